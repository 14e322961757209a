#include "messages/frame.h"

#include "messages/bytes.h"
#include "messages/channels.h"

#define XXH_STATIC_LINKING_ONLY // for a hash state on the stack
#include <hair_guides_t.h>

#include <xxhash.h>
#include <zlib.h>

// Where each field lies; messages/README.md prints the same table.
enum {
    AT_FINGERPRINT = 0,
    AT_UTIME = 8,
    AT_EPOCH = 16,
    AT_STYLE_HASH = 24,
    AT_POSITION = 32,
    AT_ORIENTATION = 56,
    AT_TICK = 64,
    AT_SEGMENT = 68,
    AT_SLOT = 72,
    AT_FIRST_STRAND = 74,
    AT_STRAND_COUNT = 76,
    AT_NODES = 78,
    AT_PROFILE = 79,
    AT_CRC = 80,
    AT_SIZE = 84,
    AT_PAYLOAD = FRAME_HEADER_BYTES,
};

#define QUATERNION_STEPS 32767.0

const char* frame_fault_text(FrameFault fault)
{
    switch (fault) {
#define FRAME_FAULT_TEXT(name, text)                                                               \
    case FRAME_##name:                                                                             \
        return text;
        FRAME_FAULTS(FRAME_FAULT_TEXT)
#undef FRAME_FAULT_TEXT
    }
    return "unknown";
}

// lcm-gen's own cache of this number is written without a lock; the recursion below it is pure, and
// sixteen additions are nothing beside the CRC.
static uint64_t fingerprint(void)
{
    return __hair_guides_t_hash_recursive(NULL);
}

size_t frame_size(int strand_count, int nodes)
{
    return FRAME_HEADER_BYTES + (size_t)strand_count * (size_t)nodes * FRAME_NODE_BYTES;
}

int frame_rows_per_message(int mtu, int nodes)
{
    int room = mtu - FRAME_PACKET_OVERHEAD;
    if (room > FRAME_MAX_BYTES) room = FRAME_MAX_BYTES;
    int rows = (room - FRAME_HEADER_BYTES) / (FRAME_NODE_BYTES * nodes);
    return rows < 1 ? 1 : rows;
}

static bool counts_are_sound(const FrameHeader* h)
{
    return h->slot < CHANNEL_MAX_SLOTS && h->nodes >= HAIRSTYLE_MIN_NODES &&
           h->nodes <= HAIRSTYLE_MAX_NODES && h->strand_count > 0 &&
           h->first_strand + h->strand_count <= HAIRSTYLE_MAX_GUIDES &&
           h->profile == FRAME_PROFILE_FULL && h->utime >= 0 && h->epoch >= 0 && h->tick >= 0;
}

static bool pose_is_sound(const Pose* pose)
{
    return pose_is_near(pose->position) && fabs(quat_length(pose->orientation) - 1.0) < 1e-3;
}

// `n` is left out: it is fixed by the counts that are in.
static uint32_t checksum(const uint8_t* bytes, size_t size)
{
    uLong crc = crc32(0, bytes, AT_CRC);
    return (uint32_t)crc32(crc, bytes + AT_PAYLOAD, (uInt)(size - AT_PAYLOAD));
}

static void put_quaternion_part(uint8_t* at, double value)
{
    int16_t n = (int16_t)(value * QUATERNION_STEPS + (value < 0.0 ? -0.5 : 0.5));
    bytes_put_be16(at, (uint16_t)n);
}

static double get_quaternion_part(const uint8_t* at)
{
    return (int16_t)bytes_get_be16(at) / QUATERNION_STEPS;
}

static void put_pose(uint8_t* bytes, const Pose* pose)
{
    Quat q = quat_normalise(pose->orientation);
    bytes_put_be_double(bytes + AT_POSITION, pose->position.x);
    bytes_put_be_double(bytes + AT_POSITION + 8, pose->position.y);
    bytes_put_be_double(bytes + AT_POSITION + 16, pose->position.z);
    put_quaternion_part(bytes + AT_ORIENTATION, q.x);
    put_quaternion_part(bytes + AT_ORIENTATION + 2, q.y);
    put_quaternion_part(bytes + AT_ORIENTATION + 4, q.z);
    put_quaternion_part(bytes + AT_ORIENTATION + 6, q.w);
}

static Pose get_pose(const uint8_t* bytes)
{
    return (Pose){.position = {bytes_get_be_double(bytes + AT_POSITION),
                               bytes_get_be_double(bytes + AT_POSITION + 8),
                               bytes_get_be_double(bytes + AT_POSITION + 16)},
                  .orientation = {get_quaternion_part(bytes + AT_ORIENTATION),
                                  get_quaternion_part(bytes + AT_ORIENTATION + 2),
                                  get_quaternion_part(bytes + AT_ORIENTATION + 4),
                                  get_quaternion_part(bytes + AT_ORIENTATION + 6)}};
}

static void put_header(uint8_t* bytes, const FrameHeader* h, size_t payload_size)
{
    bytes_put_be64(bytes + AT_FINGERPRINT, fingerprint());
    bytes_put_be64(bytes + AT_UTIME, (uint64_t)h->utime);
    bytes_put_be64(bytes + AT_EPOCH, (uint64_t)h->epoch);
    bytes_put_be64(bytes + AT_STYLE_HASH, h->style_hash);
    put_pose(bytes, &h->pose);
    bytes_put_be32(bytes + AT_TICK, (uint32_t)h->tick);
    bytes_put_be32(bytes + AT_SEGMENT, (uint32_t)h->segment);
    bytes_put_be16(bytes + AT_SLOT, h->slot);
    bytes_put_be16(bytes + AT_FIRST_STRAND, h->first_strand);
    bytes_put_be16(bytes + AT_STRAND_COUNT, h->strand_count);
    bytes[AT_NODES] = h->nodes;
    bytes[AT_PROFILE] = h->profile;
    bytes_put_be32(bytes + AT_SIZE, (uint32_t)payload_size);
}

static FrameHeader get_header(const uint8_t* bytes)
{
    return (FrameHeader){
        .utime = (int64_t)bytes_get_be64(bytes + AT_UTIME),
        .epoch = (int64_t)bytes_get_be64(bytes + AT_EPOCH),
        .style_hash = bytes_get_be64(bytes + AT_STYLE_HASH),
        .tick = (int32_t)bytes_get_be32(bytes + AT_TICK),
        .segment = (int32_t)bytes_get_be32(bytes + AT_SEGMENT),
        .pose = get_pose(bytes),
        .slot = bytes_get_be16(bytes + AT_SLOT),
        .first_strand = bytes_get_be16(bytes + AT_FIRST_STRAND),
        .strand_count = bytes_get_be16(bytes + AT_STRAND_COUNT),
        .nodes = bytes[AT_NODES],
        .profile = bytes[AT_PROFILE],
    };
}

size_t frame_encode(uint8_t* bytes, size_t capacity, const FrameHeader* header,
                    const uint16_t* positions, const int16_t* tangents)
{
    FrameHeader sent = *header;
    sent.pose.orientation = quat_normalise(sent.pose.orientation);
    if (!counts_are_sound(&sent) || !pose_is_sound(&sent.pose)) return 0;
    size_t size = frame_size(header->strand_count, header->nodes);
    if (size > capacity || size > FRAME_MAX_BYTES) return 0;
    size_t plane = (size - AT_PAYLOAD) / 2;
    size_t first = (size_t)header->first_strand * header->nodes * 3;
    put_header(bytes, &sent, size - AT_PAYLOAD);
    memcpy(bytes + AT_PAYLOAD, positions + first, plane);
    memcpy(bytes + AT_PAYLOAD + plane, tangents + first, plane);
    bytes_put_be32(bytes + AT_CRC, checksum(bytes, size));
    return size;
}

FrameFault frame_decode(FrameHeader* header, const uint8_t** positions, const uint8_t** tangents,
                        const uint8_t* bytes, size_t size)
{
    if (size < FRAME_HEADER_BYTES || size > FRAME_MAX_BYTES) return FRAME_SIZE;
    if (bytes_get_be64(bytes + AT_FINGERPRINT) != fingerprint()) return FRAME_FOREIGN;
    FrameHeader h = get_header(bytes);
    size_t expected = frame_size(h.strand_count, h.nodes);
    if (size != expected || bytes_get_be32(bytes + AT_SIZE) != expected - AT_PAYLOAD)
        return FRAME_SIZE;
    if (!counts_are_sound(&h)) return FRAME_COUNT;
    if (!pose_is_sound(&h.pose)) return FRAME_NUMBER;
    if (bytes_get_be32(bytes + AT_CRC) != checksum(bytes, size)) return FRAME_CRC;
    h.pose.orientation = quat_normalise(h.pose.orientation);
    *header = h;
    *positions = bytes + AT_PAYLOAD;
    *tangents = *positions + (size - AT_PAYLOAD) / 2;
    return FRAME_OK;
}

uint64_t frame_payload_hash(const uint16_t* positions, const int16_t* tangents, int guides,
                            int nodes)
{
    size_t plane = (size_t)guides * (size_t)nodes * FRAME_NODE_BYTES / 2;
    XXH64_state_t state;
    XXH64_reset(&state, 0);
    XXH64_update(&state, positions, plane);
    XXH64_update(&state, tangents, plane);
    return XXH64_digest(&state);
}
