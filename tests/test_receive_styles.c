// Styles from daemons: in parts, split otherwise, forged, too many; and what is asked for again.
#include "tests/receiving.h"

// A stranger's part fixes the split; the message tells both apart where only the split differs.
static void receive_tells_how_a_part_is_split_otherwise(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    send_tick(stage, at_tick(stage, 1));
    send(stage, CHANNEL_STYLE, inbound_part(&stage->style, STYLE_FAST, 0, 800));
    send(stage, CHANNEL_STYLE, inbound_part(&stage->style, STYLE_FAST, 1, INBOUND_MTU));
    assert_int_equal(stage->said, 1);
    char expected[80];
    snprintf(expected, sizeof expected, "parts of %d bytes", style_part_bytes(800));
    assert_non_null(strstr(stage->last, expected));
    assert_int_equal(counters(stage).rejected, 1);
    stage_close(stage);
}

static void receive_tells_how_far_a_style_is(void** state)
{
    (void)state;
    int held, parts, before = 0;
    Stage* stage = stage_open(600);
    uint64_t hash = stage->style.hash;
    send_tick(stage, at_tick(stage, 1));
    assert_int_equal(receive_style_progress(stage->receive, hash, &held, &parts), 0);
    assert_int_equal(held + parts, 0);
    for (int lane = 0; lane < STYLE_LANES; ++lane)
        for (int i = 0; i < inbound_parts(&stage->style, lane, INBOUND_MTU); ++i) {
            send(stage, CHANNEL_STYLE, inbound_part(&stage->style, lane, i, INBOUND_MTU));
            int progress = receive_style_progress(stage->receive, hash, &held, &parts);
            assert_true(progress > before); // from lane to lane as well
            before = progress;
        }
    assert_non_null(receive_style(stage->receive, hash, NULL, NULL));
    stage_close(stage);
}

static void receive_follows_a_change_of_style(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    send_tick(stage, at_tick(stage, 1));
    take(stage);
    FrameHeader other = inbound_header(SLOT, 2, 99);
    other.nodes = 5;
    send(stage, CHANNEL, inbound_block(other, 0, 3));
    assert_true(take(stage));
    assert_int_equal(stage->view.style_hash, 99);
    assert_int_equal(stage->view.nodes, 5);
    assert_int_equal(stage->view.guides, 3);
    assert_int_equal(stage->view.row_tick[1][0], -1);
    other.style_hash = 98; // two styles in one tick cannot be
    send(stage, CHANNEL, inbound_block(other, 0, 3));
    assert_int_equal(counters(stage).rejected, 1);
    stage_close(stage);
}

static void receive_assembles_a_style_from_parts_in_any_order(void** state)
{
    (void)state;
    Stage* stage = stage_open(600);
    int fast = inbound_parts(&stage->style, STYLE_FAST, INBOUND_MTU);
    int bulk = inbound_parts(&stage->style, STYLE_BULK, INBOUND_MTU);
    assert_true(fast > 1 && bulk > 8);
    int version = -1;
    bool complete = true;
    for (int i = bulk - 1; i > 0; --i) // bulk first, backwards, twice
        for (int twice = 0; twice < 2; ++twice)
            send(stage, CHANNEL_STYLE, inbound_part(&stage->style, STYLE_BULK, i, INBOUND_MTU));
    assert_null(receive_style(stage->receive, stage->style.hash, &version, &complete));
    assert_int_equal(version, 0);
    assert_false(complete);
    for (int i = fast - 1; i >= 0; --i)
        send(stage, CHANNEL_STYLE, inbound_part(&stage->style, STYLE_FAST, i, INBOUND_MTU));
    const Hairstyle* first = receive_style(stage->receive, stage->style.hash, &version, &complete);
    assert_non_null(first);
    assert_int_equal(version, 1);
    assert_false(complete);
    assert_int_equal(first->strand_count, 0);
    send(stage, CHANNEL_STYLE, inbound_part(&stage->style, STYLE_BULK, 0, INBOUND_MTU));
    const Hairstyle* second = receive_style(stage->receive, stage->style.hash, &version, &complete);
    assert_int_equal(version, 2);
    assert_true(complete);
    assert_int_equal(second->strand_count, 600);
    assert_ptr_not_equal(first, second);
    assert_int_equal(first->guide_count, INBOUND_GUIDES); // the old one is still alive
    assert_int_equal(counters(stage).rejected, 0);
    stage_close(stage);
}

static void receive_completes_a_style_whose_bulk_lane_came_first(void** state)
{
    (void)state;
    Stage* stage = stage_open(600);
    send_lane(stage, &stage->style, STYLE_BULK);
    send_lane(stage, &stage->style, STYLE_FAST);
    int version = 0;
    bool complete = false;
    const Hairstyle* style = receive_style(stage->receive, stage->style.hash, &version, &complete);
    assert_non_null(style);
    assert_int_equal(version, 2);
    assert_true(complete);
    assert_int_equal(style->strand_count, 600);
    stage_close(stage);
}

static bool ask(Stage* stage, RequestMessage* request)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    size_t size = receive_request(stage->receive, stage->now_us, bytes, sizeof bytes);
    if (size == 0) return false;
    Fault fault = {""};
    assert_true(request_decode(request, bytes, size, &fault));
    return true;
}

static int missing_bits(const RequestMessage* request)
{
    int bits = 0;
    for (size_t i = 0; i < sizeof request->missing; ++i)
        bits += __builtin_popcount(request->missing[i]);
    return bits;
}

static void receive_requests_what_is_missing_and_no_more_often_than_due(void** state)
{
    (void)state;
    Stage* stage = stage_open(600);
    RequestMessage request;
    assert_false(ask(stage, &request)); // nobody wears anything yet
    send_tick(stage, at_tick(stage, 1));
    assert_true(ask(stage, &request)); // at once
    assert_int_equal(request.lane, STYLE_FAST);
    assert_int_equal(request.slot, SLOT);
    assert_true(request.style_hash == stage->style.hash);
    assert_int_equal(missing_bits(&request), STYLE_MAX_PARTS); // how many there are is not known
    stage->now_us += 299999;
    assert_false(ask(stage, &request));
    stage->now_us += 1;
    send(stage, CHANNEL_STYLE, inbound_part(&stage->style, STYLE_FAST, 0, INBOUND_MTU));
    assert_false(ask(stage, &request)); // parts are coming
    stage->now_us += 200000;
    assert_true(ask(stage, &request));
    assert_int_equal(missing_bits(&request),
                     inbound_parts(&stage->style, STYLE_FAST, INBOUND_MTU) - 1);
    assert_int_equal(request.missing[0] & 1, 0);
    send_lane(stage, &stage->style, STYLE_FAST);
    int bulk = inbound_parts(&stage->style, STYLE_BULK, INBOUND_MTU);
    for (int i = 0; i < bulk; ++i)
        if (i != 2 && i != 9)
            send(stage, CHANNEL_STYLE, inbound_part(&stage->style, STYLE_BULK, i, INBOUND_MTU));
    stage->now_us += 200000;
    send_tick(stage, at_tick(stage, 2));
    assert_true(ask(stage, &request));
    assert_int_equal(request.lane, STYLE_BULK);
    assert_int_equal(missing_bits(&request), 2);
    assert_int_equal(request.missing[0], 1 << 2);
    assert_int_equal(request.missing[1], 1 << 1);
    send(stage, CHANNEL_STYLE, inbound_part(&stage->style, STYLE_BULK, 2, INBOUND_MTU));
    send(stage, CHANNEL_STYLE, inbound_part(&stage->style, STYLE_BULK, 9, INBOUND_MTU));
    stage->now_us += SECOND;
    assert_false(ask(stage, &request));
    stage_close(stage);
}

static void receive_stops_asking_once_the_daemon_is_silent(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    RequestMessage request;
    send_tick(stage, at_tick(stage, 1));
    assert_true(ask(stage, &request));
    stage->now_us += 299999;
    assert_false(ask(stage, &request));
    stage->now_us += 1;
    assert_true(ask(stage, &request));
    stage->now_us += 1700000; // 2 s after the last guides
    assert_true(ask(stage, &request));
    stage->now_us += 300000;
    assert_false(ask(stage, &request));
    stage_close(stage);
}

static void receive_accepts_a_style_cut_anew_by_a_restarted_daemon(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    send(stage, CHANNEL_STYLE, inbound_part(&stage->style, STYLE_FAST, 0, INBOUND_MTU));
    int parts = inbound_parts(&stage->style, STYLE_FAST, 1000);
    send(stage, CHANNEL_STYLE, inbound_part(&stage->style, STYLE_FAST, 0, 1000));
    assert_int_equal(counters(stage).rejected, 1); // two cuts at once
    stage->now_us += SECOND;
    for (int i = 0; i < parts; ++i)
        send(stage, CHANNEL_STYLE, inbound_part(&stage->style, STYLE_FAST, i, 1000));
    bool complete = false;
    assert_non_null(receive_style(stage->receive, stage->style.hash, NULL, &complete));
    assert_true(complete);
    stage_close(stage);
}

// Sends the fast lane under a hash that is not its own, as a forger would.
static void send_forged(Stage* stage, uint64_t hash)
{
    uint64_t true_hash = stage->style.hash;
    stage->style.hash = hash;
    send_lane(stage, &stage->style, STYLE_FAST);
    stage->style.hash = true_hash;
}

static void receive_refuses_a_style_with_another_hash_and_tries_again_later(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    send_tick(stage, inbound_header(SLOT, 1, 1234));
    send_forged(stage, 1234);
    assert_null(receive_style(stage->receive, 1234, NULL, NULL));
    assert_int_equal(stage->said, 1);
    assert_non_null(strstr(stage->last, "00000000000004d2"));
    RequestMessage request;
    stage->now_us += 2 * SECOND - 1;
    send_tick(stage, inbound_header(SLOT, 2, 1234));
    assert_false(ask(stage, &request));
    stage->now_us += 1;
    assert_true(ask(stage, &request));
    send_forged(stage, 1234);
    assert_int_equal(stage->said, 1); // told once
    stage_close(stage);
}

static void receive_makes_room_for_worn_styles_and_ignores_strangers(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    for (uint64_t i = 0; i < 100; ++i) { // strangers, unfinished
        StyleBytes stranger = stage->style;
        stranger.hash = 5000 + i;
        send(stage, CHANNEL_STYLE, inbound_part(&stranger, STYLE_FAST, 0, INBOUND_MTU));
    }
    send_tick(stage, at_tick(stage, 1));
    send_lane(stage, &stage->style, STYLE_FAST);
    assert_non_null(receive_style(stage->receive, stage->style.hash, NULL, NULL));
    StyleBytes stranger = inbound_style_bytes(2, 0);
    send_lane(stage, &stranger, STYLE_FAST);
    assert_null(receive_style(stage->receive, stranger.hash, NULL, NULL));
    style_bytes_free(&stranger);
    stage_close(stage);
}

static void receive_begins_no_stranger_once_a_style_is_worn(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    send_tick(stage, inbound_header(SLOT, 1, 1234));
    send_lane(stage, &stage->style, STYLE_FAST);
    assert_null(receive_style(stage->receive, stage->style.hash, NULL, NULL));
    send_tick(stage, at_tick(stage, 2));
    send_lane(stage, &stage->style, STYLE_FAST);
    assert_non_null(receive_style(stage->receive, stage->style.hash, NULL, NULL));
    stage_close(stage);
}

static void receive_tells_when_more_styles_are_worn_than_fit(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    for (int i = 0; i < RECEIVE_MAX_STYLES + 3; ++i) {
        StyleBytes style = inbound_style_bytes((uint32_t)i + 10, 0);
        send_tick(stage, inbound_header(SLOT, i, style.hash));
        send_lane(stage, &style, STYLE_FAST);
        bool held = receive_style(stage->receive, style.hash, NULL, NULL) != NULL;
        assert_int_equal(held, i < RECEIVE_MAX_STYLES);
        style_bytes_free(&style);
    }
    assert_int_equal(stage->said, 1);
    assert_non_null(strstr(stage->last, "more than 16 styles"));
    stage_close(stage);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(receive_tells_how_a_part_is_split_otherwise),
        cmocka_unit_test(receive_tells_how_far_a_style_is),
        cmocka_unit_test(receive_follows_a_change_of_style),
        cmocka_unit_test(receive_assembles_a_style_from_parts_in_any_order),
        cmocka_unit_test(receive_completes_a_style_whose_bulk_lane_came_first),
        cmocka_unit_test(receive_requests_what_is_missing_and_no_more_often_than_due),
        cmocka_unit_test(receive_stops_asking_once_the_daemon_is_silent),
        cmocka_unit_test(receive_accepts_a_style_cut_anew_by_a_restarted_daemon),
        cmocka_unit_test(receive_refuses_a_style_with_another_hash_and_tries_again_later),
        cmocka_unit_test(receive_makes_room_for_worn_styles_and_ignores_strangers),
        cmocka_unit_test(receive_begins_no_stranger_once_a_style_is_worn),
        cmocka_unit_test(receive_tells_when_more_styles_are_worn_than_fit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
