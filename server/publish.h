// Everything the daemon says: guide rows, style parts, status, applied inputs.
#pragma once

#include "messages/control.h"
#include "messages/frame.h"
#include "messages/style.h"
#include "server/daemon.h"
#include "server/sim.h"

#define PUBLISH_FAST_BYTES_S (2 * STYLE_FAST_MAX_BYTES) // the largest fast lane in half a second
#define PUBLISH_BULK_BYTES_S (256 * 1024)

typedef struct Publisher {
    DaemonSink sinks[DAEMON_MAX_SINKS];
    int sink_count;
    int mtu;
    int64_t epoch;
    int64_t sent_messages, sent_bytes;
    int64_t unsent;   // messages that could not be encoded
    int bulk_sharers; // styles whose bulk lane is due: they share its rate; 0 counts as 1
    uint8_t buffer[FRAME_MAX_BYTES];
} Publisher;

// To every sink. A `size` of 0 is what encoders return for what does not fit the wire: false, and
// counted.
bool publish_bytes(Publisher* publisher, int64_t utime, const char* channel, const uint8_t* bytes,
                   size_t size);

// One tick of one character as texels.
typedef struct PublishPlanes {
    Vec3* nodes;      // [guide][node], head space
    Vec3* directions; // of one strand
    uint16_t* positions;
    int16_t* tangents;
} PublishPlanes;

bool publish_planes_create(PublishPlanes* planes, int guides, int nodes);
void publish_planes_free(PublishPlanes* planes);

// Reads `sim` under `rotation` into texels; returns how many coordinates the box clamped.
int publish_quantise(PublishPlanes* planes, const Sim* sim, const float rotation[9], bool project,
                     const Hairstyle* style);

int publish_block_count(const Publisher* publisher, const Hairstyle* style);
// Block `block` of a character; `header` comes without its rows. False where it does not fit the
// wire.
bool publish_block(Publisher* publisher, const FrameHeader* header, const PublishPlanes* planes,
                   const Hairstyle* style, int block);

// What of a style is still to be sent.
typedef struct PublishStyle {
    StyleBytes bytes;
    int64_t since_fast_us;
    double credit_bytes[STYLE_LANES]; // may be spent now
    int next[STYLE_LANES];
    bool due[STYLE_LANES]; // anything missing at all
    uint8_t missing[STYLE_LANES][STYLE_MAX_PARTS / 8];
} PublishStyle;

// A new epoch: everything is missing again.
void publish_style_restart(PublishStyle* style);
void publish_style_request(PublishStyle* style, int lane, const uint8_t* missing);
// Sends missing parts as far as the rates of both lanes allow (fast: of each style; bulk: of all
// together); the fast lane is due every second.
void publish_style_due(Publisher* publisher, PublishStyle* style, int64_t utime,
                       int64_t elapsed_us);
void publish_style_all(Publisher* publisher, PublishStyle* style, int64_t utime);
