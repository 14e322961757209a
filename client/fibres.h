// Strand textures, an atlas made in code: which part of a ribbon is hair, and which hair it is. Not
// alpha but ranks, spread evenly over 0..1 (shaders/fibres.glsl says why).
#pragma once

#include "client/gl.h"

#define FIBRES_SIZE    256 // texels across 16 hairs and along
#define FIBRES_LAYERS  4   // even, waved, in locks, flying
#define FIBRES_STRANDS 16
#define FIBRES_LEVELS  5 // a hair is a texel wide on the last

// A texture array of FIBRES_LAYERS layers, RG8 (rank, hair / FIBRES_STRANDS), that tiles both ways;
// 0 with a fault out of memory.
GLuint fibres_create(const Gl* gl, Fault* fault);

// Texels of one side of a level.
int fibres_side(int level);

// One layer, and which hair each texel is of: for tests. False without memory.
bool fibres_ranks(unsigned char* ranks, unsigned char* hairs, int layer);
// The level below `above`, which has `side` texels a side: averages, ranked anew, since an average
// draws ranks to the middle and thin hair would be gone from far away.
bool fibres_halve(unsigned char* ranks, const unsigned char* above, int side);
