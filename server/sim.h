// The strand simulation as a library: definition in, guide positions out. Knows nothing of heads,
// styles or messages; a cantilever or a pendulum is just another definition.
//
// State is relative to the head's position and along world axes, so a head 100 km away costs no
// precision, a carried (teleported) head touches no float, and the head's motion enters as the
// second difference of its position. Layout: blocks of 32 strands, structure of arrays, lanes
// across strands (strands.h), so that every loop over lanes is one vector instruction wide.
// Bit-identical over thread counts, optimisation levels and compilers (-ffp-contract=off).
#pragma once

#include "messages/base.h"
#include "messages/vec.h"

#include <stdint.h>

typedef struct Sim Sim;

// A way for strands to move: a file of forces, a row in kernel.c, a row in models.c.
typedef enum ModelKind {
    MODEL_SPRING,
    MODEL_CASCADE,
    MODEL_FOREST,
    MODEL_PLAIN,
    MODEL_CASCADE_THESIS, // as printed, kept for its failures; so is the next
    MODEL_FOREST_Z,
    MODEL_COUNT
} ModelKind;

// What of a strand is kept out of colliders (Nguyen and Donnelly 2005, 23.2.2).
typedef enum CollideMode {
    COLLIDE_POINT,   // its nodes
    COLLIDE_PEARL,   // ... as spheres of pearl_radius_m
    COLLIDE_SEGMENT, // ... and the links between them, as thick
    COLLIDE_COUNT
} CollideMode;

// How links are kept at their length within a substep; the forest models need neither.
typedef enum LengthStage {
    LENGTH_SWEEPS, // one link after another, `iterations` times (thesis 4.2)
    LENGTH_DIRECT, // all links of a strand at once, `iterations` times (Han and Harada 2013)
    LENGTH_COUNT
} LengthStage;

// Two nodes of different strands that are held together: at a distance (cloth), or no further apart
// than it (a rope; a band around hair is ropes between the strands that it holds).
typedef struct Tie {
    int strand[2], node[2];
    float length_m;
    bool is_rope;
} Tie;

// What is simulated and how. Start from sim_default(), and for another model with model_use() of
// models.h.
typedef struct SimDefinition {
    ModelKind model;
    const char* kernel; // "avx512", "avx2", "sse2", "scalar"; NULL: the widest that runs here
    int strands, nodes; // nodes of every strand, node 0 the root
    const Vec3* rest;   // [strand][node], head space, m; copied
    const uint8_t*
        weight; // [strand][node], 255 physics ... 0 skinned; NULL: all physics but node 0
    const Collider* colliders; // copied
    int collider_count;
    CollideMode collide;
    const Tie* ties; // copied; held `iterations` times a substep, in this order
    int tie_count;
    double rate_hz; // ticks a second
    int substeps;   // of a tick
    int iterations; // of the length stage, a substep
    LengthStage length;
    float gravity_m_s2; // along -Y
    // k/m, 1/s^2: of the first node's spring to its rest place (spring), or across the first joint,
    // EI / (m d^3) (the others).
    float stiffness_s2;
    float fall_off_per_m; // c in k(L) = k / max(1, c L)^a, L m from the root (thesis 5.9, mended)
    int fall_off_power;   // a: 0 none, 1 linear, 2 quadratic, 3 cubic
    // Velocity relative to the head decays as exp(-damping t); forest-z has its joints' alone.
    float damping_per_s;
    float drag_per_s;          // where a wind blows, velocity relative to it decays as exp(-drag t)
    float joint_damping_per_s; // forest-z: v/J of a joint, J = m d^2 (thesis 4.2.2)
    // spring: what is left upside down of the stiffness, and of the weight that it carries; between
    // by the cosine of the tilt. 1: nothing is lost. (Thesis 4.4: alpha / k.)
    float upside_down_share;
    float down_share;     // cascade-thesis: the downward springs' part of the upward ones' k
    float pearl_radius_m; // how thick a strand is where it collides
    // Rest is equilibrium under gravity: at every tilt (spring, cascade-thesis, forest-z: gravity
    // is left out), untilted (cascade, forest: the joints carry the weight), not at all (plain).
    bool gravity_compensation;
    float tip_mass; // of the last node, in masses of the others: 1, or a half
    // forest, forest-z: the head's acceleration acts on the tips alone, not on every link. A link
    // has no inertia but its own, so the load of all links outboard overdrives it: against the rod
    // tips alone are twice as near in jump-stop, almost thrice in run, and 9 to 18 % farther in nod
    // (tests/charts/accuracy.csv).
    bool outermost;
    bool force;  // take what is beyond the stability bound, and a down_share beyond 1
    int threads; // OpenMP threads over blocks; result does not depend on it
} SimDefinition;

SimDefinition sim_default(void);

// NULL with a fault naming the field that is out of range.
Sim* sim_create(const SimDefinition* definition, Fault* fault);
void sim_destroy(Sim* sim);

// The head at the end of one substep, and the air around it, relative to the state's origin.
typedef struct SimHead {
    float rotation[9];      // row-major: world = rotation * head
    Vec3 second_difference; // x(t+dt) - 2 x(t) + x(t-dt) of the head's position, m, world axes
    Vec3 move;              // x(t+dt) - x(t) of it; only the wind asks
    // Velocity of the air, world axes, m/s. Without a wind there is no drag: damping stands for
    // still air. Drag comes in over the first m/s, so that a breeze is no jolt.
    Vec3 wind;
    // Where the torso is that the colliders of BODY_TORSO move with. Without one they move with the
    // head.
    bool has_torso;
    bool torso_is_carried;   // it did not move here in this substep: hair in its way gets no speed
    float torso_rotation[9]; // row-major: world = rotation * torso
    Vec3 torso_offset;       // of its origin from the head's, world axes, m
} SimHead;

// Takes stiffness, damping, gravity, drag, iterations and pearl radius from `wanted`, from the next
// step on; the state is not touched, nothing is allocated, and the rest of `wanted` is not read.
// Compensation of gravity stays that of the first definition: hair tuned to less of it (under
// water) rises. False with a fault where a value is out of range; nothing is then changed.
bool sim_tune(Sim* sim, const SimDefinition* wanted, Fault* fault);

// What is simulated now; its pointers are NULL.
const SimDefinition* sim_definition(const Sim* sim);

// Advances one tick; `heads` has one entry per substep. Allocates nothing.
void sim_step(Sim* sim, const SimHead* heads);

// Every node to its rest place under `rotation`, at rest.
void sim_reset(Sim* sim, const float rotation[9]);

// Turns state and velocity by `turn` (row-major): the rotational part of a carry.
void sim_turn(Sim* sim, const float turn[9]);

// Positions in head space under `rotation`: [strand][node]. With `project`, lengths are put back to
// rest from root to tip (links between two skinned nodes are left as they are).
void sim_positions(const Sim* sim, const float rotation[9], bool project, Vec3* positions);

// World-axes positions relative to the head, as simulated: [strand][node]; for measurements.
void sim_state(const Sim* sim, Vec3* positions, Vec3* previous);

// How many times a strand was put back to rest at the end of a tick (or of a substep, where there
// are ties), because a node of it was not finite or 1 km away. The other strands are not touched.
int64_t sim_quarantined(const Sim* sim);

// Feeds slot-independent state bits into an XXH64 state: strand-major, node order, position,
// previous position, then what other state the model has; padding lanes left out. `hash_state` is
// an XXH64_state_t*.
void sim_hash(const Sim* sim, void* hash_state);
