// The cascading-spaces model (thesis 4.3), corrected to an elastic one: a spring in every joint
// draws the link to where the frame of the link before would have it.
//
// As printed each spring pulls its node and nothing pushes back on the joint, so forces are not
// conservative: the strand gains energy and flutters (notes/simulation.md 0.1, 4.3). Here joint n
// has the energy V = K (1 - a.d), K = k d^2 times the mass of a node, hence the moment K sin(phi)
// on link n and its opposite on link n - 1, each as a couple of forces on the link's ends, across
// the link. For small angles that is k (y[n] - 2 y[n-1] + y[n-2]) on three nodes: the beam with EI
// = k d^3, and 2 EI / d^3 at the clamped root. The moment is largest at 90 degrees: beyond it the
// joint folds.
#pragma once

#include "server/frames.h"

// What one link has of the next one out, past the tip nothing.
typedef struct CascadeOutboard {
    Lanes3 moment, force;
} CascadeOutboard;

// On link n act the moment of joint n, K (d x a) and the d x c that carries the weight at rest, and
// against it that of joint n + 1: together a couple of forces, moment x d / length at the outer end
// and the opposite at the inner one. Node n has one end of link n and one of link n + 1.
static inline void cascade_link(Block* block, int n, real gravity, CascadeOutboard* outboard)
{
    const Lanes3 *direction = &block->direction[n], *predicted = &block->predicted[n];
    const Lanes3* carried = &block->moment[n];
    const real *hinge = block->hinge[n].v, *per_length = block->per_length[n].v;
    const real* per_mass = block->per_mass[n].v;
    Lanes3* acceleration = &block->acceleration[n];
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        Real3 d = lane_load(direction, l), a = lane_load(predicted, l);
        Real3 outer = lane_load(&outboard->moment, l);
        Real3 moment = real3_cross(d, real3_mad(lane_load(carried, l), a, hinge[l]));
        moment = frames_pass_twist(moment, outer, a, d);
        Real3 turning = real3_sub(moment, outer);
        Real3 force = real3_scale(real3_cross(turning, d), per_length[l]);
        Real3 sum = real3_sub(force, lane_load(&outboard->force, l));
        sum = real3_scale(sum, per_mass[l]);
        sum.y -= gravity;
        lane_store(acceleration, l, sum);
        lane_store(&outboard->moment, l, moment);
        lane_store(&outboard->force, l, force);
    }
}

static void cascade_accelerate(Block* block, const Substep* substep)
{
    CascadeOutboard outboard = {0};
    frames_follow(block, substep);
    for (int n = block->nodes - 1; n >= 1; --n)
        cascade_link(block, n, (real)substep->gravity_m_s2, &outboard);
}
