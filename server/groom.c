#include "server/groom.h"

#include "messages/mannequin.h"
#include "messages/trig.h"
#include "server/looks.h"

#include <stdlib.h>
#include <string.h>

// How a built-in style comes about, in this order: roots (a row along each side of the parting, a
// row along the hairline, the rest relaxed between them), scalp triangles (Delaunay on the sphere,
// none across the parting), guides (marched over the skull, then hanging), resampled and cleared.
// What the styles are: server/looks.c.

#define GUIDES          64
#define NODES           8
#define PARTING_PAIRS   5
#define PARTING_GAP_M   0.0015f // half the bare line between the two rows
#define HAIRLINE_GUIDES 19
#define HAIRLINE_SKIN   0.30f // mannequin_scalp at the outermost roots
#define LOOP_POINTS     144
#define MAX_CANDIDATES  1600
#define RELAX_ROUNDS    12
#define STEP_M          0.004f
#define PATH_POINTS     160
#define BAND_NODE       4 // of a tied style: as many links to the band as past it

// Rays from here meet the scalp once.
static const Vec3 MIDDLE = {0.0f, 0.2200f, -0.0150f};

typedef enum RootKind { ROOT_INNER, ROOT_HAIRLINE, ROOT_LEFT, ROOT_RIGHT } RootKind;

// The plan of one head of hair: where guides are rooted and which three share a patch of scalp.
typedef struct Plan {
    const Look* look;
    Vec3 parting_front, parting_back;
    int root_count;
    Vec3 root[GUIDES];
    RootKind kind[GUIDES];
    bool on_edge[GUIDES];
    int candidate_count;
    Vec3 candidate[MAX_CANDIDATES];
    int triangle_count;
    ScalpTriangle triangle[HAIRSTYLE_MAX_TRIANGLES];
} Plan;

static float smooth(float u)
{
    return (float)trig_smooth((double)u);
}

static Vec3 unit(Vec3 v)
{
    return vec3_normalise_or(v, vec3(0, -1, 0));
}

static Vec3 march(Vec3 from, Vec3 direction)
{
    for (int i = 0; i < 60; ++i) {
        float d = mannequin_distance(from);
        from = vec3_mad(from, direction, 0.85f * d);
        if (fabsf(d) < 1e-5f) break;
    }
    return from;
}

// The surface seen from MIDDLE along `direction`.
static Vec3 cast(Vec3 direction)
{
    return march(vec3_mad(MIDDLE, direction, 0.2f), vec3_scale(direction, -1.0f));
}

static Vec3 cast_at(double azimuth, double elevation)
{
    double c = trig_cos(elevation);
    return cast(vec3((float)(trig_sin(azimuth) * c), (float)trig_sin(elevation),
                     (float)(trig_cos(azimuth) * c)));
}

static Vec3 top_at(float x, float z)
{
    return march(vec3(x, 0.40f, z), vec3(0, -1, 0));
}

static void add_root(Plan* plan, Vec3 at, RootKind kind, bool on_edge)
{
    if (plan->root_count == GUIDES) return;
    plan->kind[plan->root_count] = kind;
    plan->on_edge[plan->root_count] = on_edge;
    plan->root[plan->root_count++] = at;
}

// Where the parting meets the forehead's hairline.
static float parting_front_z(float x)
{
    float in = 0.0f, out = 0.095f;
    for (int i = 0; i < 16; ++i) {
        float z = 0.5f * (in + out);
        if (mannequin_scalp(top_at(x + PARTING_GAP_M, z)) > HAIRLINE_SKIN)
            in = z;
        else
            out = z;
    }
    return in;
}

static void lay_parting(Plan* plan)
{
    float x = plan->look->parting_x_m, front = parting_front_z(x), back = plan->look->parting_end_m;
    plan->parting_front = top_at(x, front);
    plan->parting_back = top_at(x, back);
    for (int i = 0; i < PARTING_PAIRS; ++i) {
        float z = front + (back - front) * (float)i / (float)PARTING_PAIRS;
        add_root(plan, top_at(x + PARTING_GAP_M, z), ROOT_LEFT, i == 0);
        add_root(plan, top_at(x - PARTING_GAP_M, z), ROOT_RIGHT, i == 0);
    }
    add_root(plan, plan->parting_back, ROOT_INNER, false);
}

// The outermost scalp at one azimuth: down from the crown, then halved.
static Vec3 hairline_at(double azimuth)
{
    double in = 1.2, out = in;
    while (out > -1.3 && mannequin_scalp(cast_at(azimuth, out)) > HAIRLINE_SKIN) {
        in = out;
        out -= 0.06;
    }
    for (int i = 0; i < 10; ++i) {
        double middle = 0.5 * (in + out);
        if (mannequin_scalp(cast_at(azimuth, middle)) > HAIRLINE_SKIN)
            in = middle;
        else
            out = middle;
    }
    return cast_at(azimuth, in);
}

// Roots at equal distances along the hairline, from the parting's left row round to its right row.
static void lay_hairline(Plan* plan)
{
    Vec3 loop[LOOP_POINTS];
    float along[LOOP_POINTS] = {0};
    double skew = (double)plan->look->parting_x_m / 0.085;
    for (int i = 0; i < LOOP_POINTS; ++i) {
        double u = (double)i / (LOOP_POINTS - 1);
        loop[i] = i == 0                 ? plan->root[0]
                  : i == LOOP_POINTS - 1 ? plan->root[1]
                                         : hairline_at(skew + u * 2.0 * TRIG_PI);
        if (i > 0) along[i] = along[i - 1] + vec3_length(vec3_sub(loop[i], loop[i - 1]));
    }
    for (int k = 1, i = 1; k <= HAIRLINE_GUIDES; ++k) {
        float want = along[LOOP_POINTS - 1] * (float)k / (float)(HAIRLINE_GUIDES + 1);
        while (along[i] < want)
            ++i;
        add_root(plan, loop[i], ROOT_HAIRLINE, true);
    }
}

// A spiral of equal areas over the sphere, kept where hair grows.
static void find_candidates(Plan* plan)
{
    const double golden = 2.39996322972865332;
    for (int i = 0; i < 2400 && plan->candidate_count < MAX_CANDIDATES; ++i) {
        double y = 1.0 - 2.0 * (i + 0.5) / 2400.0, r = sqrt(1.0 - y * y);
        Vec3 at = cast(
            vec3((float)(r * trig_sin(i * golden)), (float)y, (float)(r * trig_cos(i * golden))));
        if (mannequin_scalp(at) > 0.6f) plan->candidate[plan->candidate_count++] = at;
    }
}

static float square_distance(Vec3 a, Vec3 b)
{
    Vec3 d = vec3_sub(a, b);
    return vec3_dot(d, d);
}

static int nearest(const Vec3* points, int count, Vec3 to)
{
    int best = 0;
    for (int i = 1; i < count; ++i)
        if (square_distance(points[i], to) < square_distance(points[best], to)) best = i;
    return best;
}

// The candidate furthest from every root there is.
static Vec3 loneliest(const Plan* plan)
{
    int best = 0;
    float most = -1.0f;
    for (int i = 0; i < plan->candidate_count; ++i) {
        Vec3 at = plan->candidate[i];
        float d = square_distance(at, plan->root[nearest(plan->root, plan->root_count, at)]);
        if (d <= most) continue;
        most = d;
        best = i;
    }
    return plan->candidate[best];
}

// Lloyd's relaxation over the candidates; the parting and the hairline stay.
static void relax(Plan* plan, int first)
{
    Vec3 sum[GUIDES] = {{0}};
    int members[GUIDES] = {0};
    for (int i = 0; i < plan->candidate_count; ++i) {
        int owner = nearest(plan->root, plan->root_count, plan->candidate[i]);
        sum[owner] = vec3_add(sum[owner], plan->candidate[i]);
        ++members[owner];
    }
    for (int i = first; i < plan->root_count; ++i)
        if (members[i] > 0) {
            Vec3 mean = vec3_scale(sum[i], 1.0f / (float)members[i]);
            plan->root[i] = cast(unit(vec3_sub(mean, MIDDLE)));
        }
}

static void lay_inner(Plan* plan)
{
    find_candidates(plan);
    int first = plan->root_count;
    while (plan->root_count < GUIDES)
        add_root(plan, loneliest(plan), ROOT_INNER, false);
    for (int round = 0; round < RELAX_ROUNDS; ++round)
        relax(plan, first);
}

// Delaunay on the sphere is the convex hull of the directions. By trial of every triple: 64 roots
// make 2.7 million tests, 10 ms once, against a page of incremental hull.
static bool is_hull_face(const Vec3d* at, int count, int a, int b, int c, bool* flip)
{
    Vec3d n = vec3d_cross(vec3d_sub(at[b], at[a]), vec3d_sub(at[c], at[a]));
    double level = vec3d_dot(n, at[a]);
    *flip = level < 0.0;
    for (int i = 0; i < count; ++i) {
        double over = vec3d_dot(n, at[i]) - level;
        if (i != a && i != b && i != c && (*flip ? -over : over) > 0.0) return false;
    }
    return true;
}

// Faces over the neck and face, and those that would grow hair across the parting.
static bool is_bare(const Plan* plan, const int corner[3])
{
    bool left = false, right = false;
    Vec3 sum = {0, 0, 0};
    for (int i = 0; i < 3; ++i) {
        left |= plan->kind[corner[i]] == ROOT_LEFT;
        right |= plan->kind[corner[i]] == ROOT_RIGHT;
        sum = vec3_add(sum, vec3_sub(plan->root[corner[i]], MIDDLE));
    }
    bool edge = plan->on_edge[corner[0]] && plan->on_edge[corner[1]] && plan->on_edge[corner[2]];
    if (left && right && !plan->look->is_tied) return true;
    return edge && mannequin_scalp(cast(unit(sum))) < 0.30f;
}

static void triangulate(Plan* plan)
{
    Vec3d at[GUIDES];
    for (int i = 0; i < plan->root_count; ++i)
        at[i] = vec3d_from(unit(vec3_sub(plan->root[i], MIDDLE)));
    for (int a = 0; a < plan->root_count; ++a)
        for (int b = a + 1; b < plan->root_count; ++b)
            for (int c = b + 1; c < plan->root_count; ++c) {
                const int corner[3] = {a, b, c};
                bool flip;
                if (!is_hull_face(at, plan->root_count, a, b, c, &flip)) continue;
                if (is_bare(plan, corner) || plan->triangle_count == HAIRSTYLE_MAX_TRIANGLES)
                    continue;
                plan->triangle[plan->triangle_count++] = (ScalpTriangle){
                    {(uint16_t)a, (uint16_t)(flip ? c : b), (uint16_t)(flip ? b : c)}};
            }
}

// From the nearest point of the parting, seen from above: over the curve of the skull the height
// would drown the few millimetres that tell the two rows apart.
static Vec3 from_parting(const Plan* plan, Vec3 p)
{
    float z = p.z;
    z = z > plan->parting_front.z ? plan->parting_front.z : z;
    z = z < plan->parting_back.z ? plan->parting_back.z : z;
    return vec3(p.x - plan->look->parting_x_m, 0, p.z - z);
}

static Vec3 tangent(Vec3 v, Vec3 normal)
{
    return vec3_mad(v, normal, -vec3_dot(v, normal));
}

// The comb, along the skin: away from the parting, turning back towards its end so that the two
// sides meet in a fan and not in a seam (bit by bit: turned only at the end, a tuft stood up
// there); back where there is a face below; down behind the crown.
static Vec3 comb(const Plan* plan, Vec3 p, Vec3 normal)
{
    float run = plan->parting_front.z - plan->parting_back.z;
    float u = (plan->parting_front.z - p.z) / run;
    u = u < 0.0f ? 0.0f : u > 1.0f ? 1.0f : u;
    float back = plan->look->sweep * smooth((p.z + 0.03f) / 0.08f) + (0.75f + 0.95f * u) * u;
    float down = smooth((0.315f - p.y) / 0.06f) * (1.0f - smooth(p.z / 0.05f));
    // Under the back of the skull "away" and "back" would point up and across along the skin.
    float level = 1.0f - 0.95f * down;
    if (p.x < plan->look->parting_x_m) // the fuller side of the parting falls over the forehead
        down += plan->look->fringe * smooth((p.z - 0.03f) / 0.04f) * smooth((p.y - 0.240f) / 0.03f);
    Vec3 away = unit(from_parting(plan, p));
    Vec3 along = vec3_scale(vec3_add(away, vec3(0, 0, -back)), level);
    return unit(tangent(vec3_add(along, vec3(0, -down, 0)), normal));
}

// What hanging hair is drawn to: a depth behind the shoulders, the neck it hugs above them, and
// inward near the tips.
static Vec3 hanging(const Look* look, Vec3 p, float hem)
{
    float low = smooth((0.215f - p.y) / 0.10f);
    float off = (p.z - look->gather_z_m) / 0.06f;
    off = off < -1.0f ? -1.0f : off > 1.0f ? 1.0f : off;
    float turn = look->curl * smooth((hem + look->curl_m - p.y) / look->curl_m);
    turn += look->hug * smooth((0.225f - p.y) / 0.06f) * smooth((p.y - 0.03f) / 0.06f);
    Vec3 inward = unit(vec3(-p.x, 0, -0.02f - p.z));
    return vec3_add(vec3(0, -1.0f, -look->gather * low * off), vec3_scale(inward, turn));
}

static float hem_at(const Look* look, Vec3 p)
{
    float front = smooth((p.z + 0.10f) / 0.16f), side = smooth(fabsf(p.x) / 0.12f);
    return look->hem_m + look->hem_front_m * front + look->hem_side_m * side;
}

// Along the skin towards the band; past it away from the head, and soon down.
static Vec3 tied_heading(const Look* look, Vec3 p, float past)
{
    if (past > 0.0f) {
        Vec3 away = unit(vec3_sub(look->band, MIDDLE));
        return unit(vec3_lerp(away, vec3(0, -1, 0), smooth(0.25f + past / 0.09f)));
    }
    Vec3 way = vec3_sub(look->band, p);
    float near = smooth(vec3_length(way) / 0.06f);
    return unit(vec3_lerp(way, tangent(way, mannequin_normal(p)), near));
}

// Marches one tied strand from its root to the band, where it has its own place, and on; `at_band`
// is the path's point there.
static int grow_tied(const Plan* plan, Vec3 root, Vec3* path, int* at_band)
{
    const Look* look = plan->look;
    Vec3 axis = unit(vec3_sub(look->band, MIDDLE));
    Vec3 from = tangent(vec3_sub(root, look->band), axis);
    float spread = vec3_length(from) / 0.10f;
    Vec3 place = vec3_mad(look->band, unit(from), look->band_m * (spread < 1.0f ? spread : 1.0f));
    Look own = *look; // whose band is this strand's place in it
    own.band = place;
    int count = 0;
    Vec3 p = path[count++] = root;
    while (count < PATH_POINTS / 2 && vec3_length(vec3_sub(place, p)) > STEP_M) {
        float along = STEP_M * (float)count;
        p = vec3_mad(p, tied_heading(&own, p, 0.0f), STEP_M);
        float lack = look->lift_m * smooth(along / 0.05f) - mannequin_distance(p);
        if (lack > 0.0f) p = vec3_mad(p, mannequin_normal(p), lack);
        path[count++] = p;
    }
    path[count - 1] = place;
    *at_band = count - 1;
    // Not all tips at one height: a tail ends in a point.
    float length = look->least_m + (look->most_m - look->least_m) * (1.0f - 0.7f * spread);
    p = place;
    for (float past = STEP_M; past < length && count < PATH_POINTS; past += STEP_M) {
        p = vec3_mad(p, tied_heading(&own, p, past), STEP_M);
        path[count++] = p;
    }
    return count;
}

static Vec3 heading(const Plan* plan, Vec3 p, float along, float lift)
{
    const Look* look = plan->look;
    Vec3 normal = mannequin_normal(p);
    float off = mannequin_distance(p) - lift;
    float front = smooth((p.z - look->face_m) / 0.025f);
    float weight = 0.10f + 0.90f * smooth(along / 0.16f);
    weight *= 1.0f - 0.9f * front;
    float loose = smooth((off - 0.002f) / 0.012f) * (1.0f - front);
    weight = weight + (1.0f - weight) * loose;
    Vec3 hang = hanging(look, p, hem_at(look, p));
    return unit(
        vec3_add(vec3_scale(comb(plan, p, normal), 1.0f - weight), vec3_scale(hang, weight)));
}

// Off the skin by at least `lift`; hair over the skull is also kept from flying off it.
static Vec3 keep_off(Vec3 p, float lift)
{
    for (int i = 0; i < 3; ++i) {
        float off = mannequin_distance(p) - lift;
        if (off < 0.0f) p = vec3_mad(p, mannequin_normal(p), -off);
    }
    float off = mannequin_distance(p) - lift, over = smooth((p.y - 0.235f) / 0.04f);
    if (off > 0.0f) p = vec3_mad(p, mannequin_normal(p), -0.3f * over * off);
    return p;
}

// Marches one strand from its root; returns how many points.
static int grow(const Plan* plan, Vec3 root, Vec3* path)
{
    const Look* look = plan->look;
    int count = 0;
    path[count++] = root;
    Vec3 p = root;
    Vec3 normal = mannequin_normal(root);
    // Rises at the crown, but not so that a parting becomes a ditch; lies flat at the nape, where
    // hair from above has to pass over it.
    float rise = 0.10f + 0.12f * smooth((root.y - 0.17f) / 0.12f);
    Vec3 direction = unit(vec3_mad(comb(plan, root, normal), normal, rise));
    for (float along = STEP_M; along < look->most_m && count < PATH_POINTS; along += STEP_M) {
        float lift = look->lift_m * smooth(along / 0.08f + 0.10f);
        Vec3 want = heading(plan, p, along, lift);
        direction = unit(vec3_lerp(direction, want, 0.30f));
        Vec3 next = keep_off(vec3_mad(p, direction, STEP_M), lift);
        direction = unit(vec3_sub(next, p));
        p = vec3_mad(p, direction, STEP_M);
        path[count++] = p;
        if (p.y < hem_at(look, p) && along > look->least_m) break;
    }
    return count;
}

// `nodes` points at equal arc lengths along the path.
static void resample(const Vec3* path, int count, Vec3* out, int nodes)
{
    float total = 0.0f, before = 0.0f;
    for (int i = 1; i < count; ++i)
        total += vec3_length(vec3_sub(path[i], path[i - 1]));
    out[0] = path[0];
    for (int k = 1, i = 1; k < nodes; ++k) {
        float want = total * (float)k / (float)(nodes - 1);
        float step = vec3_length(vec3_sub(path[i], path[i - 1]));
        while (i < count - 1 && before + step < want) {
            before += step;
            ++i;
            step = vec3_length(vec3_sub(path[i], path[i - 1]));
        }
        float u = step > 0.0f ? (want - before) / step : 0.0f;
        out[k] = vec3_lerp(path[i - 1], path[i], u < 1.0f ? u : 1.0f);
    }
}

static void push(Vec3* node, Vec3 at, float by)
{
    *node = vec3_mad(*node, mannequin_normal(at), by);
}

// Long segments cut corners of the skull that the path went round: nodes move out until the
// polyline, too, is outside: of the first `count`.
static void clear_segments(Vec3* nodes, int count)
{
    for (int round = 0; round < 24; ++round)
        for (int i = 1; i < count; ++i) {
            float lack = 0.0060f - mannequin_distance(nodes[i]);
            if (lack > 0.0f) push(&nodes[i], nodes[i], lack);
            for (int q = 1; q < 4; ++q) {
                float least = i == 1 ? 0.0012f * (float)q : 0.0045f;
                Vec3 at = vec3_lerp(nodes[i - 1], nodes[i], 0.25f * (float)q);
                lack = least - mannequin_distance(at);
                if (lack <= 0.0f) continue;
                push(&nodes[i], at, lack * (i == 1 ? 1.0f : 0.6f));
                if (i > 1) push(&nodes[i - 1], at, lack * 0.6f);
            }
        }
}

static void grow_guides(const Plan* plan, Hairstyle* style)
{
    Vec3 path[PATH_POINTS];
    for (int g = 0; g < style->guide_count; ++g) {
        Vec3* nodes = style->rest + g * NODES;
        int count = grow(plan, plan->root[g], path);
        resample(path, count, nodes, NODES);
        clear_segments(nodes, NODES);
        style->weight[g * NODES + 1] = 60; // of 255: stiff at the root, so that partings hold
    }
}

// Combed tight over the skull; the band hangs in the hair alone, and past it all is free.
static void tie_guides(const Plan* plan, Hairstyle* style)
{
    Vec3 path[PATH_POINTS];
    for (int g = 0; g < style->guide_count; ++g) {
        Vec3* nodes = style->rest + g * NODES;
        int at_band, count = grow_tied(plan, plan->root[g], path, &at_band);
        resample(path, at_band + 1, nodes, BAND_NODE + 1);
        clear_segments(nodes, BAND_NODE);
        resample(path + at_band, count - at_band, nodes + BAND_NODE, NODES - BAND_NODE);
        static const uint8_t combed[BAND_NODE] = {0, 0, 60, 140};
        memcpy(style->weight + g * NODES, combed, sizeof combed);
    }
    style->holds[style->hold_count++] = (Hold){HOLD_BAND, 0, style->guide_count, BAND_NODE};
}

static void fill_set(Hairstyle* style, const Look* look)
{
    style->set_count = 1;
    style->sets[0] = (StrandSet){
        .name = "hair",
        .kind = STRANDS_GROWN,
        .guide_count = style->guide_count,
        .triangle_count = style->triangle_count,
        .strand_count = look->wisps,
        .points = look->points,
        .root_width_m = look->root_width_m,
        .tip_width_m = look->tip_width_m,
        .fibres = look->fibres,
        .jitter_m = look->jitter_m,
    };
    style->forms[0] = look->form;
    style->magnet_count = look->magnet.pull != 0.0f;
    style->magnets[0] = look->magnet;
}

static uint8_t map_value(float factor)
{
    return (uint8_t)(factor * MAP_ONE + 0.5f);
}

// Shorter, and cut closer, towards the nape and over the ears.
static bool fill_maps(Hairstyle* style, const Look* look, Fault* fault)
{
    if (look->nape_length == 0.0f) return true;
    if (!hairstyle_add_maps(style, fault)) return false;
    for (int g = 0; g < style->guide_count; ++g) {
        Vec3 root = style->rest[g * style->nodes];
        float high = smooth((root.y - 0.175f) / 0.10f);
        float length = look->nape_length + (1.0f - look->nape_length) * high;
        style->maps[g * MAP_COUNT + MAP_LENGTH] = map_value(length);
    }
    return true;
}

static bool fill_style(const Plan* plan, Hairstyle* style, Fault* fault)
{
    if (!hairstyle_set_guides(style, plan->root_count, NODES, fault)) return false;
    style->triangles = malloc((size_t)plan->triangle_count * sizeof *style->triangles);
    if (!style->triangles) return fault_set(fault, "groom: out of memory; free some memory");
    style->triangle_count = plan->triangle_count;
    memcpy(style->triangles, plan->triangle,
           (size_t)plan->triangle_count * sizeof *style->triangles);
    memcpy(style->name, plan->look->name, strlen(plan->look->name) + 1);
    style->seed = plan->look->seed;
    if (plan->look->is_tied)
        tie_guides(plan, style);
    else
        grow_guides(plan, style);
    fill_set(style, plan->look);
    if (!fill_maps(style, plan->look, fault)) return false;
    style->collider_count = mannequin_colliders(style->colliders, HAIRSTYLE_MAX_COLLIDERS);
    style->material.root_colour = plan->look->root_colour;
    style->material.tip_colour = plan->look->tip_colour;
    style->head_kind = HEAD_MANNEQUIN;
    style->head_centre = MANNEQUIN_CENTRE;
    hairstyle_fit_box(style);
    return hairstyle_validate(style, fault);
}

static Hairstyle* make(const Look* look, Fault* fault)
{
    Plan* plan = calloc(1, sizeof *plan);
    Hairstyle* style = hairstyle_create();
    bool made = plan && style;
    if (!made) fault_set(fault, "groom: out of memory; free some memory");
    if (made) {
        plan->look = look;
        lay_parting(plan);
        lay_hairline(plan);
        lay_inner(plan);
        triangulate(plan);
        made = fill_style(plan, style, fault);
    }
    free(plan);
    if (made) return style;
    hairstyle_destroy(style);
    return NULL;
}

Hairstyle* groom_long(Fault* fault)
{
    return make(&looks[LOOK_LONG], fault);
}

Hairstyle* groom_bob(Fault* fault)
{
    return make(&looks[LOOK_BOB], fault);
}

Hairstyle* groom_ponytail(Fault* fault)
{
    return make(&looks[LOOK_PONYTAIL], fault);
}

Hairstyle* groom_curly(Fault* fault)
{
    return make(&looks[LOOK_CURLY], fault);
}

Hairstyle* groom_short(Fault* fault)
{
    return make(&looks[LOOK_SHORT], fault);
}
