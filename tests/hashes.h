// What each model ends in after each clip, as the program prints it:
//     build/bin/hair-server --model M --motion C --ticks 240 --fast --hash
// test_clip_hashes says how the literals are made anew.
#pragma once

#include "server/sim.h"

#include <stdint.h>

#define HASHED_TICKS 240
#define HASHED_CLIPS 8

static const char* const hashed_clips[HASHED_CLIPS] = {"nod",  "shake", "jump-stop", "run",
                                                       "flip", "turn",  "teleport",  "gust"};

typedef struct ModelHashes {
    const char* model;
    uint64_t of_clip[HASHED_CLIPS];
} ModelHashes;

#include "tests/hashes.inc"
