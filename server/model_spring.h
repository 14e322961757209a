// The spring model (thesis 4.4): every node hangs on a spring to its own place at rest.
//
// The thesis shifts each reference up by m g / k, so that the spring carries the node's weight:
//     k/m (reference + up g m/k - p) - up g  =  k/m (reference - p)
// The two terms cancel in full when "up" is the world's: rest is then exact equilibrium at every
// tilt. Kept fixed to the head, as printed, the shift turns away from gravity with it: 0.78 strand
// lengths of error at 30 degrees (notes/simulation.md 0.4). So compensation is no shift here, but
// leaving both out (sim.c), which is also exact in float.
#pragma once

#include "server/strands.h"

// acceleration = k/m (reference - position) - up gravity
static void spring_accelerate(Block* block, const Substep* substep)
{
    real gravity = (real)substep->gravity_m_s2;
    for (int n = 0; n < block->nodes; ++n) {
        const Lanes* k = &block->stiffness[n];
        const Lanes3* p = &block->position[n];
        const Lanes3* reference = &block->reference[n];
        Lanes3* a = &block->acceleration[n];
        LANE_LOOP
        for (int l = 0; l < LANES; ++l) {
            a->x[l] = k->v[l] * (reference->x[l] - p->x[l]);
            a->y[l] = k->v[l] * (reference->y[l] - p->y[l]) - gravity;
            a->z[l] = k->v[l] * (reference->z[l] - p->z[l]);
        }
    }
}
