// The frame of every link, and from it where the next link would point if its joint were at rest.
//
// A link's frame is (d, u, d x u): its direction and an axis carried along. From link to link the
// axis is transported by the least rotation that takes the predicted direction a to the actual one
// d,
//     T v = (a.d) v + b x v + b (b.v) / (1 + a.d),  b = a x d     (Bergou et al. 2008,
//     section 4.2.2)
// so a strand turns without twist and keeps its rest curls. The tangent spaces as printed (thesis
// 4.3) flip at every link, are left-handed, and shrink as the strand bends
// (notes/simulation.md 4.5); this has no event but at 180 degrees, where the axis is kept as it is.
//
// Built anew from the root each time: nothing drifts.
#pragma once

#include "server/strands.h"

#define FOLDED 1e-4f // 1 + cos of an angle taken for 180 degrees

// way of link n, and its direction in `d`
static inline void frames_direction(const Block* block, int n, Lanes3* d)
{
    const Lanes3* p = &block->position[n - 1];
    const Lanes3* q = &block->position[n];
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real x = q->x[l] - p->x[l], y = q->y[l] - p->y[l], z = q->z[l] - p->z[l];
        real length = real_sqrt(x * x + y * y + z * z);
        real inverse = 1 / (length > LEAST_LENGTH_M ? length : LEAST_LENGTH_M);
        d->x[l] = x * inverse;
        d->y[l] = y * inverse;
        d->z[l] = z * inverse;
    }
}

// The head is the frame before link 1: `along` and `across` of it are in head space.
static inline void frames_of_head(const Lanes3* from, const float rotation[9], Lanes3* to)
{
    real m[9];
    for (int i = 0; i < 9; ++i)
        m[i] = (real)rotation[i];
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        to->x[l] = m[0] * from->x[l] + m[1] * from->y[l] + m[2] * from->z[l];
        to->y[l] = m[3] * from->x[l] + m[4] * from->y[l] + m[5] * from->z[l];
        to->z[l] = m[6] * from->x[l] + m[7] * from->y[l] + m[8] * from->z[l];
    }
}

// `local` of the frame (d, u, d x u), in world axes.
static inline void frames_apply(const Lanes3* local, const Lanes3* d, const Lanes3* u, Lanes3* to)
{
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real dx = d->x[l], dy = d->y[l], dz = d->z[l], ux = u->x[l], uy = u->y[l], uz = u->z[l];
        real wx = dy * uz - dz * uy, wy = dz * ux - dx * uz, wz = dx * uy - dy * ux;
        real i = local->x[l], j = local->y[l], k = local->z[l];
        to->x[l] = i * dx + j * ux + k * wx;
        to->y[l] = i * dy + j * uy + k * wy;
        to->z[l] = i * dz + j * uz + k * wz;
    }
}

// Takes `u` along by the rotation from `a` to `d`.
static inline void frames_transport(Lanes3* u, const Lanes3* a, const Lanes3* d)
{
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real ax = a->x[l], ay = a->y[l], az = a->z[l], dx = d->x[l], dy = d->y[l], dz = d->z[l];
        real bx = ay * dz - az * dy, by = az * dx - ax * dz, bz = ax * dy - ay * dx;
        real c = ax * dx + ay * dy + az * dz, ux = u->x[l], uy = u->y[l], uz = u->z[l];
        real f = (bx * ux + by * uy + bz * uz) / (1 + c > FOLDED ? 1 + c : FOLDED);
        u->x[l] = c * ux + (by * uz - bz * uy) + bx * f;
        u->y[l] = c * uy + (bz * ux - bx * uz) + by * f;
        u->z[l] = c * uz + (bx * uy - by * ux) + bz * f;
    }
}

// Fills direction, predicted and moment of every link; of the moment what carries the weight at
// rest.
static void frames_follow(Block* block, const Substep* substep)
{
    Lanes3 u, next;
    for (int n = 1; n < block->nodes; ++n) {
        Lanes3* d = &block->direction[n];
        Lanes3* a = &block->predicted[n];
        const Lanes3* before = &block->direction[n - 1];
        if (n == 1) {
            frames_of_head(&block->along[1], substep->rotation, a);
            frames_of_head(&block->across[1], substep->rotation, &next);
            frames_of_head(&block->carried[1], substep->rotation, &block->moment[1]);
        } else {
            frames_apply(&block->along[n], before, &u, a);
            frames_apply(&block->across[n], before, &u, &next);
            frames_apply(&block->carried[n], before, &u, &block->moment[n]);
        }
        frames_direction(block, n, d);
        u = next;
        frames_transport(&u, a, d);
    }
}
