#include "client/wisp.h"

#include "client/fibres.h"
#include "client/scatter.h"
#include "messages/mannequin.h"
#include "messages/random.h"
#include "messages/trig.h"

// Diameter of one drawn hair, metres: 0.16 mm at the root to 0.04 mm at the tip, twice a real
// hair's, as in the path-traced reference. Thinner hair shows the scalp, thicker looks like rope.
#define FIBRE_ROOT_M 0.00016f
#define FIBRE_TIP_M  0.00004f

// Where the scalp ends, hair does not begin at once: over the first WISP_RIM_M from the rim wisps
// are narrow, and thin for the first FADE_M from their roots. A parting is a narrow line, so roots
// there are nearly as full as elsewhere.
#define FADE_M           0.010f
#define PARTING_PRESENCE 1.0f
#define RIM_WIDEST_M     0.004f // of a root there, however wide wisps are

// From a wisp's root to its next point: nearer only where even points are, further on the longest.
#define FIRST_EDGE_M 0.008f

// Wisps keep this far from the skin, metres; less and the strip's edges cut into it.
#define SKIN_CLEARANCE_M 0.002f

// Wisps gather in locks, which curl and wave as one: so many on a patch of scalp.
#define LOCK_M2    0.00016
#define MOST_LOCKS 8

#define CURL_POINTS 20 // of a wisp that shows its curls

#define TURN 6.2831853f

// Axes across a wisp, carried along it without twist.
typedef struct Across {
    Vec3 side, up;
} Across;

// The lock that a wisp belongs to.
typedef struct Lock {
    uint32_t id;
    Vec3 weight; // its middle, in the wisp's triangle
} Lock;

float wisp_fibre_width_m(float along)
{
    return FIBRE_ROOT_M + (FIBRE_TIP_M - FIBRE_ROOT_M) * along;
}

float wisp_leave(float along)
{
    return (float)trig_smooth((double)along * 8.0);
}

Vec3 wisp_rest_place(const Rest* rest, const DrawnPoint* point, Vec3* tangent)
{
    Vec3d along;
    Vec3d at = drawn_position(point, rest->style->nodes, rest->style->rest, rest->tangents,
                              rest->tangents, &along);
    if (tangent != NULL) *tangent = vec3_from(along);
    return vec3_from(at);
}

Wisp wisp_long(const Hairstyle* style, uint32_t id, Rooting rooting)
{
    float r = random_unit(style->seed, 8 * id);
    Wisp wisp = {.id = id, .rooting = rooting, .reach = 1.0f - 0.14f * r * r};
    float map = scatter_map(style, rooting.triangle, rooting.weight, MAP_LENGTH);
    if (map < 1.0f) wisp.reach *= map;
    const float of[3] = {rooting.weight.x, rooting.weight.y, rooting.weight.z};
    for (int i = 0; i < 3; ++i)
        wisp.length_m +=
            wisp.reach * of[i] * hairstyle_guide_length(style, rooting.triangle->guide[i]);
    return wisp;
}

void wisp_cut(Wisp* wisp, float length_m, bool is_short)
{
    float share = length_m / (wisp->length_m > 1e-6f ? wisp->length_m : 1e-6f);
    if (share > 1.0f) share = 1.0f;
    wisp->is_short = is_short;
    wisp->reach *= share;
    wisp->length_m *= share;
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

// Curls take even points, where there are enough: none is more bent than another.
static float along_curl(int k, int points, float length_m, const WispForm* form)
{
    bool curls = form->curl_radius_m > 0.0f && points >= CURL_POINTS;
    return curls ? (float)k / (float)(points - 1) : along_of(k, points, length_m);
}

static Across across_first(Vec3 tangent)
{
    Vec3 side = vec3_normalise_or(vec3_cross(tangent, vec3(0.31f, 0.17f, 0.93f)), vec3(1, 0, 0));
    return (Across){side, vec3_cross(side, tangent)};
}

static Across across_next(Across before, Vec3 tangent)
{
    Vec3 side = vec3_mad(before.side, tangent, -vec3_dot(before.side, tangent));
    side = vec3_normalise_or(side, across_first(tangent).side);
    return (Across){side, vec3_cross(side, tangent)};
}

static Lock find_lock(const Rest* rest, const Wisp* wisp)
{
    const Hairstyle* style = rest->style;
    const ScalpTriangle* triangle = wisp->rooting.triangle;
    Vec3 root[3];
    for (int i = 0; i < 3; ++i)
        root[i] = style->rest[(size_t)triangle->guide[i] * (size_t)style->nodes];
    Vec3 ab = vec3_sub(root[1], root[0]), ac = vec3_sub(root[2], root[0]);
    double locks = 0.5 * (double)vec3_length(vec3_cross(ab, ac)) / LOCK_M2;
    int count = locks < 1.0 ? 1 : locks > MOST_LOCKS ? MOST_LOCKS : (int)(locks + 0.5);
    uint32_t first = (uint32_t)(triangle - style->triangles) * MOST_LOCKS;
    Vec3 own = vec3_mad(vec3_scale(ab, wisp->rooting.weight.y), ac, wisp->rooting.weight.z);
    Lock best = {first, {0, 0, 0}};
    float least = 1e9f;
    for (int n = 0; n < count; ++n) {
        uint32_t id = first + (uint32_t)n;
        float u = random_unit(style->seed ^ 0x10c4u, 2 * first) + 0.75487766624669276f * (float)n;
        float v = random_unit(style->seed ^ 0x10c4u, 2 * first + 1);
        v += 0.56984029099805327f * (float)n;
        u -= floorf(u), v -= floorf(v);
        if (u + v > 1.0f) u = 1.0f - u, v = 1.0f - v;
        Vec3 from = vec3_sub(vec3_mad(vec3_scale(ab, u), ac, v), own);
        if (vec3_dot(from, from) >= least) continue;
        least = vec3_dot(from, from);
        best = (Lock){id, vec3(1.0f - u - v, u, v)};
    }
    return best;
}

// Where the wisp strays to at `along`: a lean of its own, growing to the tip, and a slow wave.
static Vec3 stray(const StrandSet* set, uint32_t seed, const Wisp* wisp, float along,
                  const Across* across)
{
    uint32_t draw = 8 * wisp->id;
    float reach = set->jitter_m * along * (0.4f + 0.6f * along);
    float a = random_signed(seed, draw + 1), b = random_signed(seed, draw + 2);
    float phase = TURN * random_unit(seed, draw + 3);
    float turns = 1.0f + 1.5f * random_unit(seed, draw + 4);
    float wave = 0.35f * (float)trig_sin((double)(phase + TURN * turns * along));
    if (wisp->is_short) reach *= 0.6f, wave = 0.0f;
    return vec3_add(vec3_scale(across->side, reach * (a + wave)),
                    vec3_scale(across->up, reach * (b - wave)));
}

// Onto a cylinder (Koster 2004): `curl_turns` round it, opening from the root as stiff hair does
// late. A lock winds as one; the patch direction is where it begins, its wisps are turned from that
// by up to rotation_rad.
static Vec3 curl(const Rest* rest, const WispKind* kind, const Wisp* wisp, const Lock* lock,
                 float along, const Across* across)
{
    const WispForm* form = kind->form;
    uint32_t seed = rest->style->seed ^ 0xc041u;
    float map =
        scatter_map(rest->style, wisp->rooting.triangle, wisp->rooting.weight, MAP_ROTATION);
    float turns = form->curl_turns * (0.8f + 0.4f * random_unit(seed, 4 * lock->id));
    float most = (float)(kind->points - 1) / 6.0f; // what so many points can show
    turns = turns > most ? most : turns < -most ? -most : turns;
    if (random_unit(seed, 4 * lock->id + 1) < 0.5f) turns = -turns;
    float phase = TURN * random_unit(seed, 4 * lock->id + 2);
    phase += map * form->rotation_rad * random_signed(seed, 0x80000000u + wisp->id);
    float late = 0.6f * form->curl_stiffness;
    float open = (float)trig_smooth((double)((along - late) / (0.35f * (1.0f - late))));
    float radius = form->curl_radius_m * open * (0.7f + 0.6f * random_unit(seed, 4 * lock->id + 3));
    double angle = (double)(phase + TURN * turns * along);
    Vec3 out = vec3_scale(across->side, radius * (float)trig_cos(angle));
    return vec3_mad(out, across->up, radius * (float)trig_sin(angle));
}

// Towards the middle of the lock, at the tip by the share `clump`.
static Vec3 gather(const Rest* rest, const WispKind* kind, const Lock* lock, DrawnPoint point,
                   Vec3 base, float along)
{
    if (kind->form->clump == 0.0f) return vec3(0, 0, 0);
    point.weight[0] = lock->weight.x;
    point.weight[1] = lock->weight.y;
    point.weight[2] = lock->weight.z;
    Vec3 middle = wisp_rest_place(rest, &point, NULL);
    return vec3_scale(vec3_sub(middle, base),
                      kind->form->clump * (float)trig_smooth((double)along * 1.6));
}

// Growth magnets: the nearer and the further from the root, the more.
static Vec3 attract(const Hairstyle* style, Vec3 place, float along)
{
    for (int i = 0; i < style->magnet_count; ++i) {
        const Magnet* magnet = &style->magnets[i];
        Vec3 to = vec3_sub(magnet->at, place);
        float reach = magnet->reach_m > 1e-6f ? magnet->reach_m : 1e-6f;
        float near = (float)trig_smooth((double)(1.0f - vec3_length(to) / reach));
        place = vec3_mad(place, to, magnet->pull * near * along * along);
    }
    return place;
}

// How much of a wisp is there: 1 but near the root of one that stands near the rim.
static float presence(const Wisp* wisp, float from_root_m)
{
    float inside = (float)trig_smooth((double)(wisp->rooting.inside_m / WISP_RIM_M));
    float grown = (float)trig_smooth((double)(from_root_m / FADE_M));
    float least = wisp->rooting.at_parting ? PARTING_PRESENCE : 0.0f;
    return fmaxf(inside + (1.0f - inside) * grown, least);
}

// The profile: between the set's two widths, a belly in the middle, less at the tip.
static float profile(const StrandSet* set, const WispForm* form, float along)
{
    float width = set->root_width_m + (set->tip_width_m - set->root_width_m) * along;
    width *= 0.7f + 0.3f * wisp_leave(along);
    width *= 1.0f + form->belly * 4.0f * along * (1.0f - along);
    return width * (1.0f - form->taper * along * along * along);
}

// Wide ribbons begin narrower: their square ends would stand off the crown.
static float widened(const WispKind* kind, float along)
{
    return 1.0f + (kind->widen - 1.0f) * (0.4f + 0.6f * wisp_leave(along));
}

static void shape_wisp(Strip* strip, const Hairstyle* style, const WispKind* kind, const Wisp* wisp)
{
    const Rooting* rooting = &wisp->rooting;
    float map = scatter_map(style, rooting->triangle, rooting->weight, MAP_WIDTH);
    float from_root_m = 0.0f;
    for (int k = 0; k < strip->points; ++k) {
        if (k > 0) from_root_m += vec3_length(vec3_sub(strip->at[k], strip->at[k - 1]));
        float along = strip->along[k], here = presence(wisp, from_root_m);
        float width = map * profile(kind->set, kind->form, along);
        // Hair is densest where it grows: wisps are full at the root, so that little scalp shows.
        float fill =
            kind->set->fibres * wisp_fibre_width_m(along) / (width > 1e-6f ? width : 1e-6f);
        fill = fmaxf(fill, 0.85f - 0.85f * wisp_leave(along));
        width *= widened(kind, along);
        fill *= kind->fuller;
        if (here < 1.0f && width > RIM_WIDEST_M)
            width = RIM_WIDEST_M + (width - RIM_WIDEST_M) * here;
        strip->width_m[k] = width * (0.6f + 0.4f * here);
        strip->fill[k] = fminf(fill, 1.0f) * (0.5f + 0.5f * here);
    }
}

static void shape_short(Strip* strip, const WispKind* kind)
{
    for (int k = 0; k < strip->points; ++k) {
        strip->width_m[k] = 3.0f * wisp_fibre_width_m(strip->along[k]) * kind->widen;
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
    if (along == 0.0f) return place;
    if (style->head_kind != HEAD_MANNEQUIN)
        return vec3_from(
            drawn_push_out(vec3d_from(place), style->colliders, style->collider_count));
    float clear = SKIN_CLEARANCE_M * (wisp->is_short ? 0.5f * along : 1.0f);
    return mannequin_distance(place) < clear ? mannequin_project(place, clear) : place;
}

static int points_of(const Hairstyle* style, const WispKind* kind, const Wisp* wisp)
{
    float map = scatter_map(style, wisp->rooting.triangle, wisp->rooting.weight, MAP_SEGMENTS);
    int points = 1 + (int)(map * (float)(kind->points - 1) + 0.5f);
    return points > kind->points ? kind->points : points < 2 ? 2 : points;
}

// As the map says at one of the root's guides: nearer ones are likelier.
static int texture_of(const Hairstyle* style, const Wisp* wisp)
{
    float chance = random_unit(style->seed ^ 0x7e47u, 2 * wisp->id);
    int any = (int)(random_unit(style->seed ^ 0x7e47u, 2 * wisp->id + 1) * FIBRES_LAYERS);
    if (style->maps == NULL) return any;
    Vec3 weight = wisp->rooting.weight;
    int i = chance < weight.x ? 0 : chance < weight.x + weight.y ? 1 : 2;
    int map = style->maps[wisp->rooting.triangle->guide[i] * MAP_COUNT + MAP_TEXTURE];
    return map == 0 ? any : (map - 1) % FIBRES_LAYERS;
}

// What the wisp does besides following its guides, from `base` on.
static Vec3 shaped(const Rest* rest, const WispKind* kind, const Wisp* wisp, const Lock* lock,
                   const DrawnPoint* point, Vec3 base, float along, const Across* across)
{
    Vec3 place = vec3_add(base, stray(kind->set, rest->style->seed, wisp, along, across));
    if (wisp->is_short) return place;
    place = vec3_add(place, gather(rest, kind, lock, *point, base, along));
    if (kind->form->curl_radius_m > 0.0f)
        place = vec3_add(place, curl(rest, kind, wisp, lock, along, across));
    return attract(rest->style, place, along);
}

void wisp_grow(Strip* strip, const Rest* rest, const WispKind* kind, const Wisp* wisp)
{
    const Hairstyle* style = rest->style;
    const uint16_t* guide = wisp->rooting.triangle->guide;
    Vec3 weight = wisp->rooting.weight, lift = {0, 0, 0};
    Lock lock = find_lock(rest, wisp);
    Across across = {{0, 0, 0}, {0, 0, 0}};
    strip->points = points_of(style, kind, wisp);
    strip->texture = texture_of(style, wisp);
    for (int k = 0; k < strip->points; ++k) {
        float along = along_curl(k, strip->points, wisp->length_m, kind->form);
        DrawnPoint point = {.guide = {guide[0], guide[1], guide[2]},
                            .weight = {weight.x, weight.y, weight.z},
                            .height = wisp->reach * along * (float)(style->nodes - 1)};
        Vec3 tangent, base = wisp_rest_place(rest, &point, &tangent);
        across = k == 0 ? across_first(tangent) : across_next(across, tangent);
        Vec3 place = shaped(rest, kind, wisp, &lock, &point, base, along, &across);
        if (k == 0) lift = root_lift(style, wisp, place);
        // A short wisp would fold if its tip did not come along.
        place = vec3_mad(place, lift, wisp->is_short ? 1.0f : (1.0f - along) * (1.0f - along));
        place = off_skin(style, wisp, place, along);
        point.offset = vec3_sub(place, base);
        strip->point[k] = point;
        strip->at[k] = place;
        strip->along[k] = along;
    }
    if (wisp->is_short)
        shape_short(strip, kind);
    else
        shape_wisp(strip, style, kind, wisp);
}
