// The spring model (thesis 4.4): every node hangs on a spring to its own place at rest.
//
// The thesis shifts each reference up by m g / k, so that the spring carries the node's weight:
//     k/m (reference + up g m/k - p) - up g  =  k/m (reference - p)
// The two terms cancel in full when "up" is the world's: rest is then exact equilibrium at every
// tilt. Kept fixed to the head, as printed, the shift turns away from gravity with it: 0.78 strand
// lengths of error at 30 degrees (notes/simulation.md 0.4). So compensation is no shift here, but
// leaving both out (step.c), which is also exact in float.
//
// Hair that is tilted should not stand as it was combed. k_m = (z.z_h + 1) / 2 (k - alpha) + alpha,
// z the world's up and z_h the head's (4.4), weakens the springs to `upside_down_share` of k; as
// much of the weight is then no longer carried, which the thesis gets as a by-product of its shift.
#pragma once

#include "server/integrate.h"
#include "server/roots.h"

// acceleration = k/m (reference - position) - up gravity
INLINE Real3 spring_pull(const Block* block, const Substep* substep, int n, int l)
{
    real k = block->stiffness[n].v[l] * (real)substep->strength;
    Real3 p = lane_load(&block->position[n], l);
    Real3 reference = roots_turn(substep->rotation, lane_load(&block->rest[n], l));
    return (Real3){k * (reference.x - p.x), k * (reference.y - p.y) - (real)substep->gravity_m_s2,
                   k * (reference.z - p.z)};
}

static void spring_move(Block* block, const Substep* substep)
{
    integrate_verlet(block, substep, spring_pull);
}
