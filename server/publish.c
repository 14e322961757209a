#include "server/publish.h"

#include "messages/channels.h"
#include "messages/quantise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

bool publish_bytes(Publisher* publisher, int64_t utime, const char* channel, const uint8_t* bytes,
                   size_t size)
{
    publisher->unsent += size == 0;
    if (size == 0) return false;
    for (int i = 0; i < publisher->sink_count; ++i)
        publisher->sinks[i].publish(publisher->sinks[i].context, utime, channel, bytes, size);
    ++publisher->sent_messages;
    publisher->sent_bytes += (int64_t)size;
    return true;
}

bool publish_planes_create(PublishPlanes* planes, int guides, int nodes)
{
    size_t count = (size_t)guides * (size_t)nodes;
    planes->nodes = calloc(count, sizeof *planes->nodes);
    planes->directions = calloc((size_t)nodes, sizeof *planes->directions);
    planes->positions = calloc(3 * count, sizeof *planes->positions);
    planes->tangents = calloc(3 * count, sizeof *planes->tangents);
    return planes->nodes && planes->directions && planes->positions && planes->tangents;
}

void publish_planes_free(PublishPlanes* planes)
{
    free(planes->nodes);
    free(planes->directions);
    free(planes->positions);
    free(planes->tangents);
    *planes = (PublishPlanes){0};
}

static int quantise_strand(PublishPlanes* planes, const Hairstyle* style, int strand)
{
    int clamped = 0;
    size_t first = (size_t)strand * (size_t)style->nodes;
    quantise_strand_tangents(planes->directions, planes->nodes + first, style->nodes);
    for (int n = 0; n < style->nodes; ++n) {
        size_t node = first + (size_t)n;
        clamped +=
            quantise_position(planes->positions + 3 * node, planes->nodes[node], &style->box);
        quantise_tangent(planes->tangents + 3 * node, planes->directions[n]);
    }
    return clamped;
}

int publish_quantise(PublishPlanes* planes, const Sim* sim, const float rotation[9], bool project,
                     const Hairstyle* style)
{
    int clamped = 0;
    sim_positions(sim, rotation, project, planes->nodes);
    for (int s = 0; s < style->guide_count; ++s)
        clamped += quantise_strand(planes, style, s);
    return clamped;
}

int publish_block_count(const Publisher* publisher, const Hairstyle* style)
{
    int rows = frame_rows_per_message(publisher->mtu, style->nodes);
    return (style->guide_count + rows - 1) / rows;
}

bool publish_block(Publisher* publisher, const FrameHeader* header, const PublishPlanes* planes,
                   const Hairstyle* style, int block)
{
    int rows = frame_rows_per_message(publisher->mtu, style->nodes);
    int first = block * rows, left = style->guide_count - first;
    FrameHeader full = *header;
    full.first_strand = (uint16_t)first;
    full.strand_count = (uint16_t)(left < rows ? left : rows);
    full.nodes = (uint8_t)style->nodes;
    size_t size = frame_encode(publisher->buffer, sizeof publisher->buffer, &full,
                               planes->positions, planes->tangents);
    char channel[CHANNEL_BYTES];
    channel_guides(channel, header->slot);
    return publish_bytes(publisher, header->utime, channel, publisher->buffer, size);
}

void publish_style_restart(PublishStyle* style)
{
    memset(style->missing, 0xff, sizeof style->missing);
    style->due[STYLE_FAST] = style->due[STYLE_BULK] = true;
    style->since_fast_us = 0;
}

void publish_style_request(PublishStyle* style, int lane, const uint8_t* missing)
{
    for (int i = 0; i < STYLE_MAX_PARTS / 8; ++i)
        style->missing[lane][i] |= missing[i];
    style->due[lane] = true;
}

static size_t send_part(Publisher* publisher, PublishStyle* style, int lane, int part, int parts,
                        int64_t utime)
{
    size_t step = (size_t)style_part_bytes(publisher->mtu), offset = (size_t)part * step;
    size_t left = style->bytes.size[lane] - offset;
    StylePart header = {.utime = utime,
                        .epoch = publisher->epoch,
                        .style_hash = style->bytes.hash,
                        .lane_bytes = (uint32_t)style->bytes.size[lane],
                        .part = (uint16_t)part,
                        .parts = (uint16_t)parts,
                        .lane = (uint8_t)lane,
                        .offset = (uint32_t)offset,
                        .size = (uint32_t)(left < step ? left : step),
                        .payload = style->bytes.lane[lane] + offset};
    size_t size = style_part_encode(publisher->buffer, sizeof publisher->buffer, &header);
    publish_bytes(publisher, utime, CHANNEL_STYLE, publisher->buffer, size);
    return size;
}

// Sends missing parts, round from where it stopped last, while there is credit. Credit may go below
// zero by one part, so that a slow tick rate still sends.
static void send_lane(Publisher* publisher, PublishStyle* style, int lane, int64_t utime)
{
    int step = style_part_bytes(publisher->mtu);
    int parts = style_part_count(style->bytes.size[lane], step);
    for (int seen = 0; seen < parts && style->credit_bytes[lane] > 0.0; ++seen) {
        int part = style->next[lane] % parts;
        uint8_t* bits = &style->missing[lane][part / 8];
        style->next[lane] = (part + 1) % parts;
        if ((*bits & 1u << part % 8) == 0) {
            if (seen == parts - 1) style->due[lane] = false;
            continue;
        }
        *bits &= (uint8_t) ~(1u << part % 8);
        seen = -1; // a whole round without a missing part ends it
        style->credit_bytes[lane] -= (double)send_part(publisher, style, lane, part, parts, utime);
    }
}

void publish_style_due(Publisher* publisher, PublishStyle* style, int64_t utime, int64_t elapsed_us)
{
    int sharers = publisher->bulk_sharers > 1 ? publisher->bulk_sharers : 1;
    const double rate[STYLE_LANES] = {PUBLISH_FAST_BYTES_S, (double)PUBLISH_BULK_BYTES_S / sharers};
    style->since_fast_us += elapsed_us;
    if (style->since_fast_us >= 1000000) {
        style->since_fast_us = 0;
        memset(style->missing[STYLE_FAST], 0xff, sizeof style->missing[STYLE_FAST]);
        style->due[STYLE_FAST] = true;
    }
    for (int lane = 0; lane < STYLE_LANES; ++lane) {
        // Unused credit does not pile up: at most what a fiftieth of a second may send.
        double* credit = &style->credit_bytes[lane];
        *credit += rate[lane] * (double)elapsed_us * 1e-6;
        double most = fmax(rate[lane] * 0.02, rate[lane] * (double)elapsed_us * 1e-6);
        if (*credit > most) *credit = most;
        if (style->bytes.size[lane] > 0 && style->due[lane])
            send_lane(publisher, style, lane, utime);
    }
}

void publish_style_all(Publisher* publisher, PublishStyle* style, int64_t utime)
{
    for (int lane = 0; lane < STYLE_LANES; ++lane) {
        int parts = style_part_count(style->bytes.size[lane], style_part_bytes(publisher->mtu));
        for (int part = 0; part < parts; ++part)
            send_part(publisher, style, lane, part, parts, utime);
        memset(style->missing[lane], 0, sizeof style->missing[lane]);
        style->due[lane] = false;
    }
    style->since_fast_us = 0;
}
