// One Verlet step (thesis 4.1, with dt in the damping).
#pragma once

#include "server/strands.h"

// p' = p + c (p - p_prev) + a dt^2 - second difference of the head's position.
//
// p is relative to the head, so the head's acceleration enters as the last term, and c damps the
// velocity relative to the head. Damping the world velocity instead makes a runner's hair stream:
// 0.77 m of lag at the tip at 3.5 m/s (notes/simulation.md 0.5). c = exp(-damping dt), so that the
// damping is the same at every rate.
void integrate_verlet(Block* block, const Substep* substep);
