// The models by name, and how stiff each may be.
#pragma once

#include "server/sim.h"

typedef struct Model {
    const char* name; // as --model
    const char* help;
    float stiffness_s2; // as it is by default, and how it falls to the tip
    int fall_off_power;
    LengthStage length;
    bool has_shape;     // rest is equilibrium once gravity is compensated
    bool has_hinges;    // stiffness is of joints, and the clamped root's counts double
    bool drops_gravity; // for compensation
    bool has_angles;    // state besides positions: Block.angle and rate
    // Verlet with damping c is stable while w^2 dt^2 < 2 (1 + c) (notes/simulation.md 4.1); this is
    // the largest w^2 of a long strand, in k/m. 0: no stiffness, no bound. Below it cascade-thesis
    // flutters all the same. Forward Euler (has_angles) has a bound of its own.
    double stiffest_mode;
} Model;

extern const Model models[MODEL_COUNT];

// Names of the other choices, as --collide and --length and a scene have them; NULL ends them.
extern const char* const collide_names[COLLIDE_COUNT + 1];
extern const char* const length_names[LENGTH_COUNT + 1];

// Index of `name`; that of the NULL where there is none.
int choice_find(const char* const* names, const char* name);

// MODEL_COUNT where there is none of that name.
ModelKind model_find(const char* name);

// Makes `definition` one of `model`, as stiff as that is by default.
void model_use(SimDefinition* definition, ModelKind model);

// The largest stable stiffness_s2 for the rate, substeps, damping and drag of `definition`.
double model_stiffness_bound(const SimDefinition* definition);

// The largest stable joint_damping_per_s: forward Euler wants v dt < J/2 where k is small; 1e30 for
// other models.
double model_joint_damping_bound(const SimDefinition* definition);

// False with a fault where a value is beyond its bound: what the bound is, and what to do; of a
// `definition` that is forced, what will happen.
bool model_is_stable(const SimDefinition* definition, Fault* fault);

// k/m, 1/s^2, `from_root_m` along the strand at rest: k / max(1, c L)^a. Thesis 5.9 prints k / (L
// c)^a, which is infinite at the root and exceeds k wherever L c < 1. By length, not by node
// number: counted in nodes, a fringe of 4 cm is as limp as a plait.
float model_stiffness(const SimDefinition* definition, float from_root_m);
