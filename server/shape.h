// The share of each node that is skinned to the head.
#pragma once

#include "server/strands.h"

// Moves every node towards its reference; a node of weight 0 sits on it exactly.
static void shape_blend(Block* block)
{
    for (int n = 0; n < block->skinned; ++n) {
        Lanes3* p = &block->position[n];
        const Lanes3* reference = &block->reference[n];
        const real* keep = block->keep[n].v;
        // Three ways, so that 1 leaves the node's bits alone and 0 forgets even a NaN.
        LANE_LOOP
        for (int l = 0; l < LANES; ++l) {
            real k = keep[l], rx = reference->x[l], ry = reference->y[l], rz = reference->z[l];
            real x = rx + k * (p->x[l] - rx);
            real y = ry + k * (p->y[l] - ry);
            real z = rz + k * (p->z[l] - rz);
            x = k == 0 ? rx : x;
            y = k == 0 ? ry : y;
            z = k == 0 ? rz : z;
            p->x[l] = k == 1 ? p->x[l] : x;
            p->y[l] = k == 1 ? p->y[l] : y;
            p->z[l] = k == 1 ? p->z[l] : z;
        }
    }
}
