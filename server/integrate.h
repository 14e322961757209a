// One Verlet step (thesis 4.1, with dt in the damping).
//
// p' = p + c (p - p_prev) + a dt^2 - second difference of the head's position.
//
// p is relative to the head, so the head's acceleration enters as the last term, and c damps the
// velocity relative to the head. Damping the world velocity instead makes a runner's hair stream:
// 0.77 m of lag at the tip at 3.5 m/s (notes/simulation.md 0.5). c = exp(-damping dt), so that the
// damping is the same at every rate.
#pragma once

#include "server/air.h"
#include "server/strands.h"

// A strand in a plane of symmetry decays towards zero until its numbers are denormal, and the step
// is then six times slower (measured). Flushing them by the processor's mode would have to be done
// on every thread, and not at all on other machines; this rounds what is below 1e-18 m to zero and
// leaves everything above 0.25 mm as it is.
static inline real settle(real v)
{
    return (v + SETTLED) - SETTLED;
}

// The acceleration of node n in lane l, m/s^2.
typedef Real3 Force(const Block*, const Substep*, int n, int l);

// Force, wind and step in one loop: in three, each writes down what the next one reads, and that
// takes longer than working it out (2.0 ns a node for 2.3, with four sweeps of lengths).
INLINE void integrate_nodes(Block* block, const Substep* substep, Force* force, bool windy)
{
    const Substep s = *substep; // a copy, which what is stored to nodes cannot be thought to change
    real c = (real)s.velocity_kept, dt2 = (real)s.dt2;
    real hx = (real)s.second_difference.x, hy = (real)s.second_difference.y,
         hz = (real)s.second_difference.z;
    for (int n = 0; n < block->nodes; ++n) {
        Lanes3 *position = &block->position[n], *previous = &block->previous[n];
        LANE_LOOP
        for (int l = 0; l < LANES; ++l) {
            Real3 p = lane_load(position, l), before = lane_load(previous, l);
            Real3 a = force(block, &s, n, l);
            if (windy) a = air_drag(a, &s, p, before);
            lane_store(previous, l, p);
            p.x = settle(p.x + c * (p.x - before.x) + (a.x * dt2 - hx));
            p.y = settle(p.y + c * (p.y - before.y) + (a.y * dt2 - hy));
            p.z = settle(p.z + c * (p.z - before.z) + (a.z * dt2 - hz));
            lane_store(position, l, p);
        }
    }
}

INLINE void integrate_verlet(Block* block, const Substep* substep, Force* force)
{
    if (substep->drag > 0)
        integrate_nodes(block, substep, force, true);
    else
        integrate_nodes(block, substep, force, false);
}

// What accelerate has left in the block.
INLINE Real3 integrate_stored(const Block* block, const Substep* substep, int n, int l)
{
    (void)substep;
    return lane_load(&block->acceleration[n], l);
}

static void integrate_accelerated(Block* block, const Substep* substep)
{
    integrate_verlet(block, substep, integrate_stored);
}
