// Messages in, newest guides and styles out: latest-wins slots between the drain thread and the
// drawing thread.
//
// receive_message may be called from any thread (the drain thread, a log player, the embedded
// daemon); receive_take from the drawing thread. In the steady state nobody allocates.
#pragma once

#include "messages/control.h"
#include "messages/frame.h"
#include "messages/hairstyle.h"

#define RECEIVE_MAX_STYLES 16

typedef struct Receive Receive;

// Guide blocks of the watched slots and style parts; other channels are not counted.
//
// What `lost` counts, exactly. The ring is two ticks. A tick T is closed when a tick >= T + 2 of
// its slot arrives (so reordering by one tick is not loss); closing counts the messages of T that
// have not come: with K the largest block seen and G guides (the style's count, or before it is
// known the highest row seen), the blocks [0,K), [K,2K) ... G of which a row is missing. Ticks of
// which nothing came count ceil(G/K), 600 ticks of a gap at most: one forged tick could claim 2^31.
// Not counted: the first tick after joining, a new epoch, a
// jump back or receive_restart (one may join in its middle), and the newest two ticks (still open).
typedef struct ReceiveCounters {
    int64_t datagrams; // messages, accepted or not
    int64_t lost;      // messages known missing: see above
    int64_t late;      // older than a row that is held, or of an epoch that is ignored
    int64_t duplicate; // blocks whose rows are all held at that tick
    int64_t rejected;  // damaged, foreign, hostile
    int64_t epoch_changes;
    int64_t bytes; // payload bytes of guide blocks that brought rows
} ReceiveCounters;

// What a layer's newest rows share: enough to mix two ticks, each with its own head pose.
typedef struct GuidesLayer {
    int32_t tick; // -1: nothing
    int32_t segment;
    int64_t utime;
    Pose pose;
} GuidesLayer;

// What the drawing thread holds of one slot. Layer L of the planes holds, for each row, the row at
// tick row_tick[L][row] (-1: nothing); ticks alternate between the layers (tick & 1), so the newest
// two ticks are resident. A late row is kept where its layer holds an older one. Row stride is
// nodes x 3. Buffers belong to the view and are as large as the caps, so that taking never
// allocates.
typedef struct GuidesView {
    int slot;
    bool any;      // some rows were ever received
    bool complete; // every row is at `tick`
    int64_t epoch, utime;
    uint64_t style_hash;
    int32_t tick, segment; // newest
    Pose pose;             // of the head at `tick`
    int guides, nodes;     // as far as rows have told; the style has the last word
    int32_t row_tick[2][HAIRSTYLE_MAX_GUIDES];
    uint16_t* positions[2]; // [guide][node][3]
    int16_t* tangents[2];
    GuidesLayer layer[2];
    uint32_t generation; // rises when everything held was dropped (epoch, style, jump back): never
                         // mix across it
    uint64_t change;     // receive_take's: what it copied up to
} GuidesView;

bool guides_view_init(GuidesView* view, int slot, Fault* fault);
void guides_view_free(GuidesView* view);

// `slots` of `slot_count` entries are kept, others ignored. 768 KiB a slot, all taken here.
// Notices: damaged messages (once per kind), two daemons on one slot (once), a style that is
// refused. They are said with no lock held.
Receive* receive_create(const int* slots, int slot_count, Notice notice, Fault* fault);
void receive_destroy(Receive* receive);

// A message as it came; `now_us` is the receiver's monotonic clock (or a log's time). Never
// crashes, blocks long or grows without bound, whatever the bytes.
void receive_message(Receive* receive, const char* channel, const uint8_t* bytes, size_t size,
                     int64_t now_us);

// Forgets the guides held of `slot`: its next block is taken as it comes, whatever its tick or
// epoch, and no gap is counted. For seeks in a log.
void receive_restart(Receive* receive, int slot);

// The slots being kept; the array lives as long as `receive`.
int receive_slots(const Receive* receive, const int** slots);

// Copies rows that are new since the last take into `view`; true if there were any.
bool receive_take(Receive* receive, GuidesView* view);

// The style with this hash, as complete as it is: NULL while its fast lane is missing. `*version`
// rises when its bulk lane arrives; `*complete` says that nothing is missing. The pointer stays
// valid until receive_destroy.
const Hairstyle* receive_style(Receive* receive, uint64_t hash, int* version, bool* complete);

// How many of how many parts are held of the lane that this style waits for (0 of 0: none came).
// What is returned rises with every part that brings the style closer, from lane to lane; it falls
// where the parts made no sound style. Waits while a style is being read.
int receive_style_progress(Receive* receive, uint64_t hash, int* held, int* parts);

// Writes the request_t that is due now, if any, and returns its size, else 0: parts of styles that
// the slots wear and that have not come, at most every 300 ms and not while they are still coming.
size_t receive_request(Receive* receive, int64_t now_us, uint8_t* bytes, size_t capacity);

ReceiveCounters receive_counters(const Receive* receive);
