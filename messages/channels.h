// Channel names: a bounded set, because liblcm keeps every name it ever saw.
#pragma once

#include <stdio.h>

#define CHANNEL_MAX_SLOTS 1024
#define CHANNEL_BYTES     20

#define CHANNEL_GUIDES_PREFIX "HAIR_GUIDES_" // + slot, four digits
#define CHANNEL_GUIDES_REGEX  "HAIR_GUIDES_[0-9]{4}"
#define CHANNEL_STYLE         "HAIR_STYLE"
#define CHANNEL_POSE          "HAIR_POSE"
#define CHANNEL_TORSO         "HAIR_TORSO" // a pose_t too
#define CHANNEL_CHARACTER     "HAIR_CHARACTER"
#define CHANNEL_WIND          "HAIR_WIND"
#define CHANNEL_TUNING        "HAIR_TUNING"
#define CHANNEL_REQUEST       "HAIR_REQUEST"
#define CHANNEL_STATUS        "HAIR_STATUS"
#define CHANNEL_APPLIED       "HAIR_APPLIED"

static inline void channel_guides(char name[CHANNEL_BYTES], int slot)
{
    snprintf(name, CHANNEL_BYTES, CHANNEL_GUIDES_PREFIX "%04u", (unsigned)slot % 10000u);
}
