// What the failure maps of hair-bench stability rest on: their rules, and in short form those of
// their boundaries that test_models and test_printed_models do not hold.
#include "server/models.h"
#include "tests/maps.h"
#include "tests/modes.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define LINKS 7

// Rules -----------------------------------------------------------------------------------------

static Watch watched(SimDefinition d)
{
    Trial trial;
    trial_straight(&trial, LINKS, vec3(0, -1, 0));
    assert_true(trial_start(&trial, d));
    trial_kick(&trial);
    Watch watch = trial_watch(&trial);
    trial_end(&trial);
    return watch;
}

// The solver puts it back to rest, tick after tick: only its counter knows.
static void a_strand_that_was_lost_is_not_calm(void** state)
{
    (void)state;
    SimDefinition d = trial_bare(MODEL_SPRING, LINKS);
    d.stiffness_s2 = 3600 * 1000;
    Watch watch = watched(d);
    assert_string_equal(watch_class(&watch), "lost");
    assert_false(is_calm("lost"));
}

// A kick of 1 mm in 28 cm is not yet 1 %, so a strand without damping that only swings is calm,
// and one that grows is not, however little it has grown.
static void what_moves_more_at_the_end_flutters(void** state)
{
    (void)state;
    SimDefinition d = trial_bare(MODEL_SPRING, LINKS);
    d.stiffness_s2 = 100;
    d.damping_per_s = 0.05f;
    Watch watch = watched(d);
    assert_true(watch.away > 1e-3 && watch.away < TRIAL_AWAY);
    assert_string_equal(watch_class(&watch), "calm");
    watch.last = 1.01 * watch.first;
    assert_string_equal(watch_class(&watch), "flutter");
    watch.last = 0.0;
    watch.away = 1.01 * TRIAL_AWAY;
    assert_string_equal(watch_class(&watch), "flutter");
}

static void a_link_that_is_longer_by_a_tenth_is_stretched(void** state)
{
    (void)state;
    SimDefinition d = trial_bare(MODEL_PLAIN, LINKS);
    d.gravity_m_s2 = (float)TRIAL_GRAVITY; // 41 % with one sweep, 9.0 with four
    d.damping_per_s = 5;
    Watch watch = watched(d);
    assert_string_equal(watch_class(&watch), "stretched");
    assert_true(is_calm("stretched"));
    d.iterations = 4;
    watch = watched(d);
    assert_string_equal(watch_class(&watch), "calm");
}

// Map B -----------------------------------------------------------------------------------------

static bool is_cascade_calm(int fall_off, double k_dt2, bool has_gravity)
{
    SimDefinition d = trial_bare(MODEL_CASCADE, LINKS);
    d.stiffness_s2 = (float)(k_dt2 * 3600);
    d.damping_per_s = trial_damping(0.97);
    d.iterations = 8;
    d.fall_off_power = fall_off;
    d.gravity_m_s2 = has_gravity ? (float)TRIAL_GRAVITY : 0.0f;
    Watch watch = watched(d);
    return is_calm(watch_class(&watch));
}

static double cascade_edge(int fall_off, bool has_gravity)
{
    double low = 0.05, high = 2.0;
    for (int pass = 0; pass < 12; ++pass) {
        double middle = 0.5 * (low + high);
        *(is_cascade_calm(fall_off, middle, has_gravity) ? &low : &high) = middle;
    }
    return low;
}

// Hanging takes nothing off it: a link's tension is of the sweeps, which see the step's own end.
static void the_corrected_cascade_breaks_where_it_should_however_stiffness_falls(void** state)
{
    (void)state;
    for (int fall_off = 0; fall_off <= 2; ++fall_off) {
        double share[LINKS];
        SimDefinition d = sim_default();
        d.stiffness_s2 = 1;
        d.fall_off_power = fall_off;
        for (int i = 0; i < LINKS; ++i)
            share[i] = (double)model_stiffness(&d, (float)(TRIAL_LENGTH_M * i / LINKS));
        double wanted = 2 * 1.97 / modes_stiffest(MODEL_CASCADE, LINKS, share);
        double found = cascade_edge(fall_off, false), hanging = cascade_edge(fall_off, true);
        print_message("fall-off %d: k dt^2 %.4f, eigenvalues say %.4f; hanging %.4f\n", fall_off,
                      found, wanted, hanging);
        assert_true(fabs(found / wanted - 1) < 0.1);
        assert_true(hanging > 1.2 * found);
    }
}

// Maps D, H and I -------------------------------------------------------------------------------

static const Verdict* verdict_on(const Points* points, const char* panel)
{
    for (int i = 0; i < points->verdict_count; ++i)
        if (strcmp(points->verdicts[i].panel, panel) == 0) return &points->verdicts[i];
    fail_msg("nothing was judged on %s", panel);
    return NULL;
}

static void is_within(const Points* points, const char* panel, double limit)
{
    const Verdict* verdict = verdict_on(points, panel);
    print_message("%s, %s: %.2g at worst of %d\n", panel, verdict->what, verdict->worst,
                  verdict->count);
    assert_true(verdict->count > 0 && fabs(verdict->worst) < limit);
}

// cos^2 + sin^2 sin^2 of the push's azimuth and the rest angle; forward Euler is a step of 64
// behind, 3 %.
static void the_printed_joint_answers_by_the_squares_of_its_angles(void** state)
{
    (void)state;
    Points points = {0};
    map_azimuth(&points);
    assert_false(points.has_failed);
    is_within(&points, "forest-z", 0.035);
    is_within(&points, "forest", 0.01);
    free(points.all);
}

// Without the first millimetres of cascade's links, which gravity stretches.
static void a_tilted_strand_hangs_by_its_own_law(void** state)
{
    (void)state;
    Points points = {0};
    map_tilt(&points);
    assert_false(points.has_failed);
    is_within(&points, "spring", 1e-4);
    is_within(&points, "cascade", 0.01);
    is_within(&points, "forest", 1e-5);
    free(points.all);
}

// Where cos(bend) = -tan(azimuth)^2.
static void the_printed_frame_flips_where_it_should_and_ours_does_not(void** state)
{
    (void)state;
    Points points = {0};
    map_frames(&points);
    assert_false(points.has_failed);
    is_within(&points, "cascade-thesis", 0.01);
    is_within(&points, "cascade-thesis/length", 1e-5);
    is_within(&points, "cascade", 0.01); // degrees
    free(points.all);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_strand_that_was_lost_is_not_calm),
        cmocka_unit_test(what_moves_more_at_the_end_flutters),
        cmocka_unit_test(a_link_that_is_longer_by_a_tenth_is_stretched),
        cmocka_unit_test(the_corrected_cascade_breaks_where_it_should_however_stiffness_falls),
        cmocka_unit_test(the_printed_joint_answers_by_the_squares_of_its_angles),
        cmocka_unit_test(a_tilted_strand_hangs_by_its_own_law),
        cmocka_unit_test(the_printed_frame_flips_where_it_should_and_ours_does_not),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
