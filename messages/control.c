#include "messages/control.h"

#include "messages/bytes.h"

#include <hair_applied_t.h>
#include <hair_character_t.h>
#include <hair_pose_t.h>
#include <hair_request_t.h>
#include <hair_status_t.h>
#include <hair_tuning_t.h>
#include <hair_wind_t.h>

// Fields are put and taken by hand, in the order of the .lcm files, rather than by lcm-gen's code:
// that caches each fingerprint in a variable without a lock, and these run in several threads.
// Tests hold both to the same bytes.
enum {
    POSE_BYTES = 79,
    CHARACTER_BYTES = 51,
    WIND_BYTES = 40,
    TUNING_BYTES = 45,
    REQUEST_BYTES = 27 + STYLE_MAX_PARTS / 8,
    STATUS_BYTES = 100,
    APPLIED_HEADER_BYTES = 52,
};

static void put8(uint8_t** at, uint8_t value)
{
    *(*at)++ = value;
}

static void put16(uint8_t** at, uint16_t value)
{
    bytes_put_be16(*at, value);
    *at += 2;
}

static void put32(uint8_t** at, uint32_t value)
{
    bytes_put_be32(*at, value);
    *at += 4;
}

static void put64(uint8_t** at, uint64_t value)
{
    bytes_put_be64(*at, value);
    *at += 8;
}

static void put_float(uint8_t** at, float value)
{
    bytes_put_be_float(*at, value);
    *at += 4;
}

static void put_double(uint8_t** at, double value)
{
    bytes_put_be_double(*at, value);
    *at += 8;
}

// Zeros behind the name's end: what is sent must not depend on what lay in the buffer before.
static void put_text(uint8_t** at, const char* text, size_t room)
{
    size_t length = strnlen(text, room);
    memcpy(*at, text, length);
    memset(*at + length, 0, room - length);
    *at += room;
}

static uint8_t take8(const uint8_t** at)
{
    return *(*at)++;
}

static uint16_t take16(const uint8_t** at)
{
    *at += 2;
    return bytes_get_be16(*at - 2);
}

static uint32_t take32(const uint8_t** at)
{
    *at += 4;
    return bytes_get_be32(*at - 4);
}

static uint64_t take64(const uint8_t** at)
{
    *at += 8;
    return bytes_get_be64(*at - 8);
}

static float take_float(const uint8_t** at)
{
    *at += 4;
    return bytes_get_be_float(*at - 4);
}

static double take_double(const uint8_t** at)
{
    *at += 8;
    return bytes_get_be_double(*at - 8);
}

static bool is_text(const char* text, size_t room)
{
    for (size_t i = 0; i < room; ++i) {
        if (text[i] == '\0') return true;
        if (text[i] < ' ' || text[i] > '~') return false;
    }
    return false;
}

// False where the bytes are no printable text with an end inside its room.
static bool take_text(const uint8_t** at, char* text, size_t room)
{
    memcpy(text, *at, room);
    *at += room;
    if (!is_text(text, room)) return false;
    size_t length = strnlen(text, room);
    memset(text + length, 0, room - length);
    return true;
}

// Size and type first, before any field is looked at. Leaves `*at` behind the fingerprint.
static bool take_start(const uint8_t** at, const char* type, size_t size, size_t expected,
                       uint64_t fingerprint, Fault* fault)
{
    if (size != expected)
        return fault_set(fault, "%s: %zu bytes where %zu are due", type, size, expected);
    if (take64(at) != fingerprint)
        return fault_set(fault, "%s: another type or version of message", type);
    return true;
}

static bool check_slot(const char* type, int slot, Fault* fault)
{
    return slot < CHANNEL_MAX_SLOTS ||
           fault_set(fault, "%s: slot %d: 0 to %d", type, slot, CHANNEL_MAX_SLOTS - 1);
}

static bool check_slots(const char* type, int first, int count, Fault* fault)
{
    return (count >= 1 && first + count <= CHANNEL_MAX_SLOTS) ||
           fault_set(fault, "%s: slots %d and %d on: 1 to %d of them, below %d", type, first, count,
                     CHANNEL_MAX_SLOTS, CHANNEL_MAX_SLOTS);
}

// False also where `value` is no number.
static bool check_range(const char* type, const char* field, double value, double low, double high,
                        Fault* fault)
{
    return (value >= low && value <= high) ||
           fault_set(fault, "%s: %s is %g: %g to %g", type, field, value, low, high);
}

static bool check_time(const char* type, const char* field, int64_t value, Fault* fault)
{
    return value >= 0 || fault_set(fault, "%s: %s is negative", type, field);
}

// Pose ------------------------------------------------------------------------------------------

static bool check_pose(const PoseMessage* m, Fault* fault)
{
    double length = quat_length(m->pose.orientation);
    if (!check_time("pose", "utime", m->utime, fault)) return false;
    if (!check_slot("pose", m->slot, fault)) return false;
    if (!pose_is_near(m->pose.position))
        return fault_set(fault, "pose: position must be finite and within 1e9 m");
    if (!(length > 1e-6 && length < 1e6))
        return fault_set(fault, "pose: orientation must be a quaternion of length near 1");
    if (m->verb > POSE_FREEZE)
        return fault_set(fault, "pose: verb %d: 0 follow, 1 carry, 2 reset or 3 freeze", m->verb);
    return true;
}

size_t pose_encode(uint8_t* bytes, size_t capacity, const PoseMessage* message)
{
    if (capacity < POSE_BYTES || !check_pose(message, NULL)) return 0;
    Vec3d p = message->pose.position;
    Quat q = quat_normalise(message->pose.orientation);
    put64(&bytes, __hair_pose_t_hash_recursive(NULL));
    put64(&bytes, (uint64_t)message->utime);
    put_double(&bytes, p.x);
    put_double(&bytes, p.y);
    put_double(&bytes, p.z);
    put_double(&bytes, q.x);
    put_double(&bytes, q.y);
    put_double(&bytes, q.z);
    put_double(&bytes, q.w);
    put32(&bytes, (uint32_t)message->segment);
    put16(&bytes, message->slot);
    put8(&bytes, message->verb);
    return POSE_BYTES;
}

bool pose_decode(PoseMessage* message, const uint8_t* bytes, size_t size, Fault* fault)
{
    uint64_t type = __hair_pose_t_hash_recursive(NULL);
    if (!take_start(&bytes, "pose", size, POSE_BYTES, type, fault)) return false;
    PoseMessage m;
    m.utime = (int64_t)take64(&bytes);
    m.pose.position.x = take_double(&bytes);
    m.pose.position.y = take_double(&bytes);
    m.pose.position.z = take_double(&bytes);
    m.pose.orientation.x = take_double(&bytes);
    m.pose.orientation.y = take_double(&bytes);
    m.pose.orientation.z = take_double(&bytes);
    m.pose.orientation.w = take_double(&bytes);
    m.segment = (int32_t)take32(&bytes);
    m.slot = take16(&bytes);
    m.verb = take8(&bytes);
    if (!check_pose(&m, fault)) return false;
    m.pose.orientation = quat_normalise(m.pose.orientation);
    *message = m;
    return true;
}

// Character -------------------------------------------------------------------------------------

static bool check_character(const CharacterMessage* m, Fault* fault)
{
    if (!check_time("character", "utime", m->utime, fault)) return false;
    if (!check_slot("character", m->slot, fault)) return false;
    if (m->verb != CHARACTER_ADD && m->verb != CHARACTER_REMOVE)
        return fault_set(fault, "character: verb %d: 1 add or 2 remove", m->verb);
    return true;
}

size_t character_encode(uint8_t* bytes, size_t capacity, const CharacterMessage* message)
{
    if (capacity < CHARACTER_BYTES || !check_character(message, NULL) ||
        !is_text(message->style, sizeof message->style))
        return 0;
    put64(&bytes, __hair_character_t_hash_recursive(NULL));
    put64(&bytes, (uint64_t)message->utime);
    put16(&bytes, message->slot);
    put8(&bytes, message->verb);
    put_text(&bytes, message->style, sizeof message->style);
    return CHARACTER_BYTES;
}

bool character_decode(CharacterMessage* message, const uint8_t* bytes, size_t size, Fault* fault)
{
    uint64_t type = __hair_character_t_hash_recursive(NULL);
    if (!take_start(&bytes, "character", size, CHARACTER_BYTES, type, fault)) return false;
    CharacterMessage m;
    m.utime = (int64_t)take64(&bytes);
    m.slot = take16(&bytes);
    m.verb = take8(&bytes);
    if (!take_text(&bytes, m.style, sizeof m.style))
        return fault_set(fault, "character: style: printable, under %d bytes",
                         HAIRSTYLE_NAME_BYTES);
    if (!check_character(&m, fault)) return false;
    *message = m;
    return true;
}

// Wind ------------------------------------------------------------------------------------------

static bool check_wind(const WindMessage* m, Fault* fault)
{
    return check_time("wind", "utime", m->utime, fault) &&
           check_slots("wind", m->first_slot, m->slot_count, fault) &&
           check_range("wind", "velocity", (double)m->velocity.x, -200, 200, fault) &&
           check_range("wind", "velocity", (double)m->velocity.y, -200, 200, fault) &&
           check_range("wind", "velocity", (double)m->velocity.z, -200, 200, fault) &&
           check_range("wind", "gust", (double)m->gust, 0, 4, fault) &&
           check_range("wind", "gust_hz", (double)m->gust_hz, 0, 100, fault);
}

size_t wind_encode(uint8_t* bytes, size_t capacity, const WindMessage* message)
{
    if (capacity < WIND_BYTES || !check_wind(message, NULL)) return 0;
    put64(&bytes, __hair_wind_t_hash_recursive(NULL));
    put64(&bytes, (uint64_t)message->utime);
    put16(&bytes, message->first_slot);
    put16(&bytes, message->slot_count);
    put_float(&bytes, message->velocity.x);
    put_float(&bytes, message->velocity.y);
    put_float(&bytes, message->velocity.z);
    put_float(&bytes, message->gust);
    put_float(&bytes, message->gust_hz);
    return WIND_BYTES;
}

bool wind_decode(WindMessage* message, const uint8_t* bytes, size_t size, Fault* fault)
{
    uint64_t type = __hair_wind_t_hash_recursive(NULL);
    if (!take_start(&bytes, "wind", size, WIND_BYTES, type, fault)) return false;
    WindMessage m;
    m.utime = (int64_t)take64(&bytes);
    m.first_slot = take16(&bytes);
    m.slot_count = take16(&bytes);
    m.velocity.x = take_float(&bytes);
    m.velocity.y = take_float(&bytes);
    m.velocity.z = take_float(&bytes);
    m.gust = take_float(&bytes);
    m.gust_hz = take_float(&bytes);
    if (!check_wind(&m, fault)) return false;
    *message = m;
    return true;
}

// Tuning ----------------------------------------------------------------------------------------

static bool check_tuning(const TuningMessage* m, Fault* fault)
{
    if (m->set == 0 || m->set > TUNING_EVERY)
        return fault_set(fault, "tuning: set is %d: bits for 1 to 6 fields, 1 to %d", m->set,
                         TUNING_EVERY);
    return check_time("tuning", "utime", m->utime, fault) &&
           check_slots("tuning", m->first_slot, m->slot_count, fault) &&
           check_range("tuning", "stiffness_s2", (double)m->stiffness_s2, 0, 1e6, fault) &&
           check_range("tuning", "damping_per_s", (double)m->damping_per_s, 0, 1e4, fault) &&
           check_range("tuning", "gravity_m_s2", (double)m->gravity_m_s2, -1000, 1000, fault) &&
           check_range("tuning", "drag_per_s", (double)m->drag_per_s, 0, 1e4, fault) &&
           check_range("tuning", "iterations", m->iterations, 0, 64, fault) &&
           check_range("tuning", "pearl_radius_m", (double)m->pearl_radius_m, 0, 1, fault);
}

size_t tuning_encode(uint8_t* bytes, size_t capacity, const TuningMessage* message)
{
    if (capacity < TUNING_BYTES || !check_tuning(message, NULL)) return 0;
    put64(&bytes, __hair_tuning_t_hash_recursive(NULL));
    put64(&bytes, (uint64_t)message->utime);
    put16(&bytes, message->first_slot);
    put16(&bytes, message->slot_count);
    put8(&bytes, message->set);
    put_float(&bytes, message->stiffness_s2);
    put_float(&bytes, message->damping_per_s);
    put_float(&bytes, message->gravity_m_s2);
    put_float(&bytes, message->drag_per_s);
    put32(&bytes, (uint32_t)message->iterations);
    put_float(&bytes, message->pearl_radius_m);
    return TUNING_BYTES;
}

bool tuning_decode(TuningMessage* message, const uint8_t* bytes, size_t size, Fault* fault)
{
    uint64_t type = __hair_tuning_t_hash_recursive(NULL);
    if (!take_start(&bytes, "tuning", size, TUNING_BYTES, type, fault)) return false;
    TuningMessage m;
    m.utime = (int64_t)take64(&bytes);
    m.first_slot = take16(&bytes);
    m.slot_count = take16(&bytes);
    m.set = take8(&bytes);
    m.stiffness_s2 = take_float(&bytes);
    m.damping_per_s = take_float(&bytes);
    m.gravity_m_s2 = take_float(&bytes);
    m.drag_per_s = take_float(&bytes);
    m.iterations = (int32_t)take32(&bytes);
    m.pearl_radius_m = take_float(&bytes);
    if (!check_tuning(&m, fault)) return false;
    *message = m;
    return true;
}

// Request ---------------------------------------------------------------------------------------

static bool check_request(const RequestMessage* m, Fault* fault)
{
    if (!check_time("request", "utime", m->utime, fault)) return false;
    if (!check_slot("request", m->slot, fault)) return false;
    if (m->lane >= STYLE_LANES)
        return fault_set(fault, "request: lane %d: 0 fast or 1 bulk", m->lane);
    return true;
}

size_t request_encode(uint8_t* bytes, size_t capacity, const RequestMessage* message)
{
    if (capacity < REQUEST_BYTES || !check_request(message, NULL)) return 0;
    put64(&bytes, __hair_request_t_hash_recursive(NULL));
    put64(&bytes, (uint64_t)message->utime);
    put64(&bytes, message->style_hash);
    put16(&bytes, message->slot);
    put8(&bytes, message->lane);
    memcpy(bytes, message->missing, sizeof message->missing);
    return REQUEST_BYTES;
}

bool request_decode(RequestMessage* message, const uint8_t* bytes, size_t size, Fault* fault)
{
    uint64_t type = __hair_request_t_hash_recursive(NULL);
    if (!take_start(&bytes, "request", size, REQUEST_BYTES, type, fault)) return false;
    RequestMessage m;
    m.utime = (int64_t)take64(&bytes);
    m.style_hash = take64(&bytes);
    m.slot = take16(&bytes);
    m.lane = take8(&bytes);
    memcpy(m.missing, bytes, sizeof m.missing);
    if (!check_request(&m, fault)) return false;
    *message = m;
    return true;
}

// Status ----------------------------------------------------------------------------------------

static bool check_status(const StatusMessage* m, Fault* fault)
{
    if (!check_time("status", "utime", m->utime, fault) ||
        !check_time("status", "epoch", m->epoch, fault) ||
        !check_time("status", "tick", m->tick, fault))
        return false;
    if (!(m->rate_hz >= 0.0f && m->rate_hz < 1e6f))
        return fault_set(fault, "status: rate_hz must be 0 to 1e6");
    if (!(m->step_us >= 0.0f && m->step_us < 1e12f))
        return fault_set(fault, "status: step_us must be 0 to 1e12");
    if (m->characters < 0 || m->characters > CHANNEL_MAX_SLOTS)
        return fault_set(fault, "status: %d characters: 0 to %d", m->characters, CHANNEL_MAX_SLOTS);
    if (m->strands < 0 || m->overruns < 0 || m->clamped < 0 || m->rejected < 0 ||
        m->sent_messages < 0 || m->sent_bytes < 0 || m->quarantined < 0 || m->jumps < 0)
        return fault_set(fault, "status: a count is negative");
    return true;
}

size_t status_encode(uint8_t* bytes, size_t capacity, const StatusMessage* message)
{
    if (capacity < STATUS_BYTES || !check_status(message, NULL)) return 0;
    put64(&bytes, __hair_status_t_hash_recursive(NULL));
    put64(&bytes, (uint64_t)message->utime);
    put64(&bytes, (uint64_t)message->epoch);
    put32(&bytes, (uint32_t)message->tick);
    put_float(&bytes, message->rate_hz);
    put_float(&bytes, message->step_us);
    put32(&bytes, (uint32_t)message->characters);
    put32(&bytes, (uint32_t)message->strands);
    put64(&bytes, (uint64_t)message->overruns);
    put64(&bytes, (uint64_t)message->clamped);
    put64(&bytes, (uint64_t)message->rejected);
    put64(&bytes, (uint64_t)message->sent_messages);
    put64(&bytes, (uint64_t)message->sent_bytes);
    put64(&bytes, (uint64_t)message->quarantined);
    put64(&bytes, (uint64_t)message->jumps);
    return STATUS_BYTES;
}

bool status_decode(StatusMessage* message, const uint8_t* bytes, size_t size, Fault* fault)
{
    uint64_t type = __hair_status_t_hash_recursive(NULL);
    if (!take_start(&bytes, "status", size, STATUS_BYTES, type, fault)) return false;
    StatusMessage m;
    m.utime = (int64_t)take64(&bytes);
    m.epoch = (int64_t)take64(&bytes);
    m.tick = (int32_t)take32(&bytes);
    m.rate_hz = take_float(&bytes);
    m.step_us = take_float(&bytes);
    m.characters = (int32_t)take32(&bytes);
    m.strands = (int32_t)take32(&bytes);
    m.overruns = (int64_t)take64(&bytes);
    m.clamped = (int64_t)take64(&bytes);
    m.rejected = (int64_t)take64(&bytes);
    m.sent_messages = (int64_t)take64(&bytes);
    m.sent_bytes = (int64_t)take64(&bytes);
    m.quarantined = (int64_t)take64(&bytes);
    m.jumps = (int64_t)take64(&bytes);
    if (!check_status(&m, fault)) return false;
    *message = m;
    return true;
}

// Applied ---------------------------------------------------------------------------------------

static bool check_applied(const AppliedMessage* m, Fault* fault)
{
    if (!check_time("applied", "utime", m->utime, fault) ||
        !check_time("applied", "epoch", m->epoch, fault) ||
        !check_time("applied", "tick", m->tick, fault))
        return false;
    if (m->channel[0] == '\0' || !is_text(m->channel, sizeof m->channel))
        return fault_set(fault, "applied: channel: printable, 1 to %d bytes", CHANNEL_BYTES - 1);
    if (m->size < 1 || m->size > CONTROL_MAX_BYTES - APPLIED_HEADER_BYTES)
        return fault_set(fault, "applied: a payload of %d bytes: 1 to %d", m->size,
                         CONTROL_MAX_BYTES - APPLIED_HEADER_BYTES);
    return true;
}

size_t applied_encode(uint8_t* bytes, size_t capacity, const AppliedMessage* message)
{
    if (!check_applied(message, NULL)) return 0;
    size_t size = APPLIED_HEADER_BYTES + (size_t)message->size;
    if (size > capacity) return 0;
    put64(&bytes, __hair_applied_t_hash_recursive(NULL));
    put64(&bytes, (uint64_t)message->utime);
    put64(&bytes, (uint64_t)message->epoch);
    put32(&bytes, (uint32_t)message->tick);
    put_text(&bytes, message->channel, sizeof message->channel);
    put32(&bytes, (uint32_t)message->size);
    memcpy(bytes, message->payload, (size_t)message->size);
    return size;
}

bool applied_decode(AppliedMessage* message, const uint8_t* bytes, size_t size, Fault* fault)
{
    uint64_t type = __hair_applied_t_hash_recursive(NULL);
    if (size <= APPLIED_HEADER_BYTES || size > CONTROL_MAX_BYTES)
        return fault_set(fault, "applied: %zu bytes: %d to %d", size, APPLIED_HEADER_BYTES + 1,
                         CONTROL_MAX_BYTES);
    if (!take_start(&bytes, "applied", size, size, type, fault)) return false;
    AppliedMessage m;
    m.utime = (int64_t)take64(&bytes);
    m.epoch = (int64_t)take64(&bytes);
    m.tick = (int32_t)take32(&bytes);
    if (!take_text(&bytes, m.channel, sizeof m.channel))
        return fault_set(fault, "applied: channel: printable, under %d bytes", CHANNEL_BYTES);
    m.size = (int32_t)take32(&bytes);
    m.payload = bytes;
    if (!check_applied(&m, fault)) return false;
    if ((size_t)m.size != size - APPLIED_HEADER_BYTES)
        return fault_set(fault, "applied: a payload of %zu bytes where %d are due",
                         size - APPLIED_HEADER_BYTES, m.size);
    *message = m;
    return true;
}
