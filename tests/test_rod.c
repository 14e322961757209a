// The yardstick itself against closed forms and tables: statics, modes, energy, motion of the head.
#include "tests/rod.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define MOST_NODES 129
#define PI         3.14159265358979323846

// cmocka's own compares floats.
#define assert_near(a, b, tolerance)                                                               \
    do {                                                                                           \
        double got = (a), wanted = (b);                                                            \
        if (!(fabs(got - wanted) <= (tolerance))) fail_msg("%.12g is not %.12g", got, wanted);     \
    } while (0)

static const Vec3d still = {0, 0, 0};

static Rod* create(RodDefinition definition)
{
    Fault fault = {0};
    Rod* rod = rod_create(&definition, &fault);
    if (rod == NULL) fail_msg("%s", fault.text);
    return rod;
}

static Pose turned(double degrees, Vec3d axis)
{
    double half = degrees * PI / 360.0;
    Vec3d v = vec3d_scale(axis, sin(half));
    return (Pose){{0, 0, 0}, {v.x, v.y, v.z, cos(half)}};
}

// A straight rod of length 1 along `way` in `links` edges, with units such that its density is 1;
// EA is as good as infinite. For the caller to set: gravity, dt and so on.
static RodDefinition straight(Vec3d* rest, int links, Vec3d way, double bending)
{
    for (int j = 0; j <= links; ++j)
        rest[j] = vec3d_scale(way, (double)j / links);
    return (RodDefinition){.nodes = links + 1,
                           .rest = rest,
                           .bending_nm2 = bending,
                           .twisting_nm2 = bending > 1e-3 ? bending : 1e-3,
                           .stretching_n = 1e6 * (bending > 1.0 ? bending : 1.0),
                           .density_kg_m = 1.0,
                           .dt_s = 0.01,
                           .scheme = ROD_BDF2};
}

// Where the tip of a horizontal cantilever goes, its clamp turned up by `degrees`: x forward, y up.
static Vec3d cantilever_tip(int links, double gamma, double degrees)
{
    Vec3d nodes[MOST_NODES];
    RodDefinition d = straight(nodes, links, (Vec3d){1, 0, 0}, 1.0 / gamma);
    d.gravity_m_s2 = 1.0;
    Rod* rod = create(d);
    assert_true(rod_settle(rod, turned(degrees, (Vec3d){0, 0, 1}), still));
    rod_positions(rod, nodes);
    rod_destroy(rod);
    return nodes[links];
}

// A tuft of three turns, 40 micrometres thick, that points down and a little sideways.
static RodDefinition curl(Vec3d* rest, int nodes)
{
    for (int j = 0; j < nodes; ++j) {
        double s = 3.0 * 2.0 * PI * j / (nodes - 1);
        rest[j] = (Vec3d){0.1 + 0.015 * sin(s) + 0.004 * s, 0.05 - 0.01 * s, 0.015 * cos(s)};
    }
    RodDefinition d = rod_circular(3.5e9, 4e-5, 1300.0, 0.38);
    d.nodes = nodes;
    d.rest = rest;
    d.gravity_m_s2 = 9.81;
    d.dt_s = 1e-3;
    return d;
}

static double farthest(const Vec3d* a, const Vec3d* b, int nodes)
{
    double most = 0.0;
    for (int j = 0; j < nodes; ++j) {
        Vec3d d = vec3d_sub(a[j], b[j]);
        most = fmax(most, sqrt(vec3d_dot(d, d)));
    }
    return most;
}

static void rod_gradient_is_the_slope_of_its_energy(void** state)
{
    (void)state;
    enum { NODES = 12, COUNT = 4 * (NODES - 1) };
    Vec3d nodes[NODES];
    RodDefinition d = curl(nodes, NODES);
    d.stretching_n = 100.0 * d.bending_nm2 / 1e-4; // so that no term drowns the others
    Rod* rod = create(d);
    for (int j = 1; j < NODES; ++j) // bent, stretched and, by the turns below, twisted
        nodes[j] = vec3d_add(
            nodes[j], (Vec3d){0.002 * sin(9.0 * j), 0.003 * cos(7.0 * j), 0.002 * sin(5.0 * j)});
    rod_place(rod, nodes);
    double gradient[COUNT], change[COUNT] = {0};
    rod_potential(rod, NULL, gradient);
    for (int i = 0; i < COUNT; ++i) {
        double by = i % 4 == 0 ? 1e-4 : 1e-7;
        change[i] = by;
        double above = rod_potential(rod, change, NULL);
        change[i] = -by;
        double below = rod_potential(rod, change, NULL);
        change[i] = 0.0;
        double size = i % 4 == 0 ? d.twisting_nm2 / 0.02 : d.bending_nm2 / 4e-4;
        assert_near((above - below) / (2.0 * by) / size, gradient[i] / size, 1e-6);
    }
    rod_destroy(rod);
}

// theta'' = -Gamma (1 - s) cos theta, Gamma = rho A g L^3 / (E I); drop H and reach W over L.
// notes/simulation.md, section 1, tables/cantilever_elastica.csv (collocation, 9 digits); pitched:
// by shooting from the tip, Runge-Kutta 4, 8000 steps (4000: equal to 2e-14; without pitch: to the
// table's digits).
static const struct Elastica {
    double gamma, pitch_degrees, drop, reach;
} elastica[] = {
    {0.1, 0, 0.0124984378, 0.999910732}, {0.2, 0, 0.0249875111, 0.999643144},
    {0.5, 0, 0.0623057682, 0.997779},    {1, 0, 0.123471402, 0.991246395},
    {2, 0, 0.238506583, 0.966892947},    {3, 0, 0.339648392, 0.931511207},
    {5, 0, 0.495905045, 0.84665718},     {7.5, 0, 0.621991475, 0.743237223},
    {10, 0, 0.700199716, 0.656353761},   {15, 0, 0.786042892, 0.529565892},
    {20, 0, 0.829881443, 0.445232052},   {30, 0, 0.873092423, 0.342763681},
    {50, 0, 0.907917123, 0.245014756},   {75, 0, 0.926887448, 0.18948398},
    {100, 0, 0.937523935, 0.159223383},
};

static const struct Elastica pitched[] = {
    {0.5, 45, -0.6735611785, 0.7389232329}, {1, 45, -0.6351074806, 0.7715465063},
    {5, 45, -0.1705368586, 0.9582151389},   {20, 45, 0.6249641581, 0.6078077000},
    {100, 45, 0.8673119315, 0.2115066794},  {0.5, -45, 0.7362358747, 0.6765383356},
    {1, -45, 0.7614788745, 0.6474837154},   {5, -45, 0.8753764542, 0.4719982502},
    {20, -45, 0.9567499195, 0.2353126426},  {100, -45, 0.9838284413, 0.0854295388},
    {0.5, -75, 0.9697391326, 0.2440763199}, {1, -75, 0.9729134732, 0.2309193772},
    {5, -75, 0.9861847464, 0.1617905652},   {20, -75, 0.9951680197, 0.0797280291},
    {100, -75, 0.9981845358, 0.0290686262},
};

static void rod_sags_as_the_elastica(void** state)
{
    (void)state;
    for (size_t i = 0; i < sizeof elastica / sizeof elastica[0]; ++i) {
        struct Elastica e = elastica[i];
        Vec3d tip = cantilever_tip(128, e.gamma, 0.0);
        assert_near(-tip.y / tip.x, e.drop / e.reach, 1e-3 * e.drop / e.reach);
        assert_near(-tip.y, e.drop, 1e-3 * e.drop);
        assert_near(tip.x, e.reach, 1e-3 * e.reach);
        assert_near(tip.z, 0.0, 1e-9);
    }
}

static void rod_sags_as_the_elastica_from_a_pitched_clamp(void** state)
{
    (void)state;
    for (size_t i = 0; i < sizeof pitched / sizeof pitched[0]; ++i) {
        struct Elastica e = pitched[i];
        Vec3d tip = cantilever_tip(128, e.gamma, e.pitch_degrees);
        assert_near(-tip.y, e.drop, 5e-4);
        assert_near(tip.x, e.reach, 5e-4);
    }
}

// Relative error of H/W against the elastica, from an independent planar solution of the same
// discrete energy: tables/hinge_chain_vs_der_curvature.csv, err_der.
static const struct Discrete {
    double gamma;
    int links;
    double error;
} discrete[] = {
    {1, 7, 1.9849e-2},     {1, 32, 9.3974e-4},   {1, 64, 2.3450e-4},    {1, 128, 5.8571e-5},
    {10, 7, 3.1767e-3},    {10, 16, -9.3009e-4}, {10, 32, -4.2763e-4},  {10, 64, -1.3292e-4},
    {10, 128, -3.6547e-5}, {100, 8, -1.8729e-3}, {100, 32, -6.6436e-3}, {100, 128, -6.6937e-4},
};

static double elastica_error(double gamma, int links)
{
    Vec3d tip = cantilever_tip(links, gamma, 0.0);
    for (size_t i = 0; i < sizeof elastica / sizeof elastica[0]; ++i)
        if (elastica[i].gamma == gamma)
            return -tip.y / tip.x / (elastica[i].drop / elastica[i].reach) - 1.0;
    fail_msg("no row for %g", gamma);
    return 0.0;
}

static void rod_errs_as_its_discrete_energy_does(void** state)
{
    (void)state;
    for (size_t i = 0; i < sizeof discrete / sizeof discrete[0]; ++i)
        assert_near(elastica_error(discrete[i].gamma, discrete[i].links), discrete[i].error, 3e-6);
}

static void rod_converges_at_second_order_in_its_nodes(void** state)
{
    (void)state;
    double coarse = elastica_error(1.0, 32), fine = elastica_error(1.0, 128);
    assert_near(log2(coarse / fine) / 2.0, 2.0, 0.02);
}

// Of a beam clamped at s = 0 and free at s = 1 (with beta from cos beta cosh beta = -1).
static double mode_shape(double beta, double s)
{
    double sigma = (cosh(beta) + cos(beta)) / (sinh(beta) + sin(beta));
    double b = beta * s;
    return cosh(b) - cos(b) - sigma * (sinh(b) - sin(b));
}

// The angular frequency of `rod`, rad/s: of what `shape` (per node, along z) sees of its motion,
// over `halves` half swings after the first passage through zero, at `dt`.
static double frequency(Rod* rod, int nodes, double dt, const double* shape, int halves)
{
    Vec3d x[MOST_NODES];
    double before = 0.0, first = -1.0, last = 0.0;
    int passages = 0;
    for (int step = 0; step < 100000; ++step) {
        double now = 0.0;
        rod_positions(rod, x);
        for (int j = 1; j < nodes; ++j)
            now += shape[j] * x[j].z;
        if (step > 0 && before * now < 0.0) {
            last = dt * (step - 1 + before / (before - now));
            if (first < 0.0) first = last;
            if (passages++ == halves) return PI * halves / (last - first);
        }
        before = now;
        assert_true(rod_step(rod, pose_identity()));
    }
    fail_msg("no swing");
    return 0.0;
}

// Small vibrations, no gravity; unit sqrt(E I / (rho A L^4)). Continuous and for 32 links:
// tables/clamped_free_beam_frequencies.csv.
static void rod_vibrates_as_a_clamped_free_beam(void** state)
{
    (void)state;
    enum { LINKS = 32 };
    const double beta[] = {1.87510406871, 4.69409113297, 7.85475743824};
    const double omega[] = {3.5160152685, 22.0344915647, 61.6972144135};
    const double chain[] = {3.51311313, 21.94252813, 61.15672252};
    for (int mode = 0; mode < 3; ++mode) {
        Vec3d nodes[LINKS + 1];
        double shape[LINKS + 1];
        RodDefinition d = straight(nodes, LINKS, (Vec3d){1, 0, 0}, 1.0);
        d.dt_s = 2.0 * PI / omega[mode] / 320.0;
        Rod* rod = create(d);
        for (int j = 0; j <= LINKS; ++j) {
            shape[j] = mode_shape(beta[mode], (double)j / LINKS);
            nodes[j].z = 1e-4 * shape[j];
        }
        rod_place(rod, nodes);
        double measured = frequency(rod, LINKS + 1, d.dt_s, shape, 4);
        assert_near(measured, omega[mode], 0.01 * omega[mode]);
        assert_near(measured, chain[mode], 5e-4 * chain[mode]);
        rod_destroy(rod);
    }
}

// A hanging rod without stiffness, bent as its first mode nearly is; unit sqrt(g / L).
static double chain_frequency(int links, bool whole_tip_mass)
{
    Vec3d nodes[MOST_NODES];
    double shape[MOST_NODES];
    RodDefinition d = straight(nodes, links, (Vec3d){0, -1, 0}, 1e-9);
    d.gravity_m_s2 = 1.0;
    d.whole_tip_mass = whole_tip_mass;
    d.dt_s = 2.0 * PI / 1.2 / 400.0;
    Rod* rod = create(d);
    for (int j = 0; j <= links; ++j) { // 1 - J0(2.405 sqrt(1 - s)) as far as its square goes
        double s = (double)j / links;
        shape[j] = 0.7 * s + 0.3 * s * s;
        nodes[j].z = 1e-4 * shape[j];
    }
    rod_place(rod, nodes);
    double got = frequency(rod, links + 1, d.dt_s, shape, 8);
    rod_destroy(rod);
    return got;
}

// tables/heavy_chain_frequencies.csv: N16_half, and N7_equal, the chain of the models of server/.
static void rod_without_stiffness_swings_as_a_heavy_chain(void** state)
{
    (void)state;
    assert_near(chain_frequency(16, false), 1.201023171, 1e-3 * 1.2);
    assert_near(chain_frequency(7, true), 1.162456767, 1e-3 * 1.2);
}

// T / T0 = 2 / pi K(sin(amplitude / 2)): tables/pendulum_period.csv.
static void rod_of_one_edge_is_a_pendulum(void** state)
{
    (void)state;
    const double amplitude[] = {5, 60, 120},
                 ratio[] = {1.00047617249, 1.07318200715, 1.37288050062};
    for (int i = 0; i < 3; ++i) {
        Vec3d nodes[2];
        RodDefinition d = straight(nodes, 1, (Vec3d){0, -1, 0}, 1e-9);
        d.gravity_m_s2 = 1.0;
        d.dt_s = 2.0 * PI / 1000.0;
        Rod* rod = create(d);
        double a = amplitude[i] * PI / 180.0;
        nodes[1] = (Vec3d){0, -cos(a), sin(a)};
        rod_place(rod, nodes);
        assert_near(1.0 / frequency(rod, 2, d.dt_s, (double[]){0, 1}, 6), ratio[i],
                    1e-3 * ratio[i]);
        rod_destroy(rod);
    }
}

static double motion_energy(const Rod* rod)
{
    RodEnergy e = rod_energy(rod);
    return e.stretch + e.bend + e.twist + e.gravity + e.motion;
}

// What part of its energy a swinging beam has left after four periods; from the second period on,
// when the stretch that its start has is gone.
static double energy_left(RodScheme scheme, double dt_per_period, double damping)
{
    enum { LINKS = 12 };
    Vec3d nodes[LINKS + 1];
    double period = 2.0 * PI / 3.49;
    RodDefinition d = straight(nodes, LINKS, (Vec3d){1, 0, 0}, 1.0);
    d.scheme = scheme;
    d.dt_s = period * dt_per_period;
    d.damping_per_s = damping / period;
    Rod* rod = create(d);
    for (int j = 0; j <= LINKS; ++j)
        nodes[j].z = 1e-4 * mode_shape(1.87510406871, (double)j / LINKS);
    rod_place(rod, nodes);
    int period_steps = (int)(1.0 / dt_per_period + 0.5);
    double before = 0.0;
    for (int step = 0; step < 5 * period_steps; ++step) {
        if (step == period_steps) before = motion_energy(rod);
        assert_true(rod_step(rod, pose_identity()));
    }
    double left = motion_energy(rod) / before;
    rod_destroy(rod);
    return left;
}

// BDF2 loses (w dt)^4 / 2 of the energy in a step, so (w dt)^3 in a time; Euler (w dt)^2.
static void rod_keeps_its_energy(void** state)
{
    (void)state;
    double coarse = 1.0 - energy_left(ROD_BDF2, 1.0 / 100.0, 0.0);
    double fine = 1.0 - energy_left(ROD_BDF2, 1.0 / 200.0, 0.0);
    assert_true(fine > 0.0 && fine < 1e-3);
    assert_near(coarse / fine, 8.0, 1.0);
    assert_true(energy_left(ROD_EULER, 1.0 / 200.0, 0.0) < 0.6);
}

// Damping g of the velocity takes exp(-g t) off the energy of a vibration.
static void rod_loses_energy_at_its_damping(void** state)
{
    (void)state;
    double kept = energy_left(ROD_BDF2, 1.0 / 200.0, 0.0);
    assert_near(log(energy_left(ROD_BDF2, 1.0 / 200.0, 0.25) / kept), -0.25 * 4.0, 5e-3);
}

static void rod_stays_curled_without_gravity(void** state)
{
    (void)state;
    enum { NODES = 40 };
    Vec3d rest[NODES], nodes[NODES];
    RodDefinition d = curl(rest, NODES);
    d.gravity_m_s2 = 0.0;
    Rod* rod = create(d);
    Pose head = turned(130.0, (Vec3d){0.48, 0.6, 0.64});
    assert_true(rod_settle(rod, head, still));
    for (int step = 0; step < 20; ++step)
        assert_true(rod_step(rod, head));
    rod_positions(rod, nodes);
    for (int j = 0; j < NODES; ++j)
        rest[j] = quat_rotate(head.orientation, rest[j]);
    assert_true(farthest(nodes, rest, NODES) < 1e-12);
    rod_destroy(rod);
}

// A quarter of a ring in the horizontal plane, clamped at one end, sags out of its plane by bending
// and by twist. Castigliano with bending moment q R^2 (1 - cos a) and torque q R^2 (a - sin a), a
// from the tip, q the weight per length: tip q R^4 (1 / (2 E I) + (pi^2 / 8 - pi / 2 + 1 / 2) / (G
// J)).
static void rod_sags_out_of_its_plane_as_a_quarter_ring(void** state)
{
    (void)state;
    enum { LINKS = 96 };
    const double twisting[] = {0.1, 1.0};
    for (int i = 0; i < 2; ++i) {
        Vec3d nodes[LINKS + 1];
        RodDefinition d = straight(nodes, LINKS, (Vec3d){1, 0, 0}, 1.0);
        for (int j = 0; j <= LINKS; ++j) {
            double a = 0.5 * PI * j / LINKS;
            nodes[j] = (Vec3d){sin(a), 0.0, cos(a)};
        }
        d.twisting_nm2 = twisting[i];
        d.gravity_m_s2 = 1e-3;
        Rod* rod = create(d);
        assert_true(rod_settle(rod, pose_identity(), still));
        rod_positions(rod, nodes);
        double sag = 1e-3 * (0.5 + (PI * PI / 8.0 - PI / 2.0 + 0.5) / twisting[i]);
        assert_near(-nodes[LINKS].y, sag, 1e-3 * sag);
        rod_destroy(rod);
    }
}

// The curl under its weight, then under a head 100 km away that goes at a constant speed.
static void rod_does_not_feel_constant_speed(void** state)
{
    (void)state;
    enum { NODES = 24 };
    Vec3d nodes[NODES], moved[NODES];
    RodDefinition d = curl(nodes, NODES);
    Rod* rod = create(d);
    Vec3d speed = {2.0, -0.5, 3.0};
    Pose head = turned(40.0, (Vec3d){0.0, 0.6, 0.8});
    head.position = (Vec3d){1e5, 0.0, -1e5};
    assert_true(rod_settle(rod, head, speed));
    rod_positions(rod, nodes);
    for (int step = 0; step < 50; ++step) {
        head.position = vec3d_add(head.position, vec3d_scale(speed, d.dt_s));
        assert_true(rod_step(rod, head));
    }
    rod_positions(rod, moved);
    assert_true(farthest(nodes, moved, NODES) < 1e-7);
    rod_destroy(rod);
}

// Let go, carried or not, let go on: 0.1 s without and with a jump on the way, about the vertical,
// which gravity does not see.
static void rod_is_carried_over_a_jump(void** state)
{
    (void)state;
    enum { NODES = 12 };
    Vec3d nodes[2][NODES];
    Pose far = turned(200.0, (Vec3d){0, 1, 0});
    far.position = (Vec3d){700.0, -20.0, 3.0};
    for (int jumps = 0; jumps < 2; ++jumps) {
        Rod* rod = create(curl(nodes[jumps], NODES));
        for (int step = 0; step < 100; ++step) {
            if (jumps && step == 30) rod_carry(rod, far);
            assert_true(rod_step(rod, jumps && step >= 30 ? far : pose_identity()));
        }
        rod_positions(rod, nodes[jumps]);
        rod_destroy(rod);
    }
    for (int j = 0; j < NODES; ++j)
        nodes[0][j] = quat_rotate(far.orientation, nodes[0][j]);
    assert_true(farthest(nodes[0], nodes[1], NODES) < 1e-8);
}

// 0.15 s after release from the rest shape: in gravity under a still head, or without gravity under
// a head that accelerates upwards as much.
static void released(bool gravity, Vec3d* nodes, int count)
{
    RodDefinition d = curl(nodes, count);
    double g = d.gravity_m_s2;
    if (!gravity) d.gravity_m_s2 = 0.0;
    Rod* rod = create(d);
    for (int step = 1; step <= 150; ++step) {
        Pose head = pose_identity();
        double t = step * d.dt_s;
        if (!gravity) head.position.y = 0.5 * g * t * t;
        assert_true(rod_step(rod, head));
    }
    rod_positions(rod, nodes);
    rod_destroy(rod);
}

static void rod_feels_acceleration_as_weight(void** state)
{
    (void)state;
    enum { NODES = 16 };
    Vec3d weighs[NODES], pushed[NODES], rest[NODES];
    released(true, weighs, NODES);
    released(false, pushed, NODES);
    curl(rest, NODES);
    assert_true(farthest(weighs, rest, NODES) > 0.02);
    assert_true(farthest(weighs, pushed, NODES) < 1e-4); // Euler's first step sees half of it
}

// After some seconds in a wind from above, without gravity; or in gravity, at once.
static void blown(bool wind, Vec3d* nodes, int count)
{
    RodDefinition d = curl(nodes, count);
    double g = d.gravity_m_s2;
    if (wind) d.gravity_m_s2 = 0.0;
    d.dt_s = 1e-2;
    Rod* rod = create(d);
    assert_true(rod_settle(rod, pose_identity(), still));
    if (wind) rod_blow(rod, (Vec3d){0, -0.5 * g, 0}, 2.0);
    for (int step = 0; step < 1500; ++step)
        assert_true(rod_step(rod, pose_identity()));
    rod_positions(rod, nodes);
    rod_destroy(rod);
}

static void rod_leans_in_the_wind_as_under_a_weight(void** state)
{
    (void)state;
    enum { NODES = 16 };
    Vec3d weighs[NODES], leans[NODES], rest[NODES];
    blown(false, weighs, NODES);
    blown(true, leans, NODES);
    curl(rest, NODES);
    assert_true(farthest(weighs, rest, NODES) > 0.02);
    assert_true(farthest(weighs, leans, NODES) < 1e-5);
}

// Under a head that goes with the wind, drag is damping of that size.
static void rod_feels_the_wind_past_its_head(void** state)
{
    (void)state;
    enum { NODES = 12 };
    Vec3d nodes[3][NODES];
    const Vec3d speed = {0, 0, 3};
    for (int i = 0; i < 3; ++i) {
        RodDefinition d = curl(nodes[i], NODES);
        if (i == 2) d.damping_per_s = 2.0;
        Rod* rod = create(d);
        assert_true(rod_settle(rod, pose_identity(), speed));
        rod_positions(rod, nodes[i]);
        for (int j = 1; j < NODES; ++j)
            nodes[i][j].x += 0.002 * j; // let go from beside its rest
        rod_place(rod, nodes[i]);
        if (i > 0) rod_blow(rod, i == 1 ? speed : (Vec3d){0, 0, 0}, i == 1 ? 2.0 : 0.0);
        Pose head = pose_identity();
        for (int step = 0; step < 200; ++step) {
            head.position = vec3d_add(head.position, vec3d_scale(speed, d.dt_s));
            assert_true(rod_step(rod, head));
        }
        rod_positions(rod, nodes[i]);
        rod_destroy(rod);
    }
    assert_true(farthest(nodes[0], nodes[1], NODES) > 1e-3); // drag damps
    assert_true(farthest(nodes[1], nodes[2], NODES) < 1e-9); // as damping of that size does
}

// Nods and goes forward and back in 0.4 s, the pivot 0.15 m below the head.
static Pose nod(double t)
{
    double ramp = 1.0 - cos(2.0 * PI * 2.5 * t);
    Pose head = turned(10.0 * ramp, (Vec3d){1, 0, 0});
    head.position = quat_rotate(head.orientation, (Vec3d){0, 0.15, 0.02 * ramp});
    return head;
}

// 0.2 s after its begin.
static void nodded(RodScheme scheme, int steps, Vec3d* nodes, int count)
{
    RodDefinition d = curl(nodes, count);
    d.scheme = scheme;
    d.dt_s = 0.2 / steps;
    d.damping_per_s = 15.0;
    Rod* rod = create(d);
    assert_true(rod_settle(rod, nod(0.0), still));
    for (int step = 1; step <= steps; ++step) {
        assert_true(rod_step(rod, nod(step * d.dt_s)));
        assert_true(rod_iterations(rod) <= 8);
    }
    rod_positions(rod, nodes);
    rod_destroy(rod);
}

static double order_in_time(RodScheme scheme)
{
    enum { NODES = 12 };
    Vec3d coarse[NODES], fine[NODES], finest[NODES];
    nodded(scheme, 200, coarse, NODES);
    nodded(scheme, 400, fine, NODES);
    nodded(scheme, 800, finest, NODES);
    return log2(farthest(coarse, fine, NODES) / farthest(fine, finest, NODES));
}

static void rod_follows_a_head_at_the_order_of_its_scheme(void** state)
{
    (void)state;
    assert_near(order_in_time(ROD_BDF2), 2.0, 0.2);
    assert_near(order_in_time(ROD_EULER), 1.0, 0.2);
}

// With all second derivatives the error squares itself in every iteration, without some it does
// not. (One that is wrong by a hundredth is too little for this test to see, and costs no more.) EA
// is low in the second case, or rounding would hide the end.
static void rod_settles_in_a_few_newton_iterations(void** state)
{
    (void)state;
    enum { NODES = 40 };
    Vec3d nodes[NODES];
    RodDefinition d = curl(nodes, NODES);
    Rod* rod = create(d);
    assert_true(rod_settle(rod, pose_identity(), still));
    assert_true(rod_iterations(rod) <= 25);
    rod_destroy(rod);
    d.stretching_n /= 1000.0;
    d.gravity_m_s2 = 0.03;
    rod = create(d);
    assert_true(rod_settle(rod, pose_identity(), still));
    assert_true(rod_iterations(rod) <= 4);
    rod_destroy(rod);
}

static void rod_refuses_what_it_cannot_be(void** state)
{
    (void)state;
    Vec3d nodes[8];
    const RodDefinition good = curl(nodes, 8);
    Fault fault = {0};
    RodDefinition bad = good;
    bad.nodes = 1;
    assert_null(rod_create(&bad, &fault));
    assert_non_null(strstr(fault.text, "nodes"));
    bad = good, bad.dt_s = 0.0;
    assert_null(rod_create(&bad, &fault));
    assert_non_null(strstr(fault.text, "dt_s"));
    bad = good, bad.damping_per_s = (double)NAN;
    assert_null(rod_create(&bad, &fault));
    assert_non_null(strstr(fault.text, "damping_per_s"));
    nodes[3] = nodes[2];
    assert_null(rod_create(&good, &fault));
    assert_non_null(strstr(fault.text, "2 and 3"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rod_gradient_is_the_slope_of_its_energy),
        cmocka_unit_test(rod_sags_as_the_elastica),
        cmocka_unit_test(rod_sags_as_the_elastica_from_a_pitched_clamp),
        cmocka_unit_test(rod_errs_as_its_discrete_energy_does),
        cmocka_unit_test(rod_converges_at_second_order_in_its_nodes),
        cmocka_unit_test(rod_vibrates_as_a_clamped_free_beam),
        cmocka_unit_test(rod_without_stiffness_swings_as_a_heavy_chain),
        cmocka_unit_test(rod_of_one_edge_is_a_pendulum),
        cmocka_unit_test(rod_keeps_its_energy),
        cmocka_unit_test(rod_loses_energy_at_its_damping),
        cmocka_unit_test(rod_stays_curled_without_gravity),
        cmocka_unit_test(rod_sags_out_of_its_plane_as_a_quarter_ring),
        cmocka_unit_test(rod_does_not_feel_constant_speed),
        cmocka_unit_test(rod_is_carried_over_a_jump),
        cmocka_unit_test(rod_feels_acceleration_as_weight),
        cmocka_unit_test(rod_leans_in_the_wind_as_under_a_weight),
        cmocka_unit_test(rod_feels_the_wind_past_its_head),
        cmocka_unit_test(rod_follows_a_head_at_the_order_of_its_scheme),
        cmocka_unit_test(rod_settles_in_a_few_newton_iterations),
        cmocka_unit_test(rod_refuses_what_it_cannot_be),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
