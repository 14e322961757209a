// Promises of messages/style_part.c: the parts of a style's lanes on the wire.
#include "messages/bytes.h"
#include "messages/random.h"
#include "messages/style.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <hair_style_t.h>

#include <zlib.h>

static void style_part_is_as_long_as_lcm_gen_says_and_has_its_bytes(void** state)
{
    (void)state;
    hair_style_t empty = {0};
    assert_int_equal(hair_style_t_encoded_size(&empty), STYLE_HEADER_BYTES);
    uint8_t payload[100], ours[300], theirs[300];
    memset(payload, 0xa5, sizeof payload);
    StylePart part = {.utime = 11,
                      .epoch = 22,
                      .style_hash = 0xfedcba9876543210u,
                      .lane_bytes = 350,
                      .part = 1,
                      .parts = 4,
                      .lane = STYLE_BULK,
                      .offset = 100,
                      .size = 100,
                      .payload = payload};
    size_t size = style_part_encode(ours, sizeof ours, &part);
    hair_style_t m = {.utime = 11,
                      .epoch = 22,
                      .style_hash = (int64_t)part.style_hash,
                      .lane_bytes = 350,
                      .offset = 100,
                      .part = 1,
                      .parts = 4,
                      .lane = 1,
                      .format = STYLE_FORMAT,
                      .crc = (int32_t)crc32(0, payload, 100),
                      .n = 100,
                      .payload = payload};
    assert_int_equal(hair_style_t_encode(theirs, 0, sizeof theirs, &m), size);
    assert_memory_equal(ours, theirs, size);
    for (size_t cut = 0; cut < size; ++cut)
        assert_false(style_part_decode(&part, ours, cut, NULL));
}

static void style_parts_assemble_under_every_mtu(void** state)
{
    (void)state;
    uint8_t lane[20000], built[20000], message[65000];
    for (size_t i = 0; i < sizeof lane; ++i)
        lane[i] = (uint8_t)random_hash((uint32_t)i);
    for (int mtu = 200; mtu < 30000; mtu = mtu * 5 / 3) {
        int each = style_part_bytes(mtu), parts = style_part_count(sizeof lane, each);
        memset(built, 0, sizeof built);
        for (int p = parts - 1; p >= 0; --p) {
            uint32_t at = (uint32_t)(p * each);
            StylePart part = {.lane_bytes = sizeof lane,
                              .part = (uint16_t)p,
                              .parts = (uint16_t)parts,
                              .lane = STYLE_FAST,
                              .offset = at,
                              .size = p < parts - 1 ? (uint32_t)each : (uint32_t)sizeof lane - at,
                              .payload = lane + at};
            size_t size = style_part_encode(message, sizeof message, &part);
            assert_true(size > 0 && (int)size + 47 <= mtu);
            StylePart got;
            assert_true(style_part_decode(&got, message, size, NULL));
            memcpy(built + got.offset, got.payload, got.size);
        }
        assert_memory_equal(built, lane, sizeof lane);
    }
}

typedef struct WrongField {
    int at, bytes;
    uint64_t value;
} WrongField;

static void style_part_decode_rejects_every_wrong_field(void** state)
{
    (void)state;
    static const WrongField wrong[] = {
        {0, 8, 5},
        {8, 8, UINT64_MAX},
        {16, 8, 1ull << 63},
        {32, 4, 0},
        {32, 4, 0xffffffff},
        {32, 4, 5u << 20},
        {36, 4, 101},
        {36, 4, 0xffffff9c},
        {40, 2, 0},
        {40, 2, 4},
        {40, 2, 0xffff},
        {42, 2, 0},
        {42, 2, 2},
        {42, 2, 0x8000},
        {44, 1, 2},
        {45, 1, 0},
        {45, 1, STYLE_FORMAT + 1},
        {46, 2, 1},
        {48, 4, 1},
        {52, 4, 99},
        {52, 4, 0xffffffff},
    };
    uint8_t payload[100] = {1, 2, 3}, bytes[200];
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
        StylePart part = {.utime = 11,
                          .lane_bytes = 350,
                          .part = 1,
                          .parts = 4,
                          .lane = STYLE_BULK,
                          .offset = 100,
                          .size = 100,
                          .payload = payload};
        size_t size = style_part_encode(bytes, sizeof bytes, &part);
        assert_true(style_part_decode(&part, bytes, size, NULL));
        for (int k = 0; k < wrong[i].bytes; ++k)
            bytes[wrong[i].at + k] = (uint8_t)(wrong[i].value >> (8 * (wrong[i].bytes - 1 - k)));
        Fault fault = {0};
        if (style_part_decode(&part, bytes, size, &fault)) fail_msg("wrong field %zu passed", i);
        assert_true(fault.text[0] != '\0');
        if (wrong[i].at == 46) assert_non_null(strstr(fault.text, "reserved field is 1"));
    }
    // The only part of a lane cannot begin inside it.
    StylePart lone = {.lane_bytes = 100, .parts = 1, .size = 100, .payload = payload};
    assert_int_equal(style_part_encode(bytes, sizeof bytes, &lone), 156);
    bytes[35] = 200;
    bytes[39] = 100;
    assert_false(style_part_decode(&lone, bytes, 156, NULL));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(style_part_is_as_long_as_lcm_gen_says_and_has_its_bytes),
        cmocka_unit_test(style_parts_assemble_under_every_mtu),
        cmocka_unit_test(style_part_decode_rejects_every_wrong_field),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
