// The cascading-spaces model as printed (thesis 4.3), kept for its failures; cascade is the mended
// one.
//
// Every link n has a tangent space with its origin at node n:
//     N = along the link, B = N x T of the link before, T = N x B
// None is normalised but N. T is minus the one before, less its part along N: it flips at every
// link, (B, N, T) is left-handed, and both B and T shrink by the cosine of every bend until they
// are nothing (notes/simulation.md 4.5). So offsets across a link shrink as the strand bends.
//
// From space n a spring k draws node n + 1 up to its place in that space, and a spring r k draws
// node n - 2 down to its own; nothing pushes back on the joint. The stiffness matrix is not
// symmetric, so the strand takes energy from nothing and flutters (notes 4.3): r at most 0.05 with
// k falling as the square.
//
// "The reference nodes may be displaced upward" by m g / k, half of it each where there are two:
// with each spring's own k that is the weight of the node exactly, at every tilt, so compensation
// is leaving gravity out (sim.c), as in model_spring.h. (With one k for both, as the print may also
// be read, what is left is (1 - r) / 2 of the weight.) It takes away the tension that alone
// steadies the strand.
#pragma once

#include "server/frames.h"
#include "server/roots.h"

// The space of link n: N in direction[n], B in predicted[n], and T in place of the T before.
static inline void cascade_thesis_space(Block* block, int n, Lanes3* t)
{
    const Lanes3* d = &block->direction[n];
    Lanes3* b = &block->predicted[n];
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real nx = d->x[l], ny = d->y[l], nz = d->z[l], tx = t->x[l], ty = t->y[l], tz = t->z[l];
        real bx = ny * tz - nz * ty, by = nz * tx - nx * tz, bz = nx * ty - ny * tx;
        b->x[l] = bx;
        b->y[l] = by;
        b->z[l] = bz;
        t->x[l] = ny * bz - nz * by;
        t->y[l] = nz * bx - nx * bz;
        t->z[l] = nx * by - ny * bx;
    }
}

// A spring of `share` times `stiffness` from `node` to its place `local` (along B, N and T) in the
// space of link n.
static inline void cascade_thesis_pull(Block* block, int n, const Lanes3* t, int node,
                                       const Lanes3* local, const Lanes* stiffness, real share)
{
    const Lanes3 *d = &block->direction[n], *b = &block->predicted[n];
    const Lanes3 *origin = &block->position[n], *p = &block->position[node];
    Lanes3* a = &block->acceleration[node];
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real i = local->x[l], j = local->y[l], m = local->z[l], k = share * stiffness->v[l];
        a->x[l] += k * (origin->x[l] - p->x[l] + (i * b->x[l] + j * d->x[l] + m * t->x[l]));
        a->y[l] += k * (origin->y[l] - p->y[l] + (i * b->y[l] + j * d->y[l] + m * t->y[l]));
        a->z[l] += k * (origin->z[l] - p->z[l] + (i * b->z[l] + j * d->z[l] + m * t->z[l]));
    }
}

// "The first tangent space for the connection point on the scalp is given": node 1's place in it is
// its rest place under the head.
static inline void cascade_thesis_root(Block* block, const Substep* substep)
{
    const Lanes3 *rest = &block->rest[1], *position = &block->position[1];
    const real* k = block->stiffness[0].v;
    Lanes3* a = &block->acceleration[1];
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        Real3 to = roots_turn(substep->rotation, lane_load(rest, l)), p = lane_load(position, l);
        a->x[l] += k[l] * (to.x - p.x);
        a->y[l] += k[l] * (to.y - p.y);
        a->z[l] += k[l] * (to.z - p.z);
    }
}

static inline void cascade_thesis_fall(Block* block, const Substep* substep)
{
    for (int n = 0; n < block->nodes; ++n) {
        Lanes3* a = &block->acceleration[n];
        LANE_LOOP
        for (int l = 0; l < LANES; ++l)
            lane_store(a, l, (Real3){0, -(real)substep->gravity_m_s2, 0});
    }
}

// The torsion spring of joint n has stiffness[n]: it draws node n + 1 up and node n - 1 down.
static void cascade_thesis_accelerate(Block* block, const Substep* substep)
{
    Lanes3 t;
    roots_turn_lanes(&block->across[1], substep->rotation, &t);
    cascade_thesis_fall(block, substep);
    cascade_thesis_root(block, substep);
    for (int n = 1; n < block->nodes; ++n) {
        frames_direction(block->position, n, &block->direction[n]);
        cascade_thesis_space(block, n, &t);
        if (n + 1 < block->nodes)
            cascade_thesis_pull(block, n, &t, n + 1, &block->upward[n + 1], &block->stiffness[n],
                                1);
        if (n > 2) // node 0 is the head's
            cascade_thesis_pull(block, n, &t, n - 2, &block->downward[n - 2],
                                &block->stiffness[n - 1], (real)substep->down_share);
    }
}
