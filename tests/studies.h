// Studies of hair-bench: many runs of the solver or many pictures, as one CSV each, for
// scripts/chart. A study has columns of its own and says in comment lines (#) what it holds and
// where it was made.
#pragma once

#include "messages/base.h"

typedef struct Study {
    const char* name;
    const char* help;
    // Writes to standard output; false with a fault.
    bool (*run)(Fault* fault);
} Study;

bool study_sim(Fault* fault);
bool study_accuracy(Fault* fault);
bool study_stability(Fault* fault);
bool study_tree(Fault* fault);
bool study_reference(Fault* fault);
bool study_shading(Fault* fault);
bool study_shadow(Fault* fault);
bool study_frame(Fault* fault);
bool study_update(Fault* fault);
bool study_transparency(Fault* fault);
bool study_wisps(Fault* fault);

// "# machine: ..." as /proc/cpuinfo names it, and how many cores there are.
void study_machine(void);
