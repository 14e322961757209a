// Guide nodes to 16-bit texels and back: the only place that knows how.
//
// Positions: three UNORM16 in the style's box, rounded to nearest: |error| <= half a step per axis,
// so at most sqrt(3)/2 = 0.87 x longest edge / 65535 in all (0.0132 mm per metre of edge).
// Tangents: three SNORM16 (n / 32767), renormalised after decoding: at most 0.0015 degrees
// (tables/quant.csv, "xyz snorm16 renorm"). Exactly what RGBA16 and RGBA16_SNORM textures decode.
#pragma once

#include "messages/vec.h"

#include <stddef.h>
#include <stdint.h>

// Largest distance between a position inside `box` and its decoded value, in metres.
float quantise_error_bound_m(const Box* box);

// `position` to `texel`; outside values are clamped. Returns how many of the three axes were
// clamped, or 3 with the box's middle for a position that is not finite (texels cannot carry NaN).
int quantise_position(uint16_t texel[3], Vec3 position, const Box* box);
Vec3 dequantise_position(const uint16_t texel[3], const Box* box);

// `tangent` need not be unit; a zero or non-finite one becomes (0, -1, 0), straight down.
void quantise_tangent(int16_t texel[3], Vec3 tangent);
// Unit length.
Vec3 dequantise_tangent(const int16_t texel[3]);

// Node tangents of one strand of `nodes` >= 2 positions (design 2): normalised x(i+1) - x(i-1),
// one-sided at the ends, repeated from the previous node where degenerate.
void quantise_strand_tangents(Vec3* tangents, const Vec3* positions, int nodes);
