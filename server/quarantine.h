// Strands that are lost: not finite, or further from the head than any strand is long. They go back
// to rest, each for itself: no lane reads another, so the rest of the block goes on bit for bit.
//
// Nothing should lose a strand; a stiffness taken by force, a head that flies off and a fault of
// the machine do, and NaN never heals: every later tick of the strand would be one.
#pragma once

#include "server/roots.h"

static inline void quarantine_measure(const Lanes3* p, real* squares)
{
    LANE_LOOP
    for (int l = 0; l < LANES; ++l)
        squares[l] += p->x[l] * p->x[l] + p->y[l] * p->y[l] + p->z[l] * p->z[l];
}

static inline bool is_within(const Lanes3* p, int l)
{
    return p->x[l] * p->x[l] + p->y[l] * p->y[l] + p->z[l] * p->z[l] <= LOST_M * LOST_M;
}

static inline bool is_lost(const Block* block, int l)
{
    for (int n = 0; n < block->nodes; ++n)
        if (!is_within(&block->position[n], l)) return true;
    return false;
}

static inline void rest_lane(Block* block, const float rotation[9], int l)
{
    for (int n = 0; n < block->nodes; ++n) {
        Real3 rest = roots_turn(rotation, lane_load(&block->rest[n], l));
        lane_store(&block->position[n], l, rest);
        lane_store(&block->previous[n], l, rest);
        block->angle[n].theta[l] = block->angle[n].phi[l] = 0;
        block->rate[n].theta[l] = block->rate[n].phi[l] = 0;
    }
}

// At the end of a tick, and of strands that are tied to others of every substep, before an infinite
// one can pull on its neighbours; under the head's rotation then. The sum over a strand's nodes
// asks for all of them at once. The positions of a substep ago need no look: what is wrong with
// them is wrong with these by now.
static void quarantine_lost(Block* block, const float rotation[9])
{
    real squares[LANES] = {0};
    for (int n = 0; n < block->nodes; ++n)
        quarantine_measure(&block->position[n], squares);
    for (int l = 0; l < LANES; ++l) {
        if (squares[l] <= LOST_M * LOST_M || !is_lost(block, l)) continue;
        rest_lane(block, rotation, l);
        block->quarantined += l < block->strands; // lanes beyond repeat the last strand
    }
}
