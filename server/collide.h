// Keeping nodes out of the head.
#pragma once

#include "server/strands.h"

// How near a node may come to a collider's centre: the sphere's radius plus the pearl's (each node
// is a sphere, Nalu's "pearls", GPU Gems 2, 23.2.2), but never more than its distance at rest: a
// groom whose rest pose dips into the head keeps its rest pose instead of being blown off it.
float collide_clearance(Sphere collider, float pearl_radius_m, Vec3 rest);

void collide_spheres(Block* block, const Substep* substep);
