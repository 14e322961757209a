#include "client/ribbons.h"

#include "client/rim.h"
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

// Where the scalp ends, hair does not begin at once: over the first RIM_M from the rim wisps are
// narrow, and thin for the first FADE_M from their roots. A parting is a narrow line, so roots
// there are nearly as full as elsewhere.
#define RIM_M            0.007f
#define FADE_M           0.010f
#define PARTING_PRESENCE 1.0f

// Some wisps stand along the rim, rooted up to STRAY_ROOT_M beyond it. Hair is younger there: they
// are shorter than their guides, and some are very short.
#define RIM_SHARE            0.26f // of the set's wisps
#define RIM_REACH            0.9f  // of their guides' length
#define STRAY_ROOT_M         0.004f
#define PARTING_STRAY_ROOT_M 0.0015f // keeps to its side
#define SHORT_SHARE          0.25f   // of those at the hairline
#define SHORT_LEAST_M        0.010f
#define SHORT_MOST_M         0.030f

// From a wisp's root to its next point: nearer only where even points are, further on the longest.
#define FIRST_EDGE_M 0.008f

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

// One ribbon at rest: its centre line, how wide it is and what share of it is hair.
typedef struct Strip {
    int points;
    Vec3 at[HAIRSTYLE_MAX_POINTS];
    float along[HAIRSTYLE_MAX_POINTS]; // 0 root to 1 tip
    float width_m[HAIRSTYLE_MAX_POINTS], fill[HAIRSTYLE_MAX_POINTS];
} Strip;

// A lock leaves the skin thin: square ends would show as teeth along the parting.
static float leave(float along)
{
    return (float)trig_smooth((double)along * 8.0);
}

static void shape_bound(Strip* strip, const StrandSet* set)
{
    for (int k = 0; k < strip->points; ++k) {
        float along = strip->along[k];
        float width = set->root_width_m + (set->tip_width_m - set->root_width_m) * along;
        strip->width_m[k] = width * (0.7f + 0.3f * leave(along));
        strip->fill[k] = set->fibres * fibre_width_m(along) / strip->width_m[k];
    }
}

// Fills in tangents, normals and widths, and counts the ribbon in.
static void finish_ribbon(Ribbons* ribbons, const Hairstyle* style, const Strip* strip, uint32_t id)
{
    Vec3 tangents[HAIRSTYLE_MAX_POINTS];
    quantise_strand_tangents(tangents, strip->at, strip->points);
    float random = random_unit(style->seed ^ 0x5eedu, id);
    for (int k = 0; k < strip->points; ++k) {
        int i = ribbons->point_count + k;
        Vec3 normal = outward(style, strip->at[k], tangents[k]);
        ribbons->weights[i][3] = 0.5f * strip->width_m[k];
        ribbons->offsets[i][3] = fminf(strip->fill[k], 1.0f);
        set4(ribbons->tangents[i], tangents[k].x, tangents[k].y, tangents[k].z, strip->along[k]);
        set4(ribbons->normals[i], normal.x, normal.y, normal.z, random);
    }
    ribbons->point_count += strip->points;
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

// A wisp to be grown.
typedef struct Wisp {
    uint32_t id;
    Rooting rooting;
    float reach; // share of its guides' length
    float length_m;
    float shift_m; // from its place in the triangle to its root, along rooting.outward
    bool is_short; // a few hairs of a few centimetres
} Wisp;

// Where the wisp strays to at `along`: a lean of its own, growing to the tip, and a slow wave.
static Vec3 stray(const StrandSet* set, uint32_t seed, const Wisp* wisp, float along, Vec3 tangent)
{
    Vec3 side = vec3_normalise_or(vec3_cross(tangent, vec3(0.31f, 0.17f, 0.93f)), vec3(1, 0, 0));
    Vec3 up = vec3_cross(side, tangent);
    uint32_t draw = 8 * wisp->id;
    float reach = set->jitter_m * along * (0.4f + 0.6f * along);
    float a = random_signed(seed, draw + 1), b = random_signed(seed, draw + 2);
    float phase = 6.2831853f * random_unit(seed, draw + 3);
    float turns = 1.0f + 1.5f * random_unit(seed, draw + 4);
    float wave = 0.35f * (float)trig_sin((double)(phase + 6.2831853f * turns * along));
    if (wisp->is_short) reach *= 0.6f, wave = 0.0f;
    return vec3_add(vec3_scale(side, reach * (a + wave)), vec3_scale(up, reach * (b - wave)));
}

// Points lie closer at the root, where hair bends round the skull: corners stood off the crown as a
// comb when they were even.
static float along_of(int k, int points, float length_m)
{
    float u = (float)k / (float)(points - 1);
    float even = FIRST_EDGE_M * (float)(points - 1) / length_m;
    even = fminf(fmaxf(even, 0.4f), 1.0f);
    return u * (even + (1.0f - even) * u);
}

// How much of a wisp is there: 1 but near the root of one that stands near the rim.
static float presence(const Wisp* wisp, float from_root_m)
{
    float inside = (float)trig_smooth((double)(wisp->rooting.inside_m / RIM_M));
    float grown = (float)trig_smooth((double)(from_root_m / FADE_M));
    float least = wisp->rooting.at_parting ? PARTING_PRESENCE : 0.0f;
    return fmaxf(inside + (1.0f - inside) * grown, least);
}

static void shape_wisp(Strip* strip, const StrandSet* set, const Wisp* wisp)
{
    float from_root_m = 0.0f;
    for (int k = 0; k < strip->points; ++k) {
        if (k > 0) from_root_m += vec3_length(vec3_sub(strip->at[k], strip->at[k - 1]));
        float along = strip->along[k], here = presence(wisp, from_root_m);
        float width = set->root_width_m + (set->tip_width_m - set->root_width_m) * along;
        width *= 0.7f + 0.3f * leave(along);
        // Hair is densest where it grows: wisps are full at the root, so that little scalp shows.
        float fill =
            fmaxf(set->fibres * fibre_width_m(along) / width, 0.85f - 0.85f * leave(along));
        strip->width_m[k] = width * (0.6f + 0.4f * here);
        strip->fill[k] = fminf(fill, 1.0f) * (0.5f + 0.5f * here);
    }
}

static void shape_short(Strip* strip)
{
    for (int k = 0; k < strip->points; ++k) {
        strip->width_m[k] = 3.0f * fibre_width_m(strip->along[k]);
        strip->fill[k] = 0.6f;
        strip->along[k] *= 0.3f; // young hair has not bleached: it keeps the colour of roots
    }
}

// From where the guides put the root to where it is. The chord between three roots lies inside the
// skull: the whole wisp is carried out by what its root lacks.
static Vec3 root_lift(const Hairstyle* style, const Wisp* wisp, Vec3 root)
{
    Vec3 lift = vec3_scale(wisp->rooting.outward, wisp->shift_m);
    if (style->head_kind != HEAD_MANNEQUIN) return lift;
    return vec3_sub(mannequin_project(vec3_add(root, lift), 0.0f), root);
}

// Pushes out what is inside the skin all the same; short hair may lie on it.
static Vec3 off_skin(const Hairstyle* style, const Wisp* wisp, Vec3 place, float along)
{
    if (style->head_kind != HEAD_MANNEQUIN || along == 0.0f) return place;
    float clear = SKIN_CLEARANCE_M * (wisp->is_short ? 0.5f * along : 1.0f);
    return mannequin_distance(place) < clear ? mannequin_project(place, clear) : place;
}

static void grow_wisp(Ribbons* ribbons, const Rest* rest, const StrandSet* set, const Wisp* wisp)
{
    const Hairstyle* style = rest->style;
    const uint16_t* guide = wisp->rooting.triangle->guide;
    Vec3 weight = wisp->rooting.weight, lift = {0, 0, 0};
    Strip strip = {.points = set->points};
    begin_ribbon(ribbons, set->points);
    for (int k = 0; k < set->points; ++k) {
        float along = along_of(k, set->points, wisp->length_m);
        DrawnPoint point = {.guide = {guide[0], guide[1], guide[2]},
                            .weight = {weight.x, weight.y, weight.z},
                            .height = wisp->reach * along * (float)(style->nodes - 1)};
        Vec3 tangent, base = rest_place(rest, &point, &tangent);
        Vec3 place = vec3_add(base, stray(set, style->seed, wisp, along, tangent));
        if (k == 0) lift = root_lift(style, wisp, place);
        // A short wisp would fold if its tip did not come along.
        place = vec3_mad(place, lift, wisp->is_short ? 1.0f : (1.0f - along) * (1.0f - along));
        place = off_skin(style, wisp, place, along);
        point.offset = vec3_sub(place, base);
        put_point(ribbons, ribbons->point_count + k, &point);
        strip.at[k] = place;
        strip.along[k] = along;
    }
    if (wisp->is_short)
        shape_short(&strip);
    else
        shape_wisp(&strip, set, wisp);
    finish_ribbon(ribbons, style, &strip, wisp->id);
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

// A wisp as long as its guides, nearly: ends are not cut with a ruler.
static Wisp long_wisp(const Hairstyle* style, uint32_t id, Rooting rooting)
{
    float r = random_unit(style->seed, 8 * id);
    Wisp wisp = {.id = id, .rooting = rooting, .reach = 1.0f - 0.14f * r * r};
    const float of[3] = {rooting.weight.x, rooting.weight.y, rooting.weight.z};
    for (int i = 0; i < 3; ++i)
        wisp.length_m +=
            wisp.reach * of[i] * hairstyle_guide_length(style, rooting.triangle->guide[i]);
    return wisp;
}

static void cut(Wisp* wisp, float length_m, bool is_short)
{
    float share = fminf(length_m / fmaxf(wisp->length_m, 1e-6f), 1.0f);
    wisp->is_short = is_short;
    wisp->reach *= share;
    wisp->length_m *= share;
}

// Deals `count` wisps to the set's triangles by area, and grows them.
static void grow_inside(Ribbons* ribbons, const Rest* rest, const StrandSet* set, const Rim* rim,
                        int count)
{
    const Hairstyle* style = rest->style;
    double total = 0, dealt = 0;
    for (int t = 0; t < set->triangle_count; ++t)
        total += (double)triangle_area(style, &style->triangles[set->first_triangle + t]);
    int grown = 0;
    for (int t = 0; t < set->triangle_count && total > 0; ++t) {
        dealt += (double)triangle_area(style, &style->triangles[set->first_triangle + t]);
        int until = (int)floor(dealt / total * count + 0.5);
        if (until > count) until = count;
        for (uint32_t n = 0; grown < until; ++grown, ++n) {
            uint32_t id = (uint32_t)(set->first_strand + grown);
            Vec3 weight = scatter(style->seed, (uint32_t)(set->first_triangle + t), n);
            Wisp wisp = long_wisp(style, id, rim_rooting(rim, style, set, t, weight));
            grow_wisp(ribbons, rest, set, &wisp);
        }
    }
}

// Wisp `id` of those along the rim, at `along` (0..1) of it.
static Wisp rim_wisp(const Hairstyle* style, const StrandSet* set, const Rim* rim, uint32_t id,
                     float along)
{
    float in = random_unit(style->seed, 8 * id + 5), out = random_unit(style->seed, 8 * id + 6);
    float kind = random_unit(style->seed, 8 * id + 7) / SHORT_SHARE;
    Wisp wisp = long_wisp(style, id, rim_place(rim, style, set, along, RIM_M * in * in));
    bool at_parting = wisp.rooting.at_parting;
    wisp.shift_m = out * out * (at_parting ? PARTING_STRAY_ROOT_M : STRAY_ROOT_M);
    if (kind < 1.0f && !at_parting)
        cut(&wisp, SHORT_LEAST_M + (SHORT_MOST_M - SHORT_LEAST_M) * kind * kind, true);
    else
        cut(&wisp, RIM_REACH * wisp.length_m, false);
    return wisp;
}

static void grow_rim(Ribbons* ribbons, const Rest* rest, const StrandSet* set, const Rim* rim,
                     int count)
{
    for (int n = 0; n < count; ++n) {
        uint32_t id = (uint32_t)(set->first_strand + set->strand_count - count + n);
        float along = ((float)n + random_unit(rest->style->seed ^ 0xa17eu, id)) / (float)count;
        Wisp wisp = rim_wisp(rest->style, set, rim, id, along);
        grow_wisp(ribbons, rest, set, &wisp);
    }
}

static bool grow_set(Ribbons* ribbons, const Rest* rest, const StrandSet* set)
{
    Rim rim;
    if (!rim_find(&rim, rest->style, set)) return false;
    int along_rim = rim.edge_count > 0 ? (int)(RIM_SHARE * (float)set->strand_count) : 0;
    grow_inside(ribbons, rest, set, &rim, set->strand_count - along_rim);
    grow_rim(ribbons, rest, set, &rim, along_rim);
    rim_free(&rim);
    return true;
}

static void bind_set(Ribbons* ribbons, const Rest* rest, const StrandSet* set)
{
    const Hairstyle* style = rest->style;
    for (int s = 0; s < set->strand_count; ++s) {
        Strip strip = {.points = set->points};
        begin_ribbon(ribbons, set->points);
        for (int k = 0; k < set->points; ++k) {
            DrawnPoint point;
            drawn_from_bound(&point, style, set, s, k);
            put_point(ribbons, ribbons->point_count + k, &point);
            strip.at[k] = rest_place(rest, &point, NULL);
            strip.along[k] = (float)k / (float)(set->points - 1);
        }
        shape_bound(&strip, set);
        finish_ribbon(ribbons, style, &strip, (uint32_t)(set->first_strand + s));
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
    bool grown = true;
    for (int i = 0; i < style->set_count; ++i) {
        const StrandSet* set = &style->sets[i];
        if (!is_here(style, set)) continue;
        if (set->kind == STRANDS_GROWN) grown &= grow_set(ribbons, &rest, set);
        if (set->kind == STRANDS_EXPLICIT) bind_set(ribbons, &rest, set);
    }
    free(tangents);
    if (grown) return true;
    ribbons_free(ribbons);
    return fault_set(fault, "no memory for the rim of the scalp");
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
