#include "server/project.h"

#include "server/span.h"

#include <math.h>

#define REACH_PASSES    64
#define REACH_TOLERANCE 5e-4f
#define CLEAR_PASSES    24    // overlapping spheres vie: 8 leave 0.9 mm where a run stops dead
#define CLEAR_M         1e-6f // nearer to clear than positions resolve

// `node` at `length` from `anchor`, on the side where it is.
static Vec3 at_length(Vec3 anchor, Vec3 node, float length)
{
    Vec3 way = vec3_sub(node, anchor);
    float d = vec3_length(way);
    if (!(d > LEAST_LENGTH_M)) return vec3_add(anchor, vec3(0.0f, -length, 0.0f));
    return vec3_mad(anchor, way, length / d);
}

// `node` on the sphere of radius `length` around `anchor`, where that meets the sphere of
// `keep_out`: the nearest such place. The nearest that there is where the two do not meet.
static Vec3 turn_out(Vec3 anchor, Vec3 node, float length, Sphere keep_out)
{
    Vec3 way = vec3_sub(keep_out.centre, anchor), side;
    float d = vec3_length(way);
    if (!(d > LEAST_LENGTH_M)) return node;
    way = vec3_scale(way, 1.0f / d);
    side = vec3_sub(node, anchor);
    side = vec3_mad(side, way, -vec3_dot(side, way));
    float along = (length * length + d * d - keep_out.radius * keep_out.radius) / (2.0f * d);
    along = fmaxf(along, -length);
    float across = sqrtf(fmaxf(length * length - along * along, 0.0f));
    side = vec3_normalise_or(side, vec3(0.0f, 0.0f, 0.0f));
    return vec3_mad(vec3_mad(anchor, way, along), side, across);
}

static Vec3 keep_out_of_all(const Obstacles* obstacles, int nodes, int n, Vec3 anchor, Vec3 node,
                            float length)
{
    bool moved = true;
    for (int pass = 0; moved && pass < CLEAR_PASSES; ++pass) {
        moved = false;
        for (int k = 0; k < obstacles->count; ++k) {
            const Collider* c = &obstacles->colliders[k];
            Sphere sphere = {span_nearest((Span){c->from, c->to}, node), c->radius};
            Vec3 from = vec3_sub(node, sphere.centre);
            float reach = sphere.radius + obstacles->pearl_radius_m, near = vec3_dot(from, from);
            if (near >= reach * reach) continue;
            sphere.radius = (float)obstacles->clearance[(k * nodes + n) * LANES];
            if (sqrtf(near) >= sphere.radius - CLEAR_M) continue;
            node = turn_out(anchor, node, length, sphere);
            moved = true;
        }
    }
    return node;
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

void project_lengths(Vec3* strand, int nodes, const float* lengths, const bool* skinned,
                     const Obstacles* obstacles)
{
    int anchor = 0;
    for (int n = 1; n < nodes; ++n) {
        if (!skinned[n]) continue;
        if (n - anchor > 1) reach_between(strand, anchor, n, lengths);
        anchor = n;
    }
    for (int n = anchor + 1; n < nodes; ++n) {
        strand[n] = at_length(strand[n - 1], strand[n], lengths[n]);
        strand[n] = keep_out_of_all(obstacles, nodes, n, strand[n - 1], strand[n], lengths[n]);
    }
}
