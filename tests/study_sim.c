// What a tick costs: over models, kernels, strands, nodes, lengths, threads, and what colliders
// and wind add. Every set of cases is measured in rounds, all of its cases in each, so that a busy
// minute falls on all alike and their ratios stand. Times are of the thread, so that what else runs
// here counts as little as may be; of the clock where there are several.
#include "server/kernel.h"
#include "server/models.h"
#include "tests/studies.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define ROUNDS     11
#define ROUND_US   4000 // a case runs at least so long in a round
#define MAX_CASES  96
#define SWAY_TICKS 60
#define MAX_SUBS   16
#define STRAND_M   0.25f
#define SPHERES    14 // as many as `long` has
#define WIND_M_S   8.0f

typedef struct Case {
    const char* set;
    ModelKind model;
    const char* kernel;
    int nodes, strands, substeps, iterations, threads, colliders;
    float wind_m_s;
    LengthStage length;
    Sim* sim;
    int64_t ticks;     // of a round
    double us[ROUNDS]; // of a tick
} Case;

typedef struct Cases {
    Case all[MAX_CASES];
    int count;
    SimHead sway[SWAY_TICKS][MAX_SUBS];
} Cases;

void study_machine(void)
{
    char line[256], name[256] = "unknown";
    FILE* file = fopen("/proc/cpuinfo", "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL)
        if (sscanf(line, "model name : %255[^\n]", name) == 1) break;
    if (file != NULL) fclose(file);
    printf("# machine: %s, %ld cores; kernels %s\n", name, sysconf(_SC_NPROCESSORS_ONLN),
           kernel_names());
}

// 46 degrees to each side, and 5 cm along x: everything moves, nothing settles, and strands bend.
static void sway(Cases* cases, const Case* one)
{
    double steps = SWAY_TICKS * one->substeps, turn = 2.0 * M_PI / steps;
    for (int i = 0; i < SWAY_TICKS * one->substeps; ++i) {
        double angle = 0.8 * sin(turn * (i + 1)), shift = -0.05 * turn * turn * cos(turn * i);
        float c = (float)cos(angle), s = (float)sin(angle);
        cases->sway[i / one->substeps][i % one->substeps] =
            (SimHead){.rotation = {c, 0, s, 0, 1, 0, -s, 0, c},
                      .second_difference = {(float)shift, 0, 0},
                      .wind = {one->wind_m_s, 0, 0}};
    }
}

// Straight strands on a grid of 2 mm; spheres beside them, near enough to be asked after.
static Sim* create(const Case* one, Fault* fault)
{
    SimDefinition d = sim_default();
    Collider spheres[SPHERES];
    Vec3* rest = calloc((size_t)one->strands * (size_t)one->nodes, sizeof *rest);
    if (rest == NULL) {
        fault_set(fault, "no memory for %d strands", one->strands);
        return NULL;
    }
    for (int i = 0; i < one->strands * one->nodes; ++i) {
        int strand = i / one->nodes, node = i % one->nodes;
        rest[i] =
            vec3(0.002f * (float)(strand % 128), -STRAND_M * (float)node / (float)(one->nodes - 1),
                 0.002f * (float)(strand / 128));
    }
    for (int k = 0; k < SPHERES; ++k)
        spheres[k] =
            collider_sphere((Sphere){{0.02f * (float)k, -0.02f * (float)k, -0.09f}, 0.08f});
    model_use(&d, one->model);
    d.length = one->length;
    d.kernel = one->kernel;
    d.strands = one->strands;
    d.nodes = one->nodes;
    d.rest = rest;
    d.substeps = one->substeps;
    d.iterations = one->iterations;
    d.threads = one->threads;
    d.colliders = spheres;
    d.collider_count = one->colliders;
    d.force = true; // forest-z: one substep is beyond the bound of its joints' damping
    // One substep is beyond the stiffness of joints, too, and what flies apart takes another time.
    d.stiffness_s2 = fminf(d.stiffness_s2, (float)(0.5 * model_stiffness_bound(&d)));
    Sim* sim = sim_create(&d, fault);
    free(rest);
    return sim;
}

static void step(Cases* cases, Case* one, int64_t ticks)
{
    for (int64_t tick = 0; tick < ticks; ++tick)
        sim_step(one->sim, cases->sway[tick % SWAY_TICKS]);
}

static double now_us(const Case* one)
{
    struct timespec now;
    clock_gettime(one->threads > 1 ? CLOCK_MONOTONIC : CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e6 * (double)now.tv_sec + 1e-3 * (double)now.tv_nsec;
}

static double time_us(Cases* cases, Case* one, int64_t ticks)
{
    double began = now_us(one);
    step(cases, one, ticks);
    return now_us(one) - began;
}

static int ascending(const void* a, const void* b)
{
    double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

// Of the round at `rank`, 0 the shortest.
static double ns_per_node_step(const Case* one, int rank)
{
    return 1e3 * one->us[rank] / ((double)one->nodes * one->strands * one->substeps);
}

static void print(const Case* one)
{
    printf("%s,%s,%s,%d,%d,%d,%d,%d,%d,%g,%.4g,%.4g,%.4g,%.4g,%s\n", one->set,
           models[one->model].name, one->kernel, one->nodes, one->strands, one->substeps,
           one->iterations, one->threads, one->colliders, (double)one->wind_m_s,
           ns_per_node_step(one, 0), ns_per_node_step(one, ROUNDS / 2), one->us[0],
           one->us[ROUNDS / 2], length_names[one->length]);
}

static bool measure(Cases* cases, Fault* fault)
{
    for (int i = 0; i < cases->count; ++i) {
        Case* one = &cases->all[i];
        sway(cases, one);
        one->sim = create(one, fault);
        if (one->sim == NULL) return false;
        for (one->ticks = 1; time_us(cases, one, one->ticks) < ROUND_US;)
            one->ticks *= 2;
    }
    for (int round = 0; round < ROUNDS; ++round)
        for (int i = 0; i < cases->count; ++i) {
            Case* one = &cases->all[i];
            sway(cases, one);
            one->us[round] = time_us(cases, one, one->ticks) / (double)one->ticks;
        }
    for (int i = 0; i < cases->count; ++i) {
        qsort(cases->all[i].us, ROUNDS, sizeof(double), ascending);
        print(&cases->all[i]);
        sim_destroy(cases->all[i].sim);
    }
    cases->count = 0;
    return fflush(stdout) == 0;
}

static Case* add(Cases* cases, const char* set, ModelKind model)
{
    Case* one = &cases->all[cases->count++];
    *one = (Case){.set = set,
                  .model = model,
                  .length = models[model].length,
                  .kernel = kernel_find(NULL)->name,
                  .nodes = 8,
                  .strands = 1024,
                  .substeps = 4,
                  .iterations = 1,
                  .threads = 1};
    return one;
}

static void add_gates(Cases* cases)
{
    static const ModelKind kinds[] = {MODEL_SPRING, MODEL_SPRING, MODEL_CASCADE, MODEL_FOREST};
    for (int sweeps = 4; sweeps >= 1; sweeps -= 3)
        for (int i = 0; i < 4; ++i) {
            Case* one = add(cases, "gate", kinds[i]);
            one->iterations = sweeps;
            one->length = LENGTH_SWEEPS;
            one->substeps = sweeps == 4 ? 1 : 4;
            if (i == 0) one->kernel = "scalar";
        }
}

// What is asked of the solver (8 nodes, four sweeps of lengths, no colliders, no wind), and the
// same at the defaults.
static void print_gates(const Cases* cases)
{
    double ns[8];
    for (int i = 0; i < 8; ++i)
        ns[i] = ns_per_node_step(&cases->all[i], 0);
    printf("# gate: spring takes %.2f ns a node-step (at most 2.0), the scalar kernel %.1f times "
           "that (at least 15)\n",
           ns[1], ns[0] / ns[1]);
    printf("# gate: cascade takes %.2f and forest %.2f times as long as spring (at most 3)\n",
           ns[2] / ns[1], ns[3] / ns[1]);
    printf("# at 4 substeps of one sweep: spring %.2f ns, scalar %.1f times that, cascade %.2f, "
           "forest %.2f\n",
           ns[5], ns[4] / ns[5], ns[6] / ns[5], ns[7] / ns[5]);
    printf("# peers, on a machine like this, a vertex and iteration: Bullet's rope 100 ns, Jolt's "
           "Cosserat rods 19 to 27 ns\n");
}

// Four link solves a node-step, one step.
static void add_kernels(Cases* cases)
{
    static const char* const names[] = {"avx512", "avx2", "sse2", "scalar"};
    for (int model = 0; model < MODEL_COUNT; ++model)
        for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
            if (kernel_find(names[i]) == NULL) continue;
            Case* one = add(cases, "kernels", (ModelKind)model);
            one->kernel = names[i];
            one->substeps = 1;
            one->iterations = 4;
            one->length = LENGTH_SWEEPS;
        }
}

static void add_strands(Cases* cases, int nodes)
{
    static const int strands[] = {9, 25, 49, 121, 512, 2048, 16384};
    for (int model = 0; model < MODEL_COUNT; ++model)
        for (size_t i = 0; i < sizeof strands / sizeof strands[0]; ++i) {
            Case* one = add(cases, "strands", (ModelKind)model);
            one->strands = strands[i];
            one->nodes = nodes;
        }
}

// Of the set of strands: what one more strand costs, as a power of how many there are.
static void print_growth(const Cases* cases, int nodes)
{
    const Case *few = NULL, *many = NULL;
    for (int i = 0; cases->all[i].set != NULL && strcmp(cases->all[i].set, "strands") == 0; ++i) {
        if (cases->all[i].strands == 512) few = &cases->all[i];
        if (cases->all[i].strands == 16384) many = &cases->all[i];
        if (few == NULL || many == NULL) continue;
        printf("# %s, %d nodes: from 512 to 16384 strands time grows as strands^%.3f\n",
               models[many->model].name, nodes,
               log(many->us[0] / few->us[0]) / log((double)many->strands / few->strands));
        few = many = NULL;
    }
}

static void add_iterations(Cases* cases)
{
    static const int iterations[] = {0, 1, 2, 4, 8, 16};
    for (size_t i = 0; i < sizeof iterations / sizeof iterations[0]; ++i)
        for (int length = 0; length < LENGTH_COUNT; ++length) {
            Case* one = add(cases, "iterations", MODEL_SPRING);
            one->iterations = iterations[i];
            one->length = (LengthStage)length;
        }
}

static void add_threads(Cases* cases)
{
    for (int threads = 1; threads <= 2; ++threads)
        for (int model = 0; model < MODEL_COUNT; ++model) {
            Case* one = add(cases, "threads", (ModelKind)model);
            one->strands = 16384;
            one->threads = threads;
        }
}

static void add_prices(Cases* cases)
{
    for (int model = 0; model < MODEL_COUNT; ++model) {
        add(cases, "prices", (ModelKind)model);
        add(cases, "prices", (ModelKind)model)->colliders = SPHERES;
        add(cases, "prices", (ModelKind)model)->wind_m_s = WIND_M_S;
    }
}

bool study_sim(Fault* fault)
{
    static Cases cases; // large
    printf("# hair-bench sim: time of a tick; the head sways, strands of 0.25 m, %d rounds; "
           "stiffness and length stage as the model has them by default, sets gate and kernels by "
           "sweeps\n",
           ROUNDS);
    study_machine();
    printf(
        "set,model,kernel,nodes,strands,substeps,iterations,threads,colliders,wind_m_s,"
        "ns_per_node_step_min,ns_per_node_step_median,us_per_tick_min,us_per_tick_median,length\n");
    add_gates(&cases);
    if (!measure(&cases, fault)) return false;
    print_gates(&cases);
    add_kernels(&cases);
    if (!measure(&cases, fault)) return false;
    for (int nodes = 4; nodes <= 16; nodes *= 2) {
        add_strands(&cases, nodes);
        if (!measure(&cases, fault)) return false;
        print_growth(&cases, nodes);
    }
    add_iterations(&cases);
    if (!measure(&cases, fault)) return false;
    add_threads(&cases);
    if (!measure(&cases, fault)) return false;
    add_prices(&cases);
    return measure(&cases, fault);
}
