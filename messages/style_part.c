#include "messages/bytes.h"
#include "messages/style.h"

#include <hair_style_t.h>

#include <zlib.h>

#define PACKET_OVERHEAD  47 // IP 20 + UDP 8 + LCM 8 + "HAIR_STYLE" with its NUL 11
#define PART_LEAST_BYTES 64 // whatever --mtu says
#define PART_MOST_BYTES  65000

enum {
    AT_FINGERPRINT = 0,
    AT_UTIME = 8,
    AT_EPOCH = 16,
    AT_STYLE_HASH = 24,
    AT_LANE_BYTES = 32,
    AT_OFFSET = 36,
    AT_PART = 40,
    AT_PARTS = 42,
    AT_LANE = 44,
    AT_FORMAT = 45,
    AT_RESERVED = 46,
    AT_CRC = 48,
    AT_SIZE = 52,
    AT_PAYLOAD = STYLE_HEADER_BYTES,
};

// Pure, where lcm-gen's cached number is written without a lock (as in frame.c).
static uint64_t fingerprint(void)
{
    return __hair_style_t_hash_recursive(NULL);
}

int style_part_bytes(int mtu)
{
    int room = mtu - PACKET_OVERHEAD - STYLE_HEADER_BYTES;
    if (room > PART_MOST_BYTES - STYLE_HEADER_BYTES) room = PART_MOST_BYTES - STYLE_HEADER_BYTES;
    return room < PART_LEAST_BYTES ? PART_LEAST_BYTES : room;
}

int style_part_count(size_t lane_bytes, int part_bytes)
{
    return (int)((lane_bytes + (size_t)part_bytes - 1) / (size_t)part_bytes);
}

static uint32_t lane_cap(uint8_t lane)
{
    return lane == STYLE_FAST ? STYLE_FAST_MAX_BYTES : STYLE_BULK_MAX_BYTES;
}

uint32_t style_part_split(const StylePart* p)
{
    if (p->lane >= STYLE_LANES || p->lane_bytes > lane_cap(p->lane)) return 0;
    if (p->parts < 1 || p->parts > STYLE_MAX_PARTS || p->part >= p->parts) return 0;
    uint64_t size = p->size, before_last = p->parts - 1u; // 64 bits: 4,095 parts of 4 MiB pass 32
    if (size < 1 || p->offset + size > p->lane_bytes) return 0;
    if (p->part < before_last) {
        bool fits = before_last * size < p->lane_bytes && p->lane_bytes <= p->parts * size;
        return fits && p->offset == p->part * size ? p->size : 0;
    }
    if (p->offset + size != p->lane_bytes) return 0;
    if (p->parts == 1) return p->offset == 0 ? p->size : 0;
    uint32_t split = p->offset / (uint32_t)before_last;
    return p->offset % before_last == 0 && split >= p->size ? split : 0;
}

static bool part_is_sound(const StylePart* part)
{
    return part->utime >= 0 && part->epoch >= 0 && style_part_split(part) > 0;
}

size_t style_part_encode(uint8_t* bytes, size_t capacity, const StylePart* part)
{
    size_t size = STYLE_HEADER_BYTES + (size_t)part->size;
    if (!part_is_sound(part) || size > capacity || size > PART_MOST_BYTES) return 0;
    bytes_put_be64(bytes + AT_FINGERPRINT, fingerprint());
    bytes_put_be64(bytes + AT_UTIME, (uint64_t)part->utime);
    bytes_put_be64(bytes + AT_EPOCH, (uint64_t)part->epoch);
    bytes_put_be64(bytes + AT_STYLE_HASH, part->style_hash);
    bytes_put_be32(bytes + AT_LANE_BYTES, part->lane_bytes);
    bytes_put_be32(bytes + AT_OFFSET, part->offset);
    bytes_put_be16(bytes + AT_PART, part->part);
    bytes_put_be16(bytes + AT_PARTS, part->parts);
    bytes[AT_LANE] = part->lane;
    bytes[AT_FORMAT] = STYLE_FORMAT;
    bytes_put_be16(bytes + AT_RESERVED, 0);
    bytes_put_be32(bytes + AT_CRC, (uint32_t)crc32(0, part->payload, part->size));
    bytes_put_be32(bytes + AT_SIZE, part->size);
    memcpy(bytes + AT_PAYLOAD, part->payload, part->size);
    return size;
}

bool style_part_decode(StylePart* part, const uint8_t* bytes, size_t size, Fault* fault)
{
    if (size <= STYLE_HEADER_BYTES || size > PART_MOST_BYTES)
        return fault_set(fault, "style part: %zu bytes", size);
    if (bytes_get_be64(bytes + AT_FINGERPRINT) != fingerprint())
        return fault_set(fault, "style part: another type or version of message");
    if (bytes[AT_FORMAT] < STYLE_FORMAT_OLDEST || bytes[AT_FORMAT] > STYLE_FORMAT)
        return fault_set(fault, "style part: format %d; this program reads formats %d to %d",
                         bytes[AT_FORMAT], STYLE_FORMAT_OLDEST, STYLE_FORMAT);
    if (bytes_get_be16(bytes + AT_RESERVED) != 0)
        return fault_set(fault, "style part: its reserved field is %d; it must be 0",
                         bytes_get_be16(bytes + AT_RESERVED));
    if (bytes_get_be32(bytes + AT_SIZE) != size - STYLE_HEADER_BYTES)
        return fault_set(fault, "style part: %zu bytes, its header says %u", size,
                         bytes_get_be32(bytes + AT_SIZE));
    StylePart p = {.utime = (int64_t)bytes_get_be64(bytes + AT_UTIME),
                   .epoch = (int64_t)bytes_get_be64(bytes + AT_EPOCH),
                   .style_hash = bytes_get_be64(bytes + AT_STYLE_HASH),
                   .lane_bytes = bytes_get_be32(bytes + AT_LANE_BYTES),
                   .part = bytes_get_be16(bytes + AT_PART),
                   .parts = bytes_get_be16(bytes + AT_PARTS),
                   .lane = bytes[AT_LANE],
                   .offset = bytes_get_be32(bytes + AT_OFFSET),
                   .size = (uint32_t)(size - STYLE_HEADER_BYTES),
                   .payload = bytes + AT_PAYLOAD};
    if (!part_is_sound(&p))
        return fault_set(fault, "style part: part %u of %u, lane %u, bytes %u + %u of %u: unsound",
                         p.part, p.parts, p.lane, p.offset, p.size, p.lane_bytes);
    if (bytes_get_be32(bytes + AT_CRC) != (uint32_t)crc32(0, p.payload, p.size))
        return fault_set(fault, "style part: damaged: its CRC-32 is wrong");
    *part = p;
    return true;
}
