// Putting one strand's links back to their lengths: what every published tick goes through.
#pragma once

#include "server/strands.h"

// What nodes keep out of, where it is now in head space: of the axis of collider k, node n stays
// clearance[(k * nodes + n) * LANES] away, at most the collider's radius and that of a pearl.
typedef struct Obstacles {
    const Collider* colliders;
    int count;
    float pearl_radius_m;
    const real* clearance;
} Obstacles;

// `lengths` (entry n: the link n - 1 to n), moving no node that `skinned` names. Free tails are
// exact after one pass, and keep out of the obstacles: a node that its length brings inside turns
// about the node before it. Runs between two skinned nodes are reached for from both ends in turn
// (FABRIK, Aristidou and Lasenby 2011) until within 0.05 %, or as far as a bounded number of passes
// goes, whatever is in the way.
void project_lengths(Vec3* strand, int nodes, const float* lengths, const bool* skinned,
                     const Obstacles* obstacles);
