// The inside of a daemon, for the files that are it: daemon.c, daemon_characters.c,
// daemon_inputs.c and daemon_publish.c. Everybody else has daemon.h.
#pragma once

#include "messages/channels.h"
#include "server/character.h"
#include "server/complaints.h"
#include "server/daemon.h"
#include "server/inputs.h"
#include "server/publish.h"
#include "server/scene.h"

typedef struct Style {
    Hairstyle* hair;
    PublishStyle publish;
} Style;

struct Daemon {
    DaemonOptions options;
    SimDefinition sim; // without strands
    const Motion* motion;
    int style_count;
    Style styles[SCENE_MAX_STYLES];
    Character* characters[CHANNEL_MAX_SLOTS]; // by slot; NULL: nobody is there
    int order[CHANNEL_MAX_SLOTS];             // numbers of the slots in use, rising
    int used;
    int32_t segments[CHANNEL_MAX_SLOTS]; // outlive a character that leaves and comes back
    int64_t orphans[CHANNEL_MAX_SLOTS];  // 1 + step of the first pose without a character; 0: none
    Inputs inputs;
    Publisher publisher;
    Complaints complaints;
    int64_t steps;      // ticks done since the start; step n simulates (n - 1) / rate to n / rate
    int64_t first_step; // of this epoch
    int64_t utime;      // of the last tick
    int64_t higher_epoch;
    bool has_yielded;
    int64_t since_status_us;
    int64_t step_us, step_count;
    double mean_step_us;
    int64_t overruns, quarantined, jumps;
};
