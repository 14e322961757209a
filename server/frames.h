// The frame of every link, and from it where the next link would point if its joint were at rest.
//
// A link's frame is (d, u, d x u): its direction and an axis carried along. From link to link the
// axis is transported by the least rotation that takes the predicted direction a to the actual one
// d,
//     T v = (a.d) v + b x v + b (b.v) / (1 + a.d),  b = a x d     (Bergou et al. 2008,
//     section 4.2.2)
// so a strand turns without twist and keeps its rest curls. The tangent spaces as printed (thesis
// 4.3) flip at every link, are left-handed, and shrink as the strand bends
// (notes/simulation.md 4.5); this has no event but at 180 degrees, where the axis is kept as it is.
//
// Built anew from the root each time: nothing drifts.
#pragma once

#include "server/roots.h"

#define FOLDED 1e-4f // 1 + cos of an angle taken for 180 degrees

// Of link n, where nodes are or were.
static inline void frames_direction(const Lanes3* nodes, int n, Lanes3* direction)
{
    const Lanes3 *inner = &nodes[n - 1], *outer = &nodes[n];
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        Real3 link = real3_sub(lane_load(outer, l), lane_load(inner, l));
        real length = real_sqrt(real3_dot(link, link));
        real inverse = 1 / real_at_least(length, LEAST_LENGTH_M);
        lane_store(direction, l, real3_scale(link, inverse));
    }
}

// `local` of the frame (d, u, w), in world axes.
INLINE Real3 frames_apply(Real3 local, Real3 d, Real3 u, Real3 w)
{
    return (Real3){local.x * d.x + local.y * u.x + local.z * w.x,
                   local.x * d.y + local.y * u.y + local.z * w.y,
                   local.x * d.z + local.y * u.z + local.z * w.z};
}

// `u` taken along by the rotation from `a` to `d`.
INLINE Real3 frames_transport(Real3 u, Real3 a, Real3 d)
{
    Real3 b = real3_cross(a, d), bu = real3_cross(b, u);
    real c = real3_dot(a, d);
    real f = real3_dot(b, u) / real_at_least(1 + c, FOLDED);
    return (Real3){c * u.x + bu.x + b.x * f, c * u.y + bu.y + b.y * f, c * u.z + bu.z + b.z * f};
}

// The moment of a link's joint with what it passes on of `outer`, that of the next joint out.
//
// A link has no twist, so what twists it goes on to the link before, through the joint. That turns
// as a constant-velocity joint does: it lets pass any rotation but one about d + a, the axis half
// way. Left out, in a strand bent out of a plane forces are no gradient: stiff ones never come to
// rest (measured: `bob` with forest at 24,000 1/s^2, under a head that does not move).
INLINE Real3 frames_pass_twist(Real3 moment, Real3 outer, Real3 a, Real3 d)
{
    real twist = real3_dot(outer, d) / real_at_least(1 + real3_dot(a, d), FOLDED);
    return real3_mad(real3_mad(moment, d, twist), a, twist);
}

// The head is the frame before link 1: what is local to it is in head space.
static inline void frames_first(Block* block, const Substep* substep, Lanes3* second)
{
    roots_turn_lanes(&block->along[1], substep->rotation, &block->predicted[1]);
    roots_turn_lanes(&block->across[1], substep->rotation, second);
    roots_turn_lanes(&block->carried[1], substep->rotation, &block->moment[1]);
    LANE_LOOP
    for (int l = 0; l < LANES; ++l)
        lane_store(second, l,
                   frames_transport(lane_load(second, l), lane_load(&block->predicted[1], l),
                                    lane_load(&block->direction[1], l)));
}

// Link n from the link before; `second` is the frame's second axis, of that link and then of this.
static inline void frames_next(Block* block, int n, Lanes3* second)
{
    const Lanes3 *along = &block->along[n], *across = &block->across[n];
    const Lanes3* carried = &block->carried[n];
    const Lanes3 *before = &block->direction[n - 1], *direction = &block->direction[n];
    Lanes3 *predicted = &block->predicted[n], *moment = &block->moment[n];
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        Real3 d = lane_load(before, l), u = lane_load(second, l), w = real3_cross(d, u);
        Real3 a = frames_apply(lane_load(along, l), d, u, w);
        Real3 next = frames_apply(lane_load(across, l), d, u, w);
        lane_store(moment, l, frames_apply(lane_load(carried, l), d, u, w));
        lane_store(predicted, l, a);
        lane_store(second, l, frames_transport(next, a, lane_load(direction, l)));
    }
}

// Fills direction, predicted and moment of every link; of the moment the vector c whose d x c
// carries the weight at rest (sim.c).
static void frames_follow(Block* block, const Substep* substep)
{
    Lanes3 second;
    for (int n = 1; n < block->nodes; ++n)
        frames_direction(block->position, n, &block->direction[n]);
    frames_first(block, substep, &second);
    for (int n = 2; n < block->nodes; ++n)
        frames_next(block, n, &second);
}

// Puts every node where its link's direction has it, from the root's place on.
static void frames_place(Block* block)
{
    block->previous[0] = block->position[0];
    block->position[0] = block->reference[0];
    for (int n = 1; n < block->nodes; ++n) {
        const Lanes3 *inner = &block->position[n - 1], *direction = &block->direction[n];
        Lanes3 *position = &block->position[n], *previous = &block->previous[n];
        const real* length = block->length[n].v;
        LANE_LOOP
        for (int l = 0; l < LANES; ++l) {
            lane_store(previous, l, lane_load(position, l));
            lane_store(position, l,
                       real3_mad(lane_load(inner, l), lane_load(direction, l), length[l]));
        }
    }
}
