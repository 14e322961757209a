// A receiver of slot 7 with its view, fed by the made-up daemons of inbound.h.
#pragma once

#include "client/receive.h"
#include "tests/inbound.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define SLOT    7
#define SECOND  1000000
#define CHANNEL "HAIR_GUIDES_0007"

// A receiver of slot 7 with its view, and what it said.
typedef struct Stage {
    Receive* receive;
    GuidesView view;
    StyleBytes style;
    int64_t now_us;
    int said;
    char last[400];
} Stage;

static inline void hear(void* context, const char* text)
{
    Stage* stage = context;
    ++stage->said;
    snprintf(stage->last, sizeof stage->last, "%s", text);
}

static inline Stage* stage_open(int bulk_strands)
{
    Stage* stage = calloc(1, sizeof *stage);
    assert_non_null(stage);
    Fault fault = {""};
    int slot = SLOT;
    stage->receive = receive_create(&slot, 1, (Notice){hear, stage}, &fault);
    assert_non_null(stage->receive);
    assert_true(guides_view_init(&stage->view, SLOT, &fault));
    stage->style = inbound_style_bytes(1, bulk_strands);
    stage->now_us = SECOND;
    return stage;
}

static inline void stage_close(Stage* stage)
{
    receive_destroy(stage->receive);
    guides_view_free(&stage->view);
    style_bytes_free(&stage->style);
    free(stage);
}

static inline void send(Stage* stage, const char* channel, InboundBytes message)
{
    receive_message(stage->receive, channel, message.bytes, message.size, stage->now_us);
}

static inline void send_tick(Stage* stage, FrameHeader header)
{
    for (int i = 0; i < inbound_blocks(); ++i)
        send(stage, CHANNEL, inbound_nth_block(header, i));
}

static inline FrameHeader at_tick(const Stage* stage, int32_t tick)
{
    return inbound_header(SLOT, tick, stage->style.hash);
}

static inline void send_lane(Stage* stage, const StyleBytes* style, int lane)
{
    for (int i = 0; i < inbound_parts(style, lane, INBOUND_MTU); ++i)
        send(stage, CHANNEL_STYLE, inbound_part(style, lane, i, INBOUND_MTU));
}

static inline bool take(Stage* stage)
{
    return receive_take(stage->receive, &stage->view);
}

static inline ReceiveCounters counters(const Stage* stage)
{
    return receive_counters(stage->receive);
}

static inline bool row_is(const GuidesView* view, int row, int32_t tick)
{
    int layer = tick & 1;
    if (view->row_tick[layer][row] != tick) return false;
    for (int i = 0; i < view->nodes * 3; ++i) {
        uint16_t number = inbound_number(tick, row, i / 3, i % 3);
        if (view->positions[layer][row * view->nodes * 3 + i] != number) return false;
        if (view->tangents[layer][row * view->nodes * 3 + i] != (int16_t)~number) return false;
    }
    return true;
}

static inline bool rows_are(const GuidesView* view, int32_t tick)
{
    for (int row = 0; row < INBOUND_GUIDES; ++row)
        if (!row_is(view, row, tick)) return false;
    return true;
}
