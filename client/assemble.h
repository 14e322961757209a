// Style parts in, hairstyles out. Parts come in any order, twice, late, never, or from strangers.
//
// Bounded whatever comes: ASSEMBLE_MAX_STYLES styles, one buffer a lane, of the size its (capped)
// header says. Decoding happens in the caller's thread under a lock that assemble_find does not
// take, so that the drawing thread never waits for an inflate.
#pragma once

#include "messages/control.h"
#include "messages/style.h"

#define ASSEMBLE_MAX_STYLES 16

typedef struct Assemble Assemble;

// A style that a watched slot's guides name.
typedef struct AssembleWorn {
    uint64_t style_hash;
    int slot;
} AssembleWorn;

typedef enum AssembleResult {
    ASSEMBLE_IGNORED,  // held already, worn by nobody, or its style is refused for now
    ASSEMBLE_KEPT,     // one part closer
    ASSEMBLE_FINISHED, // a new version of the style is ready
    ASSEMBLE_REJECTED, // contradicts itself or parts held; the fault says how
    ASSEMBLE_REFUSED // no sound style, or no room; the fault says why the first time, then is empty
} AssembleResult;

Assemble* assemble_create(void);
void assemble_destroy(Assemble* assemble);

// Takes a decoded part. Once any slot wears something only worn styles are begun; before, whatever
// comes while there is room. A worn style that finds the table full takes the place of one that
// nobody wears or holds.
AssembleResult assemble_part(Assemble* assemble, const StylePart* part, const AssembleWorn* worn,
                             int worn_count, int64_t now_us, Fault* fault);

// The newest version of a style, NULL while its fast lane is missing. Version 1 has guides, version
// 2 the bulk lane as well. With `hold` the pointer stays valid until assemble_destroy; without,
// only until the next assemble_part or assemble_request.
const Hairstyle* assemble_find(Assemble* assemble, uint64_t hash, int* version, bool* complete,
                               bool hold);

// Guide and node counts of a style, for checking blocks; false while its fast lane is missing.
bool assemble_shape(Assemble* assemble, uint64_t hash, int* guides, int* nodes);

// Fills the request that is due first, if any: the fast lane of a worn style as soon as it is
// named, its bulk lane once the fast lane has told of one. Each lane at most every 300 ms, and not
// within 200 ms of a part of it.
bool assemble_request(Assemble* assemble, const AssembleWorn* worn, int worn_count, int64_t now_us,
                      RequestMessage* request);

// How many of how many parts of a lane are held; 0 of 0 where no part came or the lane is done.
void assemble_progress(Assemble* assemble, uint64_t hash, int lane, int* held, int* parts);
