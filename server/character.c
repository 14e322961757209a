#include "server/character.h"

#include "messages/trig.h"
#include "server/weave.h"

#include <math.h>
#include <stdlib.h>

// The slot's head in world space when its motion's or ring's path is at `t`.
static Pose path_at(const Character* c, double t, MotionState* state)
{
    if (c->motion->at == NULL) return poses_at(&c->poses, t);
    *state = c->motion->at(t);
    return (Pose){vec3d_add(c->base.position, state->pose.position), state->pose.orientation};
}

double character_time(const SimDefinition* sim, int64_t step, int substep)
{
    return ((double)(step - 1) + (double)substep / sim->substeps) / sim->rate_hz;
}

static double time_of(const Character* c, int64_t step, int substep)
{
    return character_time(sim_definition(c->sim), step, substep);
}

// The head as if it had always been on its path; the hair at rest under it.
static void start(Character* c, int64_t step)
{
    MotionState state = {.segment = 0}, before = {.segment = 0};
    double now = time_of(c, step, 0), dt = time_of(c, step, 1) - now;
    c->head = path_at(c, now, &state);
    c->move = vec3d_sub(c->head.position, path_at(c, now - dt, &before).position);
    if (before.segment != state.segment) c->move = (Vec3d){0, 0, 0};
    c->motion_segment = state.segment;
    float rotation[9];
    quat_matrix(rotation, c->head.orientation);
    sim_reset(c->sim, rotation);
}

SimDefinition character_definition(const SimDefinition* sim, const Hairstyle* hair)
{
    SimDefinition definition = *sim;
    definition.strands = hair->guide_count;
    definition.nodes = hair->nodes;
    definition.rest = hair->rest;
    definition.weight = hair->weight;
    definition.colliders = hair->colliders;
    definition.collider_count = hair->collider_count;
    return definition;
}

Sim* character_sim(const SimDefinition* sim, const Hairstyle* hair, Fault* fault)
{
    SimDefinition definition = character_definition(sim, hair);
    Tie* ties = weave_ties(hair, &definition.tie_count);
    definition.ties = ties;
    Sim* made = NULL;
    if (definition.tie_count < 0)
        fault_set(fault, "no memory for what holds %s together", hair->name);
    else
        made = sim_create(&definition, fault);
    free(ties);
    return made;
}

static bool allocate(Character* c, const SimDefinition* sim, Fault* fault)
{
    c->sim = character_sim(sim, c->hair, fault);
    if (c->sim == NULL) return false;
    const SimDefinition* definition = sim_definition(c->sim);
    c->heads = calloc((size_t)definition->substeps, sizeof *c->heads);
    return (c->heads != NULL &&
            publish_planes_create(&c->planes, definition->strands, definition->nodes)) ||
           fault_set(fault, "no memory for a character of %d strands", definition->strands);
}

Character* character_create(const SimDefinition* sim, const Hairstyle* hair, const Motion* motion,
                            Vec3d position, int64_t step, Fault* fault)
{
    Character* c = calloc(1, sizeof *c);
    if (c == NULL) {
        fault_set(fault, "no memory for a character");
        return NULL;
    }
    c->hair = hair;
    if (!allocate(c, sim, fault)) {
        character_destroy(c);
        return NULL;
    }
    c->motion = motion;
    c->base = (Pose){position, quat_identity()};
    poses_init(&c->poses, c->base, 1.0 / sim->rate_hz);
    poses_init(&c->torso, c->base, 1.0 / sim->rate_hz);
    start(c, step);
    return c;
}

void character_destroy(Character* c)
{
    if (c == NULL) return;
    sim_destroy(c->sim);
    publish_planes_free(&c->planes);
    free(c->heads);
    free(c);
}

// A segment of the bus begins: the path has changed behind the head (poses.h), the hair follows by
// the verb.
static void enter_segment(Character* c, double now, double dt)
{
    PoseRing* ring = &c->poses;
    if (!ring->pending) return;
    ring->pending = false;
    ++c->segment;
    c->head = poses_at(ring, now);
    float m[9];
    if (ring->pending_verb == POSE_RESET) {
        c->move = (Vec3d){0, 0, 0};
        c->frozen_orientation = c->head.orientation;
        quat_matrix(m, c->head.orientation);
        sim_reset(c->sim, m);
        return;
    }
    if (!ring->pending_is_turned) return; // a carry without a turn touches no float
    c->move = vec3d_sub(c->head.position, poses_at(ring, now - dt).position);
    if (c->frozen) return; // thawing turns it
    quat_matrix(m, ring->pending_turn);
    sim_turn(c->sim, m);
}

// Frozen hair is rigid with the head: its state waits under the orientation it was frozen at, and
// is turned once when it thaws.
static void follow_freeze(Character* c)
{
    if (c->poses.frozen == c->frozen) return;
    c->frozen = c->poses.frozen;
    if (c->frozen) {
        c->frozen_orientation = c->head.orientation;
        return;
    }
    float m[9];
    quat_matrix(m, quat_mul(c->head.orientation, quat_conjugate(c->frozen_orientation)));
    sim_turn(c->sim, m);
}

static Vec3d wind_at(const WindMessage* wind, double t)
{
    double turns = (double)wind->gust_hz * t;
    double swing = trig_sin(2.0 * TRIG_PI * (turns - floor(turns)));
    return vec3d_scale(vec3d_from(wind->velocity), 1.0 + (double)wind->gust * swing);
}

static void move_torso(Character* c, SimHead* head, double t)
{
    head->has_torso = c->torso.any;
    head->torso_is_carried = c->torso_is_carried;
    c->torso_is_carried = false;
    if (!head->has_torso) return;
    Pose torso = poses_at(&c->torso, t);
    quat_matrix(head->torso_rotation, torso.orientation);
    head->torso_offset = vec3_from(vec3d_sub(torso.position, c->head.position));
}

static void move_head(Character* c, SimHead* head, double t)
{
    MotionState state = {.segment = c->motion_segment}; // the bus brings none of it
    Pose next = path_at(c, t, &state);
    Vec3d move = vec3d_sub(next.position, c->head.position), change = {0, 0, 0};
    if (state.segment == c->motion_segment) {
        change = vec3d_sub(move, c->move);
        c->move = move;
    } else {
        ++c->segment; // carried: the jump is no motion, and the speed before it goes on
        c->torso_is_carried = c->torso.any;
    }
    c->motion_segment = state.segment;
    c->head = next;
    quat_matrix(head->rotation, next.orientation);
    head->second_difference = vec3_from(change);
    head->move = vec3_from(c->move);
    head->wind = vec3_from(vec3d_add(state.wind, wind_at(&c->wind, t)));
    move_torso(c, head, t);
}

// Where either of them was put, or the hair waited meanwhile, the torso has not moved from where
// the hair last met it: taken for motion, a metre in a substep throws hair at 90 m/s.
static void enter_torso(Character* c)
{
    bool is_put = c->torso.pending || c->poses.pending || c->frozen;
    c->torso_is_carried = c->torso.any && is_put;
    c->torso.pending = false;
}

void character_step(Character* c, int64_t step, bool project)
{
    double now = time_of(c, step, 0), dt = time_of(c, step, 1) - now;
    enter_torso(c);
    enter_segment(c, now, dt);
    follow_freeze(c);
    for (int s = 0; s < sim_definition(c->sim)->substeps; ++s)
        move_head(c, &c->heads[s], time_of(c, step, s + 1));
    if (!c->frozen) sim_step(c->sim, c->heads);
    float rotation[9];
    quat_matrix(rotation, c->frozen ? c->frozen_orientation : c->head.orientation);
    c->clamped += publish_quantise(&c->planes, c->sim, rotation, project, c->hair);
}
