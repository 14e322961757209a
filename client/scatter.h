// Where wisps are rooted: spread over scalp triangles by area and density map, inside a triangle by
// relaxed dart throwing (thesis 5.4) or along a sequence.
#pragma once

#include "messages/hairstyle.h"

typedef enum ScatterKind {
    SCATTER_SEQUENCE, // R2 (Roberts 2018), folded into each triangle; does not know its neighbours
    SCATTER_DARTS,    // the thesis's: each triangle alone, few points near its middle
    SCATTER_ACROSS,   // darts that keep away from those of neighbouring triangles too
    SCATTER_KINDS
} ScatterKind;

typedef struct ScatterRoot {
    int triangle; // of the set
    Vec3 weight;  // of its corners
} ScatterRoot;

// At most `count` roots over the set's triangles into `roots`; fewer only where the triangles have
// no area or no density. Returns how many, or -1 without memory.
int scatter_roots(ScatterRoot* roots, int count, const Hairstyle* style, const StrandSet* set,
                  ScatterKind kind);

// A factor map at a root: 1 in a style without maps.
float scatter_map(const Hairstyle* style, const ScalpTriangle* triangle, Vec3 weight, ScalpMap map);
