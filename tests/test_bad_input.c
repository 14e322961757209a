// Bad input and bad surroundings: the right exit status, one line that names what to change, and
// nothing left behind.
#include "tests/bus.h"
#include "tests/tfx.h"

#include <math.h>

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
    // Numbers that are right but for what does not fit 32 bits.
    expect_refused(&stage, 2, "--size", "8192", ARGS(CLIENT, "--size", "4294967360x48"));
    expect_refused(&stage, 2, "--ticks", "A:B",
                   ARGS(CLIENT, "--embedded", "--ticks", "0:4294967297"));
    expect_refused(&stage, 2, "--motion", "shake", ARGS(SERVER, "--motion", "jumping"));
    stage_remove(&stage);
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

int main(void)
{
    process_setup();
    bus_require_private();
    const struct CMUnitTest tests[] = {
        PROCESS_TEST(unknown_options_and_values_are_wrong_usage),
        PROCESS_TEST(an_unknown_style_is_refused_with_the_known_ones),
        PROCESS_TEST(broken_grooms_are_refused_by_name),
        PROCESS_TEST(a_broken_scene_is_refused_with_line_and_column),
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
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
