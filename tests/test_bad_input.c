// Bad input and bad surroundings: the right exit status, one line that names what to change, and
// nothing left behind.
#include "tests/bus.h"
#include "tests/inbound.h"
#include "tests/tfx.h"

#include <math.h>

#define PUBLISHER BIN_DIR "/pose-publisher"

#define SMALL   "--size", "64x48", "--msaa", "1"
#define OFFLINE "--fast", "--ticks", "30"

static const char empty_folder[] = "empty";

typedef struct Stage {
    Folder folder;
    const char* inside; // where programs run: nothing may appear there
} Stage;

static void stage_make(Stage* stage)
{
    folder_make(&stage->folder);
    static char inside[128];
    strcpy(inside, folder_name(&stage->folder, empty_folder));
    stage->inside = inside;
    assert_int_equal(mkdir(inside, 0755), 0);
}

// Its working directory is empty still: rmdir refuses otherwise.
static void stage_remove(Stage* stage)
{
    assert_int_equal(rmdir(stage->inside), 0);
    folder_remove(&stage->folder);
}

// Fails with `status`, and says one line with `word` and `other` in it. Wrong usage adds the line
// of argp that points to --help.
static void expect_refused(Stage* stage, int status, const char* word, const char* other,
                           const char* const* argv)
{
    static Process process;
    process_run_in(&process, stage->inside, argv);
    const char* text = process.text[1];
    int lines = process_lines(text);
    bool is_fine = process.status == status && strstr(text, word) != NULL &&
                   strstr(text, other) != NULL && lines == (status == 2 ? 2 : 1);
    if (is_fine && status == 2) is_fine = strstr(text, "--help") != NULL;
    if (is_fine) return;
    fprintf(stderr, "exit status %d, %d lines; wanted %d and '%s', '%s'\n", process.status, lines,
            status, word, other);
    process_fail(&process, "not refused as it should be");
}

static void unknown_options_and_values_are_wrong_usage(void** state)
{
    (void)state;
    Stage stage;
    stage_make(&stage);
    expect_refused(&stage, 2, "hair-server", "--nonsense", ARGS(SERVER, "--nonsense"));
    expect_refused(&stage, 2, "hair-client", "--nonsense", ARGS(CLIENT, "--nonsense"));
    expect_refused(&stage, 2, "hair-log", "--nonsense", ARGS(LOG, "--nonsense"));
    expect_refused(&stage, 2, "--rate", "number", ARGS(SERVER, "--rate", "fast"));
    expect_refused(&stage, 2, "--size", "12", ARGS(CLIENT, "--size", "12"));
    expect_refused(&stage, 2, "--lod", "medium", ARGS(CLIENT, "--lod", "near"));
    // Numbers that are right but for what does not fit 32 bits.
    expect_refused(&stage, 2, "--size", "8192", ARGS(CLIENT, "--size", "4294967360x48"));
    expect_refused(&stage, 2, "--shadows", "opacity", ARGS(CLIENT, "--shadows", "soft"));
    expect_refused(&stage, 2, "--shadow-size", "1024", ARGS(CLIENT, "--shadow-size", "32"));
    expect_refused(&stage, 2, "--shadow-layers", "none",
                   ARGS(CLIENT, "--shadows", "depth", "--shadow-layers", "4"));
    expect_refused(&stage, 2, "--shadow-layers 16", "2 to 8",
                   ARGS(CLIENT, "--shadow-layers", "16", "--shadows", "deep"));
    expect_refused(&stage, 2, "--ticks", "A:B",
                   ARGS(CLIENT, "--embedded", "--ticks", "0:4294967297"));
    expect_refused(&stage, 2, "--motion", "shake", ARGS(SERVER, "--motion", "jumping"));
    expect_refused(&stage, 2, "--shading", "marschner", ARGS(CLIENT, "--shading", "phong"));
    expect_refused(&stage, 2, "--colour", "blond", ARGS(CLIENT, "--colour", "green"));
    expect_refused(&stage, 2, "--marschner", "beta", ARGS(CLIENT, "--marschner", "beta=99"));
    stage_remove(&stage);
}

static void options_that_contradict_are_wrong_usage(void** state)
{
    (void)state;
    Stage stage;
    stage_make(&stage);
    const char* scene = folder_name(&stage.folder, "scene.json");
    file_write(scene, "{}", 2);
    expect_refused(&stage, 2, "--scene", "second",
                   ARGS(SERVER, "--scene", scene, "--scene", scene, OFFLINE));
    expect_refused(&stage, 2, "--info", "--record", ARGS(SERVER, "--info", "--record", "x.lcmlog"));
    expect_refused(&stage, 2, "--info", "--ticks", ARGS(SERVER, "--info", "--ticks", "3"));
    expect_refused(&stage, 2, "--tick", "--ticks",
                   ARGS(CLIENT, "--embedded", "--tick", "1", "--ticks", "4:5"));
    expect_refused(&stage, 2, "--tick", "once",
                   ARGS(CLIENT, "--embedded", "--tick", "1", "--tick", "2"));
    expect_refused(&stage, 2, "--marschner", "--shading",
                   ARGS(CLIENT, "--embedded", "--marschner", "beta=6"));
    expect_refused(&stage, 2, "--background", "hex",
                   ARGS(CLIENT, "--embedded", "--background", "+1+2+3"));
    expect_refused(&stage, 2, "--background", "hex",
                   ARGS(CLIENT, "--embedded", "--background", " 1 2 3"));
    stage_remove(&stage);
}

static void what_would_replace_the_recording_is_wrong_usage(void** state)
{
    (void)state;
    Stage stage;
    static Process process;
    stage_make(&stage);
    const char* log = folder_name(&stage.folder, "kept.lcmlog");
    const char* link = folder_name(&stage.folder, "link.json");
    process_do(&process, ARGS(SERVER, OFFLINE, "--record", log));
    assert_int_equal(symlink(log, link), 0);
    expect_refused(&stage, 2, "--stats", "--log",
                   ARGS(CLIENT, "--log", log, "--backend", "null", "--stats", log));
    expect_refused(&stage, 2, "--stats", "--log",
                   ARGS(CLIENT, "--log", log, "--backend", "null", "--stats", link));
    expect_refused(&stage, 2, "--out", "--log",
                   ARGS(CLIENT, "--log", log, "--backend", "null", "--out", log));
    expect_refused(
        &stage, 2, "--stats", "--out",
        ARGS(CLIENT, "--embedded", "--backend", "null", "--out", "a.png", "--stats", "./a.png"));
    process_do(&process, ARGS(LOG, "info", log));
    stage_remove(&stage);
}

static void the_example_publisher_refuses_what_is_out_of_range(void** state)
{
    (void)state;
    if (!file_exists(PUBLISHER)) {
        print_message("SKIPPED: no " PUBLISHER "\n");
        skip();
    }
    static Process process;
    static const char* const wrong[][2] = {{"--slot", "1024"},
                                           {"--slot", "-1"},
                                           {"--slot", "3x"},
                                           {"--slot", "4294967296"},
                                           {"--seconds", "nan"},
                                           {"--seconds", "-1"},
                                           {"--style", "a name of thirty-two bytes or more"},
                                           {"--nonsense", "1"},
                                           {"stray", "1"}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
        process_run(&process, ARGS(PUBLISHER, wrong[i][0], wrong[i][1]));
        if (process.status != 2 || process_lines(process.text[1]) != 1 ||
            strstr(process.text[1], wrong[i][0]) == NULL)
            process_fail(&process, "not refused in one line that names it");
    }
    process_do(&process, ARGS(PUBLISHER, "--help"));
    assert_non_null(strstr(process.text[0], "--slot"));
}

static void an_unknown_style_is_refused_with_the_known_ones(void** state)
{
    (void)state;
    Stage stage;
    stage_make(&stage);
    expect_refused(&stage, 1, "mohawk", "bob",
                   ARGS(SERVER, "--style", "mohawk", OFFLINE, "--hash"));
    expect_refused(
        &stage, 1, "mohawk", "long",
        ARGS(CLIENT, "--embedded", "--style", "mohawk", "--backend", "null", "--out", "x.png"));
    stage_remove(&stage);
}

static void broken_grooms_are_refused_by_name(void** state)
{
    (void)state;
    Stage stage;
    stage_make(&stage);
    size_t size;
    uint8_t* bytes = tfx_bytes(64, 16, 80.0f, &size);
    const char* cut = folder_name(&stage.folder, "cut.tfx");
    file_write(cut, bytes, size - 100);
    expect_refused(&stage, 1, "cut.tfx", "",
                   ARGS(SERVER, "--style", cut, OFFLINE, "--record", "x.lcmlog"));
    uint32_t lie = 0x40000001;
    memcpy(bytes + 4, &lie, 4);
    const char* lying = folder_name(&stage.folder, "lying.tfx");
    file_write(lying, bytes, size);
    expect_refused(&stage, 1, "lying.tfx", "",
                   ARGS(SERVER, "--style", lying, OFFLINE, "--record", "x.lcmlog"));
    free(bytes);
    bytes = tfx_bytes(64, 16, 80.0f, &size);
    float none = NAN;
    memcpy(bytes + TFX_HEADER_BYTES + 12 * (5 * 16 + 3) + 4, &none, 4);
    const char* nan = folder_name(&stage.folder, "nan.tfx");
    file_write(nan, bytes, size);
    expect_refused(&stage, 1, "nan.tfx", "strand 5",
                   ARGS(SERVER, "--style", nan, OFFLINE, "--record", "x.lcmlog"));
    free(bytes);
    stage_remove(&stage);
}

static void a_broken_scene_is_refused_with_line_and_column(void** state)
{
    (void)state;
    Stage stage;
    stage_make(&stage);
    static const char scene[] = "{\n  \"characters\": [ { \"slot\": ], }\n}\n";
    const char* path = folder_name(&stage.folder, "scene.json");
    file_write(path, scene, sizeof scene - 1);
    expect_refused(&stage, 1, "scene.json",
                   "2:", ARGS(SERVER, "--scene", path, OFFLINE, "--record", "x.lcmlog"));
    stage_remove(&stage);
}

static void pipes_and_folders_are_refused_at_once(void** state)
{
    (void)state;
    Stage stage;
    stage_make(&stage);
    const char* pipe = folder_name(&stage.folder, "pipe");
    assert_int_equal(mkfifo(pipe, 0600), 0);
    expect_refused(&stage, 1, "pipe", "not a file", ARGS(SERVER, "--scene", pipe, OFFLINE));
    expect_refused(&stage, 1, stage.folder.path, "not a file",
                   ARGS(SERVER, "--scene", stage.folder.path, OFFLINE));
    expect_refused(&stage, 1, "pipe", "not a file",
                   ARGS(SERVER, OFFLINE, "--record", pipe, "--overwrite"));
    stage_remove(&stage);
}

// Hairs of 7.5 um: squares of their links are below what float resolves. A coordinate that is no
// number would be counted as clamped.
static void the_shortest_hairs_run_without_a_number_lost(void** state)
{
    (void)state;
    Stage stage;
    static Process server;
    stage_make(&stage);
    const char* path = folder_name(&stage.folder, "short.tfx");
    tfx_write(path, 64, 16, 7.5e-6f / 0.0027f);
    process_run(&server,
                ARGS(SERVER, "--style", path, "--motion", "shake", OFFLINE, "--hash", "--verbose"));
    process_expect(&server, 0);
    if (strstr(server.text[1], " 0 coordinates clamped") == NULL)
        process_fail(&server, "coordinates clamped");
    stage_remove(&stage);
}

static void without_a_multicast_route_the_line_names_the_fix(void** state)
{
    (void)state;
    Stage stage;
    stage_make(&stage);
    expect_refused(&stage, 1, "ip route add", "scripts/lan",
                   ARGS("unshare", "-n", SERVER, "--ticks", "30"));
    expect_refused(&stage, 1, "ip route add", "scripts/lan",
                   ARGS("unshare", "-n", CLIENT, "--backend", "null", "--frames", "1"));
    stage_remove(&stage);
}

static void a_bad_url_is_refused_with_a_good_one(void** state)
{
    (void)state;
    Stage stage;
    stage_make(&stage);
    static const char* const urls[] = {"tcpq://localhost", "udpm://10.0.0.1:7667", "nonsense",
                                       "udpm://239.255.76.67:99999"};
    for (size_t i = 0; i < sizeof urls / sizeof urls[0]; ++i) {
        expect_refused(&stage, 1, urls[i], "", ARGS(SERVER, "--url", urls[i], "--ticks", "3"));
        expect_refused(&stage, 1, urls[i], "",
                       ARGS(CLIENT, "--url", urls[i], "--backend", "null", "--frames", "1"));
    }
    stage_remove(&stage);
}

static void without_egl_osmesa_draws_and_says_so(void** state)
{
    (void)state;
    Stage stage;
    static Process client;
    stage_make(&stage);
    const char* stats = folder_name(&stage.folder, "stats.json");
    process_run(&client, ARGS("env", "__EGL_VENDOR_LIBRARY_FILENAMES=/nonexistent", CLIENT,
                              "--embedded", "--frames", "1", SMALL, "--stats", stats));
    process_expect(&client, 0);
    if (process_lines(client.text[1]) != 1 || strstr(client.text[1], "EGL") == NULL)
        process_fail(&client, "not one line that names EGL");
    json_t* root = stats_load(stats);
    assert_string_equal(stats_text(root, "backend"), "osmesa");
    assert_true(stats_number(root, "hair_pixels") > 0.0);
    json_decref(root);
    stage_remove(&stage);
}

// In a mount namespace of its own a file can be hidden from a program without harm to others.
#define HIDE_OSMESA                                                                                \
    "for f in /usr/lib/*/libOSMesa.so.8; do mount --bind /dev/null \"$f\" || exit 9; done; "       \
    "exec \"$@\""

static void without_osmesa_egl_draws_and_without_both_the_line_names_both(void** state)
{
    (void)state;
    Stage stage;
    static Process client;
    stage_make(&stage);
    const char* stats = folder_name(&stage.folder, "stats.json");
    process_run(&client, ARGS("unshare", "-m", "sh", "-c", HIDE_OSMESA, "sh", CLIENT, "--embedded",
                              "--backend", "osmesa", "--frames", "1", SMALL, "--stats", stats));
    process_expect(&client, 0);
    if (process_lines(client.text[1]) != 1 || strstr(client.text[1], "OSMesa") == NULL)
        process_fail(&client, "not one line that names OSMesa");
    json_t* root = stats_load(stats);
    assert_string_equal(stats_text(root, "backend"), "egl");
    json_decref(root);
    expect_refused(&stage, 1, "OSMesa", "EGL",
                   ARGS("unshare", "-m", "sh", "-c", HIDE_OSMESA, "sh", "env",
                        "__EGL_VENDOR_LIBRARY_FILENAMES=/nonexistent", CLIENT, "--embedded",
                        "--frames", "1", SMALL, "--out", "x.png"));
    stage_remove(&stage);
}

// $1 is mounted as a file system of 64 KiB; what is in it is only seen from inside.
#define SMALL_DISK "mount -t tmpfs -o size=64k none \"$1\" || exit 9; cd \"$1\" || exit 9; "

static void a_full_disk_ends_a_recording_at_a_whole_event(void** state)
{
    (void)state;
    Stage stage;
    static Process both;
    stage_make(&stage);
    process_run(&both, ARGS("unshare", "-m", "sh", "-c",
                            SMALL_DISK SERVER " --fast --ticks 300 --record x.lcmlog; "
                                              "echo server $?; " LOG " info x.lcmlog; echo log $?",
                            "sh", stage.inside));
    process_expect(&both, 0);
    bool is_fine =
        strstr(both.text[0], "server 1\n") != NULL && strstr(both.text[0], "log 0\n") != NULL &&
        strstr(both.text[0], " 0 damaged bytes") != NULL &&
        strstr(both.text[1], "x.lcmlog") != NULL && strstr(both.text[1], "No space left") != NULL &&
        process_lines(both.text[1]) == 1;
    if (!is_fine) process_fail(&both, "not a whole log and one line");
    stage_remove(&stage);
}

static void a_full_disk_keeps_the_earlier_picture(void** state)
{
    (void)state;
    Stage stage;
    static Process both;
    stage_make(&stage);
    process_run(&both,
                ARGS("unshare", "-m", "sh", "-c",
                     SMALL_DISK CLIENT
                     " --embedded --backend osmesa --frames 1 --size 32x32 --msaa 1 --out x.png; "
                     "echo first $?; cksum <x.png >sum; cat /dev/zero >filler 2>/dev/null; " CLIENT
                     " --embedded --backend osmesa --frames 1 --size 640x480 --msaa 1 --out x.png; "
                     "echo second $?; cksum <x.png | cmp - sum && echo kept; ls",
                     "sh", stage.inside));
    process_expect(&both, 0);
    bool is_fine =
        strstr(both.text[0], "first 0\n") != NULL && strstr(both.text[0], "second 1\n") != NULL &&
        strstr(both.text[0], "kept\nfiller\nsum\nx.png\n") != NULL &&
        strstr(both.text[1], "No space left") != NULL && process_lines(both.text[1]) == 1;
    if (!is_fine) process_fail(&both, "the earlier picture is not all that is left");
    stage_remove(&stage);
}

#define READ_ONLY                                                                                  \
    "mount -t tmpfs -o ro none \"$1\" || exit 9; cd \"$1\" || exit 9; shift; exec \"$@\""

static void a_read_only_directory_is_refused_at_once(void** state)
{
    (void)state;
    Stage stage;
    stage_make(&stage);
    static const char* const outs[] = {"x.png", "x.mp4", "folder"};
    for (size_t i = 0; i < sizeof outs / sizeof outs[0]; ++i)
        expect_refused(&stage, 1, outs[i], "Read-only",
                       ARGS("unshare", "-m", "sh", "-c", READ_ONLY, "sh", stage.inside, CLIENT,
                            "--embedded", "--backend", "null", "--frames", "1", "--out", outs[i]));
    expect_refused(&stage, 1, "x.lcmlog", "Read-only",
                   ARGS("unshare", "-m", "sh", "-c", READ_ONLY, "sh", stage.inside, SERVER, OFFLINE,
                        "--record", "x.lcmlog"));
    stage_remove(&stage);
}

static void without_ffmpeg_films_are_refused_and_pictures_drawn(void** state)
{
    (void)state;
    Stage stage;
    static Process client;
    stage_make(&stage);
    expect_refused(&stage, 1, "ffmpeg", "install",
                   ARGS("env", "PATH=/nonexistent", CLIENT, "--embedded", "--backend", "null",
                        "--frames", "2", SMALL, "--out", "x.mp4"));
    const char* picture = folder_name(&stage.folder, "x.png");
    process_run(&client, ARGS("env", "PATH=/nonexistent", CLIENT, "--embedded", "--backend", "null",
                              "--frames", "2", SMALL, "--out", picture));
    process_expect(&client, 0);
    expect_png(picture);
    stage_remove(&stage);
}

static void what_a_log_lacks_is_named(void** state)
{
    (void)state;
    Stage stage;
    static Process process;
    stage_make(&stage);
    const char* log = folder_name(&stage.folder, "five.lcmlog");
    process_do(&process, ARGS(SERVER, OFFLINE, "--epoch", "5", "--record", log));
    expect_refused(
        &stage, 1, "31", "0..29",
        ARGS(CLIENT, "--log", log, "--tick", "31", "--backend", "null", "--out", "x.png"));
    expect_refused(
        &stage, 1, "slot 3", "five.lcmlog",
        ARGS(CLIENT, "--log", log, "--slot", "3", "--backend", "null", "--out", "x.png"));
    expect_refused(&stage, 1, "nowhere.lcmlog", "No such file",
                   ARGS(CLIENT, "--log", "nowhere.lcmlog", "--backend", "null"));
    stage_remove(&stage);
}

static void a_log_of_two_epochs_wants_one_named(void** state)
{
    (void)state;
    Stage stage;
    static Process process;
    stage_make(&stage);
    const char* five = folder_name(&stage.folder, "five.lcmlog");
    const char* six = folder_name(&stage.folder, "six.lcmlog");
    const char* both = folder_name(&stage.folder, "both.lcmlog");
    process_do(&process, ARGS(SERVER, OFFLINE, "--epoch", "5", "--record", five));
    process_do(&process, ARGS(SERVER, OFFLINE, "--epoch", "6", "--record", six));
    process_do(&process, ARGS("sh", "-c", "cat \"$1\" \"$2\" >\"$3\"", "sh", five, six, both));
    expect_refused(
        &stage, 1, "--epoch", "5 (ticks 0..29), 6",
        ARGS(CLIENT, "--log", both, "--tick", "3", "--backend", "null", "--out", "x.png"));
    const char* stats = folder_name(&stage.folder, "stats.json");
    process_do(&process, ARGS(CLIENT, "--log", both, "--tick", "3", "--epoch", "6", "--backend",
                              "null", SMALL, "--stats", stats));
    json_t* root = stats_load(stats);
    assert_int_equal(stats_integer(root, "epoch"), 6);
    json_decref(root);
    stage_remove(&stage);
}

static void an_earlier_recording_is_not_written_over(void** state)
{
    (void)state;
    Stage stage;
    stage_make(&stage);
    const char* log = folder_name(&stage.folder, "kept.lcmlog");
    file_write(log, "kept", 4);
    expect_refused(&stage, 1, "kept.lcmlog", "File exists", ARGS(SERVER, OFFLINE, "--record", log));
    size_t size;
    uint8_t* bytes = file_read(log, &size);
    assert_int_equal(size, 4);
    free(bytes);
    stage_remove(&stage);
}

static void expect_kept(const char* path)
{
    size_t size;
    uint8_t* bytes = file_read(path, &size);
    assert_int_equal(size, 4);
    assert_memory_equal(bytes, "kept", 4);
    free(bytes);
}

static void a_start_that_fails_leaves_recordings_alone(void** state)
{
    (void)state;
    Stage stage;
    stage_make(&stage);
    const char* log = folder_name(&stage.folder, "kept.lcmlog");
    file_write(log, "kept", 4);
    expect_refused(&stage, 1, "foo", "",
                   ARGS(SERVER, "--record", log, "--overwrite", "--url", "foo", "--ticks", "1"));
    expect_kept(log);
    expect_refused(&stage, 1, "foo", "",
                   ARGS(SERVER, "--record", "new.lcmlog", "--url", "foo", "--ticks", "1"));
    stage_remove(&stage);
}

static void a_recording_is_one_servers(void** state)
{
    (void)state;
    Stage stage;
    static Process first, info;
    stage_make(&stage);
    const char* log = folder_name(&stage.folder, "run.lcmlog");
    process_start(&first, ARGS(SERVER, "--ticks", "9000", "--record", log));
    process_wait_ready(&first);
    expect_refused(&stage, 1, "run.lcmlog", "another program",
                   ARGS(SERVER, OFFLINE, "--record", log, "--overwrite"));
    process_stop(&first);
    process_do(&info, ARGS(LOG, "info", log));
    if (strstr(info.text[0], " 0 damaged bytes") == NULL) process_fail(&info, "damaged");
    stage_remove(&stage);
}

static void what_cannot_be_printed_is_a_failure(void** state)
{
    (void)state;
    Stage stage;
    static Process process;
    stage_make(&stage);
    const char* log = folder_name(&stage.folder, "run.lcmlog");
    process_do(&process, ARGS(SERVER, OFFLINE, "--record", log));
#define TO_FULL "sh", "-c", "exec \"$@\" >/dev/full", "sh"
    expect_refused(&stage, 1, "standard output", "No space", ARGS(TO_FULL, SERVER, "--info"));
    expect_refused(&stage, 1, "standard output", "",
                   ARGS(TO_FULL, SERVER, OFFLINE, "--hash", "--quiet"));
    expect_refused(&stage, 1, "standard output", "No space", ARGS(TO_FULL, LOG, "info", log));
    stage_remove(&stage);
}

static void a_file_beyond_the_size_limit_is_told_as_a_full_disk_is(void** state)
{
    (void)state;
    Stage stage;
    static Process info;
    stage_make(&stage);
    const char* log = folder_name(&stage.folder, "run.lcmlog");
#define LIMITED "sh", "-c", "ulimit -f 200; exec \"$@\"", "sh" // of 512 bytes
    expect_refused(&stage, 1, "run.lcmlog", "File too large",
                   ARGS(LIMITED, SERVER, "--fast", "--ticks", "300", "--record", log));
    process_do(&info, ARGS(LOG, "info", log));
    if (strstr(info.text[0], " 0 damaged bytes") == NULL) process_fail(&info, "damaged");
    expect_refused(&stage, 1, "x.png", "File too large",
                   ARGS("sh", "-c", "ulimit -f 2; exec \"$@\"", "sh", CLIENT, "--embedded",
                        "--backend", "osmesa", "--frames", "1", "--size", "320x240", "--msaa", "1",
                        "--out", "x.png"));
    stage_remove(&stage);
}

// Zeroes in the middle: ticks there lack rows.
static void damage_middle(const char* path)
{
    size_t size;
    uint8_t* bytes = file_read(path, &size);
    memset(bytes + size * 2 / 3, 0, 20000);
    file_write(path, bytes, size);
    free(bytes);
}

static void a_run_that_fails_keeps_the_earlier_pictures(void** state)
{
    (void)state;
    Stage stage;
    static Process process;
    static const char* const outs[] = {"kept.png", "kept.mp4"};
    stage_make(&stage);
    const char* log = folder_name(&stage.folder, "run.lcmlog");
    process_do(&process, ARGS(SERVER, OFFLINE, "--record", log));
    for (size_t i = 0; i < sizeof outs / sizeof *outs; ++i) {
        if (i == 1 && system("ffmpeg -version >/dev/null 2>&1") != 0) break;
        const char* kept = folder_name(&stage.folder, outs[i]);
        file_write(kept, "kept", 4);
        expect_refused(&stage, 1, "tick 35", "0..29",
                       ARGS(CLIENT, "--log", log, "--ticks", "28:35", "--backend", "null", SMALL,
                            "--out", kept));
        expect_kept(kept);
    }
    damage_middle(log);
    for (size_t i = 0; i < sizeof outs / sizeof *outs; ++i) {
        const char* kept = folder_name(&stage.folder, outs[i]);
        if (!file_exists(kept)) break; // no ffmpeg
        expect_refused(&stage, 1, "tick", "",
                       ARGS(CLIENT, "--log", log, "--ticks", "0:29", "--backend", "null", SMALL,
                            "--out", kept));
        expect_kept(kept);
    }
    stage_remove(&stage);
}

static void expect_stopped(Process* process, const char* words)
{
    kill(-process->pid, SIGTERM);
    process_expect(process, 1);
    if (strstr(process->text[1], "stopped after ") == NULL ||
        strstr(process->text[1], words) == NULL)
        process_fail(process, "does not say what it was stopped before");
}

static void a_stop_before_the_end_that_was_asked_for_is_a_failure(void** state)
{
    (void)state;
    Stage stage;
    static Process process;
    stage_make(&stage);
    process_start(&process, ARGS(SERVER, "--ticks", "9000", "--hash"));
    process_wait_ready(&process);
    expect_stopped(&process, " of 9000 ticks: no hash");
    if (strstr(process.text[0], "hash") != NULL) process_fail(&process, "a hash of no tick asked");
    const char* picture = folder_name(&stage.folder, "none.png");
    process_start(&process,
                  ARGS(CLIENT, "--backend", "null", "--frames", "5", SMALL, "--out", picture));
    process_wait_ready(&process);
    expect_stopped(&process, " 0 of 5 pictures");
    assert_false(file_exists(picture));
    const char* pictures = folder_name(&stage.folder, "pictures");
    process_start(&process, ARGS(CLIENT, "--embedded", "--frames", "90000", "--backend", "null",
                                 "--size", "16x16", "--msaa", "1", "--out", pictures));
    wait_pictures(pictures, 3);
    expect_stopped(&process, " of 90000 pictures");
    stage_remove(&stage);
}

static void a_closed_terminal_stops_as_ctrl_c_does(void** state)
{
    (void)state;
    static Process server, client;
    process_start(&server, ARGS(SERVER, "--ticks", "9000"));
    process_start(&client, ARGS(CLIENT, "--backend", "null", SMALL));
    process_wait_ready(&server);
    process_wait_ready(&client);
    kill(-server.pid, SIGHUP);
    kill(-client.pid, SIGHUP);
    process_expect(&server, 0);
    process_expect(&client, 0);
}

static void a_second_signal_leaves_no_half_film(void** state)
{
    (void)state;
    if (system("ffmpeg -version >/dev/null 2>&1") != 0) {
        print_message("SKIPPED: no ffmpeg\n");
        skip();
    }
    Folder folder;
    static Process client;
    char part[200];
    folder_make(&folder);
    const char* film = folder_name(&folder, "film.mp4");
    process_start(&client, ARGS(CLIENT, "--embedded", "--backend", "osmesa", "--frames", "90000",
                                "--size", "640x480", "--msaa", "1", "--out", film));
    snprintf(part, sizeof part, "%s.part%ld", film, (long)client.pid);
    file_wait(part);
    process_pause(0.3);
    kill(-client.pid, SIGTERM);
    kill(-client.pid, SIGINT);
    process_wait(&client);
    assert_true(client.status == 128 + SIGTERM || client.status == 128 + SIGINT);
    process_pause(0.5); // ffmpeg sees the end of its input, and writes what it has
    assert_false(file_exists(part) || file_exists(film));
    folder_remove(&folder);
}

// A daemon's guides without end, and of its style one part.
static void guides_without_their_style_run_into_the_timeout(void** state)
{
    (void)state;
    static Process client;
    static Bus bus;
    bus_open(&bus);
    StyleBytes style = inbound_style_bytes(1, 0);
    process_start(&client,
                  ARGS(CLIENT, "--backend", "null", "--frames", "1", "--timeout", "2", SMALL));
    process_wait_ready(&client);
    double until = process_now_s() + PROCESS_PATIENCE;
    for (int tick = 0; !client.ended && process_now_s() < until; ++tick) {
        for (int i = 0; i < inbound_blocks(); ++i) {
            InboundBytes block = inbound_nth_block(inbound_header(0, tick, style.hash), i);
            bus_send(&bus, "HAIR_GUIDES_0000", block.bytes, block.size);
        }
        InboundBytes part = inbound_part(&style, STYLE_FAST, 1, INBOUND_MTU);
        bus_send(&bus, "HAIR_STYLE", part.bytes, part.size); // again and again is no progress
        process_pump(&client, 0.02);
    }
    char held[80];
    snprintf(held, sizeof held, "held 1 of %d parts",
             inbound_parts(&style, STYLE_FAST, INBOUND_MTU));
    process_expect(&client, 1);
    if (strstr(client.text[1], "guides of slot 0 come, but their style does not") == NULL ||
        strstr(client.text[1], held) == NULL || process_lines(client.text[1]) != 1)
        process_fail(&client, "not one line that says how much of the style is there");
    style_bytes_free(&style);
    bus_close(&bus);
}

int main(void)
{
    process_setup();
    bus_require_private();
    const struct CMUnitTest tests[] = {
        PROCESS_TEST(unknown_options_and_values_are_wrong_usage),
        PROCESS_TEST(options_that_contradict_are_wrong_usage),
        PROCESS_TEST(what_would_replace_the_recording_is_wrong_usage),
        PROCESS_TEST(the_example_publisher_refuses_what_is_out_of_range),
        PROCESS_TEST(an_unknown_style_is_refused_with_the_known_ones),
        PROCESS_TEST(broken_grooms_are_refused_by_name),
        PROCESS_TEST(a_broken_scene_is_refused_with_line_and_column),
        PROCESS_TEST(pipes_and_folders_are_refused_at_once),
        PROCESS_TEST(the_shortest_hairs_run_without_a_number_lost),
        PROCESS_TEST(without_a_multicast_route_the_line_names_the_fix),
        PROCESS_TEST(a_bad_url_is_refused_with_a_good_one),
        PROCESS_TEST(without_egl_osmesa_draws_and_says_so),
        PROCESS_TEST(without_osmesa_egl_draws_and_without_both_the_line_names_both),
        PROCESS_TEST(a_full_disk_ends_a_recording_at_a_whole_event),
        PROCESS_TEST(a_full_disk_keeps_the_earlier_picture),
        PROCESS_TEST(a_read_only_directory_is_refused_at_once),
        PROCESS_TEST(without_ffmpeg_films_are_refused_and_pictures_drawn),
        PROCESS_TEST(what_a_log_lacks_is_named),
        PROCESS_TEST(a_log_of_two_epochs_wants_one_named),
        PROCESS_TEST(an_earlier_recording_is_not_written_over),
        PROCESS_TEST(a_start_that_fails_leaves_recordings_alone),
        PROCESS_TEST(a_recording_is_one_servers),
        PROCESS_TEST(what_cannot_be_printed_is_a_failure),
        PROCESS_TEST(a_file_beyond_the_size_limit_is_told_as_a_full_disk_is),
        PROCESS_TEST(a_run_that_fails_keeps_the_earlier_pictures),
        PROCESS_TEST(a_stop_before_the_end_that_was_asked_for_is_a_failure),
        PROCESS_TEST(a_closed_terminal_stops_as_ctrl_c_does),
        PROCESS_TEST(a_second_signal_leaves_no_half_film),
        PROCESS_TEST(guides_without_their_style_run_into_the_timeout),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
