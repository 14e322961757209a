#include "client/playback.h"

#include "client/assemble.h"
#include "messages/channels.h"
#include "messages/frame.h"
#include "messages/style.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_EPOCHS 64 // listed; a log that holds more is told so

// Where one guides block of the slot stands in the file.
typedef struct BlockAt {
    int64_t offset, utime;
    uint64_t style_hash;
    int32_t tick;
} BlockAt;

typedef struct PartAt {
    int64_t offset;
    uint64_t style_hash;
    uint8_t lane;
} PartAt;

typedef struct EpochRange {
    int64_t epoch;
    int32_t first, last;
} EpochRange;

struct Playback {
    char name[128]; // of the file, for faults
    LogReader* reader;
    int slot;
    int64_t epoch; // 0 while any will do
    char channel[CHANNEL_BYTES];
    BlockAt* blocks; // by tick, then by place in the file
    size_t block_count, block_capacity;
    PartAt* parts;
    size_t part_count, part_capacity;
    uint64_t worn[RECEIVE_MAX_STYLES]; // styles that the slot's blocks name
    int worn_count;
    EpochRange epochs[MAX_EPOCHS];
    int epoch_count;
    bool more_epochs;
    uint8_t slots[CHANNEL_MAX_SLOTS / 8]; // slots with sound blocks
    int32_t fed_tick;                     // -1: none
};

// Grows an array to hold one more. The index is bounded by the log: a block costs the file 100
// bytes or more and the index 32.
static bool reserve(void** array, size_t* capacity, size_t count, size_t entry_bytes)
{
    if (count < *capacity) return true;
    size_t grown = *capacity < 1024 ? 1024 : *capacity * 2;
    void* larger = realloc(*array, grown * entry_bytes);
    if (larger == NULL) return false;
    *array = larger;
    *capacity = grown;
    return true;
}

static void note_epoch(Playback* playback, const FrameHeader* header)
{
    int i = 0;
    while (i < playback->epoch_count && playback->epochs[i].epoch != header->epoch)
        ++i;
    if (i == MAX_EPOCHS) {
        playback->more_epochs = true;
        return;
    }
    EpochRange* range = &playback->epochs[i];
    if (i == playback->epoch_count) {
        ++playback->epoch_count;
        *range = (EpochRange){header->epoch, header->tick, header->tick};
    }
    if (header->tick < range->first) range->first = header->tick;
    if (header->tick > range->last) range->last = header->tick;
}

static void note_style(Playback* playback, uint64_t hash)
{
    for (int i = 0; i < playback->worn_count; ++i)
        if (playback->worn[i] == hash) return;
    if (playback->worn_count < RECEIVE_MAX_STYLES) playback->worn[playback->worn_count++] = hash;
}

static bool index_block(Playback* playback, const LogEvent* event)
{
    FrameHeader header;
    const uint8_t *positions, *tangents;
    if (frame_decode(&header, &positions, &tangents, event->data, event->size) != FRAME_OK)
        return true;
    if (header.slot >= CHANNEL_MAX_SLOTS || header.tick < 0) return true;
    playback->slots[header.slot / 8] |= (uint8_t)(1u << (header.slot % 8));
    if (strcmp(event->channel, playback->channel) != 0 || header.slot != playback->slot)
        return true;
    note_epoch(playback, &header);
    if (playback->epoch != 0 && header.epoch != playback->epoch) return true;
    note_style(playback, header.style_hash);
    if (!reserve((void**)&playback->blocks, &playback->block_capacity, playback->block_count,
                 sizeof *playback->blocks))
        return false;
    playback->blocks[playback->block_count++] =
        (BlockAt){event->offset, event->utime, header.style_hash, header.tick};
    return true;
}

static bool index_part(Playback* playback, const LogEvent* event)
{
    StylePart part;
    if (!style_part_decode(&part, event->data, event->size, NULL)) return true;
    if (!reserve((void**)&playback->parts, &playback->part_capacity, playback->part_count,
                 sizeof *playback->parts))
        return false;
    playback->parts[playback->part_count++] = (PartAt){event->offset, part.style_hash, part.lane};
    return true;
}

static bool build_index(Playback* playback, Fault* fault)
{
    LogEvent event;
    while (log_next(playback->reader, &event)) {
        bool room = true;
        if (strncmp(event.channel, CHANNEL_GUIDES_PREFIX, sizeof CHANNEL_GUIDES_PREFIX - 1) == 0)
            room = index_block(playback, &event);
        else if (strcmp(event.channel, CHANNEL_STYLE) == 0)
            room = index_part(playback, &event);
        if (!room) return fault_set(fault, "%s: no memory for its index", playback->name);
    }
    return true;
}

static int compare_blocks(const void* a, const void* b)
{
    const BlockAt *left = a, *right = b;
    if (left->tick != right->tick) return left->tick < right->tick ? -1 : 1;
    return (left->offset > right->offset) - (left->offset < right->offset);
}

// A fault's text built up piece by piece; what does not fit is cut.
static void append(Fault* fault, const char* text)
{
    size_t used = strlen(fault->text);
    snprintf(fault->text + used, sizeof fault->text - used, "%s", text);
}

static bool fault_epochs(const Playback* playback, int64_t wanted, Fault* fault)
{
    if (fault == NULL) return false;
    if (wanted == 0)
        fault_set(fault,
                  "%s holds several epochs of slot %d; name one with --epoch:", playback->name,
                  playback->slot);
    else
        fault_set(fault, "%s holds no epoch %lld of slot %d; it holds", playback->name,
                  (long long)wanted, playback->slot);
    for (int i = 0; i < playback->epoch_count; ++i) {
        const EpochRange* range = &playback->epochs[i];
        char text[80];
        snprintf(text, sizeof text, "%s %lld (ticks %d..%d)", i > 0 ? "," : "",
                 (long long)range->epoch, (int)range->first, (int)range->last);
        append(fault, text);
    }
    if (playback->more_epochs) append(fault, " and more");
    return false;
}

static bool fault_slots(const Playback* playback, Fault* fault)
{
    if (fault == NULL) return false;
    fault_set(fault, "%s holds no guides of slot %d; it holds", playback->name, playback->slot);
    int listed = 0;
    for (int slot = 0; slot < CHANNEL_MAX_SLOTS; ++slot) {
        if (!(playback->slots[slot / 8] >> (slot % 8) & 1)) continue;
        char text[16];
        snprintf(text, sizeof text, "%s %d", listed++ > 0 ? "," : " slots", slot);
        append(fault, text);
    }
    if (listed == 0) append(fault, " none at all");
    return false;
}

static bool check_index(Playback* playback, int64_t epoch, Fault* fault)
{
    if (playback->epoch_count == 0) return fault_slots(playback, fault);
    if (playback->block_count == 0 || (epoch == 0 && playback->epoch_count > 1))
        return fault_epochs(playback, epoch, fault);
    qsort(playback->blocks, playback->block_count, sizeof *playback->blocks, compare_blocks);
    return true;
}

Playback* playback_open(const char* path, int slot, int64_t epoch, Fault* fault)
{
    if (slot < 0 || slot >= CHANNEL_MAX_SLOTS) {
        fault_set(fault, "slot %d: slots are 0 to %d", slot, CHANNEL_MAX_SLOTS - 1);
        return NULL;
    }
    Playback* playback = calloc(1, sizeof *playback);
    if (playback == NULL) {
        fault_set(fault, "%s: no memory to index it", path);
        return NULL;
    }
    const char* slash = strrchr(path, '/');
    snprintf(playback->name, sizeof playback->name, "%s", slash != NULL ? slash + 1 : path);
    playback->slot = slot;
    playback->epoch = epoch;
    playback->fed_tick = -1;
    channel_guides(playback->channel, slot);
    playback->reader = log_open(path, fault);
    if (playback->reader != NULL && build_index(playback, fault) &&
        check_index(playback, epoch, fault))
        return playback;
    playback_close(playback);
    return NULL;
}

void playback_close(Playback* playback)
{
    if (playback == NULL) return;
    if (playback->reader != NULL) log_close(playback->reader);
    free(playback->blocks);
    free(playback->parts);
    free(playback);
}

int32_t playback_first_tick(const Playback* playback)
{
    return playback->blocks[0].tick;
}

int32_t playback_last_tick(const Playback* playback)
{
    return playback->blocks[playback->block_count - 1].tick;
}

// Index of the first block of `tick`, or block_count.
static size_t find_tick(const Playback* playback, int32_t tick)
{
    size_t low = 0, high = playback->block_count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (playback->blocks[middle].tick < tick)
            low = middle + 1;
        else
            high = middle;
    }
    bool found = low < playback->block_count && playback->blocks[low].tick == tick;
    return found ? low : playback->block_count;
}

int64_t playback_tick_utime(const Playback* playback, int32_t tick)
{
    size_t at = find_tick(playback, tick);
    return at < playback->block_count ? playback->blocks[at].utime : -1;
}

static bool read_event(Playback* playback, int64_t offset, LogEvent* event)
{
    log_seek(playback->reader, offset);
    return log_next(playback->reader, event) && event->offset == offset;
}

// Only styles that the slot wears, and a lane only until it is complete: an hour of recording holds
// each style's parts thousands of times.
static void feed_lane(Playback* playback, Receive* receive, uint64_t hash, int lane)
{
    for (size_t i = 0; i < playback->part_count; ++i) {
        const PartAt* part = &playback->parts[i];
        if (part->style_hash != hash || part->lane != lane) continue;
        int version = 0;
        bool complete = false;
        receive_style(receive, hash, &version, &complete);
        if (complete || (lane == STYLE_FAST && version > 0)) return;
        LogEvent event;
        if (read_event(playback, part->offset, &event))
            receive_message(receive, event.channel, event.data, event.size, event.utime);
    }
}

static bool check_style(Playback* playback, Receive* receive, uint64_t hash, Fault* fault)
{
    int version = 0;
    bool complete = false;
    receive_style(receive, hash, &version, &complete);
    if (complete) return true;
    return fault_set(fault,
                     "style %016llx of slot %d is %s in %s: record 2 s or more of a running daemon",
                     (unsigned long long)hash, playback->slot,
                     version > 0 ? "without its strands" : "missing or incomplete", playback->name);
}

bool playback_feed_styles(Playback* playback, Receive* receive, Fault* fault)
{
    bool fine = true;
    for (int i = 0; i < playback->worn_count; ++i) {
        uint64_t hash = playback->worn[i];
        for (int lane = 0; lane < STYLE_LANES; ++lane)
            feed_lane(playback, receive, hash, lane);
        fine = fine && check_style(playback, receive, hash, fault);
    }
    return fine;
}

static void mark_rows(bool rows[HAIRSTYLE_MAX_GUIDES], const LogEvent* event)
{
    FrameHeader header;
    const uint8_t *positions, *tangents;
    if (frame_decode(&header, &positions, &tangents, event->data, event->size) != FRAME_OK) return;
    int end = header.first_strand + header.strand_count;
    for (int row = header.first_strand; row < end && row < HAIRSTYLE_MAX_GUIDES; ++row)
        rows[row] = true;
}

// False where `receive` did not take it: a sound block may still contradict its style.
static bool feed_block(Receive* receive, const LogEvent* event)
{
    ReceiveCounters before = receive_counters(receive);
    receive_message(receive, event->channel, event->data, event->size, event->utime);
    ReceiveCounters after = receive_counters(receive);
    return after.rejected == before.rejected && after.late == before.late;
}

static bool check_rows(const Playback* playback, int32_t tick, const bool* rows, int guides,
                       Fault* fault)
{
    bool fine = true;
    for (int row = 0; row < guides; ++row) {
        if (rows[row]) continue;
        int last = row;
        while (last + 1 < guides && !rows[last + 1])
            ++last;
        char text[64];
        if (fine) fault_set(fault, "%s, tick %d: strands", playback->name, (int)tick);
        snprintf(text, sizeof text, last > row ? "%s %d-%d" : "%s %d", fine ? "" : ",", row, last);
        if (fault != NULL) append(fault, text);
        fine = false;
        row = last;
    }
    if (!fine && fault != NULL) append(fault, " are missing");
    return fine;
}

bool playback_feed_tick(Playback* playback, int32_t tick, Receive* receive, Fault* fault)
{
    size_t at = find_tick(playback, tick);
    if (at == playback->block_count)
        return fault_set(fault, "tick %d is not in %s (it holds %d..%d)", (int)tick, playback->name,
                         (int)playback_first_tick(playback), (int)playback_last_tick(playback));
    // A step to anywhere but the same or the next tick is a seek, not loss on the wire.
    int64_t step = (int64_t)tick - playback->fed_tick;
    if (step != 0 && step != 1) receive_restart(receive, playback->slot);
    playback->fed_tick = tick;
    bool rows[HAIRSTYLE_MAX_GUIDES] = {false};
    uint64_t hash = playback->blocks[at].style_hash;
    for (; at < playback->block_count && playback->blocks[at].tick == tick; ++at) {
        LogEvent event;
        if (!read_event(playback, playback->blocks[at].offset, &event)) continue;
        if (feed_block(receive, &event)) mark_rows(rows, &event);
    }
    const Hairstyle* style = receive_style(receive, hash, NULL, NULL);
    if (style == NULL)
        return fault_set(fault, "style %016llx of slot %d has not come: feed the styles first",
                         (unsigned long long)hash, playback->slot);
    return check_rows(playback, tick, rows, style->guide_count, fault);
}
