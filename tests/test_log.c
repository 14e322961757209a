#include "messages/bytes.h"
#include "messages/log.h"
#include "messages/random.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <lcm/eventlog.h>

#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#define EVENTS 12

typedef struct Bytes {
    size_t size;
    uint8_t at[8192];
} Bytes;

static void make_path(char path[64])
{
    snprintf(path, 64, P_tmpdir "/strandcast-test-log-XXXXXX");
    int file = mkstemp(path);
    assert_true(file >= 0);
    close(file);
}

static size_t event_size(int i)
{
    return (size_t)(i * 37 % 300);
}

static void fill_event(uint8_t* data, int i)
{
    for (size_t k = 0; k < event_size(i); ++k)
        data[k] = (uint8_t)random_hash((uint32_t)i * 1000 + (uint32_t)k);
    // A sync word inside a payload is no damage.
    if (event_size(i) > 40) bytes_put_be32(data + 20, 0xeda1da01u);
}

static void write_small(const char* path)
{
    LogWriter* writer = log_create(path, true, NULL);
    assert_non_null(writer);
    for (int i = 0; i < EVENTS; ++i) {
        uint8_t data[300];
        char channel[32];
        fill_event(data, i);
        snprintf(channel, sizeof channel, "HAIR_GUIDES_%04d", i);
        assert_true(log_write(writer, 1000 + i, channel, data, event_size(i), NULL));
    }
    assert_true(log_finish(writer, NULL));
}

static void load(const char* path, Bytes* bytes)
{
    FILE* file = fopen(path, "rb");
    bytes->size = fread(bytes->at, 1, sizeof bytes->at, file);
    fclose(file);
}

static void save(const char* path, const uint8_t* bytes, size_t size)
{
    int file = open(path, O_WRONLY | O_TRUNC);
    assert_int_equal(write(file, bytes, size), (ssize_t)size);
    close(file);
}

// Whether the event is number `i` of the small log, bit for bit.
static bool is_event(const LogEvent* event, int i)
{
    uint8_t data[300];
    char channel[32];
    fill_event(data, i);
    snprintf(channel, sizeof channel, "HAIR_GUIDES_%04d", i);
    return event->number == i && event->utime == 1000 + i && event->size == event_size(i) &&
           strcmp(event->channel, channel) == 0 && memcmp(event->data, data, event->size) == 0;
}

static void log_reads_back_what_was_written(void** state)
{
    (void)state;
    char path[64];
    make_path(path);
    write_small(path);
    LogReader* reader = log_open(path, NULL);
    LogEvent event;
    int64_t offset = -1;
    for (int pass = 0; pass < 2; ++pass) {
        for (int i = 0; i < EVENTS; ++i) {
            assert_true(log_next(reader, &event));
            assert_true(is_event(&event, i));
            if (i == 7) offset = event.offset;
        }
        assert_false(log_next(reader, &event));
        log_rewind(reader);
    }
    log_seek(reader, offset);
    assert_true(log_next(reader, &event));
    assert_true(is_event(&event, 7));
    assert_int_equal(log_damaged_bytes(reader), 0);
    log_close(reader);
    unlink(path);
}

static void log_is_readable_by_liblcm(void** state)
{
    (void)state;
    char path[64];
    make_path(path);
    write_small(path);
    lcm_eventlog_t* theirs = lcm_eventlog_create(path, "r");
    assert_non_null(theirs);
    for (int i = 0; i < EVENTS; ++i) {
        lcm_eventlog_event_t* e = lcm_eventlog_read_next_event(theirs);
        assert_non_null(e);
        LogEvent event = {.number = e->eventnum,
                          .utime = e->timestamp,
                          .data = e->data,
                          .size = (size_t)e->datalen};
        memcpy(event.channel, e->channel, (size_t)e->channellen);
        assert_true(is_event(&event, i));
        lcm_eventlog_free_event(e);
    }
    lcm_eventlog_destroy(theirs);
    unlink(path);
}

static void log_reads_what_liblcm_writes(void** state)
{
    (void)state;
    char path[64], channel[] = "HAIR_POSE";
    uint8_t data[] = {1, 2, 3};
    make_path(path);
    lcm_eventlog_t* theirs = lcm_eventlog_create(path, "w");
    lcm_eventlog_event_t e = {
        .timestamp = 42, .channellen = 9, .datalen = 3, .channel = channel, .data = data};
    assert_int_equal(lcm_eventlog_write_event(theirs, &e), 0);
    lcm_eventlog_destroy(theirs);
    LogReader* reader = log_open(path, NULL);
    LogEvent event;
    assert_true(log_next(reader, &event));
    assert_int_equal(event.utime, 42);
    assert_string_equal(event.channel, "HAIR_POSE");
    assert_memory_equal(event.data, data, 3);
    log_close(reader);
    unlink(path);
}

static void write_whole(char path[64], Bytes* whole)
{
    make_path(path);
    write_small(path);
    load(path, whole);
}

static void log_truncated_anywhere_gives_the_whole_events_before_the_cut(void** state)
{
    (void)state;
    char path[64];
    static Bytes whole;
    write_whole(path, &whole);
    int64_t ends[EVENTS + 1] = {0};
    for (int i = 0; i < EVENTS; ++i)
        ends[i + 1] = ends[i] + 28 + 16 + (int64_t)event_size(i);
    assert_int_equal(ends[EVENTS], whole.size);
    for (int64_t cut = 0; cut <= (int64_t)whole.size; ++cut) {
        assert_int_equal(truncate(path, (off_t)whole.size), 0);
        save(path, whole.at, (size_t)cut);
        LogReader* reader = log_open(path, NULL);
        LogEvent event;
        int count = 0;
        while (log_next(reader, &event))
            assert_true(is_event(&event, count++));
        assert_true(ends[count] <= cut && (count == EVENTS || cut < ends[count + 1]));
        assert_int_equal(log_damaged_bytes(reader), cut - ends[count]);
        log_close(reader);
    }
    unlink(path);
}

static void log_loses_only_the_event_whose_header_is_damaged(void** state)
{
    (void)state;
    char path[64];
    static Bytes whole;
    write_whole(path, &whole);
    size_t start = 0;
    for (int i = 0; i < 4; ++i)
        start += 28 + 16 + event_size(i);
    const uint32_t lengths[] = {0xffffffffu, 0x7fffffffu, 1u << 20, 3000, 500};
    for (size_t k = 0; k < 2 + sizeof lengths / sizeof lengths[0]; ++k) {
        Bytes damaged = whole;
        if (k == 0) damaged.at[start] ^= 1;     // sync
        if (k == 1) damaged.at[start + 20] = 1; // channel length
        if (k > 1) bytes_put_be32(damaged.at + start + 24, lengths[k - 2]);
        save(path, damaged.at, damaged.size);
        LogReader* reader = log_open(path, NULL);
        LogEvent event;
        for (int i = 0; i < EVENTS; ++i) {
            if (i == 4) continue;
            assert_true(log_next(reader, &event));
            assert_true(is_event(&event, i));
        }
        assert_false(log_next(reader, &event));
        int64_t lost = 28 + 16 + (int64_t)event_size(4);
        assert_int_equal(log_damaged_bytes(reader), lost);
        log_rewind(reader);
        while (log_next(reader, &event)) {
        }
        assert_int_equal(log_damaged_bytes(reader), lost); // a second pass counts nothing twice
        log_close(reader);
    }
    unlink(path);
}

static void log_survives_corruption(void** state)
{
    (void)state;
    char path[64];
    static Bytes whole;
    write_whole(path, &whole);
    for (uint32_t n = 0; n < 3000; ++n) {
        Bytes damaged = whole;
        for (uint32_t i = 0; i < 1 + n % 40; ++i)
            damaged.at[random_hash2(n, i) % damaged.size] = (uint8_t)random_hash2(n, 99 + i);
        save(path, damaged.at, damaged.size);
        LogReader* reader = log_open(path, NULL);
        LogEvent event;
        int64_t sound = 0, last = -1;
        volatile uint8_t sum = 0;
        while (log_next(reader, &event)) {
            assert_true(event.offset > last);
            last = event.offset;
            for (size_t k = 0; k < event.size; ++k)
                sum ^= event.data[k];
            sound += 28 + (int64_t)strlen(event.channel) + (int64_t)event.size;
        }
        (void)sum;
        assert_int_equal(sound + log_damaged_bytes(reader), damaged.size);
        log_close(reader);
    }
    unlink(path);
}

static void log_of_noise_holds_nothing(void** state)
{
    (void)state;
    char path[64];
    static Bytes noise;
    make_path(path);
    noise.size = sizeof noise.at;
    for (uint32_t i = 0; i < noise.size; ++i)
        noise.at[i] = i % 3 ? 0xed : (uint8_t)random_hash(i);
    save(path, noise.at, noise.size);
    LogReader* reader = log_open(path, NULL);
    LogEvent event;
    assert_false(log_next(reader, &event));
    assert_int_equal(log_damaged_bytes(reader), noise.size);
    log_seek(reader, -5);
    log_seek(reader, 1ll << 40);
    assert_false(log_next(reader, &event));
    log_close(reader);
    unlink(path);
}

static void log_carries_the_largest_event_and_refuses_a_larger_one(void** state)
{
    (void)state;
    char path[64];
    make_path(path);
    uint8_t* data = calloc(1, LOG_MAX_DATA_BYTES + 1);
    for (uint32_t i = 0; i < LOG_MAX_DATA_BYTES; ++i)
        data[i] = (uint8_t)random_hash(i);
    char name[LOG_MAX_CHANNEL_BYTES + 2];
    memset(name, 'n', sizeof name);
    name[LOG_MAX_CHANNEL_BYTES + 1] = '\0';
    LogWriter* writer = log_create(path, true, NULL);
    Fault fault = {0};
    assert_false(log_write(writer, 1, "A", data, LOG_MAX_DATA_BYTES + 1, &fault));
    assert_false(log_write(writer, 1, name, data, 1, &fault));
    assert_false(log_write(writer, 1, "", data, 1, &fault));
    name[LOG_MAX_CHANNEL_BYTES] = '\0';
    for (int i = 0; i < 5; ++i)
        assert_true(log_write(writer, i, name, data, LOG_MAX_DATA_BYTES - (size_t)i, &fault));
    assert_true(log_finish(writer, NULL));
    LogReader* reader = log_open(path, NULL);
    LogEvent event;
    for (int i = 0; i < 5; ++i) {
        assert_true(log_next(reader, &event));
        assert_int_equal(event.size, LOG_MAX_DATA_BYTES - i);
        assert_memory_equal(event.data, data, event.size);
        assert_string_equal(event.channel, name);
    }
    assert_false(log_next(reader, &event));
    assert_int_equal(log_damaged_bytes(reader), 0);
    log_close(reader);
    free(data);
    unlink(path);
}

static void log_skips_an_event_beyond_the_cap(void** state)
{
    (void)state;
    char path[64];
    make_path(path);
    size_t beyond = LOG_MAX_DATA_BYTES + 1;
    uint8_t* bytes = calloc(1, beyond + 100);
    static const uint8_t good[] = {1, 2, 3};
    for (int i = 0; i < 2; ++i) {
        uint8_t* at = bytes + (i == 0 ? 0 : 29 + beyond);
        bytes_put_be32(at, 0xeda1da01u);
        bytes_put_be32(at + 20, 1);
        bytes_put_be32(at + 24, i == 0 ? (uint32_t)beyond : sizeof good);
        at[28] = 'A';
        if (i == 1) memcpy(at + 29, good, sizeof good);
    }
    save(path, bytes, 29 + beyond + 29 + sizeof good);
    LogReader* reader = log_open(path, NULL);
    LogEvent event;
    assert_true(log_next(reader, &event));
    assert_int_equal(event.size, sizeof good);
    assert_int_equal(log_damaged_bytes(reader), 29 + beyond);
    assert_false(log_next(reader, &event));
    log_close(reader);
    free(bytes);
    unlink(path);
}

static void log_create_keeps_an_existing_file_and_faults_name_the_path(void** state)
{
    (void)state;
    char path[64];
    make_path(path);
    write_small(path);
    Fault fault = {0};
    assert_null(log_create(path, false, &fault));
    assert_non_null(strstr(fault.text, path));
    LogReader* reader = log_open(path, NULL);
    LogEvent event;
    assert_true(log_next(reader, &event));
    log_close(reader);
    unlink(path);
    fault.text[0] = '\0';
    assert_null(log_open(path, &fault));
    assert_non_null(strstr(fault.text, path));
    assert_null(log_open(P_tmpdir, &fault));
    assert_non_null(strstr(fault.text, P_tmpdir));
    assert_null(log_create("/nowhere/at/all", false, &fault));
    assert_non_null(strstr(fault.text, "/nowhere"));
}

static int64_t bytes_of(const char* path)
{
    struct stat status;
    return stat(path, &status) == 0 ? (int64_t)status.st_size : -1;
}

static void log_create_loses_nothing_before_the_first_event(void** state)
{
    (void)state;
    char path[64];
    make_path(path);
    write_small(path);
    int64_t before = bytes_of(path);
    LogWriter* writer = log_create(path, true, NULL);
    assert_non_null(writer);
    assert_true(log_finish(writer, NULL));
    assert_int_equal(bytes_of(path), before);
    writer = log_create(path, true, NULL);
    assert_true(log_write(writer, 1, "A", (const uint8_t*)"x", 1, NULL));
    assert_true(log_finish(writer, NULL));
    assert_int_equal(bytes_of(path), 28 + 1 + 1); // nothing of the earlier one is left behind it
    unlink(path);
    for (int overwrite = 0; overwrite < 2; ++overwrite) {
        writer = log_create(path, overwrite == 1, NULL);
        assert_non_null(writer);
        assert_true(log_finish(writer, NULL));
        assert_int_equal(bytes_of(path), -1); // made here, never written
    }
}

static void log_create_refuses_a_file_that_is_being_recorded(void** state)
{
    (void)state;
    char path[64];
    Fault fault = {0};
    make_path(path);
    LogWriter* first = log_create(path, true, NULL);
    assert_true(log_write(first, 1, "A", (const uint8_t*)"x", 1, NULL));
    assert_null(log_create(path, true, &fault));
    assert_non_null(strstr(fault.text, path));
    assert_non_null(strstr(fault.text, "another program"));
    assert_true(log_finish(first, NULL));
    assert_int_equal(bytes_of(path), 30);
    LogWriter* second = log_create(path, true, &fault);
    assert_non_null(second);
    log_finish(second, NULL);
    unlink(path);
}

static void log_create_refuses_pipes_at_once(void** state)
{
    (void)state;
    char path[64];
    Fault fault = {0};
    make_path(path);
    unlink(path);
    assert_int_equal(mkfifo(path, 0600), 0);
    assert_null(log_create(path, true, &fault));
    assert_non_null(strstr(fault.text, "not a file"));
    int reader = open(path, O_RDONLY | O_NONBLOCK); // now it could be opened
    assert_null(log_create(path, true, &fault));
    assert_non_null(strstr(fault.text, "not a file"));
    close(reader);
    unlink(path);
}

// What is gone from the file can only come from the window.
static void log_seek_reads_nothing_again_that_it_still_holds(void** state)
{
    (void)state;
    char path[64];
    int64_t offset[EVENTS];
    LogEvent event;
    make_path(path);
    write_small(path);
    LogReader* reader = log_open(path, NULL);
    for (int i = 0; i < EVENTS; ++i) {
        assert_true(log_next(reader, &event));
        offset[i] = event.offset;
    }
    assert_int_equal(truncate(path, 0), 0);
    for (int i = EVENTS - 1; i >= 0; --i) {
        log_seek(reader, offset[i]);
        assert_true(log_next(reader, &event));
        assert_true(is_event(&event, i));
    }
    log_close(reader);
    unlink(path);
}

// Writes until something gives; returns how many faults were reported.
static int write_much(LogWriter* writer, Fault* fault)
{
    static uint8_t data[10000];
    int faults = 0;
    for (int i = 0; i < 100; ++i)
        faults += !log_write(writer, i, "HAIR_GUIDES_0000", data, sizeof data, fault);
    return faults;
}

static void log_write_reports_a_full_disk_once(void** state)
{
    (void)state;
    Fault fault = {0};
    LogWriter* writer = log_create("/dev/full", true, &fault);
    if (writer == NULL) {
        print_message("SKIPPED: %s\n", fault.text);
        skip();
    }
    assert_int_equal(write_much(writer, &fault), 1);
    assert_non_null(strstr(fault.text, "/dev/full"));
    assert_non_null(strstr(fault.text, "No space left"));
    assert_false(log_finish(writer, &fault));
    // What is only buffered must not be lost in silence either.
    writer = log_create("/dev/full", true, &fault);
    assert_true(log_write(writer, 0, "A", (const uint8_t*)"x", 1, &fault));
    assert_false(log_finish(writer, &fault));
}

static void log_cut_short_by_a_full_disk_ends_with_a_whole_event(void** state)
{
    (void)state;
    char path[64];
    make_path(path);
    // A limit on the file's size behaves as a full disk does: a short write, then a failure.
    struct rlimit before, small = {100001, RLIM_INFINITY};
    getrlimit(RLIMIT_FSIZE, &before);
    small.rlim_max = before.rlim_max;
    void (*handler)(int) = signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &small);
    LogWriter* writer = log_create(path, true, NULL);
    Fault fault = {0};
    int faults = write_much(writer, &fault);
    bool finished = log_finish(writer, NULL);
    setrlimit(RLIMIT_FSIZE, &before);
    signal(SIGXFSZ, handler);
    assert_int_equal(faults, 1);
    assert_false(finished);
    LogReader* reader = log_open(path, NULL);
    LogEvent event;
    int count = 0;
    while (log_next(reader, &event))
        assert_int_equal(event.number, count++);
    assert_int_equal(count, 100001 / (28 + 16 + 10000)); // all that fitted
    assert_int_equal(log_damaged_bytes(reader), 0);
    log_close(reader);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(log_reads_back_what_was_written),
        cmocka_unit_test(log_is_readable_by_liblcm),
        cmocka_unit_test(log_reads_what_liblcm_writes),
        cmocka_unit_test(log_truncated_anywhere_gives_the_whole_events_before_the_cut),
        cmocka_unit_test(log_loses_only_the_event_whose_header_is_damaged),
        cmocka_unit_test(log_survives_corruption),
        cmocka_unit_test(log_of_noise_holds_nothing),
        cmocka_unit_test(log_carries_the_largest_event_and_refuses_a_larger_one),
        cmocka_unit_test(log_skips_an_event_beyond_the_cap),
        cmocka_unit_test(log_create_keeps_an_existing_file_and_faults_name_the_path),
        cmocka_unit_test(log_create_loses_nothing_before_the_first_event),
        cmocka_unit_test(log_create_refuses_a_file_that_is_being_recorded),
        cmocka_unit_test(log_create_refuses_pipes_at_once),
        cmocka_unit_test(log_seek_reads_nothing_again_that_it_still_holds),
        cmocka_unit_test(log_write_reports_a_full_disk_once),
        cmocka_unit_test(log_cut_short_by_a_full_disk_ends_with_a_whole_event),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
