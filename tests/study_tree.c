// What the Adaptive Wisp Tree saves, and what it costs in error: the clips over heads of 64 to
// 16,384 strands, beside the same strands without a tree.
//
// Both run the same ticks in rounds, one tick of the one and one of the other, and of every tick
// the shortest time counts: the machine is shared, and the tree's own worst ticks must show, not
// the neighbour's.
#include "server/models.h"
#include "server/motion.h"
#include "server/strands.h"
#include "tests/studies.h"
#include "tests/tree.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define ROUNDS       5
#define TICKS        240 // a clip of 2 s and 2 s of rest
#define SUBSTEPS     4
#define NODES        8
#define LENGTH_M     0.25
#define HEAD_M       0.095
#define DAMPING      15.0f // below it two runs part whatever they differ by (notes/simulation.md 2)
#define GOLDEN_ANGLE 2.39996322972865332

static const char* const clips[] = {"shake", "nod", "run", "turn", "gust"};
#define CLIPS (int)(sizeof clips / sizeof clips[0])

typedef enum State { FREE, MERGED, HALF, SPLIT } State;
static const char* const state_names[] = {"free", "merged", "half", "split"};

typedef struct Case {
    const char* set;
    ModelKind model;
    const char* clip;
    int strands;
    State state;
    float split_m2_s2;
    bool has_contact;
} Case;

typedef struct Run {
    SimHead heads[TICKS][SUBSTEPS];
    Vec3 *rest, *of_sim, *of_tree, *scrap;
    Sim* sim;
    Tree* tree;
    double sim_us[TICKS], tree_us[TICKS], sim_read_us, tree_read_us; // the shortest of the rounds
    double share, most_share, square, most;
} Run;

static double now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e6 * (double)now.tv_sec + 1e-3 * (double)now.tv_nsec;
}

// Roots spread evenly round a sphere, from above its middle to below; strands go out and soon hang.
static void grow(Vec3* rest, int strands)
{
    for (int s = 0; s < strands; ++s) {
        double up = 0.6 - (s + 0.5) / strands, out = sqrt(1 - up * up), turn = GOLDEN_ANGLE * s;
        Vec3d way = {out * cos(turn), up, out * sin(turn)}, p = vec3d_scale(way, HEAD_M);
        for (int n = 0; n < NODES; ++n) {
            rest[s * NODES + n] = vec3_from(p);
            Vec3d d = vec3d_scale(way, fmax(0, 1 - 2.5 * (n + 0.5) / (NODES - 1)));
            d.y -= 1;
            p = vec3d_mad(p, d, LENGTH_M / (NODES - 1) / sqrt(vec3d_dot(d, d)));
        }
    }
}

static void move(Run* run, const char* clip, double rate_hz)
{
    const Motion* motion = motion_find(clip);
    double dt = 1 / (rate_hz * SUBSTEPS);
    for (int i = 0; i < TICKS * SUBSTEPS; ++i) {
        double t = (i + 1) * dt;
        MotionState now = motion->at(t);
        Vec3d then = motion->at(t - dt).pose.position;
        Vec3d before = i == 0 ? then : motion->at(t - 2 * dt).pose.position;
        Vec3d step = vec3d_sub(now.pose.position, then), last = vec3d_sub(then, before);
        SimHead* head = &run->heads[i / SUBSTEPS][i % SUBSTEPS];
        *head = (SimHead){.second_difference = vec3_from(vec3d_sub(step, last)),
                          .move = vec3_from(step),
                          .wind = vec3_from(now.wind)};
        if (i == 0) head->second_difference = vec3(0, 0, 0); // it may be on its way already
        quat_matrix(head->rotation, now.pose.orientation);
    }
}

static TreeOptions options_of(const Case* one)
{
    TreeOptions options = tree_default();
    options.has_contact = one->has_contact;
    options.split_m2_s2 = one->state == FREE ? one->split_m2_s2 : 1e30f;
    if (one->state == HALF) options.most_merged = NODES / 2;
    if (one->state == SPLIT) options.most_merged = 1;
    return options;
}

static bool create(Run* run, const Case* one, Fault* fault)
{
    Collider head = collider_sphere((Sphere){{0, 0, 0}, (float)HEAD_M});
    SimDefinition d = sim_default();
    TreeOptions options = options_of(one);
    grow(run->rest, one->strands);
    model_use(&d, one->model);
    d.strands = one->strands;
    d.nodes = NODES;
    d.rest = run->rest;
    d.substeps = SUBSTEPS;
    d.damping_per_s = DAMPING;
    d.colliders = &head;
    d.collider_count = 1;
    move(run, one->clip, d.rate_hz);
    run->sim = sim_create(&d, fault);
    run->tree = run->sim == NULL ? NULL : tree_create(&d, &options, fault);
    return run->tree != NULL;
}

static double least(double a, double b)
{
    return a < b ? a : b;
}

static void compare(Run* run, const Case* one)
{
    tree_state(run->tree, run->of_tree, run->scrap);
    sim_state(run->sim, run->of_sim, run->scrap);
    double sum = 0;
    for (int i = 0; i < one->strands * NODES; ++i) {
        Vec3 apart = vec3_sub(run->of_tree[i], run->of_sim[i]);
        double square = (double)vec3_dot(apart, apart);
        sum += square;
        run->most = square > run->most ? square : run->most;
    }
    run->square += sum / (one->strands * NODES * TICKS);
}

static void round_trip(Run* run, const Case* one, bool is_first)
{
    const float* start = run->heads[0][0].rotation;
    sim_reset(run->sim, start);
    tree_reset(run->tree, start);
    for (int i = 0; i < TICKS; ++i) {
        double at = now_us();
        sim_step(run->sim, run->heads[i]);
        double stepped = now_us();
        tree_step(run->tree, run->heads[i]);
        double both = now_us();
        run->sim_us[i] = is_first ? stepped - at : least(run->sim_us[i], stepped - at);
        run->tree_us[i] = is_first ? both - stepped : least(run->tree_us[i], both - stepped);
        if (!is_first) continue;
        double share = tree_split_share(run->tree);
        run->share += share / TICKS;
        run->most_share = fmax(run->most_share, share);
        compare(run, one);
    }
}

// What the daemon does with every tick: positions in head space, lengths put back.
static void read_out(Run* run)
{
    for (int round = 0; round < ROUNDS; ++round) {
        double at = now_us();
        sim_positions(run->sim, run->heads[0][0].rotation, true, run->scrap);
        double read = now_us();
        tree_positions(run->tree, run->heads[0][0].rotation, true, run->scrap);
        double both = now_us();
        run->sim_read_us = round == 0 ? read - at : least(run->sim_read_us, read - at);
        run->tree_read_us = round == 0 ? both - read : least(run->tree_read_us, both - read);
    }
}

static void mean_and_most(const double* us, double* mean, double* most)
{
    *mean = *most = 0;
    for (int i = 0; i < TICKS; ++i) {
        *mean += us[i] / TICKS;
        *most = fmax(*most, us[i]);
    }
}

static void print(const Run* run, const Case* one)
{
    double sim_mean, sim_most, tree_mean, tree_most;
    mean_and_most(run->sim_us, &sim_mean, &sim_most);
    mean_and_most(run->tree_us, &tree_mean, &tree_most);
    printf("%s,%s,%s,%d,%s,%g,%d,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g\n",
           one->set, models[one->model].name, one->clip, one->strands, state_names[one->state],
           (double)one->split_m2_s2, one->has_contact, sim_mean, sim_most, tree_mean, tree_most,
           sim_mean / tree_mean, run->sim_read_us, run->tree_read_us, run->share, run->most_share,
           sqrt(run->square) / LENGTH_M, sqrt(run->most) / LENGTH_M);
}

static bool measure(const Case* one, Fault* fault)
{
    static Run run; // large
    size_t nodes = (size_t)one->strands * NODES;
    memset(&run, 0, sizeof run);
    run.rest = calloc(nodes, sizeof *run.rest);
    run.of_sim = calloc(nodes, sizeof *run.of_sim);
    run.of_tree = calloc(nodes, sizeof *run.of_tree);
    run.scrap = calloc(nodes, sizeof *run.scrap);
    bool done = run.rest && run.of_sim && run.of_tree && run.scrap;
    if (!done) fault_set(fault, "no memory for %d strands", one->strands);
    done = done && create(&run, one, fault);
    for (int round = 0; done && round < ROUNDS; ++round)
        round_trip(&run, one, round == 0);
    if (done) read_out(&run);
    if (done) print(&run, one);
    tree_destroy(run.tree);
    sim_destroy(run.sim);
    free(run.rest);
    free(run.of_sim);
    free(run.of_tree);
    free(run.scrap);
    return done && fflush(stdout) == 0;
}

static const Case usual = {.set = "clips",
                           .model = MODEL_SPRING,
                           .clip = "shake",
                           .strands = 1024,
                           .state = FREE,
                           .split_m2_s2 = 0.25f};

static bool over_clips(Case one, Fault* fault)
{
    bool done = true;
    one.split_m2_s2 = tree_default().split_m2_s2;
    for (int clip = 0; done && clip < CLIPS; ++clip) {
        one.clip = clips[clip];
        done = measure(&one, fault);
    }
    return done;
}

static bool over_strands(Fault* fault)
{
    static const int strands[] = {64, 256, 512, 1024, 2048, 4096, 16384};
    bool done = true;
    for (size_t i = 0; done && i < sizeof strands / sizeof strands[0]; ++i) {
        Case one = usual;
        one.strands = strands[i];
        done = over_clips(one, fault);
        one.set = "states";
        for (int state = MERGED; done && state <= SPLIT; ++state) {
            one.state = (State)state;
            done = measure(&one, fault);
        }
        one.state = MERGED;
        one.has_contact = true; // a second a tick for 16,384
        if (one.strands <= 2048) done = done && measure(&one, fault);
    }
    return done;
}

static bool over_models(Fault* fault)
{
    bool done = true;
    for (int model = MODEL_CASCADE; done && model <= MODEL_PLAIN; ++model) {
        Case one = usual;
        one.set = "models";
        one.model = (ModelKind)model;
        one.strands = 4096;
        done = over_clips(one, fault);
    }
    return done;
}

static bool over_bounds(Fault* fault)
{
    static const float bounds[] = {0.02f, 0.05f, 0.1f, 0.25f, 0.5f, 1.0f, 2.0f};
    bool done = true;
    for (size_t i = 0; done && i < sizeof bounds / sizeof bounds[0]; ++i) {
        Case one = usual;
        one.set = "bounds";
        one.strands = 4096;
        one.split_m2_s2 = bounds[i];
        done = measure(&one, fault);
    }
    return done;
}

bool study_tree(Fault* fault)
{
    printf(
        "# hair-bench tree: a tick with and without the Adaptive Wisp Tree, one thread, clips of "
        "2 s and 2 s of rest, damping %g/s;\n"
        "# of each tick the shortest of %d rounds; read: positions for the wire; rms, max: the "
        "tree's nodes against those without, in strand lengths\n",
        (double)DAMPING, ROUNDS);
    study_machine();
    printf("set,model,clip,strands,state,split_m2_s2,contact,single_mean_us,single_max_us,"
           "tree_mean_us,tree_max_us,ratio,single_read_us,tree_read_us,split_share_mean,"
           "split_share_max,rms,max\n");
    return over_strands(fault) && over_models(fault) && over_bounds(fault);
}
