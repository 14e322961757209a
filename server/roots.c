#include "server/roots.h"

LANES_KERNEL void roots_place(Block* block, const float rotation[9])
{
    const float* m = rotation;
    for (int n = 0; n < block->nodes; ++n) {
        const Lanes3* from = &block->rest[n];
        Lanes3* to = &block->reference[n];
#pragma omp simd
        for (int l = 0; l < LANES; ++l) {
            to->x[l] = m[0] * from->x[l] + m[1] * from->y[l] + m[2] * from->z[l];
            to->y[l] = m[3] * from->x[l] + m[4] * from->y[l] + m[5] * from->z[l];
            to->z[l] = m[6] * from->x[l] + m[7] * from->y[l] + m[8] * from->z[l];
        }
    }
}
