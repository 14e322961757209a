// The example of a game server (tests/examples): what it does is what the hair's heads do.
#include "messages/frame.h"
#include "tests/bus.h"

#include <math.h>

#define PUBLISHER BIN_DIR "/pose-publisher"
#define CHANNEL   "HAIR_GUIDES_0002"

// What a head did, as the guides' messages tell.
typedef struct Path {
    bool any;
    int32_t tick, segment, rises, falls;
    double x_m, least_m[2], most_m[2]; // before and after the first rise
    double longest_step_m;             // between ticks of one segment
} Path;

static void follow(Path* path, const FrameHeader* header)
{
    double x_m = header->pose.position.x;
    if (path->any && header->tick <= path->tick) return;
    if (path->any && header->segment > path->segment) ++path->rises;
    if (path->any && header->segment < path->segment) ++path->falls;
    if (path->any && header->segment == path->segment)
        path->longest_step_m =
            fmax(path->longest_step_m, fabs(x_m - path->x_m) / (header->tick - path->tick));
    int part = path->rises > 0;
    path->least_m[part] = fmin(path->least_m[part], x_m);
    path->most_m[part] = fmax(path->most_m[part], x_m);
    path->any = true;
    path->tick = header->tick;
    path->segment = header->segment;
    path->x_m = x_m;
}

static void hear(Path* path, Bus* bus, double seconds)
{
    FrameHeader header;
    const uint8_t *positions, *tangents;
    while (bus_hear(bus, seconds)) {
        if (bus->channel == NULL || strcmp(bus->channel, CHANNEL) != 0) continue;
        assert_int_equal(frame_decode(&header, &positions, &tangents, bus->data, bus->data_size),
                         FRAME_OK);
        assert_int_equal(header.slot, 2);
        follow(path, &header);
        seconds = 0.0;
    }
}

static void a_game_server_adds_moves_and_teleports_a_head_once(void** state)
{
    (void)state;
    if (!file_exists(PUBLISHER)) {
        print_message("SKIPPED: no " PUBLISHER "\n");
        skip();
    }
    static Process server, publisher;
    static Bus bus;
    bus_open(&bus);
    process_start(&server, ARGS(SERVER, "--motion", "bus", "--characters", "0", "--style", "bob",
                                "--ticks", "9000"));
    process_wait_ready(&server);
    Path path = {.least_m = {1e9, 1e9}, .most_m = {-1e9, -1e9}};
    process_start(&publisher, ARGS(PUBLISHER, "--slot", "2", "--style", "bob", "--seconds", "5"));
    double until = process_now_s() + PROCESS_PATIENCE;
    while (!publisher.ended && process_now_s() < until) {
        hear(&path, &bus, 0.02);
        process_pump(&publisher, 0.0);
    }
    process_expect(&publisher, 0);
    hear(&path, &bus, 0.1);
    process_stop(&server);
    print_message("x from %.3f to %.3f m, then from %.3f to %.3f m; longest step %.4f m\n",
                  path.least_m[0], path.most_m[0], path.least_m[1], path.most_m[1],
                  path.longest_step_m);
    assert_int_equal(path.rises, 1);
    assert_int_equal(path.falls, 0);
    // It swings 0.15 m to each side, and 2 m further on after the teleport; the daemon's smooth
    // path may shave the ends.
    assert_true(path.least_m[0] < -0.10 && path.most_m[0] > 0.10);
    assert_true(path.least_m[0] > -0.25 && path.most_m[0] < 0.25);
    assert_true(path.least_m[1] < 1.90 && path.most_m[1] > 2.10);
    assert_true(path.least_m[1] > 1.75 && path.most_m[1] < 2.25);
    assert_true(path.longest_step_m < 0.05); // 0.008 as it swings: the jump is in no segment
    if (process_complaints(&server) != 0) process_fail(&server, "the server complained");
    bus_close(&bus);
}

int main(void)
{
    process_setup();
    bus_require_private();
    const struct CMUnitTest tests[] = {
        PROCESS_TEST(a_game_server_adds_moves_and_teleports_a_head_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
