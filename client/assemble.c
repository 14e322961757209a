#include "client/assemble.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#define NEVER_US        (-((int64_t)1 << 61))
#define REQUEST_US      300000  // between requests for one lane
#define STILL_COMING_US 200000  // parts this fresh mean that more are on their way
#define REFUSED_US      2000000 // between attempts at a style that did not decode
#define SPLIT_US        1000000 // silence after which another split of a lane is believed

// One lane on its way in.
typedef struct Lane {
    uint8_t* bytes; // NULL: no part held
    uint32_t size, part_bytes;
    int parts, held;
    uint8_t have[STYLE_MAX_PARTS / 8];
    int64_t heard_us, asked_us;
} Lane;

typedef struct Entry {
    bool used;
    uint64_t hash;
    Lane lane[STYLE_LANES];
    size_t bulk_size; // known from version 1 on
    uint64_t bulk_hash;
    int64_t refused_until_us;
    bool refusal_told;
    Hairstyle* style[2]; // versions 1 and 2; the first outlives the second's arrival
    int version;
    bool complete, held;
} Entry;

// `work` guards the whole of the entries; `publish`, taken inside it, guards what assemble_find
// reads (used, hash, style, version, complete, held): those change only under both.
struct Assemble {
    pthread_mutex_t work, publish;
    Entry entries[ASSEMBLE_MAX_STYLES];
    bool full_told;
};

static void lane_forget(Lane* lane)
{
    int64_t asked_us = lane->asked_us;
    free(lane->bytes);
    *lane = (Lane){.heard_us = NEVER_US, .asked_us = asked_us};
}

static void entry_clear(Entry* entry)
{
    for (int i = 0; i < STYLE_LANES; ++i)
        free(entry->lane[i].bytes);
    for (int i = 0; i < 2; ++i)
        hairstyle_destroy(entry->style[i]);
    *entry = (Entry){.refused_until_us = NEVER_US};
    for (int i = 0; i < STYLE_LANES; ++i)
        entry->lane[i].heard_us = entry->lane[i].asked_us = NEVER_US;
}

Assemble* assemble_create(void)
{
    Assemble* assemble = calloc(1, sizeof *assemble);
    if (assemble == NULL) return NULL;
    pthread_mutex_init(&assemble->work, NULL);
    pthread_mutex_init(&assemble->publish, NULL);
    for (int i = 0; i < ASSEMBLE_MAX_STYLES; ++i)
        entry_clear(&assemble->entries[i]);
    return assemble;
}

void assemble_destroy(Assemble* assemble)
{
    if (assemble == NULL) return;
    for (int i = 0; i < ASSEMBLE_MAX_STYLES; ++i)
        entry_clear(&assemble->entries[i]);
    pthread_mutex_destroy(&assemble->publish);
    pthread_mutex_destroy(&assemble->work);
    free(assemble);
}

static Entry* find(Assemble* assemble, uint64_t hash)
{
    for (int i = 0; i < ASSEMBLE_MAX_STYLES; ++i) {
        Entry* entry = &assemble->entries[i];
        if (entry->used && entry->hash == hash) return entry;
    }
    return NULL;
}

static bool is_worn(uint64_t hash, const AssembleWorn* worn, int worn_count)
{
    for (int i = 0; i < worn_count; ++i)
        if (worn[i].style_hash == hash) return true;
    return false;
}

// Unfinished before finished: a finished one may be wanted again and cost a whole transfer.
static Entry* victim(Assemble* assemble, const AssembleWorn* worn, int worn_count)
{
    for (int finished = 0; finished < 2; ++finished)
        for (int i = 0; i < ASSEMBLE_MAX_STYLES; ++i) {
            Entry* entry = &assemble->entries[i];
            if (entry->held || (entry->version > 0) != (finished == 1)) continue;
            if (!is_worn(entry->hash, worn, worn_count)) return entry;
        }
    return NULL;
}

// A place for a style not in the table, or NULL. Strangers' styles never displace anything.
static Entry* begin(Assemble* assemble, uint64_t hash, const AssembleWorn* worn, int worn_count)
{
    bool wanted = is_worn(hash, worn, worn_count);
    if (!wanted && worn_count > 0) return NULL;
    Entry* entry = NULL;
    for (int i = 0; i < ASSEMBLE_MAX_STYLES && entry == NULL; ++i)
        if (!assemble->entries[i].used) entry = &assemble->entries[i];
    if (entry == NULL && !wanted) return NULL;
    pthread_mutex_lock(&assemble->publish); // before choosing: `held` may be set meanwhile
    if (entry == NULL) entry = victim(assemble, worn, worn_count);
    if (entry != NULL) {
        entry_clear(entry);
        entry->used = true;
        entry->hash = hash;
    }
    pthread_mutex_unlock(&assemble->publish);
    return entry;
}

// A lane's first part fixes its split. A daemon restarted with another --mtu sends the same style
// in other parts, and a forged first part must not block a style for good: another split is
// believed once nothing of the held one has come for a while.
static AssembleResult lane_put(Lane* lane, const StylePart* part, int64_t now_us, Fault* fault)
{
    uint32_t part_bytes = style_part_split(part);
    if (part_bytes == 0) {
        fault_set(fault, "style %016llx: part %u of %u at byte %u of %u does not fit its lane",
                  (unsigned long long)part->style_hash, part->part, part->parts, part->offset,
                  part->lane_bytes);
        return ASSEMBLE_REJECTED;
    }
    bool agrees = lane->size == part->lane_bytes && lane->parts == part->parts &&
                  lane->part_bytes == part_bytes;
    if (lane->bytes != NULL && !agrees) {
        if (now_us - lane->heard_us < SPLIT_US) {
            fault_set(fault,
                      "style %016llx: a part of another split (%u parts of %u bytes, %u in all) "
                      "among those of %d parts of %u bytes, %u in all",
                      (unsigned long long)part->style_hash, part->parts, part_bytes,
                      part->lane_bytes, lane->parts, lane->part_bytes, lane->size);
            return ASSEMBLE_REJECTED;
        }
        lane_forget(lane);
    }
    if (lane->bytes == NULL) {
        lane->bytes = malloc(part->lane_bytes);
        if (lane->bytes == NULL) return ASSEMBLE_IGNORED;
        lane->size = part->lane_bytes;
        lane->part_bytes = part_bytes;
        lane->parts = part->parts;
    }
    lane->heard_us = now_us;
    uint8_t* have = &lane->have[part->part / 8];
    uint8_t bit = (uint8_t)(1u << (part->part % 8));
    if (*have & bit) return ASSEMBLE_IGNORED;
    *have |= bit;
    memcpy(lane->bytes + part->offset, part->payload, part->size);
    ++lane->held;
    return ASSEMBLE_KEPT;
}

static bool lane_full(const Lane* lane)
{
    return lane->bytes != NULL && lane->held == lane->parts;
}

static AssembleResult refuse(Entry* entry, int lane, int64_t now_us, Fault* fault)
{
    lane_forget(&entry->lane[lane]);
    entry->refused_until_us = now_us + REFUSED_US;
    if (fault == NULL) return ASSEMBLE_REFUSED;
    if (entry->refusal_told) fault->text[0] = 0;
    entry->refusal_told = true;
    return ASSEMBLE_REFUSED;
}

static void publish(Assemble* assemble, Entry* entry, Hairstyle* style, bool complete)
{
    pthread_mutex_lock(&assemble->publish);
    entry->style[entry->version++] = style;
    entry->complete = complete;
    pthread_mutex_unlock(&assemble->publish);
    if (!complete) return;
    for (int i = 0; i < STYLE_LANES; ++i)
        lane_forget(&entry->lane[i]);
}

static AssembleResult finish_bulk(Assemble* assemble, Entry* entry, int64_t now_us, Fault* fault)
{
    const Lane* fast = &entry->lane[STYLE_FAST];
    const Lane* bulk = &entry->lane[STYLE_BULK];
    bool sound = style_hash(bulk->bytes, bulk->size) == entry->bulk_hash;
    if (!sound)
        fault_set(fault, "style %016llx is refused: its bulk lane's bytes have another hash",
                  (unsigned long long)entry->hash);
    Hairstyle* style = NULL;
    if (sound) {
        size_t size = 0;
        uint64_t hash = 0;
        style = style_decode_fast(fast->bytes, fast->size, &size, &hash, fault);
        if (style != NULL && !style_decode_bulk(style, bulk->bytes, bulk->size, fault)) {
            hairstyle_destroy(style);
            style = NULL;
        }
    }
    if (style == NULL) return refuse(entry, STYLE_BULK, now_us, fault);
    publish(assemble, entry, style, true);
    return ASSEMBLE_FINISHED;
}

static AssembleResult finish_fast(Assemble* assemble, Entry* entry, int64_t now_us, Fault* fault)
{
    const Lane* fast = &entry->lane[STYLE_FAST];
    Lane* bulk = &entry->lane[STYLE_BULK];
    if (style_hash(fast->bytes, fast->size) != entry->hash) {
        fault_set(fault, "style %016llx is refused: its bytes have another hash",
                  (unsigned long long)entry->hash);
        return refuse(entry, STYLE_FAST, now_us, fault);
    }
    Hairstyle* style =
        style_decode_fast(fast->bytes, fast->size, &entry->bulk_size, &entry->bulk_hash, fault);
    if (style == NULL) return refuse(entry, STYLE_FAST, now_us, fault);
    publish(assemble, entry, style, entry->bulk_size == 0);
    if (bulk->bytes != NULL && bulk->size != entry->bulk_size) lane_forget(bulk);
    // A bulk lane that is refused now is told at its next attempt: version 1 is news enough.
    if (!entry->complete && lane_full(bulk)) finish_bulk(assemble, entry, now_us, NULL);
    return ASSEMBLE_FINISHED;
}

static AssembleResult full(Assemble* assemble, bool wanted, Fault* fault)
{
    if (!wanted) return ASSEMBLE_IGNORED;
    if (fault != NULL) fault->text[0] = 0;
    if (!assemble->full_told)
        fault_set(fault, "more than %d styles are worn: restart the client to make room",
                  ASSEMBLE_MAX_STYLES);
    assemble->full_told = true;
    return ASSEMBLE_REFUSED;
}

static AssembleResult put(Assemble* assemble, const StylePart* part, const AssembleWorn* worn,
                          int worn_count, int64_t now_us, Fault* fault)
{
    if (part->lane >= STYLE_LANES) {
        fault_set(fault, "style part of lane %u: there are %d", part->lane, STYLE_LANES);
        return ASSEMBLE_REJECTED;
    }
    Entry* entry = find(assemble, part->style_hash);
    if (entry == NULL) entry = begin(assemble, part->style_hash, worn, worn_count);
    if (entry == NULL) return full(assemble, is_worn(part->style_hash, worn, worn_count), fault);
    bool done = entry->complete || (part->lane == STYLE_FAST && entry->version > 0);
    if (done || now_us < entry->refused_until_us) return ASSEMBLE_IGNORED;
    if (part->lane == STYLE_BULK && entry->version > 0 && part->lane_bytes != entry->bulk_size) {
        fault_set(fault, "style %016llx: a bulk part of %u bytes in all, its fast lane says %zu",
                  (unsigned long long)part->style_hash, part->lane_bytes, entry->bulk_size);
        return ASSEMBLE_REJECTED;
    }
    AssembleResult result = lane_put(&entry->lane[part->lane], part, now_us, fault);
    if (result != ASSEMBLE_KEPT || !lane_full(&entry->lane[part->lane])) return result;
    if (part->lane == STYLE_FAST) return finish_fast(assemble, entry, now_us, fault);
    return entry->version > 0 ? finish_bulk(assemble, entry, now_us, fault) : ASSEMBLE_KEPT;
}

AssembleResult assemble_part(Assemble* assemble, const StylePart* part, const AssembleWorn* worn,
                             int worn_count, int64_t now_us, Fault* fault)
{
    pthread_mutex_lock(&assemble->work);
    AssembleResult result = put(assemble, part, worn, worn_count, now_us, fault);
    pthread_mutex_unlock(&assemble->work);
    return result;
}

const Hairstyle* assemble_find(Assemble* assemble, uint64_t hash, int* version, bool* complete,
                               bool hold)
{
    pthread_mutex_lock(&assemble->publish);
    Entry* entry = find(assemble, hash);
    bool any = entry != NULL && entry->version > 0;
    if (any && hold) entry->held = true;
    const Hairstyle* style = any ? entry->style[entry->version - 1] : NULL;
    if (version != NULL) *version = any ? entry->version : 0;
    if (complete != NULL) *complete = any && entry->complete;
    pthread_mutex_unlock(&assemble->publish);
    return style;
}

bool assemble_shape(Assemble* assemble, uint64_t hash, int* guides, int* nodes)
{
    pthread_mutex_lock(&assemble->publish);
    const Entry* entry = find(assemble, hash);
    bool any = entry != NULL && entry->version > 0;
    if (any) {
        *guides = entry->style[0]->guide_count;
        *nodes = entry->style[0]->nodes;
    }
    pthread_mutex_unlock(&assemble->publish);
    return any;
}

static bool lane_due(const Lane* lane, int64_t now_us)
{
    return now_us - lane->asked_us >= REQUEST_US && now_us - lane->heard_us >= STILL_COMING_US;
}

static void fill_missing(const Lane* lane, uint8_t missing[STYLE_MAX_PARTS / 8])
{
    // Until a part has come nobody here knows how many there are: ask for all that there could be.
    memset(missing, lane->bytes == NULL ? 0xff : 0, STYLE_MAX_PARTS / 8);
    for (int i = 0; lane->bytes != NULL && i < lane->parts; ++i)
        if (!(lane->have[i / 8] >> (i % 8) & 1)) missing[i / 8] |= (uint8_t)(1u << (i % 8));
}

bool assemble_request(Assemble* assemble, const AssembleWorn* worn, int worn_count, int64_t now_us,
                      RequestMessage* request)
{
    bool due = false;
    pthread_mutex_lock(&assemble->work);
    for (int i = 0; i < worn_count && !due; ++i) {
        Entry* entry = find(assemble, worn[i].style_hash);
        if (entry == NULL) entry = begin(assemble, worn[i].style_hash, worn, worn_count);
        if (entry == NULL || entry->complete || now_us < entry->refused_until_us) continue;
        int which = entry->version == 0 ? STYLE_FAST : STYLE_BULK;
        Lane* lane = &entry->lane[which];
        if (!lane_due(lane, now_us)) continue;
        due = true;
        lane->asked_us = now_us;
        *request = (RequestMessage){.utime = now_us,
                                    .style_hash = entry->hash,
                                    .slot = (uint16_t)worn[i].slot,
                                    .lane = (uint8_t)which};
        fill_missing(lane, request->missing);
    }
    pthread_mutex_unlock(&assemble->work);
    return due;
}

void assemble_progress(Assemble* assemble, uint64_t hash, int lane, int* held, int* parts)
{
    pthread_mutex_lock(&assemble->work);
    const Entry* entry = find(assemble, hash);
    *held = entry != NULL ? entry->lane[lane].held : 0;
    *parts = entry != NULL ? entry->lane[lane].parts : 0;
    pthread_mutex_unlock(&assemble->work);
}
