// Rest under the head's rotation: where every node would be if nothing moved the hair.
#pragma once

#include "server/strands.h"

static void roots_place(Block* block, const float rotation[9])
{
    real m[9];
    for (int i = 0; i < 9; ++i)
        m[i] = (real)rotation[i];
    for (int n = 0; n < block->nodes; ++n) {
        const Lanes3* from = &block->rest[n];
        Lanes3* to = &block->reference[n];
        LANE_LOOP
        for (int l = 0; l < LANES; ++l) {
            to->x[l] = m[0] * from->x[l] + m[1] * from->y[l] + m[2] * from->z[l];
            to->y[l] = m[3] * from->x[l] + m[4] * from->y[l] + m[5] * from->z[l];
            to->z[l] = m[6] * from->x[l] + m[7] * from->y[l] + m[8] * from->z[l];
        }
    }
}
