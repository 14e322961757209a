// The plain chain (Nguyen and Donnelly 2005, 23.2: Nalu): Verlet and lengths, no shape to return
// to. What it hangs in is gravity alone, so that is never compensated.
#pragma once

#include "server/strands.h"

static void plain_accelerate(Block* block, const Substep* substep)
{
    real gravity = (real)substep->gravity_m_s2;
    for (int n = 0; n < block->nodes; ++n) {
        Lanes3* a = &block->acceleration[n];
        LANE_LOOP
        for (int l = 0; l < LANES; ++l) {
            a->x[l] = 0;
            a->y[l] = -gravity;
            a->z[l] = 0;
        }
    }
}
