// Ticks from daemons that are late, twice, gone, doubled or hostile.
#include "tests/allocations.h"
#include "tests/receiving.h"

#include <unistd.h>

static void receive_keeps_the_newest_two_ticks_bit_for_bit(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    assert_false(take(stage));
    assert_false(stage->view.any);
    for (int tick = 10; tick < 15; ++tick) {
        FrameHeader header = at_tick(stage, tick);
        header.pose.position.x = tick;
        send_tick(stage, header);
    }
    assert_true(take(stage));
    assert_true(stage->view.any && stage->view.complete);
    assert_int_equal(stage->view.tick, 14);
    assert_int_equal(stage->view.guides, INBOUND_GUIDES);
    assert_true(rows_are(&stage->view, 14) && rows_are(&stage->view, 13));
    assert_true(stage->view.pose.position.x == 14.0);
    assert_true(stage->view.layer[1].pose.position.x == 13.0);
    assert_int_equal(stage->view.layer[1].tick, 13);
    ReceiveCounters c = counters(stage);
    assert_int_equal(c.datagrams, 5 * inbound_blocks());
    assert_int_equal(c.bytes, 5 * INBOUND_GUIDES * INBOUND_NODES * FRAME_NODE_BYTES);
    assert_int_equal(c.lost + c.late + c.duplicate + c.rejected + c.epoch_changes, 0);
    assert_int_equal(stage->said, 0);
    stage_close(stage);
}

static void receive_take_copies_only_new_rows(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    send_tick(stage, at_tick(stage, 10));
    assert_true(take(stage));
    assert_false(take(stage));
    int stride = INBOUND_NODES * 3, new_row = inbound_rows();
    for (int row = 0; row < INBOUND_GUIDES; ++row)
        stage->view.positions[0][row * stride] = 1; // marks that a second copy would undo
    send(stage, CHANNEL, inbound_nth_block(at_tick(stage, 12), 1));
    assert_true(take(stage));
    assert_false(stage->view.complete);
    for (int row = 0; row < INBOUND_GUIDES; ++row) {
        bool fresh = row >= new_row && row < 2 * new_row;
        assert_int_equal(stage->view.row_tick[0][row], fresh ? 12 : 10);
        assert_true(fresh ? row_is(&stage->view, row, 12)
                          : stage->view.positions[0][row * stride] == 1);
    }
    stage_close(stage);
}

static void receive_counts_every_dropped_message_of_closed_ticks(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    send_lane(stage, &stage->style, STYLE_FAST);
    int dropped = 0;
    for (int tick = 0; tick < 500; ++tick)
        for (int i = 0; i < inbound_blocks(); ++i) {
            // Only ticks that will be closed; 100 to 119 as a whole.
            bool open = tick == 0 || tick >= 498;
            bool drop = random_unit(3, (uint32_t)(tick * 10 + i)) < 0.2f || tick / 20 == 5;
            if (drop && !open)
                ++dropped;
            else
                send(stage, CHANNEL, inbound_nth_block(at_tick(stage, tick), i));
        }
    assert_true(dropped > 100);
    assert_int_equal(counters(stage).lost, dropped);
    assert_int_equal(counters(stage).late, 0);
    stage_close(stage);
}

static void receive_counts_no_more_than_600_ticks_of_a_gap(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    send_tick(stage, at_tick(stage, 0));
    send_tick(stage, at_tick(stage, 1));
    send_tick(stage, at_tick(stage, INT32_MAX - 1)); // anybody can say so
    assert_int_equal(counters(stage).lost, 600 * inbound_blocks());
    stage_close(stage);
}

static void receive_does_not_take_a_late_join_or_a_swap_for_loss(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    send(stage, CHANNEL, inbound_nth_block(at_tick(stage, 41), inbound_blocks() - 1));
    for (int tick = 42; tick < 60; tick += 2) {
        send_tick(stage, at_tick(stage, tick + 1));
        send_tick(stage, at_tick(stage, tick));
    }
    assert_int_equal(counters(stage).lost, 0);
    assert_int_equal(counters(stage).late, 9 * inbound_blocks());
    take(stage);
    assert_true(rows_are(&stage->view, 58) && rows_are(&stage->view, 59));
    stage_close(stage);
}

static void receive_counts_late_and_duplicate_blocks_and_shows_neither(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    send_tick(stage, at_tick(stage, 20));
    send_tick(stage, at_tick(stage, 21));
    send_tick(stage, at_tick(stage, 21));
    assert_int_equal(counters(stage).duplicate, inbound_blocks());
    send_tick(stage, at_tick(stage, 19));
    send_tick(stage, at_tick(stage, 3));
    assert_int_equal(counters(stage).late, 2 * inbound_blocks());
    take(stage);
    assert_int_equal(stage->view.tick, 21);
    assert_true(rows_are(&stage->view, 21) && rows_are(&stage->view, 20));
    stage_close(stage);
}

static void receive_ignores_other_slots_and_channels(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    InboundBytes block = inbound_nth_block(inbound_header(8, 1, stage->style.hash), 0);
    send(stage, "HAIR_GUIDES_0008", block);
    send(stage, "HAIR_GUIDES_00070", block);
    send(stage, "HAIR_GUIDES_", block);
    send(stage, "HAIR_GUIDES_9999", block);
    send(stage, "", block);
    assert_int_equal(counters(stage).datagrams, 0);
    send(stage, CHANNEL, block); // slot 8 under the name of slot 7
    assert_int_equal(counters(stage).rejected, 1);
    assert_false(take(stage));
    stage_close(stage);
}

static void receive_rejects_blocks_that_contradict_the_style(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    FrameHeader header = at_tick(stage, 5);
    send_tick(stage, header);
    FrameHeader longer = header;
    longer.nodes = INBOUND_NODES + 1;
    send(stage, CHANNEL, inbound_block(longer, 0, 2));
    assert_int_equal(counters(stage).rejected, 1);
    send(stage, CHANNEL, inbound_block(header, INBOUND_GUIDES, 4)); // not known to be too far yet
    take(stage);
    assert_int_equal(stage->view.guides, INBOUND_GUIDES + 4);
    send_lane(stage, &stage->style, STYLE_FAST);
    take(stage);
    assert_int_equal(stage->view.guides, INBOUND_GUIDES);
    assert_int_equal(stage->view.row_tick[1][INBOUND_GUIDES], -1);
    assert_true(stage->view.complete);
    send(stage, CHANNEL, inbound_block(header, INBOUND_GUIDES - 1, 2));
    assert_int_equal(counters(stage).rejected, 2);
    // The style outranks blocks that came first.
    receive_restart(stage->receive, SLOT);
    send(stage, CHANNEL, inbound_block(longer, 0, 2));
    assert_int_equal(counters(stage).rejected, 3);
    stage_close(stage);
}

static void receive_prefers_the_higher_epoch_for_two_seconds(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    FrameHeader old = at_tick(stage, 900), young = at_tick(stage, 3);
    young.epoch = INBOUND_EPOCH + 1;
    send_tick(stage, old);
    send_tick(stage, young); // adopted at once, though its tick is lower
    take(stage);
    assert_int_equal(stage->view.epoch, young.epoch);
    assert_int_equal(stage->view.tick, 3);
    assert_int_equal(stage->view.layer[0].tick, -1); // nothing of the old epoch is left
    assert_int_equal(stage->view.row_tick[0][0], -1);
    assert_int_equal(counters(stage).epoch_changes, 1);
    assert_int_equal(counters(stage).lost, 0);
    uint32_t generation = stage->view.generation;
    stage->now_us += 2 * SECOND - 1;
    old.tick = 901;
    send_tick(stage, old);
    assert_false(take(stage));
    assert_int_equal(counters(stage).late, inbound_blocks());
    assert_int_equal(stage->said, 1);
    assert_non_null(strstr(stage->last, "two daemons publish slot 7"));
    stage->now_us += 1;
    send_tick(stage, old);
    assert_true(take(stage));
    assert_int_equal(stage->view.epoch, INBOUND_EPOCH);
    assert_int_equal(stage->view.generation, generation + 1);
    assert_int_equal(counters(stage).epoch_changes, 2);
    send_tick(stage, young);
    send_tick(stage, old);
    assert_int_equal(stage->said, 1); // told once
    stage_close(stage);
}

static void receive_adopts_a_jump_back_that_lasts_half_a_second(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    send_tick(stage, at_tick(stage, 600));
    for (int tick = 0; tick < 30; ++tick) {
        send_tick(stage, at_tick(stage, tick));
        stage->now_us += 16000;
    }
    assert_true(take(stage));
    assert_int_equal(stage->view.tick, 600);
    stage->now_us += 20000; // 0.5 s since the first of them
    send_tick(stage, at_tick(stage, 30));
    assert_true(take(stage));
    assert_int_equal(stage->view.tick, 30);
    assert_int_equal(stage->view.row_tick[0][0], 30);
    assert_int_equal(counters(stage).lost, 0);
    assert_int_equal(counters(stage).epoch_changes, 0);
    stage_close(stage);
}

static void receive_does_not_jump_back_while_newer_ticks_come(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    send_tick(stage, at_tick(stage, 599));
    take(stage);
    uint32_t generation = stage->view.generation;
    for (int i = 0; i < 100; ++i) {
        send_tick(stage, at_tick(stage, 600 + i));
        send_tick(stage, at_tick(stage, i));
        stage->now_us += 16000;
    }
    take(stage);
    assert_int_equal(stage->view.tick, 699);
    assert_int_equal(stage->view.generation, generation);
    stage_close(stage);
}

static void receive_view_mixes_no_rows_of_two_generations(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    send_tick(stage, at_tick(stage, 5));
    take(stage);
    FrameHeader header = inbound_header(SLOT, 5, 99); // the same tick of another daemon and style
    header.epoch = INBOUND_EPOCH + 1;
    header.nodes = 5;
    send(stage, CHANNEL, inbound_block(header, 0, 3));
    assert_true(take(stage));
    for (int row = 0; row < 3; ++row)
        assert_true(row_is(&stage->view, row, 5));
    for (int row = 3; row < INBOUND_GUIDES; ++row)
        assert_int_equal(stage->view.row_tick[1][row], -1);
    stage_close(stage);
}

// Resident pages of this process.
static long resident_kib(void)
{
    long pages = 0, resident = 0;
    FILE* file = fopen("/proc/self/statm", "r");
    if (file == NULL) return 0;
    if (fscanf(file, "%ld %ld", &pages, &resident) != 2) resident = 0;
    fclose(file);
    return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

// A message of any kind, then damaged in up to four places or cut; every second one has its CRC
// mended by being made anew with wild fields, so that the checks behind the CRC are reached.
static InboundBytes hostile(Stage* stage, uint32_t i, const char** channel)
{
    uint32_t draw = random_hash2(77, i);
    InboundBytes message;
    if (draw % 3 == 0) {
        int lane = (int)(draw >> 4) % 2, parts = inbound_parts(&stage->style, lane, INBOUND_MTU);
        StyleBytes style = stage->style;
        if (draw & 64) style.hash = draw % 50;
        *channel = CHANNEL_STYLE;
        message = inbound_part(&style, lane, (int)(draw >> 8) % parts, INBOUND_MTU);
    } else {
        FrameHeader header = at_tick(stage, (int32_t)(i / 4));
        if (draw & 64) header.tick = (int32_t)(draw >> 1);
        if (draw & 128) header.nodes = (uint8_t)(3 + (draw >> 8) % 30);
        if (draw & 256) header.epoch = (draw & 512) ? INT64_MAX : (int64_t)(draw % 5);
        if (draw & 1024) header.style_hash = draw % 7;
        if (draw & 2048) header.slot = (uint16_t)(draw % 1024);
        *channel = CHANNEL;
        message = inbound_block(header, (int)(random_hash(draw) % 1020), 1 + (int)(draw >> 30));
    }
    if (draw & 4096) return message;
    for (uint32_t k = 0; k <= draw % 4; ++k) {
        uint32_t where = random_hash2(draw, k);
        message.bytes[where % message.size] = (uint8_t)(where >> 24);
    }
    if (draw & 8192) message.size = random_hash(draw) % (message.size + 1);
    return message;
}

static void receive_survives_anything_in_bounded_memory(void** state)
{
    (void)state;
    Stage* stage = stage_open(600);
    uint8_t request[CONTROL_MAX_BYTES];
    long before = 0;
    for (uint32_t i = 0; i < 100000; ++i) {
        const char* channel = NULL;
        InboundBytes message = hostile(stage, i, &channel);
        // Exactly as large as it is, so that AddressSanitizer sees a read past its end.
        uint8_t* exact = malloc(message.size + 1);
        assert_non_null(exact);
        memcpy(exact + 1, message.bytes, message.size); // odd address: alignment is arbitrary
        receive_message(stage->receive, channel, exact + 1, message.size, stage->now_us);
        free(exact);
        stage->now_us += random_hash(i) % 50 == 0 ? 2 * SECOND : 5000;
        if (i % 16 == 0) take(stage);
        if (i % 16 == 0) receive_request(stage->receive, stage->now_us, request, sizeof request);
        if (i == 20000) before = resident_kib();
    }
    // Table of 16 styles x (64 KiB + what a bulk lane of 60 KiB takes): long reached at `before`.
    if (COUNTS_ALLOCATIONS) assert_true(resident_kib() - before < 4096);
    ReceiveCounters c = counters(stage);
    assert_int_equal(c.datagrams, 100000);
    assert_true(c.rejected > 20000 && c.bytes > 0);
    assert_true(stage->said < 40);
    int64_t extremes[] = {INT64_MIN, -1, 0, INT64_MAX};
    for (int i = 0; i < 4; ++i) {
        stage->now_us = extremes[i];
        send_tick(stage, at_tick(stage, INT32_MAX - i));
        send_tick(stage, at_tick(stage, i));
        receive_request(stage->receive, extremes[i], request, sizeof request);
    }
    stage_close(stage);
}

static void receive_recovers_after_hostile_blocks(void** state)
{
    (void)state;
    Stage* stage = stage_open(0);
    FrameHeader forged = at_tick(stage, INT32_MAX);
    forged.epoch = INT64_MAX;
    send_tick(stage, at_tick(stage, 1));
    send_tick(stage, forged);
    for (int tick = 2; tick < 140; ++tick) {
        stage->now_us += 16667;
        send_tick(stage, at_tick(stage, tick));
    }
    take(stage);
    assert_int_equal(stage->view.tick, 139);
    assert_true(rows_are(&stage->view, 139));
    stage_close(stage);
}

static void receive_allocates_nothing_in_the_steady_state(void** state)
{
    (void)state;
#if COUNTS_ALLOCATIONS
    Stage* stage = stage_open(0);
    send_lane(stage, &stage->style, STYLE_FAST);
    send_tick(stage, at_tick(stage, 0));
    take(stage);
    long before = allocations;
    for (int tick = 1; tick < 300; ++tick) {
        send_tick(stage, at_tick(stage, tick));
        assert_true(take(stage));
        if (tick % 60 == 0) send_lane(stage, &stage->style, STYLE_FAST);
        uint8_t bytes[CONTROL_MAX_BYTES];
        receive_request(stage->receive, stage->now_us += 16667, bytes, sizeof bytes);
    }
    assert_int_equal(allocations, before);
    void* volatile control = malloc(1); // the counter does count
    free(control);
    assert_int_equal(allocations, before + 1);
    stage_close(stage);
#else
    print_message("skipped: AddressSanitizer owns malloc\n");
    skip();
#endif
}

static void receive_create_names_a_slot_outside_its_cap(void** state)
{
    (void)state;
    Fault fault = {""};
    int slot = CHANNEL_MAX_SLOTS;
    assert_null(receive_create(&slot, 1, (Notice){0}, &fault));
    assert_string_equal(fault.text, "slot 1024: slots are 0 to 1023");
    assert_null(receive_create(&slot, 0, (Notice){0}, &fault));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(receive_keeps_the_newest_two_ticks_bit_for_bit),
        cmocka_unit_test(receive_take_copies_only_new_rows),
        cmocka_unit_test(receive_counts_every_dropped_message_of_closed_ticks),
        cmocka_unit_test(receive_counts_no_more_than_600_ticks_of_a_gap),
        cmocka_unit_test(receive_does_not_take_a_late_join_or_a_swap_for_loss),
        cmocka_unit_test(receive_counts_late_and_duplicate_blocks_and_shows_neither),
        cmocka_unit_test(receive_ignores_other_slots_and_channels),
        cmocka_unit_test(receive_rejects_blocks_that_contradict_the_style),
        cmocka_unit_test(receive_prefers_the_higher_epoch_for_two_seconds),
        cmocka_unit_test(receive_adopts_a_jump_back_that_lasts_half_a_second),
        cmocka_unit_test(receive_does_not_jump_back_while_newer_ticks_come),
        cmocka_unit_test(receive_view_mixes_no_rows_of_two_generations),
        cmocka_unit_test(receive_survives_anything_in_bounded_memory),
        cmocka_unit_test(receive_recovers_after_hostile_blocks),
        cmocka_unit_test(receive_allocates_nothing_in_the_steady_state),
        cmocka_unit_test(receive_create_names_a_slot_outside_its_cap),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
