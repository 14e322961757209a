// One character: a head on its path, by a motion in code or by poses from the bus, and the hair
// under it. Knows neither the daemon nor other characters.
#pragma once

#include "messages/control.h"
#include "messages/hairstyle.h"
#include "server/motion.h"
#include "server/poses.h"
#include "server/publish.h"
#include "server/sim.h"

typedef struct Character {
    int number;            // of its slot
    int style;             // of the daemon's styles
    const Hairstyle* hair; // that style; it must outlive the character
    Sim* sim;
    const Motion* motion;
    Pose base; // where the motion happens
    PoseRing poses;
    PoseRing torso;        // from the bus alone; while it is empty the torso moves with the head
    bool torso_is_carried; // relative to the head, from the last substep to the next one
    Pose head;             // at the end of the last substep
    Vec3d move;            // of the head in the last substep, m
    WindMessage wind;
    int motion_segment;
    int32_t segment; // as published
    bool frozen;
    Quat frozen_orientation; // the hair's state stays as it was under this one
    int64_t clamped;
    int64_t quarantined; // strands of it that the daemon has counted
    SimHead* heads;      // of one tick
    PublishPlanes planes;
} Character;

// `sim` with the strands and colliders of `hair`, which must outlive the definition.
SimDefinition character_definition(const SimDefinition* sim, const Hairstyle* hair);

// What simulates it: those, and the ties of what holds the style together. NULL with a fault.
Sim* character_sim(const SimDefinition* sim, const Hairstyle* hair, Fault* fault);

// Step n simulates the time from (n - 1) / rate to n / rate. This is the time at the end of its
// substep `substep`; 0 is the end of the step before.
double character_time(const SimDefinition* sim, int64_t step, int substep);

// A head that stands where its motion has it before step `step`, as if it had always been on its
// path, with hair at rest under it. `position` is where the motion happens, m. NULL with a fault.
Character* character_create(const SimDefinition* sim, const Hairstyle* hair, const Motion* motion,
                            Vec3d position, int64_t step, Fault* fault);
void character_destroy(Character* character);

// Moves the head through step `step`, and the hair with it, to the texels in `planes`. `project`
// puts lengths back on what is published.
void character_step(Character* character, int64_t step, bool project);
