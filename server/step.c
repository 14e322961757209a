// A tick: the head's motion to substeps, blocks to kernels, blocks to threads.
#include "server/step.h"

#include "messages/trig.h"
#include "server/models.h"
#include "server/ties.h"

#include <omp.h>
#include <string.h>

#define FULL_DRAG_M_S 1.0f // of wind

// How strong springs are under the head's tilt, k_m / k of thesis 4.4; what they do not hold of the
// weight, the strand feels. Without a share both are as they were, to the bit.
static void weigh(const Sim* sim, Substep* substep)
{
    const SimDefinition* d = &sim->definition;
    float up = 0.5f * (1.0f + substep->rotation[4]), share = d->upside_down_share;
    substep->strength = d->model == MODEL_SPRING ? share + (1.0f - share) * up : 1.0f;
    bool is_carried = d->gravity_compensation && models[d->model].drops_gravity;
    float carried = is_carried ? sim->gravity_at_rest * substep->strength : 0.0f;
    substep->gravity_m_s2 = d->gravity_m_s2 - carried;
}

static void meet_air(const SimDefinition* definition, Substep* substep, const SimHead* head)
{
    double speed = (double)(vec3_length(head->wind) / FULL_DRAG_M_S);
    double drag = (double)definition->drag_per_s * trig_smooth(speed);
    substep->drag = drag > 0.0 ? (float)(1.0 - trig_exp(-drag * (double)substep->dt)) : 0.0f;
    substep->air_move = vec3_sub(vec3_scale(head->wind, substep->dt), head->move);
}

static bool is_sphere(const Collider* c)
{
    return c->from.x == c->to.x && c->from.y == c->to.y && c->from.z == c->to.z;
}

static Axis axis_of(const Collider* c, const Body* before, const Body* now)
{
    Vec3 from = body_place(now, c->from), was = body_place(before, c->from);
    Axis axis = {.from = from, .from_move = vec3_sub(from, was)};
    if (is_sphere(c)) return axis;
    Vec3 then = vec3_sub(body_place(before, c->to), was);
    axis.along = vec3_sub(body_place(now, c->to), from);
    axis.along_move = vec3_sub(axis.along, then);
    float square = vec3_dot(axis.along, axis.along);
    axis.inverse2 = square > LEAST_LENGTH_M * LEAST_LENGTH_M ? 1.0f / square : 0.0f;
    return axis;
}

static void place_colliders(Sim* sim, Axis* axes, const SimHead* head)
{
    Body now[BODY_COUNT] = {0};
    memcpy(now[BODY_HEAD].rotation, head->rotation, sizeof head->rotation);
    now[BODY_TORSO] = now[BODY_HEAD];
    if (head->has_torso) {
        memcpy(now[BODY_TORSO].rotation, head->torso_rotation, sizeof head->torso_rotation);
        now[BODY_TORSO].offset = head->torso_offset;
    }
    if (head->torso_is_carried) sim->bodies[BODY_TORSO] = now[BODY_TORSO];
    for (int k = 0; k < sim->definition.collider_count; ++k) {
        int body = sim->colliders[k].body;
        axes[k] = axis_of(&sim->colliders[k], &sim->bodies[body], &now[body]);
    }
    memcpy(sim->bodies, now, sizeof now);
}

// The parts of the substeps that the head's motion decides, and the wind.
void step_prepare(Sim* sim, const SimHead* heads)
{
    for (int s = 0; s < sim->definition.substeps; ++s) {
        Substep* substep = &sim->substeps[s];
        memcpy(substep->rotation, heads[s].rotation, sizeof substep->rotation);
        substep->second_difference = heads[s].second_difference;
        weigh(sim, substep);
        meet_air(&sim->definition, substep, &heads[s]);
        substep->axis = sim->axes + sim->definition.collider_count * s;
        place_colliders(sim, sim->axes + sim->definition.collider_count * s, &heads[s]);
    }
}

void step_blocks(const Sim* sim, int first, int count, int thread, const Substep* substeps,
                 int substep_count)
{
    size_t bytes = strands_work_bytes(sim->definition.nodes);
    for (int b = 0; b < count; ++b)
        strands_lend(&sim->blocks[first + b],
                     sim->work + bytes * (size_t)(thread * KERNEL_GANG + b));
    sim->kernel->step(&sim->blocks[first], count, substeps, substep_count);
}

static void step_gang(const Sim* sim, int gang, int thread, const Substep* substeps, int count)
{
    int first = gang * KERNEL_GANG, left = sim->block_count - first;
    step_blocks(sim, first, left < KERNEL_GANG ? left : KERNEL_GANG, thread, substeps, count);
}

void step_all(const Sim* sim, const Substep* substeps, int count)
{
    int gangs = (sim->block_count + KERNEL_GANG - 1) / KERNEL_GANG;
    int threads = sim->definition.threads;
    // libgomp allocates a team for a nested region, even of one thread; a plain loop does not.
    if (threads <= 1 || gangs == 1 || omp_in_parallel()) {
        for (int g = 0; g < gangs; ++g)
            step_gang(sim, g, 0, substeps, count);
        return;
    }
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int g = 0; g < gangs; ++g)
        step_gang(sim, g, omp_get_thread_num(), substeps, count);
}

// Strands that are not tied to each other run through the whole tick while they are in the cache;
// tied ones wait for each other at every substep. Ties come first in it, so that colliders have the
// last word.
void sim_step(Sim* sim, const SimHead* heads)
{
    const SimDefinition* d = &sim->definition;
    step_prepare(sim, heads);
    if (d->tie_count == 0) {
        step_all(sim, sim->substeps, d->substeps);
        return;
    }
    for (int s = 0; s < d->substeps; ++s) {
        ties_hold(sim, d->iterations);
        step_all(sim, &sim->substeps[s], 1);
    }
}
