// What shadow methods cost and how far they are off, by layers, resolution and triangles: on
// built-in hair against the product over all strips that light crosses, and on media that are
// known.
//
// Times are shortest of repeats: by the wall clock round glFinish, and of all threads of the
// process, which on a software renderer is what the pass costs, also on a machine that others
// share.
#include "client/draw.h"
#include "client/fibres.h"
#include "messages/quantise.h"
#include "server/groom.h"
#include "tests/shadow_scenes.h"
#include "tests/studies.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define REPEATS  5
#define PLACES   4096
#define LOOK_UPS (16 * PLACES)
#define QUADS    2048

typedef struct Config {
    const char* method;
    int layers;
    ShadowFormat format;
    ShadowTuning tuning; // has_tuning
    bool has_tuning;
} Config;

// A style on the GPU, and its strips.
typedef struct Groom {
    Hairstyle* style;
    Drawing drawing;
    GuidesView view;
    Image image;
    Scene scene;
} Groom;

// ms of wall clock, and of processor in all threads.
typedef struct Timing {
    double wall, processor;
} Timing;

static double clock_ms(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

static Timing time_now(const Gl* gl)
{
    gl->Finish();
    return (Timing){clock_ms(CLOCK_MONOTONIC), clock_ms(CLOCK_PROCESS_CPUTIME_ID)};
}

static void keep_shortest(Timing* shortest, Timing from, Timing to)
{
    shortest->wall = fmin(shortest->wall, to.wall - from.wall);
    shortest->processor = fmin(shortest->processor, to.processor - from.processor);
}

static bool open_groom(Groom* groom, const Gl* gl, const char* name, Fault* fault)
{
    ShadeOptions options = shade_default();
    options.width = options.height = 64;
    options.samples = 1;
    CameraOptions camera = camera_default();
    memset(groom, 0, sizeof *groom);
    groom->style = strcmp(name, "bob") == 0 ? groom_bob(fault) : groom_long(fault);
    if (groom->style == NULL || !guides_view_init(&groom->view, 0, fault) ||
        !image_create(&groom->image, 64, 64, fault) ||
        !draw_create(&groom->drawing, gl, &options, &camera, fault) ||
        !draw_set_style(&groom->drawing, groom->style, 1, 1, fault))
        return false;
    // A view without rows shows the rest pose.
    groom->view.guides = groom->style->guide_count;
    groom->view.nodes = groom->style->nodes;
    groom->view.pose = pose_identity();
    for (int layer = 0; layer < 2; ++layer)
        for (int row = 0; row < HAIRSTYLE_MAX_GUIDES; ++row)
            groom->view.row_tick[layer][row] = -1;
    return draw_picture(&groom->drawing, &groom->view, &groom->image);
}

static void close_groom(Groom* groom)
{
    scene_free(&groom->scene);
    draw_free(&groom->drawing);
    image_free(&groom->image);
    guides_view_free(&groom->view);
    hairstyle_destroy(groom->style);
}

// `count` of the strips, evenly, as much wider as they are fewer: what --lod does.
static Strips thinned(const Strips* all, int count)
{
    int points = all->point_count / all->ribbon_count;
    Strips some = strips_make(count, points);
    for (int i = 0; i < some.point_count; ++i) {
        int ribbon = (int)((int64_t)(i / points) * all->ribbon_count / count);
        int from = all->first[ribbon] + i % points;
        some.at[i] = all->at[from];
        some.tangent[i] = all->tangent[from];
        some.fill[i] = all->fill[from];
        some.half_width_m[i] = all->half_width_m[from] * (float)all->ribbon_count / (float)count;
    }
    return some;
}

static const char* spacing_name(const Shadow* shadow)
{
    static const char* const names[] = {"even", "rising", "exponential"};
    return shadow->options.layers > 0 ? names[shadow->tuning.spacing] : "-";
}

static void print_row(const char* set, const char* scene, const Shadow* shadow, int triangles,
                      ShadowError error, Timing pass, Timing look_up)
{
    static const char* const formats[] = {"16F", "8", "32F"};
    const ShadowOptions* o = &shadow->options;
    const double per_look_up = 1e6 / LOOK_UPS;
    printf("%s,%s,%s,%d,%s,%.2f,%s,%d,%.1f,%.1f,%d,%.5f,%.4f,%+.5f,%.3f,%.3f,%.0f,%.0f\n", set,
           scene, shadow->method->name, o->layers, spacing_name(shadow),
           (double)shadow->tuning.growth, formats[o->format], o->size,
           1e3 * (double)shadow->tuning.bias_m, 1e3 * (double)shadow->tuning.reach_m, triangles,
           error.rms, error.max, error.bias, pass.wall, pass.processor, per_look_up * look_up.wall,
           per_look_up * look_up.processor);
    fflush(stdout);
}

// Errors at the scene's places, time of the pass, and of 16 look-ups at each place.
static bool measure(const char* set, const char* name, const Groom* groom, const Scene* scene,
                    const Hair* hair, const Config* config, int size, int triangles, Fault* fault)
{
    const Gl* gl = groom->drawing.gl;
    float extinction = groom->drawing.shade.lights.extinction_per_m;
    ShadowOptions options = {.method = shadow_find_method(config->method),
                             .size = size,
                             .layers = config->layers,
                             .format = config->format,
                             .tuning = config->has_tuning ? &config->tuning : NULL};
    Shadow shadow;
    Probe probe;
    if (!shadow_create(&shadow, gl, &options, groom->drawing.fibres, fault) ||
        !probe_create(&probe, gl, &shadow, fault))
        return false;
    static float seen[PLACES];
    static Vec3 many[LOOK_UPS];
    Timing pass = {1e9, 1e9}, look_up = {1e9, 1e9};
    shadow_run(&shadow, gl, hair, scene->light, &scene->frame);
    probe_run(&probe, gl, &shadow, extinction, scene->places, scene->count, seen, NULL);
    ShadowError error = shadow_error(scene, seen);
    for (int i = 0; i < LOOK_UPS; ++i)
        many[i] = scene->places[i % scene->count];
    probe_put(&probe, gl, many, LOOK_UPS);
    for (int i = 0; i < REPEATS; ++i) {
        Timing began = time_now(gl);
        shadow_run(&shadow, gl, hair, scene->light, &scene->frame);
        Timing middle = time_now(gl);
        probe_draw(&probe, gl, &shadow, extinction, LOOK_UPS);
        keep_shortest(&look_up, middle, time_now(gl));
        keep_shortest(&pass, began, middle);
    }
    print_row(set, name, &shadow, triangles, error, pass, look_up);
    probe_free(&probe, gl);
    shadow_free(&shadow, gl);
    return true;
}

#define EXPONENTIAL(by) .has_tuning = true, .tuning = {0.002f, SPACING_EXPONENTIAL, by, 0}

static const Config configs[] = {
    {.method = "none"},
    {.method = "depth"},
    {.method = "opacity", .layers = 4},
    {.method = "opacity", .layers = 8},
    {.method = "opacity", .layers = 16},
    {.method = "opacity", .layers = 16, .format = SHADOW_RGBA8},
    {.method = "opacity", .layers = 32},
    {.method = "opacity", .layers = 64},
    {.method = "opacity", .layers = 128},
    {.method = "opacity", .layers = 16, EXPONENTIAL(1.05f)},
    {.method = "opacity", .layers = 32, EXPONENTIAL(1.05f)},
    {.method = "opacity", .layers = 32, EXPONENTIAL(1.25f)},
    {.method = "deep", .layers = 3},
    {.method = "deep", .layers = 4},
    {.method = "deep", .layers = 8},
};
#define CONFIGS (int)(sizeof configs / sizeof configs[0])

static bool study_groom(const Gl* gl, const char* name, Fault* fault)
{
    Groom groom;
    if (!open_groom(&groom, gl, name, fault)) return false;
    const Drawing* drawing = &groom.drawing;
    groom.scene = scene_groom(strips_read(gl, &drawing->hair, drawing->frame.rotation),
                              drawing->shade.lights.key, &drawing->frame, PLACES);
    int triangles = 2 * (groom.scene.strips.point_count - groom.scene.strips.ribbon_count);
    bool done = true;
    for (int size = 64; done && size <= 512; size *= 2)
        for (int i = 0; done && i < CONFIGS; ++i)
            done = measure("groom", name, &groom, &groom.scene, &drawing->hair, &configs[i], size,
                           triangles, fault);
    close_groom(&groom);
    return done;
}

// How bias, and how far the layers of a deep map reach, were chosen.
static bool study_tuning(const Gl* gl, const char* name, Fault* fault)
{
    Groom groom;
    if (!open_groom(&groom, gl, name, fault)) return false;
    const Drawing* drawing = &groom.drawing;
    groom.scene = scene_groom(strips_read(gl, &drawing->hair, drawing->frame.rotation),
                              drawing->shade.lights.key, &drawing->frame, PLACES);
    bool done = true;
    for (int i = 0; done && i < 4; ++i) {
        Config config = {.method = "opacity", .layers = 16, .has_tuning = true};
        config.tuning.bias_m = 0.001f * (float)i;
        done =
            measure("tuning", name, &groom, &groom.scene, &drawing->hair, &config, 512, 0, fault);
        static const float reaches_m[] = {0, 0.010f, 0.016f, 0.026f, 0.041f, 0.066f};
        for (int r = 0; done && r < 6; ++r) {
            config = (Config){.method = "deep", .layers = 4, .has_tuning = true};
            config.tuning = (ShadowTuning){0.001f * (float)i, SPACING_RISING, 0, reaches_m[r]};
            done = measure("tuning", name, &groom, &groom.scene, &drawing->hair, &config, 512, 0,
                           fault);
        }
    }
    close_groom(&groom);
    return done;
}

static bool study_triangles(const Gl* gl, Fault* fault)
{
    static const Config few[] = {{.method = "depth"},
                                 {.method = "opacity", .layers = 16},
                                 {.method = "opacity", .layers = 32},
                                 {.method = "deep", .layers = 3},
                                 {.method = "deep", .layers = 4}};
    static const int triangles[] = {2000, 4000, 10000, 15000};
    Groom groom;
    if (!open_groom(&groom, gl, "long", fault)) return false;
    const Drawing* drawing = &groom.drawing;
    Strips all = strips_read(gl, &drawing->hair, drawing->frame.rotation);
    int points = all.point_count / all.ribbon_count;
    bool done = true;
    for (int t = 0; done && t < 4; ++t) {
        int ribbons = triangles[t] / (2 * (points - 1));
        Scene scene =
            scene_groom(thinned(&all, ribbons), drawing->shade.lights.key, &drawing->frame, PLACES);
        Hair hair = strips_hair(&scene.strips, gl);
        for (int size = 64; done && size <= 512; size *= 2)
            for (int i = 0; done && i < 5; ++i)
                done = measure("triangles", "long", &groom, &scene, &hair, &few[i], size,
                               2 * (points - 1) * ribbons, fault);
        hair_free(&hair, gl);
        scene_free(&scene);
    }
    strips_free(&all);
    close_groom(&groom);
    return done;
}

// Float layers, no bias: the methods' own errors, beside ../shared/tables/shadow_layers.csv.
static bool study_media(const Gl* gl, Fault* fault)
{
    Groom groom;
    if (!open_groom(&groom, gl, "long", fault)) return false;
    bool done = true;
    for (SceneKind kind = 0; done && kind < SCENE_KINDS; ++kind) {
        int size = kind == SCENE_SPHERE ? 512 : 256;
        Scene scene = scene_make(kind, 4, QUADS, kind == SCENE_SPHERE ? 2048 : PLACES);
        Hair hair = strips_hair(&scene.strips, gl);
        for (int i = 0; done && i < CONFIGS; ++i) {
            Config config = configs[i];
            if (strcmp(config.method, "depth") == 0) continue; // needs them opaque
            ShadowSpacing spacing =
                strcmp(config.method, "deep") == 0 ? SPACING_RISING : config.tuning.spacing;
            config.tuning = (ShadowTuning){0, spacing, config.tuning.growth, 0};
            config.has_tuning = true;
            if (config.format == SHADOW_RGBA16F) config.format = SHADOW_RGBA32F;
            done = measure("media", scene_names[kind], &groom, &scene, &hair, &config, size,
                           2 * QUADS, fault);
        }
        hair_free(&hair, gl);
        scene_free(&scene);
    }
    close_groom(&groom);
    return done;
}

// Whole pictures of the program: what of them is shadows while the light turns, and while only the
// camera does.
static bool study_light(const Gl* gl, Fault* fault)
{
    static const char* const methods[] = {"none", "depth", "opacity", "deep"};
    static const char* const moves[] = {"light turns", "camera turns"};
    for (int m = 0; m < 4; ++m) {
        Groom groom;
        if (!open_groom(&groom, gl, "long", fault)) return false;
        Drawing* drawing = &groom.drawing;
        ShadeOptions options = drawing->options;
        options.shadow.method = shadow_find_method(methods[m]);
        draw_free(drawing);
        CameraOptions camera = camera_default();
        if (!draw_create(drawing, gl, &options, &camera, fault) ||
            !draw_set_style(drawing, groom.style, 1, 1, fault) ||
            !draw_picture(drawing, &groom.view, &groom.image))
            return false;
        drawing->timed = true;
        for (int move = 0; move < 2; ++move) {
            double shadow = 1e9, light = 1e9;
            for (int i = 0; i < REPEATS; ++i) {
                DrawTimes* times = drawing->times;
                memset(times, 0, sizeof *times);
                camera.yaw_deg += 5;
                if (move == 0) draw_set_light(drawing, 40 + 5 * (float)i, 45);
                if (move == 1) draw_set_camera(drawing, &camera);
                draw_picture(drawing, &groom.view, &groom.image);
                shadow = fmin(shadow, (double)times->ms[PASS_SHADOW][0]);
                light = fmin(light, (double)times->ms[PASS_LIGHT][0]);
            }
            printf("# %s, %s: shadow %.2f ms, light %.2f ms a picture\n", methods[m], moves[move],
                   shadow, light);
        }
        close_groom(&groom);
    }
    return true;
}

bool study_shadow(Fault* fault)
{
    Gl* gl = gl_open("auto", NULL, fault);
    if (gl == NULL) return false;
    printf("# hair-bench shadow: transmittance against the exact product over all strips or quads "
           "that "
           "light crosses, at %d places\n",
           PLACES);
    study_machine();
    printf("# renderer: %s; ms of a shadow pass (hair and head) and ns of one look-up, shortest "
           "of %d: wall clock, and processor in all threads\n",
           gl->renderer, REPEATS);
    printf("set,scene,method,layers,spacing,growth,format,texels,bias_mm,reach_mm,triangles,rms_t,"
           "max_t,bias_t,pass_ms,pass_cpu_ms,look_up_ns,look_up_cpu_ns\n");
    bool done = study_light(gl, fault) && study_groom(gl, "long", fault) &&
                study_groom(gl, "bob", fault) && study_triangles(gl, fault) &&
                study_tuning(gl, "long", fault) && study_tuning(gl, "bob", fault) &&
                study_media(gl, fault);
    gl_close(gl);
    return done;
}
