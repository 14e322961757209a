// The dynamics against closed forms, invariances and what a collider promises.
#include "messages/trig.h"
#include "server/motion.h"
#include "server/sim.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define NODES     8
#define STRANDS   40
#define LINK_M    0.04f
#define LENGTH_M  (LINK_M * (NODES - 1))
#define MAX_NODES (STRANDS * NODES)

// cmocka's own compares floats.
#define assert_near(a, b, tolerance)                                                               \
    do {                                                                                           \
        double got = (double)(a), wanted = (b);                                                    \
        if (!(fabs(got - wanted) <= (tolerance))) fail_msg("%.9g is not %.9g", got, wanted);       \
    } while (0)

static const float identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

// Strands that hang beside each other, each leaning a little differently.
// The daemon's defaults on STRANDS strands of NODES nodes at `rest`.
static SimDefinition defaults_on(const Vec3* rest)
{
    SimDefinition d = sim_default();
    d.strands = STRANDS;
    d.nodes = NODES;
    d.rest = rest;
    return d;
}

static void hang(Vec3* rest, int strands, int nodes, float link)
{
    for (int s = 0; s < strands; ++s) {
        Vec3 way = vec3_normalise_or(vec3(0.02f * (float)(s % 5), -1.0f, 0.013f * (float)(s % 7)),
                                     vec3(0, -1, 0));
        for (int n = 0; n < nodes; ++n)
            rest[s * nodes + n] =
                vec3_mad(vec3(0.003f * (float)s, 0.25f, 0.01f), way, link * (float)n);
    }
}

static Sim* create(SimDefinition definition)
{
    Fault fault = {0};
    Sim* sim = sim_create(&definition, &fault);
    if (sim == NULL) fail_msg("%s", fault.text);
    return sim;
}

static void rotation_of(float m[9], Quat q)
{
    Vec3d x = quat_rotate(q, (Vec3d){1, 0, 0}), y = quat_rotate(q, (Vec3d){0, 1, 0});
    Vec3d z = quat_rotate(q, (Vec3d){0, 0, 1});
    double r[9] = {x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z};
    for (int i = 0; i < 9; ++i)
        m[i] = (float)r[i];
}

static Quat tilt(double degrees)
{
    double half = degrees * TRIG_PI / 360.0;
    return (Quat){trig_sin(half), 0, 0, trig_cos(half)};
}

// Steps under a motion from tick `first`, the head `offset` away from the origin.
static void follow(Sim* sim, const char* motion, int first, int ticks, Vec3d offset)
{
    MotionFunction at = motion_find(motion)->at;
    double dt = 1.0 / 240.0;
    for (int tick = first; tick < first + ticks; ++tick) {
        SimHead heads[4] = {0};
        for (int s = 0; s < 4; ++s) {
            double t = (tick * 4 + s + 1) * dt;
            Pose now = at(t).pose;
            Vec3d x = vec3d_add(now.position, offset);
            Vec3d y = vec3d_add(at(t - dt).pose.position, offset);
            Vec3d z = vec3d_add(at(t - 2.0 * dt).pose.position, offset);
            rotation_of(heads[s].rotation, now.orientation);
            heads[s].second_difference = vec3_from(vec3d_sub(vec3d_sub(x, y), vec3d_sub(y, z)));
        }
        sim_step(sim, heads);
    }
}

static void stand(Sim* sim, const float rotation[9], int ticks, int substeps)
{
    SimHead heads[64] = {0};
    for (int s = 0; s < substeps; ++s)
        memcpy(heads[s].rotation, rotation, sizeof heads[s].rotation);
    for (int tick = 0; tick < ticks; ++tick)
        sim_step(sim, heads);
}

// One node on a spring without links: two nodes on the same place have a link of length 0, so the
// length correction is left out.
static SimDefinition oscillator(const Vec3* rest, float stiffness, float damping)
{
    SimDefinition d = sim_default();
    d.strands = 1;
    d.nodes = 2;
    d.rest = rest;
    d.iterations = 0;
    d.substeps = 16;
    d.stiffness_s2 = stiffness;
    d.fall_off_power = 0;
    d.damping_per_s = damping;
    return d;
}

// The displacement of the tip after a kick of the head by `kick`, at every tick.
static void ring_out(Sim* sim, float* x, int ticks)
{
    SimHead heads[16] = {0};
    Vec3 position[2], previous[2];
    for (int s = 0; s < 16; ++s)
        memcpy(heads[s].rotation, identity, sizeof identity);
    heads[0].second_difference = vec3(-4e-4f, 0, 0); // the head stops: the node goes on
    for (int tick = 0; tick < ticks; ++tick) {
        sim_step(sim, heads);
        heads[0].second_difference = vec3(0, 0, 0);
        sim_state(sim, position, previous);
        x[tick] = position[1].x;
    }
}

static void an_undamped_node_swings_at_the_root_of_its_stiffness(void** state)
{
    (void)state;
    const Vec3 rest[2] = {{0, 0, 0}, {0, -0.1f, 0}};
    Sim* sim = create(oscillator(rest, 100.0f, 0.0f));
    float x[240];
    ring_out(sim, x, 240);
    // sin(10 t) v / 10 with v = 4e-4 m per 1/960 s.
    for (int i = 0; i < 240; ++i) {
        double t = (i + 1) / 60.0;
        assert_near((double)x[i], 0.384 / 10.0 * sin(10.0 * t), 1.5e-4);
    }
    sim_destroy(sim);
}

static void a_damped_node_decays_by_half_its_damping(void** state)
{
    (void)state;
    const Vec3 rest[2] = {{0, 0, 0}, {0, -0.1f, 0}};
    Sim* sim = create(oscillator(rest, 400.0f, 6.0f));
    float x[60];
    ring_out(sim, x, 60);
    double omega = sqrt(400.0 - 9.0);
    for (int i = 0; i < 60; ++i) {
        double t = (i + 1) / 60.0;
        assert_near((double)x[i], 0.384 / omega * exp(-3.0 * t) * sin(omega * t), 1e-4);
    }
    sim_destroy(sim);
}

static void damping_does_not_depend_on_the_rate(void** state)
{
    (void)state;
    const Vec3 rest[2] = {{0, 0, 0}, {0, -0.1f, 0}};
    float end[2];
    for (int fine = 0; fine < 2; ++fine) {
        SimDefinition d = oscillator(rest, 0.0f, 4.0f);
        d.rate_hz = fine ? 240.0 : 60.0;
        d.substeps = 1;
        Sim* sim = create(d);
        SimHead head = {.second_difference = vec3(fine ? -0.001f : -0.004f, 0, 0)};
        memcpy(head.rotation, identity, sizeof identity);
        for (int i = 0; i < (fine ? 960 : 240); ++i) {
            sim_step(sim, &head);
            head.second_difference = vec3(0, 0, 0);
        }
        Vec3 position[2], previous[2];
        sim_state(sim, position, previous);
        end[fine] = position[1].x; // v / gamma, but for the first step
        sim_destroy(sim);
    }
    assert_near((double)end[0], (double)end[1], 0.04 * (double)end[1]);
}

static void a_compensated_rest_pose_stays_at_every_tilt(void** state)
{
    (void)state;
    Vec3 rest[MAX_NODES], positions[MAX_NODES];
    hang(rest, STRANDS, NODES, LINK_M);
    SimDefinition d = defaults_on(rest);
    Sim* sim = create(d);
    for (int degrees = 0; degrees <= 180; degrees += 15) {
        float rotation[9];
        rotation_of(rotation, tilt(degrees));
        sim_reset(sim, rotation);
        stand(sim, rotation, 120, 4);
        sim_positions(sim, rotation, false, positions);
        for (int i = 0; i < MAX_NODES; ++i)
            assert_true(vec3_length(vec3_sub(positions[i], rest[i])) < 1e-6f);
    }
    sim_destroy(sim);
}

static void hair_comes_back_to_rest_after_a_shake(void** state)
{
    (void)state;
    Vec3 rest[MAX_NODES], positions[MAX_NODES];
    hang(rest, STRANDS, NODES, LINK_M);
    SimDefinition d = defaults_on(rest);
    Sim* sim = create(d);
    float farthest = 0.0f;
    for (int tick = 0; tick < 120; ++tick) {
        follow(sim, "shake", tick, 1, (Vec3d){0, 0, 0});
        sim_positions(sim, identity, false, positions);
        farthest =
            fmaxf(farthest, vec3_length(vec3_sub(positions[MAX_NODES - 1], rest[MAX_NODES - 1])));
    }
    assert_true(farthest > 0.03f); // it does lag
    follow(sim, "shake", 120, 120, (Vec3d){0, 0, 0});
    sim_positions(sim, identity, false, positions);
    for (int i = 0; i < MAX_NODES; ++i)
        assert_true(vec3_length(vec3_sub(positions[i], rest[i])) < 0.005f);
    sim_destroy(sim);
}

static void threads_and_neighbours_change_no_bit(void** state)
{
    (void)state;
    Vec3 rest[MAX_NODES], whole[MAX_NODES], part[MAX_NODES], previous[MAX_NODES];
    hang(rest, STRANDS, NODES, LINK_M);
    SimDefinition d = sim_default();
    d.colliders = (const Collider[]){{{0, 0.2f, 0}, {0, 0.2f, 0}, 0.07f, BODY_HEAD},
                                     {{0.05f, 0, 0}, {0.05f, 0, 0}, 0.06f, BODY_HEAD}};
    d.collider_count = 2;
    d.nodes = NODES;
    d.rest = rest;
    d.strands = STRANDS;
    Sim* sim = create(d);
    follow(sim, "shake", 0, 60, (Vec3d){0, 0, 0});
    sim_state(sim, whole, previous);
    sim_destroy(sim);
    for (int strands = 1; strands <= STRANDS; ++strands) {
        d.strands = strands;
        d.threads = 1 + strands % 2;
        sim = create(d);
        follow(sim, "shake", 0, 60, (Vec3d){0, 0, 0});
        sim_state(sim, part, previous);
        assert_memory_equal(part, whole, (size_t)(strands * NODES) * sizeof(Vec3));
        sim_destroy(sim);
    }
}

static void hair_a_hundred_kilometres_away_moves_alike(void** state)
{
    (void)state;
    Vec3 rest[MAX_NODES], here[MAX_NODES], there[MAX_NODES];
    hang(rest, STRANDS, NODES, LINK_M);
    SimDefinition d = defaults_on(rest);
    Sim *near = create(d), *far = create(d);
    follow(near, "nod", 0, 150, (Vec3d){0, 0, 0});
    follow(far, "nod", 0, 150, (Vec3d){100000.0, 0, -70000.0});
    sim_positions(near, identity, true, here);
    sim_positions(far, identity, true, there);
    for (int i = 0; i < MAX_NODES; ++i)
        assert_true(vec3_length(vec3_sub(here[i], there[i])) < 1e-5f);
    sim_destroy(near);
    sim_destroy(far);
}

static void a_turned_state_moves_like_the_unturned_one(void** state)
{
    (void)state;
    Vec3 rest[MAX_NODES], here[MAX_NODES], there[MAX_NODES];
    hang(rest, STRANDS, NODES, LINK_M);
    SimDefinition d = sim_default();
    d.colliders = (const Collider[]){{{0, 0.1f, 0.05f}, {0, 0.1f, 0.05f}, 0.09f, BODY_HEAD}};
    d.collider_count = 1;
    d.strands = STRANDS;
    d.nodes = NODES;
    d.rest = rest;
    Sim *still = create(d), *turned = create(d);
    follow(still, "nod", 0, 30, (Vec3d){0, 0, 0});
    follow(turned, "nod", 0, 30, (Vec3d){0, 0, 0});
    Quat q = {0, trig_sin(0.6), 0, trig_cos(0.6)};
    Quat head = motion_find("nod")->at(0.5).pose.orientation;
    float turn[9], before[9], after[9];
    rotation_of(turn, q);
    rotation_of(before, head);
    rotation_of(after, quat_mul(q, head));
    sim_turn(turned, turn);
    stand(still, before, 20, 4);
    stand(turned, after, 20, 4);
    sim_positions(still, before, false, here);
    sim_positions(turned, after, false, there);
    for (int i = 0; i < MAX_NODES; ++i)
        assert_true(vec3_length(vec3_sub(here[i], there[i])) < 1e-5f);
    sim_destroy(still);
    sim_destroy(turned);
}

static void a_hanging_chain_stretches_as_its_closed_form(void** state)
{
    (void)state;
    // (N - n) g dt^2 / d for link n of N, 1 iteration (notes/simulation.md 4.2).
    Vec3 rest[NODES], position[NODES], previous[NODES];
    hang(rest, 1, NODES, LINK_M);
    SimDefinition d = sim_default();
    d.strands = 1;
    d.nodes = NODES;
    d.rest = rest;
    d.gravity_compensation = false;
    d.stiffness_s2 = 0.0f;
    d.substeps = 1;
    Sim* sim = create(d);
    stand(sim, identity, 2000, 1);
    sim_state(sim, position, previous);
    for (int n = 1; n < NODES; ++n) {
        double length = (double)vec3_length(vec3_sub(position[n], position[n - 1]));
        double stretch = length / (double)LINK_M - 1.0;
        double form = (NODES - 1 - n) * 9.81 / 3600.0 / (double)LINK_M;
        assert_near(stretch, form, 0.03 * form + 0.002);
    }
    sim_destroy(sim);
}

// Positions after one tick from rest under a head that has turned.
static void turned_once(const Vec3* rest, int nodes, int iterations, Vec3* position)
{
    Vec3 previous[NODES];
    SimDefinition d = sim_default();
    d.strands = 1;
    d.nodes = nodes;
    d.rest = rest;
    d.substeps = 1;
    d.iterations = iterations;
    Sim* sim = create(d);
    SimHead head = {.second_difference = {0.004f, -0.001f, 0.002f}};
    rotation_of(head.rotation, tilt(20.0));
    sim_step(sim, &head);
    sim_state(sim, position, previous);
    sim_destroy(sim);
}

// One sweep from root to tip, link by link; the root does not move.
static void sweep_lengths(const Vec3* rest, int nodes, Vec3* p)
{
    for (int n = 1; n < nodes; ++n) {
        Vec3 way = vec3_sub(p[n], p[n - 1]);
        float length = sqrtf(way.x * way.x + way.y * way.y + way.z * way.z);
        float error = length - vec3_length(vec3_sub(rest[n], rest[n - 1]));
        float excess = fabsf(error) > 2.5e-7f ? error / length : 0.0f;
        p[n - 1] = vec3_mad(p[n - 1], way, (n == 1 ? 0.0f : 0.5f) * excess);
        p[n] = vec3_mad(p[n], way, (n == 1 ? -1.0f : -0.5f) * excess);
    }
}

static void sweeps_side_by_side_have_the_bits_of_one_after_another(void** state)
{
    (void)state;
    Vec3 rest[NODES], position[NODES], wanted[NODES];
    for (int nodes = 2; nodes <= NODES; ++nodes)
        for (int iterations = 1; iterations <= 5; ++iterations) {
            hang(rest, 1, nodes, LINK_M);
            turned_once(rest, nodes, 0, wanted);
            for (int i = 0; i < iterations; ++i)
                sweep_lengths(rest, nodes, wanted);
            turned_once(rest, nodes, iterations, position);
            if (memcmp(position, wanted, (size_t)nodes * sizeof *position) != 0)
                fail_msg("%d nodes, %d sweeps end elsewhere", nodes, iterations);
        }
}

static void published_lengths_are_those_at_rest(void** state)
{
    (void)state;
    Vec3 rest[MAX_NODES], positions[MAX_NODES];
    hang(rest, STRANDS, NODES, LINK_M);
    SimDefinition d = defaults_on(rest);
    Sim* sim = create(d);
    float rotation[9], worst = 0.0f, raw = 0.0f;
    for (int tick = 0; tick < 30; ++tick) {
        follow(sim, "turn", tick, 1, (Vec3d){0, 0, 0});
        rotation_of(rotation, motion_find("turn")->at((tick + 1) / 60.0).pose.orientation);
        for (int project = 0; project < 2; ++project) {
            sim_positions(sim, rotation, project, positions);
            for (int i = 0; i < MAX_NODES; ++i) {
                if (i % NODES == 0) continue;
                float length = vec3_length(vec3_sub(positions[i], positions[i - 1]));
                float* most = project ? &worst : &raw;
                *most = fmaxf(*most, fabsf(length / LINK_M - 1.0f));
            }
        }
    }
    assert_true(raw > 0.02f); // half a turn in 0.1 s does stretch the state
    assert_true(worst < 1e-3f);
    sim_destroy(sim);
}

// Strands held at both ends: an arc over the head.
static void arch(Vec3* rest, uint8_t* weight)
{
    for (int n = 0; n < NODES; ++n) {
        double angle = TRIG_PI * n / (NODES - 1);
        rest[n] = vec3((float)(0.1 * trig_cos(angle)), (float)(0.2 + 0.1 * trig_sin(angle)), 0.0f);
        weight[n] = n == 0 || n >= NODES - 2 ? 0 : 255;
    }
}

static void a_skinned_tip_stays_on_the_head_and_links_keep_their_length(void** state)
{
    (void)state;
    Vec3 rest[NODES], positions[NODES];
    uint8_t weight[NODES];
    arch(rest, weight);
    SimDefinition d = sim_default();
    d.strands = 1;
    d.nodes = NODES;
    d.rest = rest;
    d.weight = weight;
    Sim* sim = create(d);
    for (int tick = 0; tick < 120; ++tick) {
        follow(sim, "shake", tick, 1, (Vec3d){0, 0, 0});
        float rotation[9];
        rotation_of(rotation, motion_find("shake")->at((tick + 1) / 60.0).pose.orientation);
        sim_positions(sim, rotation, true, positions);
        for (int n = 0; n < NODES; ++n)
            if (weight[n] == 0) assert_memory_equal(&positions[n], &rest[n], sizeof rest[n]);
        for (int n = 1; n < NODES; ++n) {
            float now = vec3_length(vec3_sub(positions[n], positions[n - 1]));
            float then = vec3_length(vec3_sub(rest[n], rest[n - 1]));
            assert_true(fabsf(now / then - 1.0f) < 1e-3f);
        }
    }
    sim_destroy(sim);
}

static void a_share_of_skin_means_the_same_at_every_rate(void** state)
{
    (void)state;
    // A head that tilts at once: what is left of the way after 1/10 s, by skin alone.
    const Vec3 rest[2] = {{0, 0, 0}, {0, -0.1f, 0}};
    const uint8_t weight[2] = {0, 204};
    float left[2];
    for (int fine = 0; fine < 2; ++fine) {
        SimDefinition d = oscillator(rest, 0.0f, 1e4f); // no inertia
        d.weight = weight;
        d.substeps = fine ? 16 : 1;
        Sim* sim = create(d);
        float rotation[9];
        rotation_of(rotation, tilt(10.0));
        stand(sim, rotation, 6, d.substeps);
        Vec3 position[2], previous[2];
        sim_state(sim, position, previous);
        float whole = 0.1f * (float)trig_sin(10.0 * TRIG_PI / 180.0);
        left[fine] = 1.0f - fabsf(position[1].z) / whole;
        sim_destroy(sim);
    }
    assert_near((double)left[0], trig_pow(0.8, 6.0), 0.01);
    assert_near((double)left[1], trig_pow(0.8, 6.0), 0.01);
}

static SimDefinition beside_a_head(const Vec3* rest, const Collider* head)
{
    SimDefinition d = sim_default();
    d.strands = 1;
    d.nodes = NODES;
    d.rest = rest;
    d.colliders = head;
    d.collider_count = 1;
    return d;
}

static void nodes_stay_outside_a_collider(void** state)
{
    (void)state;
    Vec3 rest[NODES], positions[NODES];
    const Collider head = {{0, 0.1f, 0}, {0, 0.1f, 0}, 0.08f, BODY_HEAD};
    for (int n = 0; n < NODES; ++n)
        rest[n] = vec3(0, 0.2f - LINK_M * (float)n, 0.1f);
    SimDefinition d = beside_a_head(rest, &head);
    d.stiffness_s2 = 20.0f;
    Sim* sim = create(d);
    // The head leans back and forth hard: the strand is thrown against it.
    float nearest = 1.0f, nearest_without = 1.0f;
    d.collider_count = 0;
    Sim* without = create(d);
    for (int tick = 0; tick < 120; ++tick) {
        SimHead heads[4] = {0};
        for (int s = 0; s < 4; ++s) {
            memcpy(heads[s].rotation, identity, sizeof identity);
            heads[s].second_difference = vec3(0, 0, tick < 30 ? 4e-4f : 0.0f);
        }
        sim_step(sim, heads);
        sim_step(without, heads);
        for (int k = 0; k < 2; ++k) {
            sim_positions(k ? without : sim, identity, false, positions);
            for (int n = 1; n < NODES; ++n) {
                float* least = k ? &nearest_without : &nearest;
                *least = fminf(*least, vec3_length(vec3_sub(positions[n], head.from)));
            }
        }
    }
    assert_true(nearest_without < 0.07f); // it would have gone in
    assert_true(nearest > 0.0859f);       // radius and pearl
    sim_destroy(sim);
    sim_destroy(without);
}

static void a_rest_pose_inside_a_collider_stays(void** state)
{
    (void)state;
    Vec3 rest[NODES], positions[NODES];
    const Collider head = {{0, 0.1f, 0}, {0, 0.1f, 0}, 0.08f, BODY_HEAD};
    for (int n = 0; n < NODES; ++n)
        rest[n] = vec3(0.01f * (float)n, 0.2f - LINK_M * (float)n, 0.05f);
    Sim* sim = create(beside_a_head(rest, &head));
    float rotation[9];
    rotation_of(rotation, tilt(40.0));
    sim_reset(sim, rotation);
    stand(sim, rotation, 120, 4);
    sim_positions(sim, rotation, false, positions);
    for (int n = 0; n < NODES; ++n)
        assert_true(vec3_length(vec3_sub(positions[n], rest[n])) < 1e-6f);
    sim_destroy(sim);
}

static void a_node_pushed_out_is_not_thrown_off(void** state)
{
    (void)state;
    // One node falls on a sphere: it may lie there, but never rise above the surface again.
    const Vec3 rest[2] = {{0, 0.2f, 0}, {0, 0.15f, 0}};
    const Collider head = {{0, 0, 0}, {0, 0, 0}, 0.1f, BODY_HEAD};
    SimDefinition d = oscillator(rest, 0.0f, 0.0f);
    d.substeps = 4;
    d.gravity_compensation = false;
    d.colliders = &head;
    d.collider_count = 1;
    Sim* sim = create(d);
    bool landed = false;
    for (int tick = 0; tick < 120; ++tick) {
        Vec3 position[2], previous[2];
        stand(sim, identity, 1, 4);
        sim_state(sim, position, previous);
        landed = landed || position[1].y < 0.1065f;
        if (landed) assert_near((double)position[1].y, 0.106, 2e-4);
    }
    assert_true(landed);
    sim_destroy(sim);
}

static void a_definition_out_of_range_names_the_field(void** state)
{
    (void)state;
    Vec3 rest[NODES];
    hang(rest, 1, NODES, LINK_M);
    SimDefinition good = sim_default();
    good.strands = 1;
    good.nodes = NODES;
    good.rest = rest;
    SimDefinition bad[6] = {good, good, good, good, good, good};
    const char* names[6] = {"strands", "nodes", "rate_hz", "damping", "stiffness", "finite"};
    Vec3 broken[NODES];
    memcpy(broken, rest, sizeof rest);
    broken[3].y = NAN;
    bad[0].strands = 0;
    bad[1].nodes = 1;
    bad[2].rate_hz = (double)NAN;
    bad[3].damping_per_s = -1.0f;
    bad[4].stiffness_s2 = 1e9f;
    bad[5].rest = broken;
    for (int i = 0; i < 6; ++i) {
        Fault fault = {0};
        assert_null(sim_create(&bad[i], &fault));
        assert_non_null(strstr(fault.text, names[i]));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_undamped_node_swings_at_the_root_of_its_stiffness),
        cmocka_unit_test(a_damped_node_decays_by_half_its_damping),
        cmocka_unit_test(damping_does_not_depend_on_the_rate),
        cmocka_unit_test(a_compensated_rest_pose_stays_at_every_tilt),
        cmocka_unit_test(hair_comes_back_to_rest_after_a_shake),
        cmocka_unit_test(threads_and_neighbours_change_no_bit),
        cmocka_unit_test(hair_a_hundred_kilometres_away_moves_alike),
        cmocka_unit_test(a_turned_state_moves_like_the_unturned_one),
        cmocka_unit_test(a_hanging_chain_stretches_as_its_closed_form),
        cmocka_unit_test(sweeps_side_by_side_have_the_bits_of_one_after_another),
        cmocka_unit_test(published_lengths_are_those_at_rest),
        cmocka_unit_test(a_skinned_tip_stays_on_the_head_and_links_keep_their_length),
        cmocka_unit_test(a_share_of_skin_means_the_same_at_every_rate),
        cmocka_unit_test(nodes_stay_outside_a_collider),
        cmocka_unit_test(a_rest_pose_inside_a_collider_stays),
        cmocka_unit_test(a_node_pushed_out_is_not_thrown_off),
        cmocka_unit_test(a_definition_out_of_range_names_the_field),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
