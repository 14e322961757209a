// The pattern of hairs on a ribbon, made in code: ranks, spread evenly over 0..1
// (shaders/fibres.glsl says why ranks and not alpha).
#pragma once

#include "client/gl.h"

#define FIBRES_SIZE    256 // texels across 16 hairs and along
#define FIBRES_LAYERS  4
#define FIBRES_LEVELS  6 // of mips, to 8 texels: fewer could not tell a fill of 2 %
#define FIBRES_STRANDS 16

// A texture array of FIBRES_LAYERS layers, R8, that tiles both ways; 0 with a fault out of memory.
GLuint fibres_create(const Gl* gl, Fault* fault);

// The same as bytes, one layer: for tests.
bool fibres_ranks(unsigned char* ranks, int layer);

// The next mip level of one layer, from `size` x `size` ranks to a quarter of them: blocks of four
// are averaged and then ranked anew, so that at every level `rank > 1 - fill` holds for `fill` of
// all texels. False out of memory.
bool fibres_halve(unsigned char* half, const unsigned char* ranks, int size);
