// Recordings, ours and stock LCM's: the same pictures whoever recorded and whoever plays.
#include "messages/frame.h"
#include "messages/log.h"
#include "tests/bus.h"

#define SMALL "--size", "160x120", "--msaa", "1"
#define TICK  "30"
#define URL   "udpm://" BUS_GROUP ":7667?ttl=0"

typedef struct Stage {
    Folder folder;
    char log[128];
} Stage;

static void stage_make(Stage* stage)
{
    static Process server;
    folder_make(&stage->folder);
    strcpy(stage->log, folder_name(&stage->folder, "run.lcmlog"));
    process_do(&server, ARGS(SERVER, "--style", "bob", "--fast", "--ticks", "60", "--record",
                             stage->log, "--epoch", "5", "--motion", "shake"));
}

// Tick 30 of `log` as NAME.png, with NAME.json.
static void draw(Stage* stage, const char* log, const char* backend, const char* name)
{
    static Process client;
    char picture[32], stats[32];
    snprintf(picture, sizeof picture, "%s.png", name);
    snprintf(stats, sizeof stats, "%s.json", name);
    process_do(&client, ARGS(CLIENT, "--log", log, "--tick", TICK, "--backend", backend, SMALL,
                             "--out", folder_name(&stage->folder, picture), "--stats",
                             folder_name(&stage->folder, stats)));
    expect_png(folder_name(&stage->folder, picture));
    json_t* root = stats_load(folder_name(&stage->folder, stats));
    assert_string_equal(stats_text(root, "backend"), backend);
    assert_true(stats_number(root, "hair_pixels") > 100.0);
    json_decref(root);
}

static void one_tick_is_one_picture_on_either_backend(void** state)
{
    (void)state;
    Stage stage;
    stage_make(&stage);
    draw(&stage, stage.log, "egl", "first");
    draw(&stage, stage.log, "egl", "again");
    draw(&stage, stage.log, "osmesa", "other");
    const char* first = folder_name(&stage.folder, "first.png");
    assert_true(files_equal(first, folder_name(&stage.folder, "again.png")));
    assert_true(files_equal(first, folder_name(&stage.folder, "other.png")));
    folder_remove(&stage.folder);
}

typedef enum Wanted { STYLES, OTHERS, ALL_BUT_ONE, CUT_ENDS } Wanted;

static bool is_wanted(const LogEvent* event, Wanted wanted)
{
    bool is_style = strcmp(event->channel, "HAIR_STYLE") == 0;
    if (wanted == STYLES) return is_style;
    if (wanted == OTHERS) return !is_style;
    FrameHeader header;
    const uint8_t *positions, *tangents;
    bool is_block =
        frame_decode(&header, &positions, &tangents, event->data, event->size) == FRAME_OK;
    if (wanted == CUT_ENDS) // as a logger leaves it that starts and dies inside a tick
        return !(is_block && ((header.tick == 0 && header.first_strand < 28) ||
                              (header.tick == 59 && header.first_strand >= 28)));
    return !(is_block && header.tick == 30 && header.first_strand == 14);
}

static void copy(LogReader* reader, LogWriter* writer, Wanted wanted)
{
    LogEvent event;
    log_rewind(reader);
    while (log_next(reader, &event))
        if (is_wanted(&event, wanted))
            assert_true(
                log_write(writer, event.utime, event.channel, event.data, event.size, NULL));
}

static void rewrite(Stage* stage, const char* path, int count, const Wanted* wanted)
{
    Fault fault;
    LogReader* reader = log_open(stage->log, &fault);
    LogWriter* writer = log_create(path, false, &fault);
    assert_non_null(reader);
    assert_non_null(writer);
    for (int i = 0; i < count; ++i)
        copy(reader, writer, wanted[i]);
    assert_true(log_finish(writer, &fault));
    log_close(reader);
}

static void a_style_at_the_end_of_the_log_draws_the_same_picture(void** state)
{
    (void)state;
    Stage stage;
    stage_make(&stage);
    char moved[128];
    strcpy(moved, folder_name(&stage.folder, "moved.lcmlog"));
    rewrite(&stage, moved, 2, (Wanted[]){OTHERS, STYLES});
    assert_false(files_equal(moved, stage.log));
    draw(&stage, stage.log, "osmesa", "first");
    draw(&stage, moved, "osmesa", "moved");
    assert_true(files_equal(folder_name(&stage.folder, "first.png"),
                            folder_name(&stage.folder, "moved.png")));
    folder_remove(&stage.folder);
}

static void a_missing_block_is_named_by_its_strands(void** state)
{
    (void)state;
    Stage stage;
    static Process client;
    stage_make(&stage);
    const char* path = folder_name(&stage.folder, "less.lcmlog");
    const char* picture = folder_name(&stage.folder, "x.png");
    rewrite(&stage, path, 1, (Wanted[]){ALL_BUT_ONE});
    process_run(&client, ARGS(CLIENT, "--log", path, "--tick", TICK, "--backend", "null", SMALL,
                              "--out", picture));
    bool is_fine = client.status == 1 && process_lines(client.text[1]) == 1 &&
                   strstr(client.text[1], "tick 30") != NULL &&
                   strstr(client.text[1], "14") != NULL && strstr(client.text[1], "27") != NULL;
    if (!is_fine) process_fail(&client, "the missing strands are not named");
    assert_false(file_exists(picture));
    process_do(&client, ARGS(CLIENT, "--log", path, "--tick", "29", "--backend", "null", SMALL));
    folder_remove(&stage.folder);
}

static void a_log_cut_inside_its_first_and_last_tick_plays_the_rest(void** state)
{
    (void)state;
    Stage stage;
    static Process client;
    stage_make(&stage);
    const char* path = folder_name(&stage.folder, "cut.lcmlog");
    rewrite(&stage, path, 1, (Wanted[]){CUT_ENDS});
    process_do(&client, ARGS(CLIENT, "--log", path, "--backend", "null", SMALL, "--stats", "-"));
    if (strstr(client.text[0], "\"frames\": 58") == NULL) process_fail(&client, "not 58 pictures");
    process_run(&client, ARGS(CLIENT, "--log", path, "--tick", "0", "--backend", "null", SMALL));
    if (client.status != 1) process_fail(&client, "a named tick must be whole");
    folder_remove(&stage.folder);
}

static bool has_stock_tools(void)
{
    static Process which;
    process_run(&which, ARGS("sh", "-c", "command -v lcm-logger && command -v lcm-logplayer"));
    if (which.status != 0) print_message("SKIPPED: no lcm-logger, lcm-logplayer (liblcm-bin)\n");
    return which.status == 0;
}

// Waits for the whole of a file that another program writes: until it has not grown for a while.
static void wait_for_bytes(const char* path, long size)
{
    struct stat info = {0};
    double until = process_now_s() + PROCESS_PATIENCE;
    while (stat(path, &info) != 0 || info.st_size < size) {
        if (process_now_s() > until) fail_msg("%s never held %ld bytes", path, size);
        process_pause(0.02);
    }
}

static void what_stock_lcm_logger_records_our_client_plays(void** state)
{
    (void)state;
    if (!has_stock_tools()) skip();
    Stage stage;
    static Process logger, server, info;
    stage_make(&stage);
    char live[128];
    strcpy(live, folder_name(&stage.folder, "live.lcmlog"));
    // Its style comes again every second, so that it does not matter when the logger began.
    process_start(&server, ARGS(SERVER, "--style", "bob", "--motion", "shake", "--epoch", "7",
                                "--ticks", "9000"));
    process_wait_ready(&server);
    process_start(&logger, ARGS("lcm-logger", "-q", "--flush-interval=50", "--lcm-url=" URL, live));
    wait_for_bytes(live, 1000000); // about two seconds
    process_stop(&server);
    kill(-logger.pid, SIGTERM);
    process_wait(&logger);
    process_do(&info, ARGS(LOG, "info", live));
    if (strstr(info.text[0], " 0 damaged bytes") == NULL ||
        strstr(info.text[0], "epoch 7 slot 0") == NULL ||
        strstr(info.text[0], "fast lane complete") == NULL)
        process_fail(&info, "not what hair-log info should say");
    int first = 0, last = 0;
    assert_int_equal(sscanf(strstr(info.text[0], "epoch 7 slot 0"), "epoch 7 slot 0: ticks %d..%d",
                            &first, &last),
                     2);
    static Process client;
    char tick[16];
    snprintf(tick, sizeof tick, "%d", (first + last) / 2);
    const char* picture = folder_name(&stage.folder, "live.png");
    process_do(&client, ARGS(CLIENT, "--log", live, "--tick", tick, "--backend", "osmesa", SMALL,
                             "--out", picture));
    expect_png(picture);
    folder_remove(&stage.folder);
}

static void what_we_record_stock_lcm_logplayer_plays_to_a_live_client(void** state)
{
    (void)state;
    if (!has_stock_tools()) skip();
    Stage stage;
    static Process player, client;
    stage_make(&stage);
    const char* stats = folder_name(&stage.folder, "stats.json");
    process_start(&client,
                  ARGS(CLIENT, "--backend", "osmesa", SMALL, "--timeout", "60", "--stats", stats));
    process_wait_ready(&client);
    process_do(&player, ARGS("lcm-logplayer", "--lcm-url=" URL, stage.log));
    process_stop(&client);
    json_t* root = stats_load(stats);
    assert_int_equal(stats_integer(root, "epoch"), 5);
    assert_int_equal(stats_integer(root, "tick"), 59);
    assert_int_equal((int)stats_number(root, "datagrams.rejected"), 0);
    assert_true(stats_number(root, "hair_pixels") > 100.0);
    json_decref(root);
    folder_remove(&stage.folder);
}

static void hair_log_tells_what_is_in_a_recording(void** state)
{
    (void)state;
    Stage stage;
    static Process info;
    stage_make(&stage);
    process_do(&info, ARGS(LOG, "info", stage.log));
    static const char* const said[] = {" 0 damaged bytes", "HAIR_GUIDES_0000", "300 ",
                                       "epoch 5 slot 0: ticks 0..59, 0 missing", "64 guides x 8"};
    for (size_t i = 0; i < sizeof said / sizeof said[0]; ++i)
        if (strstr(info.text[0], said[i]) == NULL) process_fail(&info, said[i]);
    folder_remove(&stage.folder);
}

int main(void)
{
    process_setup();
    bus_require_private();
    const struct CMUnitTest tests[] = {
        PROCESS_TEST(one_tick_is_one_picture_on_either_backend),
        PROCESS_TEST(a_style_at_the_end_of_the_log_draws_the_same_picture),
        PROCESS_TEST(a_missing_block_is_named_by_its_strands),
        PROCESS_TEST(a_log_cut_inside_its_first_and_last_tick_plays_the_rest),
        PROCESS_TEST(what_stock_lcm_logger_records_our_client_plays),
        PROCESS_TEST(what_we_record_stock_lcm_logplayer_plays_to_a_live_client),
        PROCESS_TEST(hair_log_tells_what_is_in_a_recording),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
