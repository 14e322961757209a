#include "client/rim.h"

#include <stdlib.h>
#include <string.h>

#define FAR_M 1e3f // from any rim

// Roots on two rims this near to each other stand at a parting, metres. Along a hairline guides are
// rooted centimetres apart.
#define PARTING_M 0.008f

// Cosine of the angle to straight over the rim.
#define HUNG_OVER 0.6f

static const ScalpTriangle* triangle_of(const Hairstyle* style, const StrandSet* set, int triangle)
{
    return &style->triangles[set->first_triangle + triangle];
}

static Vec3 root(const Hairstyle* style, const ScalpTriangle* triangle, int corner)
{
    return style->rest[triangle->guide[corner % 3] * style->nodes];
}

// Neighbours wind alike, so they run along a shared edge in opposite ways.
static bool has_edge(const Hairstyle* style, const StrandSet* set, int from, int to)
{
    for (int t = 0; t < set->triangle_count; ++t) {
        const uint16_t* guide = triangle_of(style, set, t)->guide;
        for (int i = 0; i < 3; ++i)
            if (guide[i] == from && guide[(i + 1) % 3] == to) return true;
    }
    return false;
}

// Unit, in the triangle's plane, away from corner `opposite`; its distance from the edge there in
// `height_m`.
static Vec3 away(const Hairstyle* style, const ScalpTriangle* triangle, int opposite,
                 float* height_m)
{
    Vec3 a = root(style, triangle, opposite + 1), b = root(style, triangle, opposite + 2);
    Vec3 edge = vec3_normalise_or(vec3_sub(b, a), vec3(1, 0, 0));
    Vec3 out = vec3_sub(a, root(style, triangle, opposite));
    out = vec3_mad(out, edge, -vec3_dot(out, edge));
    *height_m = vec3_length(out);
    return vec3_normalise_or(out, vec3(0, 0, 0));
}

// Whether hair falls straight over the edge, as at the nape, and hides the roots there.
static bool is_hung_over(const Hairstyle* style, const ScalpTriangle* triangle, int opposite)
{
    float height_m;
    Vec3 outward = away(style, triangle, opposite, &height_m), combed = {0, 0, 0};
    for (int i = 1; i < 3; ++i) {
        const Vec3* node = style->rest + triangle->guide[(opposite + i) % 3] * style->nodes;
        combed = vec3_add(combed, vec3_sub(node[1], node[0]));
    }
    return vec3_dot(combed, outward) > HUNG_OVER * vec3_length(combed);
}

static void find_edges(Rim* rim, const Hairstyle* style, const StrandSet* set)
{
    float length_m = 0.0f;
    for (int t = 0; t < set->triangle_count; ++t) {
        const ScalpTriangle* triangle = triangle_of(style, set, t);
        for (int i = 0; i < 3; ++i) {
            int a = triangle->guide[(i + 1) % 3], b = triangle->guide[(i + 2) % 3];
            if (has_edge(style, set, b, a)) continue;
            rim->on_rim[a] = rim->on_rim[b] = true;
            rim->open[t] |= (uint8_t)(1u << i);
            if (is_hung_over(style, triangle, i)) continue;
            length_m +=
                vec3_length(vec3_sub(root(style, triangle, i + 2), root(style, triangle, i + 1)));
            rim->edges[rim->edge_count++] = (RimEdge){t, i, length_m, false};
        }
    }
}

// What find_edges could not know yet: which of them are a parting's.
static void find_partings(Rim* rim, const Hairstyle* style, const StrandSet* set)
{
    int first = set->first_guide, end = first + set->guide_count;
    for (int a = first; a < end; ++a)
        for (int b = first; b < end && rim->on_rim[a]; ++b) {
            if (a == b || !rim->on_rim[b]) continue;
            Vec3 d = vec3_sub(style->rest[a * style->nodes], style->rest[b * style->nodes]);
            rim->parts[a] |= vec3_length(d) < PARTING_M;
        }
    for (int i = 0; i < rim->edge_count; ++i) {
        RimEdge* edge = &rim->edges[i];
        const uint16_t* guide = triangle_of(style, set, edge->triangle)->guide;
        int a = guide[(edge->opposite + 1) % 3], b = guide[(edge->opposite + 2) % 3];
        edge->is_parting = rim->parts[a] && rim->parts[b];
    }
}

bool rim_find(Rim* rim, const Hairstyle* style, const StrandSet* set)
{
    memset(rim, 0, sizeof *rim);
    rim->edges = calloc(3 * (size_t)set->triangle_count + 1, sizeof *rim->edges);
    if (rim->edges == NULL) return false;
    find_edges(rim, style, set);
    find_partings(rim, style, set);
    return true;
}

void rim_free(Rim* rim)
{
    free(rim->edges);
    memset(rim, 0, sizeof *rim);
}

static Vec3 at_weight(const Hairstyle* style, const ScalpTriangle* triangle, Vec3 weight)
{
    Vec3 at = vec3_scale(root(style, triangle, 0), weight.x);
    at = vec3_mad(at, root(style, triangle, 1), weight.y);
    return vec3_mad(at, root(style, triangle, 2), weight.z);
}

static void come_nearer(Rooting* rooting, Vec3 outward, float inside_m, bool at_parting)
{
    if (inside_m >= rooting->inside_m) return;
    rooting->at_parting = at_parting;
    rooting->outward = outward;
    rooting->inside_m = inside_m;
}

Rooting rim_rooting(const Rim* rim, const Hairstyle* style, const StrandSet* set, int triangle,
                    Vec3 weight)
{
    const ScalpTriangle* patch = triangle_of(style, set, triangle);
    Rooting rooting = {.triangle = patch, .weight = weight, .inside_m = FAR_M};
    Vec3 at = at_weight(style, patch, weight);
    const float of[3] = {weight.x, weight.y, weight.z};
    for (int i = 0; i < 3; ++i) {
        if (rim->on_rim[patch->guide[i]]) {
            Vec3 to = vec3_sub(root(style, patch, i), at);
            come_nearer(&rooting, vec3_normalise_or(to, vec3(0, 0, 0)), vec3_length(to),
                        rim->parts[patch->guide[i]]);
        }
        if (!(rim->open[triangle] >> i & 1)) continue;
        float height_m;
        Vec3 outward = away(style, patch, i, &height_m);
        bool parts = rim->parts[patch->guide[(i + 1) % 3]] && rim->parts[patch->guide[(i + 2) % 3]];
        come_nearer(&rooting, outward, of[i] * height_m, parts);
    }
    return rooting;
}

Rooting rim_place(const Rim* rim, const Hairstyle* style, const StrandSet* set, float along,
                  float inside_m)
{
    float want_m = along * rim->edges[rim->edge_count - 1].until_m;
    int e = 0;
    while (e < rim->edge_count - 1 && rim->edges[e].until_m <= want_m)
        ++e;
    const RimEdge* edge = &rim->edges[e];
    const ScalpTriangle* patch = triangle_of(style, set, edge->triangle);
    float from_m = e > 0 ? rim->edges[e - 1].until_m : 0.0f, height_m;
    Vec3 outward = away(style, patch, edge->opposite, &height_m);
    float u = edge->until_m > from_m ? (want_m - from_m) / (edge->until_m - from_m) : 0.0f;
    u = fminf(u, 1.0f);
    float v = height_m > 0.0f ? fminf(inside_m / height_m, 1.0f) : 0.0f;
    float of[3];
    of[edge->opposite] = v;
    of[(edge->opposite + 1) % 3] = (1.0f - v) * (1.0f - u);
    of[(edge->opposite + 2) % 3] = (1.0f - v) * u;
    return (Rooting){patch, vec3(of[0], of[1], of[2]), outward, v * height_m, edge->is_parting};
}
