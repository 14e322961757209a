// Keeping links at their rest length: a sweep inside the step, a projection of what is published.
#pragma once

#include "server/strands.h"

// How a link's error is shared between its ends (thesis 4.2 with the sign that pulls a stretched
// link together): all at the free end where the other is skinned, half and half between free nodes,
// none between skinned ones.
void length_shares(float* inner, float* outer, bool inner_skinned, bool outer_skinned);

// One sweep from root to tip. It leaves a hanging strand's link n longer by (N - n) g dt^2 / d of
// itself (notes/simulation.md 4.2); tip to root would leave 30 % more.
void length_correct(Block* block);

// Puts one strand's links back to `lengths` (entry n: the link n - 1 to n), moving no node that
// `skinned` names. Free tails are exact after one pass; runs between two skinned nodes are reached
// for from both ends in turn (FABRIK, Aristidou and Lasenby 2011) until within 0.05 %, or as far as
// a bounded number of passes goes.
void length_project(Vec3* strand, int nodes, const float* lengths, const bool* skinned);
