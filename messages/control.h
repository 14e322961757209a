// The small messages of fixed size <-> bytes: pose, character, wind, tuning, request, status,
// applied.
//
// Each struct is the decoded form of the `.lcm` type of the same name (messages/*.lcm); the payload
// of `applied_t` is read in place. `*_decode` checks the size before anything else, then every
// field, and returns false with a fault that names the field; the output is then untouched.
// `*_encode` returns the size or 0. Neither allocates.
#pragma once

#include "messages/channels.h"
#include "messages/hairstyle.h"
#include "messages/style.h"

#define CONTROL_MAX_BYTES 1400

typedef enum PoseVerb { POSE_FOLLOW = 0, POSE_CARRY = 1, POSE_RESET = 2, POSE_FREEZE = 3 } PoseVerb;

// Where a head is. The verb says how to enter the segment: it is obeyed when `segment` rises, so
// every later message of the segment repeats it and losing one loses nothing. Freeze is a level.
typedef struct PoseMessage {
    int64_t utime; // the sender's own clock, us; only differences are used
    Pose pose;     // orientation is normalised by decode
    int32_t segment;
    uint16_t slot;
    uint8_t verb; // PoseVerb
} PoseMessage;

typedef enum CharacterVerb { CHARACTER_ADD = 1, CHARACTER_REMOVE = 2 } CharacterVerb;

typedef struct CharacterMessage {
    int64_t utime;
    uint16_t slot;
    uint8_t verb;                     // CharacterVerb
    char style[HAIRSTYLE_NAME_BYTES]; // of the daemon's styles; empty: its first
} CharacterMessage;

// How the air moves about the heads of slots [first, first + count) until the next such message:
// velocity (1 + gust sin(2 pi gust_hz t)), t the simulation's time.
typedef struct WindMessage {
    int64_t utime;
    uint16_t first_slot, slot_count;
    Vec3 velocity; // world axes, m/s
    float gust;    // share of the velocity
    float gust_hz;
} WindMessage;

// Bits of TuningMessage.set.
enum {
    TUNING_STIFFNESS = 1,
    TUNING_DAMPING = 2,
    TUNING_GRAVITY = 4,
    TUNING_DRAG = 8,
    TUNING_ITERATIONS = 16,
    TUNING_PEARL_RADIUS = 32,
    TUNING_EVERY = 63
};

// How the hair of slots [first, first + count) moves from now on. A field whose bit is not set is
// left as it is, but must be in range all the same.
typedef struct TuningMessage {
    int64_t utime;
    uint16_t first_slot, slot_count;
    uint8_t set;
    float stiffness_s2, damping_per_s, gravity_m_s2, drag_per_s;
    int32_t iterations;
    float pearl_radius_m;
} TuningMessage;

// "Send me these parts": a style by hash, or, with hash 0, whatever slot `slot` wears.
typedef struct RequestMessage {
    int64_t utime;
    uint64_t style_hash;
    uint16_t slot;
    uint8_t lane;
    uint8_t missing[STYLE_MAX_PARTS / 8]; // bit p of byte p / 8: part p is missing
} RequestMessage;

typedef struct StatusMessage {
    int64_t utime, epoch;
    int32_t tick;
    float rate_hz;
    float step_us; // mean of one tick's simulation over the last second
    int32_t characters, strands;
    int64_t overruns; // ticks dropped since the start
    int64_t clamped;  // coordinates clamped to the box since the start
    int64_t rejected; // messages refused since the start
    int64_t sent_messages, sent_bytes;
    int64_t quarantined; // strands put back to rest since the start: not finite or 1 km away
    int64_t jumps;       // of heads that did not raise their segment, since the start
} StatusMessage;

// An input as it was consumed at a tick boundary: what re-simulation replays.
typedef struct AppliedMessage {
    int64_t utime, epoch;
    int32_t tick;
    char channel[CHANNEL_BYTES];
    int32_t size;
    const uint8_t* payload; // into the caller's bytes
} AppliedMessage;

size_t pose_encode(uint8_t* bytes, size_t capacity, const PoseMessage* message);
bool pose_decode(PoseMessage* message, const uint8_t* bytes, size_t size, Fault* fault);
size_t character_encode(uint8_t* bytes, size_t capacity, const CharacterMessage* message);
bool character_decode(CharacterMessage* message, const uint8_t* bytes, size_t size, Fault* fault);
size_t wind_encode(uint8_t* bytes, size_t capacity, const WindMessage* message);
bool wind_decode(WindMessage* message, const uint8_t* bytes, size_t size, Fault* fault);
size_t tuning_encode(uint8_t* bytes, size_t capacity, const TuningMessage* message);
bool tuning_decode(TuningMessage* message, const uint8_t* bytes, size_t size, Fault* fault);
size_t request_encode(uint8_t* bytes, size_t capacity, const RequestMessage* message);
bool request_decode(RequestMessage* message, const uint8_t* bytes, size_t size, Fault* fault);
size_t status_encode(uint8_t* bytes, size_t capacity, const StatusMessage* message);
bool status_decode(StatusMessage* message, const uint8_t* bytes, size_t size, Fault* fault);
size_t applied_encode(uint8_t* bytes, size_t capacity, const AppliedMessage* message);
bool applied_decode(AppliedMessage* message, const uint8_t* bytes, size_t size, Fault* fault);
