// Made-up daemons for the tests of the inbound side: a style in parts, and blocks of guides whose
// numbers say which tick, row, node and axis they are.
#pragma once

#include "messages/channels.h"
#include "messages/frame.h"
#include "messages/random.h"
#include "messages/style.h"

#include <stdlib.h>
#include <string.h>

#define INBOUND_MTU    1500
#define INBOUND_GUIDES 30
#define INBOUND_NODES  8
#define INBOUND_EPOCH  1000000
#define INBOUND_MOST   2048 // bytes of a message here

typedef struct InboundBytes {
    uint8_t bytes[INBOUND_MOST];
    size_t size;
} InboundBytes;

// Grown over one triangle, or, with `bulk_strands`, explicit strands with noise for offsets, so
// that deflate leaves many parts. `seed` makes it another style.
static inline Hairstyle* inbound_style(uint32_t seed, int bulk_strands)
{
    Hairstyle* style = hairstyle_create();
    Fault fault = {""};
    if (style == NULL || !hairstyle_set_guides(style, INBOUND_GUIDES, INBOUND_NODES, &fault))
        abort();
    snprintf(style->name, sizeof style->name, "made-up %u", seed);
    style->seed = seed;
    for (int i = 0; i < INBOUND_GUIDES * INBOUND_NODES; ++i)
        style->rest[i] = vec3(0.01f * (float)(i / INBOUND_NODES), -0.02f * (float)(i % 8),
                              random_unit(seed, (uint32_t)i) * 0.01f);
    hairstyle_fit_box(style);
    style->set_count = 1;
    StrandSet* set = &style->sets[0];
    *set = (StrandSet){.name = "all",
                       .kind = bulk_strands > 0 ? STRANDS_EXPLICIT : STRANDS_GROWN,
                       .guide_count = INBOUND_GUIDES,
                       .points = 16,
                       .fibres = 10.0f,
                       .root_width_m = 0.001f};
    if (bulk_strands == 0) {
        style->triangle_count = set->triangle_count = 1;
        style->triangles = calloc(1, sizeof *style->triangles);
        if (style->triangles == NULL) abort();
        style->triangles[0] = (ScalpTriangle){{0, 1, 2}};
        set->strand_count = 100;
        return style;
    }
    set->strand_count = style->strand_count = bulk_strands;
    style->offset_count = bulk_strands * set->points;
    style->offset_scale_m = 1e-6f;
    style->strands = calloc((size_t)bulk_strands, sizeof *style->strands);
    style->offsets = calloc((size_t)style->offset_count, sizeof *style->offsets);
    if (style->strands == NULL || style->offsets == NULL) abort();
    for (int i = 0; i < bulk_strands; ++i)
        style->strands[i] = (BoundStrand){{0, 1, 2}, {65535, 0, 0}, 65535};
    for (int i = 0; i < style->offset_count; ++i)
        style->offsets[i] = (StrandOffset){(int16_t)random_hash2(seed, (uint32_t)i),
                                           (int16_t)random_hash2(seed + 1, (uint32_t)i), 0};
    return style;
}

static inline StyleBytes inbound_style_bytes(uint32_t seed, int bulk_strands)
{
    StyleBytes bytes = {0};
    Fault fault = {""};
    Hairstyle* style = inbound_style(seed, bulk_strands);
    if (!style_encode(&bytes, style, &fault)) {
        fprintf(stderr, "%s\n", fault.text);
        abort();
    }
    hairstyle_destroy(style);
    return bytes;
}

static inline int inbound_parts(const StyleBytes* style, int lane, int mtu)
{
    return style_part_count(style->size[lane], style_part_bytes(mtu));
}

static inline InboundBytes inbound_part(const StyleBytes* style, int lane, int part, int mtu)
{
    InboundBytes message;
    size_t most = (size_t)style_part_bytes(mtu), offset = (size_t)part * most;
    size_t size = style->size[lane] - offset < most ? style->size[lane] - offset : most;
    StylePart p = {.epoch = INBOUND_EPOCH,
                   .style_hash = style->hash,
                   .lane_bytes = (uint32_t)style->size[lane],
                   .part = (uint16_t)part,
                   .parts = (uint16_t)inbound_parts(style, lane, mtu),
                   .lane = (uint8_t)lane,
                   .offset = (uint32_t)offset,
                   .size = (uint32_t)size,
                   .payload = style->lane[lane] + offset};
    message.size = style_part_encode(message.bytes, sizeof message.bytes, &p);
    if (message.size == 0) abort();
    return message;
}

static inline uint16_t inbound_number(int tick, int row, int node, int axis)
{
    return (uint16_t)random_hash2((uint32_t)tick, (uint32_t)(row * 1000 + node * 3 + axis));
}

static inline FrameHeader inbound_header(int slot, int32_t tick, uint64_t style_hash)
{
    return (FrameHeader){.utime = (int64_t)tick * 16667,
                         .epoch = INBOUND_EPOCH,
                         .style_hash = style_hash,
                         .tick = tick,
                         .segment = 1,
                         .pose = pose_identity(),
                         .slot = (uint16_t)slot,
                         .nodes = INBOUND_NODES};
}

// Rows [first, first + count) as `header` says otherwise.
static inline InboundBytes inbound_block(FrameHeader header, int first, int count)
{
    static uint16_t positions[HAIRSTYLE_MAX_GUIDES * HAIRSTYLE_MAX_NODES * 3];
    static int16_t tangents[HAIRSTYLE_MAX_GUIDES * HAIRSTYLE_MAX_NODES * 3];
    int values = header.nodes * 3;
    for (int i = first * values; i < (first + count) * values; ++i) {
        positions[i] = inbound_number(header.tick, i / values, i % values / 3, i % 3);
        tangents[i] = (int16_t)~positions[i];
    }
    header.first_strand = (uint16_t)first;
    header.strand_count = (uint16_t)count;
    InboundBytes message;
    message.size = frame_encode(message.bytes, sizeof message.bytes, &header, positions, tangents);
    if (message.size == 0) abort();
    return message;
}

static inline int inbound_rows(void)
{
    return frame_rows_per_message(INBOUND_MTU, INBOUND_NODES);
}

static inline int inbound_blocks(void)
{
    return (INBOUND_GUIDES + inbound_rows() - 1) / inbound_rows();
}

// Block `index` of the tick, as the daemon would cut it.
static inline InboundBytes inbound_nth_block(FrameHeader header, int index)
{
    int first = index * inbound_rows(), count = INBOUND_GUIDES - first;
    return inbound_block(header, first, count < inbound_rows() ? count : inbound_rows());
}
