// One block of guide rows at one tick <-> the bytes of a `guides_t` message.
//
// A row is a strand, a column a node. A block is whole rows, never larger than one datagram, and
// complete in itself: losing it costs its own rows one tick and nothing else. The layout, byte by
// byte, is in messages/README.md; it equals what lcm-gen's C code for guides_t writes (a test holds
// them together). Decoding copies nothing, allocates nothing and trusts nothing.
#pragma once

#include "messages/hairstyle.h"

#define FRAME_HEADER_BYTES    88
#define FRAME_NODE_BYTES      12
#define FRAME_PROFILE_FULL    0
#define FRAME_MAX_BYTES       65000 // no block of ours is larger, whatever --mtu says
#define FRAME_PACKET_OVERHEAD 53    // IP 20 + UDP 8 + LCM 8 + "HAIR_GUIDES_0007" with its NUL 17

typedef struct FrameHeader {
    int64_t utime; // us
    int64_t epoch; // us since 1970 at the daemon's start, strictly rising over daemons
    uint64_t style_hash;
    int32_t tick;
    int32_t segment; // rises at each teleport or reset; nobody interpolates across one
    Pose pose;       // of the head, as used in this tick
    uint16_t slot;
    uint16_t first_strand, strand_count;
    uint8_t nodes;
    uint8_t profile;
} FrameHeader;

#define FRAME_FAULTS(X)                                                                            \
    X(OK, "fine")                                                                                  \
    X(SIZE, "shorter than its header, or its length disagrees with its counts")                    \
    X(FOREIGN, "another type or version of message")                                               \
    X(COUNT, "a count, slot or profile outside its cap")                                           \
    X(NUMBER, "a pose that is not finite or not a rotation")                                       \
    X(CRC, "damaged: its CRC-32 is wrong")

typedef enum FrameFault {
#define FRAME_FAULT_ENUM(name, text) FRAME_##name,
    FRAME_FAULTS(FRAME_FAULT_ENUM)
#undef FRAME_FAULT_ENUM
} FrameFault;

const char* frame_fault_text(FrameFault fault);

// How many rows of `nodes` nodes fit one message under an IP packet of `mtu` bytes; at least 1.
int frame_rows_per_message(int mtu, int nodes);

// Bytes of a message with these counts.
size_t frame_size(int strand_count, int nodes);

// Writes header and rows [first_strand, first_strand + strand_count) of a character's two planes:
// `positions` and `tangents` are whole planes [guide][node][3]. Returns the message's size, or 0
// where it does not fit `capacity`.
size_t frame_encode(uint8_t* bytes, size_t capacity, const FrameHeader* header,
                    const uint16_t* positions, const int16_t* tangents);

// Checks everything (size first, CRC last) and fills `header`; `*positions` and `*tangents` then
// point into `bytes`: strand_count x nodes x 3 little-endian 16-bit numbers each, unaligned.
FrameFault frame_decode(FrameHeader* header, const uint8_t** positions, const uint8_t** tangents,
                        const uint8_t* bytes, size_t size);

// XXH64 (seed 0) over the position plane, then the tangent plane, of `guides` x `nodes` nodes.
uint64_t frame_payload_hash(const uint16_t* positions, const int16_t* tangents, int guides,
                            int nodes);
