// The daemon as an object: characters, their inputs, the tick, what is published. hair-server runs
// one against the bus and the clock; hair-client --embedded runs one in its own process, tick by
// tick.
#pragma once

#include "messages/control.h"
#include "messages/hairstyle.h"
#include "server/load.h"
#include "server/sim.h"

typedef struct Daemon Daemon;

// Everything that leaves the daemon passes here: bus, log and embedded client are such sinks.
typedef struct DaemonSink {
    void (*publish)(void* context, int64_t utime, const char* channel, const uint8_t* bytes,
                    size_t size);
    void* context;
} DaemonSink;

#define DAEMON_MAX_SINKS 4

typedef struct DaemonOptions {
    LoadOptions load;
    struct Scene* scene; // of daemon_use_scene, or NULL
    const char* motion;  // see motion.h
    int characters;      // slots 0..n-1 start filled with the first style; a scene's come first
    SimDefinition sim;   // rate, substeps, iterations, stiffness ... (strands etc. ignored)
    int mtu;
    int64_t epoch; // 0: max(wall clock, highest heard + 1)
    bool fast;     // utime = tick * 1e6 / rate instead of the wall clock
    bool project;  // length projection of what is published
    Notice notice;
} DaemonOptions;

DaemonOptions daemon_default(void);

// Reads a scene: its simulation values go over those in `options` at once, so that what the caller
// sets afterwards wins; its styles and characters wait there for daemon_create.
bool daemon_use_scene(DaemonOptions* options, const char* path, Fault* fault);

// Takes the scene of `options`, also where it fails: one scene makes one daemon.
Daemon* daemon_create(const DaemonOptions* options, Fault* fault);
void daemon_destroy(Daemon* daemon);
void daemon_add_sink(Daemon* daemon, DaemonSink sink);

// An input message as it came from the bus; copied, consumed at the next tick boundary. Bad bytes
// are counted and noticed once per kind. Not thread safe: call it where daemon_tick is called.
void daemon_receive(Daemon* daemon, const char* channel, const uint8_t* bytes, size_t size);

// Consumes inputs and simulates one tick. Tick 0 ends at time 0, tick n at n / rate.
// daemon_publish_slice then hands out its messages in `slices` portions (0 .. slices-1), so that
// the caller can pace them over the tick.
void daemon_tick(Daemon* daemon);
void daemon_publish_slice(Daemon* daemon, int slice, int slices);

// Re-sends due style parts and status; `elapsed_us` since the last call bounds the bytes.
void daemon_publish_background(Daemon* daemon, int64_t elapsed_us);
// The whole style at once, unpaced: where every sink can take it.
void daemon_publish_styles(Daemon* daemon);
// The same to `sink` alone, at the start of a recording; the others get theirs paced.
void daemon_record_styles(Daemon* daemon, DaemonSink sink);

int64_t daemon_epoch(const Daemon* daemon);
// Of the last tick simulated: -1 before the first, which is 0.
int daemon_tick_number(const Daemon* daemon);
double daemon_rate_hz(const Daemon* daemon);
void daemon_count_overrun(Daemon* daemon, int ticks);
// Messages that no sink got, because what they should say does not fit the wire (a head 1e9 m away,
// a clock before 1970). More than none in a recording is a hole in it.
int64_t daemon_unsent(const Daemon* daemon);

typedef struct DaemonStatus {
    int characters, strands, styles;
    const char* style; // name of the first
    int guides, nodes; // of the first style
    double step_us;    // mean of a tick over the last second
    int64_t overruns, rejected, clamped, sent_messages, sent_bytes;
    int64_t quarantined; // strands put back to rest since the start
    int64_t jumps;       // of heads that did not raise their segment
} DaemonStatus;

DaemonStatus daemon_status(const Daemon* daemon);

// XXH64 over slot, strand, node: position then previous position, of every character.
uint64_t daemon_state_hash(const Daemon* daemon);
