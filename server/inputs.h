// Messages waiting for the next tick boundary: bounded, in order of arrival.
#pragma once

#include "messages/control.h"

#define INPUTS_MAX       4096 // two poses of head and torso for each slot, in a tick
#define INPUTS_MAX_BYTES 256  // of a queued message; inputs are smaller

typedef enum InputKind {
    INPUT_POSE,
    INPUT_TORSO, // a pose too
    INPUT_CHARACTER,
    INPUT_WIND,
    INPUT_TUNING,
    INPUT_KINDS
} InputKind;

typedef struct Input {
    InputKind kind;
    union {
        PoseMessage pose;
        CharacterMessage character;
        WindMessage wind;
        TuningMessage tuning;
    };
    size_t size;
    uint8_t bytes[INPUTS_MAX_BYTES]; // as they came: what applied_t repeats
} Input;

typedef struct Inputs {
    Input queue[INPUTS_MAX];
    int count;
} Inputs;

// False where the queue is full. A pose then takes the place of the newest waiting one of the same
// head or torso: its latest place matters more than its way there.
bool inputs_push(Inputs* inputs, const Input* input);
