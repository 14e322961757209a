// Where a drawn strand point is, in double: the reference for the client's update pass, and the
// formula that the binder inverts to make rest offsets. One definition, so that offset and picture
// cannot drift apart; shaders/ computes the same in float from the same 16-bit numbers.
//
// With f the fraction and k the whole part of `height`, over the three guides i:
//   P  = sum w_i hermite(position_i[k], position_i[k + 1], tangent_i[k], tangent_i[k + 1], f)
//   T  = normalise(sum w_i lerp(tangent_i[k], tangent_i[k + 1], f)),  T0 likewise from rest
//   tangents R  = least rotation that takes T0 to T: v' = v + b x v + b x (b x v) / (1 + c),
//        b = T0 x T, c = T0 . T   (Rodrigues' formula with sin and cos replaced by b and c)
//   drawn point = P + R offset
// hermite is the cubic through both nodes along both node tangents, each as long as the chord.
// Straight lines between nodes (what the thesis reads from its textures) show as corners as soon as
// a guide of eight nodes bends; the tangents are in the textures anyway, so the cubic costs no
// fetch. Where T or T0 has no direction, or they are opposed (c < DRAWN_OPPOSED), the least
// rotation is not defined and the offset stays unturned. Node 0 counts with its rest tangent in T
// too: roots are fixed to the head, and what hangs on them must not turn with the first link. A
// full frame per guide node would carry twist as well; it lost because the simulation has none and
// it needs another texture.
#pragma once

#include "messages/hairstyle.h"

#define DRAWN_OPPOSED        (-0.9999)
#define DRAWN_ON_AXIS_M      1e-6
#define DRAWN_MIN_TANGENT_SQ 1e-12 // of the blended tangent before it is normalised

typedef struct DrawnPoint {
    uint16_t guide[3]; // rows of the guide table
    float weight[3];
    float height; // 0 .. nodes - 1, in nodes
    Vec3 offset;  // at rest, head space axes, metres
} DrawnPoint;

// `positions`, `tangents` and `rest_tangents` are whole planes [guide][nodes]. `*tangent` (may be
// NULL) receives T, or (0, -1, 0) where there is none.
Vec3d drawn_position(const DrawnPoint* point, int nodes, const Vec3* positions,
                     const Vec3* tangents, const Vec3* rest_tangents, Vec3d* tangent);

// From the axis of a capsule.
double drawn_axis_distance(Vec3d at, const Collider* collider);

// What the update pass does to every point last: out of the capsules, one after the other, since
// wisps between guides may be carried into a head that the guides go round. By what lacks to the
// radius, but no further than the point is from the axis, so that all is continuous: what is half
// as deep as it could be comes out, what is on the axis stays.
Vec3d drawn_push_out(Vec3d at, const Collider* colliders, int count);

// Point `point` of the set's strand `strand` (both counted from 0 within the set; explicit sets
// only) as its integers decode.
void drawn_from_bound(DrawnPoint* out, const Hairstyle* style, const StrandSet* set, int strand,
                      int point);
