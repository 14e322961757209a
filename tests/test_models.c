// Every model on a strand without a head, against closed forms, tables and its own law: the
// daemon's code, in float (test_models) and the same text in double (test_models_double).
#include "messages/vec.h"
#include "server/kernel.h"
#include "server/models.h"
#include "tests/modes.h"
#include "tests/strand.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#ifdef SIM_DOUBLE
#define FOREST_TOLERANCE 1e-4
#else
#define FOREST_TOLERANCE 1e-3
#endif
#define CASCADE_TOLERANCE 1e-3 // of its law
#define BEAM_TOLERANCE    1e-4 // of the table, where sin is the angle

// Statics ---------------------------------------------------------------------------------------

// A horizontal strand that sags to rest: how far down (height) and out (width) its tip comes. The
// steps are as long as half the stability bound allows: float resolves no force over a shorter one.
static void sag(SimDefinition d, int links, double* height, double* width)
{
    Strand strand;
    straight(&strand, links, vec3(1, 0, 0));
    d.tip_mass = 0.5f;
    d.damping_per_s = 25;
    d.iterations = 32;
    d.substeps = 8;
    while (2.0 * (double)d.stiffness_s2 > model_stiffness_bound(&d) && d.substeps < MAX_SUBS)
        d.substeps += 8;
    while (2.0 * (double)d.stiffness_s2 > model_stiffness_bound(&d))
        d.rate_hz *= 2;
    start(&strand, d);
    run(&strand, (int)d.rate_hz * 12);
    Vec3 tip = node(&strand, links);
    *height = -(double)tip.y;
    *width = (double)tip.x;
    sim_destroy(strand.sim);
}

// tables/hinge_chain_static.csv: H/W of N links, root 2 EI/d, half tip mass.
static const struct {
    double gamma;
    int links;
    double h_over_w;
} hinge_chain[] = {
    {0.1, 7, 0.0127546454}, {0.1, 16, 0.0125483797}, {1, 7, 0.12710294},   {1, 16, 0.125048075},
    {10, 7, 1.09202414},    {10, 16, 1.07154755},    {100, 7, 6.71532899},
};
#define CHAINS (sizeof hinge_chain / sizeof hinge_chain[0])

static void forest_sags_as_the_hinge_chain(void** state)
{
    (void)state;
    for (size_t i = 0; i < CHAINS; ++i) {
        SimDefinition d = bare(MODEL_FOREST, hinge_chain[i].links);
        double height, width;
        d.stiffness_s2 = hinge_stiffness(hinge_chain[i].gamma, hinge_chain[i].links);
        sag(d, hinge_chain[i].links, &height, &width);
        double error = height / width / hinge_chain[i].h_over_w - 1.0;
        print_message("forest, Gamma %g, %d links: H/W %.8g, off by %.1e\n", hinge_chain[i].gamma,
                      hinge_chain[i].links, height / width, error);
        assert_near(error, 0.0, FOREST_TOLERANCE);
    }
}

// The chain with moments K sin(phi) in its joints, k = K / d^2 over the mass of a node: the angle
// at the tip that makes the root horizontal, by bisection. False where no shape is in equilibrium.
static bool sine_chain(double k, int links, double* height, double* width)
{
    double d = LENGTH_M / links, low = 0.0, high = 1.5707963;
    for (int pass = 0; pass < 100; ++pass) {
        double angle = 0.5 * (low + high), load = 0.0, moment = 0.0;
        bool is_folded = false;
        *height = *width = 0.0;
        for (int n = links; n >= 1; --n) {
            load += n == links ? 0.5 : 1.0; // outboard of joint n, in g m
            moment += load * GRAVITY * d * cos(angle);
            *height += d * sin(angle);
            *width += d * cos(angle);
            double sine = moment / ((n == 1 ? 2.0 : 1.0) * k * d * d);
            is_folded |= sine > 1.0;
            angle -= asin(fmin(sine, 1.0));
        }
        if (angle < 0.0 || is_folded)
            low = 0.5 * (low + high); // steeper, for less of a lever
        else
            high = 0.5 * (low + high);
    }
    return high < 1.57;
}

static void cascade_sags_by_its_own_law(void** state)
{
    (void)state;
    static const double gammas[] = {0.1, 1, 5, 10};
    for (size_t i = 0; i < sizeof gammas / sizeof gammas[0]; ++i) {
        SimDefinition d = bare(MODEL_CASCADE, 7);
        double height, width, h, w;
        d.stiffness_s2 = hinge_stiffness(gammas[i], 7);
        assert_true(sine_chain((double)d.stiffness_s2, 7, &h, &w));
        sag(d, 7, &height, &width);
        double error = height / width / (h / w) - 1.0;
        print_message("cascade, Gamma %g: H/W %.8g, its law %.8g, off by %.1e\n", gammas[i],
                      height / width, h / w, error);
        assert_near(error, 0.0, CASCADE_TOLERANCE);
    }
}

static void cascade_is_the_beam_where_it_bends_little(void** state)
{
    (void)state;
    SimDefinition d = bare(MODEL_CASCADE, 7);
    double height, width;
    d.stiffness_s2 = hinge_stiffness(0.1, 7);
    sag(d, 7, &height, &width);
    print_message("cascade, Gamma 0.1: off the table by %.1e\n", height / width / 0.0127546454 - 1);
    assert_near(height / width / 0.0127546454, 1.0, BEAM_TOLERANCE);
}

static void spring_sags_by_g_m_over_k(void** state)
{
    (void)state;
    SimDefinition d = bare(MODEL_SPRING, 1);
    Strand strand;
    straight(&strand, 1, vec3(1, 0, 0));
    d.iterations = 0; // no link: the node and its spring
    d.stiffness_s2 = 981;
    d.damping_per_s = 60;
    d.substeps = 4;
    start(&strand, d);
    run(&strand, 300);
    assert_near(node(&strand, 1).y, -0.01, 1e-5);
    sim_destroy(strand.sim);
}

// One sweep a step leaves link n longer by (N - n) g dt^2 / d of itself, counting nodes outboard.
static void one_sweep_leaves_the_stretch_of_the_closed_form(void** state)
{
    (void)state;
    SimDefinition d = bare(MODEL_PLAIN, 7);
    Strand strand;
    straight(&strand, 7, vec3(0, -1, 0));
    d.substeps = 1;
    d.damping_per_s = 5;
    start(&strand, d);
    run(&strand, 60 * 20);
    double link = LENGTH_M / 7, dt = 1.0 / 60.0;
    for (int n = 1; n < 7; ++n) {
        double length = (double)(node(&strand, n - 1).y - node(&strand, n).y);
        double wanted = (7 - n) * GRAVITY * dt * dt / link;
        print_message("link %d: stretched by %.4f, wanted %.4f\n", n, length / link - 1, wanted);
        assert_near((length / link - 1.0) / wanted, 1.0, 0.01);
    }
    sim_destroy(strand.sim);
}

// Swings ----------------------------------------------------------------------------------------

// Period of the tip's x, from its crossings of zero, interpolated between ticks.
static double period_of(Strand* strand, double tick_s, int crossings)
{
    double before = (double)node(strand, strand->links).x, first = 0.0, last = 0.0;
    int seen = 0;
    for (int tick = 1; seen < crossings && tick < 1000000; ++tick) {
        run(strand, 1);
        double x = (double)node(strand, strand->links).x;
        if (before * x < 0.0) {
            last = (tick - x / (x - before)) * tick_s;
            if (seen++ == 0) first = last;
        }
        before = x;
    }
    assert_int_equal(seen, crossings);
    return 2.0 * (last - first) / (crossings - 1);
}

// tables/heavy_chain_frequencies.csv, column N7_equal: omega / sqrt(g/L).
static const double heavy_chain[] = {1.162456767, 2.680793589, 4.239709567};

// A mode's shape by marching down from the root: m w^2 x_n = what the two links pull.
static void shape_of_mode(double* x, double omega_l_over_g, int links)
{
    double w2 = omega_l_over_g * omega_l_over_g / links; // in g/d
    x[0] = 0.0;
    x[1] = 1.0;
    for (int n = 1; n < links; ++n) {
        double above = links - n + 1, below = links - n;
        x[n + 1] = x[n] + (above * (x[n] - x[n - 1]) - w2 * x[n]) / below;
    }
}

static void plain_swings_in_the_heavy_chains_modes(void** state)
{
    (void)state;
    for (int mode = 0; mode < 3; ++mode) {
        SimDefinition d = bare(MODEL_PLAIN, 7);
        Strand strand = {.links = 7};
        double x[8], most = 0.0, link = LENGTH_M / 7;
        shape_of_mode(x, heavy_chain[mode], 7);
        for (int n = 0; n <= 7; ++n)
            most = fmax(most, fabs(x[n]));
        strand.rest[0] = vec3(0, 0, 0);
        for (int n = 1; n <= 7; ++n) {
            double dx = 0.002 * LENGTH_M * (x[n] - x[n - 1]) / most;
            strand.rest[n] = vec3_add(strand.rest[n - 1],
                                      vec3((float)dx, (float)-sqrt(link * link - dx * dx), 0));
        }
        d.rate_hz = 240;
        d.substeps = 16;
        d.iterations = 32;
        start(&strand, d);
        double period = period_of(&strand, 1.0 / 240, 9);
        double wanted = 2 * 3.14159265358979 / (heavy_chain[mode] * sqrt(GRAVITY / LENGTH_M));
        print_message("mode %d: %.5f s, wanted %.5f\n", mode + 1, period, wanted);
        assert_near(period / wanted, 1.0, 0.005);
        sim_destroy(strand.sim);
    }
}

// tables/pendulum_period.csv: 1.07318200715 times 2 pi sqrt(L/g) at 60 degrees.
static void a_link_is_the_pendulum(ModelKind model)
{
    SimDefinition d = bare(model, 1);
    Strand strand;
    double half = 3.14159265358979 / 3;
    straight(&strand, 1, vec3((float)sin(half), (float)-cos(half), 0));
    d.rate_hz = 240;
#ifndef SIM_DOUBLE
    d.substeps = 4;
#endif
    d.stiffness_s2 = 0;
    start(&strand, d);
    double period = period_of(&strand, 1.0 / 240, 9);
    double wanted = 1.07318200715 * 2 * 3.14159265358979 * sqrt(LENGTH_M / GRAVITY);
    print_message("%s: %.6f s, wanted %.6f\n", models[model].name, period, wanted);
    assert_near(period / wanted, 1.0, 0.001);
    sim_destroy(strand.sim);
}

static void plain_forest_and_cascade_of_one_link_are_the_pendulum(void** state)
{
    (void)state;
    a_link_is_the_pendulum(MODEL_FOREST);
#ifdef SIM_DOUBLE
    // Lengths corrected after the step damp a little, in proportion to it: 0.07 % of the period at
    // 15 kHz, where float resolves nothing any more.
    a_link_is_the_pendulum(MODEL_PLAIN);
    a_link_is_the_pendulum(MODEL_CASCADE);
#endif
}

// Thesis 4.4: k_m falls with the tilt to `share` of k, and as much of the weight is not carried.
static void a_tilted_spring_is_weaker_and_sags(void** state)
{
    (void)state;
    const double share = 0.25, k = 400;
    for (int degrees = 0; degrees <= 180; degrees += 45) {
        double angle = degrees * M_PI / 180, strength = share + (1 - share) * (1 + cos(angle)) / 2;
        Strand strand;
        straight(&strand, 1, vec3(0, 1, 0));
        SimDefinition d = bare(MODEL_SPRING, 1);
        d.gravity_compensation = true;
        d.upside_down_share = (float)share;
        d.stiffness_s2 = (float)k;
        d.iterations = 0; // no link: the node and its spring
        d.damping_per_s = 20;
        d.substeps = 4;
        start(&strand, d);
        float c = (float)cos(angle), n = (float)sin(angle);
        SimHead heads[MAX_SUBS] = {0};
        for (int s = 0; s < strand.substeps; ++s)
            memcpy(heads[s].rotation, (float[9]){c, -n, 0, n, c, 0, 0, 0, 1}, sizeof identity);
        for (int i = 0; i < 600; ++i)
            sim_step(strand.sim, heads);
        assert_near(node(&strand, 1).x, -LENGTH_M * sin(angle), 1e-5);
        double sag = GRAVITY * (1 - strength) / (strength * k);
        assert_near(node(&strand, 1).y, LENGTH_M * cos(angle) - sag, 1e-4 * sag + 1e-5);
        sim_destroy(strand.sim);
    }
}

#ifdef SIM_DOUBLE
// Does a node on a spring of `k` cross its rest place after a push? Without oscillating it comes
// back iff k dt^2 <= (1 - sqrt c)^2.
static bool overshoots(double k, double damping)
{
    SimDefinition d = bare(MODEL_SPRING, 1);
    Strand strand;
    straight(&strand, 1, vec3(0, -1, 0));
    d.iterations = 0;
    d.gravity_m_s2 = 0;
    d.substeps = 1;
    d.damping_per_s = (float)damping;
    d.stiffness_s2 = (float)k;
    start(&strand, d);
    SimHead head = {.second_difference = vec3(-0.01f, 0, 0)};
    memcpy(head.rotation, identity, sizeof identity);
    sim_step(strand.sim, &head);
    bool has_crossed = false;
    for (int tick = 0; tick < 600; ++tick) {
        run(&strand, 1);
        has_crossed |= node(&strand, 1).x < 0;
    }
    sim_destroy(strand.sim);
    return has_crossed;
}

static void spring_is_critically_damped_where_it_should(void** state)
{
    (void)state;
    for (double damping = 10; damping <= 40; damping *= 2) {
        double critical = 3600 * pow(1 - sqrt(exp(-damping / 60)), 2);
        assert_false(overshoots(0.995 * critical, damping));
        assert_true(overshoots(1.01 * critical, damping));
    }
}
#endif

// A push of the head turns every link by h / d where it acts on the tip alone, and by as many times
// that as there are links from it to the tip where it acts on all.
static void the_head_pushes_the_forests_tips(void** state)
{
    (void)state;
    const double push = 1e-5;
    for (int on_all = 0; on_all < 2; ++on_all) {
        SimDefinition d = bare(MODEL_FOREST, 7);
        Strand strand;
        straight(&strand, 7, vec3(0, -1, 0));
        d.substeps = 1;
        d.gravity_m_s2 = 0;
        d.stiffness_s2 = 0;
        d.outermost = on_all ? false : sim_default().outermost;
        start(&strand, d);
        SimHead head = {.second_difference = vec3((float)-push, 0, 0)};
        memcpy(head.rotation, identity, sizeof identity);
        sim_step(strand.sim, &head);
        double way = 0.0;
        for (int n = 1; n <= 7; ++n) {
            way += push * (on_all ? 8 - n : 1);
            assert_near(node(&strand, n).x, way, 1e-3 * way);
        }
        sim_destroy(strand.sim);
    }
}

// Stability -------------------------------------------------------------------------------------

// Does a push of a thousandth of its length grow?
static bool is_stable(ModelKind model, int links, float k, float damping)
{
    SimDefinition d = bare(model, links);
    Strand strand;
    straight(&strand, links, vec3(0, -1, 0));
    d.substeps = 1;
    d.iterations = model == MODEL_SPRING ? 0 : 4;
    d.gravity_m_s2 = 0;
    d.damping_per_s = damping;
    d.stiffness_s2 = k;
    d.force = true;
    start(&strand, d);
    SimHead head = {.second_difference = vec3(2e-6f * (float)LENGTH_M, 0, 0)};
    memcpy(head.rotation, identity, sizeof identity);
    sim_step(strand.sim, &head);
    run(&strand, 600);
    double most = 0.0;
    for (int tick = 0; tick < 60; ++tick) {
        run(&strand, 1);
        for (int n = 1; n <= links; ++n) {
            double x = fabs((double)node(&strand, n).x);
            most = x > most || !isfinite(x) ? x : most;
        }
    }
    bool was_lost = sim_quarantined(strand.sim) > 0; // and put back, where it looks calm
    sim_destroy(strand.sim);
    return !was_lost && most < 1e-3 * LENGTH_M;
}

// Where it begins to grow, in k dt^2, by bisection.
static double boundary_of(ModelKind model, int links, float damping)
{
    double low = 0.01, high = 5.0;
    for (int pass = 0; pass < 14; ++pass) {
        double middle = 0.5 * (low + high);
        bool stable = is_stable(model, links, (float)(middle * 3600.0), damping);
        *(stable ? &low : &high) = middle;
    }
    return 0.5 * (low + high);
}

static void each_model_breaks_where_its_eigenvalues_say(void** state)
{
    (void)state;
    static const struct {
        ModelKind model;
        int links;
    } cases[] = {{MODEL_SPRING, 1},
                 {MODEL_CASCADE, 7},
                 {MODEL_CASCADE, 15},
                 {MODEL_FOREST, 7},
                 {MODEL_FOREST, 15}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i)
        for (int damped = 0; damped < 2; ++damped) {
            float damping = damped ? 30.0f : 2.0f;
            double c = exp(-(double)damping / 60.0);
            double wanted = 2 * (1 + c) / modes_stiffest(cases[i].model, cases[i].links, NULL);
            double found = boundary_of(cases[i].model, cases[i].links, damping);
            print_message("%s, %d links, c %.3f: k dt^2 %.4f, eigenvalues say %.4f\n",
                          models[cases[i].model].name, cases[i].links, c, found, wanted);
            assert_near(found / wanted, 1.0, 0.03);
        }
}

static void the_bound_that_is_refused_is_on_the_safe_side_and_near(void** state)
{
    (void)state;
    for (int model = 0; model < MODEL_PLAIN; ++model) {
        SimDefinition d = bare((ModelKind)model, 7);
        Fault fault = {0};
        Strand strand;
        straight(&strand, 7, vec3(0, -1, 0));
        d.rest = strand.rest;
        double bound = model_stiffness_bound(&d);
        double modes = modes_stiffest((ModelKind)model, 7, NULL), steps = d.rate_hz * d.substeps;
        double exact = 4.0 * steps * steps / modes;
        print_message("%s: refused from %.0f, breaks at %.0f\n", models[model].name, bound, exact);
        assert_true(bound <= exact * 1.0001 && bound > 0.8 * exact);
        d.stiffness_s2 = (float)(1.01 * bound);
        assert_null(sim_create(&d, &fault));
        assert_non_null(strstr(fault.text, models[model].name));
        d.force = true;
        Sim* sim = sim_create(&d, &fault);
        assert_non_null(sim);
        sim_destroy(sim);
    }
}

// Kernels ---------------------------------------------------------------------------------------

#ifndef SIM_DOUBLE
static void every_kernel_gives_the_same_bits(void** state)
{
    (void)state;
    static const char* const names[] = {"scalar", "sse2", "avx2", "avx512"};
    for (int model = 0; model < MODEL_COUNT; ++model) {
        Vec3 wanted[16] = {{0, 0, 0}};
        for (int i = 0; i < 4; ++i) {
            if (kernel_find(names[i]) == NULL) {
                print_message("SKIPPED: no %s here\n", names[i]);
                continue;
            }
            SimDefinition d = bare((ModelKind)model, 7);
            Strand strand;
            straight(&strand, 7, vec3(0.6f, 0.64f, 0.48f));
            d.kernel = names[i];
            d.substeps = 4;
            d.damping_per_s = 3;
            start(&strand, d);
            run(&strand, 120);
            Vec3 got[16];
            sim_state(strand.sim, got, got + 8);
            if (i == 0) memcpy(wanted, got, sizeof wanted);
            assert_memory_equal(got, wanted, sizeof got);
            sim_destroy(strand.sim);
        }
    }
}
#endif

// A curl of a turn and a half, of the standard length.
static void curl(Strand* strand)
{
    const double radius = 0.025, turns = 1.5;
    double around = 2 * M_PI * turns,
           rise = sqrt(LENGTH_M * LENGTH_M - radius * radius * around * around);
    strand->links = 7;
    for (int n = 0; n <= 7; ++n) {
        double part = n / 7.0, angle = around * part;
        strand->rest[n] = vec3((float)(radius * (cos(angle) - 1)), (float)(-rise * part),
                               (float)(radius * sin(angle)));
    }
}

// How fast nodes go at most in the next two seconds, m/s.
static double speed_of(Strand* strand)
{
    Vec3 now[MAX_LINKS + 1], before[MAX_LINKS + 1];
    double most = 0, dt = 1.0 / (60.0 * strand->substeps);
    for (int i = 0; i < 120; ++i) {
        run(strand, 1);
        sim_state(strand->sim, now, before);
        for (int n = 1; n <= strand->links; ++n)
            most = fmax(most, (double)vec3_length(vec3_sub(now[n], before[n])) / dt);
    }
    return most;
}

// Bent out of a plane, undamped, carrying its weight: what moves by the gradient of an energy may
// not gain any. Neither may a strand under a head that spins (tests/charts/map-spin.png).
static void a_curled_strand_gains_no_energy_from_its_joints(void** state)
{
    (void)state;
    Strand strand;
    curl(&strand);
    SimDefinition d = bare(MODEL_FOREST, 7);
    d.gravity_compensation = true;
    d.stiffness_s2 = 12000;
    d.substeps = 16;
    start(&strand, d);
    SimHead heads[MAX_SUBS] = {0};
    for (int s = 0; s < d.substeps; ++s)
        memcpy(heads[s].rotation, identity, sizeof identity);
    heads[0].second_difference = vec3(2e-4f, 1e-4f, 3e-4f); // a knock
    sim_step(strand.sim, heads);
    double first = speed_of(&strand), last = first;
    for (int i = 0; i < 10; ++i)
        last = speed_of(&strand);
    assert_true(first > 1 && last < 1.1 * first);
    sim_destroy(strand.sim);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_curled_strand_gains_no_energy_from_its_joints),
        cmocka_unit_test(forest_sags_as_the_hinge_chain),
        cmocka_unit_test(cascade_sags_by_its_own_law),
        cmocka_unit_test(cascade_is_the_beam_where_it_bends_little),
        cmocka_unit_test(spring_sags_by_g_m_over_k),
        cmocka_unit_test(a_tilted_spring_is_weaker_and_sags),
        cmocka_unit_test(one_sweep_leaves_the_stretch_of_the_closed_form),
        cmocka_unit_test(plain_swings_in_the_heavy_chains_modes),
        cmocka_unit_test(plain_forest_and_cascade_of_one_link_are_the_pendulum),
        cmocka_unit_test(the_head_pushes_the_forests_tips),
        cmocka_unit_test(each_model_breaks_where_its_eigenvalues_say),
        cmocka_unit_test(the_bound_that_is_refused_is_on_the_safe_side_and_near),
#ifdef SIM_DOUBLE
        cmocka_unit_test(spring_is_critically_damped_where_it_should),
#else
        cmocka_unit_test(every_kernel_gives_the_same_bits),
#endif
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
