// A tick: the head's motion to substeps, blocks to kernels, blocks to threads.
#include "messages/trig.h"
#include "server/strands.h"

#include <omp.h>
#include <string.h>

#define FULL_DRAG_M_S 1.0f // of wind

static void meet_air(const SimDefinition* definition, Substep* substep, const SimHead* head)
{
    double speed = (double)(vec3_length(head->wind) / FULL_DRAG_M_S);
    double drag = (double)definition->drag_per_s * trig_smooth(speed);
    substep->drag = drag > 0.0 ? (float)(1.0 - trig_exp(-drag * (double)substep->dt)) : 0.0f;
    substep->air_move = vec3_sub(vec3_scale(head->wind, substep->dt), head->move);
}

// The parts of the substeps that the head's motion decides, and the wind.
static void prepare_substeps(Sim* sim, const SimHead* heads)
{
    int colliders = sim->definition.collider_count;
    for (int s = 0; s < sim->definition.substeps; ++s) {
        Substep* substep = &sim->substeps[s];
        memcpy(substep->rotation, heads[s].rotation, sizeof substep->rotation);
        substep->second_difference = heads[s].second_difference;
        meet_air(&sim->definition, substep, &heads[s]);
        Vec3* centre = sim->centres + 2 * colliders * s;
        Vec3* move = centre + colliders;
        for (int k = 0; k < colliders; ++k) {
            centre[k] = rotate(heads[s].rotation, sim->colliders[k].centre);
            move[k] = vec3_sub(centre[k], rotate(sim->rotation, sim->colliders[k].centre));
        }
        substep->centre = centre;
        substep->centre_move = move;
        memcpy(sim->rotation, heads[s].rotation, sizeof sim->rotation);
    }
}

static void step_gang(const Sim* sim, int gang, int thread)
{
    int first = gang * KERNEL_GANG, left = sim->block_count - first;
    int count = left < KERNEL_GANG ? left : KERNEL_GANG;
    size_t bytes = strands_work_bytes(sim->definition.nodes);
    for (int b = 0; b < count; ++b)
        strands_lend(&sim->blocks[first + b],
                     sim->work + bytes * (size_t)(thread * KERNEL_GANG + b));
    sim->kernel->step(&sim->blocks[first], count, sim->substeps, sim->definition.substeps);
}

void sim_step(Sim* sim, const SimHead* heads)
{
    prepare_substeps(sim, heads);
    int gangs = (sim->block_count + KERNEL_GANG - 1) / KERNEL_GANG;
    int threads = sim->definition.threads;
    // libgomp allocates a team for a nested region, even of one thread; a plain loop does not.
    if (threads <= 1 || gangs == 1 || omp_in_parallel()) {
        for (int g = 0; g < gangs; ++g)
            step_gang(sim, g, 0);
        return;
    }
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int g = 0; g < gangs; ++g)
        step_gang(sim, g, omp_get_thread_num());
}
