// The forest model (thesis 4.2, 5.9): every link is a branch that turns; positions follow from
// directions, so no length is ever wrong.
//
// Joint n has the moment K phi, K = k d^2 times the mass of a node, that turns link n to where the
// frame of the link before would have it, and link n - 1 the other way; the load of everything
// outboard acts at a link's end (torque = L d x F; its own node's weight alone, as printed, sags by
// half, notes/simulation.md 0.2). J = m L^2.
//
// Not angles about two axes: those lock where an axis meets the strand (forest-z, printed, in a
// straight one; about the x axis at 90 degrees), for the same price. The state is the direction
// itself, and Verlet runs on the sphere: the last step's arc goes on, shortened by the damping,
// plus the angular acceleration. In a plane that is Verlet in the angle, to the bit of rounding.
// What it lacks: a link does not feel the inertia of those outboard of it.
#pragma once

#include "server/air.h"
#include "server/frames.h"

#define LEAST_HALF   1e-3f // cos of half the angle of a joint that counts as folded
#define LONGEST_ARC2 0.81f // squared sine of the most that a link turns in a substep

// phi / sin(phi) for c = cos(phi): from q = tan(phi / 4), phi = 4 atan(q). The polynomial is
// Chebyshev's of degree 8 in q^2 on 0..1: within 2e-8.
static inline real forest_arc(real c)
{
    real h2 = (1 + c) * (real)0.5;
    real h = real_sqrt(h2 > 0 ? h2 : 0);
    h = h > LEAST_HALF ? h : LEAST_HALF;
    real s = (1 - h) / (1 + h);
    s = s > 0 ? s : 0;
    real p = (real)0.0027662835283182277;
    p = p * s - (real)0.015731249223588546;
    p = p * s + (real)0.04213762374570251;
    p = p * s - (real)0.07456854838521723;
    p = p * s + (real)0.10618370642479312;
    p = p * s - (real)0.1419779779540799;
    p = p * s + (real)0.1999187202926431;
    p = p * s - (real)0.3333303670929285;
    p = p * s + (real)0.9999999817886558;
    return 2 * p / (h * (1 + h));
}

// Adds K phi about d x a to the moments of the joints.
static void forest_joints(Block* block)
{
    Lanes3* moment = block->moment;
    for (int n = 1; n < block->nodes; ++n) {
        const Lanes3 *d = &block->direction[n], *a = &block->predicted[n];
        const real* hinge = block->hinge[n].v;
        LANE_LOOP
        for (int l = 0; l < LANES; ++l) {
            real dx = d->x[l], dy = d->y[l], dz = d->z[l], ax = a->x[l], ay = a->y[l], az = a->z[l];
            real k = hinge[l] * forest_arc(ax * dx + ay * dy + az * dz);
            moment[n].x[l] += k * (dy * az - dz * ay);
            moment[n].y[l] += k * (dz * ax - dx * az);
            moment[n].z[l] += k * (dx * ay - dy * ax);
        }
    }
}

// direction'' = (moment / (m L^2)) x d, tip first: `load` gathers the forces outboard. The last
// link passes nothing in.
static void forest_turn(Block* block, const Substep* substep)
{
    const Lanes3* moment = block->moment;
    real dt2 = (real)substep->dt2, gravity = (real)substep->gravity_m_s2;
    real hx = -(real)substep->second_difference.x / dt2;
    real hy = -(real)substep->second_difference.y / dt2;
    real hz = -(real)substep->second_difference.z / dt2;
    Lanes3 load = {0};
    for (int n = block->nodes - 1; n >= 1; --n) {
        const Lanes3 *d = &block->direction[n], *m = &moment[n], *next = &moment[n + 1];
        const real *mass = block->mass[n].v, *length = block->length[n].v;
        Lanes3* out = &block->acceleration[n];
        bool is_tip = n == block->nodes - 1;
        real share = is_tip || !substep->outermost ? 1 : 0;
        if (substep->drag > 0) air_load(block, substep, n, &load);
        LANE_LOOP
        for (int l = 0; l < LANES; ++l) {
            real dx = d->x[l], dy = d->y[l], dz = d->z[l];
            real inverse = 1 / (length[l] > LEAST_LENGTH_M ? length[l] : LEAST_LENGTH_M);
            real fx = load.x[l] + mass[l] * share * hx;
            real fy = load.y[l] + mass[l] * (share * hy - gravity);
            real fz = load.z[l] + mass[l] * share * hz;
            load.x[l] = fx;
            load.y[l] = fy;
            load.z[l] = fz;
            real tx = (m->x[l] - next->x[l]) * inverse + (dy * fz - dz * fy);
            real ty = (m->y[l] - next->y[l]) * inverse + (dz * fx - dx * fz);
            real tz = (m->z[l] - next->z[l]) * inverse + (dx * fy - dy * fx);
            out->x[l] = inverse * (ty * dz - tz * dy);
            out->y[l] = inverse * (tz * dx - tx * dz);
            out->z[l] = inverse * (tx * dy - ty * dx);
        }
    }
}

static void forest_accelerate(Block* block, const Substep* substep)
{
    frames_follow(block, substep);
    forest_joints(block);
    forest_turn(block, substep);
}

// Verlet on the sphere, from the root outwards. With e the direction a substep ago, u = (d.e) d - e
// is the arc's chord across d, and d' = q + sqrt(1 - q.q) d with q = c u + dt^2 d''.
static void forest_swing(Block* block, const Substep* substep)
{
    real c = (real)substep->velocity_kept, dt2 = (real)substep->dt2;
    Lanes3 was = block->previous[0]; // of node n - 1, a substep before
    block->previous[0] = block->position[0];
    block->position[0] = block->reference[0];
    for (int n = 1; n < block->nodes; ++n) {
        const Lanes3 *d = &block->direction[n], *a = &block->acceleration[n];
        const Lanes3* inner = &block->position[n - 1];
        Lanes3 *p = &block->position[n], *previous = &block->previous[n];
        const real* length = block->length[n].v;
        LANE_LOOP
        for (int l = 0; l < LANES; ++l) {
            real dx = d->x[l], dy = d->y[l], dz = d->z[l];
            real ex = previous->x[l] - was.x[l], ey = previous->y[l] - was.y[l],
                 ez = previous->z[l] - was.z[l];
            real e2 = real_sqrt(ex * ex + ey * ey + ez * ez);
            real inverse = 1 / (e2 > LEAST_LENGTH_M ? e2 : LEAST_LENGTH_M);
            ex *= inverse;
            ey *= inverse;
            ez *= inverse;
            real cosine = dx * ex + dy * ey + dz * ez;
            real qx = c * (cosine * dx - ex) + dt2 * a->x[l];
            real qy = c * (cosine * dy - ey) + dt2 * a->y[l];
            real qz = c * (cosine * dz - ez) + dt2 * a->z[l];
            real q2 = qx * qx + qy * qy + qz * qz;
            real most = real_sqrt(LONGEST_ARC2 / (q2 > LONGEST_ARC2 ? q2 : LONGEST_ARC2));
            qx = settle(qx * most);
            qy = settle(qy * most);
            qz = settle(qz * most);
            real along = real_sqrt(1 - most * most * q2);
            was.x[l] = previous->x[l];
            was.y[l] = previous->y[l];
            was.z[l] = previous->z[l];
            previous->x[l] = p->x[l];
            previous->y[l] = p->y[l];
            previous->z[l] = p->z[l];
            p->x[l] = inner->x[l] + length[l] * (qx + along * dx);
            p->y[l] = inner->y[l] + length[l] * (qy + along * dy);
            p->z[l] = inner->z[l] + length[l] * (qz + along * dz);
        }
    }
}
