// Putting one strand's links back to their lengths: what every published tick goes through.
#pragma once

#include "messages/vec.h"

// `lengths` (entry n: the link n - 1 to n), moving no node that `skinned` names. Free tails are
// exact after one pass; runs between two skinned nodes are reached for from both ends in turn
// (FABRIK, Aristidou and Lasenby 2011) until within 0.05 %, or as far as a bounded number of passes
// goes.
void project_lengths(Vec3* strand, int nodes, const float* lengths, const bool* skinned);
