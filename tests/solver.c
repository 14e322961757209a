// Built twice, as what it is linked with: in float, and in double (CMakeLists.txt).
#include "tests/solver.h"

#ifdef SIM_DOUBLE
#define solver_here solver_double
#else
#define solver_here solver_float
#endif

const Solver solver_here = {sim_create,    sim_destroy, sim_tune,       sim_step,
                            sim_positions, sim_state,   sim_quarantined};
