// hair-bench: how long the inner loops take, as CSV. A case is a row of `cases`; it never fails for
// being slow, because machines differ: the numbers are for people and for charts.
#include "client/receive.h"
#include "messages/quantise.h"
#include "messages/style.h"
#include "server/load.h"
#include "server/sim.h"
#include "tests/studies.h"

#include <argp.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SUBSTEPS    4
#define SWAY_TICKS  60 // of head motion, repeated
#define RING_TICKS  64 // of encoded blocks, repeated
#define MTU         1500
#define BATCH_US    20000 // a repeat lasts at least so long: the clock counts whole microseconds
#define MAX_REPEATS 1000
#define BLOCK_BYTES 2048
#define STRAND_M    0.25f
#define BENCH_EPOCH 1

typedef struct Case Case;

// Everything that a case may have set up; what it has not is zero.
typedef struct Work {
    Vec3* rest;
    Sim* sim;
    SimHead sway[SWAY_TICKS][SUBSTEPS];
    Hairstyle* style;
    StyleBytes bytes;
    uint16_t* positions;
    int16_t* tangents;
    int blocks; // of a tick
    uint8_t (*ring)[BLOCK_BYTES];
    size_t* sizes;
    Receive* receive;
    int64_t calls;
    int64_t failures; // of the code that is timed: then the times are of something else
    uint64_t sum;     // keeps the compiler from dropping what is timed
} Work;

struct Case {
    const char* name;
    const char* what;
    const char* unit;
    double ns_per_unit; // of time
    int strands, nodes; // of `step` without a style
    bool (*set_up)(Work* work, const Case* one, Fault* fault);
    void (*step)(Work* work);
    double (*count)(const Work* work, const Case* one); // how many things a step does
};

// --- step --------------------------------------------------------------------------------------

// 46 degrees to each side: everything moves, nothing settles.
static void sway(Work* work)
{
    for (int i = 0; i < SWAY_TICKS * SUBSTEPS; ++i) {
        double angle = 0.8 * sin(2.0 * M_PI * (i + 1) / (SWAY_TICKS * SUBSTEPS));
        float c = (float)cos(angle), s = (float)sin(angle);
        work->sway[i / SUBSTEPS][i % SUBSTEPS] =
            (SimHead){.rotation = {c, 0, s, 0, 1, 0, -s, 0, c}};
    }
}

static bool create_sim(Work* work, SimDefinition* definition, Fault* fault)
{
    definition->substeps = SUBSTEPS;
    definition->threads = 1;
    work->sim = sim_create(definition, fault);
    sway(work);
    return work->sim != NULL;
}

// Straight strands on a grid of 2 mm, and no colliders: the solver alone.
static bool set_up_free(Work* work, const Case* one, Fault* fault)
{
    SimDefinition definition = sim_default();
    work->rest = calloc((size_t)one->strands * (size_t)one->nodes, sizeof *work->rest);
    if (work->rest == NULL) return fault_set(fault, "no memory for %d strands", one->strands);
    for (int i = 0; i < one->strands * one->nodes; ++i) {
        int strand = i / one->nodes, node = i % one->nodes;
        work->rest[i] =
            vec3(0.002f * (float)(strand % 128), -STRAND_M * (float)node / (float)(one->nodes - 1),
                 0.002f * (float)(strand / 128));
    }
    definition.strands = one->strands;
    definition.nodes = one->nodes;
    definition.rest = work->rest;
    return create_sim(work, &definition, fault);
}

static bool load_long(Work* work, Fault* fault)
{
    LoadOptions load = {.styles = {"long"}, .style_count = 1};
    work->style = load_style(&load, NULL, fault);
    return work->style != NULL;
}

// A character as the daemon has it.
static bool set_up_long(Work* work, const Case* one, Fault* fault)
{
    (void)one;
    SimDefinition definition = sim_default();
    if (!load_long(work, fault)) return false;
    definition.strands = work->style->guide_count;
    definition.nodes = work->style->nodes;
    definition.rest = work->style->rest;
    definition.weight = work->style->weight;
    definition.colliders = work->style->colliders;
    definition.collider_count = work->style->collider_count;
    return create_sim(work, &definition, fault);
}

static void step_tick(Work* work)
{
    sim_step(work->sim, work->sway[work->calls % SWAY_TICKS]);
}

static double node_steps(const Work* work, const Case* one)
{
    const Hairstyle* style = work->style;
    return SUBSTEPS * (style != NULL ? (double)style->guide_count * style->nodes
                                     : (double)one->strands * one->nodes);
}

// --- wire --------------------------------------------------------------------------------------

static double nodes_of_style(const Work* work, const Case* one)
{
    (void)one;
    return (double)work->style->guide_count * work->style->nodes;
}

static void quantise_all(Work* work)
{
    const Hairstyle* style = work->style;
    Vec3 along[HAIRSTYLE_MAX_NODES];
    for (int g = 0; g < style->guide_count; ++g) {
        int first = g * style->nodes;
        quantise_strand_tangents(along, style->rest + first, style->nodes);
        for (int n = 0; n < style->nodes; ++n) {
            quantise_position(work->positions + 3 * (first + n), style->rest[first + n],
                              &style->box);
            quantise_tangent(work->tangents + 3 * (first + n), along[n]);
        }
    }
    work->sum += work->positions[work->calls % 24];
}

static bool set_up_planes(Work* work, const Case* one, Fault* fault)
{
    (void)one;
    if (!load_long(work, fault)) return false;
    size_t numbers = (size_t)work->style->guide_count * (size_t)work->style->nodes * 3;
    work->positions = calloc(numbers, sizeof *work->positions);
    work->tangents = calloc(numbers, sizeof *work->tangents);
    if (work->positions == NULL || work->tangents == NULL)
        return fault_set(fault, "no memory for the planes");
    quantise_all(work);
    return true;
}

// One tick into the ring, as the daemon cuts it.
static void encode_tick(Work* work, int tick)
{
    const Hairstyle* style = work->style;
    int rows = frame_rows_per_message(MTU, style->nodes);
    for (int b = 0; b < work->blocks; ++b) {
        int first = b * rows, left = style->guide_count - first;
        FrameHeader header = {.epoch = BENCH_EPOCH,
                              .style_hash = work->bytes.hash,
                              .tick = tick,
                              .pose = pose_identity(),
                              .first_strand = (uint16_t)first,
                              .strand_count = (uint16_t)(left < rows ? left : rows),
                              .nodes = (uint8_t)style->nodes};
        int at = tick * work->blocks + b;
        work->sizes[at] =
            frame_encode(work->ring[at], BLOCK_BYTES, &header, work->positions, work->tangents);
    }
}

static bool set_up_blocks(Work* work, const Case* one, Fault* fault)
{
    if (!set_up_planes(work, one, fault)) return false;
    int rows = frame_rows_per_message(MTU, work->style->nodes);
    work->blocks = (work->style->guide_count + rows - 1) / rows;
    size_t all = (size_t)(RING_TICKS * work->blocks);
    work->ring = calloc(all, sizeof *work->ring);
    work->sizes = calloc(all, sizeof *work->sizes);
    if (work->ring == NULL || work->sizes == NULL) return fault_set(fault, "no memory for blocks");
    if (!style_encode(&work->bytes, work->style, fault)) return false;
    for (int tick = 0; tick < RING_TICKS; ++tick)
        encode_tick(work, tick);
    return true;
}

static void encode_one(Work* work)
{
    encode_tick(work, (int)(work->calls % RING_TICKS));
}

static void decode_one(Work* work)
{
    int first = (int)(work->calls % RING_TICKS) * work->blocks;
    for (int b = 0; b < work->blocks; ++b) {
        FrameHeader header;
        const uint8_t *positions, *tangents;
        FrameFault fault = frame_decode(&header, &positions, &tangents, work->ring[first + b],
                                        work->sizes[first + b]);
        work->failures += fault != FRAME_OK;
    }
}

// --- style -------------------------------------------------------------------------------------

static double one_thing(const Work* work, const Case* one)
{
    (void)work, (void)one;
    return 1.0;
}

static bool set_up_style(Work* work, const Case* one, Fault* fault)
{
    (void)one;
    return load_long(work, fault) && style_encode(&work->bytes, work->style, fault);
}

static void encode_style(Work* work)
{
    StyleBytes bytes = {0};
    work->failures += !style_encode(&bytes, work->style, NULL);
    style_bytes_free(&bytes);
}

static void decode_style(Work* work)
{
    size_t bulk_size;
    uint64_t bulk_hash;
    Hairstyle* style = style_decode_fast(work->bytes.lane[STYLE_FAST], work->bytes.size[STYLE_FAST],
                                         &bulk_size, &bulk_hash, NULL);
    work->failures += style == NULL;
    hairstyle_destroy(style);
}

// --- receive -----------------------------------------------------------------------------------

static void feed_style(Work* work)
{
    size_t step = (size_t)style_part_bytes(MTU), size = work->bytes.size[STYLE_FAST];
    int parts = style_part_count(size, (int)step);
    for (int p = 0; p < parts; ++p) {
        size_t offset = (size_t)p * step;
        StylePart part = {.epoch = BENCH_EPOCH,
                          .style_hash = work->bytes.hash,
                          .lane_bytes = (uint32_t)size,
                          .part = (uint16_t)p,
                          .parts = (uint16_t)parts,
                          .lane = STYLE_FAST,
                          .offset = (uint32_t)offset,
                          .size = (uint32_t)(size - offset < step ? size - offset : step),
                          .payload = work->bytes.lane[STYLE_FAST] + offset};
        uint8_t bytes[BLOCK_BYTES];
        size_t message = style_part_encode(bytes, sizeof bytes, &part);
        receive_message(work->receive, CHANNEL_STYLE, bytes, message, 0);
    }
}

static bool set_up_receive(Work* work, const Case* one, Fault* fault)
{
    int slot = 0;
    if (!set_up_blocks(work, one, fault)) return false;
    work->receive = receive_create(&slot, 1, (Notice){0}, fault);
    if (work->receive == NULL) return false;
    feed_style(work);
    return true;
}

static void receive_tick(Work* work)
{
    int tick = (int)(work->calls % RING_TICKS);
    if (tick == 0) receive_restart(work->receive, 0); // the ring begins again: not a daemon's jump
    for (int b = 0; b < work->blocks; ++b)
        receive_message(work->receive, "HAIR_GUIDES_0000", work->ring[tick * work->blocks + b],
                        work->sizes[tick * work->blocks + b], work->calls);
}

static double blocks_of_tick(const Work* work, const Case* one)
{
    (void)one;
    return work->blocks;
}

// --- the table ---------------------------------------------------------------------------------

static const Case cases[] = {
    {"step", "long 64x8 with colliders", "ns per node-step", 1, 0, 0, set_up_long, step_tick,
     node_steps},
    {"step", "64x8", "ns per node-step", 1, 64, 8, set_up_free, step_tick, node_steps},
    {"step", "1024x8", "ns per node-step", 1, 1024, 8, set_up_free, step_tick, node_steps},
    {"step", "16384x8", "ns per node-step", 1, 16384, 8, set_up_free, step_tick, node_steps},
    {"wire", "quantise long 64x8", "ns per node", 1, 0, 0, set_up_planes, quantise_all,
     nodes_of_style},
    {"wire", "encode long 64x8", "ns per node", 1, 0, 0, set_up_blocks, encode_one, nodes_of_style},
    {"wire", "decode long 64x8", "ns per node", 1, 0, 0, set_up_blocks, decode_one, nodes_of_style},
    {"style", "encode long", "ms", 1e6, 0, 0, set_up_style, encode_style, one_thing},
    {"style", "decode long", "ms", 1e6, 0, 0, set_up_style, decode_style, one_thing},
    {"receive", "long 64x8", "us per block", 1e3, 0, 0, set_up_receive, receive_tick,
     blocks_of_tick},
};

#define CASES (sizeof cases / sizeof cases[0])

static const Study studies[] = {
    {"sim", "what a tick costs, by model, kernel, strands, nodes, iterations, threads", study_sim},
    {"accuracy", "errors against two truths over the clips, with the cost of each", study_accuracy},
    {"stability", "where the models fail: boundaries measured and derived, eleven maps",
     study_stability},
    {"frame", "what a picture costs, by pass, triangles, distance, samples, transparency",
     study_frame},
    {"update", "what the update pass costs, by triangles", study_update},
    {"transparency", "what each transparency gets wrong, with its cost", study_transparency},
    {"shadow", "error and time of shadow methods by layers, resolution, triangles", study_shadow},
    {"tree", "what the Adaptive Wisp Tree saves and what it gets wrong", study_tree},
    {"reference", "our pictures against path-traced ones of the same strands (../shared/assets)",
     study_reference},
    {"shading", "errors and prices of the shadings and of the tables of marschner", study_shading},
    {"wisps", "how evenly wisps stand on the scalp, and what that costs", study_wisps},
};
#define STUDIES (sizeof studies / sizeof studies[0])

// --- measuring ---------------------------------------------------------------------------------

static void tear_down(Work* work)
{
    receive_destroy(work->receive);
    free(work->sizes);
    free(work->ring);
    free(work->tangents);
    free(work->positions);
    style_bytes_free(&work->bytes);
    hairstyle_destroy(work->style);
    sim_destroy(work->sim);
    free(work->rest);
}

static int64_t batch_us(Work* work, const Case* one, int64_t calls)
{
    int64_t began = base_monotonic_us();
    for (int64_t i = 0; i < calls; ++i) {
        one->step(work);
        ++work->calls;
    }
    return base_monotonic_us() - began;
}

static int ascending(const void* a, const void* b)
{
    double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

static void measure(Work* work, const Case* one, int repeats)
{
    double times[MAX_REPEATS];
    int64_t calls = 1;
    while (batch_us(work, one, calls) < BATCH_US) // warms up, too
        calls *= 2;
    for (int i = 0; i < repeats; ++i) {
        double ns = 1e3 * (double)batch_us(work, one, calls) / (double)calls;
        times[i] = ns / one->count(work, one) / one->ns_per_unit;
    }
    qsort(times, (size_t)repeats, sizeof *times, ascending);
    printf("%s,%s,%s,%.4g,%.4g,%d\n", one->name, one->what, one->unit, times[0], times[repeats / 2],
           repeats);
    fflush(stdout);
}

static bool check(Work* work, Fault* fault)
{
    if (work->receive != NULL) {
        ReceiveCounters counters = receive_counters(work->receive);
        int64_t nodes = (int64_t)work->style->guide_count * work->style->nodes;
        work->failures += counters.bytes != work->calls * nodes * FRAME_NODE_BYTES;
    }
    return work->failures == 0 ||
           fault_set(fault, "%lld calls failed: the times above mean nothing",
                     (long long)work->failures);
}

static bool run(const Case* one, int repeats)
{
    static Work work; // large
    Fault fault = {""};
    memset(&work, 0, sizeof work);
    bool done = one->set_up(&work, one, &fault);
    if (done) measure(&work, one, repeats);
    done = done && check(&work, &fault);
    if (!done) fprintf(stderr, "hair-bench: %s, %s: %s\n", one->name, one->what, fault.text);
    tear_down(&work);
    return done;
}

// --- the command line --------------------------------------------------------------------------

enum { KEY_LIST = 256, KEY_REPEATS };

typedef struct Options {
    bool list;
    int repeats;
    bool wanted[CASES];
    bool any;
    const Study* study;
} Options;

static const struct argp_option arguments[] = {
    {"list", KEY_LIST, 0, 0, "Print the cases and exit", 0},
    {"repeats", KEY_REPEATS, "N", 0, "Repeats of each case, of at least 20 ms (15)", 0},
    {0}};

static const char documentation[] =
    "Times the inner loops on one thread and writes CSV: bench,case,unit,min,median,repeats.\v"
    "A node-step is one node through one of the four substeps of a tick.\n"
    "Examples:\n"
    "  hair-bench                     all of them\n"
    "  hair-bench step wire           only these\n"
    "  hair-bench --repeats 99 step > step.csv\n"
    "  hair-bench sim > sim.csv       a study, with columns of its own\n"
    "  hair-bench --list\n"
    "Exit status: 0 done, 1 failed, 2 wrong arguments.";

static void choose(struct argp_state* state, const char* name, Options* options)
{
    bool found = false;
    for (size_t i = 0; i < STUDIES; ++i)
        if (strcmp(studies[i].name, name) == 0) {
            options->study = &studies[i];
            return;
        }
    for (size_t i = 0; i < CASES; ++i)
        if (strcmp(cases[i].name, name) == 0) options->wanted[i] = found = true;
    if (!found) argp_error(state, "%s: no such bench; --list names them", name);
    options->any = true;
}

static error_t parse(int key, char* text, struct argp_state* state)
{
    Options* options = state->input;
    char* end = NULL;
    long repeats;
    switch (key) {
    case KEY_LIST:
        options->list = true;
        return 0;
    case KEY_REPEATS:
        repeats = strtol(text, &end, 10);
        if (end == text || *end != '\0' || repeats < 1 || repeats > MAX_REPEATS)
            argp_error(state, "--repeats %s: want a whole number from 1 to %d", text, MAX_REPEATS);
        options->repeats = (int)repeats;
        return 0;
    case ARGP_KEY_ARG:
        choose(state, text, options);
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static int run_study(const Options* options)
{
    Fault fault = {""};
    if (options->any) {
        fprintf(stderr, "hair-bench: %s is a study: name it alone\n", options->study->name);
        return 2;
    }
    bool done = options->study->run(&fault);
    if (!done) fprintf(stderr, "hair-bench: %s: %s\n", options->study->name, fault.text);
    return done && fflush(stdout) == 0 ? 0 : 1;
}

int main(int argc, char** argv)
{
    Options options = {.repeats = 15};
    static const struct argp argp = {arguments, parse, "[NAME...]", documentation,
                                     NULL,      NULL,  NULL};
    argp_program_version = "hair-bench (strandcast) " STRANDCAST_VERSION;
    argp_err_exit_status = 2;
    argp_parse(&argp, argc, argv, 0, NULL, &options);
    if (options.study != NULL && !options.list) return run_study(&options);
    for (size_t i = 0; options.list && i < STUDIES; ++i)
        printf("%-12s %s (a study: columns of its own)\n", studies[i].name, studies[i].help);
    if (!options.list) printf("bench,case,unit,min,median,repeats\n");
    bool done = true;
    for (size_t i = 0; i < CASES; ++i) {
        if (options.any && !options.wanted[i]) continue;
        if (options.list)
            printf("%-12s %s, %s\n", cases[i].name, cases[i].what, cases[i].unit);
        else
            done = run(&cases[i], options.repeats) && done;
    }
    if (fflush(stdout) != 0 || ferror(stdout)) {
        fputs("hair-bench: standard output cannot be written\n", stderr);
        return 1;
    }
    return done ? 0 : 1;
}
