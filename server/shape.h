// The share of each node that is skinned to the head.
#pragma once

#include "server/strands.h"

// What one substep leaves of a node's distance to its reference: weight^(60 dt), so that a weight
// means the same at every rate (the share skinned in 1/60 s is 1 - weight).
float shape_keep(float weight, double dt_s);

// Moves every node towards its reference; a node of weight 0 sits on it exactly.
void shape_blend(Block* block);
