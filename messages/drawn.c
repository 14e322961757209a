#include "messages/drawn.h"

#include <assert.h>

static Vec3d lerp(const Vec3* row, int k, double f)
{
    Vec3d a = vec3d_from(row[k]), b = vec3d_from(row[k + 1]);
    return vec3d_add(a, vec3d_scale(vec3d_sub(b, a), f));
}

static int segment(const DrawnPoint* point, int nodes)
{
    int k = (int)point->height;
    return k > nodes - 2 ? nodes - 2 : k; // the tip itself: k + 1 is the last node, f is 1
}

static Vec3d blend(const DrawnPoint* point, int nodes, const Vec3* plane)
{
    int k = segment(point, nodes);
    double f = (double)point->height - k;
    Vec3d sum = {0, 0, 0};
    for (int i = 0; i < 3; ++i) {
        Vec3d at = lerp(plane + (size_t)point->guide[i] * (size_t)nodes, k, f);
        sum = vec3d_add(sum, vec3d_scale(at, (double)point->weight[i]));
    }
    return sum;
}

// Tangents now, but for node 0: that one at rest.
static Vec3d blend_now(const DrawnPoint* point, int nodes, const Vec3* tangents,
                       const Vec3* rest_tangents)
{
    if (segment(point, nodes) > 0) return blend(point, nodes, tangents);
    double f = (double)point->height;
    Vec3d sum = {0, 0, 0};
    for (int i = 0; i < 3; ++i) {
        size_t row = (size_t)point->guide[i] * (size_t)nodes;
        Vec3d a = vec3d_from(rest_tangents[row]), b = vec3d_from(tangents[row + 1]);
        Vec3d at = vec3d_add(a, vec3d_scale(vec3d_sub(b, a), f));
        sum = vec3d_add(sum, vec3d_scale(at, (double)point->weight[i]));
    }
    return sum;
}

static Vec3d hermite(const Vec3* position, const Vec3* tangent, double f)
{
    Vec3d a = vec3d_from(position[0]), chord = vec3d_sub(vec3d_from(position[1]), a);
    double length = sqrt(vec3d_dot(chord, chord)), g = 1.0 - f;
    Vec3d at = vec3d_add(a, vec3d_scale(chord, f * f * (3.0 - 2.0 * f)));
    at = vec3d_add(at, vec3d_scale(vec3d_from(tangent[0]), length * f * g * g));
    return vec3d_add(at, vec3d_scale(vec3d_from(tangent[1]), -length * f * f * g));
}

static Vec3d carry(const DrawnPoint* point, int nodes, const Vec3* positions, const Vec3* tangents)
{
    int k = segment(point, nodes);
    double f = (double)point->height - k;
    Vec3d sum = {0, 0, 0};
    for (int i = 0; i < 3; ++i) {
        size_t at = (size_t)point->guide[i] * (size_t)nodes + (size_t)k;
        Vec3d here = hermite(positions + at, tangents + at, f);
        sum = vec3d_add(sum, vec3d_scale(here, (double)point->weight[i]));
    }
    return sum;
}

static bool normalise(Vec3d* v)
{
    double square = vec3d_dot(*v, *v);
    if (!(square > DRAWN_MIN_TANGENT_SQ)) return false;
    *v = vec3d_scale(*v, 1.0 / sqrt(square));
    return true;
}

static Vec3d turn(Vec3d v, Vec3d from, Vec3d to)
{
    Vec3d b = vec3d_cross(from, to);
    double c = vec3d_dot(from, to);
    if (c < DRAWN_OPPOSED) return v;
    Vec3d bv = vec3d_cross(b, v);
    Vec3d bbv = vec3d_cross(b, bv);
    return vec3d_add(v, vec3d_add(bv, vec3d_scale(bbv, 1.0 / (1.0 + c))));
}

Vec3d drawn_position(const DrawnPoint* point, int nodes, const Vec3* positions,
                     const Vec3* tangents, const Vec3* rest_tangents, Vec3d* tangent)
{
    Vec3d at = carry(point, nodes, positions, tangents);
    Vec3d now = blend_now(point, nodes, tangents, rest_tangents);
    Vec3d rest = blend(point, nodes, rest_tangents);
    bool has_now = normalise(&now), has_rest = normalise(&rest);
    Vec3d offset = vec3d_from(point->offset);
    if (has_now && has_rest) offset = turn(offset, rest, now);
    if (tangent != NULL) *tangent = has_now ? now : (Vec3d){0, -1, 0};
    return vec3d_add(at, offset);
}

// From the nearest point of the axis.
static Vec3d from_axis(Vec3d at, const Collider* collider)
{
    Vec3d from = vec3d_sub(at, vec3d_from(collider->from));
    Vec3d axis = vec3d_sub(vec3d_from(collider->to), vec3d_from(collider->from));
    double square = vec3d_dot(axis, axis);
    double u = square > 0.0 ? vec3d_dot(from, axis) / square : 0.0;
    u = u < 0.0 ? 0.0 : u > 1.0 ? 1.0 : u;
    return vec3d_sub(from, vec3d_scale(axis, u));
}

double drawn_axis_distance(Vec3d at, const Collider* collider)
{
    Vec3d from = from_axis(at, collider);
    return sqrt(vec3d_dot(from, from));
}

Vec3d drawn_push_out(Vec3d at, const Collider* colliders, int count)
{
    for (int i = 0; i < count; ++i) {
        Vec3d from = from_axis(at, &colliders[i]);
        double distance = sqrt(vec3d_dot(from, from));
        double lack = (double)colliders[i].radius - distance;
        if (lack <= 0.0 || distance < DRAWN_ON_AXIS_M) continue;
        at = vec3d_add(at, vec3d_scale(from, (lack < distance ? lack : distance) / distance));
    }
    return at;
}

void drawn_from_bound(DrawnPoint* out, const Hairstyle* style, const StrandSet* set, int strand,
                      int point)
{
    assert(set->kind == STRANDS_EXPLICIT);
    const BoundStrand* bound = &style->strands[set->first_strand + strand];
    for (int i = 0; i < 3; ++i) {
        out->guide[i] = bound->guide[i];
        out->weight[i] = (float)(bound->weight[i] / 65535.0);
    }
    double fraction = (double)point / (set->points - 1);
    out->height = (float)(bound->tip_height / 65535.0 * fraction * (style->nodes - 1));
    size_t at = (size_t)set->first_offset + (size_t)strand * (size_t)set->points + (size_t)point;
    const StrandOffset* offset = &style->offsets[at];
    out->offset = vec3_scale(vec3((float)offset->x, (float)offset->y, (float)offset->z),
                             style->offset_scale_m);
}
