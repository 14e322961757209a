// What a tick costs: over models, kernels, strands, nodes, iterations, threads, and what colliders
// add. Every set of cases is measured in rounds, all of its cases in each, so that a busy minute
// falls on all alike and their ratios stand.
#include "server/kernel.h"
#include "server/models.h"
#include "tests/studies.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define ROUNDS     11
#define ROUND_US   4000 // a case runs at least so long in a round
#define MAX_CASES  96
#define SWAY_TICKS 60
#define MAX_SUBS   16
#define STRAND_M   0.25f
#define SPHERES    14 // as many as `long` has

typedef struct Case {
    const char* set;
    ModelKind model;
    const char* kernel;
    int nodes, strands, substeps, iterations, threads, colliders;
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

// 46 degrees to each side: everything moves, nothing settles.
static void sway(Cases* cases, int substeps)
{
    for (int i = 0; i < SWAY_TICKS * substeps; ++i) {
        double angle = 0.8 * sin(2.0 * M_PI * (i + 1) / (SWAY_TICKS * substeps));
        float c = (float)cos(angle), s = (float)sin(angle);
        cases->sway[i / substeps][i % substeps] =
            (SimHead){.rotation = {c, 0, s, 0, 1, 0, -s, 0, c}};
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
    d.model = one->model;
    d.kernel = one->kernel;
    d.strands = one->strands;
    d.nodes = one->nodes;
    d.rest = rest;
    d.substeps = one->substeps;
    d.iterations = one->iterations;
    d.threads = one->threads;
    d.colliders = spheres;
    d.collider_count = one->colliders;
    d.force = true; // one substep of the cascade is near its bound
    Sim* sim = sim_create(&d, fault);
    free(rest);
    return sim;
}

static void step(Cases* cases, Case* one, int64_t ticks)
{
    for (int64_t tick = 0; tick < ticks; ++tick)
        sim_step(one->sim, cases->sway[tick % SWAY_TICKS]);
}

static double time_us(Cases* cases, Case* one, int64_t ticks)
{
    int64_t began = base_monotonic_us();
    step(cases, one, ticks);
    return (double)(base_monotonic_us() - began);
}

static int ascending(const void* a, const void* b)
{
    double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

static void print(const Case* one)
{
    double node_steps = (double)one->nodes * one->strands * one->substeps;
    printf("%s,%s,%s,%d,%d,%d,%d,%d,%d,%.4g,%.4g,%.4g,%.4g\n", one->set, models[one->model].name,
           one->kernel, one->nodes, one->strands, one->substeps, one->iterations, one->threads,
           one->colliders, 1e3 * one->us[0] / node_steps, 1e3 * one->us[ROUNDS / 2] / node_steps,
           one->us[0], one->us[ROUNDS / 2]);
}

static bool measure(Cases* cases, Fault* fault)
{
    for (int i = 0; i < cases->count; ++i) {
        Case* one = &cases->all[i];
        sway(cases, one->substeps);
        one->sim = create(one, fault);
        if (one->sim == NULL) return false;
        for (one->ticks = 1; time_us(cases, one, one->ticks) < ROUND_US;)
            one->ticks *= 2;
    }
    for (int round = 0; round < ROUNDS; ++round)
        for (int i = 0; i < cases->count; ++i) {
            Case* one = &cases->all[i];
            sway(cases, one->substeps);
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
                  .kernel = kernel_find(NULL)->name,
                  .nodes = 8,
                  .strands = 1024,
                  .substeps = 4,
                  .iterations = 1,
                  .threads = 1};
    return one;
}

// The gate: 8 nodes, four link solves a node-step, one step.
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

static void add_iterations(Cases* cases)
{
    static const int iterations[] = {0, 1, 2, 4, 8, 16};
    for (size_t i = 0; i < sizeof iterations / sizeof iterations[0]; ++i)
        add(cases, "iterations", MODEL_SPRING)->iterations = iterations[i];
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
    }
}

bool study_sim(Fault* fault)
{
    static Cases cases; // large
    printf("# hair-bench sim: time of a tick; the head sways, strands of 0.25 m, %d rounds\n",
           ROUNDS);
    study_machine();
    printf("set,model,kernel,nodes,strands,substeps,iterations,threads,colliders,"
           "ns_per_node_step_min,ns_per_node_step_median,us_per_tick_min,us_per_tick_median\n");
    add_kernels(&cases);
    if (!measure(&cases, fault)) return false;
    for (int nodes = 4; nodes <= 16; nodes *= 2) {
        add_strands(&cases, nodes);
        if (!measure(&cases, fault)) return false;
    }
    add_iterations(&cases);
    if (!measure(&cases, fault)) return false;
    add_threads(&cases);
    if (!measure(&cases, fault)) return false;
    add_prices(&cases);
    return measure(&cases, fault);
}
