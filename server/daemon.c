#include "server/daemon.h"

#include "server/daemon_characters.h"
#include "server/daemon_inputs.h"
#include "server/daemon_state.h"
#include "server/models.h"

#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#define EPOCH_LISTEN_S 2.0 // a daemon yields to a higher epoch only while it is new

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
    scene_destroy(options->scene);
    options->scene = scene;
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
static bool check_simulation(Daemon* daemon, const Hairstyle* hair, Fault* fault)
{
    Sim* trial = character_sim(&daemon->sim, hair, fault);
    Fault forced;
    if (trial != NULL && !model_is_stable(sim_definition(trial), &forced))
        complaints_warn(&daemon->complaints, COMPLAINT_FORCED, forced.text);
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
    const Scene* scene = daemon->options.scene;
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
    const Scene* scene = daemon->options.scene;
    for (int i = 0; scene != NULL && i < scene->character_count; ++i) {
        const SceneCharacter* c = &scene->characters[i];
        const Motion* motion = c->motion != NULL ? motion_find(c->motion) : daemon->motion;
        if (!daemon_characters_add(daemon, c->slot, c->style, motion, c->position, fault))
            return false;
    }
    for (int i = 0; i < daemon->options.characters; ++i)
        if (daemon->characters[i] == NULL &&
            !daemon_characters_add(daemon, i, 0, daemon->motion, (Vec3d){0.6 * i, 0, 0}, fault))
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
    return check_options(daemon, fault) && load_styles(daemon, fault) &&
           add_characters(daemon, fault);
}

Daemon* daemon_create(const DaemonOptions* options, Fault* fault)
{
    Daemon* daemon = calloc(1, sizeof *daemon);
    if (daemon == NULL) {
        scene_destroy(options->scene);
        fault_set(fault, "no memory for the daemon");
        return NULL;
    }
    daemon->options = *options;
    daemon->sim = options->sim;
    daemon->complaints.notice = options->notice;
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
        character_destroy(daemon->characters[i]);
    for (int i = 0; i < daemon->style_count; ++i) {
        style_bytes_free(&daemon->styles[i].publish.bytes);
        hairstyle_destroy(daemon->styles[i].hair);
    }
    scene_destroy(daemon->options.scene);
    free(daemon);
}

void daemon_add_sink(Daemon* daemon, DaemonSink sink)
{
    if (daemon->publisher.sink_count < DAEMON_MAX_SINKS)
        daemon->publisher.sinks[daemon->publisher.sink_count++] = sink;
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
    daemon_inputs_consume(daemon);
    daemon_characters_step(daemon);
    ++daemon->steps;
    count_step(daemon, base_monotonic_us() - start);
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
                           .rejected = daemon->complaints.rejected,
                           .sent_messages = daemon->publisher.sent_messages,
                           .sent_bytes = daemon->publisher.sent_bytes,
                           .quarantined = daemon->quarantined,
                           .jumps = daemon->jumps};
    for (int i = 0; i < daemon->used; ++i) {
        const Character* c = daemon->characters[daemon->order[i]];
        status.strands += c->hair->guide_count;
        status.clamped += c->clamped;
    }
    return status;
}

uint64_t daemon_state_hash(const Daemon* daemon)
{
    XXH64_state_t* state = XXH64_createState();
    if (state == NULL) return 0;
    XXH64_reset(state, 0);
    for (int i = 0; i < daemon->used; ++i)
        sim_hash(daemon->characters[daemon->order[i]]->sim, state);
    uint64_t hash = XXH64_digest(state);
    XXH64_freeState(state);
    return hash;
}
