// How strands lie in memory: blocks of 16, one strand a lane, nodes in order.
//
// The links of a strand must be corrected one after another, so a vector cannot run along a strand;
// sixteen strands are independent, so it runs across them (notes/simulation.md section 5: 23 times
// the speed of strand after strand, and the same bits at any width, because no sum changes order).
// Lanes beyond the last strand repeat the last strand: every lane is sound, nothing is 0 / 0, and
// no loop asks which lanes are real.
#pragma once

#include "server/sim.h"

#define LANES 16

// One clone of each kernel per instruction set, chosen when the program starts. Only + - * / and
// sqrt are used and nothing is contracted, so every clone gives the same bits. Clang 14 names its
// clones in a way other files cannot call, so with it the baseline is built.
#if defined(__x86_64__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define LANES_KERNEL __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define LANES_KERNEL
#endif

typedef struct Lanes {
    float v[LANES];
} Lanes;

typedef struct Lanes3 {
    float x[LANES], y[LANES], z[LANES];
} Lanes3;

// Sixteen strands. Every array has one entry per node; `length` and the shares of node n belong to
// the link from n - 1 to n, so entry 0 is unused.
typedef struct Block {
    int nodes;
    // State: world axes, relative to the head's position, m.
    Lanes3* position;
    Lanes3* previous; // one substep ago
    // Within a substep.
    Lanes3* reference;    // where rest is now
    Lanes3* acceleration; // m/s^2
    // Constants.
    Lanes3* rest;      // head space, m
    Lanes* length;     // m
    Lanes* keep;       // what one substep leaves of the distance to the reference: 0 skinned
    Lanes* stiffness;  // k/m, 1/s^2
    Lanes* outer_part; // of a link's error corrected at node n
    Lanes* inner_part; // ... and at node n - 1
    Lanes* clearance;  // [collider][node]: least distance to the centre, m
} Block;

// What one substep needs besides the block.
typedef struct Substep {
    float rotation[9];      // row-major: world = rotation * head
    Vec3 second_difference; // of the head's position, m
    float dt2;              // s^2
    float velocity_kept;    // exp(-damping dt)
    float gravity_m_s2;     // what compensation leaves of it
    int iterations;
    int collider_count;
    const Vec3* centre;      // of each collider now, world axes
    const Vec3* centre_move; // since the substep before
} Substep;

struct Sim {
    SimDefinition definition; // its pointers are NULL: everything was copied
    int block_count;
    Block* blocks;
    Sphere* colliders;
    float rotation[9]; // of the head at the end of the last substep
    Substep* substeps; // of the tick
    Vec3* centres;     // [substep][collider], then as many moves
    void* memory;      // of all blocks
};

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
    return vec3(lanes->x[lane], lanes->y[lane], lanes->z[lane]);
}

static inline void lane_set(Lanes3* lanes, int lane, Vec3 v)
{
    lanes->x[lane] = v.x;
    lanes->y[lane] = v.y;
    lanes->z[lane] = v.z;
}
