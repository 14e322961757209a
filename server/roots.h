// Rest under the head's rotation: where every node would be if nothing moved the hair.
#pragma once

#include "server/strands.h"

// A vector of head space along world axes.
INLINE Real3 roots_turn(const float rotation[9], Real3 v)
{
    const float* m = rotation;
    return (Real3){(real)m[0] * v.x + (real)m[1] * v.y + (real)m[2] * v.z,
                   (real)m[3] * v.x + (real)m[4] * v.y + (real)m[5] * v.z,
                   (real)m[6] * v.x + (real)m[7] * v.y + (real)m[8] * v.z};
}

static inline void roots_turn_lanes(const Lanes3* from, const float rotation[9], Lanes3* to)
{
    float m[9];
    memcpy(m, rotation, sizeof m);
    LANE_LOOP
    for (int l = 0; l < LANES; ++l)
        lane_store(to, l, roots_turn(m, lane_load(from, l)));
}

// Of the nodes that are drawn to it (shape.h).
static void roots_place(Block* block, const float rotation[9])
{
    for (int n = 0; n < block->skinned; ++n)
        roots_turn_lanes(&block->rest[n], rotation, &block->reference[n]);
}
