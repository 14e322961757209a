// Keeping links out of colliders, not their ends alone: pearls of a few millimetres leave gaps of
// centimetres between nodes, and there the middle of a link cuts the corner.
//
// The nearest points of link and axis are found as in Ericson, Real-Time Collision Detection 5.1.9;
// what the nearest point of the link has to move is shared between the link's ends by how near they
// are to it and how heavy they are, as a position-based constraint shares it.
#pragma once

#include "server/collide.h"

#define LEAST_SHARE 0.1f  // of a contact that a link's free end can move, next to a clamped end
#define STRETCHED   0.75f // half of the longest link, in rest lengths

// Whether the middle of a link is nearer to the axis than half a link and the clearance.
static inline bool any_link_near(const Block* block, int n, const real* clearance, const Axis* axis)
{
    const Lanes3 *p = &block->position[n - 1], *q = &block->position[n];
    const real* length = block->length[n].v;
    int near = 0;
    NEAR_LOOP
    for (int l = 0; l < LANES; ++l) {
        real x = (real)0.5 * (p->x[l] + q->x[l]) - (real)axis->from.x;
        real y = (real)0.5 * (p->y[l] + q->y[l]) - (real)axis->from.y;
        real z = (real)0.5 * (p->z[l] + q->z[l]) - (real)axis->from.z;
        real part = axis_part(axis, x, y, z);
        x -= part * (real)axis->along.x;
        y -= part * (real)axis->along.y;
        z -= part * (real)axis->along.z;
        real reach = clearance[l] + STRETCHED * length[l];
        near |= x * x + y * y + z * z < reach * reach;
    }
    return near != 0;
}

static inline real clamp_part(real part)
{
    part = part > 0 ? part : 0;
    return part < 1 ? part : 1;
}

static inline void push_link_out(Block* block, int n, const real* clearance, const Axis* axis)
{
    Lanes3 *p = &block->position[n - 1], *q = &block->position[n];
    Lanes3 *p_was = &block->previous[n - 1], *q_was = &block->previous[n];
    const real *inner = block->inner_part[n].v, *outer = block->outer_part[n].v;
    real ux = (real)axis->along.x, uy = (real)axis->along.y, uz = (real)axis->along.z;
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real rx = p->x[l] - (real)axis->from.x, ry = p->y[l] - (real)axis->from.y,
             rz = p->z[l] - (real)axis->from.z;
        real ex = q->x[l] - p->x[l], ey = q->y[l] - p->y[l], ez = q->z[l] - p->z[l];
        real ee = ex * ex + ey * ey + ez * ez, er = ex * rx + ey * ry + ez * rz;
        real uu = ux * ux + uy * uy + uz * uz, ur = ux * rx + uy * ry + uz * rz;
        real eu = ex * ux + ey * uy + ez * uz;
        ee = ee > RESOLVED_M * RESOLVED_M ? ee : RESOLVED_M * RESOLVED_M;
        // Of two lines, then back onto the axis, then back onto the link; lines that are as good as
        // parallel are as near anywhere, so their middle will do.
        real area = ee * uu - eu * eu;
        bool crossing = area > (real)1e-4 * ee * uu;
        real s = crossing ? clamp_part((eu * ur - uu * er) / (crossing ? area : 1)) : (real)0.5;
        real t = clamp_part((ur + s * eu) * (real)axis->inverse2);
        s = clamp_part((t * eu - er) / ee);
        real x = rx + s * ex - t * ux, y = ry + s * ey - t * uy, z = rz + s * ez - t * uz;
        real d = real_sqrt(x * x + y * y + z * z);
        real safe = d > LEAST_LENGTH_M ? d : LEAST_LENGTH_M;
        real nx = x / safe, ny = y / safe, nz = z / safe;
        real a = inner[l] * (1 - s), b = outer[l] * s;
        real sum = a * (1 - s) + b * s;
        real share = 1 / (sum > LEAST_SHARE ? sum : LEAST_SHARE);
        real vx = (1 - s) * (p->x[l] - p_was->x[l]) + s * (q->x[l] - q_was->x[l]) -
                  ((real)axis->from_move.x + t * (real)axis->along_move.x);
        real vy = (1 - s) * (p->y[l] - p_was->y[l]) + s * (q->y[l] - q_was->y[l]) -
                  ((real)axis->from_move.y + t * (real)axis->along_move.y);
        real vz = (1 - s) * (p->z[l] - p_was->z[l]) + s * (q->z[l] - q_was->z[l]) -
                  ((real)axis->from_move.z + t * (real)axis->along_move.z);
        real inward = vx * nx + vy * ny + vz * nz;
        inward = inward < 0 ? inward : 0;
        bool hit = d < clearance[l];
        real push = hit ? share * (clearance[l] - d) : 0;
        real shift = hit ? push + share * inward : 0;
        p->x[l] += a * push * nx;
        p->y[l] += a * push * ny;
        p->z[l] += a * push * nz;
        q->x[l] += b * push * nx;
        q->y[l] += b * push * ny;
        q->z[l] += b * push * nz;
        p_was->x[l] += a * shift * nx;
        p_was->y[l] += a * shift * ny;
        p_was->z[l] += a * shift * nz;
        q_was->x[l] += b * shift * nx;
        q_was->y[l] += b * shift * ny;
        q_was->z[l] += b * shift * nz;
    }
}

static void collide_links(Block* block, const Substep* substep)
{
    for (int k = 0; k < substep->collider_count; ++k)
        for (int n = 1; n < block->nodes; ++n) {
            const real* clearance = block->clearance_of_link[k * block->rows + n].v;
            if (any_link_near(block, n, clearance, &substep->axis[k]))
                push_link_out(block, n, clearance, &substep->axis[k]);
        }
}
