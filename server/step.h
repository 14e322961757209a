// The parts of a tick, for what steps blocks in an order of its own (tests/tree.h); sim_step is
// all of them.
#pragma once

#include "server/strands.h"

// Fills the simulation's substeps from the head's motion: one entry per substep.
void step_prepare(Sim* sim, const SimHead* heads);

// `count` blocks from `first` on, 1 to KERNEL_GANG, through these substeps; `thread` is the
// caller's number among the definition's threads.
void step_blocks(const Sim* sim, int first, int count, int thread, const Substep* substeps,
                 int substep_count);

// All of them, on as many threads as the definition says.
void step_all(const Sim* sim, const Substep* substeps, int count);
