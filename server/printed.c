#include "server/printed.h"

#include "messages/trig.h"

#include <math.h>

#define LEAST_AXIS2 1e-24 // squared: a shorter B has no direction, and nothing is put along it

typedef struct Axes {
    Vec3d x, y, z;
} Axes;

static Vec3d unit(Vec3d v)
{
    double length = sqrt(vec3d_dot(v, v));
    return length > 1e-12 ? vec3d_scale(v, 1.0 / length) : (Vec3d){0, 0, 0};
}

static Vec3d way(const Vec3* rest, int from, int to)
{
    return vec3d_sub(vec3d_from(rest[to]), vec3d_from(rest[from]));
}

// `v` along B, N and T: they are across each other, but B and T no longer unit.
static Vec3 into_space(Vec3d v, Vec3d b, Vec3d n, Vec3d t)
{
    double b2 = vec3d_dot(b, b), t2 = vec3d_dot(t, t);
    return vec3(b2 > LEAST_AXIS2 ? (float)(vec3d_dot(v, b) / b2) : 0.0f, (float)vec3d_dot(v, n),
                t2 > LEAST_AXIS2 ? (float)(vec3d_dot(v, t) / t2) : 0.0f);
}

// The tangent spaces of the strand at rest, made as model_cascade_thesis.h makes them, and in each
// the nodes that it draws: rest is then rest, however the spaces are.
static void fill_spaces(Block* block, const Vec3* rest, int lane)
{
    Vec3d t = vec3d_from(lane_get(&block->across[1], lane));
    for (int n = 1; n < block->nodes; ++n) {
        Vec3d d = unit(way(rest, n - 1, n)), b = vec3d_cross(d, t);
        t = vec3d_cross(d, b);
        if (n + 1 < block->nodes)
            lane_set(&block->upward[n + 1], lane, into_space(way(rest, n, n + 1), b, d, t));
        if (n > 1)
            lane_set(&block->downward[n - 2], lane, into_space(way(rest, n, n - 2), b, d, t));
    }
}

// What turns the frame's z axis to `d` (in the frame): the lesser turn about the first axis, so
// that a strand in a plane has none.
static void angles_to(Vec3d d, double* theta, double* phi)
{
    double side = d.x < 0.0 ? -1.0 : 1.0;
    *phi = trig_atan2(side * sqrt(d.x * d.x + d.y * d.y), d.z);
    *theta = trig_atan2(side * d.y, side * d.x);
}

static Axes turned(Axes f, double theta, double phi)
{
    double st = trig_sin(theta), ct = trig_cos(theta), sp = trig_sin(phi), cp = trig_cos(phi);
    Vec3d a = vec3d_add(vec3d_scale(f.x, ct), vec3d_scale(f.y, st)), c = f.z;
    Vec3d b = vec3d_sub(vec3d_scale(f.y, ct), vec3d_scale(f.x, st));
    return (Axes){vec3d_sub(vec3d_scale(a, cp), vec3d_scale(c, sp)), b,
                  vec3d_add(vec3d_scale(a, sp), vec3d_scale(c, cp))};
}

static void fill_angles(Block* block, const Vec3* rest, int lane)
{
    Axes f = {.x = vec3d_from(lane_get(&block->across[1], lane)),
              .z = vec3d_from(lane_get(&block->along[1], lane))};
    f.y = vec3d_cross(f.z, f.x);
    for (int n = 1; n < block->nodes; ++n) {
        Vec3d d = unit(way(rest, n - 1, n));
        double theta, phi;
        angles_to((Vec3d){vec3d_dot(d, f.x), vec3d_dot(d, f.y), vec3d_dot(d, f.z)}, &theta, &phi);
        block->rest_angle[n].theta[lane] = (real)theta;
        block->rest_angle[n].phi[lane] = (real)phi;
        f = turned(f, theta, phi);
    }
}

// v of every joint alike.
static void fill_joints(Block* block, const SimDefinition* d, const Vec3* rest, int lane)
{
    for (int n = 1; n < block->nodes; ++n) {
        Vec3d link = way(rest, n - 1, n), before = n > 1 ? way(rest, n - 2, n - 1) : link;
        double length = 0.5 * (sqrt(vec3d_dot(link, link)) + sqrt(vec3d_dot(before, before)));
        block->friction[n].v[lane] = (real)((double)d->joint_damping_per_s * length * length);
    }
}

void printed_fill(Block* block, const SimDefinition* d, int strand, int lane)
{
    const Vec3* rest = d->rest + (size_t)strand * (size_t)d->nodes;
    if (d->model == MODEL_CASCADE_THESIS) fill_spaces(block, rest, lane);
    if (d->model != MODEL_FOREST_Z) return;
    fill_angles(block, rest, lane);
    fill_joints(block, d, rest, lane);
}
