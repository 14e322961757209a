// The standard clips (server/motion.h), each once and then a second and more of rest, as the
// substeps of a solver and as poses.
#pragma once

#include "server/motion.h"
#include "server/sim.h"

#define CLIP_RATE_HZ 60 // ticks

typedef struct Clip {
    const char* name; // of the motion
    double stop_s;    // when the head comes to rest, or goes on evenly
    double seconds;   // at least a second more
    double speed_m_s; // forward, before it begins
    double swing_s;   // of its to and fro
} Clip;

// Ended by a NULL name.
extern const Clip clips[];

// From the beginning on; later than stop_s a run goes on without its strides.
MotionState clip_at(const Clip* clip, double t);

int clip_ticks(const Clip* clip);

// Where a clip is, between two substeps.
typedef struct ClipReader {
    const Clip* clip;
    int substeps; // of a tick
    int64_t done;
    Vec3d position, move; // of the head, the latter since the substep before
    int segment;
} ClipReader;

ClipReader clip_begin(const Clip* clip, int substeps);

// The substeps of the next tick, as server/daemon.c makes them.
void clip_next(ClipReader* reader, SimHead* heads);
