// A daemon in the test's own process: what goes in, and what it said. No network, no clock.
#pragma once

#include "messages/channels.h"
#include "messages/control.h"
#include "messages/frame.h"
#include "messages/style.h"
#include "server/daemon.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#define MAX_ROWS 1024

typedef struct Heard {
    // Of the last tick.
    FrameHeader frame[4]; // by slot
    int rows[4][MAX_ROWS];
    uint16_t positions[4][MAX_ROWS * HAIRSTYLE_MAX_NODES * 3];
    int guides;
    size_t largest_packet;
    // Since the start.
    int statuses, fast_parts, bulk_parts, applied, notices;
    AppliedMessage last_applied;
    char notice[400];
    StatusMessage status;
    size_t style_bytes;
    uint16_t last_part;
} Heard;

static inline void hear_guides(Heard* heard, const uint8_t* bytes, size_t size)
{
    FrameHeader header;
    const uint8_t *positions, *tangents;
    assert_int_equal(frame_decode(&header, &positions, &tangents, bytes, size), FRAME_OK);
    assert_true(header.slot < 4 && header.first_strand + header.strand_count <= MAX_ROWS);
    heard->frame[header.slot] = header;
    ++heard->guides;
    size_t row = (size_t)header.nodes * 3;
    for (int i = header.first_strand; i < header.first_strand + header.strand_count; ++i)
        ++heard->rows[header.slot][i];
    memcpy(&heard->positions[header.slot][header.first_strand * row], positions,
           header.strand_count * row * sizeof(uint16_t));
}

static inline void hear_part(Heard* heard, const uint8_t* bytes, size_t size)
{
    StylePart part;
    Fault fault = {0};
    if (!style_part_decode(&part, bytes, size, &fault)) fail_msg("%s", fault.text);
    ++*(part.lane == STYLE_FAST ? &heard->fast_parts : &heard->bulk_parts);
    heard->style_bytes += size;
    heard->last_part = part.part;
}

static inline void hear(void* context, int64_t utime, const char* channel, const uint8_t* bytes,
                        size_t size)
{
    Heard* heard = context;
    (void)utime;
    size_t packet = size + 20 + 8 + 8 + strlen(channel) + 1; // IP, UDP, LCM, its name
    if (packet > heard->largest_packet) heard->largest_packet = packet;
    if (strncmp(channel, CHANNEL_GUIDES_PREFIX, strlen(CHANNEL_GUIDES_PREFIX)) == 0) {
        hear_guides(heard, bytes, size);
    } else if (strcmp(channel, CHANNEL_STYLE) == 0) {
        hear_part(heard, bytes, size);
    } else if (strcmp(channel, CHANNEL_STATUS) == 0) {
        ++heard->statuses;
        assert_true(status_decode(&heard->status, bytes, size, NULL));
    } else {
        assert_string_equal(channel, CHANNEL_APPLIED);
        ++heard->applied;
        assert_true(applied_decode(&heard->last_applied, bytes, size, NULL));
    }
}

static inline void note(void* context, const char* text)
{
    Heard* heard = context;
    ++heard->notices;
    snprintf(heard->notice, sizeof heard->notice, "%s", text);
}

static inline DaemonOptions options_for(Heard* heard, const char* motion)
{
    memset(heard, 0, sizeof *heard);
    DaemonOptions options = daemon_default();
    options.motion = motion;
    options.fast = true;
    options.epoch = 1000;
    options.notice = (Notice){note, heard};
    return options;
}

static inline Daemon* create(const DaemonOptions* options, Heard* heard)
{
    Fault fault = {0};
    Daemon* daemon = daemon_create(options, &fault);
    if (daemon == NULL) fail_msg("%s", fault.text);
    daemon_add_sink(daemon, (DaemonSink){hear, heard});
    heard->notices = 0;
    return daemon;
}

static inline void tick(Daemon* daemon, Heard* heard)
{
    memset(heard->rows, 0, sizeof heard->rows);
    daemon_tick(daemon);
    for (int slice = 0; slice < 4; ++slice)
        daemon_publish_slice(daemon, slice, 4);
}

static inline void send_pose_of(Daemon* daemon, double t, double x, double yaw, int segment,
                                PoseVerb verb)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    PoseMessage message = {.utime = (int64_t)(t * 1e6),
                           .pose = {{x, 0, 0}, {0, sin(yaw / 2), 0, cos(yaw / 2)}},
                           .segment = segment,
                           .verb = (uint8_t)verb};
    daemon_receive(daemon, CHANNEL_POSE, bytes, pose_encode(bytes, sizeof bytes, &message));
}

static inline void send_character(Daemon* daemon, int slot, CharacterVerb verb, const char* style)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    CharacterMessage message = {.slot = (uint16_t)slot, .verb = (uint8_t)verb};
    snprintf(message.style, sizeof message.style, "%s", style);
    daemon_receive(daemon, CHANNEL_CHARACTER, bytes,
                   character_encode(bytes, sizeof bytes, &message));
}

static inline void send_wind(Daemon* daemon, int first, int count, Vec3 velocity, float gust)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    WindMessage message = {.first_slot = (uint16_t)first,
                           .slot_count = (uint16_t)count,
                           .velocity = velocity,
                           .gust = gust,
                           .gust_hz = 3};
    daemon_receive(daemon, CHANNEL_WIND, bytes, wind_encode(bytes, sizeof bytes, &message));
}

static inline void send_tuning(Daemon* daemon, TuningMessage message)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    daemon_receive(daemon, CHANNEL_TUNING, bytes, tuning_encode(bytes, sizeof bytes, &message));
}

static inline bool try_scene(const char* text, DaemonOptions* options, char path[64], Fault* fault)
{
    strcpy(path, P_tmpdir "/strandcast-scene-XXXXXX");
    int file = mkstemp(path);
    assert_true(file >= 0 && write(file, text, strlen(text)) == (ssize_t)strlen(text));
    close(file);
    return daemon_use_scene(options, path, fault);
}

static Heard heard, other;

static inline uint64_t hash_of(int threads, int characters)
{
    DaemonOptions options = options_for(&heard, "shake");
    options.sim.threads = threads;
    options.characters = characters;
    Daemon* daemon = create(&options, &heard);
    for (int n = 0; n < 60; ++n)
        daemon_tick(daemon);
    uint64_t hash = daemon_state_hash(daemon);
    daemon_destroy(daemon);
    return hash;
}

static inline bool same_hair(void)
{
    return memcmp(heard.positions, other.positions, sizeof heard.positions) == 0;
}
