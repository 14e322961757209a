// Recordings as a source: any tick exactly, and one line that says what is missing.
#include "client/playback.h"
#include "tests/inbound.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#define TICKS 40
#define SLOT  7

// A recording being made, and what plays it.
typedef struct Stage {
    char directory[32], path[64];
    LogWriter* writer;
    int64_t now_us;
    StyleBytes style;
    Receive* receive;
    GuidesView view;
    Playback* playback;
    Fault fault;
} Stage;

static Stage* stage_open(int bulk_strands)
{
    Stage* stage = calloc(1, sizeof *stage);
    assert_non_null(stage);
    strcpy(stage->directory, P_tmpdir "/playback-XXXXXX");
    assert_non_null(mkdtemp(stage->directory));
    snprintf(stage->path, sizeof stage->path, "%s/run.lcmlog", stage->directory);
    stage->writer = log_create(stage->path, false, &stage->fault);
    assert_non_null(stage->writer);
    stage->style = inbound_style_bytes(1, bulk_strands);
    int slot = SLOT;
    stage->receive = receive_create(&slot, 1, (Notice){0}, &stage->fault);
    assert_non_null(stage->receive);
    assert_true(guides_view_init(&stage->view, SLOT, &stage->fault));
    return stage;
}

static void stage_close(Stage* stage)
{
    playback_close(stage->playback);
    receive_destroy(stage->receive);
    guides_view_free(&stage->view);
    style_bytes_free(&stage->style);
    unlink(stage->path);
    rmdir(stage->directory);
    free(stage);
}

static void record(Stage* stage, const char* channel, InboundBytes message)
{
    stage->now_us += 1000;
    assert_true(log_write(stage->writer, stage->now_us, channel, message.bytes, message.size,
                          &stage->fault));
}

static void record_lane(Stage* stage, int lane, int first, int mtu)
{
    for (int i = first; i < inbound_parts(&stage->style, lane, mtu); ++i)
        record(stage, CHANNEL_STYLE, inbound_part(&stage->style, lane, i, mtu));
}

static void record_block(Stage* stage, FrameHeader header, int index)
{
    char channel[CHANNEL_BYTES];
    channel_guides(channel, header.slot);
    record(stage, channel, inbound_nth_block(header, index));
}

static void record_ticks(Stage* stage, int slot, int64_t epoch, int ticks)
{
    for (int tick = 0; tick < ticks; ++tick)
        for (int i = 0; i < inbound_blocks(); ++i) {
            FrameHeader header = inbound_header(slot, tick, stage->style.hash);
            header.epoch = epoch;
            record_block(stage, header, i);
        }
}

static bool stage_play(Stage* stage, int slot, int64_t epoch)
{
    assert_true(log_finish(stage->writer, &stage->fault));
    stage->playback = playback_open(stage->path, slot, epoch, &stage->fault);
    return stage->playback != NULL;
}

static bool feed(Stage* stage, int32_t tick)
{
    return playback_feed_tick(stage->playback, tick, stage->receive, &stage->fault);
}

static void expect_tick(Stage* stage, int32_t tick)
{
    if (!feed(stage, tick)) fail_msg("%s", stage->fault.text);
    assert_true(receive_take(stage->receive, &stage->view));
    assert_true(stage->view.complete);
    assert_int_equal(stage->view.tick, tick);
    for (int i = 0; i < INBOUND_GUIDES * INBOUND_NODES * 3; ++i) {
        int row = i / (INBOUND_NODES * 3), rest = i % (INBOUND_NODES * 3);
        assert_int_equal(stage->view.positions[tick & 1][i],
                         inbound_number(tick, row, rest / 3, rest % 3));
    }
}

static void playback_plays_a_log_whose_style_is_at_its_end(void** state)
{
    (void)state;
    Stage* stage = stage_open(600);
    record_ticks(stage, SLOT, INBOUND_EPOCH, TICKS);
    record_lane(stage, STYLE_BULK, 0, INBOUND_MTU);
    record_lane(stage, STYLE_FAST, 0, INBOUND_MTU);
    assert_true(stage_play(stage, SLOT, 0));
    assert_int_equal(playback_first_tick(stage->playback), 0);
    assert_int_equal(playback_last_tick(stage->playback), TICKS - 1);
    assert_int_equal(playback_tick_utime(stage->playback, 1), (inbound_blocks() + 1) * 1000);
    assert_int_equal(playback_tick_utime(stage->playback, TICKS), -1);
    assert_true(playback_feed_styles(stage->playback, stage->receive, &stage->fault));
    int version = 0;
    assert_non_null(receive_style(stage->receive, stage->style.hash, &version, NULL));
    assert_int_equal(version, 2);
    for (int tick = 0; tick < TICKS; ++tick)
        expect_tick(stage, tick);
    assert_int_equal(receive_counters(stage->receive).lost, 0);
    stage_close(stage);
}

static void playback_goes_to_any_tick_in_any_order(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    record_lane(stage, STYLE_FAST, 0, INBOUND_MTU);
    for (int i = 0; i < inbound_blocks(); ++i) // neither ticks nor blocks in order
        for (int tick = TICKS - 1; tick >= 0; --tick)
            record_block(stage, inbound_header(SLOT, tick, stage->style.hash), i);
    assert_true(stage_play(stage, SLOT, INBOUND_EPOCH));
    assert_true(playback_feed_styles(stage->playback, stage->receive, &stage->fault));
    for (uint32_t i = 0; i < 100; ++i) {
        int32_t tick = (int32_t)(random_hash(i) % TICKS);
        if (tick != stage->view.tick) expect_tick(stage, tick);
    }
    ReceiveCounters c = receive_counters(stage->receive);
    assert_int_equal(c.lost + c.late + c.epoch_changes, 0); // a seek is not loss
    stage_close(stage);
}

static void playback_names_a_tick_that_is_missing(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    record_lane(stage, STYLE_FAST, 0, INBOUND_MTU);
    record_ticks(stage, SLOT, INBOUND_EPOCH, TICKS);
    assert_true(stage_play(stage, SLOT, 0));
    assert_false(feed(stage, 900));
    assert_string_equal(stage->fault.text, "tick 900 is not in run.lcmlog (it holds 0..39)");
    assert_false(feed(stage, -1));
    stage_close(stage);
}

static void playback_names_the_rows_that_are_missing(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    record_lane(stage, STYLE_FAST, 0, INBOUND_MTU);
    for (int i = 0; i < inbound_blocks(); ++i)
        if (i != 1) record_block(stage, inbound_header(SLOT, 12, stage->style.hash), i);
    assert_true(stage_play(stage, SLOT, 0));
    assert_false(feed(stage, 12));
    assert_non_null(strstr(stage->fault.text, "feed the styles first"));
    // Rows are on show by now, so the style is worn and may be fed late as well.
    assert_true(playback_feed_styles(stage->playback, stage->receive, &stage->fault));
    assert_false(feed(stage, 12));
    char expected[80];
    snprintf(expected, sizeof expected, "run.lcmlog, tick 12: strands %d-%d are missing",
             inbound_rows(), 2 * inbound_rows() - 1);
    assert_string_equal(stage->fault.text, expected);
    stage_close(stage);
}

// A sound block of the right tick may still contradict the style: its rows are not there.
static void playback_counts_no_rows_that_were_refused(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    record_lane(stage, STYLE_FAST, 0, INBOUND_MTU);
    for (int i = 0; i < inbound_blocks(); ++i) {
        FrameHeader header = inbound_header(SLOT, 12, stage->style.hash);
        if (i == 1) header.nodes = INBOUND_NODES - 1;
        record_block(stage, header, i);
    }
    assert_true(stage_play(stage, SLOT, 0));
    assert_true(playback_feed_styles(stage->playback, stage->receive, &stage->fault));
    assert_false(feed(stage, 12));
    assert_non_null(strstr(stage->fault.text, "strands 14-27 are missing"));
    stage_close(stage);
}

static void playback_names_a_style_that_is_missing_or_incomplete(void** state)
{
    (void)state;
    for (int first = 0; first < 2; ++first) {
        Stage* stage = stage_open(600);
        if (first == 0) record_lane(stage, STYLE_FAST, 0, INBOUND_MTU);
        record_lane(stage, STYLE_BULK, 1, INBOUND_MTU);
        record_ticks(stage, SLOT, INBOUND_EPOCH, 2);
        assert_true(stage_play(stage, SLOT, 0));
        assert_false(playback_feed_styles(stage->playback, stage->receive, &stage->fault));
        assert_non_null(strstr(stage->fault.text, first == 0
                                                      ? "is without its strands in run.lcmlog"
                                                      : "is missing or incomplete in run.lcmlog"));
        stage_close(stage);
    }
}

static void playback_lists_epochs_where_there_are_several(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    record_lane(stage, STYLE_FAST, 1, 1000); // a first daemon's, cut otherwise and incomplete
    record_ticks(stage, SLOT, 50, 3);
    record_lane(stage, STYLE_FAST, 0, INBOUND_MTU);
    record_ticks(stage, SLOT, 60, 5);
    assert_false(stage_play(stage, SLOT, 0));
    assert_string_equal(stage->fault.text,
                        "run.lcmlog holds several epochs of slot 7; name one with --epoch: 50 "
                        "(ticks 0..2), 60 (ticks 0..4)");
    assert_null(playback_open(stage->path, SLOT, 70, &stage->fault));
    assert_non_null(strstr(stage->fault.text, "holds no epoch 70 of slot 7; it holds 50 "));
    stage->playback = playback_open(stage->path, SLOT, 50, &stage->fault);
    assert_non_null(stage->playback);
    assert_int_equal(playback_last_tick(stage->playback), 2);
    stage_close(stage);
}

static void playback_lists_slots_where_the_one_is_not_there(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    record_ticks(stage, 3, INBOUND_EPOCH, 1);
    record_ticks(stage, 12, INBOUND_EPOCH, 1);
    assert_false(stage_play(stage, SLOT, 0));
    assert_string_equal(stage->fault.text,
                        "run.lcmlog holds no guides of slot 7; it holds slots 3, 12");
    assert_null(playback_open(stage->path, CHANNEL_MAX_SLOTS, 0, &stage->fault));
    stage_close(stage);
}

static void playback_survives_a_log_damaged_anywhere(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    record_lane(stage, STYLE_FAST, 0, INBOUND_MTU);
    record_ticks(stage, SLOT, INBOUND_EPOCH, 3);
    assert_true(log_finish(stage->writer, &stage->fault));
    FILE* file = fopen(stage->path, "r+b");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    long size = ftell(file);
    for (uint32_t i = 0; i < 300; ++i) {
        fseek(file, (long)(random_hash(i) % (uint32_t)size), SEEK_SET);
        fputc((int)(random_hash(i + 1000) & 255), file);
        fflush(file);
        Playback* playback = playback_open(stage->path, SLOT, 0, &stage->fault);
        if (playback == NULL) continue;
        playback_feed_styles(playback, stage->receive, &stage->fault);
        for (int tick = -1; tick < 5; ++tick)
            playback_feed_tick(playback, tick, stage->receive, &stage->fault);
        playback_close(playback);
    }
    fclose(file);
    stage_close(stage);
}

// Exit status and standard output of hair-log.
static int run_info(const char* arguments, char* output, size_t capacity)
{
    char command[256];
    snprintf(command, sizeof command, "%s/hair-log %s 2>&1", BIN_DIR, arguments);
    FILE* pipe = popen(command, "r");
    assert_non_null(pipe);
    size_t used = fread(output, 1, capacity - 1, pipe);
    output[used] = 0;
    return WEXITSTATUS(pclose(pipe));
}

static void hair_log_info_tells_what_a_log_holds(void** state)
{
    (void)state;
    if (access(BIN_DIR "/hair-log", X_OK) != 0) {
        print_message("skipped: %s/hair-log is not built\n", BIN_DIR);
        skip();
    }
    Stage* stage = stage_open(600);
    record_ticks(stage, SLOT, 50, TICKS);
    record_block(stage, inbound_header(SLOT, 3, stage->style.hash), 0);
    record_lane(stage, STYLE_FAST, 0, INBOUND_MTU);
    record_lane(stage, STYLE_BULK, 1, INBOUND_MTU);
    assert_true(log_finish(stage->writer, &stage->fault));
    char arguments[160], output[4096], expected[160];
    snprintf(arguments, sizeof arguments, "info %s %s", stage->path, stage->path);
    assert_int_equal(run_info(arguments, output, sizeof output), 0);
    assert_non_null(strstr(output, "0 damaged bytes"));
    assert_non_null(strstr(output, "epoch 50 slot 7: ticks 0..39, 0 missing"));
    int bulk = inbound_parts(&stage->style, STYLE_BULK, INBOUND_MTU);
    snprintf(expected, sizeof expected,
             "style %016llx made-up 1, 30 guides x 8 nodes, 600 strands, fast lane complete, bulk "
             "lane %d of %d parts",
             (unsigned long long)stage->style.hash, bulk - 1, bulk);
    assert_non_null(strstr(output, expected));
    assert_non_null(strstr(strstr(output, expected) + 1, expected)); // both files
    snprintf(arguments, sizeof arguments, "info %s/absent %s", stage->directory, stage->path);
    assert_int_equal(run_info(arguments, output, sizeof output), 1);
    assert_non_null(strstr(output, expected)); // the good one is told of all the same
    assert_int_equal(run_info("info " SOURCE_DIR "/CMakeLists.txt", output, sizeof output), 1);
    assert_non_null(strstr(output, "not an LCM log"));
    assert_int_equal(run_info("", output, sizeof output), 2);
    assert_int_equal(run_info("info", output, sizeof output), 2);
    assert_int_equal(run_info("frobnicate x", output, sizeof output), 2);
    assert_int_equal(run_info("--help", output, sizeof output), 0);
    assert_non_null(strstr(output, "hair-log info run.lcmlog"));
    assert_int_equal(run_info("--version", output, sizeof output), 0);
    stage_close(stage);
}

static void hair_log_info_counts_ticks_that_lack_rows(void** state)
{
    (void)state;
    if (access(BIN_DIR "/hair-log", X_OK) != 0) {
        print_message("skipped: %s/hair-log is not built\n", BIN_DIR);
        skip();
    }
    for (int has_style = 0; has_style < 2; ++has_style) {
        Stage* stage = stage_open(0);
        if (has_style == 1) record_lane(stage, STYLE_FAST, 0, INBOUND_MTU);
        for (int tick = TICKS - 1; tick >= 0; --tick) // backwards, and two blocks of each swapped
            for (int i = inbound_blocks() - 1; i >= 0; --i) {
                bool lost = tick == 5 || (tick == 3 && i == 0) || (tick == 9 && i == 1);
                if (lost || (tick == 11 && i == inbound_blocks() - 1)) continue;
                record_block(stage, inbound_header(SLOT, tick, stage->style.hash), i);
            }
        assert_true(log_finish(stage->writer, &stage->fault));
        char arguments[160], output[4096];
        snprintf(arguments, sizeof arguments, "info %s", stage->path);
        assert_int_equal(run_info(arguments, output, sizeof output), 0);
        if (strstr(output, "slot 7: ticks 0..39, 1 missing, 3 incomplete, ") == NULL)
            fail_msg("%s", output);
        stage_close(stage);
    }
}

// v1.lcmlog holds a grown and an imported style of format 1 and three ticks of each, v2.lcmlog a
// grown one of format 2. They are never recorded anew: a build that cannot play them has broken a
// published type. What those formats lack is nothing, and reads as nothing.
static void logs_of_older_formats_always_play(void** state)
{
    (void)state;
    static const struct {
        const char* file;
        int slot, holds;
        uint64_t payload_hash;
    } held[] = {{SOURCE_DIR "/tests/v1.lcmlog", 0, 0, 0xb478c9a9d9a6727b},
                {SOURCE_DIR "/tests/v1.lcmlog", 7, 0, 0x3c667132ffb783e2},
                {SOURCE_DIR "/tests/v2.lcmlog", 0, 1, 0x7ad8176df9361bf3}};
    for (size_t i = 0; i < sizeof held / sizeof held[0]; ++i) {
        Fault fault = {""};
        GuidesView view;
        Receive* receive = receive_create(&held[i].slot, 1, (Notice){NULL, NULL}, &fault);
        assert_true(receive != NULL && guides_view_init(&view, held[i].slot, &fault));
        Playback* playback = playback_open(held[i].file, held[i].slot, 0, &fault);
        if (playback == NULL || !playback_feed_styles(playback, receive, &fault) ||
            !playback_feed_tick(playback, 2, receive, &fault))
            fail_msg("%s", fault.text);
        assert_true(receive_take(receive, &view) && view.complete);
        assert_true(frame_payload_hash(view.positions[0], view.tangents[0], view.guides,
                                       view.nodes) == held[i].payload_hash);
        int version;
        bool complete;
        const Hairstyle* style = receive_style(receive, view.style_hash, &version, &complete);
        assert_true(style != NULL && complete && style->hold_count == held[i].holds);
        static const WispForm plain;
        assert_memory_equal(&style->forms[0], &plain, sizeof plain);
        assert_true(style->magnet_count == 0 && style->maps == NULL);
        playback_close(playback);
        guides_view_free(&view);
        receive_destroy(receive);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(playback_plays_a_log_whose_style_is_at_its_end),
        cmocka_unit_test(playback_goes_to_any_tick_in_any_order),
        cmocka_unit_test(playback_names_a_tick_that_is_missing),
        cmocka_unit_test(playback_names_the_rows_that_are_missing),
        cmocka_unit_test(playback_counts_no_rows_that_were_refused),
        cmocka_unit_test(playback_names_a_style_that_is_missing_or_incomplete),
        cmocka_unit_test(playback_lists_epochs_where_there_are_several),
        cmocka_unit_test(playback_lists_slots_where_the_one_is_not_there),
        cmocka_unit_test(playback_survives_a_log_damaged_anywhere),
        cmocka_unit_test(logs_of_older_formats_always_play),
        cmocka_unit_test(hair_log_info_tells_what_a_log_holds),
        cmocka_unit_test(hair_log_info_counts_ticks_that_lack_rows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
