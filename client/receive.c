#include "client/receive.h"

#include "client/assemble.h"

#include <assert.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

// Payloads are little-endian and copied as they are into planes of 16-bit numbers.
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "planes are copied without swapping");
static_assert(RECEIVE_MAX_STYLES == ASSEMBLE_MAX_STYLES, "one bound, named twice");

#define RING      2 // ticks that stay resident
#define NEVER_US  (-((int64_t)1 << 61))
#define LATEST_US ((int64_t)1 << 61)
#define EPOCH_SILENCE_US                                                                           \
    2000000                  // a lower epoch is believed after this much silence of a higher one
#define BACKWARD_US  500000  // a jump back is believed after this long without a step forward
#define HEARD_US     2000000 // styles are asked for while guides are this fresh
#define GAP_TICKS    600     // of a gap, that are counted as lost
#define PLANE_VALUES ((size_t)HAIRSTYLE_MAX_GUIDES * HAIRSTYLE_MAX_NODES * 3)

// Latest-wins planes of one slot.
typedef struct Slot {
    int number;
    bool any;
    int64_t epoch;
    int64_t heard_us;          // of the last sound block of `epoch`
    int64_t backward_since_us; // NEVER_US unless ticks from before the ring keep coming
    uint64_t style_hash;
    int32_t tick;
    int64_t closed; // ticks up to here are not, or no longer, watched for gaps
    int guides, nodes;
    int rows_per_message; // of the largest block seen
    bool told_two_daemons;
    GuidesLayer layer[RING];
    int32_t row_tick[RING][HAIRSTYLE_MAX_GUIDES];
    uint16_t* positions[RING];
    int16_t* tangents[RING];
    uint32_t generation;
    uint64_t change;
} Slot;

// A block that frame_decode let through.
typedef struct Block {
    FrameHeader header;
    const uint8_t* positions;
    const uint8_t* tangents;
    int64_t now_us;
} Block;

// `mutex` guards slots and counters; Assemble has its own locks, taken inside it at most.
struct Receive {
    pthread_mutex_t mutex;
    Notice notice;
    Assemble* assemble;
    ReceiveCounters counters;
    unsigned told_faults; // bit FrameFault: that kind of damage was told
    bool told_style;
    int slot_count;
    int* numbers;
    Slot* slots;
    int16_t index[CHANNEL_MAX_SLOTS]; // slot number -> index in slots, -1: not kept
};

static bool planes_create(uint16_t* positions[RING], int16_t* tangents[RING])
{
    bool all = true;
    for (int i = 0; i < RING; ++i) {
        positions[i] = calloc(PLANE_VALUES, sizeof *positions[i]);
        tangents[i] = calloc(PLANE_VALUES, sizeof *tangents[i]);
        all = all && positions[i] != NULL && tangents[i] != NULL;
    }
    return all;
}

static void planes_free(uint16_t* positions[RING], int16_t* tangents[RING])
{
    for (int i = 0; i < RING; ++i) {
        free(positions[i]);
        free(tangents[i]);
        positions[i] = NULL;
        tangents[i] = NULL;
    }
}

static void forget_rows(int32_t row_tick[RING][HAIRSTYLE_MAX_GUIDES], GuidesLayer layer[RING])
{
    for (int i = 0; i < RING; ++i) {
        layer[i] = (GuidesLayer){.tick = -1, .pose = pose_identity()};
        for (int row = 0; row < HAIRSTYLE_MAX_GUIDES; ++row)
            row_tick[i][row] = -1;
    }
}

bool guides_view_init(GuidesView* view, int slot, Fault* fault)
{
    *view = (GuidesView){.slot = slot, .tick = -1, .pose = pose_identity()};
    forget_rows(view->row_tick, view->layer);
    if (planes_create(view->positions, view->tangents)) return true;
    guides_view_free(view);
    return fault_set(fault, "no memory for the guides of slot %d", slot);
}

void guides_view_free(GuidesView* view)
{
    planes_free(view->positions, view->tangents);
}

static void slot_flush(Slot* slot)
{
    slot->any = false;
    slot->backward_since_us = NEVER_US;
    slot->tick = -1;
    slot->guides = slot->nodes = slot->rows_per_message = 0;
    ++slot->generation;
    ++slot->change;
    forget_rows(slot->row_tick, slot->layer);
}

static bool create_slots(Receive* receive, const int* slots, int slot_count, Fault* fault)
{
    receive->slots = calloc((size_t)slot_count, sizeof *receive->slots);
    receive->numbers = calloc((size_t)slot_count, sizeof *receive->numbers);
    if (receive->slots == NULL || receive->numbers == NULL)
        return fault_set(fault, "no memory for %d slots", slot_count);
    for (int i = 0; i < slot_count; ++i) {
        int number = slots[i];
        if (number < 0 || number >= CHANNEL_MAX_SLOTS)
            return fault_set(fault, "slot %d: slots are 0 to %d", number, CHANNEL_MAX_SLOTS - 1);
        if (receive->index[number] >= 0) continue;
        int at = receive->slot_count++;
        receive->index[number] = (int16_t)at;
        receive->numbers[at] = receive->slots[at].number = number;
        slot_flush(&receive->slots[at]);
        if (!planes_create(receive->slots[at].positions, receive->slots[at].tangents))
            return fault_set(fault, "no memory for %d slots of 768 KiB", slot_count);
    }
    return true;
}

Receive* receive_create(const int* slots, int slot_count, Notice notice, Fault* fault)
{
    if (slot_count < 1 || slot_count > CHANNEL_MAX_SLOTS) {
        fault_set(fault, "%d slots to watch: 1 to %d can be", slot_count, CHANNEL_MAX_SLOTS);
        return NULL;
    }
    Receive* receive = calloc(1, sizeof *receive);
    if (receive == NULL) {
        fault_set(fault, "no memory to receive into");
        return NULL;
    }
    pthread_mutex_init(&receive->mutex, NULL);
    receive->notice = notice;
    for (int i = 0; i < CHANNEL_MAX_SLOTS; ++i)
        receive->index[i] = -1;
    receive->assemble = assemble_create();
    bool fine = create_slots(receive, slots, slot_count, fault);
    if (fine && receive->assemble == NULL) fine = fault_set(fault, "no memory for styles");
    if (fine) return receive;
    receive_destroy(receive);
    return NULL;
}

void receive_destroy(Receive* receive)
{
    if (receive == NULL) return;
    for (int i = 0; i < receive->slot_count; ++i)
        planes_free(receive->slots[i].positions, receive->slots[i].tangents);
    assemble_destroy(receive->assemble);
    free(receive->slots);
    free(receive->numbers);
    pthread_mutex_destroy(&receive->mutex);
    free(receive);
}

int receive_slots(const Receive* receive, const int** slots)
{
    *slots = receive->numbers;
    return receive->slot_count;
}

static bool holds_block(const Slot* slot, int32_t tick, int first, int end)
{
    for (int row = first; row < end; ++row)
        if (slot->row_tick[tick & 1][row] != tick) return false;
    return true;
}

static int missing_messages(const Slot* slot, int32_t tick)
{
    int missing = 0;
    for (int first = 0; first < slot->guides; first += slot->rows_per_message) {
        int end = first + slot->rows_per_message;
        if (end > slot->guides) end = slot->guides;
        missing += !holds_block(slot, tick, first, end);
    }
    return missing;
}

// Counts what the ticks that leave the ring lack, now that tick `newest` has come (receive.h).
static void slot_close(Slot* slot, int64_t newest, ReceiveCounters* counters)
{
    int64_t last = newest - RING;
    for (int64_t tick = slot->closed + 1; tick <= last && tick <= slot->tick; ++tick)
        counters->lost += missing_messages(slot, (int32_t)tick);
    int64_t begun = slot->closed > slot->tick ? slot->closed : slot->tick;
    if (last > begun) {
        int64_t a_tick = (slot->guides + slot->rows_per_message - 1) / slot->rows_per_message;
        int64_t ticks = last - begun < GAP_TICKS ? last - begun : GAP_TICKS;
        counters->lost += ticks * a_tick;
    }
    if (last > slot->closed) slot->closed = last;
}

// Starts over with what this block says.
static void slot_adopt(Receive* receive, Slot* slot, const Block* block)
{
    const FrameHeader* header = &block->header;
    slot_flush(slot);
    slot->any = true;
    slot->epoch = header->epoch;
    slot->heard_us = block->now_us;
    slot->style_hash = header->style_hash;
    slot->nodes = header->nodes;
    slot->tick = header->tick;
    slot->closed = header->tick;
    int guides = 0, nodes = 0;
    if (assemble_shape(receive->assemble, header->style_hash, &guides, &nodes))
        slot->guides = guides;
}

// The epoch rule (design 4). False where the block is of an epoch to ignore.
static bool judge_epoch(Receive* receive, Slot* slot, const Block* block, Fault* say)
{
    int64_t epoch = block->header.epoch;
    if (!slot->any) {
        slot_adopt(receive, slot, block);
        return true;
    }
    if (epoch < slot->epoch && block->now_us - slot->heard_us < EPOCH_SILENCE_US) {
        if (!slot->told_two_daemons)
            fault_set(say, "two daemons publish slot %d (epochs %lld and %lld): the newer is shown",
                      slot->number, (long long)epoch, (long long)slot->epoch);
        slot->told_two_daemons = true;
        return false;
    }
    if (epoch != slot->epoch) {
        slot_adopt(receive, slot, block);
        ++receive->counters.epoch_changes;
    }
    slot->heard_us = block->now_us;
    return true;
}

// Ticks from before the ring are late, unless they keep coming while nothing newer does: then
// somebody looped or sought in a log, and what is held is the past. False: late.
static bool judge_tick(Receive* receive, Slot* slot, const Block* block)
{
    if ((int64_t)block->header.tick > (int64_t)slot->tick - RING) {
        slot->backward_since_us = NEVER_US;
        return true;
    }
    if (slot->backward_since_us == NEVER_US) slot->backward_since_us = block->now_us;
    if (block->now_us - slot->backward_since_us < BACKWARD_US) return false;
    slot_adopt(receive, slot, block);
    return true;
}

// Against the style where it is known, and the slot's other blocks where it is not. The style is
// verified by its hash; blocks come from anybody.
static bool fits_style(Receive* receive, const FrameHeader* header)
{
    int guides = HAIRSTYLE_MAX_GUIDES, nodes = header->nodes;
    assemble_shape(receive->assemble, header->style_hash, &guides, &nodes);
    return header->tick >= 0 && header->nodes == nodes && header->nodes >= HAIRSTYLE_MIN_NODES &&
           header->nodes <= HAIRSTYLE_MAX_NODES && header->strand_count > 0 &&
           header->first_strand + header->strand_count <= guides;
}

// A character may change its style between two ticks; within a tick, or with the same hash and
// another shape, somebody lies.
static bool fits_slot(Receive* receive, Slot* slot, const Block* block)
{
    const FrameHeader* header = &block->header;
    if (header->style_hash == slot->style_hash) return header->nodes == slot->nodes;
    if (header->tick <= slot->tick) return false;
    slot_close(slot, (int64_t)slot->tick + RING, &receive->counters);
    slot_adopt(receive, slot, block);
    return true;
}

static void copy_row(Slot* slot, const Block* block, int row)
{
    int layer = block->header.tick & 1;
    size_t bytes = (size_t)slot->nodes * 3 * sizeof(uint16_t);
    size_t from = (size_t)(row - block->header.first_strand) * bytes;
    size_t to = (size_t)row * (size_t)slot->nodes * 3;
    memcpy(slot->positions[layer] + to, block->positions + from, bytes);
    memcpy(slot->tangents[layer] + to, block->tangents + from, bytes);
    slot->row_tick[layer][row] = block->header.tick;
}

static void store_rows(Receive* receive, Slot* slot, const Block* block)
{
    const FrameHeader* header = &block->header;
    int first = header->first_strand, end = first + header->strand_count, fresh = 0;
    bool late = false;
    for (int row = first; row < end; ++row) {
        int32_t held = slot->row_tick[header->tick & 1][row];
        late = late || held > header->tick || slot->row_tick[~header->tick & 1][row] > header->tick;
        if (held >= header->tick) continue;
        copy_row(slot, block, row);
        ++fresh;
    }
    receive->counters.late += late;
    if (fresh == 0) {
        receive->counters.duplicate += !late;
        return;
    }
    receive->counters.bytes += (int64_t)header->strand_count * header->nodes * FRAME_NODE_BYTES;
    if (header->strand_count > slot->rows_per_message)
        slot->rows_per_message = header->strand_count;
    if (end > slot->guides) slot->guides = end;
    ++slot->change;
}

static void store(Receive* receive, Slot* slot, const Block* block)
{
    const FrameHeader* header = &block->header;
    if (header->tick > slot->tick) {
        slot_close(slot, header->tick, &receive->counters);
        slot->tick = header->tick;
    }
    GuidesLayer* layer = &slot->layer[header->tick & 1];
    if (header->tick > layer->tick)
        *layer = (GuidesLayer){header->tick, header->segment, header->utime, header->pose};
    store_rows(receive, slot, block);
}

static void judge(Receive* receive, Slot* slot, const Block* block, Fault* say)
{
    ReceiveCounters* counters = &receive->counters;
    if (block->header.slot != slot->number || !fits_style(receive, &block->header))
        ++counters->rejected;
    else if (!judge_epoch(receive, slot, block, say) || !judge_tick(receive, slot, block))
        ++counters->late;
    else if (!fits_slot(receive, slot, block))
        ++counters->rejected;
    else
        store(receive, slot, block);
}

static void reject_frame(Receive* receive, int slot, FrameFault kind, Fault* say)
{
    ++receive->counters.rejected;
    if (receive->told_faults & 1u << kind) return;
    receive->told_faults |= 1u << kind;
    fault_set(say, "slot %d: a guides message is refused (%s); more of the kind are only counted",
              slot, frame_fault_text(kind));
}

static void guides_message(Receive* receive, int number, const uint8_t* bytes, size_t size,
                           int64_t now_us)
{
    Block block = {.now_us = now_us};
    Fault say = {""};
    FrameFault kind = frame_decode(&block.header, &block.positions, &block.tangents, bytes, size);
    pthread_mutex_lock(&receive->mutex);
    ++receive->counters.datagrams;
    if (kind != FRAME_OK)
        reject_frame(receive, number, kind, &say);
    else
        judge(receive, &receive->slots[receive->index[number]], &block, &say);
    pthread_mutex_unlock(&receive->mutex);
    if (say.text[0] != 0) notice_say(&receive->notice, "%s", say.text);
}

// Styles of the slots heard since `since_us`.
static int collect_worn(Receive* receive, int64_t since_us, AssembleWorn worn[CHANNEL_MAX_SLOTS])
{
    int count = 0;
    pthread_mutex_lock(&receive->mutex);
    for (int i = 0; i < receive->slot_count; ++i) {
        const Slot* slot = &receive->slots[i];
        if (slot->any && slot->heard_us >= since_us)
            worn[count++] = (AssembleWorn){slot->style_hash, slot->number};
    }
    pthread_mutex_unlock(&receive->mutex);
    return count;
}

// A style has come: it has the last word over how many rows there are and how long they are.
static void settle_slots(Receive* receive, uint64_t hash)
{
    int guides = 0, nodes = 0;
    if (!assemble_shape(receive->assemble, hash, &guides, &nodes)) return;
    for (int i = 0; i < receive->slot_count; ++i) {
        Slot* slot = &receive->slots[i];
        if (!slot->any || slot->style_hash != hash) continue;
        ++slot->change;
        if (slot->nodes != nodes) {
            slot_flush(slot);
            continue;
        }
        slot->guides = guides;
        for (int row = guides; row < HAIRSTYLE_MAX_GUIDES; ++row)
            slot->row_tick[0][row] = slot->row_tick[1][row] = -1;
    }
}

static void style_message(Receive* receive, const uint8_t* bytes, size_t size, int64_t now_us)
{
    StylePart part;
    Fault fault = {""};
    AssembleResult result = ASSEMBLE_REJECTED;
    if (style_part_decode(&part, bytes, size, &fault)) {
        AssembleWorn worn[CHANNEL_MAX_SLOTS];
        int worn_count = collect_worn(receive, NEVER_US, worn);
        result = assemble_part(receive->assemble, &part, worn, worn_count, now_us, &fault);
    }
    pthread_mutex_lock(&receive->mutex);
    ++receive->counters.datagrams;
    bool say = result == ASSEMBLE_REFUSED && fault.text[0] != 0;
    if (result == ASSEMBLE_REJECTED) {
        ++receive->counters.rejected;
        say = !receive->told_style;
        receive->told_style = true;
    }
    if (result == ASSEMBLE_FINISHED) settle_slots(receive, part.style_hash);
    pthread_mutex_unlock(&receive->mutex);
    if (say) notice_say(&receive->notice, "%s", fault.text);
}

// The slot a channel's name gives, or -1 where it is none that is kept.
static int kept_slot(const Receive* receive, const char* channel)
{
    size_t prefix = sizeof CHANNEL_GUIDES_PREFIX - 1;
    if (strncmp(channel, CHANNEL_GUIDES_PREFIX, prefix) != 0) return -1;
    int number = 0;
    for (int i = 0; i < 4; ++i) {
        char digit = channel[prefix + (size_t)i];
        if (digit < '0' || digit > '9') return -1;
        number = number * 10 + (digit - '0');
    }
    if (channel[prefix + 4] != 0 || number >= CHANNEL_MAX_SLOTS) return -1;
    return receive->index[number] >= 0 ? number : -1;
}

void receive_message(Receive* receive, const char* channel, const uint8_t* bytes, size_t size,
                     int64_t now_us)
{
    // A log's times are anybody's: kept where differences cannot overflow.
    now_us = now_us < 0 ? 0 : now_us > LATEST_US ? LATEST_US : now_us;
    if (strcmp(channel, CHANNEL_STYLE) == 0) {
        style_message(receive, bytes, size, now_us);
        return;
    }
    int number = kept_slot(receive, channel);
    if (number >= 0) guides_message(receive, number, bytes, size, now_us);
}

void receive_restart(Receive* receive, int slot)
{
    if (slot < 0 || slot >= CHANNEL_MAX_SLOTS || receive->index[slot] < 0) return;
    pthread_mutex_lock(&receive->mutex);
    slot_flush(&receive->slots[receive->index[slot]]);
    pthread_mutex_unlock(&receive->mutex);
}

static int take_rows(GuidesView* view, const Slot* slot, int layer)
{
    int taken = 0;
    size_t values = (size_t)slot->nodes * 3;
    for (int row = 0; row < slot->guides; ++row) {
        if (slot->row_tick[layer][row] == view->row_tick[layer][row]) continue;
        size_t at = (size_t)row * values;
        memcpy(view->positions[layer] + at, slot->positions[layer] + at, values * 2);
        memcpy(view->tangents[layer] + at, slot->tangents[layer] + at, values * 2);
        view->row_tick[layer][row] = slot->row_tick[layer][row];
        ++taken;
    }
    for (int row = slot->guides; row < view->guides; ++row)
        view->row_tick[layer][row] = -1; // rows that the style turned out not to have
    return taken;
}

static void take_header(GuidesView* view, const Slot* slot)
{
    const GuidesLayer* newest = &slot->layer[slot->tick & 1];
    view->any = slot->any;
    view->epoch = slot->epoch;
    view->style_hash = slot->style_hash;
    view->tick = slot->tick;
    view->utime = newest->utime;
    view->segment = newest->segment;
    view->pose = newest->pose;
    view->guides = slot->guides;
    view->nodes = slot->nodes;
    memcpy(view->layer, slot->layer, sizeof view->layer);
    view->complete = slot->any && holds_block(slot, slot->tick, 0, slot->guides);
    view->generation = slot->generation;
    view->change = slot->change;
}

bool receive_take(Receive* receive, GuidesView* view)
{
    if (view->slot < 0 || view->slot >= CHANNEL_MAX_SLOTS) return false;
    if (receive->index[view->slot] < 0) return false;
    const Slot* slot = &receive->slots[receive->index[view->slot]];
    int taken = 0;
    pthread_mutex_lock(&receive->mutex);
    if (view->change != slot->change) {
        if (view->generation != slot->generation) forget_rows(view->row_tick, view->layer);
        for (int layer = 0; layer < RING; ++layer)
            taken += take_rows(view, slot, layer);
        take_header(view, slot);
    }
    pthread_mutex_unlock(&receive->mutex);
    return taken > 0;
}

const Hairstyle* receive_style(Receive* receive, uint64_t hash, int* version, bool* complete)
{
    return assemble_find(receive->assemble, hash, version, complete, true);
}

int receive_style_progress(Receive* receive, uint64_t hash, int* held, int* parts)
{
    int version = 0;
    assemble_find(receive->assemble, hash, &version, NULL, false);
    assemble_progress(receive->assemble, hash, version == 0 ? STYLE_FAST : STYLE_BULK, held, parts);
    return version * (STYLE_MAX_PARTS + 1) + *held;
}

size_t receive_request(Receive* receive, int64_t now_us, uint8_t* bytes, size_t capacity)
{
    now_us = now_us < 0 ? 0 : now_us > LATEST_US ? LATEST_US : now_us;
    AssembleWorn worn[CHANNEL_MAX_SLOTS];
    int worn_count = collect_worn(receive, now_us - HEARD_US, worn);
    RequestMessage request;
    if (!assemble_request(receive->assemble, worn, worn_count, now_us, &request)) return 0;
    return request_encode(bytes, capacity, &request);
}

ReceiveCounters receive_counters(const Receive* receive)
{
    // The lock is the one thing that reading changes; no Receive is ever a const object.
    Receive* unlocked = (Receive*)receive;
    pthread_mutex_lock(&unlocked->mutex);
    ReceiveCounters counters = receive->counters;
    pthread_mutex_unlock(&unlocked->mutex);
    return counters;
}
