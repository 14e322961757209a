#include "client/ribbons.h"

#include "messages/mannequin.h"
#include "messages/quantise.h"
#include "messages/random.h"
#include "messages/trig.h"

#include <stdlib.h>
#include <string.h>

// Diameter of one drawn hair, metres: 0.16 mm at the root to 0.04 mm at the tip, twice a real
// hair's, as in the path-traced reference. Thinner hair shows the scalp, thicker looks like rope.
#define FIBRE_ROOT_M 0.00016f
#define FIBRE_TIP_M  0.00004f

// Wisps keep this far from the skin, metres; less and the strip's edges cut into it.
#define SKIN_CLEARANCE_M 0.002f

static float fibre_width_m(float along)
{
    return FIBRE_ROOT_M + (FIBRE_TIP_M - FIBRE_ROOT_M) * along;
}

// Away from the head: from a vertical line inside it, bent to the head's centre above.
static Vec3 outward(const Hairstyle* style, Vec3 point, Vec3 tangent)
{
    Vec3 centre = style->head_centre;
    if (point.y < centre.y) centre.y = point.y;
    Vec3 out = vec3_sub(point, centre);
    out = vec3_mad(out, tangent, -vec3_dot(out, tangent));
    return vec3_normalise_or(out, vec3(0, 1, 0));
}

static void set4(Texel t, float x, float y, float z, float w)
{
    t[0] = x, t[1] = y, t[2] = z, t[3] = w;
}

// Writes one ribbon's points (their offsets follow later, by finish_ribbon) and its strip indices.
static void begin_ribbon(Ribbons* ribbons, int points)
{
    for (int k = 0; k < points; ++k) {
        uint32_t vertex = 2u * (uint32_t)(ribbons->point_count + k);
        ribbons->indices[ribbons->index_count++] = vertex;
        ribbons->indices[ribbons->index_count++] = vertex + 1;
    }
    ribbons->indices[ribbons->index_count++] = RIBBONS_RESTART;
}

// Fills tangents, normals and widths from the drawn points at rest, and counts the ribbon in.
static void finish_ribbon(Ribbons* ribbons, const Hairstyle* style, const StrandSet* set,
                          const Vec3* drawn, int points, uint32_t id)
{
    Vec3 tangents[HAIRSTYLE_MAX_POINTS];
    quantise_strand_tangents(tangents, drawn, points);
    float random = random_unit(style->seed ^ 0x5eedu, id);
    for (int k = 0; k < points; ++k) {
        int i = ribbons->point_count + k;
        float along = (float)k / (float)(points - 1);
        float width = set->root_width_m + (set->tip_width_m - set->root_width_m) * along;
        // A lock leaves the skin thin: square ends would show as teeth along the parting.
        float leave = (float)trig_smooth((double)along * 8.0);
        width *= 0.7f + 0.3f * leave;
        float fill = set->fibres * fibre_width_m(along) / width;
        // Hair is densest where it grows: wisps are full at the root, so that little scalp shows.
        if (set->kind == STRANDS_GROWN) fill = fmaxf(fill, 1.0f - leave);
        Vec3 normal = outward(style, drawn[k], tangents[k]);
        ribbons->weights[i][3] = 0.5f * width;
        ribbons->offsets[i][3] = fill < 1.0f ? fill : 1.0f;
        set4(ribbons->tangents[i], tangents[k].x, tangents[k].y, tangents[k].z, along);
        set4(ribbons->normals[i], normal.x, normal.y, normal.z, random);
    }
    ribbons->point_count += points;
    ribbons->ribbon_count += 1;
}

static void put_point(Ribbons* ribbons, int i, const DrawnPoint* point)
{
    set4(ribbons->guides[i], point->guide[0], point->guide[1], point->guide[2], point->height);
    set4(ribbons->weights[i], point->weight[0], point->weight[1], point->weight[2], 0);
    set4(ribbons->offsets[i], point->offset.x, point->offset.y, point->offset.z, 0);
}

static Vec3 rest_node(const Hairstyle* style, int guide, int node)
{
    return style->rest[guide * style->nodes + node];
}

// Where wisp `id` strays to at `along`: a lean of its own, growing to the tip, and a slow wave.
static Vec3 stray(const StrandSet* set, uint32_t seed, uint32_t id, float along, Vec3 tangent)
{
    Vec3 side = vec3_normalise_or(vec3_cross(tangent, vec3(0.31f, 0.17f, 0.93f)), vec3(1, 0, 0));
    Vec3 up = vec3_cross(side, tangent);
    float reach = set->jitter_m * along * (0.4f + 0.6f * along);
    float a = random_signed(seed, 8 * id + 1), b = random_signed(seed, 8 * id + 2);
    float phase = 6.2831853f * random_unit(seed, 8 * id + 3);
    float turns = 1.0f + 1.5f * random_unit(seed, 8 * id + 4);
    float wave = 0.35f * (float)trig_sin((double)(phase + 6.2831853f * turns * along));
    return vec3_add(vec3_scale(side, reach * (a + wave)), vec3_scale(up, reach * (b - wave)));
}

// The style and its guides' tangents at rest.
typedef struct Rest {
    const Hairstyle* style;
    const Vec3* tangents; // [guide][node]
} Rest;

// Where `point` is at rest; its guides' direction there in `tangent`, which may be NULL.
static Vec3 rest_place(const Rest* rest, const DrawnPoint* point, Vec3* tangent)
{
    Vec3d along;
    Vec3d at = drawn_position(point, rest->style->nodes, rest->style->rest, rest->tangents,
                              rest->tangents, &along);
    if (tangent != NULL) *tangent = vec3_from(along);
    return vec3_from(at);
}

static void grow_wisp(Ribbons* ribbons, const Rest* rest, const StrandSet* set,
                      const ScalpTriangle* triangle, Vec3 weight, uint32_t id)
{
    const Hairstyle* style = rest->style;
    uint32_t seed = style->seed;
    float r = random_unit(seed, 8 * id);
    float tip = 1.0f - 0.14f * r * r;
    Vec3 drawn[HAIRSTYLE_MAX_POINTS];
    Vec3 lift = {0, 0, 0};
    begin_ribbon(ribbons, set->points);
    for (int k = 0; k < set->points; ++k) {
        float along = (float)k / (float)(set->points - 1);
        DrawnPoint point = {.guide = {triangle->guide[0], triangle->guide[1], triangle->guide[2]},
                            .weight = {weight.x, weight.y, weight.z},
                            .height = tip * along * (float)(style->nodes - 1)};
        Vec3 tangent, base = rest_place(rest, &point, &tangent);
        Vec3 place = vec3_add(base, stray(set, seed, id, along, tangent));
        if (style->head_kind == HEAD_MANNEQUIN) {
            // The chord between three roots lies inside the skull: carry the whole wisp out by what
            // its root lacks, then push whatever is still inside.
            if (k == 0) lift = vec3_sub(mannequin_project(place, 0.0f), place);
            place = vec3_mad(place, lift, (1.0f - along) * (1.0f - along));
            if (k > 0 && mannequin_distance(place) < SKIN_CLEARANCE_M)
                place = mannequin_project(place, SKIN_CLEARANCE_M);
        }
        point.offset = vec3_sub(place, base);
        put_point(ribbons, ribbons->point_count + k, &point);
        drawn[k] = place;
    }
    finish_ribbon(ribbons, style, set, drawn, set->points, id);
}

static float triangle_area(const Hairstyle* style, const ScalpTriangle* triangle)
{
    Vec3 a = rest_node(style, triangle->guide[0], 0);
    Vec3 ab = vec3_sub(rest_node(style, triangle->guide[1], 0), a);
    Vec3 ac = vec3_sub(rest_node(style, triangle->guide[2], 0), a);
    return 0.5f * vec3_length(vec3_cross(ab, ac));
}

// Place `n` of triangle `t`: the R2 sequence (Roberts 2018) folded into the triangle; even at any
// count, which dart throwing is only after many throws.
static Vec3 scatter(uint32_t seed, uint32_t t, uint32_t n)
{
    float u = random_unit(seed ^ 0x7151u, 2 * t) + 0.75487766624669276f * (float)n;
    float v = random_unit(seed ^ 0x7151u, 2 * t + 1) + 0.56984029099805327f * (float)n;
    u -= floorf(u), v -= floorf(v);
    if (u + v > 1.0f) u = 1.0f - u, v = 1.0f - v;
    return vec3(1.0f - u - v, u, v);
}

// Deals the set's wisps to its triangles by area, and grows them.
static void grow_set(Ribbons* ribbons, const Rest* rest, const StrandSet* set)
{
    const Hairstyle* style = rest->style;
    double total = 0, dealt = 0;
    for (int t = 0; t < set->triangle_count; ++t)
        total += (double)triangle_area(style, &style->triangles[set->first_triangle + t]);
    int grown = 0;
    for (int t = 0; t < set->triangle_count && total > 0; ++t) {
        const ScalpTriangle* triangle = &style->triangles[set->first_triangle + t];
        dealt += (double)triangle_area(style, triangle);
        int until = (int)floor(dealt / total * set->strand_count + 0.5);
        if (until > set->strand_count) until = set->strand_count;
        for (uint32_t n = 0; grown < until; ++grown, ++n) {
            uint32_t id = (uint32_t)(set->first_strand + grown);
            uint32_t key = (uint32_t)(set->first_triangle + t);
            grow_wisp(ribbons, rest, set, triangle, scatter(style->seed, key, n), id);
        }
    }
}

static void bind_set(Ribbons* ribbons, const Rest* rest, const StrandSet* set)
{
    const Hairstyle* style = rest->style;
    for (int s = 0; s < set->strand_count; ++s) {
        Vec3 drawn[HAIRSTYLE_MAX_POINTS];
        begin_ribbon(ribbons, set->points);
        for (int k = 0; k < set->points; ++k) {
            DrawnPoint point;
            drawn_from_bound(&point, style, set, s, k);
            put_point(ribbons, ribbons->point_count + k, &point);
            drawn[k] = rest_place(rest, &point, NULL);
        }
        finish_ribbon(ribbons, style, set, drawn, set->points, (uint32_t)(set->first_strand + s));
    }
}

// Whether the bulk lane that carries the set has come.
static bool is_here(const Hairstyle* style, const StrandSet* set)
{
    return set->kind == STRANDS_GROWN || style->strands != NULL;
}

static bool allocate(Ribbons* ribbons, size_t points, size_t indices)
{
    ribbons->guides = calloc(points + 1, sizeof(Texel));
    ribbons->weights = calloc(points + 1, sizeof(Texel));
    ribbons->offsets = calloc(points + 1, sizeof(Texel));
    ribbons->tangents = calloc(points + 1, sizeof(Texel));
    ribbons->normals = calloc(points + 1, sizeof(Texel));
    ribbons->indices = calloc(indices + 1, sizeof(uint32_t));
    return ribbons->guides && ribbons->weights && ribbons->offsets && ribbons->tangents &&
           ribbons->normals && ribbons->indices;
}

bool ribbons_build(Ribbons* ribbons, const Hairstyle* style, Fault* fault)
{
    memset(ribbons, 0, sizeof *ribbons);
    size_t points = 0, indices = 0;
    for (int i = 0; i < style->set_count; ++i) {
        const StrandSet* set = &style->sets[i];
        if (!is_here(style, set)) continue;
        points += (size_t)set->strand_count * (size_t)set->points;
        indices += (size_t)set->strand_count * (2 * (size_t)set->points + 1);
    }
    Vec3* tangents = hairstyle_rest_tangents(style);
    if (tangents == NULL || !allocate(ribbons, points, indices)) {
        free(tangents);
        ribbons_free(ribbons);
        return fault_set(fault, "no memory for %zu ribbon points", points);
    }
    const Rest rest = {style, tangents};
    for (int i = 0; i < style->set_count; ++i) {
        const StrandSet* set = &style->sets[i];
        if (!is_here(style, set)) continue;
        if (set->kind == STRANDS_GROWN) grow_set(ribbons, &rest, set);
        if (set->kind == STRANDS_EXPLICIT) bind_set(ribbons, &rest, set);
    }
    free(tangents);
    return true;
}

void ribbons_free(Ribbons* ribbons)
{
    free(ribbons->guides);
    free(ribbons->weights);
    free(ribbons->offsets);
    free(ribbons->tangents);
    free(ribbons->normals);
    free(ribbons->indices);
    memset(ribbons, 0, sizeof *ribbons);
}

DrawnPoint ribbons_point(const Ribbons* ribbons, int i)
{
    const float *g = ribbons->guides[i], *w = ribbons->weights[i], *o = ribbons->offsets[i];
    return (DrawnPoint){.guide = {(uint16_t)g[0], (uint16_t)g[1], (uint16_t)g[2]},
                        .weight = {w[0], w[1], w[2]},
                        .height = g[3],
                        .offset = {o[0], o[1], o[2]}};
}
