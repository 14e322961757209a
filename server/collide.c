#include "server/collide.h"

#include <math.h>

float collide_clearance(Sphere collider, float pearl_radius_m, Vec3 rest)
{
    return fminf(collider.radius + pearl_radius_m, vec3_length(vec3_sub(rest, collider.centre)));
}

// Is any lane too near? Most nodes are far from most spheres: asking first saves the square roots.
static inline bool any_near(const Lanes3* p, const float* clearance, Vec3 c)
{
    int near = 0;
#pragma omp simd reduction(| : near)
    for (int l = 0; l < LANES; ++l) {
        float x = p->x[l] - c.x, y = p->y[l] - c.y, z = p->z[l] - c.z;
        near |= x * x + y * y + z * z < clearance[l] * clearance[l];
    }
    return near != 0;
}

// Moves nodes that are too near out along the sphere's normal.
//
// The move must not become velocity, or hair lying on the head would be thrown off it: `previous`
// moves along. Of the velocity relative to the sphere only the part that goes in is taken away; the
// part along the surface stays, because hair slides.
static inline void push_out(Lanes3* p, Lanes3* previous, const float* clearance, const float* keep,
                            Vec3 c, Vec3 move)
{
#pragma omp simd
    for (int l = 0; l < LANES; ++l) {
        float x = p->x[l] - c.x, y = p->y[l] - c.y, z = p->z[l] - c.z;
        float d = sqrtf(x * x + y * y + z * z);
        float safe = d > 1e-9f ? d : 1e-9f;
        float nx = x / safe, ny = y / safe, nz = z / safe;
        float vx = p->x[l] - previous->x[l] - move.x;
        float vy = p->y[l] - previous->y[l] - move.y;
        float vz = p->z[l] - previous->z[l] - move.z;
        float inward = vx * nx + vy * ny + vz * nz;
        inward = inward < 0.0f ? inward : 0.0f;
        bool hit = d < clearance[l] && keep[l] > 0.0f;
        float push = hit ? clearance[l] - d : 0.0f;
        float shift = hit ? push + inward : 0.0f;
        p->x[l] += push * nx;
        p->y[l] += push * ny;
        p->z[l] += push * nz;
        previous->x[l] += shift * nx;
        previous->y[l] += shift * ny;
        previous->z[l] += shift * nz;
    }
}

LANES_KERNEL void collide_spheres(Block* block, const Substep* substep)
{
    for (int k = 0; k < substep->collider_count; ++k) {
        for (int n = 1; n < block->nodes; ++n) {
            const float* clearance = block->clearance[k * block->nodes + n].v;
            if (!any_near(&block->position[n], clearance, substep->centre[k])) continue;
            push_out(&block->position[n], &block->previous[n], clearance, block->keep[n].v,
                     substep->centre[k], substep->centre_move[k]);
        }
    }
}
