// A strand that is lost comes back to rest, and no other strand notices.
#include "server/models.h"
#include "server/motion.h"
#include "server/strands.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#define STRANDS  40 // a whole block and a part of one
#define NODES    8
#define SUBSTEPS 4
#define ALL      (STRANDS * NODES)

static Vec3 rest[ALL], got[ALL], wanted[ALL], got_before[ALL], wanted_before[ALL];

static Sim* create(ModelKind model, float stiffness_s2)
{
    for (int i = 0; i < ALL; ++i)
        rest[i] = vec3(0.003f * (float)(i / NODES), -0.04f * (float)(i % NODES), 0.01f);
    SimDefinition d = sim_default();
    d.model = model;
    d.strands = STRANDS;
    d.nodes = NODES;
    d.rest = rest;
    d.stiffness_s2 = stiffness_s2;
    d.force = true;
    Fault fault = {0};
    Sim* sim = sim_create(&d, &fault);
    if (sim == NULL) fail_msg("%s", fault.text);
    return sim;
}

static void shake(Sim* sim, int tick)
{
    SimHead heads[SUBSTEPS] = {0};
    for (int s = 0; s < SUBSTEPS; ++s)
        quat_matrix(heads[s].rotation,
                    motion_find("shake")->at((tick * SUBSTEPS + s + 1) / 240.0).pose.orientation);
    sim_step(sim, heads);
}

static bool is_at_rest(const Sim* sim, int strand)
{
    for (int n = 0; n < NODES; ++n) {
        Vec3 at = rotate(sim->bodies[BODY_HEAD].rotation, rest[strand * NODES + n]);
        if (vec3_length(vec3_sub(got[strand * NODES + n], at)) > 1e-6f ||
            vec3_length(vec3_sub(got_before[strand * NODES + n], at)) > 1e-6f)
            return false;
    }
    return true;
}

// Not forest-z: its places follow from its angles, so that a broken one mends itself.
// Breaks one number of `strand` in one of two alike: in the current positions, or in those before.
static void lose(ModelKind model, int strand, float value, bool before)
{
    Sim *broken = create(model, 1600), *whole = create(model, 1600);
    for (int tick = 0; tick < 60; ++tick) {
        if (tick == 20) {
            Block* block = &broken->blocks[strand / LANES];
            Lanes3* nodes = before ? block->previous : block->position;
            nodes[5].y[strand % LANES] = value;
        }
        shake(broken, tick);
        shake(whole, tick);
        sim_state(broken, got, got_before);
        sim_state(whole, wanted, wanted_before);
        assert_int_equal(sim_quarantined(broken), tick < 20 ? 0 : 1);
        if (tick == 20) assert_true(is_at_rest(broken, strand));
        if (tick >= 20)
            for (int n = 0; n < NODES; ++n) {
                int i = strand * NODES + n;
                assert_true(vec3_finite(got[i]));
                got[i] = wanted[i];
                got_before[i] = wanted_before[i];
            }
        assert_memory_equal(got, wanted, sizeof got);
        assert_memory_equal(got_before, wanted_before, sizeof got_before);
    }
    assert_int_equal(sim_quarantined(whole), 0);
    sim_destroy(broken);
    sim_destroy(whole);
}

static void a_lost_strand_is_put_back_and_the_others_keep_their_bits(void** state)
{
    (void)state;
    for (int model = 0; model < MODEL_FOREST_Z; ++model) {
        lose((ModelKind)model, 3, NAN, false);
        lose((ModelKind)model, 33, INFINITY, false);
        lose((ModelKind)model, 33, NAN, true);
    }
    lose(MODEL_SPRING, 0, 3000.0f, false);
    lose(MODEL_SPRING, 7, -1e30f, false);
}

static void lanes_that_repeat_the_last_strand_are_not_counted(void** state)
{
    (void)state;
    Sim* sim = create(MODEL_SPRING, 1600);
    for (int l = (STRANDS - 1) % LANES; l < LANES; ++l)
        sim->blocks[1].position[5].y[l] = NAN;
    shake(sim, 0);
    assert_int_equal(sim_quarantined(sim), 1);
    for (int l = 0; l < LANES; ++l)
        assert_true(isfinite(sim->blocks[1].position[5].y[l]));
    sim_destroy(sim);
}

static void hair_within_a_kilometre_is_left_alone(void** state)
{
    (void)state;
    Sim* sim = create(MODEL_PLAIN, 0);
    SimHead heads[SUBSTEPS] = {0};
    for (int s = 0; s < SUBSTEPS; ++s)
        heads[s] = (SimHead){.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    heads[0].second_difference = vec3(-900, 0, 0); // a head that jumps by 900 m leaves its hair
    heads[1].second_difference = vec3(900, 0, 0);
    sim_step(sim, heads);
    assert_int_equal(sim_quarantined(sim), 0);
    sim_state(sim, got, got_before);
    assert_true(got[NODES - 1].x > 1.0f);
    heads[0].second_difference = vec3(-9e5f, 0, 0);
    heads[1].second_difference = vec3(9e5f, 0, 0);
    sim_step(sim, heads);
    assert_int_equal(sim_quarantined(sim), STRANDS);
    sim_destroy(sim);
}

static void a_model_that_explodes_stays_finite(void** state)
{
    (void)state;
    for (int model = 0; model < MODEL_PLAIN; ++model) {
        Sim* sim = create((ModelKind)model, 1e8f);
        for (int tick = 0; tick < 120; ++tick) {
            shake(sim, tick);
            sim_state(sim, got, got_before);
            for (int i = 0; i < ALL; ++i)
                assert_true(vec3_length(got[i]) <= 1000.0f);
        }
        sim_destroy(sim);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_lost_strand_is_put_back_and_the_others_keep_their_bits),
        cmocka_unit_test(lanes_that_repeat_the_last_strand_are_not_counted),
        cmocka_unit_test(hair_within_a_kilometre_is_left_alone),
        cmocka_unit_test(a_model_that_explodes_stays_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
