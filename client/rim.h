// Where scalp triangles end: the hairline and the parting. Hair is finer and sparser there.
#pragma once

#include "messages/hairstyle.h"

// An edge that no other triangle of the set shares, and where roots are seen.
typedef struct RimEdge {
    int triangle, opposite; // of the set; the corner (0..2) across from the edge
    float until_m;          // length of all such up to its end
    bool is_parting;        // another rim runs beside it
} RimEdge;

typedef struct Rim {
    int edge_count;
    RimEdge* edges;
    bool on_rim[HAIRSTYLE_MAX_GUIDES];     // guides rooted there
    bool parts[HAIRSTYLE_MAX_GUIDES];      // of these, with another one close by
    uint8_t open[HAIRSTYLE_MAX_TRIANGLES]; // of the set's triangles: bit i, the edge across from i,
                                           // whether roots are seen there or not
} Rim;

// Where a wisp is rooted. The nearest rim is at root + outward * inside_m.
typedef struct Rooting {
    const ScalpTriangle* triangle;
    Vec3 weight;     // of its corners
    Vec3 outward;    // unit, in the triangle's plane, to the rim; zero where it has none
    float inside_m;  // how far the rim is
    bool at_parting; // that rim is a parting's
} Rooting;

// The set's rim; false without memory. Free it with rim_free.
bool rim_find(Rim* rim, const Hairstyle* style, const StrandSet* set);
void rim_free(Rim* rim);

// The root at `weight` of the set's triangle `triangle`. Only the triangle's own edges and corners
// are looked at: beyond them the rim is a triangle away.
Rooting rim_rooting(const Rim* rim, const Hairstyle* style, const StrandSet* set, int triangle,
                    Vec3 weight);

// The root at `along` (0..1) of all `edges`, of which there must be one, and `inside_m` from there.
Rooting rim_place(const Rim* rim, const Hairstyle* style, const StrandSet* set, float along,
                  float inside_m);
