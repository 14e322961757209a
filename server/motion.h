// Head motions in code: the standard clips (notes/simulation.md section 3), looped with rest.
#pragma once

#include "messages/vec.h"

#include <stdint.h>

typedef struct MotionState {
    Pose pose;
    int segment; // rises at a teleport; a carry of a motion does not turn the head
    int verb;    // PoseVerb by which the segment was entered
    Vec3d wind;  // velocity of the air, world axes, m/s
} MotionState;

// Pose of the head at `t` seconds. Own sines only: the same bits everywhere.
typedef MotionState (*MotionFunction)(double t);

typedef struct Motion {
    const char* name;
    const char* help;
    MotionFunction at; // NULL: poses come from the bus
} Motion;

// Table of motions, ended by a NULL name: none bus nod shake jump-stop run flip turn
// teleport gust.
extern const Motion motions[];

// NULL where there is none of that name.
const Motion* motion_find(const char* name);
