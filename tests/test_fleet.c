// One server, many clients, over real multicast: any start order, deaths and restarts.
#include "tests/bus.h"

#include <math.h>

#define SMALL   "--size", "160x120", "--msaa", "1", "--timeout", "60"
#define GROOM_S 4.0 // a late client has 482 KB of groom, at 256 KB/s
#define ASSETS  SOURCE_DIR "/../shared/assets/ponytail_"

static void start_server(Process* server, const char* style)
{
    // It ends by itself should nobody be left to end it.
    process_start(server, ARGS(SERVER, "--style", style, "--motion", "shake", "--ticks", "9000"));
}

static void expect_drawn(Process* client, const char* stats, const char* picture,
                         const char* backend, int frames)
{
    process_expect(client, 0);
    json_t* root = stats_load(stats);
    assert_string_equal(stats_text(root, "backend"), backend);
    assert_int_equal(stats_integer(root, "frames"), frames);
    assert_true(stats_number(root, "hair_pixels") > 100.0);
    expect_png(picture);
    json_decref(root);
}

static void clients_before_with_and_after_the_server_all_draw_hair(void** state)
{
    (void)state;
    static Process server, before, with, after;
    Folder folder;
    folder_make(&folder);
    process_start(&before, ARGS(CLIENT, "--backend", "egl", "--yaw", "0", "--frames", "4", SMALL,
                                "--out", folder_name(&folder, "before.png"), "--stats",
                                folder_name(&folder, "before.json")));
    process_wait_ready(&before);
    start_server(&server, "bob");
    process_start(&with, ARGS(CLIENT, "--backend", "osmesa", "--frames", "4", SMALL, "--out",
                              folder_name(&folder, "with.png"), "--stats",
                              folder_name(&folder, "with.json")));
    process_wait_ready(&server);
    process_wait_ready(&with);
    process_start(&after, ARGS(CLIENT, "--backend", "egl", "--yaw", "120", "--frames", "4", SMALL,
                               "--out", folder_name(&folder, "after.png"), "--stats",
                               folder_name(&folder, "after.json")));
    expect_drawn(&before, folder_name(&folder, "before.json"), folder_name(&folder, "before.png"),
                 "egl", 4);
    expect_drawn(&with, folder_name(&folder, "with.json"), folder_name(&folder, "with.png"),
                 "osmesa", 4);
    expect_drawn(&after, folder_name(&folder, "after.json"), folder_name(&folder, "after.png"),
                 "egl", 4);
    assert_false(
        files_equal(folder_name(&folder, "before.png"), folder_name(&folder, "after.png")));
    process_stop(&server);
    folder_remove(&folder);
}

static void start_counted(Process* client, Folder* folder, const char* name)
{
    char stats[32];
    snprintf(stats, sizeof stats, "%s.json", name);
    process_start(client,
                  ARGS(CLIENT, "--backend", "null", "--size", "16x16", "--msaa", "1", "--out",
                       folder_name(folder, name), "--stats", folder_name(folder, stats)));
    process_wait_ready(client);
}

static void a_killed_client_costs_the_others_nothing(void** state)
{
    (void)state;
    static Process server, victim, other;
    Folder folder;
    folder_make(&folder);
    start_server(&server, "bob");
    start_counted(&other, &folder, "other");
    start_counted(&victim, &folder, "victim");
    wait_pictures(folder_name(&folder, "victim"), 5);
    process_kill(&victim);
    int drawn = pictures_in(folder_name(&folder, "other"));
    wait_pictures(folder_name(&folder, "other"), drawn + 40);
    process_stop(&other);
    json_t* root = stats_load(folder_name(&folder, "other.json"));
    assert_int_equal((int)stats_number(root, "datagrams.lost"), 0);
    assert_int_equal((int)stats_number(root, "datagrams.rejected"), 0);
    assert_int_equal((int)stats_number(root, "epoch_changes"), 0);
    json_decref(root);
    process_stop(&server);
    folder_remove(&folder);
}

// What is measured: the second server publishes ten ticks and ends. A picture more than before its
// start, and the new epoch in the client's stats, can only come from those ten.
static void a_killed_server_that_returns_is_shown_within_10_ticks(void** state)
{
    (void)state;
    static Process first, second, client;
    Folder folder;
    folder_make(&folder);
    start_server(&first, "bob");
    process_wait_ready(&first);
    start_counted(&client, &folder, "client");
    wait_pictures(folder_name(&folder, "client"), 5);
    process_kill(&first);
    int drawn = pictures_in(folder_name(&folder, "client")), before;
    do { // until the client has drawn all that was on its way
        before = drawn;
        process_pause(0.2);
        drawn = pictures_in(folder_name(&folder, "client"));
    } while (drawn != before);
    process_do(&second, ARGS(SERVER, "--style", "bob", "--motion", "shake", "--ticks", "10"));
    int64_t epoch = process_number(&second, "ready: epoch ");
    assert_true(epoch > process_number(&first, "ready: epoch "));
    wait_pictures(folder_name(&folder, "client"), drawn + 1);
    process_stop(&client);
    json_t* root = stats_load(folder_name(&folder, "client.json"));
    assert_int_equal(stats_integer(root, "epoch"), epoch);
    assert_in_range(stats_integer(root, "tick"), 0, 9);
    assert_int_equal((int)stats_number(root, "epoch_changes"), 1);
    // One picture a tick at most: never rows of two ticks in one.
    assert_in_range(stats_integer(root, "frames") - drawn, 1, 10);
    print_message("the new epoch's tick shown last: %d of 0..9, %d pictures of it\n",
                  (int)stats_integer(root, "tick"), (int)stats_integer(root, "frames") - drawn);
    json_decref(root);
    folder_remove(&folder);
}

static void a_late_client_has_an_imported_groom_within_4_s(void** state)
{
    (void)state;
    if (!file_exists(ASSETS "side.tfx")) {
        print_message("SKIPPED: no " ASSETS "side.tfx\n");
        skip();
    }
    static Process server, client;
    process_start(&server, ARGS(SERVER, "--style", ASSETS "back.tfx", "--style", ASSETS "side.tfx",
                                "--style", ASSETS "front_top.tfx", "--style", ASSETS "tail_v31.tfx",
                                "--head", ASSETS "head.obj", "--ticks", "9000"));
    process_wait_ready(&server);
    process_pause(2.0); // the bulk lane, sent once an epoch, is then past
    // The pacing is what is promised, not that the machine has nothing else to do: the best of
    // three.
    double best = PROCESS_PATIENCE;
    for (int attempt = 0; attempt < 3 && best >= GROOM_S; ++attempt) {
        process_start(&client, ARGS(CLIENT, "--backend", "null", "--frames", "1", SMALL));
        process_wait_ready(&client);
        double began = process_now_s();
        process_expect(&client, 0);
        best = fmin(best, process_now_s() - began);
        print_message("a late client had the imported groom after %.2f s\n", best);
    }
    if (!PROCESS_SANITIZED) assert_true(best < GROOM_S);
    process_stop(&server);
}

int main(void)
{
    process_setup();
    bus_require_private();
    const struct CMUnitTest tests[] = {
        PROCESS_TEST(clients_before_with_and_after_the_server_all_draw_hair),
        PROCESS_TEST(a_killed_client_costs_the_others_nothing),
        PROCESS_TEST(a_killed_server_that_returns_is_shown_within_10_ticks),
        PROCESS_TEST(a_late_client_has_an_imported_groom_within_4_s),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
