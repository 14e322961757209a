// What a picture costs: every pass, over triangles, distance, resolution, samples, transparency,
// depth first and sorting; and of a frame in which hair or light stand still, only the passes that
// are needed. The cases are those of the thesis's figures 6.1.2 to 6.1.13 (charts/thesis-6.1.csv).
#include "tests/stage.h"
#include "tests/studies.h"

#include <stdio.h>
#include <stdlib.h>

#define PICTURES 9 // of each case, after 2 that compile

typedef struct Case {
    const char* set;
    StageHair hair;
    int width, height;
    float distance_m;
    int samples;
    Transparency transparency;
    bool pre_z;
    ShadeSort sort;
    int update; // row of update_paths
} Case;

static const StageHair hairs[] = {{1250, 125, 6},    {2000, 200, 6},   {4000, 286, 8},
                                  {7800, 390, 11},   {10000, 500, 11}, {15000, 750, 11},
                                  {140000, 5000, 15}}; // 150,000 vertices
enum { HAIR_1250, HAIR_2K, HAIR_4K, HAIR_7800, HAIR_10K, HAIR_15K, HAIR_150K };

// What a frame has to do anew. Hair that moves changes all; light that moves no positions.
static const struct {
    const char* name;
    bool needs[PASSES];
} frames[] = {{"simulation on", {true, true, true, true, true, true}},
              {"simulation off; light moves", {false, false, true, true, true, true}},
              {"simulation off; light still", {false, false, false, true, true, true}}};

static const char* const sorts[] = {"auto", "off", "wisps", "segments"};

typedef struct Times {
    double median, p95, least, processor; // ms
} Times;

static void print_row(const Case* one, int samples, const char* pass, Times t)
{
    printf("%s,%s,%d,%d,%dx%d,%g,%d,%s,%s,%s,%.3f,%.3f,%.3f,%.3f\n", one->set, pass,
           one->hair.triangles, 2 * one->hair.wisps * one->hair.points, one->width, one->height,
           (double)one->distance_m, samples, transparency_variants[one->transparency].name,
           one->pre_z ? "on" : "off", sorts[one->sort], t.median, t.p95, t.least, t.processor);
}

static Times times_of(const Stage* stage, int pass)
{
    return (Times){stage_pass_ms(stage, pass, 0.5), stage_pass_ms(stage, pass, 0.95),
                   stage_pass_ms(stage, pass, 0.0), stage_processor_ms(stage, pass, 0.5)};
}

static void print_case(const Case* one, const Stage* stage, double* whole)
{
    int samples = stage->drawing.shade.samples;
    for (int pass = 0; pass < PASSES; ++pass)
        print_row(one, samples, draw_pass_names[pass], times_of(stage, pass));
    for (size_t f = 0; f < sizeof frames / sizeof frames[0]; ++f) {
        Times sum = {0, 0, 0, 0};
        for (int pass = 0; pass < PASSES; ++pass) {
            Times t = times_of(stage, pass);
            if (!frames[f].needs[pass]) continue;
            sum.median += t.median, sum.p95 += t.p95, sum.least += t.least;
            sum.processor += t.processor;
        }
        char name[64];
        snprintf(name, sizeof name, "frame; %s", frames[f].name);
        if (f == 0) { // by the clock round it
            sum.median = stage_quantile(whole, PICTURES, 0.5);
            sum.p95 = stage_quantile(whole, PICTURES, 0.95);
            sum.least = stage_quantile(whole, PICTURES, 0.0);
        }
        print_row(one, samples, name, sum);
    }
    fflush(stdout);
}

static bool measure(const Case* one, const Gl* gl, Fault* fault)
{
    if (one->samples > gl->max_samples) {
        printf("# %s at %d samples is left out: this renderer has %d\n", one->set, one->samples,
               gl->max_samples);
        return true;
    }
    ShadeOptions options = shade_default();
    options.width = one->width;
    options.height = one->height;
    options.samples = one->samples;
    options.transparency = one->transparency;
    options.pre_z = one->pre_z;
    options.sort = one->sort;
    options.update = one->update;
    CameraOptions camera = camera_default();
    camera.has_distance = true;
    camera.distance_m = one->distance_m;
    static Stage stage; // large
    bool opened = stage_open(&stage, gl, &one->hair, &options, &camera, fault);
    if (opened) {
        double whole[PICTURES];
        for (int i = -2; i < PICTURES; ++i) {
            stage_move(&stage);
            double ms = stage_draw(&stage);
            if (i == -1) stage_forget(&stage);
            if (i >= 0) whole[i] = ms;
        }
        print_case(one, &stage, whole);
    }
    stage_close(&stage);
    return opened && gl_check(gl, one->set, fault);
}

// How far the eye is in the thesis: close, medium, far.
static const float distances[] = {0.7f, 1.4f, 7.0f};

static bool measure_draws(const Gl* gl, Fault* fault)
{
    static const int by[] = {HAIR_2K, HAIR_4K, HAIR_10K, HAIR_15K};
    for (int h = 0; h < 4; ++h)
        for (int d = 0; d < 3; ++d)
            for (int samples = 1; samples <= 4; samples *= 4) {
                Transparency t = samples > 1 ? TRANSPARENCY_HASH : TRANSPARENCY_TEST;
                Case one = {"draw", hairs[by[h]], 1024,      768, distances[d], samples,
                            t,      false,        SORT_AUTO, 0};
                if (!measure(&one, gl, fault)) return false;
                one.set = "pre-z";
                one.pre_z = true;
                bool wanted = by[h] == HAIR_4K || by[h] == HAIR_10K;
                if (wanted && !measure(&one, gl, fault)) return false;
            }
    return true;
}

static bool measure_transparencies(const Gl* gl, Fault* fault)
{
    static const struct {
        Transparency transparency;
        int samples;
        ShadeSort sort;
    } by[] = {{TRANSPARENCY_TEST, 1, SORT_SEGMENTS}, {TRANSPARENCY_TEST, 4, SORT_AUTO},
              {TRANSPARENCY_COVERAGE, 4, SORT_AUTO}, {TRANSPARENCY_HASH, 4, SORT_SEGMENTS},
              {TRANSPARENCY_HASH, 8, SORT_AUTO},     {TRANSPARENCY_BLEND, 1, SORT_OFF},
              {TRANSPARENCY_BLEND, 1, SORT_WISPS},   {TRANSPARENCY_BLEND, 1, SORT_SEGMENTS},
              {TRANSPARENCY_BLEND, 4, SORT_SEGMENTS}};
    for (size_t i = 0; i < sizeof by / sizeof by[0]; ++i)
        for (int d = 0; d < 3; ++d) {
            Case one = {"transparency", hairs[HAIR_10K],    1024,  768,        distances[d],
                        by[i].samples,  by[i].transparency, false, by[i].sort, 0};
            if (!measure(&one, gl, fault)) return false;
        }
    return true;
}

static bool measure_others(const Gl* gl, Fault* fault)
{
    static const int sizes[][2] = {{512, 384}, {1024, 768}, {1920, 1080}};
    for (int i = 0; i < 3; ++i) {
        Case one = {"resolution",
                    hairs[HAIR_10K],
                    sizes[i][0],
                    sizes[i][1],
                    1.4f,
                    1,
                    TRANSPARENCY_TEST,
                    false,
                    SORT_AUTO,
                    0};
        if (!measure(&one, gl, fault)) return false;
    }
    // Figure 6.1.13 by what there is here: shadows as by default, the same for all three.
    static const int lods[] = {HAIR_7800, HAIR_2K, HAIR_1250};
    for (int i = 0; i < 3; ++i) {
        Case one = {"totals",
                    hairs[lods[i]],
                    1024,
                    768,
                    distances[i],
                    1,
                    TRANSPARENCY_TEST,
                    false,
                    i == 0 ? SORT_SEGMENTS : SORT_AUTO,
                    0};
        if (!measure(&one, gl, fault)) return false;
    }
    Case most = {"most", hairs[HAIR_150K],  1024,  768,       0.7f,
                 1,      TRANSPARENCY_TEST, false, SORT_AUTO, 0};
    return measure(&most, gl, fault);
}

static Gl* begin(Fault* fault)
{
    Gl* gl = gl_open("auto", NULL, fault);
    if (gl == NULL) return NULL;
    printf("# What a picture costs, milliseconds: median, 95th percentile and least of %d.\n",
           PICTURES);
    study_machine();
    printf("# renderer: %s, %s\n", gl->renderer, gl->version);
    printf("# Each pass ends with glFinish. A frame is the clock round all of them, the reading of "
           "the\n"
           "# picture included; one with simulation off is the sum of the passes that it needs.\n"
           "# processor_ms: median of what all threads worked, whatever else ran here.\n");
    printf("set,pass,triangles,vertices,size,distance_m,samples,transparency,pre_z,sort,median_ms,"
           "p95_ms,least_ms,processor_ms\n");
    return gl;
}

bool study_frame(Fault* fault)
{
    Gl* gl = begin(fault);
    bool done = gl != NULL && measure_draws(gl, fault) && measure_transparencies(gl, fault) &&
                measure_others(gl, fault);
    if (gl != NULL) gl_close(gl);
    return done;
}

// The smallest picture, so that little but the update pass is paid for. A path that keeps no points
// pays in the passes after it: the frame tells.
bool study_update(Fault* fault)
{
    static const int by[] = {HAIR_2K, HAIR_4K, HAIR_10K, HAIR_15K, HAIR_150K};
    Gl* gl = begin(fault);
    bool done = gl != NULL;
    for (int path = 0; update_paths[path].name != NULL; ++path)
        for (int h = 0; h < 5 && done; ++h) {
            char set[32] = "update"; // the path that there always was
            if (path > 0) snprintf(set, sizeof set, "update %s", update_paths[path].name);
            Case one = {set, hairs[by[h]],      64,    48,        7.0f,
                        1,   TRANSPARENCY_TEST, false, SORT_AUTO, path};
            done = measure(&one, gl, fault);
        }
    if (gl != NULL) gl_close(gl);
    return done;
}
