// Collider spheres for a head mesh: the largest spheres that fit inside, greedily, each chosen to
// add the most volume. Inside is decided by the winding number, so holes (mouth, neck, sockets) do
// not matter.
#pragma once

#include "messages/hairstyle.h"

#define FIT_SPHERES 16 // of an imported head

// Writes at most `capacity` spheres, most volume first; returns how many. Half of them go to the
// skin where the mesh has other parts too: shoulders are larger than a head, but hair lies on the
// head.
// `*covered` (may be NULL) receives the fraction of the inside that they cover.
int fit_spheres(Sphere* spheres, int capacity, const HeadMesh* mesh, float* covered);
