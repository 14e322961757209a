#include "server/shape.h"

#include "messages/trig.h"

float shape_keep(float weight, double dt_s)
{
    if (weight <= 0.0f) return 0.0f;
    if (weight >= 1.0f) return 1.0f;
    return (float)trig_pow((double)weight, 60.0 * dt_s);
}

LANES_KERNEL void shape_blend(Block* block)
{
    for (int n = 0; n < block->nodes; ++n) {
        Lanes3* p = &block->position[n];
        const Lanes3* reference = &block->reference[n];
        const float* keep = block->keep[n].v;
        // Three ways, so that 1 leaves the node's bits alone and 0 forgets even a NaN.
#pragma omp simd
        for (int l = 0; l < LANES; ++l) {
            float k = keep[l], rx = reference->x[l], ry = reference->y[l], rz = reference->z[l];
            float x = rx + k * (p->x[l] - rx);
            float y = ry + k * (p->y[l] - ry);
            float z = rz + k * (p->z[l] - rz);
            x = k == 0.0f ? rx : x;
            y = k == 0.0f ? ry : y;
            z = k == 0.0f ? rz : z;
            p->x[l] = k == 1.0f ? p->x[l] : x;
            p->y[l] = k == 1.0f ? p->y[l] : y;
            p->z[l] = k == 1.0f ? p->z[l] : z;
        }
    }
}
