// What is on the wire, counted on the wire: datagrams, bytes, fragments.
#include "messages/bytes.h"
#include "messages/frame.h"
#include "messages/style.h"
#include "tests/bus.h"
#include "tests/tfx.h"

#define LARGEST_UDP  1472 // MTU 1500 less IP 20, UDP 8
#define PACKET_EXTRA 28
#define TICKS        120

typedef struct Count {
    int datagrams, payload, packets; // packets: bytes of IP packets
} Count;

typedef struct Tally {
    Count ticks[TICKS];
    int64_t style_parts[STYLE_LANES], requests, others, foreign;
    size_t largest;
} Tally;

// A counter of /proc/net/snmp's "Ip:" lines: names in the first, values in the second.
static int64_t ip_counter(const char* name)
{
    char names[1024], values[1024], *names_at, *values_at;
    FILE* file = fopen("/proc/net/snmp", "r");
    assert_non_null(file);
    assert_non_null(fgets(names, sizeof names, file));
    assert_non_null(fgets(values, sizeof values, file));
    fclose(file);
    const char* key = strtok_r(names, " \n", &names_at);
    const char* value = strtok_r(values, " \n", &values_at);
    while (key != NULL && value != NULL && strcmp(key, name) != 0) {
        key = strtok_r(NULL, " \n", &names_at);
        value = strtok_r(NULL, " \n", &values_at);
    }
    assert_non_null(key);
    assert_non_null(value);
    return strtoll(value, NULL, 10);
}

static void count_block(Tally* tally, const Bus* bus)
{
    FrameHeader header;
    const uint8_t *positions, *tangents;
    assert_int_equal(frame_decode(&header, &positions, &tangents, bus->data, bus->data_size),
                     FRAME_OK);
    assert_in_range(header.tick, 0, TICKS - 1);
    Count* count = &tally->ticks[header.tick];
    ++count->datagrams;
    count->payload += (int)bus->data_size - FRAME_HEADER_BYTES;
    count->packets += (int)bus->size + PACKET_EXTRA;
}

static void count_datagram(Tally* tally, const Bus* bus)
{
    if (bus->size > tally->largest) tally->largest = bus->size;
    if (bus->channel == NULL) {
        ++tally->foreign;
    } else if (strcmp(bus->channel, "HAIR_GUIDES_0000") == 0) {
        count_block(tally, bus);
    } else if (strcmp(bus->channel, "HAIR_STYLE") == 0) {
        StylePart part;
        assert_true(style_part_decode(&part, bus->data, bus->data_size, NULL));
        ++tally->style_parts[part.lane];
    } else if (strcmp(bus->channel, "HAIR_REQUEST") == 0) {
        ++tally->requests;
    } else {
        ++tally->others;
    }
}

// Counts all that is said until the program ends.
static void listen_to(Tally* tally, Bus* bus, Process* process)
{
    *tally = (Tally){0};
    double until = process_now_s() + PROCESS_PATIENCE;
    while (!process->ended) {
        while (bus_hear(bus, 0.01))
            count_datagram(tally, bus);
        process_pump(process, 0.0);
        assert_true(process_now_s() < until);
    }
    while (bus_hear(bus, 0.05))
        count_datagram(tally, bus);
}

static void a_tick_of_64x8_is_5_datagrams_of_6144_bytes_payload(void** state)
{
    (void)state;
    static Process server;
    static Bus bus;
    static Tally tally;
    bus_open(&bus);
    process_start(&server, ARGS(SERVER, "--motion", "shake", "--ticks", "120"));
    listen_to(&tally, &bus, &server);
    process_expect(&server, 0);
    int seen = 0;
    for (int tick = 0; tick < TICKS; ++tick) {
        const Count* count = &tally.ticks[tick];
        if (count->datagrams == 0) continue; // a busy machine drops ticks, whole ones
        ++seen;
        assert_int_equal(count->datagrams, 5);
        assert_int_equal(count->payload, 64 * 8 * 12);
        assert_in_range(count->packets, 6144, 7500);
    }
    print_message("%d ticks, %d bytes of packets each; largest UDP payload %zu\n", seen,
                  tally.ticks[TICKS - 1].packets, tally.largest);
    assert_in_range(seen, 1, TICKS);
    assert_int_equal(tally.ticks[TICKS - 1].datagrams, 5);
    assert_int_equal(tally.foreign, 0);
    assert_true(tally.largest <= LARGEST_UDP);
    bus_close(&bus);
}

// An imported groom, so that the bulk lane and requests are on the wire as well.
static void neither_guides_nor_styles_nor_requests_are_fragmented(void** state)
{
    (void)state;
    static Process server, client;
    static Bus bus;
    static Tally tally;
    Folder folder;
    folder_make(&folder);
    tfx_write(folder_name(&folder, "hair.tfx"), 512, 16, 80.0f);
    int64_t before = ip_counter("FragCreates");
    bus_open(&bus);
    // The client first: it asks for what a server that has just begun has not sent yet.
    process_start(&client, ARGS(CLIENT, "--backend", "null", "--size", "16x16", "--frames", "60",
                                "--timeout", "60"));
    process_wait_ready(&client);
    process_start(&server,
                  ARGS(SERVER, "--style", folder_name(&folder, "hair.tfx"), "--ticks", "120"));
    listen_to(&tally, &bus, &server);
    process_expect(&server, 0);
    process_expect(&client, 0);
    print_message("style parts: %d fast, %d bulk; %d requests; largest UDP payload %zu\n",
                  (int)tally.style_parts[STYLE_FAST], (int)tally.style_parts[STYLE_BULK],
                  (int)tally.requests, tally.largest);
    assert_true(tally.style_parts[STYLE_FAST] > 0);
    assert_true(tally.style_parts[STYLE_BULK] > 1);
    assert_int_equal(tally.foreign, 0);
    assert_true(tally.largest <= LARGEST_UDP);
    assert_int_equal(ip_counter("FragCreates") - before, 0);
    bus_close(&bus);
    folder_remove(&folder);
}

// Else the zero above would prove nothing.
static void a_larger_datagram_would_have_been_counted_as_fragments(void** state)
{
    (void)state;
    static Bus bus;
    static const uint8_t bytes[4000];
    bus_open(&bus);
    int64_t before = ip_counter("FragCreates");
    bus_send_raw(&bus, bytes, sizeof bytes);
    assert_int_equal(ip_counter("FragCreates") - before, 3);
    bus_close(&bus);
}

int main(void)
{
    process_setup();
    bus_require_private();
    const struct CMUnitTest tests[] = {
        PROCESS_TEST(a_tick_of_64x8_is_5_datagrams_of_6144_bytes_payload),
        PROCESS_TEST(neither_guides_nor_styles_nor_requests_are_fragmented),
        PROCESS_TEST(a_larger_datagram_would_have_been_counted_as_fragments),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
