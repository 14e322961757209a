// One wisp: its centre line at rest, from the guides at its root, the form of its set and what the
// scalp's maps say there.
#pragma once

#include "client/rim.h"
#include "messages/drawn.h"

#define WISP_RIM_M 0.007f // so far inside the scalp's end hair is thin where it begins

// The style and its guides' tangents at rest.
typedef struct Rest {
    const Hairstyle* style;
    const Vec3* tangents; // [guide][node]
} Rest;

// One ribbon at rest: its centre line, how wide it is and what share of it is hair.
typedef struct Strip {
    int points;
    DrawnPoint point[HAIRSTYLE_MAX_POINTS]; // what carries it
    Vec3 at[HAIRSTYLE_MAX_POINTS];
    float along[HAIRSTYLE_MAX_POINTS]; // 0 root to 1 tip
    float width_m[HAIRSTYLE_MAX_POINTS], fill[HAIRSTYLE_MAX_POINTS];
    int texture; // of the strand textures
} Strip;

// A wisp to be grown.
typedef struct Wisp {
    uint32_t id;
    Rooting rooting;
    float reach; // share of its guides' length
    float length_m;
    float shift_m; // from its place in the triangle to its root, along rooting.outward
    bool is_short; // a few hairs of a few centimetres
} Wisp;

// What wisps of one set have in common. Fewer wisps are wider and fuller ones (client/lod.h).
typedef struct WispKind {
    const StrandSet* set;
    const WispForm* form;
    int points;
    float widen, fuller;
} WispKind;

// Diameter of one drawn hair.
float wisp_fibre_width_m(float along);
// Width of the skin's lock at `along`, as a share: thin where it leaves the skin.
float wisp_leave(float along);

// Where `point` is at rest; its guides' direction there in `tangent`, which may be NULL.
Vec3 wisp_rest_place(const Rest* rest, const DrawnPoint* point, Vec3* tangent);

// A wisp as long as its guides, nearly: ends are not cut with a ruler.
Wisp wisp_long(const Hairstyle* style, uint32_t id, Rooting rooting);
// Shortened to `length_m`, if it is longer.
void wisp_cut(Wisp* wisp, float length_m, bool is_short);

void wisp_grow(Strip* strip, const Rest* rest, const WispKind* kind, const Wisp* wisp);
