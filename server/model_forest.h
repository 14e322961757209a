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
#include "server/integrate.h"

#define LEAST_HALF 1e-3f // cos of half the angle of a joint that counts as folded

// phi / sin(phi) for c = cos(phi): from q = tan(phi / 4), phi = 4 atan(q). The polynomial is
// Chebyshev's of degree 8 in s = q^2 on 0..1, within 2e-8; its odd and even powers apart, because a
// sum waits for the one before.
static inline real forest_arc(real c)
{
    real h = real_at_least(real_sqrt(real_at_least((1 + c) * (real)0.5, 0)), LEAST_HALF);
    real inverse = 1 / (h * (1 + h)), s = real_at_least((1 - h) * h * inverse, 0), s2 = s * s;
    real even = (real)0.0027662835283182277, odd = (real)-0.015731249223588546;
    even = even * s2 + (real)0.04213762374570251;
    odd = odd * s2 - (real)0.07456854838521723;
    even = even * s2 + (real)0.10618370642479312;
    odd = odd * s2 - (real)0.1419779779540799;
    even = even * s2 + (real)0.1999187202926431;
    odd = odd * s2 - (real)0.3333303670929285;
    even = even * s2 + (real)0.9999999817886558;
    return 2 * (even + odd * s) * inverse;
}

// To the moment of joint n, K phi about d x a and what carries the weight at rest, from what
// frames.h left there. A loop of its own: with the next one it would be too long for the processor
// to begin the next lanes while it waits for this root and division.
static inline void forest_joint(Block* block, int n)
{
    const Lanes3 *direction = &block->direction[n], *predicted = &block->predicted[n];
    const real* hinge = block->hinge[n].v;
    Lanes3* moment = &block->moment[n];
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        Real3 d = lane_load(direction, l), a = lane_load(predicted, l);
        real k = hinge[l] * forest_arc(real3_dot(a, d));
        Real3 turning = real3_cross(d, real3_mad(lane_load(moment, l), a, k));
        lane_store(moment, l, frames_pass_twist(turning, lane_load(moment + 1, l), a, d));
    }
}

// direction'' of link n = (moment / (m L^2)) x d. The moment is its joint's less the next one's,
// which is zero past the tip, and that of the load at its end: `load` gathers the forces outboard.
// `push` is what acts on every mass.
static inline void forest_turn(Block* block, int n, Real3 push, Lanes3* load)
{
    const Lanes3 *direction = &block->direction[n], *moment = &block->moment[n],
                 *next = &block->moment[n + 1];
    const real *mass = block->mass[n].v, *per_length = block->per_length[n].v;
    Lanes3* acceleration = &block->acceleration[n];
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        Real3 d = lane_load(direction, l);
        Real3 force = real3_mad(lane_load(load, l), push, mass[l]);
        Real3 turning = real3_sub(lane_load(moment, l), lane_load(next, l));
        turning = real3_mad(real3_cross(d, force), turning, per_length[l]);
        lane_store(acceleration, l, real3_scale(real3_cross(turning, d), per_length[l]));
        lane_store(load, l, force);
    }
}

static void forest_accelerate(Block* block, const Substep* substep)
{
    Lanes3 load = {0};
    real dt2 = (real)substep->dt2, gravity = (real)substep->gravity_m_s2;
    frames_follow(block, substep);
    for (int n = block->nodes - 1; n >= 1; --n)
        forest_joint(block, n);
    for (int n = block->nodes - 1; n >= 1; --n) {
        real share = n == block->nodes - 1 || !substep->outermost ? 1 : 0;
        Real3 push = {-share * (real)substep->second_difference.x / dt2,
                      -share * (real)substep->second_difference.y / dt2 - gravity,
                      -share * (real)substep->second_difference.z / dt2};
        if (substep->drag > 0) air_load(block, substep, n, &load);
        forest_turn(block, n, push, &load);
    }
}

// Verlet on the sphere. With e the direction a substep ago, (d.e) d - e is the sine of the last
// arc, across d; times 2 / (1 + d.e) it is 2 tan of half of it, which the damping and the force
// change. An arc is got back from that without a root, and none is too long.
static inline void forest_swing_link(Block* block, int n, real c, real dt2)
{
    const Lanes3* before = &block->predicted[n];
    const Lanes3* acceleration = &block->acceleration[n];
    Lanes3* direction = &block->direction[n];
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        Real3 d = lane_load(direction, l), e = lane_load(before, l);
        real cosine = real3_dot(d, e);
        real kept = 2 * c / real_at_least(1 + cosine, FOLDED);
        Real3 q = real3_scale(real3_sub(real3_scale(d, cosine), e), kept);
        q = real3_mad(q, lane_load(acceleration, l), dt2);
        q = (Real3){settle(q.x), settle(q.y), settle(q.z)};
        real tan2 = (real)0.25 * real3_dot(q, q), inverse = 1 / (1 + tan2);
        lane_store(direction, l, real3_mad(real3_scale(q, inverse), d, (1 - tan2) * inverse));
    }
}

static void forest_swing(Block* block, const Substep* substep)
{
    for (int n = 1; n < block->nodes; ++n)
        frames_direction(block->previous, n, &block->predicted[n]);
    for (int n = 1; n < block->nodes; ++n)
        forest_swing_link(block, n, (real)substep->velocity_kept, (real)substep->dt2);
    frames_place(block);
}
