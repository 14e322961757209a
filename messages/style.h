// A hairstyle <-> canonical bytes <-> the parts that `style_t` messages carry.
//
// Two lanes. Fast (at most 64 KiB): guides, scalp triangles, sets, colliders, colours; re-sent
// whole every second. Bulk (at most 4 MiB, deflated): imported strands and the head mesh; sent once
// an epoch, then only parts that a request names. A style's identity is the XXH64 of its fast
// bytes, which hold size and XXH64 of its bulk bytes, so one number names both.
#pragma once

#include "messages/hairstyle.h"

#define STYLE_FAST_MAX_BYTES (64 * 1024)
#define STYLE_BULK_MAX_BYTES (4 * 1024 * 1024)
#define STYLE_MAX_PARTS      4096
#define STYLE_HEADER_BYTES   56 // of a style_t message: see messages/README.md
#define STYLE_FORMAT         3  // written; those from STYLE_FORMAT_OLDEST on are read
#define STYLE_FORMAT_OLDEST  1  // spheres of the head only, no holds; 2: no forms, magnets, maps

typedef enum StyleLane { STYLE_FAST = 0, STYLE_BULK = 1, STYLE_LANES = 2 } StyleLane;

// A style ready to send: owned bytes of both lanes.
typedef struct StyleBytes {
    uint64_t hash;
    uint8_t* lane[STYLE_LANES];
    size_t size[STYLE_LANES]; // bulk 0 where the style is only grown
} StyleBytes;

// Encodes both lanes; false with a fault where a lane's cap is passed (the fault says what to cut).
bool style_encode(StyleBytes* bytes, const Hairstyle* style, Fault* fault);
void style_bytes_free(StyleBytes* bytes);

// Fast lane to a new style, guides only until style_decode_bulk adds strands and head. `*bulk_size`
// and `*bulk_hash` say what the bulk lane will be (size 0: there is none). Hostile bytes give a
// fault, bounded work and bounded memory. NULL on a fault.
Hairstyle* style_decode_fast(const uint8_t* bytes, size_t size, size_t* bulk_size,
                             uint64_t* bulk_hash, Fault* fault);
bool style_decode_bulk(Hairstyle* style, const uint8_t* bytes, size_t size, Fault* fault);

uint64_t style_hash(const uint8_t* bytes, size_t size);

// One part on the wire: style_part.c from here on.
typedef struct StylePart {
    int64_t utime, epoch;
    uint64_t style_hash;
    uint32_t lane_bytes;  // of the whole lane
    uint16_t part, parts; // every part but the last carries the same number of bytes
    uint8_t lane;
    uint32_t offset;        // of this part in its lane
    uint32_t size;          // of this part's payload
    const uint8_t* payload; // into the caller's bytes
} StylePart;

// Payload bytes of one part under `mtu`, and how many parts `lane_bytes` takes.
int style_part_bytes(int mtu);
int style_part_count(size_t lane_bytes, int part_bytes);

// Bytes of every part of the lane but the last, 0 where lane, counts, offset and sizes contradict
// one another. Every part but the last is equally long, so place and size of a part bind each
// other: a receiver may copy a sound one to `offset` of its lane without a further look.
uint32_t style_part_split(const StylePart* part);

// Returns the message's size, or 0 where it does not fit.
size_t style_part_encode(uint8_t* bytes, size_t capacity, const StylePart* part);
// False with a fault for anything but a sound part (size, version, lane, counts, CRC).
bool style_part_decode(StylePart* part, const uint8_t* bytes, size_t size, Fault* fault);
