#include "server/daemon_inputs.h"

#include "server/daemon_characters.h"
#include "server/models.h"

#include <stdio.h>
#include <string.h>

#define APPLIED_BYTES  1400
#define ADD_PATIENCE_S 1.5 // for the add of a character whose poses come already

static void receive_request(Daemon* daemon, const uint8_t* bytes, size_t size)
{
    RequestMessage request;
    Fault fault;
    if (!request_decode(&request, bytes, size, &fault)) {
        complaints_reject(&daemon->complaints, COMPLAINT_REQUEST, fault.text);
        return;
    }
    uint64_t hash = request.style_hash;
    const Character* c = request.slot < CHANNEL_MAX_SLOTS ? daemon->characters[request.slot] : NULL;
    if (hash == 0 && c != NULL) hash = daemon->styles[c->style].publish.bytes.hash;
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
        complaints_reject(&daemon->complaints, COMPLAINT_STATUS, fault.text);
    else if (status.epoch > daemon->higher_epoch)
        daemon->higher_epoch = status.epoch;
}

static void queue_input(Daemon* daemon, Input* input, const uint8_t* bytes, size_t size)
{
    if (size > sizeof input->bytes) size = sizeof input->bytes; // fixed sizes: cannot happen
    input->size = size;
    memcpy(input->bytes, bytes, size);
    if (!inputs_push(&daemon->inputs, input))
        complaints_reject(&daemon->complaints, COMPLAINT_OVERFLOW,
                          "more inputs in one tick than the queue holds");
}

static bool decode_input(Input* input, const uint8_t* bytes, size_t size, Fault* fault)
{
    switch (input->kind) {
    case INPUT_POSE:
    case INPUT_TORSO:
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
    [INPUT_TORSO] = {CHANNEL_TORSO, COMPLAINT_POSE},
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
            complaints_reject(&daemon->complaints, input_table[input.kind].complaint, fault.text);
    } else if (strcmp(channel, CHANNEL_REQUEST) == 0) {
        receive_request(daemon, bytes, size);
    } else if (strcmp(channel, CHANNEL_STATUS) == 0) {
        receive_status(daemon, bytes, size);
    } else {
        complaints_reject(&daemon->complaints, COMPLAINT_CHANNEL,
                          "a message on a channel this daemon does not read");
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
    complaints_reject(&daemon->complaints, COMPLAINT_STYLE, text);
}

// Senders repeat an add each second: a pose may well come before the add that a daemon hears.
static bool may_be_early(Daemon* daemon, int number)
{
    int64_t* since = &daemon->orphans[number];
    if (*since == 0) *since = 1 + daemon->steps;
    return (double)(1 + daemon->steps - *since) < ADD_PATIENCE_S * daemon->sim.rate_hz;
}

static void reject_orphan(Daemon* daemon, int number)
{
    if (may_be_early(daemon, number))
        ++daemon->complaints.rejected;
    else
        complaints_reject(&daemon->complaints, COMPLAINT_EMPTY_SLOT,
                          "a pose for a slot without a character");
}

static void apply_character(Daemon* daemon, const CharacterMessage* message)
{
    if (message->verb == CHARACTER_REMOVE) {
        daemon_characters_remove(daemon, message->slot);
        return;
    }
    int style = find_style(daemon, message->style);
    if (style < 0) {
        reject_style(daemon, message->style);
        return;
    }
    Fault fault;
    const Character* old = daemon->characters[message->slot];
    // Senders repeat an add for a daemon that starts after them: LCM keeps nothing.
    if (old != NULL && old->style == style) return;
    const Motion* motion = old != NULL ? old->motion : daemon->motion;
    Vec3d position = old != NULL ? old->base.position : (Vec3d){0, 0, 0};
    ++daemon->segments[message->slot]; // nobody interpolates from one hairstyle to another
    if (old != NULL) ++daemon->characters[message->slot]->segment;
    if (!daemon_characters_add(daemon, message->slot, style, motion, position, &fault))
        complaints_reject(&daemon->complaints, COMPLAINT_CHARACTER, fault.text);
}

static void push_pose(Daemon* daemon, Character* c, const PoseMessage* message)
{
    char text[160];
    if (!poses_push(&c->poses, message, character_time(&daemon->sim, daemon->steps, 0))) return;
    ++daemon->jumps;
    snprintf(text, sizeof text,
             "the head of character %d jumped without raising its segment: taken as a carry; raise "
             "the segment of " CHANNEL_POSE " at a teleport",
             c->number);
    complaints_remark(&daemon->complaints, COMPLAINT_JUMP, text);
}

static void apply_pose(Daemon* daemon, const PoseMessage* message)
{
    Character* c = daemon->characters[message->slot];
    if (c == NULL)
        reject_orphan(daemon, message->slot);
    else if (c->motion->at != NULL)
        complaints_reject(&daemon->complaints, COMPLAINT_POSE_IN_CODE,
                          "a pose for a character that moves by itself; start with --motion bus");
    else
        push_pose(daemon, c, message);
}

// A torso may be posed under a head that moves by itself.
static void apply_torso(Daemon* daemon, const PoseMessage* message)
{
    Character* c = daemon->characters[message->slot];
    if (c == NULL)
        reject_orphan(daemon, message->slot);
    else
        poses_push(&c->torso, message, character_time(&daemon->sim, daemon->steps, 0));
}

static bool is_among(const Character* c, int first, int count)
{
    return c->number >= first && c->number < first + count;
}

static void apply_wind(Daemon* daemon, const WindMessage* message)
{
    for (int i = 0; i < daemon->used; ++i) {
        Character* c = daemon->characters[daemon->order[i]];
        if (is_among(c, message->first_slot, message->slot_count)) c->wind = *message;
    }
}

static bool tune(Daemon* daemon, Character* c, const TuningMessage* message, Fault* fault)
{
    Fault forced;
    SimDefinition wanted = *sim_definition(c->sim);
    if (message->set & TUNING_STIFFNESS) wanted.stiffness_s2 = message->stiffness_s2;
    if (message->set & TUNING_DAMPING) wanted.damping_per_s = message->damping_per_s;
    if (message->set & TUNING_GRAVITY) wanted.gravity_m_s2 = message->gravity_m_s2;
    if (message->set & TUNING_DRAG) wanted.drag_per_s = message->drag_per_s;
    if (message->set & TUNING_ITERATIONS) wanted.iterations = message->iterations;
    if (message->set & TUNING_PEARL_RADIUS) wanted.pearl_radius_m = message->pearl_radius_m;
    if (!sim_tune(c->sim, &wanted, fault)) return false;
    if (!model_is_stable(sim_definition(c->sim), &forced))
        complaints_warn(&daemon->complaints, COMPLAINT_FORCED, forced.text);
    return true;
}

// Each character by itself: what one is stable with may be too much for another's damping.
static void apply_tuning(Daemon* daemon, const TuningMessage* message)
{
    Fault fault;
    bool taken = true;
    for (int i = 0; i < daemon->used; ++i) {
        Character* c = daemon->characters[daemon->order[i]];
        if (is_among(c, message->first_slot, message->slot_count))
            taken = tune(daemon, c, message, &fault) && taken;
    }
    if (taken) return;
    fault_prefix(&fault, CHANNEL_TUNING);
    complaints_reject(&daemon->complaints, COMPLAINT_UNSTABLE, fault.text);
}

static void apply_input(Daemon* daemon, const Input* input)
{
    switch (input->kind) {
    case INPUT_POSE:
        apply_pose(daemon, &input->pose);
        break;
    case INPUT_TORSO:
        apply_torso(daemon, &input->pose);
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

void daemon_inputs_consume(Daemon* daemon)
{
    for (int i = 0; i < daemon->inputs.count; ++i) {
        const Input* input = &daemon->inputs.queue[i];
        apply_input(daemon, input);
        publish_applied(daemon, input);
    }
    daemon->inputs.count = 0;
}
