#include "client/ribbons.h"

#include "client/fibres.h"
#include "client/scatter.h"
#include "client/wisp.h"
#include "messages/quantise.h"
#include "messages/random.h"

#include <stdlib.h>
#include <string.h>

// Some wisps stand along the rim, rooted up to STRAY_ROOT_M beyond it. Hair is younger there: they
// are shorter than their guides, and some are very short.
#define RIM_SHARE            0.26f // of the set's wisps
#define RIM_REACH            0.9f  // of their guides' length
#define STRAY_ROOT_M         0.004f
#define PARTING_STRAY_ROOT_M 0.0015f // keeps to its side
#define SHORT_SHARE          0.25f   // of those at the hairline
#define SHORT_LEAST_M        0.010f
#define SHORT_MOST_M         0.030f

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

static void put_point(Ribbons* ribbons, int i, const Strip* strip, int k)
{
    const DrawnPoint* point = &strip->point[k];
    set4(ribbons->guides[i], point->guide[0], point->guide[1], point->guide[2], point->height);
    set4(ribbons->weights[i], point->weight[0], point->weight[1], point->weight[2],
         0.5f * strip->width_m[k]);
    set4(ribbons->offsets[i], point->offset.x, point->offset.y, point->offset.z,
         fminf(strip->fill[k], 1.0f));
}

// Adds one ribbon. Its random number says in quarters which strand texture it shows.
static void add_ribbon(Ribbons* ribbons, const Hairstyle* style, const Strip* strip, uint32_t id)
{
    Vec3 tangents[HAIRSTYLE_MAX_POINTS];
    quantise_strand_tangents(tangents, strip->at, strip->points);
    float random = random_unit(style->seed ^ 0x5eedu, id);
    random = ((float)strip->texture + random) * (1.0f / FIBRES_LAYERS);
    for (int k = 0; k < strip->points; ++k) {
        int i = ribbons->point_count + k;
        Vec3 normal = outward(style, strip->at[k], tangents[k]);
        put_point(ribbons, i, strip, k);
        set4(ribbons->tangents[i], tangents[k].x, tangents[k].y, tangents[k].z, strip->along[k]);
        set4(ribbons->normals[i], normal.x, normal.y, normal.z, random);
        ribbons->indices[ribbons->index_count++] = 2u * (uint32_t)i;
        ribbons->indices[ribbons->index_count++] = 2u * (uint32_t)i + 1u;
    }
    ribbons->indices[ribbons->index_count++] = RIBBONS_RESTART;
    ribbons->point_count += strip->points;
    ribbons->ribbon_count += 1;
}

// Wisp `id` of those along the rim, at `along` (0..1) of it.
static Wisp rim_wisp(const Hairstyle* style, const StrandSet* set, const Rim* rim, uint32_t id,
                     float along)
{
    float in = random_unit(style->seed, 8 * id + 5), out = random_unit(style->seed, 8 * id + 6);
    float kind = random_unit(style->seed, 8 * id + 7) / SHORT_SHARE;
    Wisp wisp = wisp_long(style, id, rim_place(rim, style, set, along, WISP_RIM_M * in * in));
    bool at_parting = wisp.rooting.at_parting;
    wisp.shift_m = out * out * (at_parting ? PARTING_STRAY_ROOT_M : STRAY_ROOT_M);
    if (kind < 1.0f && !at_parting)
        wisp_cut(&wisp, SHORT_LEAST_M + (SHORT_MOST_M - SHORT_LEAST_M) * kind * kind, true);
    else
        wisp_cut(&wisp, RIM_REACH * wisp.length_m, false);
    return wisp;
}

// Wisps over the triangles; the first rows of ids are theirs.
static bool grow_inside(Ribbons* ribbons, const Rest* rest, const WispKind* kind, const Rim* rim,
                        int count)
{
    const StrandSet* set = kind->set;
    ScatterRoot* roots = malloc(((size_t)count + 1) * sizeof *roots);
    int found = roots == NULL ? -1 : scatter_roots(roots, count, rest->style, set, SCATTER_ACROSS);
    for (int n = 0; n < found; ++n) {
        uint32_t id = (uint32_t)(set->first_strand + n);
        Strip strip;
        Wisp wisp =
            wisp_long(rest->style, id,
                      rim_rooting(rim, rest->style, set, roots[n].triangle, roots[n].weight));
        wisp_grow(&strip, rest, kind, &wisp);
        add_ribbon(ribbons, rest->style, &strip, id);
    }
    free(roots);
    return found >= 0;
}

static void grow_rim(Ribbons* ribbons, const Rest* rest, const WispKind* kind, const Rim* rim,
                     int first, int count)
{
    for (int n = 0; n < count; ++n) {
        uint32_t id = (uint32_t)(kind->set->first_strand + first + n);
        float along = ((float)n + random_unit(rest->style->seed ^ 0xa17eu, id)) / (float)count;
        Strip strip;
        Wisp wisp = rim_wisp(rest->style, kind->set, rim, id, along);
        wisp_grow(&strip, rest, kind, &wisp);
        add_ribbon(ribbons, rest->style, &strip, id);
    }
}

static bool grow_set(Ribbons* ribbons, const Rest* rest, int i, Lod lod)
{
    const StrandSet* set = &rest->style->sets[i];
    LodShare share = lod_share(rest->style, set, lod);
    const WispKind kind = {set, &rest->style->forms[i], share.points, share.widen, share.fuller};
    Rim rim;
    if (!rim_find(&rim, rest->style, set)) return false;
    int along_rim = rim.edge_count > 0 ? (int)(RIM_SHARE * (float)share.strands) : 0;
    int inside = share.strands - along_rim;
    bool grown = grow_inside(ribbons, rest, &kind, &rim, inside);
    if (grown) grow_rim(ribbons, rest, &kind, &rim, inside, along_rim);
    rim_free(&rim);
    return grown;
}

static void shape_bound(Strip* strip, const StrandSet* set, const LodShare* share)
{
    for (int k = 0; k < strip->points; ++k) {
        float along = strip->along[k];
        float width = set->root_width_m + (set->tip_width_m - set->root_width_m) * along;
        width *= 0.7f + 0.3f * wisp_leave(along);
        strip->fill[k] = set->fibres * wisp_fibre_width_m(along) / (width > 1e-9f ? width : 1e-9f);
        strip->width_m[k] = width * share->widen;
        strip->fill[k] *= share->fuller;
    }
}

static void bind_set(Ribbons* ribbons, const Rest* rest, const StrandSet* set, Lod lod)
{
    const Hairstyle* style = rest->style;
    LodShare share = lod_share(style, set, lod);
    for (int n = 0; n < share.strands; ++n) {
        int s = (int)((int64_t)n * set->strand_count / share.strands);
        uint32_t id = (uint32_t)(set->first_strand + s);
        Strip strip = {.points = share.points, .texture = (int)(random_hash(id) % FIBRES_LAYERS)};
        for (int k = 0; k < share.points; ++k) {
            int from = (k * (set->points - 1) + (share.points - 1) / 2) / (share.points - 1);
            drawn_from_bound(&strip.point[k], style, set, s, from);
            strip.at[k] = wisp_rest_place(rest, &strip.point[k], NULL);
            strip.along[k] = (float)from / (float)(set->points - 1);
        }
        shape_bound(&strip, set, &share);
        add_ribbon(ribbons, style, &strip, id);
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

static bool allocate_for(Ribbons* ribbons, const Hairstyle* style, Lod lod)
{
    size_t points = 0, indices = 0;
    for (int i = 0; i < style->set_count; ++i) {
        if (!is_here(style, &style->sets[i])) continue;
        LodShare share = lod_share(style, &style->sets[i], lod);
        points += (size_t)share.strands * (size_t)share.points;
        indices += (size_t)share.strands * (2 * (size_t)share.points + 1);
    }
    return allocate(ribbons, points, indices);
}

static bool fill(Ribbons* ribbons, const Rest* rest, Lod lod)
{
    bool filled = true;
    for (int i = 0; i < rest->style->set_count; ++i) {
        const StrandSet* set = &rest->style->sets[i];
        if (!is_here(rest->style, set)) continue;
        if (set->kind == STRANDS_GROWN) filled &= grow_set(ribbons, rest, i, lod);
        if (set->kind == STRANDS_EXPLICIT) bind_set(ribbons, rest, set, lod);
    }
    return filled;
}

// Colliders lie up to so far inside the skin; no more than their hair at rest lets them grow.
#define COLLIDER_LACK_M 0.003f

// A collider keeps out what stands outside it at rest: one that hair is combed through is smaller.
// The head's alone: where the torso is, clients are not told.
static void find_colliders(Ribbons* ribbons, const Rest* rest)
{
    const Hairstyle* style = rest->style;
    for (int c = 0; c < style->collider_count; ++c) {
        Collider collider = style->colliders[c];
        collider.radius += COLLIDER_LACK_M;
        if (collider.body == BODY_HEAD) ribbons->colliders[ribbons->collider_count++] = collider;
    }
    for (int i = 0; i < ribbons->point_count; ++i) {
        DrawnPoint point = ribbons_point(ribbons, i);
        Vec3d at = vec3d_from(wisp_rest_place(rest, &point, NULL));
        for (int c = 0; c < ribbons->collider_count; ++c) {
            float distance = (float)drawn_axis_distance(at, &ribbons->colliders[c]);
            if (distance < ribbons->colliders[c].radius) ribbons->colliders[c].radius = distance;
        }
    }
}

bool ribbons_build_lod(Ribbons* ribbons, const Hairstyle* style, Lod lod, Fault* fault)
{
    memset(ribbons, 0, sizeof *ribbons);
    Vec3* tangents = hairstyle_rest_tangents(style);
    const Rest rest = {style, tangents};
    bool made = tangents != NULL && allocate_for(ribbons, style, lod) && fill(ribbons, &rest, lod);
    if (made) find_colliders(ribbons, &rest);
    free(tangents);
    if (made) return true;
    ribbons_free(ribbons);
    return fault_set(fault, "no memory for the ribbons of style %s", style->name);
}

bool ribbons_build(Ribbons* ribbons, const Hairstyle* style, Fault* fault)
{
    return ribbons_build_lod(ribbons, style, LOD_FULL, fault);
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
