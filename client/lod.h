// How much of a style is drawn: all of it, or as few triangles as the thesis drew at three
// distances (its table of whole frames: 7,800, 2,000 and 1,250). Fewer wisps are wider ones.
#pragma once

#include "messages/hairstyle.h"

typedef enum Lod { LOD_FULL, LOD_CLOSE, LOD_MEDIUM, LOD_FAR, LODS } Lod;

extern const char* const lod_names[LODS + 1]; // NULL-terminated

// What of one set is drawn.
typedef struct LodShare {
    int strands, points; // at most the set's own
    float widen, fuller; // factors of every ribbon's width, and of how much of it is hair
} LodShare;

// All sets together stay within the level's triangles, but for one ribbon a set.
LodShare lod_share(const Hairstyle* style, const StrandSet* set, Lod lod);
