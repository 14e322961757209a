// How strands lie in memory: blocks of 32, one strand a lane, nodes in order.
//
// The links of a strand must be corrected one after another, so a vector cannot run along a strand;
// strands are independent, so it runs across them (notes/simulation.md section 5: 23 times the
// speed of strand after strand, and the same bits at any width, because no sum changes order). 32
// are two AVX-512 registers: while one waits for its square root, the other is worked on
// (measured: 1.39 ns for 1.90 with 16). Lanes beyond the last strand repeat the last strand: every
// lane is sound, nothing is 0 / 0, and no loop asks which lanes are real.
#pragma once

#include "server/kernel.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#define LANES 32

// What the solver counts in. The tests' library sim_double is the same text in double: there a
// model's own error shows, without that of float.
#ifdef SIM_DOUBLE
typedef double real;
typedef int64_t real_bits;
#define real_sqrt  sqrt
#define real_abs   fabs
#define RESOLVED_M 1e-15
#define SETTLED    1e-30
#else
typedef float real;
typedef int32_t real_bits;
#define real_sqrt  sqrtf
#define real_abs   fabsf
// What positions within a metre resolve of a length.
#define RESOLVED_M 2.5e-7f
#define SETTLED    1e-11f
#endif
#define LEAST_LENGTH_M 1e-9f // below it a link has no direction
#define LOST_M         1e3f  // from the head: no hair is there

typedef struct Lanes {
    real v[LANES];
} Lanes;

typedef struct Lanes3 {
    real x[LANES], y[LANES], z[LANES];
} Lanes3;

// A vector of one lane, for what is worked out in one loop over lanes.
typedef struct Real3 {
    real x, y, z;
} Real3;

// Of a joint: theta about the z axis of the link before, phi about the link's own y axis.
typedef struct Angles {
    real theta[LANES], phi[LANES];
} Angles;

// Thirty-two strands. Every array has one entry per node; what belongs to link n, from node n - 1
// to n, stands at n, and entry 0 is unused.
struct Block {
    int nodes;
    int rows;            // from one collider's clearances to the next one's
    int strands;         // lanes beyond them repeat the last
    int skinned;         // nodes before it are skinned, in part and in some lane; the rest is free
    int64_t quarantined; // times that a strand was put back (quarantine.h)
    // State: world axes, relative to the head's position, m.
    Lanes3* position;
    Lanes3* previous; // one substep ago
    Angles* angle;    // forest-z: of joint n from rest, and how fast it turns, 1/s
    Angles* rate;
    // Within a substep; all but the first are lent (Sim.work).
    Lanes3* reference;    // where rest is now; of the nodes before `skinned`
    Lanes3* acceleration; // m/s^2; of a link's direction, 1/s^2, in the forest models
    Lanes3* direction;    // of link n, unit
    Lanes3* predicted;    // where link n would point if its joint were at rest, unit
    Lanes* pivot;         // length_direct: of row n of the elimination, inverse
    Lanes* tension;       // ... and how much is pulled along link n, m
    Lanes3* moment;       // of joint n on link n, m^2/s^2; one more, past the tip, is zero
    // Constants.
    Lanes3* rest;        // head space, m
    Lanes3* along;       // rest direction of link n in the frame of link n - 1
    Lanes3* across;      // its frame's second axis, in the same frame (frames.h)
    Lanes3* carried;     // c of joint n, in that frame, m^2/s^2: d x c carries the weight at rest
    Lanes* length;       // m
    Lanes* per_length;   // 1/m, of no less than LEAST_LENGTH_M
    Lanes* keep;         // what one substep leaves of the distance to the reference: 0 skinned
    Lanes* stiffness;    // k/m, 1/s^2
    Lanes* hinge;        // k/m times the square of the length between the middles of links, m^2/s^2
    Lanes* mass;         // of the node, in masses of an inner node
    Lanes* per_mass;     // its inverse
    Lanes* inverse_mass; // that, but 0 of a skinned node
    Lanes* outer_part;   // of a link's error corrected at node n
    Lanes* inner_part;   // ... and at node n - 1
    Lanes* clearance;    // [collider][node]: least distance to the axis, m
    Lanes* clearance_of_link; // ... of link n; COLLIDE_SEGMENT alone
    // Of the printed models alone; forest-z has its y and x axes in predicted and moment.
    Lanes3* upward;     // cascade-thesis: node n at rest in the space of link n - 1, m (printed.c)
    Lanes3* downward;   // ... and in that of link n + 2
    Angles* rest_angle; // forest-z: of joint n at rest
    Lanes* friction;    // forest-z: v of joint n over the mass of a node, m^2/s
};

// Of a collider in a substep; world axes, relative to the head's position.
typedef struct Axis {
    Vec3 from, along;           // m; along is zero of a sphere
    float inverse2;             // of along's square, 1/m^2; 0 of a sphere
    Vec3 from_move, along_move; // since the substep before, m
} Axis;

// Where what colliders are fixed to is, relative to the head's position.
typedef struct Body {
    float rotation[9]; // row-major: world = rotation * body
    Vec3 offset;       // m
} Body;

// What one substep needs besides the block.
struct Substep {
    float rotation[9];      // row-major: world = rotation * head
    Vec3 second_difference; // of the head's position, m
    float dt;               // s
    float dt2;              // s^2
    float velocity_kept;    // exp(-damping dt)
    float gravity_m_s2;     // what compensation leaves of it
    float strength;         // spring: of its stiffness, what the tilt leaves
    float drag;             // the share of a node's velocity against the air that the air takes
    Vec3 air_move;          // of the air past the head, m
    int model;              // ModelKind
    int iterations;
    bool outermost;      // forest: the head's acceleration acts on the tips alone
    float down_share;    // cascade-thesis
    bool solve_directly; // lengths
    bool collide_links;
    int collider_count;
    const Axis* axis; // of each collider
};

struct Sim {
    SimDefinition definition; // its pointers are NULL: everything was copied
    const Kernel* kernel;
    float gravity_at_rest; // m/s^2: what the rest pose was made for, whatever gravity is tuned to
    int block_count;
    Block* blocks;
    Collider* colliders;
    Body bodies[BODY_COUNT]; // at the end of the last substep
    Substep* substeps;       // of the tick
    Axis* axes;              // [substep][collider]
    Tie* ties;
    void* memory; // of all blocks
    // What is worked out anew in every substep, lent to the blocks of a gang while they are
    // stepped: [thread][block of the gang]. Were it the blocks' own, it would go to memory and back
    // with them: 16,384 strands of the cascade took 26 % longer.
    char* work;
};

static inline size_t strands_work_bytes(int nodes)
{
    return (4 * (size_t)nodes + 1) * sizeof(Lanes3);
}

static inline void strands_lend(Block* block, char* work)
{
    Lanes3* at = (Lanes3*)work;
    block->acceleration = at;
    block->direction = at + block->nodes;
    block->predicted = at + 2 * block->nodes;
    block->moment = at + 3 * block->nodes;
}

// Functions of one lane, and the loops that are given one: a call would end the vector.
#define INLINE static inline __attribute__((always_inline))

// `v` where it is above `low`, which is not negative; else `low`. Positive numbers are in the order
// of their bits, and the whole numbers' maximum is 2 cycles where compare and choose are 9
// (AVX-512), in the middle of what everything waits for: root, this, division. NaN stays or is
// `low`.
INLINE real real_at_least(real v, real low)
{
    real_bits bits, least;
    memcpy(&bits, &v, sizeof bits);
    memcpy(&least, &low, sizeof least);
    bits = bits > least ? bits : least;
    memcpy(&v, &bits, sizeof v);
    return v;
}

INLINE Real3 lane_load(const Lanes3* lanes, int lane)
{
    return (Real3){lanes->x[lane], lanes->y[lane], lanes->z[lane]};
}

INLINE void lane_store(Lanes3* lanes, int lane, Real3 v)
{
    lanes->x[lane] = v.x;
    lanes->y[lane] = v.y;
    lanes->z[lane] = v.z;
}

INLINE Real3 real3_sub(Real3 a, Real3 b)
{
    return (Real3){a.x - b.x, a.y - b.y, a.z - b.z};
}

// a + s b
INLINE Real3 real3_mad(Real3 a, Real3 b, real s)
{
    return (Real3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

INLINE Real3 real3_scale(Real3 v, real s)
{
    return (Real3){v.x * s, v.y * s, v.z * s};
}

INLINE real real3_dot(Real3 a, Real3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

INLINE Real3 real3_cross(Real3 a, Real3 b)
{
    return (Real3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline Vec3 rotate(const float m[9], Vec3 v)
{
    return vec3(m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
                m[6] * v.x + m[7] * v.y + m[8] * v.z);
}

static inline Vec3 rotate_back(const float m[9], Vec3 v)
{
    return vec3(m[0] * v.x + m[3] * v.y + m[6] * v.z, m[1] * v.x + m[4] * v.y + m[7] * v.z,
                m[2] * v.x + m[5] * v.y + m[8] * v.z);
}

static inline Vec3 lane_get(const Lanes3* lanes, int lane)
{
    return vec3((float)lanes->x[lane], (float)lanes->y[lane], (float)lanes->z[lane]);
}

static inline void lane_set(Lanes3* lanes, int lane, Vec3 v)
{
    lanes->x[lane] = (real)v.x;
    lanes->y[lane] = (real)v.y;
    lanes->z[lane] = (real)v.z;
}

// Where a point of a body is, relative to the head's position, world axes.
static inline Vec3 body_place(const Body* body, Vec3 point)
{
    return vec3_add(rotate(body->rotation, point), body->offset);
}
