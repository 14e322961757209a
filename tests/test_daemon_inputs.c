// Heads that are moved, blown on and tuned from outside: what the hair of a daemon does.
#include "server/inputs.h"
#include "tests/daemon.h"

// Sways for a second, rests; at tick 120, when hair still swings, something happens.
static void sway_and(Daemon* daemon, Heard* to, int n, double x, PoseVerb verb)
{
    double t = n / 60.0;
    double sway = n < 60 ? 0.3 * sin(4.0 * M_PI * t) : 0.0;
    send_pose_of(daemon, t, n < 120 ? sway : x, 0.0, n < 120 ? 1 : 2, n < 120 ? POSE_FOLLOW : verb);
    tick(daemon, to);
}

static void a_carry_leaves_the_hair_bit_equal(void** state)
{
    (void)state;
    DaemonOptions a = options_for(&heard, "bus"), b = options_for(&other, "bus");
    Daemon *still = create(&a, &heard), *carried = create(&b, &other);
    static uint16_t rest[sizeof heard.positions / 2];
    tick(still, &heard);
    tick(carried, &other);
    memcpy(rest, heard.positions, sizeof rest);
    for (int n = 1; n < 180; ++n) {
        sway_and(still, &heard, n, 0.0, POSE_FOLLOW);
        sway_and(carried, &other, n, 1.0, POSE_CARRY);
        assert_true(same_hair());
        if (n == 125) assert_memory_not_equal(rest, heard.positions, sizeof rest); // it swings
    }
    assert_true(other.frame[0].pose.position.x == 1.0);
    assert_int_equal(other.frame[0].segment, heard.frame[0].segment + 1);
    daemon_destroy(still);
    daemon_destroy(carried);
}

static void a_jump_without_a_segment_is_carried_told_once_and_counted(void** state)
{
    (void)state;
    DaemonOptions a = options_for(&heard, "bus"), b = options_for(&other, "bus");
    Daemon *still = create(&a, &heard), *jumping = create(&b, &other);
    for (int n = 0; n < 240; ++n) {
        double sway = n < 60 ? 0.3 * sin(4.0 * M_PI * n / 60.0) : 0.0;
        double jump = n < 120 ? 0.0 : n < 180 ? 2.0 : 1.0;
        send_pose_of(still, n / 60.0, sway, 0.0, 1, POSE_FOLLOW);
        send_pose_of(jumping, n / 60.0, sway + jump, 0.0, 1, POSE_FOLLOW);
        tick(still, &heard);
        tick(jumping, &other);
        daemon_publish_background(jumping, 16667);
        assert_true(same_hair());
        assert_int_equal(other.frame[0].segment, heard.frame[0].segment + (n >= 120) + (n >= 180));
    }
    assert_true(other.frame[0].pose.position.x == 1.0);
    assert_int_equal(other.notices, 1);
    assert_non_null(strstr(other.notice, "jumped"));
    assert_int_equal(daemon_status(jumping).jumps, 2);
    assert_int_equal(daemon_status(jumping).rejected, 0);
    assert_int_equal(other.status.jumps, 2);
    assert_int_equal(daemon_status(still).jumps, 0);
    daemon_destroy(still);
    daemon_destroy(jumping);
}

static void a_reset_brings_hair_to_rest_and_a_fast_follow_does_not(void** state)
{
    (void)state;
    for (int k = 0; k < 2; ++k) {
        DaemonOptions a = options_for(&heard, "bus"), b = options_for(&other, "none");
        Daemon *moved = create(&a, &heard), *rest = create(&b, &other);
        tick(rest, &other);
        for (int n = 0; n <= 130; ++n)
            sway_and(moved, &heard, n, 1.0, k ? POSE_RESET : POSE_FOLLOW);
        assert_int_equal(same_hair(), k);
        daemon_destroy(moved);
        daemon_destroy(rest);
    }
}

// Sways, is frozen at tick 60, turns by `turn` until tick 80, thaws at tick 100.
static void sway_and_freeze(Daemon* daemon, Heard* to, int n, double turn)
{
    double yaw = turn * fmin(fmax(n - 60, 0) / 20.0, 1.0);
    if (n < 60)
        sway_and(daemon, to, n, 0.0, POSE_FOLLOW);
    else
        send_pose_of(daemon, n / 60.0, 0.0, yaw, n < 100 ? 2 : 3,
                     n < 100 ? POSE_FREEZE : POSE_CARRY);
    if (n >= 60) tick(daemon, to);
}

static void frozen_hair_is_rigid_with_the_head_and_thaws_where_it_was(void** state)
{
    (void)state;
    DaemonOptions a = options_for(&heard, "bus"), b = options_for(&other, "bus");
    Daemon *turned = create(&a, &heard), *straight = create(&b, &other);
    static uint16_t frozen[sizeof heard.positions / 2];
    for (int n = 0; n < 110; ++n) {
        sway_and_freeze(turned, &heard, n, 2.0);
        sway_and_freeze(straight, &other, n, 0.0);
        if (n == 60) memcpy(frozen, heard.positions, sizeof frozen);
        if (n < 60 || n >= 100) continue;
        assert_memory_equal(frozen, heard.positions, sizeof frozen);
    }
    assert_true(fabs(heard.frame[0].pose.orientation.y) > 0.8); // the head did turn
    // Thawed, the hair goes on, and as if the head had not turned meanwhile.
    assert_memory_not_equal(frozen, heard.positions, sizeof frozen);
    for (int i = 0; i < 64 * 8 * 3; ++i)
        assert_in_range(heard.positions[0][i] + 8 - other.positions[0][i], 0, 16);
    daemon_destroy(turned);
    daemon_destroy(straight);
}

static void a_teleporting_motion_keeps_hair_at_rest(void** state)
{
    (void)state;
    DaemonOptions a = options_for(&heard, "teleport"), b = options_for(&other, "none");
    Daemon *jumping = create(&a, &heard), *rest = create(&b, &other);
    for (int n = 0; n < 260; ++n) {
        tick(jumping, &heard);
        tick(rest, &other);
        assert_true(same_hair());
        assert_int_equal(heard.frame[0].segment, n / 120);
    }
    daemon_destroy(jumping);
    daemon_destroy(rest);
}

// Tips that are further than 5 % of the box from where `other` has them, along x.
static int tips_blown(void)
{
    int blown = 0;
    for (int i = 0; i < 64; ++i) {
        int at = (i * 8 + 7) * 3;
        blown += heard.positions[0][at] - other.positions[0][at] > 65535 / 20;
    }
    return blown;
}

static void a_gust_visibly_moves_long_hair_and_it_comes_back(void** state)
{
    (void)state;
    DaemonOptions a = options_for(&heard, "gust"), b = options_for(&other, "none");
    Daemon *blown = create(&a, &heard), *rest = create(&b, &other);
    tick(rest, &other);
    for (int n = 0; n < 240; ++n) {
        tick(blown, &heard);
        if (n == 0) assert_int_equal(tips_blown(), 0);
        if (n == 50) assert_true(tips_blown() > 32);
    }
    for (int i = 0; i < 64 * 8 * 3; ++i)
        assert_in_range(heard.positions[0][i] + 200 - other.positions[0][i], 0, 400);
    assert_int_equal(daemon_status(blown).clamped, 0);
    daemon_destroy(blown);
    daemon_destroy(rest);
}

static void a_wind_blows_on_its_slots_until_it_is_over(void** state)
{
    (void)state;
    DaemonOptions a = options_for(&heard, "none"), b = options_for(&other, "none");
    a.characters = b.characters = 2;
    Daemon *blown = create(&a, &heard), *rest = create(&b, &other);
    tick(rest, &other);
    for (int n = 0; n < 300; ++n) {
        if (n == 5) send_wind(blown, 0, 1, vec3(8, 0, 0), 0.25f);
        if (n == 100) send_wind(blown, 0, 1024, vec3(0, 0, 0), 0.0f);
        tick(blown, &heard);
        if (n == 4) assert_int_equal(tips_blown(), 0);
        if (n == 60) assert_true(tips_blown() > 32);
        if (n < 100)
            assert_memory_equal(heard.positions[1], other.positions[1], sizeof heard.positions[1]);
    }
    assert_int_equal(heard.applied, 2);
    assert_string_equal(heard.last_applied.channel, CHANNEL_WIND);
    for (int i = 0; i < 64 * 8 * 3; ++i)
        assert_in_range(heard.positions[0][i] + 200 - other.positions[0][i], 0, 400);
    daemon_destroy(blown);
    daemon_destroy(rest);
}

// The hash of a daemon that was made so, or was made otherwise and tuned before its first tick.
static uint64_t hash_of_tuned(const TuningMessage* tuning, SimDefinition made)
{
    DaemonOptions options = options_for(&heard, "shake");
    options.sim = made;
    Daemon* daemon = create(&options, &heard);
    if (tuning != NULL) send_tuning(daemon, *tuning);
    for (int n = 0; n < 60; ++n)
        tick(daemon, &heard);
    assert_int_equal(daemon_status(daemon).rejected, 0);
    assert_int_equal(heard.applied, tuning != NULL);
    if (tuning != NULL) assert_string_equal(heard.last_applied.channel, CHANNEL_TUNING);
    if (tuning != NULL) assert_int_equal(heard.last_applied.tick, 0);
    uint64_t hash = daemon_state_hash(daemon);
    daemon_destroy(daemon);
    return hash;
}

static void a_tuned_daemon_goes_on_as_one_that_was_made_so(void** state)
{
    (void)state;
    TuningMessage tuning = {.slot_count = 1024,
                            .stiffness_s2 = 300,
                            .damping_per_s = 5,
                            .drag_per_s = 3,
                            .iterations = 2,
                            .pearl_radius_m = 0.01f};
    SimDefinition plain = sim_default(), made = plain;
    tuning.set = TUNING_EVERY & ~TUNING_GRAVITY;
    made.stiffness_s2 = 300;
    made.damping_per_s = 5;
    made.iterations = 2;
    made.pearl_radius_m = 0.01f;
    assert_true(hash_of_tuned(&tuning, plain) == hash_of_tuned(NULL, made));
    // A bit that is not set leaves its field.
    tuning.set = TUNING_DAMPING;
    made = plain;
    made.damping_per_s = 5;
    assert_true(hash_of_tuned(&tuning, plain) == hash_of_tuned(NULL, made));
    assert_true(hash_of_tuned(&tuning, plain) != hash_of_tuned(NULL, plain));
}

static void less_gravity_lifts_the_hair_of_its_slots_within_a_tick(void** state)
{
    (void)state;
    DaemonOptions a = options_for(&heard, "none"), b = options_for(&other, "none");
    a.characters = b.characters = 2;
    Daemon *wet = create(&a, &heard), *dry = create(&b, &other);
    tick(wet, &heard);
    tick(dry, &other);
    assert_true(same_hair());
    send_tuning(wet, (TuningMessage){.first_slot = 1, .slot_count = 1, .set = TUNING_GRAVITY});
    tick(wet, &heard);
    assert_false(same_hair());
    for (int n = 0; n < 60; ++n)
        tick(wet, &heard);
    assert_memory_equal(heard.positions[0], other.positions[0], sizeof heard.positions[0]);
    assert_true(heard.positions[1][7 * 3 + 1] > other.positions[1][7 * 3 + 1] + 1000);
    daemon_destroy(wet);
    daemon_destroy(dry);
}

static void an_unstable_tuning_is_refused_told_once_and_counted(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "shake");
    Daemon* daemon = create(&options, &heard);
    for (int n = 0; n < 60; ++n) {
        if (n % 20 == 5)
            send_tuning(daemon, (TuningMessage){.slot_count = 1024,
                                                .set = TUNING_STIFFNESS | TUNING_DAMPING,
                                                .stiffness_s2 = 9e5f,
                                                .damping_per_s = 1});
        tick(daemon, &heard);
    }
    assert_int_equal(heard.notices, 1);
    assert_non_null(strstr(heard.notice, "stiffness_s2"));
    assert_int_equal(daemon_status(daemon).rejected, 3);
    assert_true(daemon_state_hash(daemon) == hash_of(1, 1)); // nothing of it was taken
    daemon_destroy(daemon);
}

static void inputs_wait_for_the_tick_and_are_said_as_applied(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "bus");
    Daemon* daemon = create(&options, &heard);
    tick(daemon, &heard);
    send_pose_of(daemon, 1.0, 2.0, 0.0, 1, POSE_FOLLOW);
    assert_int_equal(heard.applied, 0);
    tick(daemon, &heard);
    assert_int_equal(heard.applied, 1);
    assert_int_equal(heard.last_applied.tick, 1);
    assert_string_equal(heard.last_applied.channel, CHANNEL_POSE);
    assert_true(heard.frame[0].pose.position.x == 2.0);
    daemon_destroy(daemon);
}

static void send_torso(Daemon* daemon, double t, double height, int slot)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    PoseMessage message = {.utime = (int64_t)(t * 1e6),
                           .pose = {{0.6 * slot, height, 0}, quat_identity()},
                           .slot = (uint16_t)slot};
    daemon_receive(daemon, CHANNEL_TORSO, bytes, pose_encode(bytes, sizeof bytes, &message));
}

// Two seconds under the head of slot 1, at rest 0.6 m aside, while its torso rises by `height`.
static void shrug(Heard* of, double height, bool has_torso)
{
    DaemonOptions options = options_for(of, "none");
    options.characters = 2;
    Daemon* daemon = create(&options, of);
    for (int i = 0; i < 120; ++i) {
        double part = fmin(1, i / 60.0);
        if (has_torso) send_torso(daemon, 1 + i / 60.0, height * part, 1);
        tick(daemon, of);
    }
    assert_int_equal(daemon_status(daemon).rejected, 0);
    daemon_destroy(daemon);
}

// How far apart texels are at most, quanta.
static int apart_in(const Heard* a, const Heard* b, int slot)
{
    int most = 0;
    for (int i = 0; i < 64 * 8 * 3; ++i) {
        int d = abs(a->positions[slot][i] - b->positions[slot][i]);
        most = d > most ? d : most;
    }
    return most;
}

static int apart(const Heard* a, const Heard* b)
{
    return apart_in(a, b, 1);
}

static void a_torso_posed_by_the_bus_pushes_hair(void** state)
{
    (void)state;
    shrug(&heard, 0, false);
    shrug(&other, 0, true);
    assert_true(apart(&heard, &other) <= 1); // where the head has it anyway
    assert_int_equal(other.applied, 120);
    assert_string_equal(other.last_applied.channel, CHANNEL_TORSO);
    shrug(&other, 0.06, true);
    assert_true(apart(&heard, &other) > 500); // a shrug lifts the hair that lies on the shoulders
}

// How a torso that stands 6 cm too high comes to be under the hair.
typedef enum Coming { FIRST_POSE, NEW_SEGMENT, JUMP, HEAD_RESET, HEAD_CARRIED, THAW } Coming;

static void send_torso_to(Daemon* daemon, double t, double x, int segment)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    PoseMessage message = {.utime = (int64_t)(t * 1e6),
                           .pose = {{x, 0.06, 0}, quat_identity()},
                           .segment = segment,
                           .verb = POSE_CARRY};
    daemon_receive(daemon, CHANNEL_TORSO, bytes, pose_encode(bytes, sizeof bytes, &message));
}

// Head and torso are a metre apart until tick 60; of frozen hair the torso comes half a second
// before that.
static void send_both(Daemon* daemon, Coming how, int n)
{
    static const PoseVerb verbs[] = {[HEAD_RESET] = POSE_RESET, [HEAD_CARRIED] = POSE_CARRY};
    bool is_over = n >= 60, is_head = how == HEAD_RESET || how == HEAD_CARRIED;
    double t = 1 + n / 60.0, away = n >= (how == THAW ? 30 : 60) ? 0.0 : 1.0;
    PoseVerb verb = is_head ? verbs[how] : how == THAW && !is_over ? POSE_FREEZE : POSE_FOLLOW;
    send_pose_of(daemon, t, is_head ? away : 0.0, 0.0, is_head && is_over, verb);
    if (how != FIRST_POSE || is_over)
        send_torso_to(daemon, t, is_head ? 0.0 : away, how == NEW_SEGMENT && is_over);
}

// How far a node moves in a tick at most from then on, quanta on an axis.
static int thrown(Coming how)
{
    DaemonOptions options = options_for(&heard, "bus");
    Daemon* daemon = create(&options, &heard);
    int most = 0;
    for (int n = 0; n < 120; ++n) {
        memcpy(&other, &heard, sizeof other);
        send_both(daemon, how, n);
        tick(daemon, &heard);
        int moved = n < 60 ? 0 : apart_in(&heard, &other, 0);
        most = moved > most ? moved : most;
    }
    daemon_destroy(daemon);
    return most;
}

static void a_torso_that_is_put_under_hair_throws_none(void** state)
{
    (void)state;
    for (Coming how = FIRST_POSE; how <= THAW; ++how) {
        int moved = thrown(how);
        assert_in_range(moved, 1000, 2000); // it is pushed aside all the same
    }
}

// A head that teleports by itself, away from its torso and back.
static void a_motion_that_teleports_to_its_torso_throws_no_hair(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "teleport");
    Daemon* daemon = create(&options, &heard);
    int most = 0;
    for (int n = 0; n < 300; ++n) {
        memcpy(&other, &heard, sizeof other);
        send_torso_to(daemon, 1 + n / 60.0, 0.0, 0);
        tick(daemon, &heard);
        int moved = n < 60 ? 0 : apart_in(&heard, &other, 0);
        most = moved > most ? moved : most;
    }
    assert_in_range(most, 1000, 2000);
    daemon_destroy(daemon);
}

static void a_torso_for_nobody_is_refused(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "none");
    Daemon* daemon = create(&options, &heard);
    for (int n = 0; n < 70; ++n) {
        send_torso(daemon, 1 + n / 60.0, 0, 3);
        tick(daemon, &heard);
    }
    assert_int_equal(heard.notices, 0); // it may still be added
    for (int n = 70; n < 100; ++n) {
        send_torso(daemon, 1 + n / 60.0, 0, 3);
        tick(daemon, &heard);
    }
    assert_int_equal(heard.notices, 1);
    assert_non_null(strstr(heard.notice, "without a character"));
    assert_int_equal(daemon_status(daemon).rejected, 100);
    daemon_destroy(daemon);
}

static void heads_and_torsos_of_all_slots_are_heard_in_one_tick(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "bus");
    options.characters = 0;
    Daemon* daemon = create(&options, &heard);
    for (int slot = 0; slot < CHANNEL_MAX_SLOTS; ++slot) {
        uint8_t bytes[CONTROL_MAX_BYTES];
        PoseMessage message = {.pose = {.orientation = quat_identity()}, .slot = (uint16_t)slot};
        size_t size = pose_encode(bytes, sizeof bytes, &message);
        daemon_receive(daemon, CHANNEL_POSE, bytes, size);
        daemon_receive(daemon, CHANNEL_TORSO, bytes, size);
    }
    tick(daemon, &heard);
    assert_int_equal(heard.applied, 2 * CHANNEL_MAX_SLOTS);
    daemon_destroy(daemon);
}

static void a_flood_of_poses_keeps_the_newest(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "bus");
    Daemon* daemon = create(&options, &heard);
    for (int i = 0; i < 3 * INPUTS_MAX; ++i)
        send_pose_of(daemon, 1.0 + i * 1e-3, i, 0.0, i, POSE_RESET);
    tick(daemon, &heard);
    assert_int_equal(heard.applied, INPUTS_MAX);
    assert_true(heard.frame[0].pose.position.x == 3.0 * INPUTS_MAX - 1);
    assert_int_equal(daemon_status(daemon).rejected, 0);
    daemon_destroy(daemon);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_carry_leaves_the_hair_bit_equal),
        cmocka_unit_test(a_jump_without_a_segment_is_carried_told_once_and_counted),
        cmocka_unit_test(a_reset_brings_hair_to_rest_and_a_fast_follow_does_not),
        cmocka_unit_test(frozen_hair_is_rigid_with_the_head_and_thaws_where_it_was),
        cmocka_unit_test(a_teleporting_motion_keeps_hair_at_rest),
        cmocka_unit_test(a_gust_visibly_moves_long_hair_and_it_comes_back),
        cmocka_unit_test(a_wind_blows_on_its_slots_until_it_is_over),
        cmocka_unit_test(a_tuned_daemon_goes_on_as_one_that_was_made_so),
        cmocka_unit_test(less_gravity_lifts_the_hair_of_its_slots_within_a_tick),
        cmocka_unit_test(an_unstable_tuning_is_refused_told_once_and_counted),
        cmocka_unit_test(inputs_wait_for_the_tick_and_are_said_as_applied),
        cmocka_unit_test(a_torso_posed_by_the_bus_pushes_hair),
        cmocka_unit_test(a_torso_that_is_put_under_hair_throws_none),
        cmocka_unit_test(a_motion_that_teleports_to_its_torso_throws_no_hair),
        cmocka_unit_test(a_torso_for_nobody_is_refused),
        cmocka_unit_test(heads_and_torsos_of_all_slots_are_heard_in_one_tick),
        cmocka_unit_test(a_flood_of_poses_keeps_the_newest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
