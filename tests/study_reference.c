// hair-bench reference: our pictures against path-traced ones of the same 24,665 strands, camera
// and lights (../shared/assets/reference). What a path tracer adds (light between hairs, bounces)
// is in its full pictures and not in those of one scattering event.
#include "client/draw.h"
#include "messages/quantise.h"
#include "tests/follow.h"
#include "tests/strand_angle.h"
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
#define REGION    16
#define FRAMES    3 // timed, after one that is not

typedef struct View {
    const char* name;
    float yaw_deg, distance_m;
} View;

static const View views[] = {{"front", 0.0f, 0.7f},
                             {"threequarter", 35.0f, 0.7f},
                             {"back", 180.0f, 0.7f},
                             {"backwide", 180.0f, 1.0f}};

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

static CameraOptions view_camera(const View* view)
{
    CameraOptions camera = camera_default();
    camera.yaw_deg = view->yaw_deg;
    camera.pitch_deg = PITCH_DEG;
    camera.has_distance = true;
    camera.distance_m = view->distance_m;
    return camera;
}

// `*ms` (may be NULL) receives the time of a picture.
static bool draw(Image* image, const Scene* scene, const View* view, const ShadeOptions* options,
                 double* ms, Fault* fault)
{
    Drawing drawing;
    CameraOptions camera = view_camera(view);
    if (!draw_create(&drawing, scene->gl, options, &camera, fault)) return false;
    drawing.timed = ms != NULL;
    bool drawn = draw_set_style(&drawing, scene->style, 1, 0, fault);
    for (int i = 0; drawn && i < (ms != NULL ? 1 + FRAMES : 1); ++i) {
        drawing.moved = true;
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
        double a = ours->rgba[4 * i + 3] / 255.0, b = image_linear(mask->rgba[4 * i]);
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

// Colour ------------------------------------------------------------------------------------------

// A path-traced picture and what our side has to be set to.
typedef struct Picture {
    const char *name, *view;
    bool is_clay;         // white, key light alone, black behind
    double absorption[3]; // per radius (scene.json, hair.material.presets)
} Picture;

#define BROWN                                                                                      \
    {                                                                                              \
        0.735674, 1.301391, 2.791248                                                               \
    }
#define BLOND                                                                                      \
    {                                                                                              \
        0.101999, 0.180434, 0.386998                                                               \
    }

static const Picture pictures[] = {
    {"claykey", "threequarter", true, {0}},      {"darkbrown1", "threequarter", false, BROWN},
    {"blond1", "threequarter", false, BLOND},    {"darkbrown", "front", false, BROWN},
    {"darkbrown", "threequarter", false, BROWN}, {"darkbrown", "back", false, BROWN},
    {"blond", "threequarter", false, BLOND},     {"blond", "back", false, BLOND},
};

// The path tracer's fibre (scene.json, hair.material.derived): R's variance 0.0846 over theta_i +
// theta_r is twice as wide as over theta_h, its cuticle 2.5 degrees, its logistic's deviation
// 0.2125.
static Fibre traced_fibre(const Picture* picture)
{
    Fibre fibre = marschner_fibre();
    fibre.eta = 1.55;
    fibre.alpha_deg = -2.5;
    fibre.beta_deg = 0.5 * sqrt(0.0846112) * 180.0 / M_PI;
    fibre.width_deg = 0.1171598 * M_PI / sqrt(3.0) * 180.0 / M_PI;
    fibre.norm = NORM_DEON;
    for (int c = 0; c < MARSCHNER_CHANNELS; ++c)
        fibre.absorption[c] = picture->absorption[c % 3];
    return fibre;
}

// What one fibre gives back of light from everywhere, at the mean of cos theta_d: 0.93 or so.
static Vec3 traced_albedo(const Fibre* fibre)
{
    float albedo[3] = {0, 0, 0};
    for (int c = 0; c < 3; ++c)
        for (int lobe = 0; lobe < LOBES; ++lobe)
            albedo[c] += (float)marschner_energy(fibre->eta, 0.93, lobe, fibre->absorption[c]);
    return vec3(albedo[0], albedo[1], albedo[2]);
}

static ShadeOptions picture_options(const Picture* picture, Vec3* albedo)
{
    ShadeOptions options = shade_default();
    options.width = WIDTH;
    options.height = HEIGHT;
    options.has_background = true;
    options.background = picture->is_clay ? vec3(0, 0, 0) : vec3(0.25f, 0.25f, 0.25f);
    if (picture->is_clay)
        options.light_strength[LIGHT_FILL] = options.light_strength[LIGHT_RIM] =
            options.light_strength[LIGHT_SKY] = 0.0f;
    ShadingOptions* shading = &options.shading;
    shading->fibre = traced_fibre(picture);
    shading->has_absorption = true;
    shading->through = 1.0f;
    shading->diffuse = 0.0f;
    *albedo = traced_albedo(&shading->fibre);
    return options;
}

typedef struct Tint {
    double rgb[3], weight;
} Tint;

static void add_tint(Tint* tint, const uint8_t* rgba, double weight)
{
    for (int c = 0; c < 3; ++c)
        tint->rgb[c] += weight * image_linear(rgba[c]);
    tint->weight += weight;
}

// Mean luminance by strand angle; where it is greatest, in degrees, as the middle of what lies
// above 90 % of it: a maximum alone jumps with the noise.
static double peak_degrees(const Image* image, const Image* mask, const float* angles)
{
    double sum[BINS] = {0}, weight[BINS] = {0}, most = 0, middle = 0, share = 0;
    for (int i = 0; i < WIDTH * HEIGHT; ++i) {
        if (isnan(angles[i]) || image_linear(mask->rgba[4 * i]) < 0.5) continue;
        int bin = (int)(((double)angles[i] / M_PI + 0.5) * BINS);
        bin = bin < 0 ? 0 : bin >= BINS ? BINS - 1 : bin;
        const uint8_t* p = image->rgba + 4 * (size_t)i;
        sum[bin] +=
            0.2126 * image_linear(p[0]) + 0.7152 * image_linear(p[1]) + 0.0722 * image_linear(p[2]);
        weight[bin] += 1;
    }
    for (int b = 0; b < BINS; ++b) {
        sum[b] = weight[b] >= 200 ? sum[b] / weight[b] : 0; // a bin of few pixels is noise
        most = sum[b] > most ? sum[b] : most;
    }
    for (int b = 0; b < BINS; ++b)
        if (sum[b] > 0.9 * most) {
            middle += sum[b] * ((b + 0.5) / BINS - 0.5) * 180.0;
            share += sum[b];
        }
    return share > 0 ? middle / share : (double)NAN;
}

// Root mean square over squares of REGION pixels of the difference of mean colours, weighted by the
// mask, as a share of the reference's mean: single pixels of thin strands are noise.
static double region_error(const Image* ours, const Image* reference, const Image* mask)
{
    double square = 0, all = 0, mean = 0;
    for (int y = 0; y + REGION <= HEIGHT; y += REGION)
        for (int x = 0; x + REGION <= WIDTH; x += REGION) {
            Tint a = {0}, b = {0};
            for (int i = 0; i < REGION * REGION; ++i) {
                size_t at = 4 * (size_t)((y + i / REGION) * WIDTH + x + i % REGION);
                double w = image_linear(mask->rgba[at]);
                add_tint(&a, ours->rgba + at, w);
                add_tint(&b, reference->rgba + at, w);
            }
            for (int c = 0; c < 3 && a.weight > 0; ++c) {
                double d = (a.rgb[c] - b.rgb[c]) / a.weight;
                square += d * d * a.weight / 3.0;
                mean += b.rgb[c] / 3.0;
            }
            all += a.weight;
        }
    return sqrt(square / all) / (mean / all);
}

typedef struct Method {
    const char *shading, *shadows;
    ShadingKind kind;
    bool all_lights; // cast shadows
} Method;

static const Method methods[] = {
    {"clay", "none", SHADING_CLAY, false},
    {"clay", "depth", SHADING_CLAY, false},
    {"clay", "opacity", SHADING_CLAY, false},
    {"clay", "deep", SHADING_CLAY, false},
    {"kajiya", "deep", SHADING_KAJIYA, false},
    {"banks", "deep", SHADING_BANKS, false},
    {"marschner", "none", SHADING_MARSCHNER, false},
    {"marschner", "depth", SHADING_MARSCHNER, false},
    {"marschner", "opacity", SHADING_MARSCHNER, false},
    {"marschner", "deep", SHADING_MARSCHNER, false},
    {"kajiya", "deep", SHADING_KAJIYA, true},
    {"marschner", "depth", SHADING_MARSCHNER, true},
    {"marschner", "opacity", SHADING_MARSCHNER, true},
    {"marschner", "deep", SHADING_MARSCHNER, true},
};

// Everything that a row of the CSV is made from.
typedef struct Pair {
    const Picture* picture;
    const Method* method;
    Image *ours, reference, mask;
    const float* angles;
    double ms;
} Pair;

static void print_colour(const Pair* pair)
{
    Tint ours = {0}, theirs = {0};
    for (size_t i = 0; i < (size_t)WIDTH * HEIGHT; ++i) {
        double w = image_linear(pair->mask.rgba[4 * i]);
        add_tint(&ours, pair->ours->rgba + 4 * i, w);
        add_tint(&theirs, pair->reference.rgba + 4 * i, w);
    }
    printf("%s,%s,%s,%s,%s,%.2f", pair->picture->name, pair->picture->view, pair->method->shading,
           pair->method->shadows, pair->method->all_lights ? "all" : "key", pair->ms);
    for (int c = 0; c < 3; ++c)
        printf(",%.4f,%.4f", ours.rgb[c] / ours.weight, ours.rgb[c] / theirs.rgb[c]);
    printf(",%.1f,%.1f,%.4f\n", peak_degrees(pair->ours, &pair->mask, pair->angles),
           peak_degrees(&pair->reference, &pair->mask, pair->angles),
           region_error(pair->ours, &pair->reference, &pair->mask));
    fflush(stdout);
}

// In clay the traced head is white as well.
static void whiten(HeadMesh* head)
{
    for (int p = 0; p < head->part_count; ++p) {
        head->parts[p].albedo = vec3(0.8f, 0.8f, 0.8f);
        head->parts[p].is_skin = false; // no scalp
    }
}

static bool draw_pair(Pair* pair, const Scene* scene, const View* view, Fault* fault)
{
    Vec3 albedo;
    ShadeOptions options = picture_options(pair->picture, &albedo);
    options.shading.kind = pair->method->kind;
    options.shadow.method = shadow_find_method(pair->method->shadows);
    options.shadow.all_lights = pair->method->all_lights;
    if (pair->method->all_lights) options.shading.wrap = 0.0f; // shadows are there for that
    scene->style->material.root_colour = scene->style->material.tip_colour = albedo;
    HeadMesh* head = &scene->style->head;
    HeadPart parts[HAIRSTYLE_MAX_PARTS];
    memcpy(parts, head->parts, sizeof parts);
    if (pair->picture->is_clay) whiten(head);
    bool drawn = draw(pair->ours, scene, view, &options, &pair->ms, fault);
    memcpy(head->parts, parts, sizeof parts);
    if (!drawn) return false;
    print_colour(pair);
    return true;
}

static bool study_picture(const Picture* picture, const Scene* scene, Image* ours, Fault* fault)
{
    const View* view = views;
    while (strcmp(view->name, picture->view) != 0)
        ++view;
    Pair pair = {.picture = picture, .ours = ours};
    ShadeOptions options = shade_default();
    CameraOptions orbit = view_camera(view);
    Camera camera = camera_orbit(&orbit, scene->style, (float)WIDTH / HEIGHT);
    float* angles = strand_angles(scene->style, &camera,
                                  camera_direction(options.light_yaw_deg, options.light_pitch_deg),
                                  WIDTH, HEIGHT);
    pair.angles = angles;
    bool done = angles != NULL &&
                read_reference(&pair.reference, picture->name, picture->view, fault) &&
                read_reference(&pair.mask, "mask", picture->view, fault);
    for (size_t m = 0; done && m < sizeof methods / sizeof methods[0]; ++m) {
        pair.method = &methods[m];
        if (picture->is_clay == (methods[m].kind == SHADING_CLAY))
            done = draw_pair(&pair, scene, view, fault);
    }
    image_free(&pair.mask);
    image_free(&pair.reference);
    free(angles);
    return done;
}

static bool study_colour(const Scene* scene, Image* ours, Fault* fault)
{
    printf("picture,view,shading,shadows,lights,ms,red,red_ratio,green,green_ratio,blue,blue_ratio,"
           "peak_deg,reference_peak_deg,region_error\n");
    for (size_t i = 0; i < sizeof pictures / sizeof pictures[0]; ++i)
        if (!study_picture(&pictures[i], scene, ours, fault)) return false;
    return true;
}

static bool run(Scene* scene, Fault* fault)
{
    Image ours;
    scene->style = follow_style(ASSETS, fault);
    if (scene->style == NULL || !rest_view(&scene->guides, scene->style, fault) ||
        !image_create(&ours, WIDTH, HEIGHT, fault))
        return false;
    bool done = study_coverage(scene, &ours, fault) && study_colour(scene, &ours, fault);
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
