#include "server/spring.h"

float spring_stiffness(const SimDefinition* definition, float from_root_m)
{
    float reach = definition->fall_off_per_m * from_root_m;
    float stiffness = definition->stiffness_s2;
    for (int a = 0; a < definition->fall_off_power && reach > 1.0f; ++a)
        stiffness /= reach;
    return stiffness;
}

float spring_gravity(const SimDefinition* definition)
{
    return definition->gravity_compensation ? 0.0f : definition->gravity_m_s2;
}

LANES_KERNEL void spring_accelerate(Block* block, const Substep* substep)
{
    float gravity = substep->gravity_m_s2;
    for (int n = 0; n < block->nodes; ++n) {
        const Lanes* k = &block->stiffness[n];
        const Lanes3* p = &block->position[n];
        const Lanes3* reference = &block->reference[n];
        Lanes3* a = &block->acceleration[n];
#pragma omp simd
        for (int l = 0; l < LANES; ++l) {
            a->x[l] = k->v[l] * (reference->x[l] - p->x[l]);
            a->y[l] = k->v[l] * (reference->y[l] - p->y[l]) - gravity;
            a->z[l] = k->v[l] * (reference->z[l] - p->z[l]);
        }
    }
}
