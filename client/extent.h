// What part of a picture can hold hair or head: all else is backdrop, and is not drawn anew.
#pragma once

#include "client/hair.h"
#include "client/matrix.h"

// Pixels from the lower left.
typedef struct Extent {
    int x, y, width, height;
} Extent;

Box box_join(Box a, Box b);
// The box round a rotated box; `r` row-major.
Box box_rotate(Box box, const float r[9]);

// What holds the body and all that hair is kept out of, head space; empty (low > high) without.
Box extent_still(const Hair* hair);
// How far points of ribbons and their edges may lie from their guides, metres.
float extent_stray(const Ribbons* ribbons);

// Where `box` is in a picture; all of it where the box reaches behind the eye.
Extent extent_seen(const Mat4* view_projection, Box box, int width, int height);
