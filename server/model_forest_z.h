// The forest model as printed (thesis 4.2), kept for its failures; forest is the mended one.
//
// The state is two angles a joint, theta about the z axis of the link before (its own direction)
// and phi about the link's y axis, and their rates:
//     frame[n] = frame[n-1] turn(z, theta) turn(y, phi)
// with joint springs k and dampers v about both axes, the child's reaction (4.2.3), the parent's
// acceleration taken off (4.2.5) and forward Euler (4.2.6). It fails as printed:
//   - In a straight strand z and y are both across the torque of a push along y: it is not felt at
//     all, elsewhere by the sine of phi squared (thesis 5.9). About x instead
//     it is felt there and lost where phi is 90 degrees.
//   - A joint carries the weight of its own link alone: with 7 links and Gamma = 10 the strand sags
//     to H/W 0.536, which should be 1.58 (the same lumps) or 1.07 (the elastica).
//   - Forward Euler is stable only while k dt < v and v dt < (J + k dt^2) / 2, and never without v.
//   - The frames turn rigidly with the head, and what pushes a node aside (colliders) is not known
//     to the angles: the next substep places the node anew.
// One thing is mended, or there would be nothing to see: J = m L^2 where 4.2.4 has J = m I, which
// lacks the length. The root's acceleration acts on each link (or the tip's alone) by its mass, as
// 4.2 has it, by the head's way and by its turning.
#pragma once

#include "server/frames.h"
#include "server/integrate.h"
#include "server/roots.h"

// The nearest whole number without a conversion or a call: what is added pushes the fraction out.
#ifdef SIM_DOUBLE
#define ROUNDER 6755399441055744.0
#else
#define ROUNDER 12582912.0f
#endif

static inline real round_real(real v)
{
    return (v + ROUNDER) - ROUNDER;
}

// Sine and cosine: the nearest multiple of pi is taken off in two parts, then Taylor to x^15 and
// x^16, within 1e-11 (double) or 2e-7 (float).
static inline void forest_z_sincos(real x, real* sine, real* cosine)
{
    real turns = round_real(x * (real)0.31830988618379067);
    real r = (x - turns * (real)3.140625) - turns * (real)9.676535897932385e-4;
    real s = r * r;
    real a = (real)(-1.0 / 1307674368000.0);
    a = a * s + (real)(1.0 / 6227020800.0);
    a = a * s - (real)(1.0 / 39916800.0);
    a = a * s + (real)(1.0 / 362880.0);
    a = a * s - (real)(1.0 / 5040.0);
    a = a * s + (real)(1.0 / 120.0);
    a = a * s - (real)(1.0 / 6.0);
    real b = (real)(1.0 / 20922789888000.0);
    b = b * s - (real)(1.0 / 87178291200.0);
    b = b * s + (real)(1.0 / 479001600.0);
    b = b * s - (real)(1.0 / 3628800.0);
    b = b * s + (real)(1.0 / 40320.0);
    b = b * s - (real)(1.0 / 720.0);
    b = b * s + (real)(1.0 / 24.0);
    b = b * s - (real)0.5;
    real half = turns * (real)0.5;
    real sign = 1 - 2 * real_abs(turns - 2 * round_real(half));
    *sine = sign * (r + r * s * a);
    *cosine = sign * (1 + s * b);
}

// The head's frame, along the root's rest direction.
static inline void forest_z_head(Block* block, const float rotation[9])
{
    Lanes3 *x = &block->moment[1], *y = &block->predicted[0], *z = &block->direction[0];
    roots_turn_lanes(&block->along[1], rotation, z);
    roots_turn_lanes(&block->across[1], rotation, x);
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        y->x[l] = z->y[l] * x->z[l] - z->z[l] * x->y[l];
        y->y[l] = z->z[l] * x->x[l] - z->x[l] * x->z[l];
        y->z[l] = z->x[l] * x->y[l] - z->y[l] * x->x[l];
    }
}

// The frame of link n, from the one before and the angles: x in moment[n + 1], y (also the second
// axis of joint n) in predicted[n], z in direction[n].
static inline void forest_z_frame(Block* block, int n)
{
    const Lanes3 *x = &block->moment[n], *y = &block->predicted[n - 1],
                 *z = &block->direction[n - 1];
    Lanes3 *to_x = &block->moment[n + 1], *to_y = &block->predicted[n],
           *to_z = &block->direction[n];
    const Angles *rest = &block->rest_angle[n], *angle = &block->angle[n];
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real st, ct, sp, cp;
        forest_z_sincos(rest->theta[l] + angle->theta[l], &st, &ct);
        forest_z_sincos(rest->phi[l] + angle->phi[l], &sp, &cp);
        real xx = x->x[l], xy = x->y[l], xz = x->z[l], yx = y->x[l], yy = y->y[l], yz = y->z[l];
        real zx = z->x[l], zy = z->y[l], zz = z->z[l];
        real ax = ct * xx + st * yx, ay = ct * xy + st * yy, az = ct * xz + st * yz;
        real bx = ct * yx - st * xx, by = ct * yy - st * xy, bz = ct * yz - st * xz;
        real cx = zx, cy = zy, cz = zz;
        to_x->x[l] = cp * ax - sp * cx;
        to_x->y[l] = cp * ay - sp * cy;
        to_x->z[l] = cp * az - sp * cz;
        to_y->x[l] = bx;
        to_y->y[l] = by;
        to_y->z[l] = bz;
        to_z->x[l] = sp * ax + cp * cx;
        to_z->y[l] = sp * ay + cp * cy;
        to_z->z[l] = sp * az + cp * cz;
    }
}

static void forest_z_frames(Block* block, const float rotation[9])
{
    forest_z_head(block, rotation);
    for (int n = 1; n < block->nodes; ++n)
        forest_z_frame(block, n);
}

// How fast the strand's root changes its way, by the head's way and by its turning, m/s^2.
static inline void forest_z_root(const Block* block, const Substep* substep, Lanes3* a)
{
    const Lanes3 *now = &block->reference[0], *p = &block->position[0],
                 *before = &block->previous[0];
    real hx = (real)substep->second_difference.x, hy = (real)substep->second_difference.y,
         hz = (real)substep->second_difference.z, inverse = 1 / (real)substep->dt2;
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        a->x[l] = (hx + ((now->x[l] - p->x[l]) - (p->x[l] - before->x[l]))) * inverse;
        a->y[l] = (hy + ((now->y[l] - p->y[l]) - (p->y[l] - before->y[l]))) * inverse;
        a->z[l] = (hz + ((now->z[l] - p->z[l]) - (p->z[l] - before->z[l]))) * inverse;
    }
}

// 4.2.1 and 4.2.4: the force on link n's node alone, at its end; and the joint's own moment. Sets
// acceleration[n], of turning, 1/s^2.
static inline void forest_z_force(Block* block, int n, const Lanes3* root, real share, real gravity)
{
    const Lanes3 *z = &block->direction[n], *y = &block->predicted[n],
                 *first = &block->direction[n - 1];
    const Angles *angle = &block->angle[n], *rate = &block->rate[n];
    const real *hinge = block->hinge[n].v, *friction = block->friction[n].v;
    const real *length = block->length[n].v, *mass = block->mass[n].v;
    Lanes3* to = &block->acceleration[n];
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real inverse = 1 / (length[l] > LEAST_LENGTH_M ? length[l] : LEAST_LENGTH_M);
        real by_inertia = inverse * inverse / mass[l];
        real t = by_inertia * (hinge[l] * angle->theta[l] + friction[l] * rate->theta[l]);
        real p = by_inertia * (hinge[l] * angle->phi[l] + friction[l] * rate->phi[l]);
        real fx = -share * root->x[l], fy = -share * root->y[l] - gravity, fz = -share * root->z[l];
        real zx = z->x[l], zy = z->y[l], zz = z->z[l];
        to->x[l] = inverse * (zy * fz - zz * fy) - (t * first->x[l] + p * y->x[l]);
        to->y[l] = inverse * (zz * fx - zx * fz) - (t * first->y[l] + p * y->y[l]);
        to->z[l] = inverse * (zx * fy - zy * fx) - (t * first->z[l] + p * y->z[l]);
    }
}

// The child's reaction, about the child's own axes as 4.2.3 has it: not quite those that its joint
// turns about.
static inline void forest_z_reaction(Block* block, int n)
{
    const Lanes3 *y = &block->predicted[n + 1], *first = &block->direction[n + 1];
    const Angles *angle = &block->angle[n + 1], *rate = &block->rate[n + 1];
    const real *hinge = block->hinge[n + 1].v, *friction = block->friction[n + 1].v;
    const real *length = block->length[n].v, *mass = block->mass[n].v;
    Lanes3* to = &block->acceleration[n];
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real inverse = 1 / (length[l] > LEAST_LENGTH_M ? length[l] : LEAST_LENGTH_M);
        real by_inertia = inverse * inverse / mass[l];
        real t = by_inertia * (hinge[l] * angle->theta[l] + friction[l] * rate->theta[l]);
        real p = by_inertia * (hinge[l] * angle->phi[l] + friction[l] * rate->phi[l]);
        to->x[l] += t * first->x[l] + p * y->x[l];
        to->y[l] += t * first->y[l] + p * y->y[l];
        to->z[l] += t * first->z[l] + p * y->z[l];
    }
}

static void forest_z_accelerate(Block* block, const Substep* substep)
{
    Lanes3 root;
    int tip = block->nodes - 1;
    forest_z_frames(block, substep->rotation);
    forest_z_root(block, substep, &root);
    for (int n = 1; n <= tip; ++n) {
        real share = n == tip || !substep->outermost ? 1 : 0;
        forest_z_force(block, n, &root, share, (real)substep->gravity_m_s2);
        if (n < tip) forest_z_reaction(block, n);
    }
}

// 4.2.5 and 4.2.6. A skinned joint forgets its angle, as a skinned node its place (shape.h).
static inline void forest_z_euler(Block* block, int n, real dt)
{
    const Lanes3 *a = &block->acceleration[n], *parent = &block->acceleration[n - 1];
    const Lanes3 *y = &block->predicted[n], *first = &block->direction[n - 1];
    const real* keep = block->keep[n].v;
    Angles *angle = &block->angle[n], *rate = &block->rate[n];
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real rx = a->x[l] - parent->x[l], ry = a->y[l] - parent->y[l], rz = a->z[l] - parent->z[l];
        real t = angle->theta[l] + dt * rate->theta[l], p = angle->phi[l] + dt * rate->phi[l];
        real dt_t = rate->theta[l] + dt * (first->x[l] * rx + first->y[l] * ry + first->z[l] * rz);
        real dt_p = rate->phi[l] + dt * (y->x[l] * rx + y->y[l] * ry + y->z[l] * rz);
        real k = keep[l];
        angle->theta[l] = k == 0 ? 0 : settle(k * t);
        angle->phi[l] = k == 0 ? 0 : settle(k * p);
        rate->theta[l] = k == 0 ? 0 : settle(k * dt_t);
        rate->phi[l] = k == 0 ? 0 : settle(k * dt_p);
    }
}

static void forest_z_turn(Block* block, const Substep* substep)
{
    block->acceleration[0] = (Lanes3){0}; // the head's own is not known
    for (int n = 1; n < block->nodes; ++n)
        forest_z_euler(block, n, (real)substep->dt);
    forest_z_frames(block, substep->rotation);
    frames_place(block);
}
