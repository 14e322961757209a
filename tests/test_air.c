// The wind against closed forms, in every model; and that without one nothing changes.
#include "messages/trig.h"
#include "server/kernel.h"
#include "server/models.h"
#include "server/motion.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#define MOST_NODES 32
#define LENGTH_M   0.28
#define GRAVITY    9.81
#define SUBSTEPS   4
#define DT         (1.0 / (60.0 * SUBSTEPS))

// cmocka's own compares floats.
#define assert_near(a, b, tolerance)                                                               \
    do {                                                                                           \
        double got = (double)(a), wanted = (b);                                                    \
        if (!(fabs(got - wanted) <= (tolerance))) fail_msg("%.9g is not %.9g", got, wanted);       \
    } while (0)

// One strand that hangs straight down, with gravity in full and nothing that holds it up.
static SimDefinition hanging(ModelKind model, int nodes, Vec3* rest)
{
    for (int n = 0; n < nodes; ++n)
        rest[n] = vec3(0, (float)(-LENGTH_M * n / (nodes - 1)), 0);
    SimDefinition d = sim_default();
    d.model = model;
    d.strands = 1;
    d.nodes = nodes;
    d.rest = rest;
    d.stiffness_s2 = 0;
    d.fall_off_power = 0;
    d.gravity_compensation = false;
    return d;
}

static Sim* create(SimDefinition d)
{
    Fault fault = {0};
    Sim* sim = sim_create(&d, &fault);
    if (sim == NULL) fail_msg("%s", fault.text);
    return sim;
}

// A wind of `wind` about a head that moves at `velocity`, both m/s, steadily.
static void blow(Sim* sim, Vec3 wind, Vec3 velocity, int ticks)
{
    SimHead heads[SUBSTEPS] = {0};
    for (int s = 0; s < SUBSTEPS; ++s)
        heads[s] = (SimHead){.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                             .move = vec3_scale(velocity, (float)DT),
                             .wind = wind};
    for (int tick = 0; tick < ticks; ++tick)
        sim_step(sim, heads);
}

static Vec3 node(const Sim* sim, int n)
{
    Vec3 now[MOST_NODES], before[MOST_NODES];
    sim_state(sim, now, before);
    return now[n];
}

static void a_node_that_only_the_wind_moves_follows_its_closed_form(void** state)
{
    (void)state;
    Vec3 rest[2];
    SimDefinition d = hanging(MODEL_PLAIN, 2, rest);
    d.iterations = 0;
    d.gravity_m_s2 = 0;
    d.damping_per_s = 0;
    d.drag_per_s = 3;
    Sim* sim = create(d);
    for (int tick = 1; tick <= 120; ++tick) {
        blow(sim, vec3(8, 0, -2), vec3(0, 0, 0), 1);
        // Positions lag velocities by up to a substep.
        double t = tick / 60.0, way = t - (1.0 - exp(-3.0 * t)) / 3.0;
        assert_near(node(sim, 1).x, 8.0 * way, 8.0 * DT);
        assert_near(node(sim, 1).z, -2.0 * way, 2.0 * DT);
    }
    sim_destroy(sim);
}

// A chain without stiffness lies along what pulls at it: gravity down, the wind aside.
static void every_chain_leans_as_far_as_the_wind_is_stronger_than_gravity(void** state)
{
    (void)state;
    const ModelKind chains[] = {MODEL_PLAIN, MODEL_CASCADE, MODEL_FOREST};
    for (int k = 0; k < 3; ++k)
        for (int nodes = 2; nodes <= 32; nodes += 6) {
            Vec3 rest[MOST_NODES];
            SimDefinition d = hanging(chains[k], nodes, rest);
            d.iterations = 16;
            d.drag_per_s = 1;
            Sim* sim = create(d);
            blow(sim, vec3(8, 0, 0), vec3(0, 0, 0), 900);
            Vec3 tip = node(sim, nodes - 1);
            double tangent = 8.0 / GRAVITY;
            assert_near(-tip.x / tip.y, tangent, 0.005);
            assert_near(tip.x, LENGTH_M * tangent / sqrt(1.0 + tangent * tangent), 0.01);
            sim_destroy(sim);
        }
}

static void a_spring_gives_by_the_winds_pull_over_its_stiffness(void** state)
{
    (void)state;
    Vec3 rest[2];
    SimDefinition d = hanging(MODEL_SPRING, 2, rest);
    d.iterations = 0;
    d.stiffness_s2 = 400;
    d.drag_per_s = 2;
    Sim* sim = create(d);
    blow(sim, vec3(0, 0, 5), vec3(0, 0, 0), 600);
    // The share of a substep for the rate: 1 - exp(-2 dt) for 2 dt.
    double pull = 5.0 * (1.0 - exp(-2.0 * DT)) / DT;
    assert_near(node(sim, 1).z, pull / 400.0, 1e-5);
    sim_destroy(sim);
}

static void a_head_that_goes_with_the_wind_feels_none(void** state)
{
    (void)state;
    for (int model = 0; model < MODEL_COUNT; ++model) {
        if (model == MODEL_FOREST_Z) continue; // as printed it knows no wind
        Vec3 rest[8];
        SimDefinition d = hanging((ModelKind)model, 8, rest);
        Sim *with = create(d), *against = create(d);
        blow(with, vec3(3.5f, 0, 0), vec3(3.5f, 0, 0), 120);
        blow(against, vec3(3.5f, 0, 0), vec3(-3.5f, 0, 0), 120);
        assert_near(node(with, 7).x, 0.0, 1e-5);
        assert_true(node(against, 7).x > 0.05f);
        sim_destroy(with);
        sim_destroy(against);
    }
}

// Blown for 5 s it lies still in the wind, and hangs still 15 s after it.
static void weather(SimDefinition d, float wind)
{
    int tip = d.nodes - 1;
    d.stiffness_s2 = (float)fmin(0.99 * model_stiffness_bound(&d), 1000.0);
    Sim* sim = create(d);
    for (int blows = 1; blows >= 0; --blows) {
        Vec3 air = vec3(blows ? wind : 0, 0, 0);
        blow(sim, air, vec3(0, 0, 0), blows ? 300 : 900);
        Vec3 before = node(sim, tip);
        blow(sim, air, vec3(0, 0, 0), 1);
        Vec3 now = node(sim, tip);
        float moved = vec3_length(vec3_sub(now, before));
        if (!vec3_finite(now) || moved > 1e-3f || (blows ? now.x <= 0.0f : fabsf(now.x) > 0.05f))
            fail_msg("%s, %d nodes, drag %g, %s: tip at %g, moved by %g", models[d.model].name,
                     d.nodes, (double)d.drag_per_s, blows ? "blown" : "after", (double)now.x,
                     (double)moved);
    }
    sim_destroy(sim);
}

static void a_gale_is_weathered_at_any_drag_and_length(void** state)
{
    (void)state;
    for (int model = 0; model < MODEL_FOREST_Z; ++model) // that one knows no wind
        for (int nodes = 2; nodes <= 32; nodes += 15)
            for (float drag = 1; drag <= 1e4f; drag *= 3.16f) {
                Vec3 rest[MOST_NODES];
                SimDefinition d = hanging((ModelKind)model, nodes, rest);
                d.drag_per_s = drag;
                d.iterations = 4;
                // A forest flutters under any load of N links beyond 2 d / (N dt^2): server/README.
                double links = nodes - 1, pull = (1.0 - exp(-(double)drag * DT)) / DT;
                double most = 2.0 * LENGTH_M / (links * links * DT * DT);
                if (model != MODEL_FOREST)
                    weather(d, 100);
                else if (pull < 0.8 * most)
                    weather(d, 1);
            }
}

// A node on a spring 1 % below the bound comes to rest in the wind; 10 % above it does not.
static void the_bound_of_stiffness_counts_the_drag(void** state)
{
    (void)state;
    for (int over = 0; over < 2; ++over) {
        Vec3 rest[2];
        SimDefinition d = hanging(MODEL_SPRING, 2, rest);
        d.iterations = 0;
        d.drag_per_s = 200;
        d.force = true;
        d.stiffness_s2 = (float)((over ? 1.1 : 0.99) * model_stiffness_bound(&d));
        Sim* sim = create(d);
        blow(sim, vec3(5, 0, 0), vec3(0, 0, 0), 600);
        bool is_calm = fabsf(node(sim, 1).x) < 0.1f && sim_quarantined(sim) == 0;
        assert_int_equal(is_calm, !over);
        sim_destroy(sim);
    }
}

// Under "shake", where nothing blows.
static void shaken(SimDefinition d, Vec3* positions)
{
    Sim* sim = create(d);
    for (int tick = 0; tick < 60; ++tick) {
        SimHead heads[SUBSTEPS] = {0};
        for (int s = 0; s < SUBSTEPS; ++s) {
            double t = (tick * SUBSTEPS + s) * DT;
            Pose now = motion_find("shake")->at(t).pose;
            quat_matrix(heads[s].rotation, now.orientation);
            heads[s].move = vec3(0.01f, 0, (float)t);
            heads[s].second_difference = vec3(1e-4f * (float)(s - 2), 0, 0);
        }
        sim_step(sim, heads);
    }
    Vec3 previous[MOST_NODES];
    sim_state(sim, positions, previous);
    sim_destroy(sim);
}

static void without_a_wind_drag_changes_no_bit(void** state)
{
    (void)state;
    for (int model = 0; model < MODEL_COUNT; ++model) {
        Vec3 rest[8], without[8], with[8];
        SimDefinition d = hanging((ModelKind)model, 8, rest);
        d.drag_per_s = 0;
        shaken(d, without);
        d.drag_per_s = 100;
        shaken(d, with);
        assert_memory_equal(without, with, sizeof with);
        assert_true(fabsf(with[7].x) > 1e-3f);
    }
}

static void a_breeze_is_no_jolt(void** state)
{
    (void)state;
    // A runner at 3.5 m/s: the air that stands still must not begin to drag at once when it stirs.
    double tips[3];
    for (int k = 0; k < 3; ++k) {
        Vec3 rest[8];
        Sim* sim = create(hanging(MODEL_PLAIN, 8, rest));
        blow(sim, vec3(0.02f * (float)k, 0, 0), vec3(3.5f, 0, 0), 300);
        tips[k] = (double)node(sim, 7).x;
        sim_destroy(sim);
    }
    assert_near(tips[0], 0.0, 1e-6);
    assert_near(tips[1], 0.0, 1e-4);
    assert_near(tips[2], 0.0, 1e-3);
}

static void every_kernel_gives_the_same_bits_in_a_wind(void** state)
{
    (void)state;
    static const char* const names[] = {"scalar", "sse2", "avx2", "avx512"};
    for (int model = 0; model < MODEL_COUNT; ++model) {
        Vec3 rest[8], wanted[8] = {{0, 0, 0}}, got[8], previous[8];
        for (int i = 0; i < 4; ++i) {
            if (kernel_find(names[i]) == NULL) {
                print_message("SKIPPED: no %s here\n", names[i]);
                continue;
            }
            SimDefinition d = hanging((ModelKind)model, 8, rest);
            d.kernel = names[i];
            d.stiffness_s2 = 100;
            Sim* sim = create(d);
            blow(sim, vec3(3, 0.7f, -1.3f), vec3(0.1f, 0, 0.9f), 120);
            sim_state(sim, got, previous);
            sim_destroy(sim);
            if (i == 0) memcpy(wanted, got, sizeof wanted);
            assert_memory_equal(got, wanted, sizeof got);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_node_that_only_the_wind_moves_follows_its_closed_form),
        cmocka_unit_test(every_chain_leans_as_far_as_the_wind_is_stronger_than_gravity),
        cmocka_unit_test(a_spring_gives_by_the_winds_pull_over_its_stiffness),
        cmocka_unit_test(a_head_that_goes_with_the_wind_feels_none),
        cmocka_unit_test(a_gale_is_weathered_at_any_drag_and_length),
        cmocka_unit_test(the_bound_of_stiffness_counts_the_drag),
        cmocka_unit_test(without_a_wind_drag_changes_no_bit),
        cmocka_unit_test(a_breeze_is_no_jolt),
        cmocka_unit_test(every_kernel_gives_the_same_bits_in_a_wind),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
