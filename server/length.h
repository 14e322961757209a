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
        d = real_at_least(d, LEAST_LENGTH_M);
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
// Blocks run side by side: while one waits for its square root, the other is worked on.
static void length_correct(Block* blocks, int count, int sweeps)
{
    int nodes = blocks[0].nodes;
    for (int sweep = 0; sweep < sweeps; ++sweep)
        for (int n = 1; n < nodes; ++n)
            for (int b = 0; b < count; ++b)
                length_correct_link(&blocks[b], n);
}
