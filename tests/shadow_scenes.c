#include "tests/shadow_scenes.h"

#include "messages/random.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char* const scene_names[SCENE_KINDS] = {"slab_fit",   "slab_unaligned", "gauss_blob",
                                              "two_sheets", "in_sheets",      "sphere"};

// What comes before a thousandth of a blob stands where that is reached: the tables' first depth.
#define FIRST_SHARE 1e-3
#define DISC_POINTS 25

// How far a medium is moved from one side of its scene to the other, and where it is in between.
static double lean_of(SceneKind kind)
{
    static const double lean[SCENE_KINDS] = {0, 0.5, 0.2, 0.1, 0.1, 0};
    return lean[kind];
}

static double place_of(SceneKind kind)
{
    static const double place[SCENE_KINDS] = {0.25, 0.25, 0.5, 0.1, 0.1, 0};
    return place[kind];
}

static double blob_depth(double share)
{
    double low = -1.0, high = 1.0;
    for (int i = 0; i < 60; ++i) {
        double middle = 0.5 * (low + high);
        if (0.5 * (1.0 + erf(middle / (0.125 * sqrt(2.0)))) < share)
            low = middle;
        else
            high = middle;
    }
    return low;
}

// From the medium's place to where `share` of it has been passed.
static double medium_depth(SceneKind kind, double share)
{
    switch (kind) {
    case SCENE_BLOB:
        return blob_depth(fmax(share, FIRST_SHARE));
    case SCENE_SHEETS:
    case SCENE_IN_SHEETS:
        return share * 0.14 <= 0.04 ? share * 0.14 : 0.6 + share * 0.14 - 0.04;
    default:
        return 0.5 * share;
    }
}

// Depths between which the tables take errors.
static void medium_ends(SceneKind kind, double place, double* low, double* high)
{
    static const double length[SCENE_KINDS] = {0.5, 0.5, 1.0, 0.7, 0.7, 1.0};
    *low = kind == SCENE_BLOB ? 0.0 : place;
    *high = *low + length[kind];
}

// From x and y across (0 in the middle, 1 near to far) and depth.
static Vec3 at(const Scene* scene, const Vec3 axes[3], double x, double y, double depth)
{
    Vec3 p = vec3_scale(axes[0], (float)x * SCENE_SIZE_M);
    p = vec3_mad(p, axes[1], (float)y * SCENE_SIZE_M);
    return vec3_mad(p, axes[2], scene->frame.lit_high_m - (float)depth * SCENE_SIZE_M);
}

static void make_layers(Scene* scene, SceneKind kind, const Vec3 axes[3], float fill, int quads)
{
    Strips* strips = &scene->strips;
    *strips = strips_make(quads, 2);
    for (int q = 0; q < quads; ++q) {
        double depth = place_of(kind) + medium_depth(kind, (q + 0.5) / quads);
        for (int end = 0; end < 2; ++end) {
            double x = end ? 0.6 : -0.6;
            int i = 2 * q + end;
            strips->at[i] = at(scene, axes, x, 0, depth + lean_of(kind) * x);
            strips->half_width_m[i] = 0.08f * SCENE_SIZE_M;
            strips->fill[i] = fill;
        }
        Vec3 along = vec3_sub(strips->at[2 * q + 1], strips->at[2 * q]);
        strips->tangent[2 * q] = strips->tangent[2 * q + 1] =
            vec3_normalise_or(along, vec3(1, 0, 0));
    }
}

static void make_discs(Scene* scene, const Vec3 axes[3], float fill, int quads)
{
    Strips* strips = &scene->strips;
    *strips = strips_make(quads, DISC_POINTS);
    for (int i = 0; i < strips->point_count; ++i) {
        double depth = (i / DISC_POINTS + 0.5) / quads;
        double radius = sqrt(0.25 - (depth - 0.5) * (depth - 0.5));
        double angle = M_PI * (i % DISC_POINTS) / (DISC_POINTS - 1);
        strips->at[i] = at(scene, axes, -radius * cos(angle), 0, depth);
        strips->half_width_m[i] = (float)(radius * sin(angle)) * SCENE_SIZE_M;
        strips->tangent[i] = axes[0];
        strips->fill[i] = fill;
    }
}

static double draw(int i, uint32_t dimension)
{
    return (double)random_unit(0x5ca1eu + dimension, (uint32_t)i);
}

static Vec3 layer_place(const Scene* scene, SceneKind kind, const Vec3 axes[3], int i)
{
    double x = draw(i, 0) - 0.5, low, high;
    medium_ends(kind, place_of(kind) + lean_of(kind) * x, &low, &high);
    double depth = low + (high - low) * draw(i, 2);
    if (kind == SCENE_IN_SHEETS) depth = low + medium_depth(kind, draw(i, 2));
    return at(scene, axes, x, 0.1 * (draw(i, 1) - 0.5), depth);
}

static Vec3 ball_place(const Scene* scene, const Vec3 axes[3], int i)
{
    double r = 0.5 * cbrt(draw(i, 0)), z = 2.0 * draw(i, 1) - 1.0, turn = 2.0 * M_PI * draw(i, 2);
    double across = sqrt(1.0 - z * z);
    return at(scene, axes, r * across * cos(turn), r * across * sin(turn), 0.5 + r * z);
}

static void find_truth(Scene* scene, const Lit* lit, const int* own)
{
    for (int i = 0; i < scene->count; ++i)
        scene->truth[i] = lit_transmittance(lit, scene->places[i], own != NULL ? own[i] : -1);
}

static void make_room(Scene* scene, int places)
{
    scene->count = places;
    scene->places = calloc((size_t)places, sizeof *scene->places);
    scene->truth = calloc((size_t)places, sizeof *scene->truth);
    if (scene->places == NULL || scene->truth == NULL) abort();
}

Scene scene_make(SceneKind kind, double tau, int quads, int places)
{
    float half = 0.5f * SCENE_SIZE_M;
    Scene scene = {.light = {0.36f, 0.48f, 0.8f},
                   .frame = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                             .bounds = {{-half, -half, -half}, {half, half, half}},
                             .lit_low_m = -half,
                             .lit_high_m = half}};
    // As lit_make has them.
    Vec3 axes[3] = {scene.light, scene.light, scene.light};
    axes[0] = vec3_normalise_or(vec3_cross(vec3(0, 1, 0), scene.light), vec3(1, 0, 0));
    axes[1] = vec3_cross(scene.light, axes[0]);
    float fill = (float)(1.0 - exp(-tau / quads));
    if (kind == SCENE_SPHERE)
        make_discs(&scene, axes, fill, quads);
    else
        make_layers(&scene, kind, axes, fill, quads);
    make_room(&scene, places);
    for (int i = 0; i < places; ++i)
        scene.places[i] =
            kind == SCENE_SPHERE ? ball_place(&scene, axes, i) : layer_place(&scene, kind, axes, i);
    Lit lit = lit_make(&scene.strips, scene.light);
    find_truth(&scene, &lit, NULL);
    lit_free(&lit);
    return scene;
}

static double segment_area(const Strips* strips, int i)
{
    double length = (double)vec3_length(vec3_sub(strips->at[i + 1], strips->at[i]));
    return length * (double)(strips->half_width_m[i] + strips->half_width_m[i + 1]);
}

// On the segment from point i to the next, across and along it by chance.
static Vec3 strip_place(const Strips* strips, Vec3 light, int i, int n)
{
    float along = (float)draw(n, 0), across = 2.0f * (float)draw(n, 1) - 1.0f;
    Vec3 edge[2];
    for (int end = 0; end < 2; ++end) {
        Vec3 side = vec3_normalise_or(vec3_cross(strips->tangent[i + end], light), vec3(0, 0, 0));
        edge[end] = vec3_mad(strips->at[i + end], side, across * strips->half_width_m[i + end]);
    }
    return vec3_lerp(edge[0], edge[1], along);
}

Scene scene_groom(Strips strips, Vec3 light, const Frame* frame, int places)
{
    Scene scene = {.strips = strips, .light = light, .frame = *frame};
    make_room(&scene, places);
    int* own = calloc((size_t)places, sizeof *own);
    if (own == NULL) abort();
    double total = 0, passed = 0;
    for (int pass = 0, n = 0; pass < 2; ++pass)
        for (int r = 0; r < strips.ribbon_count; ++r)
            for (int i = strips.first[r]; i + 1 < strips.first[r + 1]; ++i) {
                double area = segment_area(&strips, i);
                if (pass == 0) total += area;
                if (pass == 1) passed += area;
                for (; pass == 1 && n < places && (n + 0.5) / places * total < passed; ++n) {
                    scene.places[n] = strip_place(&strips, light, i, n);
                    own[n] = r;
                }
            }
    Lit lit = lit_make(&scene.strips, light);
    find_truth(&scene, &lit, own);
    lit_free(&lit);
    free(own);
    return scene;
}

void scene_make_opaque(Scene* scene)
{
    for (int i = 0; i < scene->strips.point_count; ++i)
        scene->strips.fill[i] = 1.0f;
}

void scene_free(Scene* scene)
{
    strips_free(&scene->strips);
    free(scene->places);
    free(scene->truth);
    *scene = (Scene){0};
}

ShadowError shadow_error(const Scene* scene, const float* transmittance)
{
    ShadowError error = {0};
    for (int i = 0; i < scene->count; ++i) {
        double e = (double)transmittance[i] - scene->truth[i];
        error.rms += e * e;
        error.bias += e;
        // Written so that no number is a large error.
        if (!(fabs(e) <= error.max)) error.max = isnan(e) ? HUGE_VAL : fabs(e);
    }
    error.rms = sqrt(error.rms / scene->count);
    error.bias /= scene->count;
    return error;
}

ShadowError shadow_measure(const Scene* scene, const Gl* gl, const Hair* hair, GLuint fibres,
                           const ShadowOptions* options, float extinction_per_m)
{
    Fault fault = {""};
    Shadow shadow;
    Probe probe = {0};
    if (!shadow_create(&shadow, gl, options, fibres, &fault) ||
        !probe_create(&probe, gl, &shadow, &fault)) {
        fprintf(stderr, "%s\n", fault.text);
        abort();
    }
    float* seen = calloc((size_t)scene->count, sizeof *seen);
    if (seen == NULL) abort();
    shadow_run(&shadow, gl, hair, scene->light, &scene->frame);
    probe_run(&probe, gl, &shadow, extinction_per_m, scene->places, scene->count, seen, NULL);
    ShadowError error = shadow_error(scene, seen);
    free(seen);
    probe_free(&probe, gl);
    shadow_free(&shadow, gl);
    return error;
}
