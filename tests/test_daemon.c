// The daemon as an object: what goes in, what comes out, tick by tick. No network, no clock.
#include "messages/channels.h"
#include "messages/control.h"
#include "messages/frame.h"
#include "messages/style.h"
#include "server/daemon.h"
#include "server/groom.h"
#include "server/inputs.h"
#include "server/publish.h"
#include "tests/allocations.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

// --- what a daemon said
// ---------------------------------------------------------------------------

#define MAX_ROWS 1024

typedef struct Heard {
    // Of the last tick.
    FrameHeader frame[4]; // by slot
    int rows[4][MAX_ROWS];
    uint16_t positions[4][MAX_ROWS * HAIRSTYLE_MAX_NODES * 3];
    int guides;
    size_t largest_packet;
    // Since the start.
    int statuses, fast_parts, bulk_parts, applied, notices;
    AppliedMessage last_applied;
    char notice[400];
    StatusMessage status;
    size_t style_bytes;
    uint16_t last_part;
} Heard;

static void hear_guides(Heard* heard, const uint8_t* bytes, size_t size)
{
    FrameHeader header;
    const uint8_t *positions, *tangents;
    assert_int_equal(frame_decode(&header, &positions, &tangents, bytes, size), FRAME_OK);
    assert_true(header.slot < 4 && header.first_strand + header.strand_count <= MAX_ROWS);
    heard->frame[header.slot] = header;
    ++heard->guides;
    size_t row = (size_t)header.nodes * 3;
    for (int i = header.first_strand; i < header.first_strand + header.strand_count; ++i)
        ++heard->rows[header.slot][i];
    memcpy(&heard->positions[header.slot][header.first_strand * row], positions,
           header.strand_count * row * sizeof(uint16_t));
}

static void hear_part(Heard* heard, const uint8_t* bytes, size_t size)
{
    StylePart part;
    Fault fault = {0};
    if (!style_part_decode(&part, bytes, size, &fault)) fail_msg("%s", fault.text);
    ++*(part.lane == STYLE_FAST ? &heard->fast_parts : &heard->bulk_parts);
    heard->style_bytes += size;
    heard->last_part = part.part;
}

static void hear(void* context, int64_t utime, const char* channel, const uint8_t* bytes,
                 size_t size)
{
    Heard* heard = context;
    (void)utime;
    size_t packet = size + 20 + 8 + 8 + strlen(channel) + 1; // IP, UDP, LCM, its name
    if (packet > heard->largest_packet) heard->largest_packet = packet;
    if (strncmp(channel, CHANNEL_GUIDES_PREFIX, strlen(CHANNEL_GUIDES_PREFIX)) == 0) {
        hear_guides(heard, bytes, size);
    } else if (strcmp(channel, CHANNEL_STYLE) == 0) {
        hear_part(heard, bytes, size);
    } else if (strcmp(channel, CHANNEL_STATUS) == 0) {
        ++heard->statuses;
        assert_true(status_decode(&heard->status, bytes, size, NULL));
    } else {
        assert_string_equal(channel, CHANNEL_APPLIED);
        ++heard->applied;
        assert_true(applied_decode(&heard->last_applied, bytes, size, NULL));
    }
}

static void note(void* context, const char* text)
{
    Heard* heard = context;
    ++heard->notices;
    snprintf(heard->notice, sizeof heard->notice, "%s", text);
}

static DaemonOptions options_for(Heard* heard, const char* motion)
{
    memset(heard, 0, sizeof *heard);
    DaemonOptions options = daemon_default();
    options.motion = motion;
    options.fast = true;
    options.epoch = 1000;
    options.notice = (Notice){note, heard};
    return options;
}

static Daemon* create(const DaemonOptions* options, Heard* heard)
{
    Fault fault = {0};
    Daemon* daemon = daemon_create(options, &fault);
    if (daemon == NULL) fail_msg("%s", fault.text);
    daemon_add_sink(daemon, (DaemonSink){hear, heard});
    heard->notices = 0;
    return daemon;
}

static void tick(Daemon* daemon, Heard* heard)
{
    memset(heard->rows, 0, sizeof heard->rows);
    daemon_tick(daemon);
    for (int slice = 0; slice < 4; ++slice)
        daemon_publish_slice(daemon, slice, 4);
}

static void send_pose_of(Daemon* daemon, double t, double x, double yaw, int segment, PoseVerb verb)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    PoseMessage message = {.utime = (int64_t)(t * 1e6),
                           .pose = {{x, 0, 0}, {0, sin(yaw / 2), 0, cos(yaw / 2)}},
                           .segment = segment,
                           .verb = (uint8_t)verb};
    daemon_receive(daemon, CHANNEL_POSE, bytes, pose_encode(bytes, sizeof bytes, &message));
}

static void send_character(Daemon* daemon, int slot, CharacterVerb verb, const char* style)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    CharacterMessage message = {.slot = (uint16_t)slot, .verb = (uint8_t)verb};
    snprintf(message.style, sizeof message.style, "%s", style);
    daemon_receive(daemon, CHANNEL_CHARACTER, bytes,
                   character_encode(bytes, sizeof bytes, &message));
}

static void send_wind(Daemon* daemon, int first, int count, Vec3 velocity, float gust)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    WindMessage message = {.first_slot = (uint16_t)first,
                           .slot_count = (uint16_t)count,
                           .velocity = velocity,
                           .gust = gust,
                           .gust_hz = 3};
    daemon_receive(daemon, CHANNEL_WIND, bytes, wind_encode(bytes, sizeof bytes, &message));
}

static void send_tuning(Daemon* daemon, TuningMessage message)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    daemon_receive(daemon, CHANNEL_TUNING, bytes, tuning_encode(bytes, sizeof bytes, &message));
}

static bool try_scene(const char* text, DaemonOptions* options, char path[64], Fault* fault)
{
    strcpy(path, P_tmpdir "/strandcast-scene-XXXXXX");
    int file = mkstemp(path);
    assert_true(file >= 0 && write(file, text, strlen(text)) == (ssize_t)strlen(text));
    close(file);
    return daemon_use_scene(options, path, fault);
}

static Heard heard, other;

// --- publishing
// -----------------------------------------------------------------------------------

static void slices_together_hold_every_row_once(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "shake");
    options.characters = 3;
    Daemon* daemon = create(&options, &heard);
    assert_int_equal(daemon_tick_number(daemon), -1);
    for (int n = 0; n < 20; ++n) {
        tick(daemon, &heard);
        for (int slot = 0; slot < 3; ++slot) {
            const FrameHeader* frame = &heard.frame[slot];
            assert_int_equal(frame->tick, n);
            assert_int_equal(frame->epoch, 1000);
            assert_int_equal(frame->utime, (int64_t)(n * 1e6 / 60.0));
            for (int i = 0; i < daemon_status(daemon).guides; ++i)
                assert_int_equal(heard.rows[slot][i], 1);
        }
    }
    daemon_publish_styles(daemon);
    assert_true(heard.largest_packet <= 1500);
    assert_int_equal(daemon_status(daemon).clamped, 0);
    daemon_destroy(daemon);
}

static uint64_t hash_of(int threads, int characters)
{
    DaemonOptions options = options_for(&heard, "shake");
    options.sim.threads = threads;
    options.characters = characters;
    Daemon* daemon = create(&options, &heard);
    for (int n = 0; n < 60; ++n)
        daemon_tick(daemon);
    uint64_t hash = daemon_state_hash(daemon);
    daemon_destroy(daemon);
    return hash;
}

static void the_hash_does_not_depend_on_threads(void** state)
{
    (void)state;
    assert_true(hash_of(1, 1) == hash_of(2, 1));
    assert_true(hash_of(1, 5) == hash_of(3, 5));
    assert_true(hash_of(1, 1) != hash_of(1, 5));
}

static void count_bytes(void* context, int64_t utime, const char* channel, const uint8_t* bytes,
                        size_t size)
{
    (void)utime, (void)channel, (void)bytes;
    *(size_t*)context += size;
}

static void a_recording_gets_the_style_at_once_and_the_bus_in_its_time(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "none");
    Daemon* daemon = create(&options, &heard);
    tick(daemon, &heard);
    size_t recorded = 0, before = heard.style_bytes;
    daemon_record_styles(daemon, (DaemonSink){count_bytes, &recorded});
    assert_int_equal(heard.style_bytes, before);
    for (int n = 0; n < 30; ++n)
        daemon_publish_background(daemon, 16667);
    assert_true(recorded > 0);
    assert_int_equal(heard.style_bytes - before, recorded);
    daemon_destroy(daemon);
}

static void styles_are_sent_at_once_and_again_each_second(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "none");
    Daemon* daemon = create(&options, &heard);
    int after[4] = {0};
    for (int n = 0; n < 240; ++n) {
        tick(daemon, &heard);
        size_t before = heard.style_bytes;
        daemon_publish_background(daemon, 16667);
        assert_true(heard.style_bytes - before < 4200); // paced: a fiftieth of a second and a part
        if (n % 60 == 50) after[n / 60] = heard.fast_parts;
    }
    assert_true(after[0] > 0);
    for (int second = 1; second < 4; ++second)
        assert_int_equal(after[second], (second + 1) * after[0]);
    assert_in_range(heard.statuses, 3, 4);
    assert_int_equal(heard.status.characters, 1);
    assert_int_equal(heard.status.epoch, 1000);
    daemon_destroy(daemon);
}

static void a_request_brings_the_parts_it_names(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "none");
    Daemon* daemon = create(&options, &heard);
    tick(daemon, &heard);
    for (int n = 0; n < 30; ++n)
        daemon_publish_background(daemon, 16667);
    int before = heard.fast_parts;
    assert_true(before > 3);
    RequestMessage request = {.style_hash = 0, .slot = 0, .lane = STYLE_FAST};
    request.missing[0] = 1u << 2;
    uint8_t bytes[CONTROL_MAX_BYTES];
    size_t size = request_encode(bytes, sizeof bytes, &request);
    daemon_receive(daemon, CHANNEL_REQUEST, bytes, size);
    daemon_publish_background(daemon, 16667);
    assert_int_equal(heard.fast_parts, before + 1);
    assert_int_equal(heard.last_part, 2);
    request.style_hash = 12345; // somebody else's
    size = request_encode(bytes, sizeof bytes, &request);
    daemon_receive(daemon, CHANNEL_REQUEST, bytes, size);
    daemon_publish_background(daemon, 16667);
    assert_int_equal(heard.fast_parts, before + 1);
    daemon_destroy(daemon);
}

// --- poses
// ----------------------------------------------------------------------------------------

// Sways for a second, rests; at tick 120, when hair still swings, something happens.
static void sway_and(Daemon* daemon, Heard* to, int n, double x, PoseVerb verb)
{
    double t = n / 60.0;
    double sway = n < 60 ? 0.3 * sin(4.0 * M_PI * t) : 0.0;
    send_pose_of(daemon, t, n < 120 ? sway : x, 0.0, n < 120 ? 1 : 2, n < 120 ? POSE_FOLLOW : verb);
    tick(daemon, to);
}

static bool same_hair(void)
{
    return memcmp(heard.positions, other.positions, sizeof heard.positions) == 0;
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

// --- characters, bad bytes, epochs
// ----------------------------------------------------------------

static void characters_come_and_go(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "none");
    Daemon* daemon = create(&options, &heard);
    send_character(daemon, 2, CHARACTER_ADD, "");
    send_character(daemon, 0, CHARACTER_REMOVE, "");
    tick(daemon, &heard);
    assert_int_equal(heard.rows[0][0], 0);
    assert_int_equal(heard.rows[2][0], 1);
    int segment = heard.frame[2].segment;
    send_character(daemon, 2, CHARACTER_REMOVE, "");
    tick(daemon, &heard);
    assert_int_equal(daemon_status(daemon).characters, 0);
    send_character(daemon, 2, CHARACTER_ADD, "long");
    tick(daemon, &heard);
    assert_true(heard.frame[2].segment > segment);
    daemon_destroy(daemon);
}

// A daemon with two styles, moving hair in slot 1.
static Daemon* create_with_two_styles(void)
{
    char path[64];
    DaemonOptions options = options_for(&heard, "shake");
    assert_true(try_scene("{\"styles\": [{\"name\": \"hers\", \"builtin\": \"long\"},\n"
                          "            {\"name\": \"his\", \"builtin\": \"bob\"}],\n"
                          " \"characters\": [{\"slot\": 1, \"style\": \"hers\"}]}",
                          &options, path, NULL));
    Daemon* daemon = create(&options, &heard);
    unlink(path);
    return daemon;
}

static uint64_t hash_after_adds(const char* style)
{
    Daemon* daemon = create_with_two_styles();
    tick(daemon, &heard);
    int segment = heard.frame[1].segment;
    for (int n = 0; n < 40; ++n) {
        if (style != NULL && n % 10 == 5) send_character(daemon, 1, CHARACTER_ADD, style);
        tick(daemon, &heard);
    }
    assert_int_equal(heard.frame[1].segment, segment);
    assert_int_equal(daemon_status(daemon).rejected, 0);
    uint64_t hash = daemon_state_hash(daemon);
    daemon_destroy(daemon);
    return hash;
}

static void adding_what_is_worn_changes_nothing(void** state)
{
    (void)state;
    uint64_t hash = hash_after_adds(NULL);
    assert_true(hash_after_adds("hers") == hash);
    assert_true(hash_after_adds("") == hash); // the first style by no name
}

static void adding_another_style_changes_it(void** state)
{
    (void)state;
    Daemon* daemon = create_with_two_styles();
    tick(daemon, &heard);
    FrameHeader before = heard.frame[1];
    send_character(daemon, 1, CHARACTER_ADD, "his");
    tick(daemon, &heard);
    assert_true(heard.frame[1].style_hash != before.style_hash);
    assert_true(heard.frame[1].segment > before.segment);
    daemon_destroy(daemon);
}

// A sender's add may be a second later than its poses: LCM keeps nothing for who starts late.
static void poses_may_come_a_second_before_their_character(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "bus");
    options.characters = 0;
    Daemon* daemon = create(&options, &heard);
    for (int n = 0; n < 70; ++n) {
        send_pose_of(daemon, n / 60.0, 0.0, 0.0, 0, POSE_FOLLOW);
        tick(daemon, &heard);
    }
    assert_int_equal(heard.notices, 0);
    assert_int_equal(daemon_status(daemon).rejected, 70);
    send_character(daemon, 0, CHARACTER_ADD, "");
    send_pose_of(daemon, 2.0, 0.0, 0.0, 0, POSE_FOLLOW);
    tick(daemon, &heard);
    assert_int_equal(heard.notices, 0);
    assert_int_equal(daemon_status(daemon).rejected, 70);
    send_character(daemon, 0, CHARACTER_REMOVE, "");
    for (int n = 0; n < 100; ++n) {
        send_pose_of(daemon, 3.0 + n / 60.0, 0.0, 0.0, 0, POSE_FOLLOW);
        tick(daemon, &heard);
    }
    assert_int_equal(heard.notices, 1); // nobody adds it
    assert_non_null(strstr(heard.notice, "without a character"));
    daemon_destroy(daemon);
}

static void what_does_not_fit_the_wire_is_counted_and_not_sent(void** state)
{
    (void)state;
    static Publisher publisher;
    static uint16_t positions[MAX_ROWS * HAIRSTYLE_MAX_NODES * 3];
    static int16_t tangents[MAX_ROWS * HAIRSTYLE_MAX_NODES * 3];
    PublishPlanes planes = {.positions = positions, .tangents = tangents};
    Hairstyle* style = groom_long(NULL);
    memset(&heard, 0, sizeof heard);
    publisher = (Publisher){.sinks = {{hear, &heard}}, .sink_count = 1, .mtu = 1500};
    FrameHeader header = {.epoch = 1, .pose = pose_identity()};
    assert_true(publish_block(&publisher, &header, &planes, style, 0));
    assert_int_equal(publisher.unsent, 0);
    header.pose.position.y = -1e9;
    assert_false(publish_block(&publisher, &header, &planes, style, 0));
    header.pose.position.y = NAN;
    assert_false(publish_block(&publisher, &header, &planes, style, 1));
    assert_int_equal(publisher.unsent, 2);
    assert_int_equal(publisher.sent_messages, 1);
    hairstyle_destroy(style);
}

static void a_simulation_that_no_character_could_have_is_refused_without_one(void** state)
{
    (void)state;
    Fault fault = {0};
    DaemonOptions options = options_for(&heard, "none");
    options.characters = 0;
    options.sim.stiffness_s2 = 1e6f;
    assert_null(daemon_create(&options, &fault));
    assert_non_null(strstr(fault.text, "stiffness_s2"));
}

static void an_unknown_style_is_told_the_known_ones(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "none");
    Daemon* daemon = create(&options, &heard);
    for (int i = 0; i < 3; ++i)
        send_character(daemon, 1, CHARACTER_ADD, "mullet");
    tick(daemon, &heard);
    assert_int_equal(heard.notices, 1);
    assert_non_null(strstr(heard.notice, "mullet"));
    assert_non_null(strstr(heard.notice, "long"));
    assert_int_equal(daemon_status(daemon).characters, 1);
    assert_int_equal(daemon_status(daemon).rejected, 3);
    daemon_destroy(daemon);
}

static void bad_bytes_are_counted_and_noticed_once_a_kind(void** state)
{
    (void)state;
    const char* channels[] = {CHANNEL_POSE,    CHANNEL_CHARACTER, CHANNEL_WIND, CHANNEL_TUNING,
                              CHANNEL_REQUEST, CHANNEL_STATUS,    "ELSEWHERE"};
    DaemonOptions options = options_for(&heard, "bus");
    Daemon* daemon = create(&options, &heard);
    uint8_t bytes[700];
    memset(bytes, 0xa5, sizeof bytes);
    for (int k = 0; k < 7; ++k)
        for (size_t size = 0; size < sizeof bytes; size += 7)
            daemon_receive(daemon, channels[k], bytes, size);
    tick(daemon, &heard);
    assert_int_equal(heard.notices, 7);
    assert_int_equal(daemon_status(daemon).rejected, 7 * 100);
    assert_int_equal(heard.applied, 0);
    daemon_destroy(daemon);
}

static void lost_strands_are_put_back_told_once_and_counted(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "shake");
    options.sim.stiffness_s2 = 1e6f;
    options.sim.force = true;
    options.sim.iterations = 0;
    Daemon* daemon = create(&options, &heard);
    for (int n = 0; n < 240; ++n) {
        tick(daemon, &heard);
        daemon_publish_background(daemon, 16667);
    }
    assert_int_equal(heard.notices, 1);
    assert_non_null(strstr(heard.notice, "character 0"));
    assert_in_range(daemon_status(daemon).quarantined, 65, 240 * 64);
    assert_in_range(heard.status.quarantined, 64, daemon_status(daemon).quarantined);
    int64_t before = daemon_status(daemon).quarantined;
    send_character(daemon, 0, CHARACTER_REMOVE, "");
    tick(daemon, &heard);
    assert_int_equal(daemon_status(daemon).quarantined, before);
    assert_int_equal(daemon_status(daemon).rejected, 0);
    daemon_destroy(daemon);
}

static void hear_epoch(Daemon* daemon, int64_t epoch)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    StatusMessage status = {.epoch = epoch, .rate_hz = 60.0f};
    daemon_receive(daemon, CHANNEL_STATUS, bytes, status_encode(bytes, sizeof bytes, &status));
}

static void a_new_daemon_outbids_a_higher_epoch_once(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "none");
    options.epoch = 0;
    Daemon* daemon = create(&options, &heard);
    tick(daemon, &heard);
    int64_t own = daemon_epoch(daemon);
    hear_epoch(daemon, own); // its own status comes back by the bus
    tick(daemon, &heard);
    assert_true(daemon_epoch(daemon) == own);
    hear_epoch(daemon, own + 5000);
    tick(daemon, &heard);
    assert_true(daemon_epoch(daemon) == own + 5001);
    assert_int_equal(heard.frame[0].tick, 0);
    hear_epoch(daemon, own + 9000);
    tick(daemon, &heard);
    assert_true(daemon_epoch(daemon) == own + 5001);
    daemon_destroy(daemon);
    options.epoch = 42; // asked for: stays
    daemon = create(&options, &heard);
    hear_epoch(daemon, 9000);
    tick(daemon, &heard);
    assert_true(daemon_epoch(daemon) == 42);
    daemon_destroy(daemon);
}

static void steady_state_allocates_nothing(void** state)
{
    (void)state;
#if !COUNTS_ALLOCATIONS
    print_message("skipped: AddressSanitizer owns malloc\n");
    skip();
#endif
    for (int threads = 1; threads <= 2; ++threads)
        for (int characters = 1; characters <= 4; characters += 3) {
            DaemonOptions options = options_for(&heard, "bus");
            options.sim.threads = threads;
            options.characters = characters;
            Daemon* daemon = create(&options, &heard);
            for (int n = 0; n < 90; ++n) {
                if (n == 10) allocations = 0; // OpenMP's threads are there by now
                send_pose_of(daemon, n / 60.0, 0.01 * n, 0.0, n / 20, POSE_CARRY);
                send_wind(daemon, 0, 1024, vec3((float)(n % 9), 0, 0), 0.5f);
                send_tuning(daemon, (TuningMessage){.slot_count = 1024,
                                                    .set = TUNING_STIFFNESS | TUNING_PEARL_RADIUS,
                                                    .stiffness_s2 = (float)(300 + n),
                                                    .pearl_radius_m = 0.005f});
                tick(daemon, &heard);
                daemon_publish_background(daemon, 16667);
            }
            assert_int_equal(allocations, 0);
            send_character(daemon, 3, CHARACTER_REMOVE, "");
            send_character(daemon, 3, CHARACTER_ADD, "");
            tick(daemon, &heard);
            assert_true(allocations > 0); // the counter counts
            daemon_destroy(daemon);
        }
}

// --- scenes
// ---------------------------------------------------------------------------------------

static void a_scene_says_styles_characters_and_physics(void** state)
{
    (void)state;
    char path[64];
    DaemonOptions options = options_for(&heard, "none");
    assert_true(try_scene("{\"rate_hz\": 50, \"substeps\": 2,\n"
                          " \"simulation\": {\"stiffness_s2\": 300, \"fall_off_power\": 1},\n"
                          " \"styles\": [{\"name\": \"hers\", \"builtin\": \"long\"},\n"
                          "            {\"name\": \"his\", \"builtin\": \"bob\"}],\n"
                          " \"characters\": [{\"slot\": 3, \"style\": \"his\",\n"
                          "   \"motion\": \"nod\", \"position\": [1, 0, -2]}, {\"slot\": 1}]}",
                          &options, path, NULL));
    assert_true(options.sim.rate_hz == 50.0 && options.sim.stiffness_s2 == 300.0f);
    Daemon* daemon = create(&options, &heard);
    unlink(path);
    tick(daemon, &heard);
    assert_int_equal(daemon_status(daemon).styles, 2);
    assert_int_equal(daemon_status(daemon).characters, 2);
    assert_string_equal(daemon_status(daemon).style, "hers");
    assert_int_equal(heard.rows[3][0], 1);
    assert_true(heard.frame[3].pose.position.x == 1.0);
    assert_true(heard.frame[1].style_hash != heard.frame[3].style_hash);
    daemon_destroy(daemon);
}

static void a_wrong_scene_names_line_and_column(void** state)
{
    (void)state;
    const char* wrong[][2] = {
        {"{\n  \"rate_hz\": 60,,\n}", ":2:"},
        {"{\n  \"rate\": 60\n}", ":2:3: unknown key \"rate\""},
        {"{\"simulation\": {\"stiffness_s2\": 400,\n \"damping\": 3}}", ":2:2: unknown key"},
        {"{\"styles\": [{\"name\": \"a\", \"builtin\": \"long\"},\n {\"name\": \"b\"}]}", ":2:2:"},
        {"{\"styles\": [{\"name\": \"a\",\n  \"builtin\": 3}]}", ":2:3:"},
        {"{\"characters\": [{\"slot\": 0}, {\"slot\": 1},\n    {\"slot\": 5000}]}", ":2:6:"},
        {"{\"characters\": [{\"slot\": 0},\n {\"slot\": 0}]}", ":2:2: this slot"},
        {"{\"characters\": [{\"slot\": 0,\n\"position\": [1, 2, \"x\"]}]}", ":2:20:"},
        {"{\"characters\": [{\"slot\": 0, \"motion\": \"hop\"}]}", ":1:29:"},
        {"{\"characters\": [{\"slot\": 0,\n\"position\": [1, 2, 1e9]}]}", "-1e+08 to 1e+08"},
        {"{\"styles\": [{\"name\": \"\xc3\xa9\", \"builtin\": \"bob\"}]}", ":1:14: \"name\""},
        {"{\"styles\": [{\"name\": \"a\", \"files\": [3]}]}", "\"files\"[0] must be a text"},
        {"{\"styles\": {}}", "\"styles\" must be a list"},
        {"{\"styles\": [\"bob\"]}", "\"styles\"[0] must be an object"},
        {"{\"simulation\": 3}", "\"simulation\" must be an object"},
        {"{\"characters\": 3}", ":1:2:"},
        {"{\"substeps\": 2.5}", ":1:2:"},
        {"[]", ":1:1:"},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
        char path[64];
        Fault fault = {0};
        DaemonOptions options = options_for(&heard, "none");
        assert_false(try_scene(wrong[i][0], &options, path, &fault));
        unlink(path);
        if (strstr(fault.text, wrong[i][1]) == NULL || strstr(fault.text, path) == NULL)
            fail_msg("\"%s\" lacks \"%s\"", fault.text, wrong[i][1]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(slices_together_hold_every_row_once),
        cmocka_unit_test(the_hash_does_not_depend_on_threads),
        cmocka_unit_test(a_recording_gets_the_style_at_once_and_the_bus_in_its_time),
        cmocka_unit_test(styles_are_sent_at_once_and_again_each_second),
        cmocka_unit_test(a_request_brings_the_parts_it_names),
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
        cmocka_unit_test(a_flood_of_poses_keeps_the_newest),
        cmocka_unit_test(characters_come_and_go),
        cmocka_unit_test(adding_what_is_worn_changes_nothing),
        cmocka_unit_test(adding_another_style_changes_it),
        cmocka_unit_test(poses_may_come_a_second_before_their_character),
        cmocka_unit_test(what_does_not_fit_the_wire_is_counted_and_not_sent),
        cmocka_unit_test(a_simulation_that_no_character_could_have_is_refused_without_one),
        cmocka_unit_test(an_unknown_style_is_told_the_known_ones),
        cmocka_unit_test(bad_bytes_are_counted_and_noticed_once_a_kind),
        cmocka_unit_test(lost_strands_are_put_back_told_once_and_counted),
        cmocka_unit_test(a_new_daemon_outbids_a_higher_epoch_once),
        cmocka_unit_test(steady_state_allocates_nothing),
        cmocka_unit_test(a_scene_says_styles_characters_and_physics),
        cmocka_unit_test(a_wrong_scene_names_line_and_column),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
