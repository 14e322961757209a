#include "client/options.h"

#include <argp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum {
    KEY_URL = 256,
    KEY_LOG,
    KEY_EMBEDDED,
    KEY_STYLE,
    KEY_HEAD,
    KEY_UNIT,
    KEY_MOTION,
    KEY_SLOT,
    KEY_BACKEND,
    KEY_SIZE,
    KEY_MSAA,
    KEY_TARGET,
    KEY_DISTANCE,
    KEY_YAW,
    KEY_PITCH,
    KEY_FOV,
    KEY_LIGHT,
    KEY_LIGHTS,
    KEY_BACKGROUND,
    KEY_SHADING,
    KEY_MARSCHNER,
    KEY_COLOUR,
    KEY_TRANSPARENCY,
    KEY_PRE_Z,
    KEY_SORT,
    KEY_VIEW,
    KEY_SHADOWS,
    KEY_SHADOW_SIZE,
    KEY_SHADOW_LAYERS,
    KEY_SHADOW_LIGHTS,
    KEY_LOD,
    KEY_UPDATE,
    KEY_TICK,
    KEY_TICKS,
    KEY_EPOCH,
    KEY_FRAMES,
    KEY_TIMEOUT,
    KEY_OUT,
    KEY_STATS,
    KEY_VERBOSE
};

static const struct argp_option arguments[] = {
    {0, 0, 0, 0, "Where the hair comes from (default: the bus)", 1},
    {"url", KEY_URL, "URL", 0, "LCM bus; default $LCM_DEFAULT_URL or udpm://239.255.76.67:7667", 0},
    {"log", KEY_LOG, "FILE", 0, "a recorded log, played frame by frame without a network", 0},
    {"embedded", KEY_EMBEDDED, 0, 0, "a daemon inside this process, one tick a frame", 0},
    {"style", KEY_STYLE, "NAME|FILE", 0,
     "embedded: long, bob, ponytail, curly, short, crest, a .json or .tfx files", 0},
    {"head", KEY_HEAD, "FILE.obj", 0, "embedded: the head of a .tfx groom", 0},
    {"unit", KEY_UNIT, "M", 0, "embedded: metres per unit of the groom's files", 0},
    {"motion", KEY_MOTION, "NAME", 0,
     "embedded: none, nod, shake, jump-stop, run, flip, turn, teleport, gust", 0},
    {"slot", KEY_SLOT, "N", 0, "which character (default 0)", 0},
    {0, 0, 0, 0, "The picture", 2},
    {"backend", KEY_BACKEND, "NAME", 0, "auto (default), egl, osmesa or null", 0},
    {"size", KEY_SIZE, "WxH", 0, "pixels (default 1024x768)", 0},
    {"msaa", KEY_MSAA, "N", 0, "samples a pixel: 1, 2, 4 (default) or 8", 0},
    {"target", KEY_TARGET, "X,Y,Z", 0,
     "what the camera orbits, head space m (default: head centre)", 0},
    {"distance", KEY_DISTANCE, "M", 0, "from the target (default: all of the hair is seen)", 0},
    {"yaw", KEY_YAW, "DEG", 0, "0 sees the face, 90 stands on +X (default 30)", 0},
    {"pitch", KEY_PITCH, "DEG", 0, "positive looks down (default 5)", 0},
    {"fov", KEY_FOV, "DEG", 0, "vertical (default 45)", 0},
    {"light", KEY_LIGHT, "YAW,PITCH", 0, "where the key light stands (default 40,45)", 0},
    {"lights", KEY_LIGHTS, "KEY,FILL,RIM,SKY", 0,
     "irradiance of the three lights, radiance of the sky (default 3,0.6,2,0.25)", 0},
    {"background", KEY_BACKGROUND, "RRGGBB", 0, "one sRGB colour instead of the grey backdrop", 0},
    {"shading", KEY_SHADING, "NAME", 0,
     "kajiya (default), marschner, banks, or clay: white, to judge light and shadow", 0},
    {"marschner", KEY_MARSCHNER, "NAME=N,...", 0,
     "its eta, alpha, beta, width (degrees), shine, through, diffuse; norm=half, paper or deon", 0},
    {"colour", KEY_COLOUR, "NAME", 0, "of the hair instead of its own: blond, brown, black, red",
     0},
    {"transparency", KEY_TRANSPARENCY, "NAME", 0,
     "test (default at 1 sample), coverage: GL's alpha to coverage, hash (default at 2 or more): "
     "hash-dithered coverage, or blend: sorted from back to front",
     0},
    {"pre-z", KEY_PRE_Z, "on|off", 0, "draw hair's depth first (default off)", 0},
    {"sort", KEY_SORT, "NAME", 0,
     "by distance, each picture: off, wisps or segments (default for blend, from back to front; "
     "others are sorted from front to back)",
     0},
    {"view", KEY_VIEW, "NAME", 0,
     "shaded (default); coverage: hair as linear grey; transmittance: how much key light arrives",
     0},
    {"shadows", KEY_SHADOWS, "NAME", 0, "none, depth, opacity, layered or deep (default)", 0},
    {"shadow-size", KEY_SHADOW_SIZE, "N", 0,
     "texels across a shadow map: 64 to 1024 (default 512, fewer in pictures of small heads)", 0},
    {"shadow-layers", KEY_SHADOW_LAYERS, "N", 0,
     "planes of optical depth: 4 to 128 (opacity, default 16; layered, 32), 2 to 8 (deep, 4)", 0},
    {"shadow-lights", KEY_SHADOW_LIGHTS, "NAME", 0,
     "which cast shadows: key (default), or all: fill and rim too, by maps half as wide", 0},
    {"lod", KEY_LOD, "NAME", 0,
     "full (default), or close, medium, far: 7,800, 2,000 or 1,250 triangles of hair", 0},
    {"update", KEY_UPDATE, "NAME", 0,
     "where ribbon points are found: pass (default), buffer, vertex, cpu, linear; for comparison",
     0},
    {0, 0, 0, 0, "Which ticks", 3},
    {"tick", KEY_TICK, "N", 0, "draw exactly tick N (log, embedded)", 0},
    {"ticks", KEY_TICKS, "A:B[:STEP]", 0,
     "draw ticks A to B, both included, or every STEP-th of them (log, embedded)", 0},
    {"epoch", KEY_EPOCH, "E", 0, "of a log that holds several", 0},
    {"frames", KEY_FRAMES, "N", 0, "end after N pictures", 0},
    {"timeout", KEY_TIMEOUT, "S", 0,
     "bus: fail if for S seconds no picture can be drawn and no part of a style comes", 0},
    {0, 0, 0, 0, "What comes out", 4},
    {"out", KEY_OUT, "FILE.png|DIR|FILE.mp4", 0,
     "the last picture, every picture as DIR/00000.png ..., or a film (needs ffmpeg)", 0},
    {"stats", KEY_STATS, "FILE.json", 0,
     "counters and pass times at the end; - for standard output", 0},
    {"quiet", 'q', 0, 0, "errors only", 0},
    {"verbose", KEY_VERBOSE, 0, 0, "at the end, pictures and hair pixels", 0},
    {0}};

static const char text[] =
    "Draws hair that a hair-server streams (or that a log holds), headless, on EGL or OSMesa.\v"
    "Examples:\n"
    "  hair-client --out hair.png --frames 60          the 60th picture from the bus\n"
    "  hair-client --slot 3 --yaw 180 --out frames/    character 3 from behind, every tick\n"
    "  hair-client --log run.lcmlog --tick 120 --out t120.png\n"
    "  hair-client --log run.lcmlog --ticks 0:179 --out run.mp4\n"
    "  hair-client --embedded --style bob --motion shake --frames 60 --out bob.png\n"
    "Any start order: a client waits for its daemon, and finds it again after a restart.\n"
    "Exit status: 0 done, 1 failed, 2 wrong arguments.";

static double number(struct argp_state* state, const char* name, const char* value, double low,
                     double high)
{
    char* end;
    double n = strtod(value, &end);
    if (end == value || *end != '\0' || !(n >= low && n <= high))
        argp_error(state, "--%s %s: want a number from %g to %g", name, value, low, high);
    return n;
}

static int64_t integer(struct argp_state* state, const char* name, const char* value, int64_t low,
                       int64_t high)
{
    char* end;
    long long n = strtoll(value, &end, 10);
    if (end == value || *end != '\0' || n < low || n > high)
        argp_error(state, "--%s %s: want a whole number from %lld to %lld", name, value,
                   (long long)low, (long long)high);
    return n;
}

// The whole numbers between `separator`s; how many, or 0 where `value` is anything else or more
// than `most` of them. Not sscanf: what it makes of a number that does not fit is undefined.
static int integers(int64_t* numbers, int most, const char* value, char separator)
{
    for (int n = 0; n < most; ++n) {
        char* end;
        numbers[n] = strtoll(value, &end, 10); // out of range: the largest or least
        if (end == value) return 0;
        if (*end == '\0') return n + 1;
        if (*end != separator) return 0;
        value = end + 1;
    }
    return 0;
}

static void parse_size(struct argp_state* state, const char* value, ShadeOptions* shade)
{
    int64_t size[2] = {0, 0};
    if (integers(size, 2, value, 'x') != 2 || size[0] < 16 || size[1] < 16 || size[0] > 8192 ||
        size[1] > 8192)
        argp_error(state, "--size %s: want WIDTHxHEIGHT, 16 to 8192 each, like 1024x768", value);
    shade->width = (int)size[0];
    shade->height = (int)size[1];
}

static float linear(unsigned code)
{
    float c = (float)code / 255.0f;
    return c <= 0.04045f ? c / 12.92f : powf((c + 0.055f) / 1.055f, 2.4f);
}

static void parse_background(struct argp_state* state, const char* value, ShadeOptions* shade)
{
    unsigned r = 0, g = 0, b = 0;
    if (value[0] == '#') ++value;
    bool is_hex = strlen(value) == 6 && strspn(value, "0123456789abcdefABCDEF") == 6;
    if (!is_hex || sscanf(value, "%2x%2x%2x", &r, &g, &b) != 3) // which takes signs and spaces
        argp_error(state, "--background %s: want six hex digits RRGGBB, like 898989", value);
    shade->has_background = true;
    shade->background = vec3(linear(r), linear(g), linear(b));
}

static void parse_lights(struct argp_state* state, const char* value, float* strength)
{
    char after;
    bool right = sscanf(value, "%f,%f,%f,%f%c", strength, strength + 1, strength + 2, strength + 3,
                        &after) == 4;
    for (int i = 0; i < LIGHT_STRENGTHS; ++i)
        right = right && strength[i] >= 0.0f && strength[i] <= 1000.0f;
    if (!right)
        argp_error(state, "--lights %s: want KEY,FILL,RIM,SKY, 0 to 1000 each, like 3,0.6,2,0.25",
                   value);
}

static void parse_target(struct argp_state* state, const char* value, CameraOptions* camera)
{
    char after;
    Vec3* t = &camera->target;
    if (sscanf(value, "%f,%f,%f%c", &t->x, &t->y, &t->z, &after) != 3 || !vec3_finite(*t))
        argp_error(state, "--target %s: want X,Y,Z in metres, like 0,0.2,0", value);
    camera->has_target = true;
}

static void parse_ticks(struct argp_state* state, const char* value, Options* options)
{
    int64_t ticks[3] = {0, 0, 1}; // first, last, step
    if (integers(ticks, 3, value, ':') < 2 || ticks[0] < 0 || ticks[1] < ticks[0] ||
        ticks[1] > INT32_MAX || ticks[2] < 1 || ticks[2] > INT32_MAX)
        argp_error(state,
                   "--ticks %s: want A:B or A:B:STEP with 0 <= A <= B, like 0:179 or 0:179:2",
                   value);
    options->first_tick = (int32_t)ticks[0];
    options->last_tick = (int32_t)ticks[1];
    options->tick_step = (int32_t)ticks[2];
    options->has_ticks = true;
}

// Index of `value` in `names` (ended by NULL), or a usage error that lists them.
static int choice(struct argp_state* state, const char* name, const char* value,
                  const char* const* names)
{
    char list[128] = "";
    for (int i = 0; names[i] != NULL; ++i) {
        if (strcmp(names[i], value) == 0) return i;
        size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", i > 0 ? ", " : "", names[i]);
    }
    argp_error(state, "--%s %s: choose from %s", name, value, list);
    return 0;
}

static error_t parse_source(int key, char* value, struct argp_state* state, Options* options)
{
    switch (key) {
    case KEY_URL:
        options->url = value;
        break;
    case KEY_LOG:
        options->log = value;
        break;
    case KEY_EMBEDDED:
        options->embedded = true;
        break;
    case KEY_STYLE:
        if (options->style_count == OPTIONS_MAX_STYLES)
            argp_error(state, "--style: at most %d", OPTIONS_MAX_STYLES);
        options->styles[options->style_count++] = value;
        break;
    case KEY_HEAD:
        options->head = value;
        break;
    case KEY_UNIT:
        options->unit_m = number(state, "unit", value, 1e-6, 1e3);
        break;
    case KEY_MOTION:
        options->motion = value;
        break;
    case KEY_SLOT:
        options->slot = (int)integer(state, "slot", value, 0, 1023);
        break;
    case KEY_EPOCH:
        options->epoch = integer(state, "epoch", value, 1, INT64_MAX);
        break;
    case KEY_TIMEOUT:
        options->timeout_s = number(state, "timeout", value, 0, 1e6);
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static void parse_shadow_method(struct argp_state* state, const char* value, ShadowOptions* shadow)
{
    const char* names[16] = {NULL};
    for (int i = 0; shadow_methods[i].name != NULL && i < 15; ++i)
        names[i] = shadow_methods[i].name;
    shadow->method = choice(state, "shadows", value, names);
}

static void parse_update(struct argp_state* state, const char* value, int* path)
{
    const char* names[16] = {NULL};
    for (int i = 0; update_paths[i].name != NULL && i < 15; ++i)
        names[i] = update_paths[i].name;
    *path = choice(state, "update", value, names);
}

static const char* const shadow_lights[] = {"key", "all", NULL};

static error_t parse_shadow(int key, char* value, struct argp_state* state, ShadowOptions* shadow)
{
    switch (key) {
    case KEY_SHADOWS:
        parse_shadow_method(state, value, shadow);
        break;
    case KEY_SHADOW_SIZE:
        shadow->follows = false;
        shadow->size =
            (int)integer(state, "shadow-size", value, SHADOW_LEAST_SIZE, SHADOW_MOST_SIZE);
        break;
    case KEY_SHADOW_LAYERS:
        shadow->layers = (int)integer(state, "shadow-layers", value, 1, SHADOW_MAX_LAYERS);
        break;
    case KEY_SHADOW_LIGHTS:
        shadow->all_lights = choice(state, "shadow-lights", value, shadow_lights) == 1;
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static error_t parse_picture(int key, char* value, struct argp_state* state, Options* options)
{
    static const char* const backends[] = {"auto", "egl", "osmesa", "null", NULL};
    static const char* const transparencies[] = {"test", "coverage", "hash", "blend", NULL};
    static const char* const switches[] = {"on", "off", NULL};
    static const char* const sorts[] = {"off", "wisps", "segments", NULL};
    static const char* const views[] = {"shaded", "coverage", "transmittance", NULL};
    ShadeOptions* shade = &options->shade;
    CameraOptions* camera = &options->camera;
    Fault fault = {""};
    char after;
    switch (key) {
    case KEY_BACKEND:
        options->backend = backends[choice(state, "backend", value, backends)];
        break;
    case KEY_SIZE:
        parse_size(state, value, shade);
        break;
    case KEY_MSAA:
        shade->samples = (int)integer(state, "msaa", value, 1, 8);
        if ((shade->samples & (shade->samples - 1)) != 0)
            argp_error(state, "--msaa %s: choose 1, 2, 4 or 8", value);
        break;
    case KEY_TARGET:
        parse_target(state, value, camera);
        break;
    case KEY_DISTANCE:
        camera->distance_m = (float)number(state, "distance", value, 0.05, 1000);
        camera->has_distance = true;
        break;
    case KEY_YAW:
        camera->yaw_deg = (float)number(state, "yaw", value, -3600, 3600);
        break;
    case KEY_PITCH:
        camera->pitch_deg = (float)number(state, "pitch", value, -90, 90);
        break;
    case KEY_FOV:
        camera->fov_deg = (float)number(state, "fov", value, 1, 150);
        break;
    case KEY_LIGHT:
        if (sscanf(value, "%f,%f%c", &shade->light_yaw_deg, &shade->light_pitch_deg, &after) != 2 ||
            !isfinite(shade->light_yaw_deg) || !(fabsf(shade->light_pitch_deg) <= 90.0f))
            argp_error(state, "--light %s: want YAW,PITCH in degrees, like 40,45", value);
        break;
    case KEY_LIGHTS:
        parse_lights(state, value, shade->light_strength);
        break;
    case KEY_BACKGROUND:
        parse_background(state, value, shade);
        break;
    case KEY_SHADING:
        shade->shading.kind = (ShadingKind)choice(state, "shading", value, shading_names);
        break;
    case KEY_MARSCHNER:
        if (!shading_parse(&shade->shading, value, &fault))
            argp_error(state, "--marschner %s: %s", value, fault.text);
        options->has_marschner = true;
        break;
    case KEY_COLOUR:
        shade->colour = choice(state, "colour", value, shading_colour_names);
        shade->has_colour = true;
        break;
    case KEY_TRANSPARENCY:
        shade->transparency =
            TRANSPARENCY_TEST + (Transparency)choice(state, "transparency", value, transparencies);
        break;
    case KEY_PRE_Z:
        shade->pre_z = choice(state, "pre-z", value, switches) == 0;
        break;
    case KEY_SORT:
        shade->sort = SORT_OFF + (ShadeSort)choice(state, "sort", value, sorts);
        break;
    case KEY_VIEW:
        shade->view = (ShadeView)choice(state, "view", value, views);
        break;
    case KEY_LOD:
        shade->lod = (Lod)choice(state, "lod", value, lod_names);
        break;
    case KEY_UPDATE:
        parse_update(state, value, &shade->update);
        break;
    default:
        return parse_shadow(key, value, state, &shade->shadow);
    }
    return 0;
}

static bool is_same_inode(const struct stat* a, const struct stat* b)
{
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino;
}

// Of the directory that a file of this name is in or would be made in; its own name there.
static const char* find_parent(const char* path, struct stat* parent)
{
    const char* slash = strrchr(path, '/');
    char folder[4096];
    snprintf(folder, sizeof folder, "%.*s/", slash != NULL ? (int)(slash - path) : 1,
             slash != NULL ? path : ".");
    if (stat(folder, parent) != 0) *parent = (struct stat){0};
    return slash != NULL ? slash + 1 : path;
}

// Whether two names lead to one file, or would if it were made. Devices may serve twice.
static bool is_same_file(const char* a, const char* b)
{
    struct stat at_a, at_b;
    if (a == NULL || b == NULL || strcmp(a, "-") == 0 || strcmp(b, "-") == 0) return false;
    bool has_a = stat(a, &at_a) == 0, has_b = stat(b, &at_b) == 0;
    if (has_a && has_b)
        return (S_ISREG(at_a.st_mode) || S_ISDIR(at_a.st_mode)) && is_same_inode(&at_a, &at_b);
    if (has_a || has_b) return false;
    const char *name_a = find_parent(a, &at_a), *name_b = find_parent(b, &at_b);
    return strcmp(name_a, name_b) == 0 && is_same_inode(&at_a, &at_b);
}

static void check_files(struct argp_state* state, const Options* options)
{
    if (is_same_file(options->stats, options->log))
        argp_error(state, "--stats %s: would replace the --log", options->stats);
    if (is_same_file(options->out, options->log))
        argp_error(state, "--out %s: would replace the --log", options->out);
    if (is_same_file(options->out, options->stats))
        argp_error(state, "--stats %s: would replace what --out writes", options->stats);
}

static void check_shadow(struct argp_state* state, const ShadowOptions* shadow)
{
    const ShadowMethod* method = &shadow_methods[shadow->method];
    if (shadow->layers == 0) return;
    if (method->most_layers == 0)
        argp_error(state, "--shadow-layers: --shadows %s has none", method->name);
    if (shadow->layers < method->least_layers || shadow->layers > method->most_layers)
        argp_error(state, "--shadow-layers %d: --shadows %s takes %d to %d", shadow->layers,
                   method->name, method->least_layers, method->most_layers);
}

static void check(struct argp_state* state, const Options* options)
{
    check_files(state, options);
    check_shadow(state, &options->shade.shadow);
    if ((options->log != NULL) + options->embedded + (options->url != NULL) > 1)
        argp_error(state, "choose one of --url, --log and --embedded");
    bool daemon_options =
        options->style_count > 0 || options->head || options->motion || options->unit_m > 0;
    if (daemon_options && !options->embedded)
        argp_error(state, "--style, --head, --unit and --motion go with --embedded; on the bus the "
                          "hair-server has them");
    if (options->has_ticks && options->log == NULL && !options->embedded)
        argp_error(state,
                   "--tick and --ticks go with --log or --embedded; the bus shows what comes");
    if (options->timeout_s > 0 && (options->log != NULL || options->embedded))
        argp_error(state, "--timeout goes with the bus; a log and --embedded never wait");
    if (options->motion != NULL && strcmp(options->motion, "bus") == 0)
        argp_error(state, "--motion bus: --embedded hears no bus; choose another motion");
    if (options->epoch != 0 && options->log == NULL) argp_error(state, "--epoch goes with --log");
    if (options->has_marschner && options->shade.shading.kind != SHADING_MARSCHNER)
        argp_error(state, "--marschner goes with --shading marschner");
    if (options->shade.transparency == TRANSPARENCY_HASH && options->shade.samples < 2)
        argp_error(state, "--transparency hash needs --msaa 2, 4 or 8");
}

static void refuse_second_range(struct argp_state* state, const Options* options)
{
    if (options->has_ticks) argp_error(state, "--tick and --ticks: give one of them, once");
}

static error_t parse(int key, char* value, struct argp_state* state)
{
    Options* options = state->input;
    if (parse_source(key, value, state, options) == 0) return 0;
    if (parse_picture(key, value, state, options) == 0) return 0;
    switch (key) {
    case KEY_TICK:
        refuse_second_range(state, options);
        options->first_tick = options->last_tick =
            (int32_t)integer(state, "tick", value, 0, INT32_MAX);
        options->has_ticks = true;
        break;
    case KEY_TICKS:
        refuse_second_range(state, options);
        parse_ticks(state, value, options);
        break;
    case KEY_FRAMES:
        options->frames = integer(state, "frames", value, 1, INT64_MAX);
        break;
    case KEY_OUT:
        options->out = value;
        break;
    case KEY_STATS:
        options->stats = value;
        break;
    case 'q':
        options->quiet = true;
        break;
    case KEY_VERBOSE:
        options->verbose = true;
        break;
    case ARGP_KEY_ARG:
        argp_error(state, "unexpected argument '%s'", value);
        break;
    case ARGP_KEY_END:
        check(state, options);
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

Options options_parse(int argc, char** argv)
{
    Options options = {
        .backend = "auto", .shade = shade_default(), .camera = camera_default(), .tick_step = 1};
    argp_program_version = "hair-client " STRANDCAST_VERSION;
    argp_err_exit_status = 2;
    static const struct argp argp = {arguments, parse, NULL, text, NULL, NULL, NULL};
    argp_parse(&argp, argc, argv, 0, NULL, &options);
    return options;
}
