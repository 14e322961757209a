// The pose ring: linear motion exact, no comb at the source's rate, no jump whatever is lost.
#include "messages/random.h"
#include "messages/trig.h"
#include "server/motion.h"
#include "server/poses.h"
#include "server/sim.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define TICK_S (1.0 / 60.0)

typedef struct Source {
    Pose (*at)(double t);
    double interval_s, jitter_s; // of the sending, truly stamped
    double delay_jitter_s;       // of the arrival
    double clock_s;              // sender's clock - ours
    uint32_t seed;
} Source;

static PoseMessage message_at(const Source* source, int i)
{
    double t = i * source->interval_s +
               source->jitter_s * (double)random_signed(source->seed, (uint32_t)i);
    return (PoseMessage){.utime = (int64_t)((t + source->clock_s) * 1e6),
                         .pose = source->at(t),
                         .segment = 1,
                         .verb = POSE_FOLLOW};
}

static double arrival(const Source* source, int i)
{
    return i * source->interval_s + 0.004 +
           source->delay_jitter_s * (double)random_unit(source->seed + 1, (uint32_t)i);
}

// Runs a source into a ring tick by tick; fills path[] at `per_tick` substeps of each tick.
static void play(PoseRing* ring, const Source* source, int ticks, int per_tick, Pose* path)
{
    int next = 0;
    poses_init(ring, source->at(0.0), TICK_S);
    for (int tick = 0; tick < ticks; ++tick) {
        double now = tick * TICK_S;
        for (; arrival(source, next) <= now; ++next) {
            PoseMessage message = message_at(source, next);
            poses_push(ring, &message, now);
        }
        for (int s = 0; s < per_tick; ++s)
            path[tick * per_tick + s] = poses_at(ring, now + (s + 1) * TICK_S / per_tick);
    }
}

static Pose walk(double t)
{
    return (Pose){{1.5 * t, -0.25 * t, 0.5}, {0, 0, 0, 1}};
}

static Pose sway(double t)
{
    double yaw = 0.4 * trig_sin(5.1 * t);
    return (Pose){{0.15 * trig_sin(6.3 * t), 0.05 * trig_sin(4.3 * t), 0.1 * trig_cos(5.7 * t)},
                  {0, trig_sin(0.5 * yaw), 0, trig_cos(0.5 * yaw)}};
}

static Pose still(double t)
{
    (void)t;
    return (Pose){{100000.3, 1.7, -70000.1}, {0, 0.6, 0, 0.8}};
}

static double largest_kick(const Pose* path, int from, int to)
{
    double largest = 0.0;
    for (int i = from + 2; i < to; ++i) {
        Vec3d d = vec3d_sub(vec3d_sub(path[i].position, path[i - 1].position),
                            vec3d_sub(path[i - 1].position, path[i - 2].position));
        largest = fmax(largest, sqrt(vec3d_dot(d, d)));
    }
    return largest;
}

static void linear_motion_is_exact_at_any_jitter(void** state)
{
    (void)state;
    static Pose path[600 * 4];
    const double rates[] = {20.0, 30.0, 60.0, 144.0};
    for (int k = 0; k < 4; ++k) {
        const double interval = 1.0 / rates[k];
        Source source = {walk, interval, 0.3 * interval, 0.002, 1234.5, 7};
        PoseRing ring;
        play(&ring, &source, 600, 4, path);
        // The same step every substep, but for the slow approach of the clocks (0.5 %) and a lag
        // that is set anew once in seconds (a source this uneven is never quite measured).
        for (int i = 1800; i < 2400; ++i) {
            double step = path[i].position.x - path[i - 1].position.x;
            assert_true(fabs(step / (1.5 * TICK_S / 4) - 1.0) < 0.02);
        }
        assert_true(largest_kick(path, 1800, 2400) < 0.01 * 1.5 * TICK_S / 4);
    }
}

static void latency_is_bounded(void** state)
{
    (void)state;
    static Pose path[600];
    const double rates[] = {20.0, 60.0, 120.0};
    for (int k = 0; k < 3; ++k) {
        Source source = {walk, 1.0 / rates[k], 0.0, 0.0, -50.0, 7};
        PoseRing ring;
        play(&ring, &source, 600, 1, path);
        double behind = 600 * TICK_S - path[599].position.x / 1.5;
        assert_true(behind > 1.0 / rates[k]);
        assert_true(behind < 2.5 / rates[k] + 2.5 * TICK_S + 0.004);
    }
}

static void a_head_at_rest_is_at_rest_to_the_bit(void** state)
{
    (void)state;
    static Pose path[300 * 4];
    Source source = {still, 0.05, 0.001, 0.003, 77.0, 3};
    PoseRing ring;
    play(&ring, &source, 300, 4, path);
    for (int i = 200; i < 1200; ++i)
        assert_memory_equal(&path[i], &path[199], sizeof path[i]);
}

static void starvation_ends_smoothly(void** state)
{
    (void)state;
    // Every message of 0.3 s out of each second is lost, and the rest come up to 40 ms late: the
    // path slows and catches up, but its acceleration stays that of a head.
    static Pose path[1200 * 4];
    Source source = {sway, 1.0 / 30.0, 0.002, 0.04, 5.0, 11};
    PoseRing ring;
    int next = 0;
    poses_init(&ring, sway(0.0), TICK_S);
    for (int tick = 0; tick < 1200; ++tick) {
        double now = tick * TICK_S;
        for (; arrival(&source, next) <= now; ++next) {
            PoseMessage message = message_at(&source, next);
            if (next % 30 < 21) poses_push(&ring, &message, now);
        }
        for (int s = 0; s < 4; ++s)
            path[tick * 4 + s] = poses_at(&ring, now + (s + 1) * TICK_S / 4);
    }
    double dt = TICK_S / 4;
    // 0.3 m made good within one interval of 33 ms and smoothed over two is 270 m/s^2; a path that
    // changes behind its reader jumps those 0.3 m at once, 17,000 m/s^2.
    double kick = largest_kick(path, 240, 4800) / (dt * dt);
    print_message("largest acceleration %.0f m/s^2\n", kick);
    assert_true(kick < 600.0);
}

static PoseMessage pose_message(double t, Vec3d position, int segment, PoseVerb verb)
{
    return (PoseMessage){.utime = (int64_t)(t * 1e6),
                         .pose = {position, quat_identity()},
                         .segment = segment,
                         .verb = (uint8_t)verb};
}

// A sway that is carried 1 m aside at 2 s, with `lost` messages of the new segment never heard.
static void carried(int lost, Pose* path, PoseRing* ring)
{
    poses_init(ring, sway(0.0), TICK_S);
    for (int tick = 0; tick < 240; ++tick) {
        double now = tick * TICK_S;
        Vec3d at = sway(now).position;
        if (tick >= 120) at.x += 1.0;
        PoseMessage message = pose_message(now, at, tick < 120 ? 1 : 2, POSE_CARRY);
        if (tick < 120 || tick >= 120 + lost) poses_push(ring, &message, now);
        ring->pending = false;
        for (int s = 0; s < 4; ++s) {
            path[tick * 4 + s] = poses_at(ring, now + (s + 1) * TICK_S / 4);
            if (tick >= 120 + lost) path[tick * 4 + s].position.x -= 1.0;
        }
    }
}

static void a_lost_carry_is_made_by_the_next_message_without_a_jump(void** state)
{
    (void)state;
    static Pose path[240 * 4];
    double dt = TICK_S / 4;
    for (int lost = 0; lost < 3; ++lost) {
        PoseRing ring;
        carried(lost, path, &ring);
        assert_int_equal(ring.segment, 2);
        // But for the metre itself the path is one: what is left is the guess of where the head
        // would have been, which a sway of 6 m/s^2 misses by little.
        double step = 0.0;
        for (int i = 440; i < 960; ++i) {
            Vec3d d = vec3d_sub(path[i].position, path[i - 1].position);
            step = fmax(step, sqrt(vec3d_dot(d, d)));
        }
        assert_true(step < 2.2 * dt + 0.003 * (lost + 1));
    }
}

static void verbs_are_reported_once_by_whichever_message_is_heard_first(void** state)
{
    (void)state;
    const PoseVerb verbs[] = {POSE_CARRY, POSE_RESET, POSE_FREEZE};
    for (int k = 0; k < 3; ++k) {
        PoseRing ring;
        poses_init(&ring, pose_identity(), TICK_S);
        PoseMessage first = pose_message(10.0, (Vec3d){0, 0, 0}, 1, POSE_FOLLOW);
        poses_push(&ring, &first, 0.0);
        assert_true(ring.pending && ring.pending_verb == POSE_CARRY); // nobody flies in
        ring.pending = false;
        for (int i = 3; i < 6; ++i) { // the first two of the segment are lost
            PoseMessage next = pose_message(10.0 + i * TICK_S, (Vec3d){5, 0, 0}, 2, verbs[k]);
            poses_push(&ring, &next, i * TICK_S);
            assert_int_equal(ring.pending, i == 3);
            if (i == 3)
                assert_int_equal(ring.pending_verb,
                                 verbs[k] == POSE_RESET ? POSE_RESET : POSE_CARRY);
            ring.pending = false;
            assert_int_equal(ring.frozen, verbs[k] == POSE_FREEZE);
            assert_true(poses_at(&ring, i * TICK_S + 0.001).position.x == 5.0);
        }
    }
}

static void follow_into_a_segment_is_a_fast_motion(void** state)
{
    (void)state;
    PoseRing ring;
    poses_init(&ring, pose_identity(), TICK_S);
    double last = 0.0, largest = 0.0;
    for (int i = 0; i < 120; ++i) {
        PoseMessage next = pose_message(i * TICK_S, (Vec3d){i < 60 ? 0.0 : 1.0, 0, 0},
                                        i < 60 ? 1 : 2, POSE_FOLLOW);
        poses_push(&ring, &next, i * TICK_S);
        assert_int_equal(ring.pending, i == 0);
        ring.pending = false;
        for (int s = 0; s < 4; ++s) {
            double x = poses_at(&ring, (i + 0.25 * (s + 1)) * TICK_S).position.x;
            largest = fmax(largest, x - last);
            last = x;
        }
    }
    assert_true(last == 1.0);
    assert_true(largest < 0.5);
}

// A sway that jumps by 1 m within its segment at 2 s, `lost` messages there never heard.
static void a_jump_within_a_segment_is_a_carry(void** state)
{
    (void)state;
    for (int lost = 0; lost < 3; ++lost) {
        PoseRing ring;
        double largest = 0.0, last = 0.0;
        poses_init(&ring, sway(0.0), TICK_S);
        for (int tick = 0; tick < 240; ++tick) {
            double now = tick * TICK_S;
            Vec3d at = sway(now).position;
            if (tick >= 120) at.x += 1.0;
            PoseMessage message = pose_message(now, at, 1, POSE_FOLLOW);
            bool jumps = false;
            if (tick < 120 || tick >= 120 + lost) jumps = poses_push(&ring, &message, now);
            assert_int_equal(jumps, tick == 120 + lost);
            assert_int_equal(ring.pending, jumps || tick == 0);
            if (jumps) assert_int_equal(ring.pending_verb, POSE_CARRY);
            ring.pending = false;
            for (int s = 0; s < 4; ++s) {
                double x = poses_at(&ring, now + (s + 1) * TICK_S / 4).position.x;
                if (tick >= 120 + lost) x -= 1.0;
                if (tick > 100) largest = fmax(largest, fabs(x - last));
                last = x;
            }
        }
        assert_true(largest < 1.2 * TICK_S / 4 + 0.003 * (lost + 1));
    }
}

static void a_turn_by_more_than_a_quarter_at_once_is_a_carry(void** state)
{
    (void)state;
    for (int wide = 0; wide < 2; ++wide) {
        PoseRing ring;
        poses_init(&ring, pose_identity(), TICK_S);
        for (int i = 0; i < 20; ++i) {
            PoseMessage m = pose_message(i * TICK_S, (Vec3d){0, 0, 0}, 1, POSE_FOLLOW);
            double yaw = i < 10 ? 0.0 : wide ? 1.7 : 1.4;
            // Either of the two quaternions that a rotation has.
            double sign = i % 2 ? 1.0 : -1.0;
            m.pose.orientation =
                (Quat){0, sign * trig_sin(0.5 * yaw), 0, sign * trig_cos(0.5 * yaw)};
            ring.pending = false;
            assert_int_equal(poses_push(&ring, &m, i * TICK_S), wide && i == 10);
            if (wide && i == 10) assert_true(ring.pending && ring.pending_is_turned);
        }
    }
}

// 110 degrees an interval, from one interval to the next: a jump, and then a motion.
static void a_steady_spin_is_one_jump_at_most(void** state)
{
    (void)state;
    PoseRing ring;
    int jumps = 0;
    poses_init(&ring, pose_identity(), TICK_S);
    for (int i = 0; i < 40; ++i) {
        PoseMessage m = pose_message(i * TICK_S, (Vec3d){0, 0, 0}, 1, POSE_FOLLOW);
        double yaw = i < 10 ? 0.0 : 1.92 * (i - 9), sign = i % 2 ? 1.0 : -1.0;
        m.pose.orientation = (Quat){0, sign * trig_sin(0.5 * yaw), 0, sign * trig_cos(0.5 * yaw)};
        jumps += poses_push(&ring, &m, i * TICK_S);
    }
    assert_int_equal(jumps, 1);
}

static int jumps_of(const char* motion, double rate_hz, int kept, int of)
{
    PoseRing ring;
    int jumps = 0;
    poses_init(&ring, pose_identity(), TICK_S);
    for (int i = 0; i < 13.0 * rate_hz; ++i) {
        double t = i / rate_hz;
        PoseMessage m = pose_message(t, (Vec3d){0, 0, 0}, 1, POSE_FOLLOW);
        m.pose = motion_find(motion)->at(t).pose;
        if (i % of < kept) jumps += poses_push(&ring, &m, t);
    }
    return jumps;
}

static void no_clip_jumps_at_any_rate_or_loss_but_teleports(void** state)
{
    (void)state;
    const char* const clips[] = {"none", "nod", "shake", "jump-stop", "run", "flip", "gust"};
    const double rates[] = {20, 30, 60, 144};
    for (int r = 0; r < 4; ++r) {
        for (size_t k = 0; k < sizeof clips / sizeof clips[0]; ++k) {
            assert_int_equal(jumps_of(clips[k], rates[r], 1, 1), 0);
            assert_int_equal(jumps_of(clips[k], rates[r], (int)rates[r], 2 * (int)rates[r]), 0);
            assert_int_equal(jumps_of(clips[k], rates[r], 2, 7), 0);
        }
        if (rates[r] > 36) assert_int_equal(jumps_of("turn", rates[r], 1, 1), 0);
        assert_int_equal(jumps_of("teleport", rates[r], 1, 1), 6);
    }
}

static void a_fast_car_and_its_brake_are_no_jumps(void** state)
{
    (void)state;
    PoseRing ring;
    double x = 0.0;
    poses_init(&ring, pose_identity(), TICK_S);
    for (int i = 0; i < 60; ++i) {
        PoseMessage m = pose_message(i * 0.05, (Vec3d){x, 0, 0}, 1, POSE_FOLLOW);
        assert_false(poses_push(&ring, &m, i * 0.05));
        if (i < 40) x += 1.5; // 30 m/s
    }
    // Off at once at that speed: one jump, and then a motion again.
    int jumps = 0;
    for (int i = 60; i < 80; ++i) {
        PoseMessage m = pose_message(i * 0.05, (Vec3d){x += 1.5, 0, 0}, 1, POSE_FOLLOW);
        jumps += poses_push(&ring, &m, i * 0.05);
    }
    assert_int_equal(jumps, 1);
}

static void older_messages_are_ignored_and_restarted_senders_are_not(void** state)
{
    (void)state;
    PoseRing ring;
    poses_init(&ring, pose_identity(), TICK_S);
    PoseMessage m = pose_message(100.0, (Vec3d){0, 0, 0}, 5, POSE_FOLLOW);
    poses_push(&ring, &m, 1.0);
    m = pose_message(99.99, (Vec3d){9, 0, 0}, 5, POSE_FOLLOW); // overtaken
    poses_push(&ring, &m, 1.01);
    m = pose_message(100.02, (Vec3d){9, 0, 0}, 4, POSE_FOLLOW); // of the segment before
    poses_push(&ring, &m, 1.02);
    assert_true(poses_at(&ring, 3.0).position.x == 0.0);
    assert_int_equal(ring.segment, 5);
    m = pose_message(3.0, (Vec3d){1, 0, 0}, 0, POSE_RESET); // another clock, from the beginning
    poses_push(&ring, &m, 1.03);
    assert_int_equal(ring.segment, 0);
    assert_true(poses_at(&ring, 1.03).position.x == 1.0);
}

// --- the comb
// -------------------------------------------------------------------------------------

#define COMB_TICKS 1200

static double band(const double* x, int n, double hz)
{
    double re = 0.0, im = 0.0;
    for (int i = 0; i < n; ++i) {
        double hann = 0.5 - 0.5 * cos(2.0 * TRIG_PI * i / n);
        re += hann * x[i] * cos(2.0 * TRIG_PI * hz * i / 240.0);
        im += hann * x[i] * sin(2.0 * TRIG_PI * hz * i / 240.0);
    }
    return sqrt(re * re + im * im);
}

// How far the tip's speed sticks out at `hz` (with the sidebands of the motion) over both sides.
static double comb(const double* speed, int n, double hz)
{
    double line = 0.0, beside = 0.0;
    for (double d = -1.5; d <= 1.5; d += 0.1)
        line = fmax(line, band(speed, n, hz + d));
    for (double d = 4.0; d <= 7.0; d += 0.1)
        beside = fmax(beside, fmax(band(speed, n, hz + d), band(speed, n, hz - d)));
    return line / beside;
}

// Speed of the tip of one strand whose head takes `path`, at 240 Hz.
static void tip_speed(double* speed, const Pose* path, int count)
{
    Vec3 rest[8], position[8], previous[8];
    for (int n = 0; n < 8; ++n)
        rest[n] = vec3(0.1f, 0.2f - 0.04f * (float)n, 0.0f);
    SimDefinition d = sim_default();
    d.strands = 1;
    d.nodes = 8;
    d.rest = rest;
    d.rate_hz = 240.0;
    d.substeps = 1;
    Sim* sim = sim_create(&d, NULL);
    for (int i = 2; i < count; ++i) {
        SimHead head = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
        Vec3d a = vec3d_sub(path[i].position, path[i - 1].position);
        Vec3d b = vec3d_sub(path[i - 1].position, path[i - 2].position);
        head.second_difference = vec3_from(vec3d_sub(a, b));
        sim_step(sim, &head);
        sim_state(sim, position, previous);
        speed[i] = 240.0 * (double)vec3_length(vec3_sub(position[7], previous[7]));
    }
    sim_destroy(sim);
}

static Pose linear(const Source* source, double t)
{
    int i = (int)(t / source->interval_s);
    PoseMessage a = message_at(source, i), b = message_at(source, i + 1);
    double u = (t * 1e6 - (double)a.utime) / (double)(b.utime - a.utime);
    Vec3d move = vec3d_sub(b.pose.position, a.pose.position);
    return (Pose){vec3d_add(a.pose.position, vec3d_scale(move, u)), quat_identity()};
}

static void a_slow_source_leaves_no_comb_in_tip_speed(void** state)
{
    (void)state;
    static Pose path[COMB_TICKS * 4];
    static double speed[COMB_TICKS * 4];
    const int from = 960, count = COMB_TICKS * 4 - from;
    Source source = {sway, 0.05, 0.001, 0.001, 0.0, 5};
    PoseRing ring;
    play(&ring, &source, COMB_TICKS, 4, path);
    tip_speed(speed, path, COMB_TICKS * 4);
    double ours[2] = {comb(speed + from, count, 20.0), comb(speed + from, count, 40.0)};
    for (int i = 0; i < COMB_TICKS * 4; ++i)
        path[i] = linear(&source, 1.0 + i / 240.0);
    tip_speed(speed, path, COMB_TICKS * 4);
    double line[2] = {comb(speed + from, count, 20.0), comb(speed + from, count, 40.0)};
    print_message("line over its sides at 20 and 40 Hz: %.2f %.2f, linear %.2f %.2f\n", ours[0],
                  ours[1], line[0], line[1]);
    assert_true(line[0] > 5.0 && line[1] > 5.0); // the measure sees a comb where there is one
    assert_true(ours[0] < 2.0 && ours[1] < 2.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(linear_motion_is_exact_at_any_jitter),
        cmocka_unit_test(latency_is_bounded),
        cmocka_unit_test(a_head_at_rest_is_at_rest_to_the_bit),
        cmocka_unit_test(starvation_ends_smoothly),
        cmocka_unit_test(a_lost_carry_is_made_by_the_next_message_without_a_jump),
        cmocka_unit_test(verbs_are_reported_once_by_whichever_message_is_heard_first),
        cmocka_unit_test(follow_into_a_segment_is_a_fast_motion),
        cmocka_unit_test(a_jump_within_a_segment_is_a_carry),
        cmocka_unit_test(a_turn_by_more_than_a_quarter_at_once_is_a_carry),
        cmocka_unit_test(a_steady_spin_is_one_jump_at_most),
        cmocka_unit_test(no_clip_jumps_at_any_rate_or_loss_but_teleports),
        cmocka_unit_test(a_fast_car_and_its_brake_are_no_jumps),
        cmocka_unit_test(older_messages_are_ignored_and_restarted_senders_are_not),
        cmocka_unit_test(a_slow_source_leaves_no_comb_in_tip_speed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
