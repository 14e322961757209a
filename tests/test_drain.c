// The drain thread against a bus inside this process (memq), so that no network is needed.
#include "client/drain.h"
#include "tests/inbound.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SLOT     7
#define PATIENCE 5000 // ms before a test gives up

typedef struct Stage {
    Receive* receive;
    GuidesView view;
    StyleBytes style;
    Drain* drain;
    Fault fault;
    // What the bus carried back; written by the drain thread before `asked` rises.
    RequestMessage request;
    atomic_int asked;
} Stage;

static Stage* stage_open(void)
{
    Stage* stage = calloc(1, sizeof *stage);
    assert_non_null(stage);
    int slot = SLOT;
    stage->receive = receive_create(&slot, 1, (Notice){0}, &stage->fault);
    assert_non_null(stage->receive);
    assert_true(guides_view_init(&stage->view, SLOT, &stage->fault));
    stage->style = inbound_style_bytes(1, 0);
    stage->drain = drain_start("memq://", stage->receive, (Notice){0}, &stage->fault);
    if (stage->drain == NULL) fail_msg("%s", stage->fault.text);
    return stage;
}

static void stage_close(Stage* stage)
{
    drain_stop(stage->drain);
    receive_destroy(stage->receive);
    guides_view_free(&stage->view);
    style_bytes_free(&stage->style);
    free(stage);
}

static void publish(Stage* stage, const char* channel, InboundBytes message)
{
    assert_true(link_publish(drain_link(stage->drain), channel, message.bytes, message.size));
}

static void publish_tick(Stage* stage, int slot, int32_t tick)
{
    char channel[CHANNEL_BYTES];
    channel_guides(channel, slot);
    for (int i = 0; i < inbound_blocks(); ++i)
        publish(stage, channel,
                inbound_nth_block(inbound_header(slot, tick, stage->style.hash), i));
}

static void wait_a_millisecond(void)
{
    base_sleep_until_us(base_monotonic_us() + 1000);
}

static void drain_hands_over_what_the_bus_carries(void** state)
{
    (void)state;
    Stage* stage = stage_open();
    assert_true(drain_running(stage->drain));
    for (int tick = 0; tick < 200; ++tick) { // far more than LCM's default queue of 30 keeps
        publish_tick(stage, SLOT, tick);
        publish_tick(stage, SLOT + 1, tick);
    }
    for (int i = 0; i < PATIENCE && !(stage->view.tick == 199 && stage->view.complete); ++i) {
        receive_take(stage->receive, &stage->view);
        wait_a_millisecond();
    }
    assert_int_equal(stage->view.tick, 199);
    ReceiveCounters c = receive_counters(stage->receive);
    assert_int_equal(c.datagrams, 200 * inbound_blocks());
    assert_int_equal(c.lost + c.late + c.duplicate + c.rejected, 0);
    stage_close(stage);
}

static void hear_request(void* context, const char* channel, const uint8_t* bytes, size_t size)
{
    (void)channel;
    Stage* stage = context;
    if (atomic_load(&stage->asked) > 0) return;
    if (request_decode(&stage->request, bytes, size, NULL)) atomic_fetch_add(&stage->asked, 1);
}

static void drain_asks_for_a_style_and_gets_it(void** state)
{
    (void)state;
    Stage* stage = stage_open();
    assert_true(link_subscribe(drain_link(stage->drain), CHANNEL_REQUEST, hear_request, stage,
                               &stage->fault));
    publish_tick(stage, SLOT, 1);
    for (int i = 0; i < PATIENCE && atomic_load(&stage->asked) == 0; ++i)
        wait_a_millisecond();
    assert_int_equal(atomic_load(&stage->asked), 1);
    assert_true(stage->request.style_hash == stage->style.hash);
    assert_int_equal(stage->request.slot, SLOT);
    for (int i = 0; i < inbound_parts(&stage->style, STYLE_FAST, INBOUND_MTU); ++i)
        publish(stage, CHANNEL_STYLE, inbound_part(&stage->style, STYLE_FAST, i, INBOUND_MTU));
    const Hairstyle* style = NULL;
    for (int i = 0; i < PATIENCE && style == NULL; ++i) {
        style = receive_style(stage->receive, stage->style.hash, NULL, NULL);
        wait_a_millisecond();
    }
    assert_non_null(style);
    assert_int_equal(style->guide_count, INBOUND_GUIDES);
    stage_close(stage);
}

static void drain_stops_and_starts_again(void** state)
{
    (void)state;
    for (int i = 0; i < 10; ++i)
        stage_close(stage_open());
    drain_stop(NULL);
}

static void drain_start_reports_a_bad_url(void** state)
{
    (void)state;
    Fault fault = {""};
    int slot = SLOT;
    Receive* receive = receive_create(&slot, 1, (Notice){0}, &fault);
    assert_null(drain_start("nonsense://", receive, (Notice){0}, &fault));
    assert_true(fault.text[0] != 0);
    receive_destroy(receive);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(drain_hands_over_what_the_bus_carries),
        cmocka_unit_test(drain_asks_for_a_style_and_gets_it),
        cmocka_unit_test(drain_stops_and_starts_again),
        cmocka_unit_test(drain_start_reports_a_bad_url),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
