// The daemon as an object: what it publishes and when, epochs, what it refuses.
#include "server/groom.h"
#include "server/publish.h"
#include "tests/allocations.h"
#include "tests/daemon.h"

static void slices_together_hold_every_row_once(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "shake");
    options.characters = 3;
    Daemon* daemon = create(&options, &heard);
    assert_int_equal(daemon_tick_number(daemon), -1);
    for (int n = 0; n < 20; ++n) {
        tick(daemon, &heard);
        for (int slot = 0; slot < 3; ++slot) {
            const FrameHeader* frame = &heard.frame[slot];
            assert_int_equal(frame->tick, n);
            assert_int_equal(frame->epoch, 1000);
            assert_int_equal(frame->utime, (int64_t)(n * 1e6 / 60.0));
            for (int i = 0; i < daemon_status(daemon).guides; ++i)
                assert_int_equal(heard.rows[slot][i], 1);
        }
    }
    daemon_publish_styles(daemon);
    assert_true(heard.largest_packet <= 1500);
    assert_int_equal(daemon_status(daemon).clamped, 0);
    daemon_destroy(daemon);
}

static void the_hash_does_not_depend_on_threads(void** state)
{
    (void)state;
    assert_true(hash_of(1, 1) == hash_of(2, 1));
    assert_true(hash_of(1, 5) == hash_of(3, 5));
    assert_true(hash_of(1, 1) != hash_of(1, 5));
}

static void count_bytes(void* context, int64_t utime, const char* channel, const uint8_t* bytes,
                        size_t size)
{
    (void)utime, (void)channel, (void)bytes;
    *(size_t*)context += size;
}

static void a_recording_gets_the_style_at_once_and_the_bus_in_its_time(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "none");
    Daemon* daemon = create(&options, &heard);
    tick(daemon, &heard);
    size_t recorded = 0, before = heard.style_bytes;
    daemon_record_styles(daemon, (DaemonSink){count_bytes, &recorded});
    assert_int_equal(heard.style_bytes, before);
    for (int n = 0; n < 30; ++n)
        daemon_publish_background(daemon, 16667);
    assert_true(recorded > 0);
    assert_int_equal(heard.style_bytes - before, recorded);
    daemon_destroy(daemon);
}

static void styles_are_sent_at_once_and_again_each_second(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "none");
    Daemon* daemon = create(&options, &heard);
    int after[4] = {0};
    for (int n = 0; n < 240; ++n) {
        tick(daemon, &heard);
        size_t before = heard.style_bytes;
        daemon_publish_background(daemon, 16667);
        assert_true(heard.style_bytes - before < 4200); // paced: a fiftieth of a second and a part
        if (n % 60 == 50) after[n / 60] = heard.fast_parts;
    }
    assert_true(after[0] > 0);
    for (int second = 1; second < 4; ++second)
        assert_int_equal(after[second], (second + 1) * after[0]);
    assert_in_range(heard.statuses, 3, 4);
    assert_int_equal(heard.status.characters, 1);
    assert_int_equal(heard.status.epoch, 1000);
    daemon_destroy(daemon);
}

static void a_request_brings_the_parts_it_names(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "none");
    Daemon* daemon = create(&options, &heard);
    tick(daemon, &heard);
    for (int n = 0; n < 30; ++n)
        daemon_publish_background(daemon, 16667);
    int before = heard.fast_parts;
    assert_true(before > 3);
    RequestMessage request = {.style_hash = 0, .slot = 0, .lane = STYLE_FAST};
    request.missing[0] = 1u << 2;
    uint8_t bytes[CONTROL_MAX_BYTES];
    size_t size = request_encode(bytes, sizeof bytes, &request);
    daemon_receive(daemon, CHANNEL_REQUEST, bytes, size);
    daemon_publish_background(daemon, 16667);
    assert_int_equal(heard.fast_parts, before + 1);
    assert_int_equal(heard.last_part, 2);
    request.style_hash = 12345; // somebody else's
    size = request_encode(bytes, sizeof bytes, &request);
    daemon_receive(daemon, CHANNEL_REQUEST, bytes, size);
    daemon_publish_background(daemon, 16667);
    assert_int_equal(heard.fast_parts, before + 1);
    daemon_destroy(daemon);
}

static void what_does_not_fit_the_wire_is_counted_and_not_sent(void** state)
{
    (void)state;
    static Publisher publisher;
    static uint16_t positions[MAX_ROWS * HAIRSTYLE_MAX_NODES * 3];
    static int16_t tangents[MAX_ROWS * HAIRSTYLE_MAX_NODES * 3];
    PublishPlanes planes = {.positions = positions, .tangents = tangents};
    Hairstyle* style = groom_long(NULL);
    memset(&heard, 0, sizeof heard);
    publisher = (Publisher){.sinks = {{hear, &heard}}, .sink_count = 1, .mtu = 1500};
    FrameHeader header = {.epoch = 1, .pose = pose_identity()};
    assert_true(publish_block(&publisher, &header, &planes, style, 0));
    assert_int_equal(publisher.unsent, 0);
    header.pose.position.y = -1e9;
    assert_false(publish_block(&publisher, &header, &planes, style, 0));
    header.pose.position.y = NAN;
    assert_false(publish_block(&publisher, &header, &planes, style, 1));
    assert_int_equal(publisher.unsent, 2);
    assert_int_equal(publisher.sent_messages, 1);
    hairstyle_destroy(style);
}

static void bad_bytes_are_counted_and_noticed_once_a_kind(void** state)
{
    (void)state;
    const char* channels[] = {CHANNEL_POSE,    CHANNEL_CHARACTER, CHANNEL_WIND, CHANNEL_TUNING,
                              CHANNEL_REQUEST, CHANNEL_STATUS,    "ELSEWHERE"};
    DaemonOptions options = options_for(&heard, "bus");
    Daemon* daemon = create(&options, &heard);
    uint8_t bytes[700];
    memset(bytes, 0xa5, sizeof bytes);
    for (int k = 0; k < 7; ++k)
        for (size_t size = 0; size < sizeof bytes; size += 7)
            daemon_receive(daemon, channels[k], bytes, size);
    tick(daemon, &heard);
    assert_int_equal(heard.notices, 7);
    assert_int_equal(daemon_status(daemon).rejected, 7 * 100);
    assert_int_equal(heard.applied, 0);
    daemon_destroy(daemon);
}

static void hear_epoch(Daemon* daemon, int64_t epoch)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    StatusMessage status = {.epoch = epoch, .rate_hz = 60.0f};
    daemon_receive(daemon, CHANNEL_STATUS, bytes, status_encode(bytes, sizeof bytes, &status));
}

static void a_new_daemon_outbids_a_higher_epoch_once(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "none");
    options.epoch = 0;
    Daemon* daemon = create(&options, &heard);
    tick(daemon, &heard);
    int64_t own = daemon_epoch(daemon);
    hear_epoch(daemon, own); // its own status comes back by the bus
    tick(daemon, &heard);
    assert_true(daemon_epoch(daemon) == own);
    hear_epoch(daemon, own + 5000);
    tick(daemon, &heard);
    assert_true(daemon_epoch(daemon) == own + 5001);
    assert_int_equal(heard.frame[0].tick, 0);
    hear_epoch(daemon, own + 9000);
    tick(daemon, &heard);
    assert_true(daemon_epoch(daemon) == own + 5001);
    daemon_destroy(daemon);
    options.epoch = 42; // asked for: stays
    daemon = create(&options, &heard);
    hear_epoch(daemon, 9000);
    tick(daemon, &heard);
    assert_true(daemon_epoch(daemon) == 42);
    daemon_destroy(daemon);
}

static void steady_state_allocates_nothing(void** state)
{
    (void)state;
#if !COUNTS_ALLOCATIONS
    print_message("skipped: AddressSanitizer owns malloc\n");
    skip();
#endif
    for (int threads = 1; threads <= 2; ++threads)
        for (int characters = 1; characters <= 4; characters += 3) {
            DaemonOptions options = options_for(&heard, "bus");
            options.sim.threads = threads;
            options.characters = characters;
            Daemon* daemon = create(&options, &heard);
            for (int n = 0; n < 90; ++n) {
                if (n == 10) allocations = 0; // OpenMP's threads are there by now
                send_pose_of(daemon, n / 60.0, 0.01 * n, 0.0, n / 20, POSE_CARRY);
                send_wind(daemon, 0, 1024, vec3((float)(n % 9), 0, 0), 0.5f);
                send_tuning(daemon, (TuningMessage){.slot_count = 1024,
                                                    .set = TUNING_STIFFNESS | TUNING_PEARL_RADIUS,
                                                    .stiffness_s2 = (float)(300 + n),
                                                    .pearl_radius_m = 0.005f});
                tick(daemon, &heard);
                daemon_publish_background(daemon, 16667);
            }
            assert_int_equal(allocations, 0);
            send_character(daemon, 3, CHARACTER_REMOVE, "");
            send_character(daemon, 3, CHARACTER_ADD, "");
            tick(daemon, &heard);
            assert_true(allocations > 0); // the counter counts
            daemon_destroy(daemon);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(slices_together_hold_every_row_once),
        cmocka_unit_test(the_hash_does_not_depend_on_threads),
        cmocka_unit_test(a_recording_gets_the_style_at_once_and_the_bus_in_its_time),
        cmocka_unit_test(styles_are_sent_at_once_and_again_each_second),
        cmocka_unit_test(a_request_brings_the_parts_it_names),
        cmocka_unit_test(what_does_not_fit_the_wire_is_counted_and_not_sent),
        cmocka_unit_test(bad_bytes_are_counted_and_noticed_once_a_kind),
        cmocka_unit_test(a_new_daemon_outbids_a_higher_epoch_once),
        cmocka_unit_test(steady_state_allocates_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
