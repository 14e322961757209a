// The solver as a table of its functions: the one that ships, in float, and the same text in
// double, whose runs at a thousandth of the step are not blurred by rounding.
#pragma once

#include "server/sim.h"

typedef struct Solver {
    Sim* (*create)(const SimDefinition* definition, Fault* fault);
    void (*destroy)(Sim* sim);
    bool (*tune)(Sim* sim, const SimDefinition* wanted, Fault* fault);
    void (*step)(Sim* sim, const SimHead* heads);
    void (*positions)(const Sim* sim, const float rotation[9], bool project, Vec3* positions);
    void (*state)(const Sim* sim, Vec3* positions, Vec3* previous);
    int64_t (*quarantined)(const Sim* sim);
} Solver;

extern const Solver solver_float, solver_double;
