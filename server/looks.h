// The built-in styles as numbers: what server/groom.c grows. A new style is a new row.
#pragma once

#include "messages/hairstyle.h"

typedef struct Look {
    const char* name;
    uint32_t seed;
    float parting_x_m, parting_end_m; // where hair divides, how far back; behind that it falls
    float lift_m;                     // volume: how far hair stands off the skull (8 mm is sleek)
    float sweep;                      // front hair goes back (1) rather than to the side (0)
    float fringe;                     // how steeply front hair crosses the forehead
    float face_m;                     // how far forward hair may hang beside the face
    float gather, gather_z_m;         // how strongly hanging hair is drawn to that depth
    float hem_m;                      // height of the tips at the back
    float hem_front_m, hem_side_m;    // added to it at the front and the sides
    float hug;                        // how closely hanging hair closes in on the neck
    float curl, curl_m;               // ends turn inward (positive) over the last curl_m
    float least_m, most_m;            // shortest and longest guide
    bool is_tied;                     // all of it through a band, without a parting
    Vec3 band;                        // where that is
    float band_m;                     // its radius
    Vec3 root_colour, tip_colour;
    // Wisps.
    int wisps, points;
    float root_width_m, tip_width_m;
    float fibres;      // of a wisp, side by side
    float jitter_m;    // how far wisps stray from their guides
    float nape_length; // length at the nape, of what it is above; 0: alike, without maps
    WispForm form;
    Magnet magnet;
} Look;

typedef enum LookName {
    LOOK_LONG,
    LOOK_BOB,
    LOOK_PONYTAIL,
    LOOK_CURLY,
    LOOK_SHORT,
    LOOKS
} LookName;

extern const Look looks[LOOKS];
