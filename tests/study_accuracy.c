// How wrong each model is, over the standard clips, against two truths that are never mixed:
//   numerical: the same model in double with a step and lengths that are as good as converged
//   rod        the discrete elastic rod that the model's stiffness stands for
// and what each configuration costs, measured here, so that one table holds both axes.
#include "server/models.h"
#include "tests/energy.h"
#include "tests/studies.h"
#include "tests/trace.h"

#include <math.h>
#include <stdio.h>

#define GAMMA          22.0 // of the groom that models are compared with themselves on
#define LINKS          7
#define RATES          5
#define STAGES         8
#define TRUTH_SUBSTEPS 256
#define TRUTH_SOLVES   4
#define TRUTH_SWEEPS   40 // of a model that only ever sweeps
#define ROD_LINKS      42
#define ROD_STEPS      12 // a tick
#define MODEL_SUBSTEPS 64 // ... of a model that is compared with it, converged
#define MODEL_SOLVES   4
#define MODEL_SWEEPS   8
#define CHAIN_LINKS    42
#define CHAOS          3.0 // of what the truth itself is unsure of: an error within says nothing
#define COST_STRANDS   121
#define COST_ROUNDS    25
#define COST_PIECE     5  // ticks, timed together
#define COST_REPEATS   4  // ... so often
#define MOST_RATE      16 // of rates[]
#define COST_TICKS     60
#define FIRST_MODE     12.362        // 3.516^2: first mode of a clamped beam
#define MISSING        ((double)NAN) // printed as nothing
#define FIRST_SWING    1.4458        // 1.2024^2: of a hanging chain

static const int rates[RATES] = {1, 2, 4, 8, 16}; // substeps of a tick

// How lengths are kept within a substep.
typedef struct Stage {
    LengthStage length;
    int iterations;
} Stage;

static const Stage stages[STAGES] = {
    {LENGTH_SWEEPS, 1},  {LENGTH_SWEEPS, 2}, {LENGTH_SWEEPS, 4}, {LENGTH_SWEEPS, 8},
    {LENGTH_SWEEPS, 16}, {LENGTH_DIRECT, 1}, {LENGTH_DIRECT, 2}, {LENGTH_DIRECT, 4},
};
static const float dampings[] = {15.0f, 8.0f};
#define DAMPINGS (sizeof dampings / sizeof dampings[0])

typedef struct Bench {
    Groom groom;
    double us[MODEL_COUNT][RATES][STAGES]; // of a tick of COST_STRANDS
    Trace truth, other, trace;
} Bench;

// A line of the table. What does not apply is NaN and printed as nothing.
typedef struct Row {
    const char *set, *model, *variant, *clip;
    double gamma, damping;
    int substeps, iterations;
    LengthStage length;
    Distance distance;
    Conduct conduct;
    double truth_rms, spread, us, energy, stable_to_s2;
    int64_t lost;
} Row;

static const Distance no_distance = {MISSING, MISSING, MISSING, MISSING, MISSING};
static const Conduct no_conduct = {MISSING, MISSING, MISSING, MISSING, MISSING, MISSING};

static void number(double value)
{
    if (isnan(value))
        printf(",");
    else
        printf(",%.3g", value);
}

static void print(const Row* row)
{
    Distance d = row->distance;
    Conduct c = row->conduct;
    printf("%s,%s,%s", row->set, row->model, row->variant);
    number(row->gamma);
    number(row->damping);
    printf(",%s,%d,%d", row->clip, row->substeps * CLIP_RATE_HZ, row->iterations);
    number(d.rms);
    number(d.raw_rms);
    number(d.max);
    number(d.motion_rms);
    number(d.tip_lag_ms);
    number(100.0 * c.stretch_mean);
    number(100.0 * c.stretch_max);
    number(1e3 * c.projection_mean_m);
    number(1e3 * c.projection_max_m);
    number(c.rest);
    number(c.tip_peak);
    number(row->truth_rms);
    number(row->spread);
    bool is_at_floor = CHAOS * fmax(row->spread, row->truth_rms) > d.rms;
    printf(",%d,%lld", is_at_floor, (long long)row->lost);
    number(row->us);
    number(1e3 * row->us / (COST_STRANDS * (LINKS + 1) * row->substeps));
    number(row->energy);
    number(row->stable_to_s2);
    printf(",%s\n", row->iterations > 0 ? length_names[row->length] : "");
}

static void print_head(void)
{
    printf("# hair-bench accuracy: errors against two truths over the clips, and what they cost\n");
    study_machine();
    printf("# eight strands of %.2f m, four that hang and four that arch, %d links; no colliders, "
           "the rod has none\n",
           GROOM_LENGTH_M, LINKS);
    printf(
        "# set numerical: against the same model in double at %d substeps of 1/60 s and %d direct "
        "solves of lengths (cascade-thesis: %d sweeps); stiffness, fall-off, compensation as by "
        "default of the model; groom of gamma %g\n",
        TRUTH_SUBSTEPS, TRUTH_SOLVES, TRUTH_SWEEPS, GAMMA);
    printf("# set truth: spring's truth by %d sweeps against that by %d direct solves\n",
           TRUTH_SWEEPS, TRUTH_SOLVES);
    printf("# set rod: against a discrete elastic rod of %d edges (G J = E I / 1.38, BDF2, %d "
           "steps of 1/60 s), straight by nature, whose rest under gravity is the groom; gamma is "
           "rho A g L^3 / (E I); k uniform, E I / (m d^3)\n",
           ROD_LINKS, ROD_STEPS);
    printf("#   variant converged: in double, %d substeps and %d direct solves (cascade-thesis: %d "
           "sweeps), so that the model's own error is left; shipped: in float, as by default\n",
           MODEL_SUBSTEPS, MODEL_SOLVES, MODEL_SWEEPS);
    printf("#   spring, beam: k/m = 12.36 g / (L gamma), first mode of a beam; hang: 1.446 g / L "
           "more, that of a hanging chain; default: k and fall-off as shipped\n"
           "#   forest, forest-z: the head's acceleration acts on every link, or on the outermost "
           "alone\n");
    printf("# set chain: plain, converged, against itself with %d links\n", CHAIN_LINKS);
    printf("# set energy: a strand that hangs straight is kicked and not damped; what its own "
           "energy gains in the first second, in %% of what it has above rest\n"
           "# rms_l, max_l: of published nodes, in strand lengths; raw_rms_l: as simulated; "
           "motion_rms_l: less what is apart at the start\n"
           "# tip_lag_ms: where the tips' displacements correlate best, within half a swing\n"
           "# rest_error_l: farthest node from the start's pose, 1 s after the head stopped\n"
           "# truth_rms_l: what halving the truth's step (numerical) or having half its edges and "
           "steps (rod) moves it by\n"
           "# spread_l: the truth against itself with rest moved by 1e-6 lengths; chaos: 1 where "
           "the error is below %g times the larger of the two: at the floor of chaos\n"
           "# stable_to_s2: the stiffness beyond which the daemon refuses (server/models.h)\n",
           CHAOS);
    printf("# us_per_tick: %d strands of %d nodes, one thread, no colliders, least of %d rounds\n",
           COST_STRANDS, LINKS + 1, COST_ROUNDS);
    printf("set,model,variant,gamma,damping_per_s,clip,rate_hz,iterations,rms_l,raw_rms_l,max_l,"
           "motion_rms_l,tip_lag_ms,stretch_mean_pct,stretch_max_pct,projection_mean_mm,"
           "projection_max_mm,rest_error_l,tip_peak_l,truth_rms_l,spread_l,chaos,lost,us_per_tick,"
           "ns_per_node_step,energy_drift_pct_s,stable_to_s2,length\n");
}

static SimDefinition defaults(ModelKind model, double damping)
{
    SimDefinition d = sim_default();
    model_use(&d, model);
    d.damping_per_s = (float)damping;
    d.force = true; // 60 Hz is beyond the bound of some: that is an error, too
    return d;
}

static bool has_lengths(ModelKind model)
{
    return model != MODEL_FOREST && model != MODEL_FOREST_Z;
}

// The printed cascade is as printed: it sweeps. What has no lengths to keep has one stage.
static bool has_stage(ModelKind model, int stage)
{
    if (!has_lengths(model)) return stage == 0;
    return model != MODEL_CASCADE_THESIS || stages[stage].length == LENGTH_SWEEPS;
}

static void use_stage(SimDefinition* d, int stage)
{
    d->length = stages[stage].length;
    d->iterations = has_lengths(d->model) ? stages[stage].iterations : 0;
}

// One iteration of the model's own.
static int stage_by_default(ModelKind model)
{
    int i = 0;
    while (has_lengths(model) && (stages[i].length != models[model].length))
        ++i;
    return i;
}

static void use_converged(SimDefinition* d, int substeps, int solves, int many_sweeps)
{
    bool is_printed = d->model == MODEL_CASCADE_THESIS;
    d->substeps = substeps;
    d->length = is_printed ? LENGTH_SWEEPS : LENGTH_DIRECT;
    d->iterations = is_printed ? many_sweeps : has_lengths(d->model) ? solves : 0;
}

// --- cost

// The groom over and over, on COST_STRANDS strands, under a head that shakes.
static Sim* create_cost(const Groom* groom, SimDefinition d, Fault* fault)
{
    static Vec3 rest[COST_STRANDS * (LINKS + 1)];
    Vec3d nodes[LINKS + 1];
    for (int s = 0; s < COST_STRANDS; ++s) {
        groom_nodes(groom, s % GROOM_STRANDS, LINKS, nodes);
        for (int n = 0; n <= LINKS; ++n)
            rest[s * (LINKS + 1) + n] = vec3_from(nodes[n]);
    }
    d.strands = COST_STRANDS;
    d.nodes = LINKS + 1;
    d.rest = rest;
    return sim_create(&d, fault);
}

typedef struct Costs {
    Sim* sims[MODEL_COUNT][RATES][STAGES];
    SimHead heads[RATES][COST_TICKS][MOST_RATE];
} Costs;

static bool create_costs(Costs* costs, const Groom* groom, Fault* fault)
{
    for (int r = 0; r < RATES; ++r) {
        ClipReader reader = clip_begin(&clips[1], rates[r]);
        for (int tick = 0; tick < COST_TICKS; ++tick)
            clip_next(&reader, costs->heads[r][tick]);
    }
    for (int model = 0; model < MODEL_COUNT; ++model)
        for (int r = 0; r < RATES; ++r)
            for (int i = 0; i < STAGES; ++i) {
                if (!has_stage((ModelKind)model, i)) continue;
                SimDefinition d = defaults((ModelKind)model, 8.0);
                d.substeps = rates[r];
                use_stage(&d, i);
                costs->sims[model][r][i] = create_cost(groom, d, fault);
                if (costs->sims[model][r][i] == NULL) return false;
            }
    return true;
}

// In pieces so short that some of them run from end to end undisturbed.
static double time_us(Sim* sim, SimHead (*heads)[MOST_RATE])
{
    double least = HUGE_VAL;
    for (int first = 0; first < COST_TICKS; first += COST_PIECE) {
        int64_t began = base_monotonic_us();
        for (int repeat = 0; repeat < COST_REPEATS; ++repeat)
            for (int i = first; i < first + COST_PIECE; ++i)
                sim_step(sim, heads[i]);
        double us = (double)(base_monotonic_us() - began);
        least = fmin(least, us / (COST_REPEATS * COST_PIECE));
    }
    return least;
}

// All of them in every round, so that a busy second falls on all alike.
static void time_costs(Bench* bench, Costs* costs)
{
    for (int round = 0; round < COST_ROUNDS; ++round)
        for (int model = 0; model < MODEL_COUNT; ++model)
            for (int r = 0; r < RATES; ++r)
                for (int i = 0; i < STAGES; ++i) {
                    if (!has_stage((ModelKind)model, i)) continue;
                    double us = time_us(costs->sims[model][r][i], costs->heads[r]);
                    double* least = &bench->us[model][r][i];
                    *least = round == 0 ? us : fmin(*least, us);
                }
}

static bool measure_cost(Bench* bench, Fault* fault)
{
    static Costs costs; // large
    fprintf(stderr, "accuracy: cost\n");
    bool done = create_costs(&costs, &bench->groom, fault);
    if (done) time_costs(bench, &costs);
    for (int model = 0; model < MODEL_COUNT; ++model)
        for (int r = 0; r < RATES; ++r)
            for (int i = 0; i < STAGES; ++i)
                sim_destroy(costs.sims[model][r][i]);
    return done;
}

// --- against itself, converged

static bool find_truth(Bench* bench, SimDefinition d, const Clip* clip, double* halving,
                       Fault* fault)
{
    use_converged(&d, TRUTH_SUBSTEPS, TRUTH_SOLVES, TRUTH_SWEEPS);
    if (!trace_simulate(&bench->truth, &solver_double, d, LINKS, TRACE_COPIES, &bench->groom, clip,
                        fault))
        return false;
    d.substeps /= 2;
    if (!trace_simulate(&bench->other, &solver_double, d, LINKS, 1, &bench->groom, clip, fault))
        return false;
    *halving = trace_distance(&bench->other, &bench->truth, 1, clip).rms;
    return true;
}

static bool compare(Bench* bench, SimDefinition d, const Clip* clip, Row row, Fault* fault)
{
    if (!trace_simulate(&bench->trace, &solver_float, d, LINKS, 1, &bench->groom, clip, fault))
        return false;
    row.model = models[d.model].name;
    row.clip = clip->name;
    row.substeps = d.substeps;
    row.iterations = d.iterations;
    row.length = d.length;
    row.damping = (double)d.damping_per_s;
    row.stable_to_s2 = model_stiffness_bound(&d);
    row.distance = trace_distance(&bench->trace, &bench->truth, 1, clip);
    row.conduct = trace_conduct(&bench->trace, &bench->groom, clip);
    row.lost = bench->trace.lost;
    print(&row);
    return true;
}

// Every stage where the study is about them: for others, and at the damping that is not for
// comparing, one and four sweeps and one and two solves.
static bool is_wanted(ModelKind model, double damping, int stage)
{
    const Stage* s = &stages[stage];
    if (!has_stage(model, stage)) return false;
    if (model == MODEL_SPRING && damping > 10.0) return true;
    if (s->length == LENGTH_DIRECT) return s->iterations <= 2;
    return s->iterations == 1 || s->iterations == 4 || (s->iterations == 16 && damping > 10.0);
}

static bool study_numerical(Bench* bench, ModelKind model, double damping, const Clip* clip,
                            Fault* fault)
{
    SimDefinition d = defaults(model, damping);
    Row row = {.set = "numerical", .variant = "", .gamma = MISSING, .energy = MISSING};
    if (!find_truth(bench, d, clip, &row.truth_rms, fault)) return false;
    row.spread = trace_spread(&bench->truth);
    for (int r = 0; r < RATES; ++r)
        for (int i = 0; i < STAGES; ++i) {
            if (!is_wanted(model, damping, i)) continue;
            d.substeps = rates[r];
            use_stage(&d, i);
            row.us = bench->us[model][r][i];
            if (!compare(bench, d, clip, row, fault)) return false;
        }
    return fflush(stdout) == 0;
}

static bool study_all_numerical(Bench* bench, Fault* fault)
{
    for (int model = 0; model < MODEL_COUNT; ++model)
        for (size_t i = 0; i < DAMPINGS; ++i)
            for (const Clip* clip = clips; clip->name != NULL; ++clip) {
                fprintf(stderr, "accuracy: %s, damping %g, %s\n", models[model].name,
                        (double)dampings[i], clip->name);
                if (!study_numerical(bench, (ModelKind)model, (double)dampings[i], clip, fault))
                    return false;
            }
    return true;
}

// Does the truth depend on how its lengths are kept?
static bool study_truth(Bench* bench, Fault* fault)
{
    for (const Clip* clip = clips; clip->name != NULL; ++clip) {
        SimDefinition d = defaults(MODEL_SPRING, (double)dampings[0]);
        Row row = {.set = "truth",
                   .model = models[d.model].name,
                   .variant = "sweeps to solves",
                   .gamma = MISSING,
                   .us = MISSING,
                   .energy = MISSING};
        fprintf(stderr, "accuracy: truth, %s\n", clip->name);
        if (!find_truth(bench, d, clip, &row.truth_rms, fault)) return false;
        row.spread = trace_spread(&bench->truth);
        d.substeps = row.substeps = TRUTH_SUBSTEPS;
        d.iterations = row.iterations = TRUTH_SWEEPS;
        if (!trace_simulate(&bench->trace, &solver_double, d, LINKS, 1, &bench->groom, clip, fault))
            return false;
        row.clip = clip->name;
        row.damping = (double)d.damping_per_s;
        row.length = d.length;
        row.distance = trace_distance(&bench->trace, &bench->truth, 1, clip);
        row.conduct = trace_conduct(&bench->trace, &bench->groom, clip);
        row.stable_to_s2 = model_stiffness_bound(&d);
        print(&row);
    }
    return true;
}

// --- against the rod

typedef struct Contender {
    ModelKind model;
    const char* variant;
    double beam, swing; // k/m of a spring in g / (L gamma) and in g / L; 0, 0: as shipped
    bool outermost;
    bool is_converged;
} Contender;

static const Contender contenders[] = {
    {MODEL_SPRING, "beam converged", FIRST_MODE, 0, false, true},
    {MODEL_SPRING, "hang converged", FIRST_MODE, FIRST_SWING, false, true},
    {MODEL_SPRING, "hang shipped", FIRST_MODE, FIRST_SWING, false, false},
    {MODEL_SPRING, "default converged", 0, 0, false, true},
    {MODEL_SPRING, "default shipped", 0, 0, false, false},
    {MODEL_CASCADE, "converged", 0, 0, false, true},
    {MODEL_CASCADE, "shipped", 0, 0, false, false},
    {MODEL_FOREST, "every converged", 0, 0, false, true},
    {MODEL_FOREST, "every shipped", 0, 0, false, false},
    {MODEL_FOREST, "outermost converged", 0, 0, true, true},
    {MODEL_FOREST, "outermost shipped", 0, 0, true, false},
    {MODEL_PLAIN, "converged", 0, 0, false, true},
    {MODEL_PLAIN, "shipped", 0, 0, false, false},
    {MODEL_CASCADE_THESIS, "converged", 0, 0, false, true},
    {MODEL_FOREST_Z, "every converged", 0, 0, false, true},
    {MODEL_FOREST_Z, "outermost converged", 0, 0, true, true},
};
#define CONTENDERS (sizeof contenders / sizeof contenders[0])

static SimDefinition stand_for(const Contender* one, double gamma, double damping)
{
    SimDefinition d = defaults(one->model, damping);
    double unit = GROOM_GRAVITY / GROOM_LENGTH_M;
    bool is_spring = one->model == MODEL_SPRING;
    d.outermost = one->outermost;
    if (one->is_converged) use_converged(&d, MODEL_SUBSTEPS, MODEL_SOLVES, MODEL_SWEEPS);
    if (!has_lengths(d.model)) d.iterations = 0;
    if (is_spring && one->beam == 0.0) return d;
    d.fall_off_power = 0;
    d.stiffness_s2 =
        (float)(is_spring ? unit * (one->beam / gamma + one->swing) : unit * pow(LINKS, 4) / gamma);
    return d;
}

static bool contend(Bench* bench, const Contender* one, double damping, const Clip* clip,
                    double truth_rms, Fault* fault)
{
    double gamma = bench->groom.gamma;
    SimDefinition d = stand_for(one, gamma, damping);
    const Solver* solver = one->is_converged ? &solver_double : &solver_float;
    if (!trace_simulate(&bench->trace, solver, d, LINKS, 1, &bench->groom, clip, fault))
        return false;
    Row row = {.set = "rod",
               .model = models[d.model].name,
               .variant = one->variant,
               .clip = clip->name,
               .gamma = gamma,
               .damping = damping,
               .substeps = d.substeps,
               .iterations = d.iterations,
               .length = d.length,
               .distance = trace_distance(&bench->trace, &bench->truth, 1, clip),
               .conduct = trace_conduct(&bench->trace, &bench->groom, clip),
               .truth_rms = truth_rms,
               .spread = MISSING,
               .us = one->is_converged ? MISSING : bench->us[d.model][2][stage_by_default(d.model)],
               .energy = MISSING,
               .stable_to_s2 = model_stiffness_bound(&d),
               .lost = bench->trace.lost};
    print(&row);
    return true;
}

static bool study_rod(Bench* bench, double damping, const Clip* clip, Fault* fault)
{
    double gamma = bench->groom.gamma;
    const double drag = (double)sim_default().drag_per_s;
    if (!trace_rods(&bench->truth, &bench->groom, ROD_LINKS, LINKS, damping, drag, ROD_STEPS, clip,
                    fault) ||
        !trace_rods(&bench->other, &bench->groom, ROD_LINKS / 2, LINKS, damping, drag,
                    ROD_STEPS / 2, clip, fault))
        return false;
    double truth_rms = trace_distance(&bench->other, &bench->truth, 1, clip).rms;
    Row rod = {.set = "rod",
               .model = "rod",
               .variant = "itself",
               .clip = clip->name,
               .gamma = gamma,
               .damping = damping,
               .substeps = ROD_STEPS,
               .distance = no_distance,
               .conduct = trace_conduct(&bench->truth, &bench->groom, clip),
               .truth_rms = truth_rms,
               .spread = MISSING,
               .us = MISSING,
               .energy = MISSING,
               .stable_to_s2 = MISSING};
    rod.conduct.stretch_mean = rod.conduct.stretch_max = MISSING; // chords of curves
    print(&rod);
    for (size_t i = 0; i < CONTENDERS; ++i)
        if (!contend(bench, &contenders[i], damping, clip, truth_rms, fault)) return false;
    return fflush(stdout) == 0;
}

static bool study_rods_of(Bench* bench, double gamma, double damping, Fault* fault)
{
    if (!groom_make(&bench->groom, gamma, fault)) return false;
    for (const Clip* clip = clips; clip->name != NULL; ++clip) {
        fprintf(stderr, "accuracy: rod, gamma %g, damping %g, %s\n", gamma, damping, clip->name);
        if (!study_rod(bench, damping, clip, fault)) return false;
    }
    return true;
}

static bool study_all_rods(Bench* bench, Fault* fault)
{
    return study_rods_of(bench, 10.0, 15.0, fault) && study_rods_of(bench, 50.0, 15.0, fault) &&
           study_rods_of(bench, 10.0, 8.0, fault);
}

// --- plain, which has no rod, against a finer chain

static bool study_chain(Bench* bench, double damping, const Clip* clip, Fault* fault)
{
    SimDefinition d = defaults(MODEL_PLAIN, damping);
    use_converged(&d, MODEL_SUBSTEPS, MODEL_SOLVES, MODEL_SWEEPS);
    if (!trace_simulate(&bench->truth, &solver_double, d, CHAIN_LINKS, 1, &bench->groom, clip,
                        fault) ||
        !trace_simulate(&bench->trace, &solver_double, d, LINKS, 1, &bench->groom, clip, fault))
        return false;
    Row row = {.set = "chain",
               .model = models[d.model].name,
               .variant = "converged",
               .clip = clip->name,
               .gamma = MISSING,
               .damping = damping,
               .substeps = d.substeps,
               .iterations = d.iterations,
               .length = d.length,
               .distance = trace_distance(&bench->trace, &bench->truth, CHAIN_LINKS / LINKS, clip),
               .truth_rms = MISSING,
               .spread = MISSING,
               .conduct = trace_conduct(&bench->trace, &bench->groom, clip),
               .us = MISSING,
               .energy = MISSING,
               .stable_to_s2 = MISSING};
    print(&row);
    return true;
}

static bool study_all_chains(Bench* bench, Fault* fault)
{
    for (size_t i = 0; i < DAMPINGS; ++i)
        for (const Clip* clip = clips; clip->name != NULL; ++clip)
            if (!study_chain(bench, (double)dampings[i], clip, fault)) return false;
    return true;
}

// --- energy

static bool study_energy(Bench* bench, Fault* fault)
{
    Row row = {.set = "energy",
               .variant = "",
               .clip = "kick",
               .gamma = MISSING,
               .distance = no_distance,
               .conduct = no_conduct,
               .truth_rms = MISSING,
               .spread = MISSING};
    for (int model = 0; model < MODEL_CASCADE_THESIS; ++model)
        for (int r = 0; r < RATES; ++r)
            for (int i = 0; i < STAGES; ++i) {
                if (!has_stage((ModelKind)model, i)) continue;
                SimDefinition d = defaults((ModelKind)model, 0.0);
                d.substeps = row.substeps = rates[r];
                use_stage(&d, i);
                row.iterations = d.iterations;
                row.length = d.length;
                row.stable_to_s2 = model_stiffness_bound(&d);
                row.model = models[model].name;
                row.us = bench->us[model][r][i];
                if (!energy_drift(d, &row.energy, &row.lost, fault)) return false;
                row.energy *= 100.0;
                print(&row);
            }
    return true;
}

bool study_accuracy(Fault* fault)
{
    static Bench bench; // large
    if (!groom_make(&bench.groom, GAMMA, fault)) return false;
    print_head();
    bool done = measure_cost(&bench, fault) && study_energy(&bench, fault) &&
                study_all_chains(&bench, fault) && study_truth(&bench, fault) &&
                study_all_numerical(&bench, fault) && study_all_rods(&bench, fault);
    trace_free(&bench.truth);
    trace_free(&bench.other);
    trace_free(&bench.trace);
    return done;
}
