#include "server/length.h"

#include <math.h>

#define REACH_PASSES    64
#define REACH_TOLERANCE 5e-4f
#define LEAST_LENGTH_M  1e-9f // below it a link has no direction
// What float positions within a metre resolve of a length. Correcting less is correcting rounding:
// the tip's spring is so soft (k dt^2 below 1e-3) that the pushes would add up to a drift of 0.01
// mm at rest.
#define RESOLVED_M 2.5e-7f

void length_shares(float* inner, float* outer, bool inner_skinned, bool outer_skinned)
{
    *inner = inner_skinned ? 0.0f : outer_skinned ? 1.0f : 0.5f;
    *outer = outer_skinned ? 0.0f : inner_skinned ? 1.0f : 0.5f;
}

LANES_KERNEL void length_correct(Block* block)
{
    for (int n = 1; n < block->nodes; ++n) {
        Lanes3* a = &block->position[n - 1];
        Lanes3* b = &block->position[n];
        const float* rest = block->length[n].v;
        const float* inner = block->inner_part[n].v;
        const float* outer = block->outer_part[n].v;
#pragma omp simd
        for (int l = 0; l < LANES; ++l) {
            float x = b->x[l] - a->x[l], y = b->y[l] - a->y[l], z = b->z[l] - a->z[l];
            float d = sqrtf(x * x + y * y + z * z);
            d = d > LEAST_LENGTH_M ? d : LEAST_LENGTH_M;
            float error = d - rest[l];
            error = fabsf(error) > RESOLVED_M ? error : 0.0f;
            float excess = error / d;
            float in = inner[l] * excess, out = outer[l] * excess;
            a->x[l] += in * x;
            a->y[l] += in * y;
            a->z[l] += in * z;
            b->x[l] -= out * x;
            b->y[l] -= out * y;
            b->z[l] -= out * z;
        }
    }
}

// `node` at `length` from `anchor`, on the side where it is.
static Vec3 at_length(Vec3 anchor, Vec3 node, float length)
{
    Vec3 way = vec3_sub(node, anchor);
    float d = vec3_length(way);
    if (!(d > LEAST_LENGTH_M)) return vec3_add(anchor, vec3(0.0f, -length, 0.0f));
    return vec3_mad(anchor, way, length / d);
}

static void reach_outwards(Vec3* strand, int from, int to, const float* lengths)
{
    for (int n = from + 1; n < to; ++n)
        strand[n] = at_length(strand[n - 1], strand[n], lengths[n]);
}

static void reach_inwards(Vec3* strand, int from, int to, const float* lengths)
{
    for (int n = to - 1; n > from; --n)
        strand[n] = at_length(strand[n + 1], strand[n], lengths[n + 1]);
}

// The free nodes between skinned nodes `from` and `to`. After an outward pass only the last link
// is wrong.
static void reach_between(Vec3* strand, int from, int to, const float* lengths)
{
    reach_outwards(strand, from, to, lengths);
    for (int pass = 0; pass < REACH_PASSES; ++pass) {
        float last = vec3_length(vec3_sub(strand[to], strand[to - 1]));
        if (fabsf(last - lengths[to]) <= REACH_TOLERANCE * lengths[to]) return;
        reach_inwards(strand, from, to, lengths);
        reach_outwards(strand, from, to, lengths);
    }
}

void length_project(Vec3* strand, int nodes, const float* lengths, const bool* skinned)
{
    int anchor = 0;
    for (int n = 1; n < nodes; ++n) {
        if (!skinned[n]) continue;
        if (n - anchor > 1) reach_between(strand, anchor, n, lengths);
        anchor = n;
    }
    reach_outwards(strand, anchor, nodes, lengths);
}
