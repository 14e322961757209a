// What the shadings err by and cost: the tables of marschner over size, format and layout, and the
// light pass with each shading. Errors are of single strands against the fibre in double
// (client/marschner.h), in sRGB codes; times are of the clock around glFinish, the shortest of
// several rounds.
#include "client/draw.h"
#include "client/fibres.h"
#include "server/load.h"
#include "tests/shade_points.h"
#include "tests/studies.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PAIRS = 60000, LIGHT_POINTS = 10000, ROUNDS = 25, MAX_CASES = 64 };

typedef struct Case {
    const char* set;
    const char* name;
    ShadingOptions options;
    CodeErrors errors;
    double furnace; // largest share of the light that is gained or lost against the lobes' energy
    double table_ms, light_ms;
} Case;

typedef struct Cases {
    const Gl* gl;
    ShadePoint points[PAIRS];
    ShadedPoint exact[PAIRS], shaded[PAIRS];
    Case all[MAX_CASES];
    int count;
} Cases;

static const char* const format_names[] = {
    [TABLE_HALF] = "fp16", [TABLE_BYTE] = "8-bit", [TABLE_FLOAT] = "float"};
static const char* const layout_names[] = {[LAYOUT_ENDS] = "ends", [LAYOUT_NALU] = "nalu"};

static ShadingOptions alone(MarschnerAzimuth azimuth, int size, TableFormat format,
                            TableLayout layout)
{
    Fibre fibre = shade_points_fibre(azimuth);
    ShadingOptions options = shade_points_alone(SHADING_MARSCHNER, &fibre);
    options.table_size = size;
    options.format = format;
    options.layout = layout;
    return options;
}

static void add(Cases* cases, const char* set, const char* name, ShadingOptions options)
{
    cases->all[cases->count++] = (Case){.set = set, .name = name, .options = options};
}

static void choose_tables(Cases* cases, const char* set, MarschnerAzimuth azimuth)
{
    for (int layout = LAYOUT_ENDS; layout <= LAYOUT_NALU; ++layout)
        for (int format = TABLE_HALF; format <= TABLE_FLOAT; ++format)
            for (int size = 32; size <= 256; size *= 2)
                add(cases, set, "marschner",
                    alone(azimuth, size, (TableFormat)format, (TableLayout)layout));
}

// Against the smooth fibre with the paper's caustic: what is saved elsewhere.
static void choose_paths(Cases* cases)
{
    ShadingOptions options = alone(AZIMUTH_CLAMPED, 256, TABLE_FLOAT, LAYOUT_ENDS);
    add(cases, "paths", "caustic clamped", options);
    options.fibre.azimuth = AZIMUTH_CAUSTIC;
    options.fibre.tt_as_trt = true;
    add(cases, "paths", "M_TT = M_TRT", options);
    options.fibre.tt_as_trt = false;
    options.fibre.azimuth = AZIMUTH_ROUGH;
    add(cases, "paths", "blurred by 10 degrees", options);
    options.fibre.width_deg = 5.0;
    add(cases, "paths", "blurred by 5 degrees", options);
}

static void choose_prices(Cases* cases)
{
    ShadingOptions options = shading_default();
    for (int kind = 0; kind < SHADINGS; ++kind) {
        options.kind = (ShadingKind)kind;
        add(cases, "price", shading_names[kind], options);
    }
    options.kind = SHADING_MARSCHNER;
    options.fibre.norm = NORM_DEON;
    add(cases, "price", "d'Eon's M", options);
    options.fibre.norm = NORM_HALF;
    options.layout = LAYOUT_NALU;
    add(cases, "price", "Nalu's", options);
}

// --- errors

static bool measure_furnace(Cases* cases, Case* one, Fault* fault)
{
    ShadingOptions options = one->options;
    options.fibre.norm = NORM_DEON;
    memset(options.fibre.absorption, 0, sizeof options.fibre.absorption);
    for (int theta = 0; theta <= 60; theta += 30) {
        double cos_d = cos(theta * M_PI / 180.0), sum, want = 0;
        for (int lobe = 0; lobe < LOBES; ++lobe)
            want += marschner_energy(options.fibre.eta, cos_d, lobe, 0.0);
        if (!shade_points_furnace(cases->gl, &options, theta, &sum, fault)) return false;
        if (fabs(sum - want) > fabs(one->furnace)) one->furnace = sum - want;
    }
    return true;
}

static bool measure_errors(Cases* cases, Fault* fault)
{
    int truth = -1;
    shade_points_random(cases->points, PAIRS, 7);
    for (int i = 0; i < cases->count; ++i) {
        Case* one = &cases->all[i];
        if (strcmp(one->set, "price") == 0) continue;
        bool path = strcmp(one->set, "paths") == 0;
        int wanted = path ? AZIMUTH_CAUSTIC : (int)one->options.fibre.azimuth;
        if (wanted != truth) {
            Fibre fibre = shade_points_fibre((MarschnerAzimuth)wanted);
            shade_points_exact(&fibre, cases->points, PAIRS, cases->exact);
            truth = wanted;
        }
        if (!shade_points(cases->gl, &one->options, &shade_points_grey, NULL, cases->points, PAIRS,
                          cases->shaded, fault) ||
            !measure_furnace(cases, one, fault))
            return false;
        one->errors = shade_points_errors(cases->exact, cases->shaded, PAIRS);
    }
    return true;
}

// --- times

// What the light pass of one picture reads.
typedef struct Scene {
    Hairstyle* style;
    Hair hair;
    GLuint fibres;
    Shadow shadow;
    Lights lights;
    Frame frame;
} Scene;

static bool open_scene(Scene* scene, const Gl* gl, Fault* fault)
{
    LoadOptions load = {.styles = {"long"}, .style_count = 1};
    memset(scene, 0, sizeof *scene);
    scene->style = load_style(&load, NULL, fault);
    if (scene->style == NULL) return false;
    StrandSet* set = &scene->style->sets[0];
    set->strand_count = LIGHT_POINTS / set->points;
    scene->style->set_count = 1;
    scene->fibres = fibres_create(gl, fault);
    GuidesView view;
    ShadowOptions shadow = shadow_default();
    if (scene->fibres == 0 || !hair_create(&scene->hair, gl, scene->style, LOD_FULL, 0, fault) ||
        !shadow_create(&scene->shadow, gl, &shadow, scene->fibres, fault) ||
        !guides_view_init(&view, 0, fault))
        return false;
    upload_rows(&scene->hair.guides, gl, &view); // nothing has come: hair at rest
    update_run(&scene->hair.update, gl, &scene->hair.guides, &view, 1.0f);
    guides_view_free(&view);
    CameraOptions camera = camera_default();
    scene->lights = (Lights){camera_direction(40, 45),
                             camera_direction(-60, 10),
                             camera_direction(160, 35),
                             {3.0f, 0.6f, 2.0f, 0.25f},
                             90.0f};
    scene->frame = (Frame){.camera = camera_orbit(&camera, scene->style, 1.3f),
                           .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                           .bounds = scene->style->box};
    shadow_run(&scene->shadow, gl, &scene->hair, scene->lights.key, &scene->frame);
    return true;
}

static void close_scene(Scene* scene, const Gl* gl)
{
    shadow_free(&scene->shadow, gl);
    hair_free(&scene->hair, gl);
    if (scene->fibres != 0) gl->DeleteTextures(1, &scene->fibres);
    if (scene->style != NULL) hairstyle_destroy(scene->style);
}

static double least(double a, double b)
{
    return a == 0.0 || b < a ? b : a;
}

static void time_light(const Gl* gl, Scene* scene, Light* light, Case* one)
{
    gl->Finish();
    int64_t began = base_monotonic_us();
    const Shadow* shadow = &scene->shadow;
    light_run(light, gl, &scene->hair, &shadow, &scene->lights, &scene->frame, false);
    gl->Finish();
    one->light_ms = least(one->light_ms, (double)(base_monotonic_us() - began) * 1e-3);
}

// Made anew: something that is of no weight changes.
static void time_table(const Gl* gl, Scene* scene, Light* light, Case* one)
{
    if (light->shading.around == 0) return;
    light->shading.options.fibre.alpha_deg += 1e-9;
    int64_t began = base_monotonic_us();
    shading_update(&light->shading, gl, &scene->hair.material);
    gl->Finish();
    one->table_ms = least(one->table_ms, (double)(base_monotonic_us() - began) * 1e-3);
}

// In rounds, all cases in each, so that a busy minute falls on all alike.
static bool measure_times(Cases* cases, Fault* fault)
{
    static Scene scene;
    static Light lights[MAX_CASES];
    const Gl* gl = cases->gl;
    bool done = open_scene(&scene, gl, fault);
    for (int i = 0; i < cases->count && done; ++i)
        done = light_create(&lights[i], gl, &cases->all[i].options, &scene.shadow, fault) &&
               light_fit(&lights[i], gl, &scene.hair.update, fault);
    for (int round = 0; round < ROUNDS && done; ++round)
        for (int i = 0; i < cases->count; ++i) {
            time_light(gl, &scene, &lights[i], &cases->all[i]);
            if (round % 8 == 0) time_table(gl, &scene, &lights[i], &cases->all[i]);
        }
    if (done)
        printf("# light pass: %d points of %d strands, three lights and their shadows\n",
               scene.hair.ribbons.point_count, scene.hair.ribbons.ribbon_count);
    for (int i = 0; i < cases->count; ++i)
        light_free(&lights[i], gl);
    close_scene(&scene, gl);
    return done && gl_check(gl, "hair-bench shading", fault);
}

static void print(const Case* one)
{
    const ShadingOptions* o = &one->options;
    bool tables = o->kind == SHADING_MARSCHNER, errors = strcmp(one->set, "price") != 0;
    printf("%s,%s,", one->set, one->name);
    if (tables)
        printf("%d,%s,%s,", o->table_size, format_names[o->format], layout_names[o->layout]);
    else
        printf(",,,");
    if (errors)
        printf("%.4f,%.4f,%.3f,%.6f,%.5f,", one->errors.mean, one->errors.p99, one->errors.most,
               one->errors.rms_linear, one->furnace);
    else
        printf(",,,,,");
    if (tables) printf("%.2f", one->table_ms);
    printf(",%.3f\n", one->light_ms);
}

bool study_shading(Fault* fault)
{
    static Cases cases;
    Gl* gl = gl_open("auto", NULL, fault);
    if (gl == NULL) return false;
    cases.gl = gl;
    choose_tables(&cases, "caustic", AZIMUTH_CAUSTIC);
    choose_tables(&cases, "blurred", AZIMUTH_ROUGH);
    choose_paths(&cases);
    choose_prices(&cases);
    printf(
        "# hair-bench shading: errors of %d random pairs of light and eye, of one fibre in "
        "double:\n"
        "# sets caustic (the paper's, as marschner_endtoend.csv) and blurred (by 10 degrees: the\n"
        "# default); paths against caustic. Codes: sRGB, 8 bits, 99.5 %% of the exact below "
        "white.\n"
        "# furnace: share of white light from everywhere that is gained or lost, d'Eon's M, worst "
        "of\n"
        "# inclinations 0, 30, 60. Times: shortest of %d rounds, clock around glFinish.\n",
        PAIRS, ROUNDS);
    study_machine();
    printf("# renderer: %s, %s\n", gl->renderer, gl->backend);
    bool done = measure_errors(&cases, fault) && measure_times(&cases, fault);
    if (done) {
        printf(
            "set,name,size,format,layout,mean_code,p99_code,max_code,rms_linear,furnace,table_ms,"
            "light_ms\n");
        for (int i = 0; i < cases.count; ++i)
            print(&cases.all[i]);
    }
    gl_close(gl);
    return done;
}
