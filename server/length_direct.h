// All links of a strand put to their length at once, instead of one after another (length.h).
//
// Newton's method on |p[n] - p[n-1]| = length[n]: with W the inverse masses and J the links'
// directions, J W J^T tension = error is tridiagonal, because a link shares nodes with its
// neighbours alone; it is eliminated from the root out and solved from the tip in, in O(nodes).
// (Han and Harada 2013, "Tridiagonal matrix formulation for inextensible hair strand simulation".)
// What one solve leaves is of second order in the error, where a sweep leaves what the weight
// outboard stretches.
#pragma once

#include "server/length.h"

#define LEAST_PIVOT 1e-3f // of a straight strand between two skinned nodes: nothing can move there

// Directions and errors, and the elimination of row n; the row before is done.
static inline void length_eliminate(Block* block, int n)
{
    const Lanes3 *p = &block->position[n - 1], *q = &block->position[n];
    const Lanes3* before = &block->direction[n - 1];
    const Lanes *inner = &block->inverse_mass[n - 1], *outer = &block->inverse_mass[n];
    const Lanes *pivot_before = &block->pivot[n - 1], *tension_before = &block->tension[n - 1];
    const real* rest = block->length[n].v;
    Lanes3* d = &block->direction[n];
    Lanes *pivot = &block->pivot[n], *tension = &block->tension[n];
    bool is_first = n == 1; // nothing is before it, and what stands there is not even a number
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real x = q->x[l] - p->x[l], y = q->y[l] - p->y[l], z = q->z[l] - p->z[l];
        real length = real_sqrt(x * x + y * y + z * z);
        real inverse = 1 / (length > LEAST_LENGTH_M ? length : LEAST_LENGTH_M);
        x *= inverse;
        y *= inverse;
        z *= inverse;
        real error = length - rest[l];
        error = real_abs(error) > RESOLVED_M ? error : 0;
        real both = inner->v[l] + outer->v[l];
        error = both > 0 ? error : 0;
        both = both > 0 ? both : 1;
        real cosine = x * before->x[l] + y * before->y[l] + z * before->z[l];
        real shared = is_first ? 0 : -inner->v[l] * cosine;
        real factor = shared * pivot_before->v[l];
        real left = both - factor * shared;
        pivot->v[l] = 1 / (left > LEAST_PIVOT ? left : LEAST_PIVOT);
        tension->v[l] = error - factor * tension_before->v[l];
        d->x[l] = x;
        d->y[l] = y;
        d->z[l] = z;
    }
}

// The tension of row n; the row after is done. Then node n moves by what its two links pull.
static inline void length_pull(Block* block, int n, bool is_tip)
{
    const Lanes3 *d = &block->direction[n], *after = &block->direction[is_tip ? n : n + 1];
    const Lanes* tension_after = &block->tension[is_tip ? n : n + 1];
    const Lanes *pivot = &block->pivot[n], *mass = &block->inverse_mass[n];
    Lanes* tension = &block->tension[n];
    Lanes3* p = &block->position[n];
    real chained = is_tip ? 0 : 1;
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real w = mass->v[l], next = chained * tension_after->v[l];
        real cosine = d->x[l] * after->x[l] + d->y[l] * after->y[l] + d->z[l] * after->z[l];
        real pull = pivot->v[l] * (tension->v[l] + w * cosine * next);
        tension->v[l] = pull;
        p->x[l] += w * (next * after->x[l] - pull * d->x[l]);
        p->y[l] += w * (next * after->y[l] - pull * d->y[l]);
        p->z[l] += w * (next * after->z[l] - pull * d->z[l]);
    }
}

static void length_solve(Block* blocks, int count, int solves)
{
    int nodes = blocks[0].nodes;
    for (int solve = 0; solve < solves; ++solve) {
        for (int n = 1; n < nodes; ++n)
            for (int b = 0; b < count; ++b)
                length_eliminate(&blocks[b], n);
        for (int n = nodes - 1; n >= 1; --n)
            for (int b = 0; b < count; ++b)
                length_pull(&blocks[b], n, n == nodes - 1);
    }
}
