#include "messages/bytes.h"
#include "messages/frame.h"
#include "messages/random.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <hair_guides_t.h>

#include <stdlib.h>
#include <zlib.h>

#define GUIDES 12
#define NODES  4
#define PLANE  (GUIDES * NODES * 3)

typedef struct Fixture {
    uint16_t positions[PLANE];
    int16_t tangents[PLANE];
    FrameHeader header;
    uint8_t bytes[4096];
    size_t size;
} Fixture;

static Fixture make(void)
{
    Fixture f = {.header = {.utime = 1234567890123456,
                            .epoch = 1700000000000000,
                            .style_hash = 0xfedcba9876543210u,
                            .tick = 777,
                            .segment = 3,
                            .pose = {{1.5, -2.25, 100000.125}, {0.6, 0.0, 0.0, 0.8}},
                            .slot = 7,
                            .first_strand = 5,
                            .strand_count = 6,
                            .nodes = NODES,
                            .profile = FRAME_PROFILE_FULL}};
    for (uint32_t i = 0; i < PLANE; ++i) {
        f.positions[i] = (uint16_t)random_hash(i);
        f.tangents[i] = (int16_t)random_hash(i + 1000);
    }
    f.size = frame_encode(f.bytes, sizeof f.bytes, &f.header, f.positions, f.tangents);
    assert_int_equal(f.size, FRAME_HEADER_BYTES + 6 * NODES * 12);
    return f;
}

static FrameFault decode(const uint8_t* bytes, size_t size)
{
    // Its own allocation, so that AddressSanitizer sees a read past the end.
    uint8_t* copy = malloc(size > 0 ? size : 1);
    if (size > 0) memcpy(copy, bytes, size);
    FrameHeader header;
    const uint8_t *positions, *tangents;
    FrameFault fault = frame_decode(&header, &positions, &tangents, copy, size);
    free(copy);
    return fault;
}

// What a hostile but skilled sender does: changes a field and repairs the checksum.
static void repair(uint8_t* bytes, size_t size)
{
    uLong crc = crc32(crc32(0, bytes, 80), bytes + 88, (uInt)(size - 88));
    bytes_put_be32(bytes + 80, (uint32_t)crc);
}

static void frame_header_is_as_long_as_lcm_gen_says(void** state)
{
    (void)state;
    hair_guides_t empty = {0};
    assert_int_equal(hair_guides_t_encoded_size(&empty), FRAME_HEADER_BYTES);
}

static void frame_encode_writes_the_bytes_that_lcm_gen_writes(void** state)
{
    (void)state;
    Fixture f = make();
    hair_guides_t m = {.utime = f.header.utime,
                       .epoch = f.header.epoch,
                       .style_hash = (int64_t)f.header.style_hash,
                       .position = {1.5, -2.25, 100000.125},
                       .orientation = {19660, 0, 0, 26214},
                       .tick = 777,
                       .segment = 3,
                       .slot = 7,
                       .first_strand = 5,
                       .strand_count = 6,
                       .nodes = NODES,
                       .profile = 0,
                       .crc = (int32_t)bytes_get_be32(f.bytes + 80),
                       .n = (int32_t)f.size - FRAME_HEADER_BYTES,
                       .payload = f.bytes + FRAME_HEADER_BYTES};
    uint8_t theirs[4096];
    assert_int_equal(hair_guides_t_encode(theirs, 0, sizeof theirs, &m), f.size);
    assert_memory_equal(theirs, f.bytes, f.size);
}

static void frame_encode_writes_golden_bytes(void** state)
{
    (void)state;
    // Version 1, for ever: were this to change, every log and every other client would break.
    static const uint8_t golden[80] = {
        0x9a, 0xf3, 0xa0, 0x6c, 0xdc, 0x88, 0x91, 0xe3, 0x00, 0x04, 0x62, 0xd5, 0x3c, 0x8a,
        0xba, 0xc0, 0x00, 0x06, 0x0a, 0x24, 0x18, 0x1e, 0x40, 0x00, 0xfe, 0xdc, 0xba, 0x98,
        0x76, 0x54, 0x32, 0x10, 0x3f, 0xf8, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xc0, 0x02,
        0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x40, 0xf8, 0x6a, 0x02, 0x00, 0x00, 0x00, 0x00,
        0x4c, 0xcc, 0x00, 0x00, 0x00, 0x00, 0x66, 0x66, 0x00, 0x00, 0x03, 0x09, 0x00, 0x00,
        0x00, 0x03, 0x00, 0x07, 0x00, 0x05, 0x00, 0x06, 0x04, 0x00};
    Fixture f = make();
    assert_memory_equal(f.bytes, golden, sizeof golden);
    assert_int_equal(bytes_get_be32(f.bytes + 80), 0x0de59af0u);
}

static void frame_decode_returns_what_was_encoded(void** state)
{
    (void)state;
    Fixture f = make();
    FrameHeader h;
    const uint8_t *positions, *tangents;
    assert_int_equal(frame_decode(&h, &positions, &tangents, f.bytes, f.size), FRAME_OK);
    assert_int_equal(h.utime, f.header.utime);
    assert_int_equal(h.epoch, f.header.epoch);
    assert_true(h.style_hash == f.header.style_hash);
    assert_int_equal(h.tick, 777);
    assert_int_equal(h.segment, 3);
    assert_int_equal(h.slot, 7);
    assert_int_equal(h.first_strand, 5);
    assert_int_equal(h.strand_count, 6);
    assert_int_equal(h.nodes, NODES);
    assert_true(h.pose.position.z == 100000.125);
    Quat q = h.pose.orientation;
    assert_true(fabs(q.x - 0.6) < 2e-5 && fabs(q.w - 0.8) < 2e-5);
    assert_true(fabs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0) < 1e-12);
    assert_memory_equal(positions, f.positions + 5 * NODES * 3, 6 * NODES * 6);
    assert_memory_equal(tangents, f.tangents + 5 * NODES * 3, 6 * NODES * 6);
}

static void frame_decode_rejects_every_truncation(void** state)
{
    (void)state;
    Fixture f = make();
    for (size_t size = 0; size < f.size; ++size)
        assert_int_equal(decode(f.bytes, size), FRAME_SIZE);
    assert_int_equal(decode(f.bytes, f.size + 1), FRAME_SIZE);
}

static void frame_decode_rejects_every_changed_byte(void** state)
{
    (void)state;
    Fixture f = make();
    for (size_t at = 0; at < f.size; ++at)
        for (int flip = 1; flip < 256; ++flip) {
            f.bytes[at] ^= (uint8_t)flip;
            assert_int_not_equal(decode(f.bytes, f.size), FRAME_OK);
            f.bytes[at] ^= (uint8_t)flip;
        }
}

typedef struct WrongField {
    int at, bytes;
    uint64_t value;
    FrameFault fault;
} WrongField;

static void frame_decode_rejects_every_wrong_field_even_with_a_sound_checksum(void** state)
{
    (void)state;
    static const WrongField wrong[] = {
        {0, 8, 1, FRAME_FOREIGN},
        {8, 8, UINT64_MAX, FRAME_COUNT},   // utime
        {16, 8, 1ull << 63, FRAME_COUNT},  // epoch
        {64, 4, 0x80000000u, FRAME_COUNT}, // tick
        {72, 2, 1024, FRAME_COUNT},        // slot
        {72, 2, 0xffff, FRAME_COUNT},
        {74, 2, 1019, FRAME_COUNT}, // first + count passes the guides' cap
        {74, 2, 0xffff, FRAME_COUNT},
        {76, 2, 0, FRAME_SIZE}, // count
        {76, 2, 0xffff, FRAME_SIZE},
        {78, 1, 0, FRAME_SIZE}, // nodes
        {78, 1, 255, FRAME_SIZE},
        {79, 1, 1, FRAME_COUNT},                    // profile
        {84, 4, 0xffffffffu, FRAME_SIZE},           // n
        {32, 8, 0x7ff0000000000000u, FRAME_NUMBER}, // position: infinite
        {40, 8, 0x7ff8000000000000u, FRAME_NUMBER}, // not a number
        {48, 8, 0x7fe0000000000000u, FRAME_NUMBER}, // 1e307
        {56, 2, 0, FRAME_NUMBER},                   // quaternion no longer of length one
        {62, 2, 0x8000, FRAME_NUMBER},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
        Fixture f = make();
        for (int k = 0; k < wrong[i].bytes; ++k)
            f.bytes[wrong[i].at + k] = (uint8_t)(wrong[i].value >> (8 * (wrong[i].bytes - 1 - k)));
        repair(f.bytes, f.size);
        assert_int_equal(decode(f.bytes, f.size), wrong[i].fault);
    }
}

static void frame_decode_rejects_too_few_and_too_many_nodes_of_the_right_length(void** state)
{
    (void)state;
    // 6 strands x 4 nodes is also 12 x 2, and 24 x 1: lengths agree, the node count is outside.
    for (int nodes = 1; nodes <= 2; ++nodes) {
        Fixture f = make();
        bytes_put_be16(f.bytes + 76, (uint16_t)(24 / nodes));
        f.bytes[78] = (uint8_t)nodes;
        repair(f.bytes, f.size);
        assert_int_equal(decode(f.bytes, f.size), FRAME_COUNT);
    }
}

static void frame_decode_leaves_its_outputs_alone_on_a_fault(void** state)
{
    (void)state;
    Fixture f = make();
    FrameHeader h = {.tick = 99};
    const uint8_t *positions = NULL, *tangents = NULL;
    f.bytes[f.size - 1] ^= 1;
    assert_int_equal(frame_decode(&h, &positions, &tangents, f.bytes, f.size), FRAME_CRC);
    assert_int_equal(h.tick, 99);
    assert_null(positions);
    assert_null(tangents);
}

static void frame_encode_refuses_what_decode_would(void** state)
{
    (void)state;
    Fixture f = make();
    assert_int_equal(frame_encode(f.bytes, f.size - 1, &f.header, f.positions, f.tangents), 0);
    FrameHeader h = f.header;
    h.slot = 1024;
    assert_int_equal(frame_encode(f.bytes, sizeof f.bytes, &h, f.positions, f.tangents), 0);
    h = f.header;
    h.pose.position.x = (double)NAN;
    assert_int_equal(frame_encode(f.bytes, sizeof f.bytes, &h, f.positions, f.tangents), 0);
    h = f.header;
    h.pose.orientation.y = HUGE_VAL;
    assert_int_equal(frame_encode(f.bytes, sizeof f.bytes, &h, f.positions, f.tangents), 0);
    h = f.header;
    h.first_strand = 1020;
    assert_int_equal(frame_encode(f.bytes, sizeof f.bytes, &h, f.positions, f.tangents), 0);
}

static void frame_rows_fit_one_packet(void** state)
{
    (void)state;
    assert_int_equal(frame_rows_per_message(1500, 8), 14); // 64 strands: 5 messages
    for (int mtu = 576; mtu <= 9000; mtu += 53)
        for (int nodes = HAIRSTYLE_MIN_NODES; nodes <= HAIRSTYLE_MAX_NODES; ++nodes) {
            int rows = frame_rows_per_message(mtu, nodes);
            int spent = FRAME_PACKET_OVERHEAD + (int)frame_size(rows, nodes);
            assert_true(rows == 1 || spent <= mtu);
            assert_true(spent + FRAME_NODE_BYTES * nodes > mtu);
        }
    assert_int_equal(frame_rows_per_message(0, 32), 1);
    assert_true(frame_size(frame_rows_per_message(1 << 20, 8), 8) <= FRAME_MAX_BYTES);
}

static void frame_payload_hash_sees_both_planes(void** state)
{
    (void)state;
    Fixture f = make();
    uint64_t hash = frame_payload_hash(f.positions, f.tangents, GUIDES, NODES);
    f.positions[0] ^= 1;
    assert_true(hash != frame_payload_hash(f.positions, f.tangents, GUIDES, NODES));
    f.positions[0] ^= 1;
    f.tangents[PLANE - 1] ^= 1;
    assert_true(hash != frame_payload_hash(f.positions, f.tangents, GUIDES, NODES));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frame_header_is_as_long_as_lcm_gen_says),
        cmocka_unit_test(frame_encode_writes_the_bytes_that_lcm_gen_writes),
        cmocka_unit_test(frame_encode_writes_golden_bytes),
        cmocka_unit_test(frame_decode_returns_what_was_encoded),
        cmocka_unit_test(frame_decode_rejects_every_truncation),
        cmocka_unit_test(frame_decode_rejects_every_changed_byte),
        cmocka_unit_test(frame_decode_rejects_every_wrong_field_even_with_a_sound_checksum),
        cmocka_unit_test(frame_decode_rejects_too_few_and_too_many_nodes_of_the_right_length),
        cmocka_unit_test(frame_decode_leaves_its_outputs_alone_on_a_fault),
        cmocka_unit_test(frame_encode_refuses_what_decode_would),
        cmocka_unit_test(frame_rows_fit_one_packet),
        cmocka_unit_test(frame_payload_hash_sees_both_planes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
