// What hair-bench accuracy measures with: the clips as substeps, the groom, distances and conduct.
#include "tests/energy.h"
#include "tests/trace.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#define GAMMA 10.0
#define LINKS 7

// cmocka's own compares floats.
#define assert_near(a, b, tolerance)                                                               \
    do {                                                                                           \
        double got = (a), wanted = (b);                                                            \
        if (!(fabs(got - wanted) <= (tolerance))) fail_msg("%.9g is not %.9g", got, wanted);       \
    } while (0)

static const Clip* clip_named(const char* name)
{
    const Clip* clip = clips;
    while (strcmp(clip->name, name) != 0)
        ++clip;
    return clip;
}

static Groom groom_of_tests(void)
{
    Groom groom;
    Fault fault = {0};
    if (!groom_make(&groom, GAMMA, &fault)) fail_msg("%s", fault.text);
    return groom;
}

static size_t at(const Trace* trace, int tick, int strand, int node)
{
    return (size_t)((tick * trace->strands + strand) * trace->nodes + node);
}

// The groom over the clip, all of it moved by way(t), `late` seconds after.
static Trace swaying(const Groom* groom, const Clip* clip, Vec3d (*way)(double t), double late)
{
    Trace trace = {0};
    Fault fault = {0};
    assert_true(trace_prepare(&trace, clip_ticks(clip), GROOM_STRANDS, LINKS + 1, &fault));
    for (int tick = 0; tick <= trace.ticks; ++tick)
        for (int s = 0; s < GROOM_STRANDS; ++s) {
            Vec3d nodes[LINKS + 1], by = way((double)tick / CLIP_RATE_HZ - late);
            groom_nodes(groom, s, LINKS, nodes);
            for (int n = 0; n <= LINKS; ++n) {
                Vec3 node = vec3_from(vec3d_mad(nodes[n], by, n > 0 ? 1.0 : 0.0));
                trace.raw[at(&trace, tick, s, n)] = node;
                trace.published[at(&trace, tick, s, n)] = node;
            }
        }
    return trace;
}

static Vec3d nowhere(double t)
{
    (void)t;
    return (Vec3d){0, 0, 0};
}

static Vec3d aside(double t)
{
    (void)t;
    return (Vec3d){0.006 * GROOM_LENGTH_M, 0, -0.008 * GROOM_LENGTH_M};
}

static Vec3d to_and_fro(double t)
{
    double inside = t > 0.0 && t < 2.4 ? t : 0.0;
    return (Vec3d){0.05 * sin(2.0 * M_PI * 1.25 * inside), 0, 0};
}

static void what_is_moved_aside_is_off_by_as_much(void** state)
{
    (void)state;
    Groom groom = groom_of_tests();
    const Clip* clip = clip_named("turn");
    Trace truth = swaying(&groom, clip, nowhere, 0), trace = swaying(&groom, clip, aside, 0);
    Distance distance = trace_distance(&trace, &truth, 1, clip);
    assert_near(distance.rms, 0.01, 1e-7);
    assert_near(distance.raw_rms, 0.01, 1e-7);
    assert_near(distance.max, 0.01, 1e-7);
    assert_near(distance.motion_rms, 0.0, 1e-7);
    size_t tip = at(&trace, 5, 3, LINKS); // one node of all, once, 0.3 lengths away
    trace.published[tip] = vec3_add(truth.published[tip], vec3(0, 0.3f * (float)GROOM_LENGTH_M, 0));
    distance = trace_distance(&trace, &truth, 1, clip);
    double nodes = (double)(trace.ticks + 1) * GROOM_STRANDS * LINKS;
    assert_near(distance.max, 0.3, 1e-6);
    assert_near(distance.rms, sqrt((1e-4 * (nodes - 1) + 0.09) / nodes), 1e-7);
    trace_free(&truth);
    trace_free(&trace);
}

static void what_moves_later_lags(void** state)
{
    (void)state;
    static const double late[] = {0.0, 0.0417, -0.1, 0.2};
    Groom groom = groom_of_tests();
    const Clip* clip = clip_named("nod");
    Trace truth = swaying(&groom, clip, to_and_fro, 0.3);
    for (int i = 0; i < 4; ++i) {
        Trace trace = swaying(&groom, clip, to_and_fro, 0.3 + late[i]);
        assert_near(trace_distance(&trace, &truth, 1, clip).tip_lag_ms, 1e3 * late[i], 1.0);
        trace_free(&trace);
    }
    trace_free(&truth);
}

static void conduct_is_of_links_and_of_what_is_put_right(void** state)
{
    (void)state;
    Groom groom = groom_of_tests();
    const Clip* clip = clip_named("shake");
    Trace trace = swaying(&groom, clip, nowhere, 0);
    Vec3* tip = &trace.raw[at(&trace, 9, 0, LINKS)]; // strand 0 hangs: 3 mm of 40
    tip->y -= 0.003f;
    int rest = 3 * CLIP_RATE_HZ; // a second after the stop
    trace.published[at(&trace, rest, 2, 4)].z += 0.02f * (float)GROOM_LENGTH_M;
    trace.published[at(&trace, rest + 1, 2, 5)].z += 0.04f * (float)GROOM_LENGTH_M;
    trace.published[at(&trace, 20, 2, LINKS)].z += 0.5f * (float)GROOM_LENGTH_M;
    Conduct conduct = trace_conduct(&trace, &groom, clip);
    double links = (double)(trace.ticks + 1) * GROOM_STRANDS * LINKS;
    assert_near(conduct.stretch_max, 0.003 / 0.04, 1e-5);
    assert_near(conduct.stretch_mean, 0.003 / 0.04 / links, 1e-7);
    assert_near(conduct.rest, 0.02, 1e-6);
    assert_near(conduct.tip_peak, 0.5, 1e-6);
    assert_near(conduct.projection_max_m, 0.5 * GROOM_LENGTH_M, 1e-6);
    assert_near(conduct.projection_mean_m, (0.003 + 0.56 * GROOM_LENGTH_M) / links, 1e-8);
    trace_free(&trace);
}

// Straight hair under its weight: rods of any fineness are at rest in it, and stay.
static void a_rod_rests_in_the_groom_and_is_carried(void** state)
{
    (void)state;
    Groom groom = groom_of_tests();
    const Clip* clip = clip_named("teleport");
    Trace truth = swaying(&groom, clip, nowhere, 0), rods = {0};
    Fault fault = {0};
    if (!trace_rods(&rods, &groom, 42, LINKS, 8.0, 1.0, 1, clip, &fault))
        fail_msg("%s", fault.text);
    assert_true(trace_distance(&rods, &truth, 1, clip).max < 1e-3);
    assert_true(trace_conduct(&rods, &groom, clip).rest < 1e-6);
    trace_free(&truth);
    trace_free(&rods);
}

// The second differences add up to where the head is, but for jumps.
static void substeps_add_up_to_the_clip(void** state)
{
    (void)state;
    for (const Clip* clip = clips; clip->name != NULL; ++clip) {
        enum { SUBSTEPS = 4 };
        ClipReader reader = clip_begin(clip, SUBSTEPS);
        SimHead heads[SUBSTEPS];
        Vec3d move = {0, 0, clip->speed_m_s / (CLIP_RATE_HZ * SUBSTEPS)}, way = {0, 0, 0};
        for (int tick = 0; tick < clip_ticks(clip); ++tick) {
            clip_next(&reader, heads);
            for (int s = 0; s < SUBSTEPS; ++s) {
                move = vec3d_add(move, vec3d_from(heads[s].second_difference));
                way = vec3d_add(way, move);
            }
        }
        MotionState from = clip_at(clip, 0), to = clip_at(clip, clip->seconds);
        Vec3d gone = vec3d_sub(to.pose.position, from.pose.position);
        if (to.segment != from.segment) gone = (Vec3d){0, 0, 0}; // carried
        assert_near(sqrt(vec3d_dot(vec3d_sub(way, gone), vec3d_sub(way, gone))), 0.0, 1e-4);
        assert_near(sqrt(vec3d_dot(move, move)), clip->speed_m_s / (CLIP_RATE_HZ * SUBSTEPS), 1e-6);
    }
}

// Verlet keeps the energy of a forest, and of springs whose lengths nobody corrects; correcting
// lengths takes energy.
static void what_nothing_damps_keeps_its_energy(void** state)
{
    (void)state;
    static const struct {
        ModelKind model;
        int iterations;
        double least, most; // a second
    } cases[] = {{MODEL_FOREST, 1, -1e-3, 1e-3},
                 {MODEL_SPRING, 0, -1e-3, 1e-3},
                 {MODEL_SPRING, 1, -0.9, -0.1},
                 {MODEL_CASCADE, 1, -0.9, -0.1}};
    for (int i = 0; i < 4; ++i) {
        SimDefinition d = sim_default();
        Fault fault = {0};
        double drift = 0.0;
        int64_t lost = 0;
        d.model = cases[i].model;
        d.iterations = cases[i].iterations;
        if (!energy_drift(d, &drift, &lost, &fault)) fail_msg("%s", fault.text);
        print_message("model %d, %d iterations: %.6f a second\n", (int)d.model, d.iterations,
                      drift);
        assert_true(drift >= cases[i].least && drift <= cases[i].most);
        assert_int_equal(lost, 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_moved_aside_is_off_by_as_much),
        cmocka_unit_test(what_moves_later_lags),
        cmocka_unit_test(conduct_is_of_links_and_of_what_is_put_right),
        cmocka_unit_test(a_rod_rests_in_the_groom_and_is_carried),
        cmocka_unit_test(substeps_add_up_to_the_clip),
        cmocka_unit_test(what_nothing_damps_keeps_its_energy),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
