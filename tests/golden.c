#include "tests/golden.h"

#include <stdio.h>
#include <string.h>
#include <xxhash.h>

#define SMALL " --size 320x240 "

// Small, since each is kept as a file. Every variant that ships is in one of them.
const GoldenScene golden_scenes[] = {
    {"long", "--style long --tick 0 --yaw 25 --distance 0.55 --target 0,0.19,0" SMALL},
    {"long-shake", "--style long --motion shake --tick 62 --yaw 150 --distance 0.66 "
                   "--target 0,0.14,0" SMALL},
    {"long-test", "--style long --motion nod --tick 40 --yaw 60 --distance 0.6 --msaa 1" SMALL},
    {"long-gust", "--style long --motion gust --tick 90 --yaw 0 --distance 0.6 "
                  "--transparency blend" SMALL},
    {"long-behind", "--style long --tick 5 --yaw 40 --distance 0.6 --light 200,30" SMALL},
    {"long-far", "--style long --motion run --tick 50 --yaw 30 --distance 1.6 "
                 "--background 404040" SMALL},
    {"long-coverage", "--style long --tick 0 --yaw 70 --distance 0.6 --view coverage" SMALL},
    {"bob", "--style bob --tick 0 --yaw 20 --distance 0.44 --target 0,0.21,0" SMALL},
    {"bob-shake", "--style bob --motion shake --tick 45 --yaw 130 --distance 0.46 "
                  "--target 0,0.2,0" SMALL},
    {"bob-ends", "--style bob --tick 0 --yaw 90 --distance 0.3 --fov 8 "
                 "--target 0.09,0.135,-0.01" SMALL}, // so near that one wisp is a part of it
    {"ponytail", "--style ponytail --motion shake --tick 72 --yaw 100 --distance 0.54 "
                 "--target 0,0.17,0" SMALL},
    {"crest", "--style crest --motion shake --tick 40 --yaw 65 --distance 0.62 "
              "--transparency coverage --pre-z on" SMALL},
    {NULL, NULL}};

const GoldenScene* golden_scene(const char* name)
{
    for (const GoldenScene* scene = golden_scenes; scene->name != NULL; ++scene)
        if (strcmp(scene->name, name) == 0) return scene;
    return NULL;
}

void golden_parse(Golden* golden, const GoldenScene* scene)
{
    static char program[] = "golden scene", embedded[] = "--embedded";
    int argc = 0;
    golden->argv[argc++] = program;
    golden->argv[argc++] = embedded;
    snprintf(golden->words, sizeof golden->words, "%s", scene->options);
    char* rest = NULL;
    for (char* word = strtok_r(golden->words, " ", &rest); word != NULL && argc < 63;
         word = strtok_r(NULL, " ", &rest))
        golden->argv[argc++] = word;
    golden->options = options_parse(argc, golden->argv);
}

static void take_message(void* context, int64_t utime, const char* channel, const uint8_t* bytes,
                         size_t size)
{
    Golden* golden = context;
    receive_message(golden->receive, channel, bytes, size, utime);
}

static bool simulate(Golden* golden, Fault* fault)
{
    const Options* options = &golden->options;
    DaemonOptions daemon = daemon_default();
    for (int i = 0; i < options->style_count; ++i)
        daemon.load.styles[daemon.load.style_count++] = options->styles[i];
    if (options->motion != NULL) daemon.motion = options->motion;
    daemon.characters = 1;
    daemon.fast = true;
    golden->daemon = daemon_create(&daemon, fault);
    golden->receive = receive_create(&options->slot, 1, (Notice){0}, fault);
    if (golden->daemon == NULL || golden->receive == NULL) return false;
    daemon_add_sink(golden->daemon, (DaemonSink){take_message, golden});
    daemon_publish_styles(golden->daemon);
    for (int tick = 0; tick <= options->first_tick; ++tick) {
        daemon_tick(golden->daemon);
        daemon_publish_slice(golden->daemon, 0, 1);
        receive_take(golden->receive, &golden->view);
    }
    return golden->view.complete || fault_set(fault, "rows of the last tick are missing");
}

// Programs stay from scene to scene where they would be the same: drivers compile for a second.
static bool prepare_drawing(Golden* golden, Fault* fault)
{
    const Options* options = &golden->options;
    Drawing* drawing = &golden->drawing;
    if (golden->can_draw &&
        memcmp(&golden->made_for, &options->shade, sizeof options->shade) == 0) {
        drawing->camera = options->camera;
        drawing->has_style = false; // the one that it holds is gone with the scene before
        return true;
    }
    if (golden->can_draw) draw_free(drawing);
    golden->made_for = options->shade;
    golden->can_draw = draw_create(drawing, golden->gl, &options->shade, &options->camera, fault);
    return golden->can_draw;
}

bool golden_open(Golden* golden, Gl* gl, Fault* fault)
{
    const Options* options = &golden->options;
    golden->gl = gl;
    if (!guides_view_init(&golden->view, options->slot, fault) || !simulate(golden, fault) ||
        !image_create(&golden->image, options->shade.width, options->shade.height, fault))
        return false;
    if (!prepare_drawing(golden, fault)) return false;
    int samples = golden->drawing.shade.samples;
    if (samples != options->shade.samples)
        return fault_set(fault, "%s has %d samples a pixel and not %d", gl->renderer, samples,
                         options->shade.samples);
    int version;
    bool complete;
    const Hairstyle* style =
        receive_style(golden->receive, golden->view.style_hash, &version, &complete);
    if (style == NULL || !complete) return fault_set(fault, "the style is missing");
    return draw_set_style(&golden->drawing, style, golden->view.style_hash, version, fault);
}

bool golden_draw(Golden* golden, Fault* fault)
{
    if (!draw_picture(&golden->drawing, &golden->view, &golden->image))
        return fault_set(fault, "nothing is drawn");
    for (int i = 0; i < golden->image.width * golden->image.height; ++i)
        golden->image.rgba[4 * i + 3] = 255; // files are without
    return gl_check(golden->gl, "a golden picture", fault);
}

void golden_close(Golden* golden)
{
    image_free(&golden->image);
    guides_view_free(&golden->view);
    receive_destroy(golden->receive);
    daemon_destroy(golden->daemon);
    golden->receive = NULL;
    golden->daemon = NULL;
}

void golden_free(Golden* golden)
{
    golden_close(golden);
    if (golden->can_draw) draw_free(&golden->drawing);
    memset(golden, 0, sizeof *golden);
}

void golden_renderer(const Gl* gl, char* text, size_t size)
{
    snprintf(text, size, "%s, %s", gl->renderer, gl->version);
}

uint64_t golden_hash(const Image* image)
{
    return XXH64(image->rgba, (size_t)image->width * (size_t)image->height * 4, 0);
}

bool golden_is_within(const Comparison* comparison)
{
    return comparison->flip <= 0.004 && comparison->p99 <= 0.01 && comparison->rmse <= 0.01;
}
