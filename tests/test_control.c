#include "messages/bytes.h"
#include "messages/control.h"
#include "messages/random.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <hair_applied_t.h>
#include <hair_character_t.h>
#include <hair_pose_t.h>
#include <hair_request_t.h>
#include <hair_status_t.h>
#include <hair_tuning_t.h>
#include <hair_wind_t.h>

#include <stdio.h>
#include <stdlib.h>

static const PoseMessage POSE = {
    .utime = 5, .pose = {{1, -2, 3e5}, {0.6, 0, 0, 0.8}}, .segment = 9, .slot = 7, .verb = 1};
static const CharacterMessage CHARACTER = {.utime = 6, .slot = 1023, .verb = 1, .style = "long"};
static const RequestMessage REQUEST = {.utime = 7,
                                       .style_hash = 0xfedcba9876543210u,
                                       .slot = 3,
                                       .lane = 1,
                                       .missing = {1, 2, [511] = 3}};
static const StatusMessage STATUS = {.utime = 8,
                                     .epoch = 9,
                                     .tick = 10,
                                     .rate_hz = 60,
                                     .step_us = 123.5f,
                                     .characters = 2,
                                     .strands = 128,
                                     .overruns = 1,
                                     .clamped = 2,
                                     .rejected = 3,
                                     .sent_messages = 4,
                                     .sent_bytes = 5000000000,
                                     .quarantined = 6,
                                     .jumps = 7};
static const uint8_t PAYLOAD[] = {9, 8, 7, 6, 5};
static const AppliedMessage APPLIED = {.utime = 8,
                                       .epoch = 9,
                                       .tick = 10,
                                       .channel = "HAIR_POSE",
                                       .size = sizeof PAYLOAD,
                                       .payload = PAYLOAD};

static const WindMessage WIND = {.utime = 9,
                                 .first_slot = 3,
                                 .slot_count = 1021,
                                 .velocity = {8, -0.5f, 2},
                                 .gust = 0.25f,
                                 .gust_hz = 3.1f};
static const TuningMessage TUNING = {.utime = 10,
                                     .first_slot = 0,
                                     .slot_count = 1024,
                                     .set = TUNING_EVERY,
                                     .stiffness_s2 = 300,
                                     .damping_per_s = 6,
                                     .gravity_m_s2 = -2,
                                     .drag_per_s = 4,
                                     .iterations = 3,
                                     .pearl_radius_m = 0.01f};

enum { KINDS = 7, BUFFER_BYTES = 2048 };

static size_t encode(int kind, uint8_t* bytes, size_t capacity)
{
    switch (kind) {
    case 0:
        return pose_encode(bytes, capacity, &POSE);
    case 1:
        return character_encode(bytes, capacity, &CHARACTER);
    case 2:
        return request_encode(bytes, capacity, &REQUEST);
    case 3:
        return status_encode(bytes, capacity, &STATUS);
    case 5:
        return wind_encode(bytes, capacity, &WIND);
    case 6:
        return tuning_encode(bytes, capacity, &TUNING);
    default:
        return applied_encode(bytes, capacity, &APPLIED);
    }
}

static size_t encode_with_lcm_gen(int kind, uint8_t* bytes)
{
    hair_pose_t pose = {5, {1, -2, 3e5}, {0.6, 0, 0, 0.8}, 9, 7, 1};
    hair_character_t character = {6, 1023, 1, "long"};
    hair_request_t request = {7, (int64_t)REQUEST.style_hash, 3, 1, {1, 2, [511] = 3}};
    hair_status_t status = {8, 9, 10, 60, 123.5f, 2, 128, 1, 2, 3, 4, 5000000000, 6, 7};
    hair_wind_t wind = {9, 3, 1021, {8, -0.5f, 2}, 0.25f, 3.1f};
    hair_tuning_t tuning = {10, 0, 1024, 63, 300, 6, -2, 4, 3, 0.01f};
    hair_applied_t applied = {8, 9, 10, "HAIR_POSE", sizeof PAYLOAD, (uint8_t*)PAYLOAD};
    switch (kind) {
    case 0:
        return (size_t)hair_pose_t_encode(bytes, 0, BUFFER_BYTES, &pose);
    case 1:
        return (size_t)hair_character_t_encode(bytes, 0, BUFFER_BYTES, &character);
    case 2:
        return (size_t)hair_request_t_encode(bytes, 0, BUFFER_BYTES, &request);
    case 3:
        return (size_t)hair_status_t_encode(bytes, 0, BUFFER_BYTES, &status);
    case 5:
        return (size_t)hair_wind_t_encode(bytes, 0, BUFFER_BYTES, &wind);
    case 6:
        return (size_t)hair_tuning_t_encode(bytes, 0, BUFFER_BYTES, &tuning);
    default:
        return (size_t)hair_applied_t_encode(bytes, 0, BUFFER_BYTES, &applied);
    }
}

// From its own allocation, so that AddressSanitizer sees a read past the end.
static bool decode(int kind, const uint8_t* bytes, size_t size, Fault* fault)
{
    union {
        PoseMessage pose;
        CharacterMessage character;
        RequestMessage request;
        StatusMessage status;
        AppliedMessage applied;
        WindMessage wind;
        TuningMessage tuning;
    } m;
    uint8_t* copy = malloc(size > 0 ? size : 1);
    memcpy(copy, bytes, size);
    bool decoded = false;
    switch (kind) {
    case 0:
        decoded = pose_decode(&m.pose, copy, size, fault);
        break;
    case 1:
        decoded = character_decode(&m.character, copy, size, fault);
        break;
    case 2:
        decoded = request_decode(&m.request, copy, size, fault);
        break;
    case 3:
        decoded = status_decode(&m.status, copy, size, fault);
        break;
    case 5:
        decoded = wind_decode(&m.wind, copy, size, fault);
        break;
    case 6:
        decoded = tuning_decode(&m.tuning, copy, size, fault);
        break;
    default:
        decoded = applied_decode(&m.applied, copy, size, fault);
    }
    free(copy);
    return decoded;
}

static void control_encode_writes_the_bytes_that_lcm_gen_writes(void** state)
{
    (void)state;
    for (int kind = 0; kind < KINDS; ++kind) {
        uint8_t ours[BUFFER_BYTES], theirs[BUFFER_BYTES];
        size_t size = encode(kind, ours, sizeof ours);
        assert_true(size > 0 && size <= CONTROL_MAX_BYTES);
        assert_int_equal(size, encode_with_lcm_gen(kind, theirs));
        assert_memory_equal(ours, theirs, size);
        assert_int_equal(encode(kind, ours, size - 1), 0);
        assert_int_equal(encode(kind, ours, size), size);
    }
}

static void control_decode_returns_what_was_encoded(void** state)
{
    (void)state;
    uint8_t bytes[BUFFER_BYTES];
    PoseMessage pose;
    assert_true(pose_decode(&pose, bytes, encode(0, bytes, sizeof bytes), NULL));
    assert_true(pose.utime == 5 && pose.segment == 9 && pose.slot == 7 && pose.verb == POSE_CARRY);
    assert_true(pose.pose.position.z == 3e5 && fabs(pose.pose.orientation.x - 0.6) < 1e-15);
    CharacterMessage character;
    assert_true(character_decode(&character, bytes, encode(1, bytes, sizeof bytes), NULL));
    assert_true(character.slot == 1023 && character.verb == CHARACTER_ADD);
    assert_string_equal(character.style, "long");
    RequestMessage request;
    assert_true(request_decode(&request, bytes, encode(2, bytes, sizeof bytes), NULL));
    assert_true(request.style_hash == REQUEST.style_hash && request.lane == STYLE_BULK);
    assert_memory_equal(request.missing, REQUEST.missing, sizeof request.missing);
    StatusMessage status;
    assert_true(status_decode(&status, bytes, encode(3, bytes, sizeof bytes), NULL));
    assert_true(status.sent_bytes == 5000000000 && status.step_us == 123.5f);
    assert_true(status.clamped == 2 && status.rejected == 3 && status.strands == 128);
    assert_int_equal(status.quarantined, 6);
    assert_int_equal(status.jumps, 7);
    AppliedMessage applied;
    assert_true(applied_decode(&applied, bytes, encode(4, bytes, sizeof bytes), NULL));
    assert_string_equal(applied.channel, "HAIR_POSE");
    assert_int_equal(applied.size, sizeof PAYLOAD);
    assert_memory_equal(applied.payload, PAYLOAD, sizeof PAYLOAD);
    WindMessage wind;
    assert_true(wind_decode(&wind, bytes, encode(5, bytes, sizeof bytes), NULL));
    assert_true(wind.utime == 9 && wind.first_slot == 3 && wind.slot_count == 1021);
    assert_memory_equal(&wind.velocity, &WIND.velocity, sizeof wind.velocity);
    assert_true(wind.gust == 0.25f && wind.gust_hz == 3.1f);
    TuningMessage tuning;
    assert_true(tuning_decode(&tuning, bytes, encode(6, bytes, sizeof bytes), NULL));
    assert_true(tuning.first_slot == 0 && tuning.slot_count == 1024 && tuning.set == 63);
    assert_true(tuning.stiffness_s2 == 300.0f && tuning.damping_per_s == 6.0f);
    assert_true(tuning.gravity_m_s2 == -2.0f && tuning.drag_per_s == 4.0f);
    assert_true(tuning.iterations == 3 && tuning.pearl_radius_m == 0.01f);
}

static void control_decode_rejects_every_other_size_and_type(void** state)
{
    (void)state;
    for (int kind = 0; kind < KINDS; ++kind) {
        uint8_t bytes[BUFFER_BYTES] = {0};
        size_t size = encode(kind, bytes, sizeof bytes);
        assert_true(decode(kind, bytes, size, NULL));
        for (size_t other = 0; other < sizeof bytes; ++other) {
            Fault fault = {0};
            if (other == size) continue;
            assert_false(decode(kind, bytes, other, &fault));
            assert_true(fault.text[0] != '\0');
        }
        for (int at = 0; at < 8; ++at) {
            bytes[at] ^= 0x10;
            assert_false(decode(kind, bytes, size, NULL));
            bytes[at] ^= 0x10;
        }
    }
}

typedef struct WrongField {
    int kind, at, bytes;
    uint64_t value;
    const char* named; // by the fault
} WrongField;

#define INFINITE      0x7ff0000000000000u
#define NOT_A_NUMBER  0x7ff8000000000000u
#define TWO_BILLION   0x41dfffffffc00000u
#define NAN_BITS      0x7fc00000u // of floats
#define INFINITE_BITS 0x7f800000u

static void control_decode_names_every_wrong_field(void** state)
{
    (void)state;
    static const WrongField wrong[] = {
        {0, 8, 8, UINT64_MAX, "utime"},
        {0, 16, 8, INFINITE, "position"},
        {0, 24, 8, NOT_A_NUMBER, "position"},
        {0, 32, 8, TWO_BILLION, "position"},
        {0, 40, 8, NOT_A_NUMBER, "orientation"},
        {0, 64, 8, INFINITE, "orientation"},
        {0, 64, 8, 0x7fe0000000000000u, "orientation"},
        {0, 76, 2, 1024, "slot"},
        {0, 78, 1, 4, "verb"},
        {1, 8, 8, 1ull << 63, "utime"},
        {1, 16, 2, 0xffff, "slot"},
        {1, 18, 1, 0, "verb"},
        {1, 18, 1, 3, "verb"},
        {1, 19, 1, 0x0a, "style"},
        {1, 21, 1, 0xff, "style"},
        {2, 24, 2, 1024, "slot"},
        {2, 26, 1, 2, "lane"},
        {3, 16, 8, UINT64_MAX, "epoch"},
        {3, 24, 4, 0xffffffffu, "tick"},
        {3, 28, 4, 0x7fc00000u, "rate_hz"},
        {3, 32, 4, 0x7f800000u, "step_us"},
        {3, 36, 4, 5000, "characters"},
        {3, 40, 4, 0x80000000u, "count"},
        {3, 76, 8, UINT64_MAX, "count"},
        {3, 84, 8, UINT64_MAX, "count"},
        {3, 92, 8, UINT64_MAX, "count"},
        {4, 24, 4, 0x80000000u, "tick"},
        {4, 28, 1, 0, "channel"},
        {4, 30, 1, 7, "channel"},
        {4, 48, 4, 0, "payload"},
        {4, 48, 4, 4, "payload"},
        {4, 48, 4, 6, "payload"},
        {4, 48, 4, 0xffffffffu, "payload"},
        {4, 48, 4, 0x7fffffffu, "payload"},
        {5, 8, 8, UINT64_MAX, "utime"},
        {5, 16, 2, 4, "slots"},
        {5, 16, 2, 0xffff, "slots"},
        {5, 18, 2, 0, "slots"},
        {5, 18, 2, 0xffff, "slots"},
        {5, 20, 4, NAN_BITS, "velocity"},
        {5, 24, 4, INFINITE_BITS, "velocity"},
        {5, 28, 4, 0x43490000u, "velocity"}, // 201
        {5, 32, 4, 0xbf800000u, "gust"},
        {5, 32, 4, NAN_BITS, "gust"},
        {5, 36, 4, INFINITE_BITS, "gust_hz"},
        {6, 8, 8, UINT64_MAX, "utime"},
        {6, 16, 2, 1, "slots"},
        {6, 18, 2, 0, "slots"},
        {6, 18, 2, 1025, "slots"},
        {6, 20, 1, 0, "set"},
        {6, 20, 1, 64, "set"},
        {6, 20, 1, 0xff, "set"},
        {6, 21, 4, NAN_BITS, "stiffness_s2"},
        {6, 21, 4, 0xbf800000u, "stiffness_s2"},
        {6, 21, 4, INFINITE_BITS, "stiffness_s2"},
        {6, 25, 4, NAN_BITS, "damping_per_s"},
        {6, 29, 4, NAN_BITS, "gravity_m_s2"},
        {6, 33, 4, INFINITE_BITS, "drag_per_s"},
        {6, 37, 4, 0xffffffffu, "iterations"},
        {6, 37, 4, 65, "iterations"},
        {6, 41, 4, 0x40000000u, "pearl_radius_m"}, // 2
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
        uint8_t bytes[BUFFER_BYTES];
        const WrongField* w = &wrong[i];
        size_t size = encode(w->kind, bytes, sizeof bytes);
        for (int k = 0; k < w->bytes; ++k)
            bytes[w->at + k] = (uint8_t)(w->value >> (8 * (w->bytes - 1 - k)));
        Fault fault = {0};
        if (decode(w->kind, bytes, size, &fault)) fail_msg("wrong field %zu passed", i);
        if (strstr(fault.text, w->named) == NULL) fail_msg("%zu: \"%s\"", i, fault.text);
    }
}

static void control_decode_rejects_names_without_an_end(void** state)
{
    (void)state;
    uint8_t bytes[BUFFER_BYTES];
    size_t size = encode(1, bytes, sizeof bytes);
    memset(bytes + 19, 'x', 32);
    assert_false(decode(1, bytes, size, NULL));
    size = encode(4, bytes, sizeof bytes);
    memset(bytes + 28, 'x', 20);
    assert_false(decode(4, bytes, size, NULL));
}

static void pose_decode_normalises_and_refuses_the_zero_quaternion(void** state)
{
    (void)state;
    uint8_t bytes[BUFFER_BYTES];
    size_t size = encode(0, bytes, sizeof bytes);
    bytes_put_be_double(bytes + 40, 6.0);
    bytes_put_be_double(bytes + 64, 8.0);
    PoseMessage m;
    assert_true(pose_decode(&m, bytes, size, NULL));
    assert_true(fabs(m.pose.orientation.x - 0.6) < 1e-15);
    assert_true(fabs(m.pose.orientation.w - 0.8) < 1e-15);
    bytes_put_be_double(bytes + 40, 0.0);
    bytes_put_be_double(bytes + 64, 0.0);
    m.segment = 1234;
    assert_false(pose_decode(&m, bytes, size, NULL));
    assert_int_equal(m.segment, 1234); // untouched
}

static void control_encode_refuses_what_decode_would(void** state)
{
    (void)state;
    uint8_t bytes[BUFFER_BYTES];
    PoseMessage pose = POSE;
    pose.pose.position.y = (double)NAN;
    assert_int_equal(pose_encode(bytes, sizeof bytes, &pose), 0);
    pose = POSE;
    pose.pose.orientation = (Quat){0, 0, 0, 0};
    assert_int_equal(pose_encode(bytes, sizeof bytes, &pose), 0);
    WindMessage wind = WIND;
    wind.velocity.y = NAN;
    assert_int_equal(wind_encode(bytes, sizeof bytes, &wind), 0);
    TuningMessage tuning = TUNING;
    tuning.set = 0;
    assert_int_equal(tuning_encode(bytes, sizeof bytes, &tuning), 0);
    AppliedMessage applied = APPLIED;
    applied.size = CONTROL_MAX_BYTES;
    assert_int_equal(applied_encode(bytes, sizeof bytes, &applied), 0);
    CharacterMessage character = CHARACTER;
    memset(character.style, 'x', sizeof character.style);
    assert_int_equal(character_encode(bytes, sizeof bytes, &character), 0);
}

static void control_decode_survives_corruption(void** state)
{
    (void)state;
    for (uint32_t n = 0; n < 20000; ++n) {
        int kind = (int)(n % KINDS);
        uint8_t bytes[BUFFER_BYTES];
        size_t size = encode(kind, bytes, sizeof bytes);
        for (uint32_t i = 0; i < 4; ++i)
            bytes[8 + random_hash2(n, i) % (size - 8)] = (uint8_t)random_hash2(n, 99 + i);
        Fault fault = {0};
        bool decoded = decode(kind, bytes, size, &fault);
        assert_true(decoded == (fault.text[0] == '\0'));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(control_encode_writes_the_bytes_that_lcm_gen_writes),
        cmocka_unit_test(control_decode_returns_what_was_encoded),
        cmocka_unit_test(control_decode_rejects_every_other_size_and_type),
        cmocka_unit_test(control_decode_names_every_wrong_field),
        cmocka_unit_test(control_decode_rejects_names_without_an_end),
        cmocka_unit_test(pose_decode_normalises_and_refuses_the_zero_quaternion),
        cmocka_unit_test(control_encode_refuses_what_decode_would),
        cmocka_unit_test(control_decode_survives_corruption),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
