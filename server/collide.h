// Keeping nodes out of the head and the torso: each node is a sphere ("pearl", Nguyen and Donnelly
// 2005, 23.2.2), each collider a sphere or a capsule. Links between nodes: collide_links.h.
#pragma once

#include "server/strands.h"

// Where along a collider's axis a point is, 0 to 1; (x, y, z) from the axis's first end.
static inline real axis_part(const Axis* axis, real x, real y, real z)
{
    real part = (x * (real)axis->along.x + y * (real)axis->along.y + z * (real)axis->along.z) *
                (real)axis->inverse2;
    part = part > 0 ? part : 0;
    return part < 1 ? part : 1;
}

// Is any lane too near? Most nodes are far from most colliders: asking first saves the square
// roots. A sphere is asked without the axis it has not.
static inline bool any_near(const Lanes3* p, const real* clearance, const Axis* axis,
                            bool is_sphere)
{
    real ax = (real)axis->from.x, ay = (real)axis->from.y, az = (real)axis->from.z;
    real ux = (real)axis->along.x, uy = (real)axis->along.y, uz = (real)axis->along.z;
    int near = 0;
    NEAR_LOOP
    for (int l = 0; l < LANES; ++l) {
        real x = p->x[l] - ax, y = p->y[l] - ay, z = p->z[l] - az;
        real part = is_sphere ? 0 : axis_part(axis, x, y, z);
        x -= part * ux;
        y -= part * uy;
        z -= part * uz;
        near |= x * x + y * y + z * z < clearance[l] * clearance[l];
    }
    return near != 0;
}

// Moves nodes that are too near out along the collider's normal.
//
// The move must not become velocity, or hair lying on the head would be thrown off it: `previous`
// moves along. Of the velocity relative to the collider only the part that goes in is taken away;
// the part along the surface stays, because hair slides.
static inline void push_out(Lanes3* p, Lanes3* previous, const real* clearance, const real* keep,
                            const Axis* axis)
{
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real x = p->x[l] - (real)axis->from.x, y = p->y[l] - (real)axis->from.y,
             z = p->z[l] - (real)axis->from.z;
        real part = axis_part(axis, x, y, z);
        x -= part * (real)axis->along.x;
        y -= part * (real)axis->along.y;
        z -= part * (real)axis->along.z;
        real d = real_sqrt(x * x + y * y + z * z);
        real safe = d > LEAST_LENGTH_M ? d : LEAST_LENGTH_M;
        real nx = x / safe, ny = y / safe, nz = z / safe;
        real mx = (real)axis->from_move.x + part * (real)axis->along_move.x;
        real my = (real)axis->from_move.y + part * (real)axis->along_move.y;
        real mz = (real)axis->from_move.z + part * (real)axis->along_move.z;
        real vx = p->x[l] - previous->x[l] - mx;
        real vy = p->y[l] - previous->y[l] - my;
        real vz = p->z[l] - previous->z[l] - mz;
        real inward = vx * nx + vy * ny + vz * nz;
        inward = inward < 0 ? inward : 0;
        bool hit = d < clearance[l] && keep[l] > 0;
        real push = hit ? clearance[l] - d : 0;
        real shift = hit ? push + inward : 0;
        p->x[l] += push * nx;
        p->y[l] += push * ny;
        p->z[l] += push * nz;
        previous->x[l] += shift * nx;
        previous->y[l] += shift * ny;
        previous->z[l] += shift * nz;
    }
}

static void collide_nodes(Block* block, const Substep* substep)
{
    for (int k = 0; k < substep->collider_count; ++k) {
        const Axis* axis = &substep->axis[k];
        for (int n = 1; n < block->nodes; ++n) {
            const real* clearance = block->clearance[k * block->rows + n].v;
            bool is_near = axis->inverse2 > 0
                               ? any_near(&block->position[n], clearance, axis, false)
                               : any_near(&block->position[n], clearance, axis, true);
            if (is_near)
                push_out(&block->position[n], &block->previous[n], clearance, block->keep[n].v,
                         axis);
        }
    }
}
