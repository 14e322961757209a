#include "server/project.h"

#include <math.h>

#define REACH_PASSES    64
#define REACH_TOLERANCE 5e-4f
#define LEAST_LENGTH_M  1e-9f // below it a link has no direction

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

void project_lengths(Vec3* strand, int nodes, const float* lengths, const bool* skinned)
{
    int anchor = 0;
    for (int n = 1; n < nodes; ++n) {
        if (!skinned[n]) continue;
        if (n - anchor > 1) reach_between(strand, anchor, n, lengths);
        anchor = n;
    }
    reach_outwards(strand, anchor, nodes, lengths);
}
