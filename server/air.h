// The wind: it draws every node towards its own velocity, a = drag (wind - velocity).
//
// The velocity that counts is the world's, and state is relative to the head: so the air moves past
// it at the wind's velocity less the head's. Of a node's velocity against the air a substep takes
// the share 1 - exp(-drag dt), so that a gale cannot take more than all of it, and a node that only
// the wind moves follows its closed form at every rate.
//
// Still air has no drag of its own: damping (integrate.h) stands for it.
#pragma once

#include "server/strands.h"

// Acceleration `a` of a node at `p`, `before` a substep ago, with the wind's.
INLINE Real3 air_drag(Real3 a, const Substep* substep, Real3 p, Real3 before)
{
    real rate = (real)substep->drag / (real)substep->dt2;
    a.x += rate * ((real)substep->air_move.x - (p.x - before.x));
    a.y += rate * ((real)substep->air_move.y - (p.y - before.y));
    a.z += rate * ((real)substep->air_move.z - (p.z - before.z));
    return a;
}

// Adds the wind's force on node n to the load that a link carries (model_forest.h).
//
// There a link has no inertia but its own, while it moves every node outboard: N links that turn
// together feel 4/pi^2 (N + 1/2)^2 times the drag of one (the largest eigenvalue of the sums of
// sums). What the hair's own velocity adds is bounded so that a step cannot turn it back; what the
// air adds is not, so the strand leans as far as it should.
static inline void air_load(const Block* block, const Substep* substep, int n, Lanes3* load)
{
    real reach = (real)block->nodes - (real)0.5;
    real most = (real)2.4674011 / (reach * reach), share = (real)substep->drag;
    real rate = share / (real)substep->dt2;
    real held = (share < most ? share : most) / (real)substep->dt2;
    real mx = rate * (real)substep->air_move.x, my = rate * (real)substep->air_move.y,
         mz = rate * (real)substep->air_move.z;
    const Lanes3 *p = &block->position[n], *previous = &block->previous[n];
    const real* mass = block->mass[n].v;
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        load->x[l] += mass[l] * (mx - held * (p->x[l] - previous->x[l]));
        load->y[l] += mass[l] * (my - held * (p->y[l] - previous->y[l]));
        load->z[l] += mass[l] * (mz - held * (p->z[l] - previous->z[l]));
    }
}
