// Life of a simulation: made from a definition, reset, turned, read and hashed. Stepping: step.c.
#include "server/sim.h"

#include "messages/hairstyle.h"
#include "messages/trig.h"
#include "server/models.h"
#include "server/printed.h"
#include "server/project.h"
#include "server/span.h"
#include "server/strands.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#define SIM_MAX_STRANDS    65536
#define SIM_MAX_NODES      256
#define SIM_MAX_TIES       1048576
#define SIM_MAX_SUBSTEPS   1024
#define SIM_MAX_ITERATIONS 4096

SimDefinition sim_default(void)
{
    SimDefinition definition = {.rate_hz = 60.0,
                                .substeps = 4,
                                .iterations = 1,
                                .gravity_m_s2 = 9.81f,
                                .fall_off_per_m = 16.0f,
                                .damping_per_s = 8.0f,
                                .drag_per_s = 1.0f,
                                .joint_damping_per_s = 60.0f,
                                .upside_down_share = 1.0f,
                                .down_share = 0.05f,
                                .collide = COLLIDE_PEARL,
                                .pearl_radius_m = 0.006f,
                                .gravity_compensation = true,
                                .tip_mass = 1.0f,
                                .outermost = true,
                                .threads = 1};
    model_use(&definition, MODEL_SPRING);
    return definition;
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
    return true;
}

static bool check_colliders(const SimDefinition* d, Fault* fault)
{
    if ((int)d->length < 0 || d->length >= LENGTH_COUNT)
        return fault_set(fault, "simulation: length stage %d is unknown", (int)d->length);
    if ((int)d->collide < 0 || d->collide >= COLLIDE_COUNT)
        return fault_set(fault, "simulation: collide %d is unknown", (int)d->collide);
    for (int k = 0; k < d->collider_count; ++k) {
        const Collider* c = &d->colliders[k];
        if (!vec3_finite(c->from) || !vec3_finite(c->to) || !(c->radius >= 0.0f) || c->body < 0 ||
            c->body >= BODY_COUNT)
            return fault_set(fault, "simulation: collider %d is neither sphere nor capsule", k);
    }
    return true;
}

static bool check_tie(const SimDefinition* d, const Tie* tie)
{
    for (int end = 0; end < 2; ++end)
        if (tie->strand[end] < 0 || tie->strand[end] >= d->strands || tie->node[end] < 0 ||
            tie->node[end] >= d->nodes)
            return false;
    bool is_loop = tie->strand[0] == tie->strand[1] && tie->node[0] == tie->node[1];
    return !is_loop && tie->length_m >= 0.0f && tie->length_m <= LOST_M;
}

static bool check_ties(const SimDefinition* d, Fault* fault)
{
    for (int i = 0; i < d->tie_count; ++i)
        if (!check_tie(d, &d->ties[i]))
            return fault_set(
                fault, "simulation: tie %d does not join two of the %d x %d nodes by a length", i,
                d->strands, d->nodes);
    return true;
}

static bool check_model(const SimDefinition* d, Fault* fault)
{
    if ((int)d->model < 0 || d->model >= MODEL_COUNT)
        return fault_set(fault, "simulation: model %d is unknown", (int)d->model);
    return kernel_find(d->kernel) != NULL ||
           fault_set(fault, "simulation: kernel \"%s\" is not to be had here; it must be one of %s",
                     d->kernel, kernel_names());
}

// What sim_tune may change.
static bool check_tuned(const SimDefinition* d, Fault* fault)
{
    return in_range(d->iterations, 0, SIM_MAX_ITERATIONS, "iterations", fault) &&
           in_range((double)d->gravity_m_s2, -1000, 1000, "gravity_m_s2", fault) &&
           in_range((double)d->damping_per_s, 0, 1e4, "damping_per_s", fault) &&
           in_range((double)d->drag_per_s, 0, 1e4, "drag_per_s", fault) &&
           in_range((double)d->stiffness_s2, 0, 1e12, "stiffness_s2", fault) &&
           in_range((double)d->joint_damping_per_s, 0, 1e6, "joint_damping_per_s", fault) &&
           in_range((double)d->pearl_radius_m, 0, 1, "pearl_radius_m", fault) &&
           (d->force || model_is_stable(d, fault));
}

static bool check(const SimDefinition* d, Fault* fault)
{
    return check_model(d, fault) && in_range(d->strands, 1, SIM_MAX_STRANDS, "strands", fault) &&
           in_range(d->nodes, 2, SIM_MAX_NODES, "nodes", fault) &&
           in_range(d->collider_count, 0, HAIRSTYLE_MAX_COLLIDERS, "colliders", fault) &&
           in_range(d->tie_count, 0, SIM_MAX_TIES, "ties", fault) &&
           in_range(d->rate_hz, 1, 100000, "rate_hz", fault) &&
           in_range(d->substeps, 1, SIM_MAX_SUBSTEPS, "substeps", fault) && check_tuned(d, fault) &&
           in_range((double)d->upside_down_share, 0, 1, "upside_down_share", fault) &&
           in_range((double)d->down_share, 0, d->force ? 10 : 1, "down_share", fault) &&
           in_range((double)d->tip_mass, 0.01, 100, "tip_mass", fault) &&
           in_range((double)d->fall_off_per_m, 0, 1e6, "fall_off_per_m", fault) &&
           in_range(d->fall_off_power, 0, 3, "fall_off_power", fault) &&
           in_range(d->threads, 1, 256, "threads", fault) && check_rest(d, fault) &&
           check_colliders(d, fault) && check_ties(d, fault);
}

// Cuts `count` entries of `size` off the arena; sizes are multiples of 64, so all stay aligned.
static void* cut(char** arena, size_t count, size_t size)
{
    void* piece = *arena;
    *arena += count * size;
    return piece;
}

// Of nodes, and of links where those collide.
static size_t clearances(const SimDefinition* d)
{
    return (size_t)d->collider_count * (d->collide == COLLIDE_SEGMENT ? 2 : 1);
}

static size_t block_bytes(const SimDefinition* d)
{
    return (size_t)d->nodes *
           (10 * sizeof(Lanes3) + 3 * sizeof(Angles) + (13 + clearances(d)) * sizeof(Lanes));
}

static void cut_block(Block* block, const SimDefinition* d, char* arena)
{
    size_t nodes = (size_t)d->nodes;
    block->nodes = d->nodes;
    block->rows = d->nodes;
    Lanes3** vectors[] = {&block->position, &block->previous, &block->reference, &block->rest,
                          &block->along,    &block->across,   &block->carried};
    for (size_t i = 0; i < sizeof vectors / sizeof vectors[0]; ++i)
        *vectors[i] = cut(&arena, nodes, sizeof(Lanes3));
    Lanes** numbers[] = {&block->length,    &block->per_length, &block->keep,
                         &block->stiffness, &block->hinge,      &block->mass,
                         &block->per_mass,  &block->outer_part, &block->inner_part};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; ++i)
        *numbers[i] = cut(&arena, nodes, sizeof(Lanes));
    block->clearance = cut(&arena, nodes * clearances(d), sizeof(Lanes));
    block->clearance_of_link = block->clearance + d->collider_count * d->nodes;
    // Last, so that they lie in nobody else's way.
    Lanes3** places[] = {&block->upward, &block->downward};
    for (size_t i = 0; i < sizeof places / sizeof places[0]; ++i)
        *places[i] = cut(&arena, nodes, sizeof(Lanes3));
    Angles** angles[] = {&block->angle, &block->rate, &block->rest_angle};
    for (size_t i = 0; i < sizeof angles / sizeof angles[0]; ++i)
        *angles[i] = cut(&arena, nodes, sizeof(Angles));
    Lanes** others[] = {&block->friction, &block->inverse_mass, &block->pivot, &block->tension};
    for (size_t i = 0; i < sizeof others / sizeof others[0]; ++i)
        *others[i] = cut(&arena, nodes, sizeof(Lanes));
}

static float weight_of(const SimDefinition* d, int strand, int node)
{
    if (node == 0) return 0.0f;
    return d->weight == NULL ? 1.0f : (float)d->weight[strand * d->nodes + node] / 255.0f;
}

static double mass_of(const SimDefinition* d, int node)
{
    return node == d->nodes - 1 ? (double)d->tip_mass : 1.0;
}

// What one substep leaves of a node's distance to its reference: weight^(60 dt), so that a weight
// means the same at every rate (the share skinned in 1/60 s is 1 - weight).
static float keep_of(const SimDefinition* d, float weight)
{
    if (weight <= 0.0f) return 0.0f;
    if (weight >= 1.0f) return 1.0f;
    return (float)trig_pow((double)weight, 60.0 / (d->rate_hz * d->substeps));
}

// How near a node may come to a collider's axis: the collider's radius plus the pearl's, but never
// more than its distance at rest: a groom whose rest pose dips into the head keeps its rest pose
// instead of being blown off it. So with links.
static float clearance_at(const SimDefinition* d, const Collider* collider, float distance_at_rest)
{
    float pearl = d->collide == COLLIDE_POINT ? 0.0f : d->pearl_radius_m;
    return fminf(collider->radius + pearl, distance_at_rest);
}

static void fill_clearance(Block* block, const SimDefinition* d, const Vec3* rest, int lane, int n)
{
    for (int k = 0; k < d->collider_count; ++k) {
        const Collider* c = &d->colliders[k];
        Span axis = {c->from, c->to}, link = {rest[n - (n > 0)], rest[n]};
        int at = k * d->nodes + n;
        block->clearance[at].v[lane] = (real)clearance_at(d, c, span_to_point(axis, rest[n]));
        if (d->collide == COLLIDE_SEGMENT)
            block->clearance_of_link[at].v[lane] =
                (real)clearance_at(d, c, span_to_span(axis, link));
    }
}

static Vec3 link_of(const Vec3* rest, int n)
{
    return vec3_sub(rest[n], rest[n - 1]);
}

static float reach_of(const Vec3* rest, int n)
{
    float from_root = 0.0f;
    for (int k = 1; k <= n; ++k)
        from_root += vec3_length(link_of(rest, k));
    return from_root;
}

static double inverse_mass(const SimDefinition* d, int strand, int n)
{
    return weight_of(d, strand, n) == 0.0f ? 0.0 : 1.0 / mass_of(d, n);
}

// How a link's error is shared between its ends (thesis 4.2 with the sign that pulls a stretched
// link together): by inverse mass, all at the free end where the other is skinned, none between
// skinned ones.
static void fill_shares(Block* block, const SimDefinition* d, int strand, int lane, int n)
{
    double inner = inverse_mass(d, strand, n - 1), outer = inverse_mass(d, strand, n);
    double sum = inner + outer > 0.0 ? inner + outer : 1.0;
    block->inner_part[n].v[lane] = (real)(inner / sum);
    block->outer_part[n].v[lane] = (real)(outer / sum);
}

// K of joint n over the mass of a node: k/m d^2, d from the middle of one link to that of the next.
// A clamped root has half a link to bend, so it is twice as stiff (notes/simulation.md 1); as
// printed the forest knows no clamp.
static void fill_hinge(Block* block, const SimDefinition* d, const Vec3* rest, int lane, int n)
{
    double k = (double)model_stiffness(d, reach_of(rest, n - 1));
    double length = (double)vec3_length(link_of(rest, n));
    if (n > 1) length = 0.5 * (length + (double)vec3_length(link_of(rest, n - 1)));
    double clamp = n == 1 && d->model != MODEL_FOREST_Z ? 2.0 : 1.0;
    block->hinge[n].v[lane] = (real)(clamp * k * length * length);
}

// What sim_tune may change.
static void fill_tuned(Block* block, const SimDefinition* d, const Vec3* rest, int lane)
{
    for (int n = 0; n < d->nodes; ++n) {
        fill_clearance(block, d, rest, lane, n);
        block->stiffness[n].v[lane] = (real)model_stiffness(d, reach_of(rest, n));
        if (n > 0) fill_hinge(block, d, rest, lane, n);
    }
}

static void fill_node(Block* block, const SimDefinition* d, int strand, int lane, int n)
{
    const Vec3* rest = d->rest + (size_t)strand * (size_t)d->nodes;
    lane_set(&block->rest[n], lane, rest[n]);
    block->keep[n].v[lane] = (real)keep_of(d, weight_of(d, strand, n));
    block->mass[n].v[lane] = (real)mass_of(d, n);
    block->inverse_mass[n].v[lane] = (real)inverse_mass(d, strand, n);
    block->per_mass[n].v[lane] = 1 / block->mass[n].v[lane];
    if (n == 0) return;
    real length = (real)vec3_length(link_of(rest, n));
    block->length[n].v[lane] = length;
    block->per_length[n].v[lane] = 1 / (length > LEAST_LENGTH_M ? length : LEAST_LENGTH_M);
    fill_shares(block, d, strand, lane, n);
}

// A vector in the frame (d, u, d x u).
static Vec3 into_frame(Vec3 v, Vec3 d, Vec3 u)
{
    return vec3(vec3_dot(v, d), vec3_dot(v, u), vec3_dot(v, vec3_cross(d, u)));
}

static Vec3 across(Vec3 d)
{
    Vec3 axis = fabsf(d.x) < 0.6f ? vec3(1, 0, 0) : vec3(0, 0, 1);
    return vec3_normalise_or(vec3_mad(axis, d, -vec3_dot(axis, d)), vec3(0, 0, 1));
}

// What the joints need to carry the weight of the strand at rest. From the tip in, link n is in
// balance where M[n] - M[n+1] + length d x F[n] = 0, F the weight outboard. What of M twists the
// link its joint passes on (frames.h); the rest is d x c with c = M x d, and that is the moment of
// the potential -c.d: a pull on the link's end that stays in the frame. A moment that stayed in the
// frame would be no gradient, and would feed energy into a strand whose head spins.
//
// In its rest pose a strand does not sag; tilted it hangs another way. Too soft a strand that
// stands up falls over all the same.
static void fill_carried(Vec3* carried, const SimDefinition* d, const Vec3* rest)
{
    Vec3 moment = vec3(0, 0, 0), load = vec3(0, 0, 0);
    bool is_carried = d->gravity_compensation && models[d->model].has_hinges;
    for (int n = d->nodes - 1; n >= 1; --n) {
        load.y -= is_carried ? d->gravity_m_s2 * (float)mass_of(d, n) : 0.0f;
        moment = vec3_sub(moment, vec3_cross(link_of(rest, n), load));
        carried[n] = vec3_cross(moment, vec3_normalise_or(link_of(rest, n), vec3(0, -1, 0)));
    }
}

// The strand's shape at rest as the frames of frames.h see it: each link in the frame of the one
// before, the first in head space. The same axis is carried along the links by the same rotation.
static void fill_frames(Block* block, const SimDefinition* d, int strand, int lane)
{
    const Vec3* rest = d->rest + (size_t)strand * (size_t)d->nodes;
    Vec3 way = vec3_normalise_or(link_of(rest, 1), vec3(0, -1, 0)), u = across(way);
    Vec3 carried[SIM_MAX_NODES];
    fill_carried(carried, d, rest);
    lane_set(&block->carried[1], lane, carried[1]);
    lane_set(&block->along[1], lane, way);
    lane_set(&block->across[1], lane, u);
    for (int n = 2; n < d->nodes; ++n) {
        Vec3 next = vec3_normalise_or(link_of(rest, n), way), b = vec3_cross(way, next);
        float c = vec3_dot(way, next), f = vec3_dot(b, u) / fmaxf(1.0f + c, 1e-4f);
        Vec3 turned = vec3_mad(vec3_add(vec3_scale(u, c), vec3_cross(b, u)), b, f);
        turned = vec3_mad(turned, next, -vec3_dot(turned, next));
        turned = vec3_normalise_or(turned, across(next));
        lane_set(&block->along[n], lane, into_frame(next, way, u));
        lane_set(&block->across[n], lane, into_frame(turned, way, u));
        lane_set(&block->carried[n], lane, into_frame(carried[n], way, u));
        way = next;
        u = turned;
    }
}

static void fill_block(Block* block, const SimDefinition* d, int first)
{
    block->strands = d->strands - first < LANES ? d->strands - first : LANES;
    for (int lane = 0; lane < LANES; ++lane) {
        int strand = first + lane < d->strands ? first + lane : d->strands - 1;
        for (int n = 0; n < d->nodes; ++n)
            fill_node(block, d, strand, lane, n);
        fill_tuned(block, d, d->rest + (size_t)strand * (size_t)d->nodes, lane);
        fill_frames(block, d, strand, lane);
        printed_fill(block, d, strand, lane);
        for (int n = 0; n < d->nodes; ++n)
            if (weight_of(d, strand, n) < 1.0f && block->skinned <= n) block->skinned = n + 1;
    }
}

static void fill_substeps(Sim* sim)
{
    const SimDefinition* d = &sim->definition;
    double dt = 1.0 / (d->rate_hz * d->substeps);
    for (int s = 0; s < d->substeps; ++s)
        sim->substeps[s] =
            (Substep){.dt = (float)dt,
                      .dt2 = (float)(dt * dt),
                      .model = (int)d->model,
                      .outermost = d->outermost,
                      .down_share = d->down_share,
                      .velocity_kept = (float)trig_exp(-(double)d->damping_per_s * dt),
                      .iterations = d->iterations,
                      .solve_directly = d->length == LENGTH_DIRECT,
                      .collide_links = d->collide == COLLIDE_SEGMENT,
                      .collider_count = d->collider_count};
}

static bool allocate(Sim* sim, const SimDefinition* d)
{
    size_t colliders = (size_t)d->collider_count;
    sim->block_count = (d->strands + LANES - 1) / LANES;
    sim->blocks = calloc((size_t)sim->block_count, sizeof *sim->blocks);
    sim->memory = aligned_alloc(64, (size_t)sim->block_count * block_bytes(d));
    sim->work = aligned_alloc(64, strands_work_bytes(d->nodes) * KERNEL_GANG * (size_t)d->threads);
    sim->substeps = calloc((size_t)d->substeps, sizeof *sim->substeps);
    sim->colliders = calloc(colliders + 1, sizeof *sim->colliders);
    sim->axes = calloc(colliders * (size_t)d->substeps + 1, sizeof *sim->axes);
    sim->ties = calloc((size_t)d->tie_count + 1, sizeof *sim->ties);
    return sim->blocks && sim->memory && sim->work && sim->substeps && sim->colliders &&
           sim->axes && sim->ties;
}

static void fill(Sim* sim, const SimDefinition* d)
{
    memset(sim->memory, 0, (size_t)sim->block_count * block_bytes(d));
    memset(sim->work, 0, strands_work_bytes(d->nodes) * KERNEL_GANG * (size_t)d->threads);
    for (int b = 0; b < sim->block_count; ++b) {
        cut_block(&sim->blocks[b], d, (char*)sim->memory + (size_t)b * block_bytes(d));
        fill_block(&sim->blocks[b], d, b * LANES);
    }
    for (int k = 0; k < d->collider_count; ++k)
        sim->colliders[k] = d->colliders[k];
    for (int i = 0; i < d->tie_count; ++i)
        sim->ties[i] = d->ties[i];
    sim->definition = *d;
    sim->gravity_at_rest = d->gravity_m_s2;
    sim->kernel = kernel_find(d->kernel);
    sim->definition.rest = NULL;
    sim->definition.weight = NULL;
    sim->definition.colliders = NULL;
    sim->definition.ties = NULL;
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
    free(sim->work);
    free(sim->substeps);
    free(sim->colliders);
    free(sim->axes);
    free(sim->ties);
    free(sim);
}

static bool is_tuned_alike(const SimDefinition* a, const SimDefinition* b)
{
    return a->stiffness_s2 == b->stiffness_s2 && a->damping_per_s == b->damping_per_s &&
           a->gravity_m_s2 == b->gravity_m_s2 && a->drag_per_s == b->drag_per_s &&
           a->iterations == b->iterations && a->pearl_radius_m == b->pearl_radius_m;
}

bool sim_tune(Sim* sim, const SimDefinition* wanted, Fault* fault)
{
    SimDefinition d = sim->definition;
    d.stiffness_s2 = wanted->stiffness_s2;
    d.damping_per_s = wanted->damping_per_s;
    d.gravity_m_s2 = wanted->gravity_m_s2;
    d.drag_per_s = wanted->drag_per_s;
    d.iterations = wanted->iterations;
    d.pearl_radius_m = wanted->pearl_radius_m;
    if (!check_tuned(&d, fault)) return false;
    if (is_tuned_alike(&d, &sim->definition)) return true; // senders repeat themselves
    sim->definition = d;
    fill_substeps(sim);
    d.colliders = sim->colliders;
    Vec3 rest[SIM_MAX_NODES];
    for (int i = 0; i < sim->block_count * LANES; ++i) {
        for (int n = 0; n < d.nodes; ++n)
            rest[n] = lane_get(&sim->blocks[i / LANES].rest[n], i % LANES);
        fill_tuned(&sim->blocks[i / LANES], &d, rest, i % LANES);
    }
    return true;
}

const SimDefinition* sim_definition(const Sim* sim)
{
    return &sim->definition;
}

static void place(Block* block, const float rotation[9])
{
    for (int n = 0; n < block->nodes; ++n)
        for (int l = 0; l < LANES; ++l)
            lane_set(&block->position[n], l, rotate(rotation, lane_get(&block->rest[n], l)));
}

void sim_reset(Sim* sim, const float rotation[9])
{
    for (int i = 0; i < BODY_COUNT; ++i) {
        memcpy(sim->bodies[i].rotation, rotation, sizeof sim->bodies[i].rotation);
        sim->bodies[i].offset = vec3(0, 0, 0);
    }
    for (int b = 0; b < sim->block_count; ++b) {
        Block* block = &sim->blocks[b];
        place(block, rotation);
        size_t bytes = (size_t)block->nodes * sizeof(Lanes3);
        memcpy(block->previous, block->position, bytes);
        memset(block->angle, 0, (size_t)block->nodes * sizeof(Angles));
        memset(block->rate, 0, (size_t)block->nodes * sizeof(Angles));
    }
}

static void turn_body(Body* body, const float turn[9])
{
    float turned[9];
    for (int i = 0; i < 9; ++i)
        turned[i] = turn[i / 3 * 3] * body->rotation[i % 3] +
                    turn[i / 3 * 3 + 1] * body->rotation[i % 3 + 3] +
                    turn[i / 3 * 3 + 2] * body->rotation[i % 3 + 6];
    memcpy(body->rotation, turned, sizeof turned);
    body->offset = rotate(turn, body->offset);
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
    for (int i = 0; i < BODY_COUNT; ++i)
        turn_body(&sim->bodies[i], turn);
}

// A skinned node is where it is at rest, to the bit; turning it forth and back would round.
static void read_strand(const Block* block, int lane, const float rotation[9], Vec3* strand)
{
    for (int n = 0; n < block->nodes; ++n)
        strand[n] = block->keep[n].v[lane] == 0.0f
                        ? lane_get(&block->rest[n], lane)
                        : rotate_back(rotation, lane_get(&block->position[n], lane));
}

static void project_strand(const Block* block, int lane, Obstacles obstacles, Vec3* strand)
{
    bool skinned[SIM_MAX_NODES];
    float lengths[SIM_MAX_NODES];
    for (int n = 0; n < block->nodes; ++n) {
        skinned[n] = block->keep[n].v[lane] == 0.0f;
        lengths[n] = (float)block->length[n].v[lane];
    }
    obstacles.clearance = &block->clearance->v[lane];
    project_lengths(strand, block->nodes, lengths, skinned, &obstacles);
}

// Where a collider is now, in head space.
static Collider seen_from_head(const Sim* sim, const float rotation[9], Collider c)
{
    if (c.body == BODY_HEAD) return c;
    const Body* body = &sim->bodies[c.body];
    c.from = rotate_back(rotation, body_place(body, c.from));
    c.to = rotate_back(rotation, body_place(body, c.to));
    return c;
}

void sim_positions(const Sim* sim, const float rotation[9], bool project, Vec3* positions)
{
    const SimDefinition* d = &sim->definition;
    Collider colliders[HAIRSTYLE_MAX_COLLIDERS];
    for (int k = 0; k < d->collider_count; ++k)
        colliders[k] = seen_from_head(sim, rotation, sim->colliders[k]);
    Obstacles obstacles = {colliders, d->collider_count, d->pearl_radius_m, NULL};
    for (int s = 0; s < d->strands; ++s) {
        const Block* block = &sim->blocks[s / LANES];
        Vec3* strand = positions + (size_t)s * (size_t)d->nodes;
        read_strand(block, s % LANES, rotation, strand);
        if (project) project_strand(block, s % LANES, obstacles, strand);
    }
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

int64_t sim_quarantined(const Sim* sim)
{
    int64_t sum = 0;
    for (int b = 0; b < sim->block_count; ++b)
        sum += sim->blocks[b].quarantined;
    return sum;
}

static void hash_angles(const Block* block, int n, int lane, void* hash_state)
{
    const Angles *angle = &block->angle[n], *rate = &block->rate[n];
    float state[4] = {(float)angle->theta[lane], (float)angle->phi[lane], (float)rate->theta[lane],
                      (float)rate->phi[lane]};
    XXH64_update(hash_state, state, sizeof state);
}

void sim_hash(const Sim* sim, void* hash_state)
{
    int nodes = sim->definition.nodes;
    for (int i = 0; i < sim->definition.strands * nodes; ++i) {
        const Block* block = &sim->blocks[i / nodes / LANES];
        Vec3 node[2] = {lane_get(&block->position[i % nodes], i / nodes % LANES),
                        lane_get(&block->previous[i % nodes], i / nodes % LANES)};
        XXH64_update(hash_state, node, sizeof node);
        if (models[sim->definition.model].has_angles)
            hash_angles(block, i % nodes, i / nodes % LANES, hash_state);
    }
}
