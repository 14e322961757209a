#include "client/scatter.h"

#include "messages/random.h"

#include <math.h>
#include <stdlib.h>

#define TRIES    24    // darts that may miss before they are allowed nearer to each other
#define RELAX    0.88f // and by how much
#define NEAREST  0.08f // of the widest spacing: below that any place will do
#define FEW      12    // from so many roots on a triangle is used to its corners
#define FEW_PART 0.35f // of its circle that a single root may be in

typedef struct Darts {
    const Hairstyle* style;
    const StrandSet* set;
    ScatterRoot* roots;
    Vec3* at;    // where those are
    int* first;  // of each triangle's roots
    int count;   // thrown so far
    bool across; // look into neighbours
} Darts;

float scatter_map(const Hairstyle* style, const ScalpTriangle* triangle, Vec3 weight, ScalpMap map)
{
    if (style->maps == NULL) return 1.0f;
    const float of[3] = {weight.x, weight.y, weight.z};
    float sum = 0.0f;
    for (int i = 0; i < 3; ++i)
        sum += of[i] * (float)style->maps[triangle->guide[i] * MAP_COUNT + map];
    return sum * (1.0f / MAP_ONE);
}

static const ScalpTriangle* triangle_of(const Hairstyle* style, const StrandSet* set, int t)
{
    return &style->triangles[set->first_triangle + t];
}

static Vec3 corner(const Hairstyle* style, const ScalpTriangle* triangle, int i)
{
    return style->rest[(size_t)triangle->guide[i] * (size_t)style->nodes];
}

static Vec3 place(const Hairstyle* style, const ScalpTriangle* triangle, Vec3 weight)
{
    Vec3 sum = vec3_scale(corner(style, triangle, 0), weight.x);
    sum = vec3_mad(sum, corner(style, triangle, 1), weight.y);
    return vec3_mad(sum, corner(style, triangle, 2), weight.z);
}

static float area(const Hairstyle* style, const ScalpTriangle* triangle)
{
    Vec3 a = corner(style, triangle, 0);
    Vec3 ab = vec3_sub(corner(style, triangle, 1), a), ac = vec3_sub(corner(style, triangle, 2), a);
    return 0.5f * vec3_length(vec3_cross(ab, ac));
}

// Square metres of full density.
static double room(const Hairstyle* style, const ScalpTriangle* triangle)
{
    Vec3 middle = {1.0f / 3.0f, 1.0f / 3.0f, 1.0f / 3.0f};
    return (double)area(style, triangle) *
           (double)scatter_map(style, triangle, middle, MAP_DENSITY);
}

static Vec3 fold(float u, float v)
{
    if (u + v > 1.0f) u = 1.0f - u, v = 1.0f - v;
    return vec3(1.0f - u - v, u, v);
}

// Whether the density map lets a root stand there: by a random number, as often as the map is below
// its own highest in the triangle.
static bool is_dense(const Darts* darts, const ScalpTriangle* triangle, Vec3 weight, float random)
{
    if (darts->style->maps == NULL) return true;
    float most = 0.0f;
    for (int i = 0; i < 3; ++i) {
        const float one[3] = {i == 0, i == 1, i == 2};
        float here = scatter_map(darts->style, triangle, vec3(one[0], one[1], one[2]), MAP_DENSITY);
        most = here > most ? here : most;
    }
    return random * most < scatter_map(darts->style, triangle, weight, MAP_DENSITY);
}

// Where roots are sparse they keep further away from each other: what the spacing is of the mean
// one of the triangle.
static float spacing(const Darts* darts, const ScalpTriangle* triangle, Vec3 weight)
{
    if (darts->style->maps == NULL) return 1.0f;
    Vec3 middle = {1.0f / 3.0f, 1.0f / 3.0f, 1.0f / 3.0f};
    float here = scatter_map(darts->style, triangle, weight, MAP_DENSITY);
    float mean = scatter_map(darts->style, triangle, middle, MAP_DENSITY);
    return sqrtf(mean / (here > 0.05f * mean ? here : 0.05f * mean));
}

static bool shares_guide(const ScalpTriangle* a, const ScalpTriangle* b)
{
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
            if (a->guide[i] == b->guide[k]) return true;
    return false;
}

static bool is_clear(const Darts* darts, int from, int until, Vec3 at, float apart_m)
{
    for (int i = from; i < until; ++i) {
        Vec3 d = vec3_sub(darts->at[i], at);
        if (vec3_dot(d, d) < apart_m * apart_m) return false;
    }
    return true;
}

// Of those thrown before, on triangle `t` and, where asked for, on its neighbours.
static bool is_free(const Darts* darts, int t, const int* neighbours, int neighbour_count, Vec3 at,
                    float apart_m)
{
    for (int n = 0; n < neighbour_count; ++n)
        if (!is_clear(darts, darts->first[neighbours[n]], darts->first[neighbours[n] + 1], at,
                      apart_m))
            return false;
    return is_clear(darts, darts->first[t], darts->count, at, apart_m);
}

// The circle criterion: few roots keep to the middle, or neighbouring triangles would show pairs.
static bool is_in_circle(const Darts* darts, const ScalpTriangle* triangle, Vec3 at, int wanted)
{
    if (wanted >= FEW) return true;
    Vec3 middle = place(darts->style, triangle, vec3(1.0f / 3.0f, 1.0f / 3.0f, 1.0f / 3.0f));
    float reach_m = 0.0f;
    for (int i = 0; i < 3; ++i) {
        float d = vec3_length(vec3_sub(corner(darts->style, triangle, i), middle));
        reach_m = d > reach_m ? d : reach_m;
    }
    float part = FEW_PART + (1.0f - FEW_PART) * (float)(wanted - 1) / (float)(FEW - 1);
    return vec3_length(vec3_sub(at, middle)) <= part * reach_m;
}

static void keep(Darts* darts, int t, Vec3 weight, Vec3 at)
{
    darts->roots[darts->count] = (ScatterRoot){t, weight};
    darts->at[darts->count++] = at;
}

static int find_neighbours(const Darts* darts, int t, int* neighbours)
{
    int count = 0;
    for (int other = 0; darts->across && other < t; ++other)
        if (shares_guide(triangle_of(darts->style, darts->set, other),
                         triangle_of(darts->style, darts->set, t)))
            neighbours[count++] = other;
    return count;
}

// Throws until `wanted` stick, nearer to each other after every TRIES in a row that do not.
static void throw_darts(Darts* darts, int t, int wanted)
{
    const ScalpTriangle* triangle = triangle_of(darts->style, darts->set, t);
    int neighbours[HAIRSTYLE_MAX_TRIANGLES];
    int neighbour_count = find_neighbours(darts, t, neighbours);
    uint32_t seed = random_hash2(darts->style->seed ^ 0xda27u, (uint32_t)t), draw = 0;
    float widest_m = sqrtf(1.1547f * area(darts->style, triangle) / (float)wanted);
    float apart_m = widest_m;
    for (int stuck = 0, misses = 0; stuck < wanted; draw += 3) {
        Vec3 weight = fold(random_unit(seed, draw), random_unit(seed, draw + 1));
        Vec3 at = place(darts->style, triangle, weight);
        bool any = apart_m < NEAREST * widest_m;
        if (any || (is_dense(darts, triangle, weight, random_unit(seed, draw + 2)) &&
                    (darts->across || is_in_circle(darts, triangle, at, wanted)) &&
                    is_free(darts, t, neighbours, neighbour_count, at,
                            apart_m * spacing(darts, triangle, weight)))) {
            keep(darts, t, weight, at);
            ++stuck;
            misses = 0;
        } else if (++misses == TRIES) {
            apart_m *= RELAX;
            misses = 0;
        }
    }
}

static void follow_sequence(Darts* darts, int t, int wanted)
{
    const ScalpTriangle* triangle = triangle_of(darts->style, darts->set, t);
    uint32_t seed = darts->style->seed ^ 0x7151u, key = 2u * (uint32_t)t;
    float start_u = random_unit(seed, key), start_v = random_unit(seed, key + 1);
    for (int stuck = 0, n = 0; stuck < wanted; ++n) {
        float u = start_u + 0.75487766624669276f * (float)n;
        float v = start_v + 0.56984029099805327f * (float)n;
        Vec3 weight = fold(u - floorf(u), v - floorf(v));
        float random = random_unit(seed ^ (uint32_t)t, (uint32_t)n);
        if (n < 20 * wanted && !is_dense(darts, triangle, weight, random)) continue;
        keep(darts, t, weight, place(darts->style, triangle, weight));
        ++stuck;
    }
}

static void deal(Darts* darts, int count, ScatterKind kind)
{
    double total = 0, dealt = 0;
    for (int t = 0; t < darts->set->triangle_count; ++t)
        total += room(darts->style, triangle_of(darts->style, darts->set, t));
    for (int t = 0; t < darts->set->triangle_count && total > 0; ++t) {
        dealt += room(darts->style, triangle_of(darts->style, darts->set, t));
        int until = (int)floor(dealt / total * count + 0.5);
        if (until > count) until = count;
        darts->first[t] = darts->count;
        int wanted = until - darts->count;
        if (wanted > 0 && kind == SCATTER_SEQUENCE)
            follow_sequence(darts, t, wanted);
        else if (wanted > 0)
            throw_darts(darts, t, wanted);
        darts->first[t + 1] = darts->count;
    }
}

int scatter_roots(ScatterRoot* roots, int count, const Hairstyle* style, const StrandSet* set,
                  ScatterKind kind)
{
    Darts darts = {.style = style, .set = set, .roots = roots, .across = kind == SCATTER_ACROSS};
    darts.at = malloc(((size_t)count + 1) * sizeof *darts.at);
    darts.first = calloc((size_t)set->triangle_count + 1, sizeof *darts.first);
    bool made = darts.at != NULL && darts.first != NULL;
    if (made) deal(&darts, count, kind);
    free(darts.at);
    free(darts.first);
    return made ? darts.count : -1;
}
