// The spring model (thesis 4.4): every node hangs on a spring to its own place at rest.
#pragma once

#include "server/strands.h"

// k/m, 1/s^2, of a node `from_root_m` along the strand at rest: k / max(1, c L)^a. Thesis 5.9
// prints k / (L c)^a, which is infinite at the root and exceeds k wherever L c < 1. By length, not
// by node number: counted in nodes, a fringe of 4 cm is as limp as a plait.
float spring_stiffness(const SimDefinition* definition, float from_root_m);

// What of gravity a node feels.
//
// The thesis shifts each reference up by m g / k, so that the spring carries the node's weight:
//     k/m (reference + up g m/k - p) - up g  =  k/m (reference - p)
// The two terms cancel in full when "up" is the world's: rest is then exact equilibrium at every
// tilt. Kept fixed to the head, as printed, the shift turns away from gravity with it: 0.78 strand
// lengths of error at 30 degrees (notes/simulation.md 0.4). So compensation is no shift here, but
// leaving both out, which is also exact in float.
float spring_gravity(const SimDefinition* definition);

// acceleration = k/m (reference - position) - up gravity
void spring_accelerate(Block* block, const Substep* substep);
