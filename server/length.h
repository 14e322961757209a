// Keeping links at their rest length inside the step. What is published is projected: project.h.
#pragma once

#include "server/strands.h"

// In lane l the link from a to b: both ends moved along it, by their shares of its error. Errors
// below RESOLVED_M are left: correcting them is correcting rounding, and the tip's spring is so
// soft (k dt^2 below 1e-3) that the pushes would add up to a drift of 0.01 mm at rest.
INLINE void length_correct_lane(Lanes3* a, Lanes3* b, const real* rest, const real* inner,
                                const real* outer, int l)
{
    real x = b->x[l] - a->x[l], y = b->y[l] - a->y[l], z = b->z[l] - a->z[l];
    real d = real_at_least(real_sqrt(x * x + y * y + z * z), LEAST_LENGTH_M);
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

static inline void length_correct_link(Block* k, int n)
{
    Lanes3 *a = &k->position[n - 1], *b = &k->position[n];
    const real *rest = k->length[n].v, *in = k->inner_part[n].v, *out = k->outer_part[n].v;
    LANE_LOOP
    for (int l = 0; l < LANES; ++l)
        length_correct_lane(a, b, rest, in, out, l);
}

// Link n of one sweep and link m of the next: they have no node in common.
static inline void length_correct_two(Block* k, int n, int m)
{
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        length_correct_lane(&k->position[n - 1], &k->position[n], k->length[n].v,
                            k->inner_part[n].v, k->outer_part[n].v, l);
        length_correct_lane(&k->position[m - 1], &k->position[m], k->length[m].v,
                            k->inner_part[m].v, k->outer_part[m].v, l);
    }
}

// Sweeps from root to tip. One leaves a hanging strand's link n longer by (N - n) g dt^2 / d of
// itself (notes/simulation.md 4.2); tip to root would leave 30 % more.
//
// Blocks run side by side, and sweeps two by two, the second two links behind the first: while one
// waits for its square root, another is worked on. Every number is the same as of one sweep after
// another.
static void length_correct(Block* blocks, int count, int sweeps)
{
    int nodes = blocks[0].nodes, sweep = 0;
    for (; sweep + 1 < sweeps && nodes > 3; sweep += 2)
        for (int n = 1; n < nodes + 2; ++n)
            for (int b = 0; b < count; ++b) {
                if (n >= 3 && n < nodes)
                    length_correct_two(&blocks[b], n, n - 2);
                else
                    length_correct_link(&blocks[b], n < nodes ? n : n - 2);
            }
    for (; sweep < sweeps; ++sweep)
        for (int n = 1; n < nodes; ++n)
            for (int b = 0; b < count; ++b)
                length_correct_link(&blocks[b], n);
}
