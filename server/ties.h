// Constraints between strands: cloth, and bands around hair.
//
// They reach across lanes and blocks, so they are no stage of a kernel: between two substeps all
// strands are at the same time, and there they are held, one after another in the order in which
// they were given, on one thread.
#pragma once

#include "server/sim.h"

// Moves the ends of every tie along it, by inverse mass, `sweeps` times. Skinned ends stay.
void ties_hold(Sim* sim, int sweeps);
