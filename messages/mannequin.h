// A smooth, neutral human head with neck and shoulders, made in code: what built-in styles grow on
// and clients draw. It lives here because daemon and clients must agree on it bit for bit: no libm
// but sqrt, fabs, floor.
//
// The surface is the zero of a smooth union of ellipsoids and capsules, in metres, head space: chin
// near y = 0.105, crown near y = 0.325, face towards +Z, neck going down, origin at the pivot of
// the neck. MANNEQUIN_CENTRE is half-way between chin and crown.
#pragma once

#include "messages/hairstyle.h"

#define MANNEQUIN_CENTRE ((Vec3){0.0f, 0.216f, 0.0f})

// Signed distance (a bound near the surface), metres, negative inside; and its unit gradient.
float mannequin_distance(Vec3 point);
Vec3 mannequin_normal(Vec3 point);

// `point` moved along the gradient onto the surface (+ `lift_m` outside it).
Vec3 mannequin_project(Vec3 point, float lift_m);

// How much of the skin at `surface` grows hair: 1 on the scalp, 0 on face, ears and neck, smooth
// over the hairline.
float mannequin_scalp(Vec3 surface);

// Spheres inside the head, neck and shoulders for collision, the last of them the torso's; returns
// how many (<= capacity).
int mannequin_colliders(Collider* colliders, int capacity);

// Triangulates the surface; positions on the surface, normals its gradient. At `spacing` 1 there
// are about 19,000 vertices, close over eyes, lips and ears; at more they lie so many times as far
// apart, but on the bust.
bool mannequin_mesh(HeadMesh* mesh, float spacing, Vec3 skin_colour, Fault* fault);
