// Strangers on the bus: whatever comes, server and client live on, in the memory they had.
#include "messages/bytes.h"
#include "messages/control.h"
#include "messages/frame.h"
#include "messages/random.h"
#include "messages/style.h"
#include "tests/bus.h"

#include <hair_character_t.h>
#include <hair_guides_t.h>
#include <hair_pose_t.h>
#include <hair_request_t.h>
#include <hair_status_t.h>
#include <hair_style_t.h>
#include <hair_tuning_t.h>
#include <hair_wind_t.h>

#include <zlib.h>

#define GUIDES       "HAIR_GUIDES_0000"
#define LARGEST      1440 // of a message's data in one packet, whatever its channel
#define STEP         17   // of sizes
#define BURST        40   // datagrams between pauses: a flood is the kernel's to drop, not ours
#define GROWTH_KIB   4096
#define GUIDES_TICKS 30

typedef struct Kind {
    const char* channel;
    int64_t (*fingerprint)(void);
    size_t sound; // the one size that could be right; 0: many could
} Kind;

static const Kind kinds[] = {
    {GUIDES, __hair_guides_t_get_hash, 0},
    {CHANNEL_STYLE, __hair_style_t_get_hash, 0},
    {CHANNEL_POSE, __hair_pose_t_get_hash, 79},
    {CHANNEL_CHARACTER, __hair_character_t_get_hash, 51},
    {CHANNEL_WIND, __hair_wind_t_get_hash, 40},
    {CHANNEL_TUNING, __hair_tuning_t_get_hash, 45},
    {CHANNEL_REQUEST, __hair_request_t_get_hash, 539},
    {CHANNEL_STATUS, __hair_status_t_get_hash, 100},
};
#define KINDS (sizeof kinds / sizeof kinds[0])

static void send_paced(Bus* bus, const char* channel, const uint8_t* bytes, size_t size)
{
    bus_send(bus, channel, bytes, size);
    if (bus->sequence % BURST == 0) process_pause(0.002);
}

static void fill_random(uint8_t* bytes, size_t size, uint32_t seed)
{
    for (size_t i = 0; i < size; ++i)
        bytes[i] = (uint8_t)(256.0f * random_unit(seed, (uint32_t)i));
}

// Every size but the right one, with and without the type's fingerprint; the right one without.
static void send_wrong_sizes(Bus* bus, const Kind* kind, uint32_t seed)
{
    uint8_t bytes[LARGEST] = {0};
    for (size_t size = 0; size <= LARGEST; size += STEP) {
        fill_random(bytes, size, seed + (uint32_t)size);
        send_paced(bus, kind->channel, bytes, size);
        if (size < 8 || size == kind->sound) continue;
        bytes_put_be64(bytes, (uint64_t)kind->fingerprint());
        send_paced(bus, kind->channel, bytes, size);
    }
    if (kind->sound == 0) return;
    for (size_t size = kind->sound - 1; size <= kind->sound + 1; ++size) {
        fill_random(bytes, size, seed);
        if (size != kind->sound) bytes_put_be64(bytes, (uint64_t)kind->fingerprint());
        send_paced(bus, kind->channel, bytes, size);
    }
}

// A block that would be taken, were it not for one byte.
static void send_wrong_blocks(Bus* bus)
{
    static uint16_t positions[64 * 8 * 3];
    static int16_t tangents[64 * 8 * 3];
    uint8_t bytes[LARGEST], changed[LARGEST];
    FrameHeader header = {.epoch = 1, .pose = pose_identity(), .strand_count = 14, .nodes = 8};
    size_t size = frame_encode(bytes, sizeof bytes, &header, positions, tangents);
    assert_true(size > 0);
    for (size_t i = 0; i < size; i += i < FRAME_HEADER_BYTES ? 1 : 29) {
        memcpy(changed, bytes, size);
        changed[i] ^= 0xff;
        send_paced(bus, GUIDES, changed, size);
        // The same with a CRC that agrees: a liar, not noise. A wrong time or place that is sound
        // is believed (a trusted network), and so is a strand that some style may have; counts are
        // not.
        if (i < 74 || i == 75 || i >= 80) continue;
        uint32_t crc = (uint32_t)crc32(0, changed, 80);
        crc = (uint32_t)crc32(crc, changed + FRAME_HEADER_BYTES, (uInt)(size - FRAME_HEADER_BYTES));
        bytes_put_be32(changed + 80, crc);
        send_paced(bus, GUIDES, changed, size);
    }
    for (size_t cut = 0; cut < size; cut += STEP)
        send_paced(bus, GUIDES, bytes, cut);
}

static void send_part(Bus* bus, StylePart part, uint32_t lane_bytes, uint16_t parts, uint8_t lane)
{
    uint8_t bytes[LARGEST] = {0};
    size_t size = style_part_encode(bytes, sizeof bytes, &part);
    assert_true(size > 0);
    bytes_put_be32(bytes + 32, lane_bytes);
    bytes_put_be16(bytes + 42, parts);
    bytes[44] = lane;
    send_paced(bus, CHANNEL_STYLE, bytes, size);
}

static void send_absurd_lanes(Bus* bus, uint32_t seed)
{
    static const uint32_t lanes[] = {0, 1, 999, 65537, 4194305, 0x7fffffff, 0xffffffff};
    static const uint16_t parts[] = {0, 1, 2, 4096, 4097, 65535};
    uint8_t payload[1000];
    fill_random(payload, sizeof payload, seed);
    for (size_t i = 0; i < sizeof lanes / sizeof lanes[0]; ++i)
        for (size_t j = 0; j < sizeof parts / sizeof parts[0]; ++j)
            for (uint8_t lane = 0; lane < 3; ++lane) {
                // Another style each time, so that a table of them would grow.
                StylePart part = {.epoch = 1,
                                  .style_hash = seed + 100 * i + 10 * j + lane,
                                  .lane_bytes = sizeof payload,
                                  .parts = 1,
                                  .size = sizeof payload,
                                  .payload = payload};
                send_part(bus, part, lanes[i], parts[j], lane);
            }
}

// Numbers that are none in messages that are sound otherwise.
static void send_wrong_numbers(Bus* bus)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    PoseMessage pose = {.utime = 1, .pose = pose_identity()};
    size_t size = pose_encode(bytes, sizeof bytes, &pose);
    assert_true(size > 0);
    for (size_t at = 16; at + 8 <= size; at += 8) {
        memset(bytes + at, 0xff, 8); // not a number
        send_paced(bus, CHANNEL_POSE, bytes, size);
    }
    WindMessage wind = {.slot_count = 1024};
    size = wind_encode(bytes, sizeof bytes, &wind);
    assert_true(size > 0);
    for (size_t at = 16; at + 4 <= size; at += 4) {
        memset(bytes + at, 0xff, 4);
        send_paced(bus, CHANNEL_WIND, bytes, size);
    }
    TuningMessage tuning = {.slot_count = 1024, .set = TUNING_EVERY};
    for (size_t at = 16; at + 4 <= 45; at += 4) {
        size = tuning_encode(bytes, sizeof bytes, &tuning);
        assert_true(size > 0);
        memset(bytes + at, 0xff, 4);
        send_paced(bus, CHANNEL_TUNING, bytes, size);
    }
    StatusMessage status = {.epoch = 1};
    size = status_encode(bytes, sizeof bytes, &status);
    assert_true(size > 0);
    bytes_put_be64(bytes + 16, UINT64_MAX); // an epoch below zero
    send_paced(bus, CHANNEL_STATUS, bytes, size);
}

// No LCM messages at all. LC03, liblcm's fragments, are left out: its reassembly does not survive
// them, which is why nothing of ours is ever fragmented and a firewall should drop them.
static void send_noise(Bus* bus, uint32_t seed)
{
    uint8_t bytes[LARGEST] = {0};
    for (size_t size = 1; size < LARGEST; size += STEP) {
        fill_random(bytes, size, seed + (uint32_t)size);
        if (size >= 4 && memcmp(bytes, "LC03", 4) == 0) continue;
        bus_send_raw(bus, bytes, size);
        if (size % BURST == 0) process_pause(0.002);
    }
}

static void send_everything(Bus* bus, uint32_t seed)
{
    for (size_t i = 0; i < KINDS; ++i)
        send_wrong_sizes(bus, &kinds[i], seed + 10000 * (uint32_t)i);
    send_wrong_blocks(bus);
    send_absurd_lanes(bus, seed);
    send_wrong_numbers(bus);
    send_noise(bus, seed);
}

static bool is_block(const Bus* bus, FrameHeader* header)
{
    const uint8_t *positions, *tangents;
    return bus->channel != NULL && strcmp(bus->channel, GUIDES) == 0 &&
           frame_decode(header, &positions, &tangents, bus->data, bus->data_size) == FRAME_OK;
}

// Hears out the bus until the server of `epoch` has published `ticks` more.
static void expect_ticks(Bus* bus, int64_t epoch, int ticks)
{
    double until = process_now_s() + PROCESS_PATIENCE;
    int32_t first = -1, last = -1;
    while (first < 0 || last < first + ticks) {
        FrameHeader header;
        bool heard = bus_hear(bus, 0.1) && is_block(bus, &header) && header.epoch == epoch;
        if (heard && first < 0) first = header.tick;
        if (heard) last = header.tick;
        assert_true(process_now_s() < until);
    }
}

// What the server of `epoch` counts as refused in a status sent from now on.
static int64_t heard_rejected(Bus* bus, int64_t epoch)
{
    double until = process_now_s() + PROCESS_PATIENCE;
    while (bus_hear(bus, 0.0)) {
    }
    StatusMessage status = {0};
    for (;;) {
        assert_true(process_now_s() < until);
        if (!bus_hear(bus, 0.1) || bus->channel == NULL) continue;
        if (strcmp(bus->channel, CHANNEL_STATUS) == 0 &&
            status_decode(&status, bus->data, bus->data_size, NULL) && status.epoch == epoch)
            return status.rejected;
    }
}

static void expect_no_growth(const char* name, long before, long after)
{
    print_message("%s: %ld KiB, then %ld KiB\n", name, before, after);
    // A sanitizer keeps what was freed for a while.
    if (!PROCESS_SANITIZED) assert_true(after - before < GROWTH_KIB);
}

static int lines_with(const char* text, const char* word)
{
    int count = 0;
    for (const char* at = text; (at = strstr(at, word)) != NULL; at += strlen(word))
        ++count;
    return count;
}

static void server_and_client_live_through_hostile_messages(void** state)
{
    (void)state;
    static Process server, client;
    static Bus bus;
    Folder folder;
    folder_make(&folder);
    bus_open(&bus);
    process_start(&server, ARGS(SERVER, "--motion", "bus", "--style", "bob", "--ticks", "9000"));
    process_wait_ready(&server);
    process_start(&client, ARGS(CLIENT, "--backend", "null", "--size", "16x16", "--msaa", "1",
                                "--out", folder_name(&folder, "pictures"), "--stats",
                                folder_name(&folder, "stats.json")));
    process_wait_ready(&client);
    int64_t epoch = process_number(&server, "ready: epoch ");
    send_everything(&bus, 1); // while the client still waits for its style
    wait_pictures(folder_name(&folder, "pictures"), 10);
    long server_kib = process_rss_kib(&server), client_kib = process_rss_kib(&client);
    for (uint32_t round = 2; round < 6; ++round)
        send_everything(&bus, round * 1000003);
    int drawn = pictures_in(folder_name(&folder, "pictures"));
    expect_ticks(&bus, epoch, GUIDES_TICKS);
    wait_pictures(folder_name(&folder, "pictures"), drawn + GUIDES_TICKS);
    expect_no_growth("server", server_kib, process_rss_kib(&server));
    expect_no_growth("client", client_kib, process_rss_kib(&client));
    int64_t refused = heard_rejected(&bus, epoch);
    process_stop(&client);
    process_stop(&server);
    json_t* root = stats_load(folder_name(&folder, "stats.json"));
    int64_t rejected = (int64_t)stats_number(root, "datagrams.rejected");
    print_message("refused: %d by the server, %d by the client; %d pictures, tick %d, lost %d\n",
                  (int)refused, (int)rejected, (int)stats_integer(root, "frames"),
                  (int)stats_integer(root, "tick"), (int)stats_number(root, "datagrams.lost"));
    assert_true(refused > 100);
    assert_true(rejected > 100);
    assert_int_equal(stats_integer(root, "epoch"), epoch);
    json_decref(root);
    // One line a kind: six channels here, and damage of five kinds or a bad style part there.
    if (process_complaints(&server) != 6) process_fail(&server, "not one line a channel");
    if (process_lines(client.text[1]) > 6 || process_lines(client.text[1]) < 2)
        process_fail(&client, "not one line a kind");
    for (int kind = 1; kind <= FRAME_CRC; ++kind)
        assert_true(lines_with(client.text[1], frame_fault_text((FrameFault)kind)) <= 1);
    bus_close(&bus);
    folder_remove(&folder);
}

static void two_daemons_on_a_slot_are_told_once_and_the_newer_is_shown(void** state)
{
    (void)state;
    static Process older, newer, client;
    static Bus bus;
    Folder folder;
    folder_make(&folder);
    bus_open(&bus);
    // Fixed epochs: neither gives way to the other.
    process_start(&older, ARGS(SERVER, "--style", "bob", "--epoch", "1000", "--ticks", "9000"));
    process_start(&newer, ARGS(SERVER, "--style", "bob", "--epoch", "2000", "--ticks", "9000"));
    process_start(&client, ARGS(CLIENT, "--backend", "null", "--size", "16x16", "--msaa", "1",
                                "--stats", folder_name(&folder, "stats.json")));
    process_wait_text(&client, 1, "two daemons");
    expect_ticks(&bus, 1000, GUIDES_TICKS);
    expect_ticks(&bus, 2000, GUIDES_TICKS);
    process_stop(&client);
    process_stop(&older);
    process_stop(&newer);
    assert_int_equal(lines_with(client.text[1], "two daemons"), 1);
    assert_int_equal(process_lines(client.text[1]), 1);
    json_t* root = stats_load(folder_name(&folder, "stats.json"));
    assert_int_equal(stats_integer(root, "epoch"), 2000);
    assert_true(stats_number(root, "epoch_changes") <= 1.0);
    json_decref(root);
    bus_close(&bus);
    folder_remove(&folder);
}

int main(void)
{
    process_setup();
    bus_require_private();
    const struct CMUnitTest tests[] = {
        PROCESS_TEST(server_and_client_live_through_hostile_messages),
        PROCESS_TEST(two_daemons_on_a_slot_are_told_once_and_the_newer_is_shown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
