// Keeping nodes out of the head: each node is a sphere ("pearl", Nguyen and Donnelly 2005, 23.2.2).
#pragma once

#include "server/strands.h"

// Is any lane too near? Most nodes are far from most spheres: asking first saves the square roots.
static inline bool any_near(const Lanes3* p, const real* clearance, Vec3 c)
{
    real cx = (real)c.x, cy = (real)c.y, cz = (real)c.z;
    int near = 0;
    NEAR_LOOP
    for (int l = 0; l < LANES; ++l) {
        real x = p->x[l] - cx, y = p->y[l] - cy, z = p->z[l] - cz;
        near |= x * x + y * y + z * z < clearance[l] * clearance[l];
    }
    return near != 0;
}

// Moves nodes that are too near out along the sphere's normal.
//
// The move must not become velocity, or hair lying on the head would be thrown off it: `previous`
// moves along. Of the velocity relative to the sphere only the part that goes in is taken away; the
// part along the surface stays, because hair slides.
static inline void push_out(Lanes3* p, Lanes3* previous, const real* clearance, const real* keep,
                            Vec3 c, Vec3 move)
{
    real cx = (real)c.x, cy = (real)c.y, cz = (real)c.z;
    real mx = (real)move.x, my = (real)move.y, mz = (real)move.z;
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real x = p->x[l] - cx, y = p->y[l] - cy, z = p->z[l] - cz;
        real d = real_sqrt(x * x + y * y + z * z);
        real safe = d > LEAST_LENGTH_M ? d : LEAST_LENGTH_M;
        real nx = x / safe, ny = y / safe, nz = z / safe;
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

static void collide_spheres(Block* block, const Substep* substep)
{
    for (int k = 0; k < substep->collider_count; ++k) {
        for (int n = 1; n < block->nodes; ++n) {
            const real* clearance = block->clearance[k * block->nodes + n].v;
            if (!any_near(&block->position[n], clearance, substep->centre[k])) continue;
            push_out(&block->position[n], &block->previous[n], clearance, block->keep[n].v,
                     substep->centre[k], substep->centre_move[k]);
        }
    }
}
