// A running simulation tuned: as if it had been made so, without a touch on its state.
#include "server/models.h"
#include "server/motion.h"
#include "server/sim.h"
#include "tests/allocations.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#define STRANDS  40
#define NODES    8
#define SUBSTEPS 4
#define ALL      (STRANDS * NODES)

static Vec3 rest[ALL], got[ALL], wanted[ALL], got_before[ALL], wanted_before[ALL];

static SimDefinition definition(ModelKind model)
{
    static const Collider head[] = {
        {{0.06f, -0.1f, 0.06f}, {0.06f, -0.1f, 0.06f}, 0.05f, BODY_HEAD}};
    for (int i = 0; i < ALL; ++i) {
        int s = i / NODES, n = i % NODES;
        rest[i] = vec3(0.003f * (float)s + 0.002f * (float)(n * n % 7), -0.04f * (float)n,
                       0.001f * (float)(s % 3 * n));
    }
    SimDefinition d = sim_default();
    d.model = model;
    d.strands = STRANDS;
    d.nodes = NODES;
    d.rest = rest;
    d.colliders = head;
    d.collider_count = 1;
    return d;
}

static SimDefinition tuned(SimDefinition d)
{
    d.stiffness_s2 = 250;
    d.damping_per_s = 3;
    d.drag_per_s = 2;
    d.iterations = 3;
    d.pearl_radius_m = 0.012f;
    return d;
}

static Sim* create(SimDefinition d)
{
    Fault fault = {0};
    Sim* sim = sim_create(&d, &fault);
    if (sim == NULL) fail_msg("%s", fault.text);
    return sim;
}

static void shake(Sim* sim, int ticks)
{
    for (int tick = 0; tick < ticks; ++tick) {
        SimHead heads[SUBSTEPS] = {0};
        for (int s = 0; s < SUBSTEPS; ++s) {
            double t = (tick * SUBSTEPS + s + 1) / 240.0;
            quat_matrix(heads[s].rotation, motion_find("shake")->at(t).pose.orientation);
            heads[s].wind = vec3(3, 0, 0);
        }
        sim_step(sim, heads);
    }
}

static bool are_alike(const Sim* a, const Sim* b)
{
    sim_state(a, got, got_before);
    sim_state(b, wanted, wanted_before);
    return memcmp(got, wanted, sizeof got) == 0 &&
           memcmp(got_before, wanted_before, sizeof got_before) == 0;
}

static void a_tuned_simulation_goes_on_as_one_that_was_made_so(void** state)
{
    (void)state;
    for (int model = 0; model < MODEL_COUNT; ++model) {
        SimDefinition from = definition((ModelKind)model), to = tuned(from);
        Sim *sim = create(from), *made = create(to), *untouched = create(from);
        assert_true(sim_tune(sim, &to, NULL));
        assert_true(sim_definition(sim)->stiffness_s2 == 250.0f);
        assert_true(are_alike(sim, untouched)); // until it is stepped
        shake(sim, 60);
        shake(made, 60);
        shake(untouched, 60);
        assert_true(are_alike(sim, made));
        assert_false(are_alike(sim, untouched));
        sim_destroy(sim);
        sim_destroy(made);
        sim_destroy(untouched);
    }
}

static void each_value_is_taken_for_itself(void** state)
{
    (void)state;
    SimDefinition from = definition(MODEL_SPRING), all = tuned(from), one[6];
    for (int i = 0; i < 6; ++i)
        one[i] = from;
    one[0].stiffness_s2 = all.stiffness_s2;
    one[1].damping_per_s = all.damping_per_s;
    one[2].drag_per_s = all.drag_per_s;
    one[3].iterations = all.iterations;
    one[4].pearl_radius_m = all.pearl_radius_m;
    one[5].gravity_m_s2 = 3;
    Sim* untouched = create(from);
    shake(untouched, 60);
    for (int i = 0; i < 6; ++i) {
        Sim* sim = create(from);
        assert_true(sim_tune(sim, &one[i], NULL));
        shake(sim, 60);
        if (are_alike(sim, untouched)) fail_msg("value %d changes nothing", i);
        sim_destroy(sim);
    }
    sim_destroy(untouched);
}

static void what_cannot_be_is_refused_whole(void** state)
{
    (void)state;
    SimDefinition from = definition(MODEL_FOREST), bad[6];
    static const char* const names[] = {"stiffness", "damping",    "drag",
                                        "gravity",   "iterations", "pearl"};
    for (int i = 0; i < 6; ++i)
        bad[i] = tuned(from);
    bad[0].stiffness_s2 = (float)(1.01 * model_stiffness_bound(&bad[0]));
    bad[1].damping_per_s = -1;
    bad[2].drag_per_s = NAN;
    bad[3].gravity_m_s2 = INFINITY;
    bad[4].iterations = -1;
    bad[5].pearl_radius_m = 2;
    Sim *sim = create(from), *untouched = create(from);
    for (int i = 0; i < 6; ++i) {
        Fault fault = {0};
        assert_false(sim_tune(sim, &bad[i], &fault));
        assert_non_null(strstr(fault.text, names[i]));
    }
    shake(sim, 60);
    shake(untouched, 60);
    assert_true(are_alike(sim, untouched));
    sim_destroy(sim);
    sim_destroy(untouched);
}

static float mean_height(Sim* sim)
{
    const float identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    float sum = 0.0f;
    sim_positions(sim, identity, false, got);
    for (int i = 0; i < ALL; ++i)
        sum += got[i].y - rest[i].y;
    return sum / ALL;
}

static void hair_made_for_gravity_rises_with_less_of_it(void** state)
{
    (void)state;
    for (int model = 0; model < MODEL_PLAIN; ++model) {
        SimDefinition d = definition((ModelKind)model);
        // Links that lean: along a strand that hangs plumb nothing can rise.
        for (int i = 0; i < ALL; ++i)
            rest[i] = vec3(0.003f * (float)(i / NODES) + 0.03f * (float)(i % NODES),
                           -0.026f * (float)(i % NODES), 0);
        d.collider_count = 0;
        // Too soft a joint under the weight that it carries curls up and stays so.
        d.fall_off_power = 0;
        d.stiffness_s2 = models[model].has_hinges ? 12000.0f : 1600.0f;
        Sim* sim = create(d);
        SimHead heads[SUBSTEPS] = {0};
        for (int s = 0; s < SUBSTEPS; ++s)
            heads[s] = (SimHead){.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
        for (int tick = 0; tick < 240; ++tick)
            sim_step(sim, heads);
        float before = mean_height(sim);
        SimDefinition wet = d;
        wet.gravity_m_s2 = 5;
        assert_true(sim_tune(sim, &wet, NULL));
        for (int tick = 0; tick < 240; ++tick)
            sim_step(sim, heads);
        float under_water = mean_height(sim);
        assert_true(sim_tune(sim, &d, NULL));
        for (int tick = 0; tick < 600; ++tick)
            sim_step(sim, heads);
        float after = mean_height(sim);
        print_message("%s: %.4f m, under water %.4f, after %.4f\n", models[model].name,
                      (double)before, (double)under_water, (double)after);
        assert_true(under_water > before + 0.001f);
        assert_true(fabsf(after - before) < 1e-4f);
        sim_destroy(sim);
    }
}

static void tuning_allocates_nothing(void** state)
{
    (void)state;
#if !COUNTS_ALLOCATIONS
    print_message("SKIPPED: AddressSanitizer owns malloc\n");
    skip();
#endif
    SimDefinition from = definition(MODEL_CASCADE), to = tuned(from);
    Sim* sim = create(from);
    allocations = 0;
    for (int i = 0; i < 20; ++i)
        assert_true(sim_tune(sim, i % 2 ? &from : &to, NULL));
    assert_int_equal(allocations, 0);
    sim_destroy(sim);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_tuned_simulation_goes_on_as_one_that_was_made_so),
        cmocka_unit_test(each_value_is_taken_for_itself),
        cmocka_unit_test(what_cannot_be_is_refused_whole),
        cmocka_unit_test(hair_made_for_gravity_rises_with_less_of_it),
        cmocka_unit_test(tuning_allocates_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
