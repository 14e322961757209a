// Life of a simulation: made from a definition, reset, turned, read and hashed. Stepping: step.c.
#include "server/sim.h"

#include "messages/hairstyle.h"
#include "messages/trig.h"
#include "server/collide.h"
#include "server/length.h"
#include "server/roots.h"
#include "server/shape.h"
#include "server/spring.h"
#include "server/strands.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#define SIM_MAX_STRANDS    65536
#define SIM_MAX_NODES      256
#define SIM_MAX_SUBSTEPS   1024
#define SIM_MAX_ITERATIONS 4096

// 1600 1/s^2 falling with the square of 25 L leaves 33 at the tip of a strand of 28 cm, about what
// gravity gives a pendulum of that length, and 16 at 40 cm.
SimDefinition sim_default(void)
{
    return (SimDefinition){.rate_hz = 60.0,
                           .substeps = 4,
                           .iterations = 1,
                           .gravity_m_s2 = 9.81f,
                           .stiffness_s2 = 1600.0f,
                           .fall_off_per_m = 25.0f,
                           .fall_off_power = 2,
                           .damping_per_s = 8.0f,
                           .pearl_radius_m = 0.006f,
                           .gravity_compensation = true,
                           .threads = 1};
}

static bool in_range(double value, double low, double high, const char* name, Fault* fault)
{
    if (value >= low && value <= high) return true;
    return fault_set(fault, "simulation: %s is %g; it must be %g to %g", name, value, low, high);
}

static bool check_rest(const SimDefinition* d, Fault* fault)
{
    if (d->rest == NULL) return fault_set(fault, "simulation: rest nodes are missing");
    for (int i = 0; i < d->strands * d->nodes; ++i)
        if (!vec3_finite(d->rest[i]))
            return fault_set(fault, "simulation: rest node %d of strand %d is not finite",
                             i % d->nodes, i / d->nodes);
    for (int k = 0; k < d->collider_count; ++k)
        if (!vec3_finite(d->colliders[k].centre) || !(d->colliders[k].radius >= 0.0f))
            return fault_set(fault, "simulation: collider %d is not a sphere", k);
    return true;
}

// Verlet is stable while k dt^2 < 2 (1 + c) (notes/simulation.md 4.1); c > 0 here.
static bool check_stiffness(const SimDefinition* d, Fault* fault)
{
    double steps_hz = d->rate_hz * d->substeps;
    if (d->stiffness_s2 >= 0 && (double)d->stiffness_s2 <= 2.0 * steps_hz * steps_hz) return true;
    return fault_set(fault,
                     "simulation: stiffness_s2 is %g; %g Hz and %d substeps take 0 to %g, more of "
                     "either takes more",
                     (double)d->stiffness_s2, d->rate_hz, d->substeps, 2.0 * steps_hz * steps_hz);
}

static bool check(const SimDefinition* d, Fault* fault)
{
    return in_range(d->strands, 1, SIM_MAX_STRANDS, "strands", fault) &&
           in_range(d->nodes, 2, SIM_MAX_NODES, "nodes", fault) &&
           in_range(d->collider_count, 0, HAIRSTYLE_MAX_COLLIDERS, "colliders", fault) &&
           in_range(d->rate_hz, 1, 100000, "rate_hz", fault) &&
           in_range(d->substeps, 1, SIM_MAX_SUBSTEPS, "substeps", fault) &&
           in_range(d->iterations, 0, SIM_MAX_ITERATIONS, "iterations", fault) &&
           in_range((double)d->gravity_m_s2, -1000, 1000, "gravity_m_s2", fault) &&
           in_range((double)d->damping_per_s, 0, 1e4, "damping_per_s", fault) &&
           check_stiffness(d, fault) &&
           in_range((double)d->fall_off_per_m, 0, 1e6, "fall_off_per_m", fault) &&
           in_range(d->fall_off_power, 0, 3, "fall_off_power", fault) &&
           in_range((double)d->pearl_radius_m, 0, 1, "pearl_radius_m", fault) &&
           in_range(d->threads, 1, 256, "threads", fault) && check_rest(d, fault);
}

// Cuts `count` entries of `size` off the arena; sizes are multiples of 64, so all stay aligned.
static void* cut(char** arena, size_t count, size_t size)
{
    void* piece = *arena;
    *arena += count * size;
    return piece;
}

static size_t block_bytes(const SimDefinition* d)
{
    return (size_t)d->nodes *
           (5 * sizeof(Lanes3) + (5 + (size_t)d->collider_count) * sizeof(Lanes));
}

static void cut_block(Block* block, const SimDefinition* d, char* arena)
{
    size_t nodes = (size_t)d->nodes;
    block->nodes = d->nodes;
    block->position = cut(&arena, nodes, sizeof(Lanes3));
    block->previous = cut(&arena, nodes, sizeof(Lanes3));
    block->reference = cut(&arena, nodes, sizeof(Lanes3));
    block->acceleration = cut(&arena, nodes, sizeof(Lanes3));
    block->rest = cut(&arena, nodes, sizeof(Lanes3));
    block->length = cut(&arena, nodes, sizeof(Lanes));
    block->keep = cut(&arena, nodes, sizeof(Lanes));
    block->stiffness = cut(&arena, nodes, sizeof(Lanes));
    block->outer_part = cut(&arena, nodes, sizeof(Lanes));
    block->inner_part = cut(&arena, nodes, sizeof(Lanes));
    block->clearance = cut(&arena, nodes * (size_t)d->collider_count, sizeof(Lanes));
}

static float weight_of(const SimDefinition* d, int strand, int node)
{
    if (node == 0) return 0.0f;
    return d->weight == NULL ? 1.0f : (float)d->weight[strand * d->nodes + node] / 255.0f;
}

static void fill_node(Block* block, const SimDefinition* d, int strand, int lane, int n)
{
    const Vec3* rest = d->rest + (size_t)strand * (size_t)d->nodes;
    float weight = weight_of(d, strand, n);
    lane_set(&block->rest[n], lane, rest[n]);
    block->keep[n].v[lane] = shape_keep(weight, 1.0 / (d->rate_hz * d->substeps));
    for (int k = 0; k < d->collider_count; ++k)
        block->clearance[k * d->nodes + n].v[lane] =
            collide_clearance(d->colliders[k], d->pearl_radius_m, rest[n]);
    float from_root = 0.0f;
    for (int k = 1; k <= n; ++k)
        from_root += vec3_length(vec3_sub(rest[k], rest[k - 1]));
    block->stiffness[n].v[lane] = spring_stiffness(d, from_root);
    if (n == 0) return;
    block->length[n].v[lane] = vec3_length(vec3_sub(rest[n], rest[n - 1]));
    length_shares(&block->inner_part[n].v[lane], &block->outer_part[n].v[lane],
                  weight_of(d, strand, n - 1) == 0.0f, weight == 0.0f);
}

static void fill_block(Block* block, const SimDefinition* d, int first)
{
    for (int lane = 0; lane < LANES; ++lane) {
        int strand = first + lane < d->strands ? first + lane : d->strands - 1;
        for (int n = 0; n < d->nodes; ++n)
            fill_node(block, d, strand, lane, n);
    }
}

static void fill_substeps(Sim* sim)
{
    const SimDefinition* d = &sim->definition;
    double dt = 1.0 / (d->rate_hz * d->substeps);
    for (int s = 0; s < d->substeps; ++s)
        sim->substeps[s] =
            (Substep){.dt2 = (float)(dt * dt),
                      .velocity_kept = (float)trig_exp(-(double)d->damping_per_s * dt),
                      .gravity_m_s2 = spring_gravity(d),
                      .iterations = d->iterations,
                      .collider_count = d->collider_count};
}

static bool allocate(Sim* sim, const SimDefinition* d)
{
    size_t colliders = (size_t)d->collider_count;
    sim->block_count = (d->strands + LANES - 1) / LANES;
    sim->blocks = calloc((size_t)sim->block_count, sizeof *sim->blocks);
    sim->memory = aligned_alloc(64, (size_t)sim->block_count * block_bytes(d));
    sim->substeps = calloc((size_t)d->substeps, sizeof *sim->substeps);
    sim->colliders = calloc(colliders + 1, sizeof *sim->colliders);
    sim->centres = calloc(2 * colliders * (size_t)d->substeps + 1, sizeof *sim->centres);
    return sim->blocks && sim->memory && sim->substeps && sim->colliders && sim->centres;
}

static void fill(Sim* sim, const SimDefinition* d)
{
    memset(sim->memory, 0, (size_t)sim->block_count * block_bytes(d));
    for (int b = 0; b < sim->block_count; ++b) {
        cut_block(&sim->blocks[b], d, (char*)sim->memory + (size_t)b * block_bytes(d));
        fill_block(&sim->blocks[b], d, b * LANES);
    }
    for (int k = 0; k < d->collider_count; ++k)
        sim->colliders[k] = d->colliders[k];
    sim->definition = *d;
    sim->definition.rest = NULL;
    sim->definition.weight = NULL;
    sim->definition.colliders = NULL;
    fill_substeps(sim);
    sim_reset(sim, (const float[9]){1, 0, 0, 0, 1, 0, 0, 0, 1});
}

Sim* sim_create(const SimDefinition* definition, Fault* fault)
{
    if (!check(definition, fault)) return NULL;
    Sim* sim = calloc(1, sizeof *sim);
    if (sim == NULL || !allocate(sim, definition)) {
        sim_destroy(sim);
        fault_set(fault, "simulation: no memory for %d strands of %d nodes", definition->strands,
                  definition->nodes);
        return NULL;
    }
    fill(sim, definition);
    return sim;
}

void sim_destroy(Sim* sim)
{
    if (sim == NULL) return;
    free(sim->blocks);
    free(sim->memory);
    free(sim->substeps);
    free(sim->colliders);
    free(sim->centres);
    free(sim);
}

void sim_reset(Sim* sim, const float rotation[9])
{
    memcpy(sim->rotation, rotation, sizeof sim->rotation);
    for (int b = 0; b < sim->block_count; ++b) {
        Block* block = &sim->blocks[b];
        roots_place(block, rotation);
        size_t bytes = (size_t)block->nodes * sizeof(Lanes3);
        memcpy(block->position, block->reference, bytes);
        memcpy(block->previous, block->reference, bytes);
    }
}

void sim_turn(Sim* sim, const float turn[9])
{
    for (int b = 0; b < sim->block_count; ++b) {
        Block* block = &sim->blocks[b];
        for (int n = 0; n < block->nodes; ++n)
            for (int l = 0; l < LANES; ++l) {
                lane_set(&block->position[n], l, rotate(turn, lane_get(&block->position[n], l)));
                lane_set(&block->previous[n], l, rotate(turn, lane_get(&block->previous[n], l)));
            }
    }
    float turned[9];
    for (int i = 0; i < 9; ++i)
        turned[i] = turn[i / 3 * 3] * sim->rotation[i % 3] +
                    turn[i / 3 * 3 + 1] * sim->rotation[i % 3 + 3] +
                    turn[i / 3 * 3 + 2] * sim->rotation[i % 3 + 6];
    memcpy(sim->rotation, turned, sizeof turned);
}

// A skinned node is where it is at rest, to the bit; turning it forth and back would round.
static void read_strand(const Block* block, int lane, const float rotation[9], bool project,
                        Vec3* strand)
{
    bool skinned[SIM_MAX_NODES];
    float lengths[SIM_MAX_NODES];
    for (int n = 0; n < block->nodes; ++n) {
        skinned[n] = block->keep[n].v[lane] == 0.0f;
        lengths[n] = block->length[n].v[lane];
        strand[n] = skinned[n] ? lane_get(&block->rest[n], lane)
                               : rotate_back(rotation, lane_get(&block->position[n], lane));
    }
    if (project) length_project(strand, block->nodes, lengths, skinned);
}

void sim_positions(const Sim* sim, const float rotation[9], bool project, Vec3* positions)
{
    int nodes = sim->definition.nodes;
    for (int s = 0; s < sim->definition.strands; ++s)
        read_strand(&sim->blocks[s / LANES], s % LANES, rotation, project,
                    positions + (size_t)s * (size_t)nodes);
}

void sim_state(const Sim* sim, Vec3* positions, Vec3* previous)
{
    int nodes = sim->definition.nodes;
    for (int i = 0; i < sim->definition.strands * nodes; ++i) {
        const Block* block = &sim->blocks[i / nodes / LANES];
        positions[i] = lane_get(&block->position[i % nodes], i / nodes % LANES);
        previous[i] = lane_get(&block->previous[i % nodes], i / nodes % LANES);
    }
}

void sim_hash(const Sim* sim, void* hash_state)
{
    int nodes = sim->definition.nodes;
    for (int i = 0; i < sim->definition.strands * nodes; ++i) {
        const Block* block = &sim->blocks[i / nodes / LANES];
        Vec3 node[2] = {lane_get(&block->position[i % nodes], i / nodes % LANES),
                        lane_get(&block->previous[i % nodes], i / nodes % LANES)};
        XXH64_update(hash_state, node, sizeof node);
    }
}
