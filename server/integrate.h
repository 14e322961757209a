// One Verlet step (thesis 4.1, with dt in the damping).
//
// p' = p + c (p - p_prev) + a dt^2 - second difference of the head's position.
//
// p is relative to the head, so the head's acceleration enters as the last term, and c damps the
// velocity relative to the head. Damping the world velocity instead makes a runner's hair stream:
// 0.77 m of lag at the tip at 3.5 m/s (notes/simulation.md 0.5). c = exp(-damping dt), so that the
// damping is the same at every rate.
#pragma once

#include "server/strands.h"

// A strand in a plane of symmetry decays towards zero until its numbers are denormal, and the step
// is then six times slower (measured). Flushing them by the processor's mode would have to be done
// on every thread, and not at all on other machines; this rounds what is below 1e-18 m to zero and
// leaves everything above 0.25 mm as it is.
static inline real settle(real v)
{
    return (v + SETTLED) - SETTLED;
}

static void integrate_verlet(Block* block, const Substep* substep)
{
    real c = (real)substep->velocity_kept, dt2 = (real)substep->dt2;
    real hx = (real)substep->second_difference.x, hy = (real)substep->second_difference.y,
         hz = (real)substep->second_difference.z;
    for (int n = 0; n < block->nodes; ++n) {
        Lanes3* p = &block->position[n];
        Lanes3* previous = &block->previous[n];
        const Lanes3* a = &block->acceleration[n];
        LANE_LOOP
        for (int l = 0; l < LANES; ++l) {
            real x = p->x[l], y = p->y[l], z = p->z[l];
            p->x[l] = settle(x + c * (x - previous->x[l]) + (a->x[l] * dt2 - hx));
            p->y[l] = settle(y + c * (y - previous->y[l]) + (a->y[l] * dt2 - hy));
            p->z[l] = settle(z + c * (z - previous->z[l]) + (a->z[l] * dt2 - hz));
            previous->x[l] = x;
            previous->y[l] = y;
            previous->z[l] = z;
        }
    }
}
