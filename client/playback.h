// A recorded log as a source: index first, then any tick, exactly.
#pragma once

#include "client/receive.h"
#include "messages/log.h"

typedef struct Playback Playback;

// Reads the whole log once and indexes `slot` of `epoch` (0: the only one; several are a fault that
// lists them). NULL with a fault.
Playback* playback_open(const char* path, int slot, int64_t epoch, Fault* fault);
void playback_close(Playback* playback);

int32_t playback_first_tick(const Playback* playback);
int32_t playback_last_tick(const Playback* playback);
// Log time of the first block of a tick, us; -1 where the log has no such tick.
int64_t playback_tick_utime(const Playback* playback, int32_t tick);

// Feeds the parts of every style that the slot wears, wherever they stand in the log, to `receive`,
// up to the first complete copy. False with a fault where a style is missing or incomplete. Call it
// before feeding ticks (of several playbacks: of all): Receive begins no unworn style after that.
bool playback_feed_styles(Playback* playback, Receive* receive, Fault* fault);

// Feeds the blocks of one tick; any order of ticks will do: all but the same or the next tick is a
// seek, before which what `receive` holds of the slot is forgotten. False with a fault that names
// what is missing (tick, or rows a-b).
bool playback_feed_tick(Playback* playback, int32_t tick, Receive* receive, Fault* fault);
