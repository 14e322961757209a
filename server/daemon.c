#include "server/daemon.h"

#include "messages/channels.h"
#include "messages/trig.h"
#include "server/inputs.h"
#include "server/motion.h"
#include "server/poses.h"
#include "server/publish.h"
#include "server/scene.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#define MAX_STYLES     SCENE_MAX_STYLES
#define EPOCH_LISTEN_S 2.0 // a daemon yields to a higher epoch only while it is new
#define APPLIED_BYTES  1400
#define ADD_PATIENCE_S 1.5 // for the add of a character whose poses come already

// Things that are noticed once each.
#define COMPLAINTS(X)                                                                              \
    X(POSE)                                                                                        \
    X(CHARACTER)                                                                                   \
    X(WIND)                                                                                        \
    X(TUNING)                                                                                      \
    X(UNSTABLE)                                                                                    \
    X(REQUEST)                                                                                     \
    X(STATUS)                                                                                      \
    X(CHANNEL)                                                                                     \
    X(UNSENT)                                                                                      \
    X(OVERFLOW)                                                                                    \
    X(STYLE)                                                                                       \
    X(EMPTY_SLOT)                                                                                  \
    X(POSE_IN_CODE)                                                                                \
    X(QUARANTINE)                                                                                  \
    X(JUMP)

typedef enum Complaint {
#define COMPLAINT_ENUM(name) COMPLAINT_##name,
    COMPLAINTS(COMPLAINT_ENUM)
#undef COMPLAINT_ENUM
        COMPLAINT_COUNT
} Complaint;

typedef struct Style {
    Hairstyle* hair;
    PublishStyle publish;
} Style;

typedef struct Slot {
    Sim* sim; // NULL: nobody is here
    int number;
    int style;
    const Motion* motion;
    Pose base; // where the motion happens
    PoseRing poses;
    Pose head;  // at the end of the last substep
    Vec3d move; // of the head in the last substep, m
    WindMessage wind;
    int motion_segment;
    int32_t segment; // as published
    bool frozen;
    Quat frozen_orientation; // the hair's state stays as it was under this one
    int64_t clamped;
    int64_t quarantined; // of its strands, as counted below
    SimHead* heads;      // of one tick
    PublishPlanes planes;
} Slot;

struct Daemon {
    DaemonOptions options;
    SimDefinition sim; // without strands
    const Motion* motion;
    Scene* scene;
    int style_count;
    Style styles[MAX_STYLES];
    Slot* slots[CHANNEL_MAX_SLOTS];
    int order[CHANNEL_MAX_SLOTS]; // numbers of the slots in use, rising
    int used;
    int32_t segments[CHANNEL_MAX_SLOTS]; // outlive a character that leaves and comes back
    int64_t orphans[CHANNEL_MAX_SLOTS];  // 1 + step of the first pose without a character; 0: none
    Inputs inputs;
    Publisher publisher;
    int64_t steps;      // ticks done since the start; step n simulates (n - 1) / rate to n / rate
    int64_t first_step; // of this epoch
    int64_t utime;      // of the last tick
    int64_t higher_epoch;
    bool has_yielded;
    int64_t since_status_us;
    int64_t step_us, step_count;
    double mean_step_us;
    int64_t overruns, rejected, quarantined, jumps;
    bool complained[COMPLAINT_COUNT];
};

DaemonOptions daemon_default(void)
{
    return (DaemonOptions){
        .motion = "bus", .characters = 1, .sim = sim_default(), .mtu = 1500, .project = true};
}

bool daemon_use_scene(DaemonOptions* options, const char* path, Fault* fault)
{
    Scene* scene = scene_load(path, &options->sim, fault);
    if (scene == NULL) return false;
    // Characters of the scene stand for the default one.
    if (scene->character_count > 0) options->characters = 0;
    scene_destroy(scene);
    options->scene = path;
    return true;
}

static void remark(Daemon* daemon, Complaint kind, const char* text)
{
    if (daemon->complained[kind]) return;
    daemon->complained[kind] = true;
    notice_say(&daemon->options.notice, "%s (said once; later ones are counted)", text);
}

// Of what is refused.
static void complain(Daemon* daemon, Complaint kind, const char* text)
{
    ++daemon->rejected;
    remark(daemon, kind, text);
}

// Characters -------------------------------------------------------------------------------------

// The slot's head in world space when its motion's or ring's path is at `t`.
static Pose path_at(const Slot* slot, double t, MotionState* state)
{
    if (slot->motion->at == NULL) return poses_at(&slot->poses, t);
    *state = slot->motion->at(t);
    return (Pose){vec3d_add(slot->base.position, state->pose.position), state->pose.orientation};
}

// Substep `s` of step `step`; s = 0 is the end of the step before.
static double time_of(const Daemon* daemon, int64_t step, int s)
{
    return ((double)(step - 1) + (double)s / daemon->sim.substeps) / daemon->sim.rate_hz;
}

static void free_slot(Daemon* daemon, int number)
{
    Slot* slot = daemon->slots[number];
    if (slot == NULL) return;
    daemon->segments[number] = slot->segment;
    sim_destroy(slot->sim);
    publish_planes_free(&slot->planes);
    free(slot->heads);
    free(slot);
    daemon->slots[number] = NULL;
}

static void order_slots(Daemon* daemon)
{
    daemon->used = 0;
    for (int i = 0; i < CHANNEL_MAX_SLOTS; ++i)
        if (daemon->slots[i] != NULL) daemon->order[daemon->used++] = i;
}

// The head as if it had always been on its path; the hair at rest under it.
static void start_slot(const Daemon* daemon, Slot* slot)
{
    MotionState state = {.segment = 0}, before = {.segment = 0};
    double now = time_of(daemon, daemon->steps, 0), dt = time_of(daemon, daemon->steps, 1) - now;
    slot->head = path_at(slot, now, &state);
    slot->move = vec3d_sub(slot->head.position, path_at(slot, now - dt, &before).position);
    if (before.segment != state.segment) slot->move = (Vec3d){0, 0, 0};
    slot->motion_segment = state.segment;
    float rotation[9];
    quat_matrix(rotation, slot->head.orientation);
    sim_reset(slot->sim, rotation);
}

static SimDefinition definition_of(const Daemon* daemon, const Hairstyle* hair)
{
    SimDefinition definition = daemon->sim;
    definition.strands = hair->guide_count;
    definition.nodes = hair->nodes;
    definition.rest = hair->rest;
    definition.weight = hair->weight;
    definition.colliders = hair->colliders;
    definition.collider_count = hair->collider_count;
    return definition;
}

static bool add_slot(Daemon* daemon, int number, int style, const Motion* motion, Vec3d position,
                     Fault* fault)
{
    const Hairstyle* hair = daemon->styles[style].hair;
    SimDefinition definition = definition_of(daemon, hair);
    free_slot(daemon, number);
    Slot* slot = calloc(1, sizeof *slot);
    if (slot == NULL) return fault_set(fault, "no memory for character %d", number);
    daemon->slots[number] = slot;
    slot->heads = calloc((size_t)definition.substeps, sizeof *slot->heads);
    slot->sim = sim_create(&definition, fault);
    if (slot->heads == NULL || slot->sim == NULL ||
        !publish_planes_create(&slot->planes, hair->guide_count, hair->nodes)) {
        if (slot->sim != NULL) fault_set(fault, "no memory for character %d", number);
        free_slot(daemon, number);
        order_slots(daemon);
        return false;
    }
    slot->number = number;
    slot->style = style;
    slot->motion = motion;
    slot->base = (Pose){position, quat_identity()};
    slot->segment = daemon->segments[number];
    daemon->orphans[number] = 0;
    poses_init(&slot->poses, slot->base, 1.0 / daemon->sim.rate_hz);
    start_slot(daemon, slot);
    order_slots(daemon);
    return true;
}

// Making a daemon --------------------------------------------------------------------------------

// Requests name parts by bits of a fixed table.
static bool check_parts(const StyleBytes* bytes, int mtu, Fault* fault)
{
    size_t size = bytes->size[STYLE_BULK];
    int parts = style_part_count(size, style_part_bytes(mtu));
    return parts <= STYLE_MAX_PARTS ||
           fault_set(fault,
                     "%zu bytes of strands and head take %d messages, at most %d; raise --mtu",
                     size, parts, STYLE_MAX_PARTS);
}

// Now, not when the first character comes: by then nobody is looking.
static bool check_simulation(const Daemon* daemon, const Hairstyle* hair, Fault* fault)
{
    SimDefinition definition = definition_of(daemon, hair);
    Sim* trial = sim_create(&definition, fault);
    sim_destroy(trial);
    return trial != NULL;
}

static bool load_one(Daemon* daemon, const LoadOptions* load, const char* name, Fault* fault)
{
    Style* style = &daemon->styles[daemon->style_count];
    style->hair = load_style(load, &daemon->options.notice, fault);
    if (style->hair == NULL) return false;
    if (name != NULL) strcpy(style->hair->name, name);
    ++daemon->style_count;
    if (!style_encode(&style->publish.bytes, style->hair, fault) ||
        !check_parts(&style->publish.bytes, daemon->options.mtu, fault))
        return fault_prefix(fault, style->hair->name);
    publish_style_restart(&style->publish);
    return check_simulation(daemon, style->hair, fault);
}

static bool load_styles(Daemon* daemon, Fault* fault)
{
    const Scene* scene = daemon->scene;
    if (scene == NULL || scene->style_count == 0) {
        LoadOptions* load = &daemon->options.load;
        if (load->style_count == 0) load->styles[load->style_count++] = load_builtin_styles[0];
        return load_one(daemon, load, NULL, fault);
    }
    for (int i = 0; i < scene->style_count; ++i)
        if (!load_one(daemon, &scene->styles[i].load, scene->styles[i].name, fault)) return false;
    return true;
}

static bool add_characters(Daemon* daemon, Fault* fault)
{
    const Scene* scene = daemon->scene;
    for (int i = 0; scene != NULL && i < scene->character_count; ++i) {
        const SceneCharacter* c = &scene->characters[i];
        const Motion* motion = c->motion != NULL ? motion_find(c->motion) : daemon->motion;
        if (!add_slot(daemon, c->slot, c->style, motion, c->position, fault)) return false;
    }
    for (int i = 0; i < daemon->options.characters; ++i)
        if (daemon->slots[i] == NULL &&
            !add_slot(daemon, i, 0, daemon->motion, (Vec3d){0.6 * i, 0, 0}, fault))
            return false;
    return true;
}

static bool check_options(Daemon* daemon, Fault* fault)
{
    const DaemonOptions* o = &daemon->options;
    daemon->motion = motion_find(o->motion != NULL ? o->motion : "bus");
    if (daemon->motion == NULL)
        return fault_set(fault, "motion \"%s\" is unknown; see --help for the list", o->motion);
    if (o->characters < 0 || o->characters > CHANNEL_MAX_SLOTS)
        return fault_set(fault, "characters is %d; it must be 0 to %d", o->characters,
                         CHANNEL_MAX_SLOTS);
    if (o->mtu < 576 || o->mtu > FRAME_MAX_BYTES)
        return fault_set(fault, "mtu is %d; it must be 576 to %d bytes", o->mtu, FRAME_MAX_BYTES);
    return true;
}

static bool build(Daemon* daemon, Fault* fault)
{
    if (!check_options(daemon, fault)) return false;
    if (daemon->options.scene != NULL) {
        SimDefinition ignored = daemon->sim; // daemon_use_scene has taken these values
        daemon->scene = scene_load(daemon->options.scene, &ignored, fault);
        if (daemon->scene == NULL) return false;
    }
    return load_styles(daemon, fault) && add_characters(daemon, fault);
}

Daemon* daemon_create(const DaemonOptions* options, Fault* fault)
{
    Daemon* daemon = calloc(1, sizeof *daemon);
    if (daemon == NULL) {
        fault_set(fault, "no memory for the daemon");
        return NULL;
    }
    daemon->options = *options;
    daemon->sim = options->sim;
    daemon->publisher.mtu = options->mtu;
    daemon->publisher.epoch = options->epoch > 0 ? options->epoch : base_wall_us();
    if (!build(daemon, fault)) {
        daemon_destroy(daemon);
        return NULL;
    }
    return daemon;
}

void daemon_destroy(Daemon* daemon)
{
    if (daemon == NULL) return;
    for (int i = 0; i < CHANNEL_MAX_SLOTS; ++i)
        free_slot(daemon, i);
    for (int i = 0; i < daemon->style_count; ++i) {
        style_bytes_free(&daemon->styles[i].publish.bytes);
        hairstyle_destroy(daemon->styles[i].hair);
    }
    scene_destroy(daemon->scene);
    free(daemon);
}

void daemon_add_sink(Daemon* daemon, DaemonSink sink)
{
    if (daemon->publisher.sink_count < DAEMON_MAX_SINKS)
        daemon->publisher.sinks[daemon->publisher.sink_count++] = sink;
}

// Inputs -----------------------------------------------------------------------------------------

static void receive_request(Daemon* daemon, const uint8_t* bytes, size_t size)
{
    RequestMessage request;
    Fault fault;
    if (!request_decode(&request, bytes, size, &fault)) {
        complain(daemon, COMPLAINT_REQUEST, fault.text);
        return;
    }
    uint64_t hash = request.style_hash;
    const Slot* slot = request.slot < CHANNEL_MAX_SLOTS ? daemon->slots[request.slot] : NULL;
    if (hash == 0 && slot != NULL) hash = daemon->styles[slot->style].publish.bytes.hash;
    // Another daemon's style: not for us.
    for (int i = 0; i < daemon->style_count; ++i)
        if (daemon->styles[i].publish.bytes.hash == hash && request.lane < STYLE_LANES)
            publish_style_request(&daemon->styles[i].publish, request.lane, request.missing);
}

// Another daemon is heard only for its epoch. Our own status comes back by the bus as well.
static void receive_status(Daemon* daemon, const uint8_t* bytes, size_t size)
{
    StatusMessage status;
    Fault fault;
    if (!status_decode(&status, bytes, size, &fault))
        complain(daemon, COMPLAINT_STATUS, fault.text);
    else if (status.epoch > daemon->higher_epoch)
        daemon->higher_epoch = status.epoch;
}

static void queue_input(Daemon* daemon, Input* input, const uint8_t* bytes, size_t size)
{
    if (size > sizeof input->bytes) size = sizeof input->bytes; // fixed sizes: cannot happen
    input->size = size;
    memcpy(input->bytes, bytes, size);
    if (!inputs_push(&daemon->inputs, input))
        complain(daemon, COMPLAINT_OVERFLOW, "more inputs in one tick than the queue holds");
}

static bool decode_input(Input* input, const uint8_t* bytes, size_t size, Fault* fault)
{
    switch (input->kind) {
    case INPUT_POSE:
        return pose_decode(&input->pose, bytes, size, fault);
    case INPUT_CHARACTER:
        return character_decode(&input->character, bytes, size, fault);
    case INPUT_WIND:
        return wind_decode(&input->wind, bytes, size, fault);
    default:
        return tuning_decode(&input->tuning, bytes, size, fault);
    }
}

// What waits for the tick boundary.
static const struct {
    const char* channel;
    Complaint complaint;
} input_table[INPUT_KINDS] = {
    [INPUT_POSE] = {CHANNEL_POSE, COMPLAINT_POSE},
    [INPUT_CHARACTER] = {CHANNEL_CHARACTER, COMPLAINT_CHARACTER},
    [INPUT_WIND] = {CHANNEL_WIND, COMPLAINT_WIND},
    [INPUT_TUNING] = {CHANNEL_TUNING, COMPLAINT_TUNING},
};

void daemon_receive(Daemon* daemon, const char* channel, const uint8_t* bytes, size_t size)
{
    Input input = {.kind = INPUT_POSE};
    Fault fault;
    while (input.kind < INPUT_KINDS && strcmp(channel, input_table[input.kind].channel) != 0)
        ++input.kind;
    if (input.kind < INPUT_KINDS) {
        if (decode_input(&input, bytes, size, &fault))
            queue_input(daemon, &input, bytes, size);
        else
            complain(daemon, input_table[input.kind].complaint, fault.text);
    } else if (strcmp(channel, CHANNEL_REQUEST) == 0) {
        receive_request(daemon, bytes, size);
    } else if (strcmp(channel, CHANNEL_STATUS) == 0) {
        receive_status(daemon, bytes, size);
    } else {
        complain(daemon, COMPLAINT_CHANNEL, "a message on a channel this daemon does not read");
    }
}

static int find_style(const Daemon* daemon, const char* name)
{
    if (*name == '\0') return 0;
    for (int i = 0; i < daemon->style_count; ++i)
        if (strcmp(daemon->styles[i].hair->name, name) == 0) return i;
    return -1;
}

static void reject_style(Daemon* daemon, const char* name)
{
    char text[sizeof((Fault*)0)->text];
    int length = snprintf(text, sizeof text, "character_t names style \"%s\"; known are:", name);
    for (int i = 0; i < daemon->style_count && length < (int)sizeof text; ++i)
        length += snprintf(text + length, sizeof text - (size_t)length, " %s",
                           daemon->styles[i].hair->name);
    complain(daemon, COMPLAINT_STYLE, text);
}

// Senders repeat an add each second: a pose may well come before the add that a daemon hears.
static bool may_be_early(Daemon* daemon, int number)
{
    int64_t* since = &daemon->orphans[number];
    if (*since == 0) *since = 1 + daemon->steps;
    return (double)(1 + daemon->steps - *since) < ADD_PATIENCE_S * daemon->sim.rate_hz;
}

static void apply_character(Daemon* daemon, const CharacterMessage* message)
{
    if (message->verb == CHARACTER_REMOVE) {
        free_slot(daemon, message->slot);
        order_slots(daemon);
        return;
    }
    int style = find_style(daemon, message->style);
    if (style < 0) {
        reject_style(daemon, message->style);
        return;
    }
    Fault fault;
    const Slot* old = daemon->slots[message->slot];
    // Senders repeat an add for a daemon that starts after them: LCM keeps nothing.
    if (old != NULL && old->style == style) return;
    const Motion* motion = old != NULL ? old->motion : daemon->motion;
    Vec3d position = old != NULL ? old->base.position : (Vec3d){0, 0, 0};
    ++daemon->segments[message->slot]; // nobody interpolates from one hairstyle to another
    if (old != NULL) ++daemon->slots[message->slot]->segment;
    if (!add_slot(daemon, message->slot, style, motion, position, &fault))
        complain(daemon, COMPLAINT_CHARACTER, fault.text);
}

static void push_pose(Daemon* daemon, Slot* slot, const PoseMessage* message)
{
    char text[160];
    if (!poses_push(&slot->poses, message, time_of(daemon, daemon->steps, 0))) return;
    ++daemon->jumps;
    snprintf(text, sizeof text,
             "the head of character %d jumped without raising its segment: taken as a carry; raise "
             "the segment of " CHANNEL_POSE " at a teleport",
             slot->number);
    remark(daemon, COMPLAINT_JUMP, text);
}

static void apply_pose(Daemon* daemon, const PoseMessage* message)
{
    Slot* slot = daemon->slots[message->slot];
    if (slot == NULL && may_be_early(daemon, message->slot))
        ++daemon->rejected;
    else if (slot == NULL)
        complain(daemon, COMPLAINT_EMPTY_SLOT, "a pose for a slot without a character");
    else if (slot->motion->at != NULL)
        complain(daemon, COMPLAINT_POSE_IN_CODE,
                 "a pose for a character that moves by itself; start with --motion bus");
    else
        push_pose(daemon, slot, message);
}

static bool is_among(const Slot* slot, int first, int count)
{
    return slot->number >= first && slot->number < first + count;
}

static void apply_wind(Daemon* daemon, const WindMessage* message)
{
    for (int i = 0; i < daemon->used; ++i) {
        Slot* slot = daemon->slots[daemon->order[i]];
        if (is_among(slot, message->first_slot, message->slot_count)) slot->wind = *message;
    }
}

static bool tune_slot(Slot* slot, const TuningMessage* message, Fault* fault)
{
    SimDefinition wanted = *sim_definition(slot->sim);
    if (message->set & TUNING_STIFFNESS) wanted.stiffness_s2 = message->stiffness_s2;
    if (message->set & TUNING_DAMPING) wanted.damping_per_s = message->damping_per_s;
    if (message->set & TUNING_GRAVITY) wanted.gravity_m_s2 = message->gravity_m_s2;
    if (message->set & TUNING_DRAG) wanted.drag_per_s = message->drag_per_s;
    if (message->set & TUNING_ITERATIONS) wanted.iterations = message->iterations;
    if (message->set & TUNING_PEARL_RADIUS) wanted.pearl_radius_m = message->pearl_radius_m;
    return sim_tune(slot->sim, &wanted, fault);
}

// Each character by itself: what one is stable with may be too much for another's damping.
static void apply_tuning(Daemon* daemon, const TuningMessage* message)
{
    Fault fault;
    bool taken = true;
    for (int i = 0; i < daemon->used; ++i) {
        Slot* slot = daemon->slots[daemon->order[i]];
        if (is_among(slot, message->first_slot, message->slot_count))
            taken = tune_slot(slot, message, &fault) && taken;
    }
    if (taken) return;
    fault_prefix(&fault, CHANNEL_TUNING);
    complain(daemon, COMPLAINT_UNSTABLE, fault.text);
}

static void apply_input(Daemon* daemon, const Input* input)
{
    switch (input->kind) {
    case INPUT_POSE:
        apply_pose(daemon, &input->pose);
        break;
    case INPUT_CHARACTER:
        apply_character(daemon, &input->character);
        break;
    case INPUT_WIND:
        apply_wind(daemon, &input->wind);
        break;
    default:
        apply_tuning(daemon, &input->tuning);
    }
}

static void publish_applied(Daemon* daemon, const Input* input)
{
    uint8_t bytes[APPLIED_BYTES];
    AppliedMessage message = {.utime = daemon->utime,
                              .epoch = daemon->publisher.epoch,
                              .tick = (int32_t)(daemon->steps - daemon->first_step),
                              .size = (int32_t)input->size,
                              .payload = input->bytes};
    strcpy(message.channel, input_table[input->kind].channel);
    publish_bytes(&daemon->publisher, daemon->utime, CHANNEL_APPLIED, bytes,
                  applied_encode(bytes, sizeof bytes, &message));
}

static void consume_inputs(Daemon* daemon)
{
    for (int i = 0; i < daemon->inputs.count; ++i) {
        const Input* input = &daemon->inputs.queue[i];
        apply_input(daemon, input);
        publish_applied(daemon, input);
    }
    daemon->inputs.count = 0;
}

// A tick -----------------------------------------------------------------------------------------

// A segment of the bus begins: the path has changed behind the head (poses.h), the hair follows by
// the verb.
static void enter_segment(Slot* slot, double now, double dt)
{
    PoseRing* ring = &slot->poses;
    if (!ring->pending) return;
    ring->pending = false;
    ++slot->segment;
    slot->head = poses_at(ring, now);
    float m[9];
    if (ring->pending_verb == POSE_RESET) {
        slot->move = (Vec3d){0, 0, 0};
        slot->frozen_orientation = slot->head.orientation;
        quat_matrix(m, slot->head.orientation);
        sim_reset(slot->sim, m);
        return;
    }
    if (!ring->pending_is_turned) return; // a carry without a turn touches no float
    slot->move = vec3d_sub(slot->head.position, poses_at(ring, now - dt).position);
    if (slot->frozen) return; // thawing turns it
    quat_matrix(m, ring->pending_turn);
    sim_turn(slot->sim, m);
}

// Frozen hair is rigid with the head: its state waits under the orientation it was frozen at, and
// is turned once when it thaws.
static void follow_freeze(Slot* slot)
{
    if (slot->poses.frozen == slot->frozen) return;
    slot->frozen = slot->poses.frozen;
    if (slot->frozen) {
        slot->frozen_orientation = slot->head.orientation;
        return;
    }
    float m[9];
    quat_matrix(m, quat_mul(slot->head.orientation, quat_conjugate(slot->frozen_orientation)));
    sim_turn(slot->sim, m);
}

static Vec3d wind_at(const WindMessage* wind, double t)
{
    double turns = (double)wind->gust_hz * t;
    double swing = trig_sin(2.0 * TRIG_PI * (turns - floor(turns)));
    return vec3d_scale(vec3d_from(wind->velocity), 1.0 + (double)wind->gust * swing);
}

static void move_head(Slot* slot, SimHead* head, double t)
{
    MotionState state = {.segment = slot->motion_segment}; // the bus brings none of it
    Pose next = path_at(slot, t, &state);
    Vec3d move = vec3d_sub(next.position, slot->head.position), change = {0, 0, 0};
    if (state.segment == slot->motion_segment) {
        change = vec3d_sub(move, slot->move);
        slot->move = move;
    } else {
        ++slot->segment; // carried: the jump is no motion, and the speed before it goes on
    }
    slot->motion_segment = state.segment;
    slot->head = next;
    quat_matrix(head->rotation, next.orientation);
    head->second_difference = vec3_from(change);
    head->move = vec3_from(slot->move);
    head->wind = vec3_from(vec3d_add(state.wind, wind_at(&slot->wind, t)));
}

static void step_slot(Daemon* daemon, Slot* slot)
{
    double now = time_of(daemon, daemon->steps, 0), dt = time_of(daemon, daemon->steps, 1) - now;
    enter_segment(slot, now, dt);
    follow_freeze(slot);
    for (int s = 0; s < daemon->sim.substeps; ++s)
        move_head(slot, &slot->heads[s], time_of(daemon, daemon->steps, s + 1));
    if (!slot->frozen) sim_step(slot->sim, slot->heads);
    float rotation[9];
    quat_matrix(rotation, slot->frozen ? slot->frozen_orientation : slot->head.orientation);
    slot->clamped += publish_quantise(&slot->planes, slot->sim, rotation, daemon->options.project,
                                      daemon->styles[slot->style].hair);
}

// One character spreads its blocks over the threads; many characters are spread whole.
static void step_slots(Daemon* daemon)
{
    int threads = daemon->sim.threads, used = daemon->used;
    if (used < 2 || threads < 2) {
        for (int i = 0; i < used; ++i)
            step_slot(daemon, daemon->slots[daemon->order[i]]);
        return;
    }
#pragma omp parallel for num_threads(threads) schedule(dynamic)
    for (int i = 0; i < used; ++i)
        step_slot(daemon, daemon->slots[daemon->order[i]]);
}

// Here rather than where it is stepped: characters are stepped side by side.
static void count_quarantined(Daemon* daemon)
{
    char text[160];
    for (int i = 0; i < daemon->used; ++i) {
        Slot* slot = daemon->slots[daemon->order[i]];
        int64_t count = sim_quarantined(slot->sim);
        if (count == slot->quarantined) continue;
        daemon->quarantined += count - slot->quarantined;
        slot->quarantined = count;
        snprintf(text, sizeof text,
                 "strands of character %d were not finite or 1 km from the head and are back at "
                 "rest; lower the stiffness or raise the substeps",
                 slot->number);
        remark(daemon, COMPLAINT_QUARANTINE, text);
    }
}

static void begin_epoch(Daemon* daemon, int64_t epoch)
{
    daemon->publisher.epoch = epoch;
    daemon->first_step = daemon->steps;
    for (int i = 0; i < daemon->style_count; ++i)
        publish_style_restart(&daemon->styles[i].publish);
}

// A daemon that starts while a higher epoch is on the air would not be listened to: it begins a
// higher one. Only once and only while it is new, or two daemons would outbid each other for ever.
static void yield_epoch(Daemon* daemon)
{
    const Publisher* publisher = &daemon->publisher;
    bool is_new = (double)daemon->steps < EPOCH_LISTEN_S * daemon->sim.rate_hz;
    if (daemon->higher_epoch <= publisher->epoch || daemon->has_yielded || !is_new) return;
    if (daemon->options.epoch > 0 || daemon->higher_epoch == INT64_MAX) return;
    daemon->has_yielded = true;
    begin_epoch(daemon, daemon->higher_epoch + 1);
    notice_say(&daemon->options.notice, "another daemon has a higher epoch; continuing as %lld",
               (long long)publisher->epoch);
}

static void count_step(Daemon* daemon, int64_t us)
{
    daemon->step_us += us;
    if (++daemon->step_count < (int64_t)daemon->sim.rate_hz) return;
    // A recording made without the clock is the same each time; its figures of time are 0.
    daemon->mean_step_us =
        daemon->options.fast ? 0.0 : (double)daemon->step_us / (double)daemon->step_count;
    daemon->step_us = daemon->step_count = 0;
}

void daemon_tick(Daemon* daemon)
{
    int64_t start = base_monotonic_us();
    yield_epoch(daemon);
    // Ticks are 32 bits on the wire: 414 days at 60 Hz, but 24 at 1000 Hz.
    if (daemon->steps - daemon->first_step == INT32_MAX)
        begin_epoch(daemon, daemon->publisher.epoch + 1);
    daemon->utime =
        daemon->options.fast
            ? (int64_t)((double)(daemon->steps - daemon->first_step) * 1e6 / daemon->sim.rate_hz)
            : base_wall_us();
    consume_inputs(daemon);
    step_slots(daemon);
    count_quarantined(daemon);
    ++daemon->steps;
    count_step(daemon, base_monotonic_us() - start);
}

// Publishing -------------------------------------------------------------------------------------

static FrameHeader header_of(const Daemon* daemon, const Slot* slot)
{
    return (FrameHeader){.utime = daemon->utime,
                         .epoch = daemon->publisher.epoch,
                         .style_hash = daemon->styles[slot->style].publish.bytes.hash,
                         .tick = daemon_tick_number(daemon),
                         .segment = slot->segment,
                         .pose = slot->head,
                         .slot = (uint16_t)slot->number,
                         .profile = FRAME_PROFILE_FULL};
}

static void remark_unsent(Daemon* daemon, const Slot* slot)
{
    char text[200];
    Vec3d at = slot->head.position;
    if (pose_is_near(at))
        snprintf(text, sizeof text, "character %d is not sent: is the clock before 1970?",
                 slot->number);
    else
        snprintf(text, sizeof text,
                 "character %d is not sent: its head at %g %g %g m must be within %g m of the "
                 "origin",
                 slot->number, at.x, at.y, at.z, POSE_FARTHEST_M);
    remark(daemon, COMPLAINT_UNSENT, text);
}

void daemon_publish_slice(Daemon* daemon, int slice, int slices)
{
    int64_t total = 0, message = 0;
    for (int i = 0; i < daemon->used; ++i)
        total += publish_block_count(&daemon->publisher,
                                     daemon->styles[daemon->slots[daemon->order[i]]->style].hair);
    int64_t first = total * slice / slices, end = total * (slice + 1) / slices;
    for (int i = 0; i < daemon->used; ++i) {
        const Slot* slot = daemon->slots[daemon->order[i]];
        const Hairstyle* hair = daemon->styles[slot->style].hair;
        FrameHeader header = header_of(daemon, slot);
        int blocks = publish_block_count(&daemon->publisher, hair);
        for (int b = 0; b < blocks; ++b, ++message)
            if (message >= first && message < end &&
                !publish_block(&daemon->publisher, &header, &slot->planes, hair, b))
                remark_unsent(daemon, slot);
    }
}

static void publish_status(Daemon* daemon)
{
    DaemonStatus status = daemon_status(daemon);
    StatusMessage message = {.utime = daemon->utime,
                             .epoch = daemon->publisher.epoch,
                             .tick = daemon_tick_number(daemon),
                             .rate_hz = (float)daemon->sim.rate_hz,
                             .step_us = (float)status.step_us,
                             .characters = status.characters,
                             .strands = status.strands,
                             .overruns = status.overruns,
                             .clamped = status.clamped,
                             .rejected = status.rejected,
                             .sent_messages = status.sent_messages,
                             .sent_bytes = status.sent_bytes,
                             .quarantined = status.quarantined,
                             .jumps = status.jumps};
    uint8_t bytes[CONTROL_MAX_BYTES];
    publish_bytes(&daemon->publisher, daemon->utime, CHANNEL_STATUS, bytes,
                  status_encode(bytes, sizeof bytes, &message));
}

void daemon_publish_background(Daemon* daemon, int64_t elapsed_us)
{
    daemon->publisher.bulk_sharers = 0;
    for (int i = 0; i < daemon->style_count; ++i) {
        const PublishStyle* style = &daemon->styles[i].publish;
        daemon->publisher.bulk_sharers +=
            style->due[STYLE_BULK] && style->bytes.size[STYLE_BULK] > 0;
    }
    for (int i = 0; i < daemon->style_count; ++i)
        publish_style_due(&daemon->publisher, &daemon->styles[i].publish, daemon->utime,
                          elapsed_us);
    daemon->since_status_us += elapsed_us;
    if (daemon->since_status_us < 1000000) return;
    daemon->since_status_us = 0;
    publish_status(daemon);
}

void daemon_publish_styles(Daemon* daemon)
{
    for (int i = 0; i < daemon->style_count; ++i)
        publish_style_all(&daemon->publisher, &daemon->styles[i].publish, daemon->utime);
}

void daemon_record_styles(Daemon* daemon, DaemonSink sink)
{
    Publisher* publisher = &daemon->publisher;
    DaemonSink first = publisher->sinks[0];
    int count = publisher->sink_count;
    publisher->sinks[0] = sink;
    publisher->sink_count = 1;
    daemon_publish_styles(daemon);
    publisher->sinks[0] = first;
    publisher->sink_count = count;
    for (int i = 0; i < daemon->style_count; ++i)
        publish_style_restart(&daemon->styles[i].publish);
}

// Looking in -------------------------------------------------------------------------------------

int64_t daemon_epoch(const Daemon* daemon)
{
    return daemon->publisher.epoch;
}

int daemon_tick_number(const Daemon* daemon)
{
    return (int)(daemon->steps - daemon->first_step) - 1;
}

double daemon_rate_hz(const Daemon* daemon)
{
    return daemon->sim.rate_hz;
}

int64_t daemon_unsent(const Daemon* daemon)
{
    return daemon->publisher.unsent;
}

void daemon_count_overrun(Daemon* daemon, int ticks)
{
    daemon->overruns += ticks;
}

DaemonStatus daemon_status(const Daemon* daemon)
{
    const Hairstyle* first = daemon->styles[0].hair;
    DaemonStatus status = {.characters = daemon->used,
                           .styles = daemon->style_count,
                           .style = first->name,
                           .guides = first->guide_count,
                           .nodes = first->nodes,
                           .step_us = daemon->mean_step_us,
                           .overruns = daemon->overruns,
                           .rejected = daemon->rejected,
                           .sent_messages = daemon->publisher.sent_messages,
                           .sent_bytes = daemon->publisher.sent_bytes,
                           .quarantined = daemon->quarantined,
                           .jumps = daemon->jumps};
    for (int i = 0; i < daemon->used; ++i) {
        const Slot* slot = daemon->slots[daemon->order[i]];
        status.strands += daemon->styles[slot->style].hair->guide_count;
        status.clamped += slot->clamped;
    }
    return status;
}

uint64_t daemon_state_hash(const Daemon* daemon)
{
    XXH64_state_t* state = XXH64_createState();
    if (state == NULL) return 0;
    XXH64_reset(state, 0);
    for (int i = 0; i < daemon->used; ++i)
        sim_hash(daemon->slots[daemon->order[i]]->sim, state);
    uint64_t hash = XXH64_digest(state);
    XXH64_freeState(state);
    return hash;
}
