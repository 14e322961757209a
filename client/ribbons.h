// What a style draws, as static tables: one entry per point of every ribbon's centre line. The
// update pass turns them into positions; the vertex shaders widen each point into the two edges of
// a triangle strip that faces the viewer (or the light).
//
// The thesis (5.5) stores both edges, each with its own weights, and takes the frame from the
// neighbour's weights; where guides cross or meet, those strips collapse or flip (its
// figure 5.4.3). A centre line with a width cannot, costs half the texels, and serves imported
// strands as well.
#pragma once

#include "client/lod.h"
#include "messages/drawn.h"

#define RIBBONS_RESTART 0xFFFFFFFFu

typedef float Texel[4];

typedef struct Ribbons {
    int ribbon_count, point_count, index_count;
    Texel* guides;     // guide a, b, c, height along them in nodes
    Texel* weights;    // of a, b, c; half width in m
    Texel* offsets;    // rest offset x, y, z; share of fibres that fill the ribbon (0..1)
    Texel* tangents;   // of the drawn curve at rest x, y, z; 0 at the root .. 1 at the tip
    Texel* normals;    // away from the head at rest x, y, z; random number of the ribbon 0..1, in
                       // quarters its strand texture
    uint32_t* indices; // triangle strips, RIBBONS_RESTART between: vertex = 2 * point + edge
    int collider_count;
    Collider colliders[HAIRSTYLE_MAX_COLLIDERS]; // the head's, which moved points are kept out of
} Ribbons;

// Grows and binds everything `style` draws. The same style gives the same bits on every client.
bool ribbons_build(Ribbons* ribbons, const Hairstyle* style, Fault* fault);
bool ribbons_build_lod(Ribbons* ribbons, const Hairstyle* style, Lod lod, Fault* fault);
void ribbons_free(Ribbons* ribbons);

// Point `i` as the double-precision reference takes it.
DrawnPoint ribbons_point(const Ribbons* ribbons, int i);
