// FLIP (Andersson et al., 2020, "FLIP: A Difference Evaluator for Alternating Images"): how
// different two pictures look to somebody who flips between them, 0 (not at all) to 1 a pixel.
// Written from the paper; the maps of one picture against another and the other way round are the
// same.
#pragma once

#include "client/image.h"

// Pixels in a degree of the viewer's eye: 0.7 m from a screen 0.7 m wide with 3,840 pixels.
#define FLIP_PIXELS_PER_DEGREE 67.02f

// Larger pictures would want gigabytes of planes.
#define FLIP_MAX_PIXELS ((int64_t)1 << 24)

// Writes width * height values, top row first. Alpha is not looked at. False with a fault where the
// sizes differ, are too large, or memory is short.
bool flip_map(float* map, const Image* a, const Image* b, float pixels_per_degree, Fault* fault);

// The largest difference of two colours there is, between pure green and pure blue; what the paper
// calls c_max. It says 41.2760 or so.
float flip_largest_difference(void);
