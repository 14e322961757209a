#include "server/integrate.h"

// A strand in a plane of symmetry decays towards zero until its numbers are denormal, and the step
// is then six times slower (measured). Flushing them by the processor's mode would have to be done
// on every thread, and not at all on other machines; this rounds what is below 1e-18 m to zero and
// leaves everything above 0.25 mm as it is.
static inline float settle(float v)
{
    return (v + 1e-11f) - 1e-11f;
}

LANES_KERNEL void integrate_verlet(Block* block, const Substep* substep)
{
    float c = substep->velocity_kept, dt2 = substep->dt2;
    Vec3 head = substep->second_difference;
    for (int n = 0; n < block->nodes; ++n) {
        Lanes3* p = &block->position[n];
        Lanes3* previous = &block->previous[n];
        const Lanes3* a = &block->acceleration[n];
#pragma omp simd
        for (int l = 0; l < LANES; ++l) {
            float x = p->x[l], y = p->y[l], z = p->z[l];
            p->x[l] = settle(x + c * (x - previous->x[l]) + (a->x[l] * dt2 - head.x));
            p->y[l] = settle(y + c * (y - previous->y[l]) + (a->y[l] * dt2 - head.y));
            p->z[l] = settle(z + c * (z - previous->z[l]) + (a->z[l] * dt2 - head.z));
            previous->x[l] = x;
            previous->y[l] = y;
            previous->z[l] = z;
        }
    }
}
