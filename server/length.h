// Keeping links at their rest length inside the step. What is published is projected: project.h.
#pragma once

#include "server/strands.h"

// Link n: both ends moved along it, by their shares of its error. Errors below RESOLVED_M are left:
// correcting them is correcting rounding, and the tip's spring is so soft (k dt^2 below 1e-3) that
// the pushes would add up to a drift of 0.01 mm at rest.
static inline void length_correct_link(Block* block, int n)
{
    Lanes3* a = &block->position[n - 1];
    Lanes3* b = &block->position[n];
    const real* rest = block->length[n].v;
    const real* inner = block->inner_part[n].v;
    const real* outer = block->outer_part[n].v;
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real x = b->x[l] - a->x[l], y = b->y[l] - a->y[l], z = b->z[l] - a->z[l];
        real d = real_sqrt(x * x + y * y + z * z);
        d = d > LEAST_LENGTH_M ? d : LEAST_LENGTH_M;
        real error = d - rest[l];
        real excess = error / d;
        excess = real_abs(error) > RESOLVED_M ? excess : 0;
        real in = inner[l] * excess, out = outer[l] * excess;
        a->x[l] += in * x;
        a->y[l] += in * y;
        a->z[l] += in * z;
        b->x[l] -= out * x;
        b->y[l] -= out * y;
        b->z[l] -= out * z;
    }
}

// Sweeps from root to tip. One leaves a hanging strand's link n longer by (N - n) g dt^2 / d of
// itself (notes/simulation.md 4.2); tip to root would leave 30 % more.
//
// The sweeps run as a wave, each two links behind the one before it, and two blocks run side by
// side: what is in work at a time touches other nodes, so the processor does not wait for one
// link's square root to begin another's, and every number is the same as of one sweep after
// another.
static void length_correct(Block* blocks, int count, int sweeps)
{
    int nodes = blocks[0].nodes;
    for (int front = 1; front < nodes + 2 * (sweeps - 1); ++front)
        for (int sweep = 0, n = front; sweep < sweeps && n >= 1; ++sweep, n -= 2)
            for (int b = 0; b < count && n < nodes; ++b)
                length_correct_link(&blocks[b], n);
}
