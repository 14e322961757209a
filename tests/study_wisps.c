// How evenly wisps stand, and what that costs: the ways to scatter roots over scalp triangles
// (client/scatter.h) on a flat square, where power spectra can be had, and on the scalp of a style.
#include "client/scatter.h"
#include "messages/base.h"
#include "messages/random.h"
#include "server/groom.h"
#include "tests/studies.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define GRID    6     // cells a side of the square
#define SIDE_M  0.15f // a scalp laid flat
#define SEEDS   16
#define HIGHEST 48 // frequency

static const char* const names[SCATTER_KINDS] = {"sequence", "darts", "across"};

typedef struct Figures {
    double nearest, spread, least; // mean, deviation and least of the distance to the nearest root
    double pairs;                  // share of roots with one nearer than 0.3 of the widest spacing
    double low;                    // mean power below half the principal frequency; 1 is chance
    double us;                     // a root, the least of the seeds: others use the machine too
} Figures;

static Hairstyle* flat_style(Fault* fault)
{
    Hairstyle* style = hairstyle_create();
    int row = GRID + 1;
    if (style == NULL || !hairstyle_set_guides(style, row * row, 3, fault)) return style;
    for (int g = 0; g < style->guide_count; ++g) {
        int x = g % row, z = g / row;
        bool inner = x > 0 && z > 0 && x < GRID && z < GRID;
        float jx = inner ? 0.3f * random_signed(77, (uint32_t)(2 * g)) : 0.0f;
        float jz = inner ? 0.3f * random_signed(77, (uint32_t)(2 * g + 1)) : 0.0f;
        for (int n = 0; n < 3; ++n)
            style->rest[3 * g + n] = vec3(((float)x + jx) * SIDE_M / GRID, 0.01f * (float)n,
                                          ((float)z + jz) * SIDE_M / GRID);
    }
    style->triangles = calloc(2 * GRID * GRID, sizeof *style->triangles);
    for (int c = 0; c < GRID * GRID && style->triangles != NULL; ++c) {
        uint16_t a = (uint16_t)(c / GRID * row + c % GRID), b = (uint16_t)(a + 1);
        uint16_t d = (uint16_t)(a + row), e = (uint16_t)(d + 1);
        style->triangles[style->triangle_count++] = (ScalpTriangle){{a, d, b}};
        style->triangles[style->triangle_count++] = (ScalpTriangle){{b, d, e}};
    }
    style->set_count = 1;
    style->sets[0] = (StrandSet){.kind = STRANDS_GROWN,
                                 .guide_count = style->guide_count,
                                 .triangle_count = style->triangle_count};
    return style;
}

static Vec3 place(const Hairstyle* style, const ScatterRoot* root)
{
    const uint16_t* guide = style->triangles[root->triangle].guide;
    Vec3 at = vec3_scale(style->rest[guide[0] * style->nodes], root->weight.x);
    at = vec3_mad(at, style->rest[guide[1] * style->nodes], root->weight.y);
    return vec3_mad(at, style->rest[guide[2] * style->nodes], root->weight.z);
}

static double area_m2(const Hairstyle* style)
{
    double sum = 0;
    for (int t = 0; t < style->triangle_count; ++t) {
        const ScatterRoot corner[3] = {{t, {1, 0, 0}}, {t, {0, 1, 0}}, {t, {0, 0, 1}}};
        Vec3 a = place(style, &corner[0]);
        Vec3 n = vec3_cross(vec3_sub(place(style, &corner[1]), a),
                            vec3_sub(place(style, &corner[2]), a));
        sum += 0.5 * (double)vec3_length(n);
    }
    return sum;
}

// In units of the spacing of the same number in a hexagonal lattice, which is the widest there is.
static void measure_nearest(Figures* figures, const Vec3* at, int count, double widest_m)
{
    double sum = 0, squares = 0, least = 1e9;
    int pairs = 0;
    for (int i = 0; i < count; ++i) {
        double nearest = 1e9;
        for (int k = 0; k < count; ++k) {
            double d = (double)vec3_length(vec3_sub(at[i], at[k])) / widest_m;
            if (k != i && d < nearest) nearest = d;
        }
        sum += nearest;
        squares += nearest * nearest;
        least = fmin(least, nearest);
        pairs += nearest < 0.3;
    }
    double mean = sum / count;
    figures->nearest += mean / SEEDS;
    figures->spread += sqrt(fmax(squares / count - mean * mean, 0)) / SEEDS;
    figures->least += least / SEEDS;
    figures->pairs += (double)pairs / count / SEEDS;
}

// Of whole frequencies of the square, where its edge leaves no trace.
static void measure_power(Figures* figures, const Vec3* at, int count)
{
    double half = 0.5 * sqrt(1.1547 * count), sum = 0;
    int frequencies = 0;
    for (int u = -HIGHEST; u <= HIGHEST; ++u)
        for (int v = 0; v <= HIGHEST; ++v) {
            if ((u == 0 && v == 0) || u * u + v * v > half * half) continue;
            double re = 0, im = 0;
            for (int i = 0; i < count; ++i) {
                double angle =
                    2 * M_PI * (u * (double)at[i].x + v * (double)at[i].z) / (double)SIDE_M;
                re += cos(angle);
                im += sin(angle);
            }
            sum += (re * re + im * im) / count;
            ++frequencies;
        }
    figures->low += sum / frequencies / SEEDS;
}

static bool measure(Hairstyle* style, int count, bool flat)
{
    ScatterRoot* roots = malloc((size_t)count * sizeof *roots);
    Vec3* at = malloc((size_t)count * sizeof *at);
    bool made = roots != NULL && at != NULL;
    for (int kind = 0; made && kind < SCATTER_KINDS; ++kind) {
        Figures figures = {0};
        for (uint32_t seed = 1; seed <= SEEDS; ++seed) {
            style->seed = seed;
            int64_t began = base_monotonic_us();
            int found = scatter_roots(roots, count, style, &style->sets[0], (ScatterKind)kind);
            double us = (double)(base_monotonic_us() - began) / count;
            if (seed == 1 || us < figures.us) figures.us = us;
            for (int i = 0; i < found; ++i)
                at[i] = place(style, &roots[i]);
            measure_nearest(&figures, at, found, sqrt(1.1547 * area_m2(style) / found));
            if (flat) measure_power(&figures, at, found);
        }
        printf("%s,%s,%d,%.3f,%.3f,%.3f,%.4f,%.3f,%.2f\n", flat ? "square" : style->name,
               names[kind], count, figures.nearest, figures.spread, figures.least, figures.pairs,
               flat ? figures.low : -1.0, figures.us);
    }
    free(roots);
    free(at);
    return made;
}

bool study_wisps(Fault* fault)
{
    printf("# Roots of wisps over scalp triangles, means of %d seeds. Distances are to the nearest "
           "root, in spacings of the hexagonal lattice of as many; pairs are nearer than 0.3; low "
           "is the power below half the principal frequency, 1 is chance, -1 not measured; "
           "times are the least.\n",
           SEEDS);
    study_machine();
    printf("where,method,roots,nearest,deviation,least,pairs,low,us_a_root\n");
    static const int counts[] = {150, 600, 2000};
    Hairstyle *flat = flat_style(fault), *scalp = groom_long(fault);
    bool done = flat != NULL && flat->triangles != NULL && scalp != NULL;
    for (int i = 0; done && i < 3; ++i)
        done = measure(flat, counts[i], true) && measure(scalp, counts[i], false);
    hairstyle_destroy(flat);
    hairstyle_destroy(scalp);
    return done;
}
