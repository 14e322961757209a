// hair-server: simulates hair and publishes its guides. This file is the command line, the clock
// and the signals; what happens in a tick is in daemon.c.
#include "messages/channels.h"
#include "messages/link.h"
#include "messages/log.h"
#include "server/daemon.h"
#include "server/kernel.h"
#include "server/load.h"
#include "server/models.h"
#include "server/motion.h"

#include <argp.h>
#include <inttypes.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define EXIT_USAGE   2
#define SLOW_SHARE   0.1 // of a second's ticks dropped
#define SLOW_SECONDS 3
#define SLICES       4 // guides go out in so many portions a tick: a burst overruns socket buffers

const char* argp_program_version = "hair-server (strandcast) " STRANDCAST_VERSION;

typedef struct Options {
    DaemonOptions daemon;
    const char* scene;
    const char* url;
    const char* record;
    int64_t ticks; // 0: until stopped
    bool overwrite, hash, info, quiet, verbose;
    bool is_first_pass; // of two over the command line
    Fault fault;
} Options;

enum {
    KEY_SCENE = 256,
    KEY_STYLE,
    KEY_HEAD,
    KEY_UNIT,
    KEY_KEEP_AXES,
    KEY_GUIDES,
    KEY_NODES,
    KEY_BOTH_ENDS,
    KEY_INFO,
    KEY_CHARACTERS,
    KEY_MOTION,
    KEY_MODEL,
    KEY_KERNEL,
    KEY_FORCE,
    KEY_RATE,
    KEY_SUBSTEPS,
    KEY_ITERATIONS,
    KEY_LENGTH,
    KEY_COLLIDE,
    KEY_STIFFNESS,
    KEY_DAMPING,
    KEY_DRAG,
    KEY_JOINT_DAMPING,
    KEY_UPSIDE_DOWN,
    KEY_DOWN_SHARE,
    KEY_GRAVITY,
    KEY_THREADS,
    KEY_PROJECT,
    KEY_URL,
    KEY_MTU,
    KEY_TICKS,
    KEY_FAST,
    KEY_EPOCH,
    KEY_RECORD,
    KEY_OVERWRITE,
    KEY_HASH,
};

static const struct argp_option option_table[] = {
    {NULL, 0, NULL, 0, "What is simulated:", 1},
    {"scene", KEY_SCENE, "FILE", 0, "Styles, characters and physics from a JSON scene", 1},
    {"style", KEY_STYLE, "NAME|FILE", 0,
     "long (default), bob, ponytail, curly, short or crest, a .json style, or .tfx sections "
     "(repeat for each)",
     1},
    {"head", KEY_HEAD, "FILE", 0, "Head mesh (.obj) of a .tfx groom", 1},
    {"unit", KEY_UNIT, "M", 0, "Metres per unit of the groom's files", 1},
    {"keep-axes", KEY_KEEP_AXES, NULL, 0, "Do not mirror z of .tfx version 3", 1},
    {"guides", KEY_GUIDES, "N", 0, "Guide strands of an imported groom (64)", 1},
    {"nodes", KEY_NODES, "N", 0, "Nodes of a guide strand of an imported groom (8)", 1},
    {"both-ends", KEY_BOTH_ENDS, "auto|none|NAMES", 0, "Which sections keep both ends on the head",
     1},
    {"characters", KEY_CHARACTERS, "N", 0, "Slots 0 to N-1 wear the first style (1)", 1},
    {"info", KEY_INFO, NULL, 0, "Print the loaded style and exit", 1},
    {NULL, 0, NULL, 0, "How it moves:", 2},
    {"motion", KEY_MOTION, "NAME", 0,
     "none, bus (default), nod, shake, jump-stop, run, flip, turn, teleport or gust; bus "
     "obeys " CHANNEL_POSE,
     2},
    {"model", KEY_MODEL, "NAME", 0,
     "spring (default): nodes on springs to their rest places; cascade: sprung joints that push "
     "back; forest: links that turn in sprung joints; plain: a chain that only hangs; as printed, "
     "with their failures: cascade-thesis: sprung joints that nothing pushes back; forest-z: two "
     "angles a joint, which lock",
     2},
    {"rate", KEY_RATE, "HZ", 0, "Ticks a second (60)", 2},
    {"substeps", KEY_SUBSTEPS, "N", 0, "Steps of a tick (4)", 2},
    {"iterations", KEY_ITERATIONS, "N", 0, "Length corrections of a substep (1)", 2},
    {"length", KEY_LENGTH, "sweeps|direct", 0,
     "sweeps (default of spring): links corrected one after another; direct (of cascade and "
     "plain): all at once, for the price of two sweeps and with less stretch left",
     2},
    {"collide", KEY_COLLIDE, "point|pearl|segment", 0,
     "What is kept out of head and torso: nodes, nodes as small spheres (default), or those and "
     "the links between them",
     2},
    {"stiffness", KEY_STIFFNESS, "S2", 0,
     "k/m at the root, 1/s^2 (1600, falling to the tip; cascade and forest 12000 all along)", 2},
    {"damping", KEY_DAMPING, "S", 0, "Decay of velocity relative to the head, 1/s (8)", 2},
    {"drag", KEY_DRAG, "S", 0, "Decay of velocity relative to the air where a wind blows, 1/s (1)",
     2},
    {"joint-damping", KEY_JOINT_DAMPING, "S", 0, "v/J of a joint of forest-z, 1/s (60)", 2},
    {"upside-down", KEY_UPSIDE_DOWN, "SHARE", 0,
     "spring: what is left of its strength upside down, 0 to 1 (1); by the cosine between", 2},
    {"down-share", KEY_DOWN_SHARE, "SHARE", 0,
     "The downward springs' part of k in cascade-thesis, 0 to 1 (0.05)", 2},
    {"gravity", KEY_GRAVITY, "on|off", 0,
     "on: rest is where gravity pulls from; off (default): gravity is compensated at rest", 2},
    {"force", KEY_FORCE, NULL, 0, "Take a stiffness or joint damping beyond its bound of stability",
     2},
    {"kernel", KEY_KERNEL, "NAME", 0,
     "avx512, avx2, sse2 or scalar (default: the widest here); the result does not depend on it",
     2},
    {"threads", KEY_THREADS, "N", 0, "Threads; the result does not depend on it (1)", 2},
    {"project", KEY_PROJECT, "on|off", 0, "Publish links at their exact lengths (on)", 2},
    {NULL, 0, NULL, 0, "Where it goes:", 3},
    {"url", KEY_URL, "URL", 0, "LCM bus (LCM_DEFAULT_URL, else this host only)", 3},
    {"mtu", KEY_MTU, "BYTES", 0, "Largest IP packet (1500)", 3},
    {"ticks", KEY_TICKS, "N", 0, "Stop after N ticks", 3},
    {"fast", KEY_FAST, NULL, 0, "Do not wait for the clock", 3},
    {"epoch", KEY_EPOCH, "E", 0, "Fix the epoch, us", 3},
    {"record", KEY_RECORD, "FILE", 0, "Write an LCM log; with --fast no network is opened", 3},
    {"overwrite", KEY_OVERWRITE, NULL, 0, "Let --record replace a file", 3},
    {"hash", KEY_HASH, NULL, 0, "Print the hash of the state at the end", 3},
    {"quiet", 'q', NULL, 0, "Faults only", 3},
    {"verbose", 'v', NULL, 0, "At the end, what was sent, dropped, refused", 3},
    {0},
};

static const char documentation[] =
    "Simulates guide strands of hair and publishes them on LCM.\v"
    "Examples:\n"
    "  hair-server                              long hair, 60 Hz, this host\n"
    "  hair-server --motion shake               a head that shakes\n"
    "  hair-server --style bob --motion bus     a head moved by " CHANNEL_POSE " messages\n"
    "  hair-server --motion gust --drag 2       wind; " CHANNEL_WIND " and " CHANNEL_TUNING "\n"
    "                                           messages change both while it runs\n"
    "  hair-server --style tail.tfx --style top.tfx --head head.obj --info\n"
    "  hair-server --motion nod --ticks 240 --fast --record nod.lcmlog\n"
    "  hair-server --motion shake --ticks 600 --fast --hash\n"
    "Exit status: 0 fine, 1 failed, 2 wrong usage.";

static double number(struct argp_state* state, const char* name, const char* text, double low,
                     double high)
{
    char* end;
    double value = strtod(text, &end);
    if (end == text || *end != '\0' || !(value >= low && value <= high))
        argp_error(state, "--%s %s: must be a number from %g to %g", name, text, low, high);
    return value;
}

static int64_t whole(struct argp_state* state, const char* name, const char* text, int64_t low,
                     int64_t high)
{
    char* end;
    long long value = strtoll(text, &end, 10);
    if (end == text || *end != '\0' || value < low || value > high)
        argp_error(state, "--%s %s: must be a whole number from %" PRId64 " to %" PRId64, name,
                   text, low, high);
    return value;
}

// One of `names`, by its index.
static int choice(struct argp_state* state, const char* name, const char* text,
                  const char* const* names)
{
    char list[80] = "";
    for (int i = 0; names[i] != NULL; ++i)
        snprintf(list + strlen(list), sizeof list - strlen(list), "%s%s",
                 i == 0                 ? ""
                 : names[i + 1] == NULL ? " or "
                                        : ", ",
                 names[i]);
    int index = choice_find(names, text);
    if (names[index] == NULL) argp_error(state, "--%s %s: must be %s", name, text, list);
    return index;
}

static bool on_off(struct argp_state* state, const char* name, const char* text)
{
    if (strcmp(text, "on") != 0 && strcmp(text, "off") != 0)
        argp_error(state, "--%s %s: must be on or off", name, text);
    return strcmp(text, "on") == 0;
}

static void parse_style(struct argp_state* state, LoadOptions* load, const char* text)
{
    if (load->style_count == LOAD_MAX_FILES)
        argp_error(state, "--style: at most %d files", LOAD_MAX_FILES);
    else
        load->styles[load->style_count++] = text;
}

static void parse_model(struct argp_state* state, SimDefinition* sim, const char* text)
{
    ModelKind model = model_find(text);
    if (model == MODEL_COUNT)
        argp_error(state,
                   "--model %s: must be spring, cascade, forest, plain, cascade-thesis or forest-z",
                   text);
    else
        model_use(sim, model);
}

static error_t parse_what(int key, char* text, struct argp_state* state)
{
    Options* options = state->input;
    LoadOptions* load = &options->daemon.load;
    switch (key) {
    case KEY_SCENE:
        break; // the first pass has read it
    case KEY_STYLE:
        parse_style(state, load, text);
        break;
    case KEY_HEAD:
        load->head = text;
        break;
    case KEY_UNIT:
        load->unit_m = number(state, "unit", text, 1e-6, 1000);
        break;
    case KEY_KEEP_AXES:
        load->keep_axes = true;
        break;
    case KEY_GUIDES:
        load->guides = (int)whole(state, "guides", text, 1, HAIRSTYLE_MAX_GUIDES);
        break;
    case KEY_NODES:
        load->nodes = (int)whole(state, "nodes", text, HAIRSTYLE_MIN_NODES, HAIRSTYLE_MAX_NODES);
        break;
    case KEY_BOTH_ENDS:
        load->both_ends = text;
        break;
    case KEY_CHARACTERS:
        options->daemon.characters = (int)whole(state, "characters", text, 0, CHANNEL_MAX_SLOTS);
        break;
    case KEY_INFO:
        options->info = true;
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static error_t parse_how(int key, char* text, struct argp_state* state)
{
    Options* options = state->input;
    SimDefinition* sim = &options->daemon.sim;
    switch (key) {
    case KEY_MOTION:
        options->daemon.motion = text;
        if (motion_find(text) == NULL)
            argp_error(state,
                       "--motion %s: must be none, bus, nod, shake, jump-stop, run, flip, turn, "
                       "teleport or gust",
                       text);
        break;
    case KEY_MODEL:
        break; // the first pass has taken it
    case KEY_KERNEL:
        sim->kernel = text;
        if (kernel_find(text) == NULL)
            argp_error(state, "--kernel %s: must be one of %s here", text, kernel_names());
        break;
    case KEY_FORCE:
        sim->force = true;
        break;
    case KEY_RATE:
        sim->rate_hz = number(state, "rate", text, 1, 1000);
        break;
    case KEY_SUBSTEPS:
        sim->substeps = (int)whole(state, "substeps", text, 1, 64);
        break;
    case KEY_ITERATIONS:
        sim->iterations = (int)whole(state, "iterations", text, 0, 64);
        break;
    case KEY_LENGTH:
        sim->length = (LengthStage)choice(state, "length", text, length_names);
        break;
    case KEY_COLLIDE:
        sim->collide = (CollideMode)choice(state, "collide", text, collide_names);
        break;
    case KEY_STIFFNESS:
        sim->stiffness_s2 = (float)number(state, "stiffness", text, 0, 1e6);
        break;
    case KEY_DAMPING:
        sim->damping_per_s = (float)number(state, "damping", text, 0, 1e4);
        break;
    case KEY_DRAG:
        sim->drag_per_s = (float)number(state, "drag", text, 0, 1e4);
        break;
    case KEY_JOINT_DAMPING:
        sim->joint_damping_per_s = (float)number(state, "joint-damping", text, 0, 1e6);
        break;
    case KEY_UPSIDE_DOWN:
        sim->upside_down_share = (float)number(state, "upside-down", text, 0, 1);
        break;
    case KEY_DOWN_SHARE:
        sim->down_share = (float)number(state, "down-share", text, 0, 1);
        break;
    case KEY_GRAVITY:
        sim->gravity_compensation = !on_off(state, "gravity", text);
        break;
    case KEY_THREADS:
        sim->threads = (int)whole(state, "threads", text, 1, 256);
        break;
    case KEY_PROJECT:
        options->daemon.project = on_off(state, "project", text);
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static error_t parse_where(int key, char* text, struct argp_state* state)
{
    Options* options = state->input;
    switch (key) {
    case KEY_URL:
        options->url = text;
        break;
    case KEY_MTU:
        options->daemon.mtu = (int)whole(state, "mtu", text, 576, 65000);
        break;
    case KEY_TICKS:
        options->ticks = whole(state, "ticks", text, 1, INT32_MAX);
        break;
    case KEY_FAST:
        options->daemon.fast = true;
        break;
    case KEY_EPOCH:
        options->daemon.epoch = whole(state, "epoch", text, 1, INT64_MAX - 1);
        break;
    case KEY_RECORD:
        options->record = text;
        break;
    case KEY_OVERWRITE:
        options->overwrite = true;
        break;
    case KEY_HASH:
        options->hash = true;
        break;
    case 'q':
        options->quiet = true;
        break;
    case 'v':
        options->verbose = true;
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static void check_together(const Options* options, struct argp_state* state)
{
    if (options->scene != NULL && options->daemon.load.style_count > 0)
        argp_error(state,
                   "--style and --scene: a scene names its own styles; choose one of the two");
    if (options->scene != NULL && load_has_groom_options(&options->daemon.load))
        argp_error(state, "--scene: what grooms are made of stands in the scene's styles");
    if (options->scene != NULL && options->info)
        argp_error(state, "--info is of a --style, not of a --scene");
    if (options->info && (options->record != NULL || options->ticks > 0 || options->hash))
        argp_error(state, "--info prints the style and exits: leave --record, --ticks and --hash "
                          "out");
    if (options->overwrite && options->record == NULL)
        argp_error(state, "--overwrite needs --record FILE");
    if (options->hash && options->ticks == 0)
        argp_error(state, "--hash needs --ticks N: otherwise there is no end to hash");
    if (options->daemon.fast && options->ticks == 0 && options->record != NULL)
        argp_error(state, "--fast --record needs --ticks N: otherwise the disk fills");
}

static error_t parse(int key, char* text, struct argp_state* state)
{
    Options* options = state->input;
    if (key == ARGP_KEY_ARG)
        argp_error(state, "\"%s\" is not an option; did you mean --style %s?", text, text);
    if (options->is_first_pass) {
        if (key == KEY_MODEL) parse_model(state, &options->daemon.sim, text);
        if (key == KEY_SCENE && options->scene != NULL)
            argp_error(state, "--scene %s: a second one, after %s; put all into one scene", text,
                       options->scene);
        if (key == KEY_SCENE) options->scene = text;
        return 0;
    }
    if (key == ARGP_KEY_END) check_together(options, state);
    if (parse_what(key, text, state) == 0 || parse_how(key, text, state) == 0) return 0;
    return parse_where(key, text, state);
}

// Twice: the model is taken in the first pass and the scene is read after it, so that what a model
// has by default yields to the scene, and that to options wherever they stand.
static bool read_options(Options* options, int argc, char** argv)
{
    const struct argp argp = {option_table, parse, NULL, documentation, NULL, NULL, NULL};
    argp_err_exit_status = EXIT_USAGE;
    options->daemon = daemon_default();
    options->is_first_pass = true;
    argp_parse(&argp, argc, argv, 0, NULL, options);
    const char* scene = options->scene;
    if (scene != NULL && !daemon_use_scene(&options->daemon, scene, &options->fault)) return false;
    options->is_first_pass = false;
    argp_parse(&argp, argc, argv, 0, NULL, options);
    return true;
}

// Running ----------------------------------------------------------------------------------------

typedef struct Server {
    const Options* options;
    Daemon* daemon;
    Link* link;
    LogWriter* log;
    int64_t done;           // ticks
    bool failed;            // a fault was said
    bool has_progress;      // a line without its end stands on the terminal
    int64_t dropped_before; // a second ago
    int slow_seconds;       // in a row
    bool told_slow;
    int64_t send_failures;
} Server;

static volatile sig_atomic_t stop_requested;

static void request_stop(int signal)
{
    (void)signal;
    stop_requested = 1;
}

static void catch_signals(void)
{
    struct sigaction action = {.sa_handler = request_stop, .sa_flags = SA_RESETHAND}, before;
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    // A closed terminal sends it twice, by the kernel and by the shell; under nohup it is ignored.
    action.sa_flags = 0;
    sigaction(SIGHUP, NULL, &before);
    if (before.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, NULL);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN); // writing fails with EFBIG instead, and that is said
}

static void say_error(Server* server, const char* text)
{
    if (server != NULL && server->has_progress) fputc('\n', stderr);
    if (server != NULL) server->has_progress = false;
    fprintf(stderr, "hair-server: %s\n", text);
}

static void say_notice(void* context, const char* text)
{
    say_error(context, text);
}

static void send_to_bus(void* context, int64_t utime, const char* channel, const uint8_t* bytes,
                        size_t size)
{
    Server* server = context;
    (void)utime;
    if (link_publish(server->link, channel, bytes, size)) return;
    if (server->send_failures++ == 0)
        say_error(server, "the bus does not take a message; is the network up? (said once)");
}

static void write_to_log(void* context, int64_t utime, const char* channel, const uint8_t* bytes,
                         size_t size)
{
    Server* server = context;
    Fault fault;
    if (server->failed || log_write(server->log, utime, channel, bytes, size, &fault)) return;
    say_error(server, fault.text);
    server->failed = true;
}

static void hear(void* context, const char* channel, const uint8_t* bytes, size_t size)
{
    daemon_receive(((Server*)context)->daemon, channel, bytes, size);
}

static bool open_bus(Server* server, Fault* fault)
{
    static const char* const heard[] = {CHANNEL_POSE,  CHANNEL_TORSO,  CHANNEL_CHARACTER,
                                        CHANNEL_WIND,  CHANNEL_TUNING, CHANNEL_REQUEST,
                                        CHANNEL_STATUS};
    server->link = link_open(server->options->url, fault);
    if (server->link == NULL) return false;
    for (size_t i = 0; i < sizeof heard / sizeof heard[0]; ++i)
        if (!link_subscribe(server->link, heard[i], hear, server, fault)) return false;
    daemon_add_sink(server->daemon, (DaemonSink){send_to_bus, server});
    return true;
}

// The log last: a start that fails leaves the files as they were.
static bool open_outputs(Server* server, Fault* fault)
{
    const Options* options = server->options;
    bool is_offline = options->daemon.fast && (options->record != NULL || options->hash);
    if (!(is_offline && options->url == NULL) && !open_bus(server, fault)) return false;
    if (options->record == NULL) return true;
    server->log = log_create(options->record, options->overwrite, fault);
    if (server->log == NULL) return false;
    daemon_add_sink(server->daemon, (DaemonSink){write_to_log, server});
    return true;
}

static void say_ready(const Server* server)
{
    DaemonStatus status = daemon_status(server->daemon);
    const char* url = server->options->url != NULL ? server->options->url : "";
    if (*url == '\0' && getenv("LCM_DEFAULT_URL") != NULL) url = getenv("LCM_DEFAULT_URL");
    if (*url == '\0') url = "this host";
    if (server->options->quiet) return;
    printf("ready: epoch %" PRId64 ", %g Hz, %d character%s, style %s %dx%d, %s\n",
           daemon_epoch(server->daemon), daemon_rate_hz(server->daemon), status.characters,
           status.characters == 1 ? "" : "s", status.style, status.guides, status.nodes,
           server->link != NULL ? url : "no network");
    fflush(stdout);
}

static void say_progress(Server* server)
{
    if (server->options->quiet || !isatty(STDERR_FILENO)) return;
    DaemonStatus status = daemon_status(server->daemon);
    fprintf(stderr, "\rtick %d, %.2f ms a tick, %" PRId64 " dropped, %.1f MB sent\033[K",
            daemon_tick_number(server->daemon), status.step_us * 1e-3, status.overruns,
            (double)status.sent_bytes * 1e-6);
    server->has_progress = true;
}

// Hears the bus until the monotonic clock reads `when_us`.
static void listen_until(Server* server, int64_t when_us)
{
    while (!stop_requested) {
        int64_t left = when_us - base_monotonic_us();
        if (server->link == NULL) {
            if (left > 0) base_sleep_until_us(when_us);
            return;
        }
        if (left < 0) left = 0;
        struct timespec wait = {left / 1000000, left % 1000000 * 1000};
        struct pollfd ready = {.fd = link_fileno(server->link), .events = POLLIN};
        if (ppoll(&ready, 1, &wait, NULL) <= 0) return;
        if (link_handle(server->link, 0) < 0) {
            say_error(server, "the bus is dead");
            server->failed = true;
            return;
        }
        if (left == 0) return; // one helping once the time is up: a flood must not stop the ticks
    }
}

// The daemon has said which character or message it is.
static void check_recorded(Server* server)
{
    int64_t unsent = daemon_unsent(server->daemon);
    if (server->log == NULL || unsent == 0 || server->failed) return;
    char text[sizeof((Fault*)0)->text];
    snprintf(text, sizeof text, "%.200s: incomplete: %" PRId64 " messages do not fit the wire",
             server->options->record, unsent);
    say_error(server, text);
    server->failed = true;
}

static bool goes_on(Server* server)
{
    int64_t ticks = server->options->ticks;
    check_recorded(server);
    return !stop_requested && !server->failed && (ticks == 0 || server->done < ticks);
}

static void run_fast(Server* server)
{
    int64_t tick_us = (int64_t)(1e6 / daemon_rate_hz(server->daemon));
    for (; goes_on(server); ++server->done) {
        if (server->link != NULL) listen_until(server, 0);
        daemon_tick(server->daemon);
        if (server->done == 0) daemon_publish_styles(server->daemon);
        daemon_publish_slice(server->daemon, 0, 1);
        daemon_publish_background(server->daemon, tick_us);
        if (server->done % 600 == 599) say_progress(server);
    }
}

// Called each second; said once. A hiccup drops the ticks of a second or two, a machine that is too
// slow goes on and on.
static void tell_slow(Server* server)
{
    int64_t dropped = daemon_status(server->daemon).overruns;
    double share = (double)(dropped - server->dropped_before) / daemon_rate_hz(server->daemon);
    server->dropped_before = dropped;
    server->slow_seconds = share > SLOW_SHARE ? server->slow_seconds + 1 : 0;
    if (server->told_slow || server->options->quiet || server->slow_seconds < SLOW_SECONDS) return;
    server->told_slow = true;
    char text[160];
    snprintf(text, sizeof text,
             "too slow here: %" PRId64
             " ticks dropped so far, over %g %% in each of the last %d s; "
             "fewer characters, substeps or Hz",
             dropped, 100 * SLOW_SHARE, SLOW_SECONDS);
    say_notice(server, text);
}

// Ticks whose time has passed before they began are dropped and counted: they would only be
// followed by more that are late.
static int64_t drop_late_ticks(Server* server, int64_t tick_us, double* due_us)
{
    int64_t late = (int64_t)(((double)base_monotonic_us() - *due_us) / (double)tick_us);
    if (late < 1) return 0;
    *due_us += (double)(late * tick_us);
    daemon_count_overrun(server->daemon, (int)late);
    return late;
}

static void run_paced(Server* server)
{
    double exact_us = 1e6 / daemon_rate_hz(server->daemon);
    double due_us = (double)base_monotonic_us(), said_us = due_us;
    for (; goes_on(server); ++server->done) {
        daemon_tick(server->daemon);
        if (server->done == 0 && server->log != NULL)
            daemon_record_styles(server->daemon, (DaemonSink){write_to_log, server});
        for (int slice = 0; slice < SLICES && !stop_requested; ++slice) {
            listen_until(server, (int64_t)(due_us + exact_us * slice / SLICES));
            daemon_publish_slice(server->daemon, slice, SLICES);
        }
        daemon_publish_background(server->daemon, (int64_t)exact_us);
        if (due_us - said_us >= 1e6) {
            say_progress(server);
            tell_slow(server);
            said_us = due_us;
        }
        due_us += exact_us;
        listen_until(server, (int64_t)due_us);
        drop_late_ticks(server, (int64_t)exact_us, &due_us);
    }
}

static void finish(Server* server)
{
    Fault fault;
    if (server->log != NULL && !log_finish(server->log, &fault) && !server->failed) {
        say_error(server, fault.text);
        server->failed = true;
    }
    if (server->has_progress) fputc('\n', stderr);
    server->has_progress = false;
    link_close(server->link);
    if (server->options->verbose && server->daemon != NULL) {
        DaemonStatus status = daemon_status(server->daemon);
        fprintf(stderr,
                "hair-server: %" PRId64 " messages, %" PRId64 " bytes, %" PRId64
                " ticks dropped, %" PRId64 " inputs refused, %" PRId64
                " coordinates clamped, %" PRId64 " strands put back to rest, %" PRId64
                " jumps carried\n",
                status.sent_messages, status.sent_bytes, status.overruns, status.rejected,
                status.clamped, status.quarantined, status.jumps);
    }
}

static bool print_hash(Server* server, Fault* fault)
{
    int64_t ticks = server->options->ticks;
    if (server->done < ticks)
        return fault_set(fault, "stopped after %" PRId64 " of %" PRId64 " ticks: no hash",
                         server->done, ticks);
    printf("hash %016" PRIx64 "\n", daemon_state_hash(server->daemon));
    return true;
}

static int serve(Options* options)
{
    Server server = {.options = options};
    Fault fault;
    DaemonOptions daemon = options->daemon; // a copy: its notice points at this call's server
    if (!options->quiet) daemon.notice = (Notice){say_notice, &server};
    LoadOptions* load = &daemon.load;
    if (options->info && load->style_count == 0)
        load->styles[load->style_count++] = load_builtin_styles[0];
    if (options->info)
        return load_print_info(load, &daemon.notice, &options->fault) ? EXIT_SUCCESS : EXIT_FAILURE;
    server.daemon = daemon_create(&daemon, &options->fault);
    if (server.daemon == NULL) return EXIT_FAILURE;
    if (open_outputs(&server, &fault)) {
        say_ready(&server);
        (options->daemon.fast ? run_fast : run_paced)(&server);
    } else {
        say_error(&server, fault.text);
        server.failed = true;
    }
    finish(&server);
    if (options->hash && !server.failed && !print_hash(&server, &options->fault))
        server.failed = true;
    daemon_destroy(server.daemon);
    return server.failed ? EXIT_FAILURE : EXIT_SUCCESS;
}

int main(int argc, char** argv)
{
    static Options options;
    catch_signals();
    int status = read_options(&options, argc, argv) ? serve(&options) : EXIT_FAILURE;
    Fault unwritten;
    if (status == EXIT_SUCCESS && !base_stdout_written(&unwritten)) {
        say_error(NULL, unwritten.text);
        status = EXIT_FAILURE;
    }
    if (options.fault.text[0] != '\0') say_error(NULL, options.fault.text);
    return status;
}
