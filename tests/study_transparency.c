// What each transparency gets wrong and what it costs. The truth is 64 alpha-tested pictures' worth
// of samples a pixel: fibres are then wider than a sample, each is there or not, and the depth test
// sorts them exactly. Everything else of a picture (light, shadow) is the same.
#include "tests/compare.h"
#include "tests/flip.h"
#include "tests/stage.h"
#include "tests/studies.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define FINER    8 // times the truth is, each way
#define PICTURES 5

static const StageHair hair = {52000, 2600, 11};

typedef struct View {
    const char* name;
    int width, height;
} View;

// One eye, 0.5 m away; a pixel of the second spans as much as one of 400 x 300 at 2 m.
static const View views[] = {{"close", 400, 300}, {"far", 100, 75}};

typedef struct Method {
    Transparency transparency;
    int samples;
    bool pre_z;
    ShadeSort sort;
    Comparison is;
    double shade_ms, hair_pixels;
    bool measured;
} Method;

static const Method methods[] = {
    {.transparency = TRANSPARENCY_TEST, .samples = 1},
    {.transparency = TRANSPARENCY_TEST, .samples = 4},
    {.transparency = TRANSPARENCY_TEST, .samples = 1, .pre_z = true},
    {.transparency = TRANSPARENCY_COVERAGE, .samples = 4},
    {.transparency = TRANSPARENCY_COVERAGE, .samples = 4, .pre_z = true},
    {.transparency = TRANSPARENCY_HASH, .samples = 4},
    {.transparency = TRANSPARENCY_HASH, .samples = 4, .pre_z = true},
    {.transparency = TRANSPARENCY_HASH, .samples = 4, .sort = SORT_SEGMENTS},
    {.transparency = TRANSPARENCY_HASH, .samples = 8},
    {.transparency = TRANSPARENCY_BLEND, .samples = 1, .sort = SORT_OFF},
    {.transparency = TRANSPARENCY_BLEND, .samples = 1, .sort = SORT_WISPS},
    {.transparency = TRANSPARENCY_BLEND, .samples = 1, .sort = SORT_SEGMENTS},
    {.transparency = TRANSPARENCY_BLEND, .samples = 1, .sort = SORT_SEGMENTS, .pre_z = true},
    {.transparency = TRANSPARENCY_BLEND, .samples = 4, .sort = SORT_OFF},
    {.transparency = TRANSPARENCY_BLEND, .samples = 4, .sort = SORT_WISPS},
    {.transparency = TRANSPARENCY_BLEND, .samples = 4, .sort = SORT_SEGMENTS},
};
#define METHODS (sizeof methods / sizeof methods[0])

static bool open_view(Stage* stage, const Gl* gl, const View* view, const Method* method, int finer,
                      Fault* fault)
{
    ShadeOptions options = shade_default();
    options.width = view->width * finer;
    options.height = view->height * finer;
    options.samples = method->samples;
    options.transparency = method->transparency;
    options.pre_z = method->pre_z;
    options.sort = method->sort;
    CameraOptions camera = camera_default();
    camera.has_distance = true;
    camera.distance_m = 0.5f;
    camera.yaw_deg = 60.0f;
    return stage_open(stage, gl, &hair, &options, &camera, fault);
}

static uint8_t to_code(double linear)
{
    double c = linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
    return (uint8_t)lrint(255.0 * c);
}

// Means of FINER x FINER pixels, in linear light.
static void shrink(Image* out, const Image* in)
{
    double linear[256];
    for (int i = 0; i < 256; ++i)
        linear[i] = image_linear((uint8_t)i);
    for (int i = 0; i < 4 * out->width * out->height; ++i) {
        int x = i / 4 % out->width * FINER, y = i / 4 / out->width * FINER, k = i % 4;
        double sum = 0;
        for (int j = 0; j < FINER * FINER; ++j) {
            int at = 4 * ((y + j / FINER) * in->width + x + j % FINER) + k;
            sum += k < 3 ? linear[in->rgba[at]] : in->rgba[at] / 255.0;
        }
        sum /= FINER * FINER;
        out->rgba[i] = k < 3 ? to_code(sum) : (uint8_t)lrint(255.0 * sum);
    }
}

static bool draw_truth(Image* truth, const Gl* gl, const View* view, Fault* fault)
{
    static Stage stage;
    const Method test = {.transparency = TRANSPARENCY_TEST, .samples = 1};
    bool drawn = image_create(truth, view->width, view->height, fault) &&
                 open_view(&stage, gl, view, &test, FINER, fault);
    if (drawn) {
        stage_draw(&stage);
        shrink(truth, &stage.image);
    }
    stage_close(&stage);
    return drawn;
}

static bool measure(Method* method, const Gl* gl, const View* view, const Image* truth,
                    Fault* fault)
{
    static Stage stage;
    if (method->samples > gl->max_samples) return true;
    bool opened = open_view(&stage, gl, view, method, 1, fault);
    if (opened) {
        stage_draw(&stage);
        stage_forget(&stage);
        for (int i = 0; i < PICTURES; ++i)
            stage_draw(&stage);
        method->shade_ms = stage_processor_ms(&stage, PASS_SHADE, 0.5);
        method->hair_pixels = draw_hair_pixels(&stage.image);
        method->measured =
            compare_images(&method->is, truth, &stage.image, FLIP_PIXELS_PER_DEGREE, NULL, fault);
    }
    stage_close(&stage);
    return opened && method->measured;
}

// Nothing measured is as fast and as near to the truth, and better in one of them.
static bool is_on_front(const Method* of, const Method* all)
{
    for (size_t i = 0; i < METHODS; ++i) {
        const Method* m = &all[i];
        bool is_as_good = m->shade_ms <= of->shade_ms && m->is.flip <= of->is.flip;
        bool is_better = m->shade_ms < of->shade_ms || m->is.flip < of->is.flip;
        if (m->measured && is_as_good && is_better) return false;
    }
    return true;
}

static bool study_view(const Gl* gl, const View* view, Fault* fault)
{
    static const char* const sorts[] = {"auto", "off", "wisps", "segments"};
    static Method all[METHODS];
    Image truth = {0};
    bool done = draw_truth(&truth, gl, view, fault);
    for (size_t i = 0; i < METHODS && done; ++i) {
        all[i] = methods[i];
        done = measure(&all[i], gl, view, &truth, fault);
    }
    double hair_pixels = done ? draw_hair_pixels(&truth) : 1.0;
    for (size_t i = 0; i < METHODS && done; ++i) {
        const Method* m = &all[i];
        if (m->measured)
            printf("%s,%s,%d,%s,%s,%.5f,%.5f,%.5f,%.5f,%.4f,%.3f,%d\n", view->name,
                   transparency_variants[m->transparency].name, m->samples, m->pre_z ? "on" : "off",
                   sorts[m->sort], m->is.rmse, m->is.p99, m->is.flip, m->is.flip_p99,
                   m->hair_pixels / hair_pixels, m->shade_ms, is_on_front(m, all));
        else
            printf("# %s at %d samples is left out: this renderer has %d\n",
                   transparency_variants[m->transparency].name, m->samples, gl->max_samples);
    }
    image_free(&truth);
    return done;
}

bool study_transparency(Fault* fault)
{
    Gl* gl = gl_open("auto", NULL, fault);
    if (gl == NULL) return false;
    printf("# Transparencies against %d alpha-tested samples a pixel: `long`, %d triangles.\n",
           FINER * FINER, hair.triangles);
    study_machine();
    printf("# renderer: %s, %s\n", gl->renderer, gl->version);
    printf("# shade_ms: median of what all threads worked in %d shading passes, sorting included. "
           "front: nothing here is as\n"
           "# fast, of as little FLIP, and better in one. hair: covered area over that of the "
           "truth.\n",
           PICTURES);
    printf("view,transparency,samples,pre_z,sort,rmse,p99,flip,flip_p99,hair,shade_ms,front\n");
    bool done = study_view(gl, &views[0], fault) && study_view(gl, &views[1], fault);
    gl_close(gl);
    return done;
}
