// The table of contents of the dynamics: what happens in a tick, in which order.
#include "server/collide.h"
#include "server/integrate.h"
#include "server/length.h"
#include "server/roots.h"
#include "server/shape.h"
#include "server/spring.h"

#include <omp.h>
#include <string.h>

static void step_block(Block* block, const Substep* substep)
{
    roots_place(block, substep->rotation);
    spring_accelerate(block, substep);
    integrate_verlet(block, substep);
    shape_blend(block);
    for (int i = 0; i < substep->iterations; ++i)
        length_correct(block);
    collide_spheres(block, substep);
}

// A block goes through all substeps of the tick before the next begins: it stays in the cache.
static void step_block_tick(const Sim* sim, int block)
{
    for (int s = 0; s < sim->definition.substeps; ++s)
        step_block(&sim->blocks[block], &sim->substeps[s]);
}

// The parts of the substeps that the head's motion decides.
static void prepare_substeps(Sim* sim, const SimHead* heads)
{
    int colliders = sim->definition.collider_count;
    for (int s = 0; s < sim->definition.substeps; ++s) {
        Substep* substep = &sim->substeps[s];
        memcpy(substep->rotation, heads[s].rotation, sizeof substep->rotation);
        substep->second_difference = heads[s].second_difference;
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

void sim_step(Sim* sim, const SimHead* heads)
{
    prepare_substeps(sim, heads);
    int blocks = sim->block_count, threads = sim->definition.threads;
    // libgomp allocates a team for a nested region, even of one thread; a plain loop does not.
    if (threads <= 1 || blocks == 1 || omp_in_parallel()) {
        for (int b = 0; b < blocks; ++b)
            step_block_tick(sim, b);
        return;
    }
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int b = 0; b < blocks; ++b)
        step_block_tick(sim, b);
}
