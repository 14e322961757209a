// Keeping links at their rest length inside the step. What is published is projected: project.h.
#pragma once

#include "server/strands.h"

// One sweep from root to tip. It leaves a hanging strand's link n longer by (N - n) g dt^2 / d of
// itself (notes/simulation.md 4.2); tip to root would leave 30 % more. Errors below RESOLVED_M are
// left: correcting them is correcting rounding, and the tip's spring is so soft (k dt^2 below 1e-3)
// that the pushes would add up to a drift of 0.01 mm at rest.
static void length_correct(Block* block)
{
    for (int n = 1; n < block->nodes; ++n) {
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
            error = real_abs(error) > RESOLVED_M ? error : 0;
            real excess = error / d;
            real in = inner[l] * excess, out = outer[l] * excess;
            a->x[l] += in * x;
            a->y[l] += in * y;
            a->z[l] += in * z;
            b->x[l] -= out * x;
            b->y[l] -= out * y;
            b->z[l] -= out * z;
        }
    }
}
