// hair-bench reference: our pictures against path-traced ones of the same 24,665 strands, camera
// and lights (../shared/assets/reference). What a path tracer adds (light between hairs, bounces)
// is in its full pictures and not in those of one scattering event.
#include "client/draw.h"
#include "messages/quantise.h"
#include "tests/follow.h"
#include "tests/studies.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ASSETS    "../shared/assets/" // from the checkout, where commands of the README stand
#define WIDTH     1024
#define HEIGHT    768
#define PITCH_DEG 5.0f
#define BINS      90 // of the strand angle, 2 degrees each
#define FRAMES    5  // timed, after one that is not

typedef struct View {
    const char* name;
    float yaw_deg, distance_m;
} View;

static const View views[] = {{"front", 0.0f, 0.7f},
                             {"threequarter", 35.0f, 0.7f},
                             {"back", 180.0f, 0.7f},
                             {"backwide", 180.0f, 1.0f}};

static double linear(uint8_t code)
{
    double c = code / 255.0;
    return c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
}

// Guides at rest, as a daemon would have sent them.
static bool rest_view(GuidesView* view, const Hairstyle* style, Fault* fault)
{
    Vec3 along[HAIRSTYLE_MAX_NODES];
    if (!guides_view_init(view, 0, fault)) return false;
    view->any = view->complete = true;
    view->guides = style->guide_count;
    view->nodes = style->nodes;
    view->pose = pose_identity();
    for (int layer = 0; layer < 2; ++layer)
        view->layer[layer] = (GuidesLayer){.tick = layer - 1, .pose = pose_identity()};
    for (int row = 0; row < style->guide_count; ++row) {
        const Vec3* nodes = style->rest + row * style->nodes;
        quantise_strand_tangents(along, nodes, style->nodes);
        for (int n = 0; n < style->nodes; ++n) {
            int i = 3 * (row * style->nodes + n);
            quantise_position(view->positions[0] + i, nodes[n], &style->box);
            quantise_tangent(view->tangents[0] + i, along[n]);
        }
        view->row_tick[0][row] = 0;
        view->row_tick[1][row] = -1;
    }
    return true;
}

static int ascending(const void* a, const void* b)
{
    float x = *(const float*)a, y = *(const float*)b;
    return (x > y) - (x < y);
}

// Sum over the passes of each one's median, without reading the picture back.
static double median_ms(const DrawTimes* times)
{
    double sum = 0.0;
    for (int pass = 0; pass < PASS_READ; ++pass) {
        float sorted[FRAMES];
        // The first picture warms up: programs are compiled late.
        memcpy(sorted, times->ms[pass] + 1, sizeof sorted);
        qsort(sorted, FRAMES, sizeof *sorted, ascending);
        sum += (double)sorted[FRAMES / 2];
    }
    return sum;
}

// What stays the same over all pictures.
typedef struct Scene {
    const Gl* gl;
    Hairstyle* style;
    GuidesView guides;
} Scene;

// `*ms` (may be NULL) receives the time of a picture.
static bool draw(Image* image, const Scene* scene, const View* view, const ShadeOptions* options,
                 double* ms, Fault* fault)
{
    Drawing drawing;
    CameraOptions camera = camera_default();
    camera.yaw_deg = view->yaw_deg;
    camera.pitch_deg = PITCH_DEG;
    camera.has_distance = true;
    camera.distance_m = view->distance_m;
    if (!draw_create(&drawing, scene->gl, options, &camera, fault)) return false;
    drawing.timed = ms != NULL;
    bool drawn = draw_set_style(&drawing, scene->style, 1, 0, fault);
    for (int i = 0; drawn && i < (ms != NULL ? 1 + FRAMES : 1); ++i) {
        drawing.fresh = true;
        drawn = draw_picture(&drawing, &scene->guides, image);
    }
    if (ms != NULL) *ms = median_ms(drawing.times);
    draw_free(&drawing);
    return drawn;
}

static bool read_reference(Image* image, const char* name, const char* view, Fault* fault)
{
    char path[512];
    snprintf(path, sizeof path, ASSETS "reference/%s_%s.png", name, view);
    if (!image_read_png(image, path, fault)) return false;
    if (image->width == WIDTH && image->height == HEIGHT) return true;
    image_free(image);
    return fault_set(fault, "%s: %dx%d; it must be %dx%d", path, image->width, image->height, WIDTH,
                     HEIGHT);
}

// Coverage
// ------------------------------------------------------------------------------------------

// The masks' files say that they are linear, so reading them made sRGB codes of what they hold.
// Ours is the picture's alpha.
static void print_coverage(const char* view, int samples, const Image* ours, const Image* mask)
{
    double sum = 0, wanted = 0, difference = 0, above = 0, wanted_above = 0;
    for (size_t i = 0; i < (size_t)WIDTH * HEIGHT; ++i) {
        double a = ours->rgba[4 * i + 3] / 255.0, b = linear(mask->rgba[4 * i]);
        sum += a;
        wanted += b;
        difference += fabs(a - b);
        above += a > 0.5;
        wanted_above += b > 0.5;
    }
    printf("coverage,%s,,,,%d,%.1f,%.1f,%.4f,%.4f,%.4f\n", view, samples, sum, wanted, sum / wanted,
           difference / wanted, above / wanted_above);
    fflush(stdout);
}

static bool study_coverage(const Scene* scene, Image* ours, Fault* fault)
{
    printf("kind,view,shading,shadows,transparency,samples,pixels,reference_pixels,ratio,"
           "mean_difference,ratio_above_half\n");
    for (size_t v = 0; v < sizeof views / sizeof views[0]; ++v)
        for (int samples = 1; samples <= 4; samples += 3) {
            Image mask;
            ShadeOptions options = shade_default();
            options.width = WIDTH;
            options.height = HEIGHT;
            options.samples = samples;
            options.view = VIEW_COVERAGE;
            if (!read_reference(&mask, "mask", views[v].name, fault)) return false;
            bool drawn = draw(ours, scene, &views[v], &options, NULL, fault);
            if (drawn) print_coverage(views[v].name, samples, ours, &mask);
            image_free(&mask);
            if (!drawn) return false;
        }
    return true;
}

static bool run(Scene* scene, Fault* fault)
{
    Image ours;
    scene->style = follow_style(ASSETS, fault);
    if (scene->style == NULL || !rest_view(&scene->guides, scene->style, fault) ||
        !image_create(&ours, WIDTH, HEIGHT, fault))
        return false;
    bool done = study_coverage(scene, &ours, fault);
    image_free(&ours);
    return done;
}

bool study_reference(Fault* fault)
{
    Scene scene = {0};
    scene.gl = gl_open("auto", NULL, fault);
    if (scene.gl == NULL) return false;
    study_machine();
    printf("# renderer: %s\n", scene.gl->renderer);
    bool done = run(&scene, fault);
    guides_view_free(&scene.guides);
    hairstyle_destroy(scene.style);
    gl_close((Gl*)scene.gl);
    return done;
}
