// A discrete elastic rod: what a strand does when nothing is left out for speed. The yardstick that
// the models of server/ are compared with; it knows nothing of them, and no program ships it.
//
// Model: Bergou, Wardetzky, Robinson, Audoly, Grinspun, "Discrete Elastic Rods" (2008), with the
// time-parallel frames of "Discrete Viscous Threads" (Bergou et al. 2010) and the notation of
// Jawed, Novelia, O'Reilly, "A Primer on the Kinematics of Discrete Elastic Rods" (2018). Isotropic
// cross section; straight or curved at rest; stretch, bend and twist; every node and edge implicit,
// solved by Newton with exact derivatives. Twist has no inertia: it is in equilibrium at every
// instant (what that leaves out is of the order of (radius / length)^2).
//
// Clamp: node 0 and the direction of the first edge at rest are fixed to the head. The length
// counts from node 0, and the bend at the clamp has half an edge to itself (stiffness 2 EI / d), so
// that the error is O(d^2); a first edge fixed as a whole would cost O(d).
//
// SI units and doubles. Space: right-handed, Y up, gravity along -Y. State is relative to the
// head's position and along world axes, as in server/sim.h.
#pragma once

#include "messages/base.h"
#include "messages/vec.h"

typedef struct Rod Rod;

// Both are implicit and stable at every step. Euler damps what it cannot resolve and is first
// order; BDF2 is second order and hardly damps, and starts with one step of Euler.
typedef enum RodScheme { ROD_EULER, ROD_BDF2 } RodScheme;

// Start from rod_circular() or from zero; every stiffness, the density and dt_s must be positive.
typedef struct RodDefinition {
    int nodes;            // 2 and more, node 0 the root
    const Vec3d* rest;    // [nodes], head space, m, the shape without gravity; copied
    double bending_nm2;   // E I, N m^2
    double twisting_nm2;  // G J, N m^2; without effect where the rest shape and motion are planar
    double stretching_n;  // E A, N; from 1e5 times the weight on, length is as good as constant
    double density_kg_m;  // rho A, kg per metre
    double gravity_m_s2;  // along -Y
    double damping_per_s; // velocity relative to the head's position decays as exp(-damping t)
    double dt_s;          // of a step
    RodScheme scheme;     // BDF2 for truth
    bool whole_tip_mass;  // the last node has the mass of a whole edge, as in the models of server/
                          // (then O(d)); false: of the half that is its own (O(d^2))
} RodDefinition;

// The stiffnesses and density of a solid round fibre; the rest is left zero. Hair: 3.5e9 Pa, radius
// 4e-5 m, 1300 kg/m^3, Poisson's ratio 0.38.
RodDefinition rod_circular(double young_pa, double radius_m, double density_kg_m3, double poisson);

// At rest under a head at the origin that does not turn. NULL with a fault naming the field that is
// out of range.
Rod* rod_create(const RodDefinition* definition, Fault* fault);
void rod_destroy(Rod* rod);

// Puts the rod to its rest shape under `head` and lets it sag to the equilibrium next to it; it
// then moves with the head, at `velocity_m_s`. False where no equilibrium was found.
bool rod_settle(Rod* rod, Pose head, Vec3d velocity_m_s);

// Puts the nodes to `positions` ([nodes], world axes relative to the head, m), moving with the
// head; twist goes to its equilibrium in the next step. The root stays in its place, and no edge
// may turn by 180 degrees.
void rod_place(Rod* rod, const Vec3d* positions);

// One dt. `head` is where the head is at the end of the step. Between two steps it should turn by
// less than a few degrees, or the step is not accurate; its speed costs nothing. False where Newton
// did not get there (the state is then its last guess).
bool rod_step(Rod* rod, Pose head);

// From the next step on the air moves at `wind_m_s` and draws every node towards its own velocity:
// a = drag (wind - velocity), both in the world. rod_settle() does not know of it.
void rod_blow(Rod* rod, Vec3d wind_m_s, double drag_per_s);

// The head jumps to `head` between two steps and takes the rod along, with the velocities that it
// has relative to the head; the head's own velocity stays as it is.
void rod_carry(Rod* rod, Pose head);

// [nodes], world axes relative to the head, m.
void rod_positions(const Rod* rod, Vec3d* positions);

// J; motion and height relative to the head's position.
typedef struct RodEnergy {
    double stretch, bend, twist, gravity, motion;
} RodEnergy;

RodEnergy rod_energy(const Rod* rod);

// The potential energy, J, with the unknowns moved by `change` (NULL: not at all), and its gradient
// there where `gradient` is not NULL. Both are [4 (nodes - 1)]: for every node from 1 the turn of
// the edge that ends there about itself (rad), then the node's x, y, z (m). Changes no state.
double rod_potential(Rod* rod, const double* change, double* gradient);

// Newton iterations of the last rod_settle() or rod_step(), for those who wonder about its cost.
int rod_iterations(const Rod* rod);
