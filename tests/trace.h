// What strands did over a clip, in head space, at its start and at the end of every tick; and how
// far two of them are apart.
#pragma once

#include "tests/clip.h"
#include "tests/groom.h"
#include "tests/solver.h"

#define TRACE_COPIES 4 // of the groom: the first as it is, the others a little beside it

typedef struct Trace {
    int ticks, strands, nodes; // places for ticks + 1
    Vec3* raw;                 // [tick][strand][node], as simulated
    Vec3* published;           // ... with lengths put back
    int64_t lost;              // strands that were put back to rest
} Trace;

// Replaces what the trace held before; start from zero.
bool trace_prepare(Trace* trace, int ticks, int strands, int nodes, Fault* fault);
void trace_free(Trace* trace);

// The groom of `copies` copies under `definition`, over a clip. Models without a shape first settle
// for some seconds. Rest, strands, nodes and rate are filled in here.
bool trace_simulate(Trace* trace, const Solver* solver, SimDefinition definition, int links,
                    int copies, const Groom* groom, const Clip* clip, Fault* fault);

// Rods of the groom's Gamma and of `links` edges over a clip, seen at the nodes of `seen` links.
bool trace_rods(Trace* trace, const Groom* groom, int links, int seen, double damping_per_s,
                double drag_per_s, int steps_a_tick, const Clip* clip, Fault* fault);

// Node n of `trace` against node n * stride of `truth`, of the groom's strands; lengths are in
// strand lengths.
typedef struct Distance {
    double rms, raw_rms, max; // of published nodes; raw: as simulated; the root does not count
    double motion_rms;        // ... less what they are apart at the start
    double tip_lag_ms;        // by which the tips are late, where their displacements match best
} Distance;

Distance trace_distance(const Trace* trace, const Trace* truth, int stride, const Clip* clip);

// Root mean square of the copies against the first, in strand lengths.
double trace_spread(const Trace* trace);

typedef struct Conduct {
    double stretch_mean, stretch_max; // of links as simulated, relative
    double projection_mean_m, projection_max_m;
    double rest;     // farthest node from the start, a second after the clip stopped, in lengths
    double tip_peak; // farthest tip from the start, in lengths
} Conduct;

Conduct trace_conduct(const Trace* trace, const Groom* groom, const Clip* clip);
