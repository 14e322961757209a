#include "tests/trace.h"

#include "messages/trig.h"
#include "server/models.h"
#include "tests/rod.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST_SUBSTEPS   256
#define SETTLE_S        6.0
#define SETTLE_DAMPING  12.0f
#define BESIDE          1e-6         // of the length: how far the copies are from the first
#define FULL_DRAG_M_S   1.0          // of wind, as in server/step.c
#define HELD_STRETCHING 1e5          // E A in weights: length is as good as constant
#define TWIST_PER_BEND  (1.0 / 1.38) // G J / E I of a round fibre, Poisson's ratio 0.38

bool trace_prepare(Trace* trace, int ticks, int strands, int nodes, Fault* fault)
{
    trace_free(trace);
    size_t places = (size_t)(ticks + 1) * (size_t)strands * (size_t)nodes;
    *trace = (Trace){.ticks = ticks, .strands = strands, .nodes = nodes};
    trace->raw = calloc(places, sizeof *trace->raw);
    trace->published = calloc(places, sizeof *trace->published);
    if (trace->raw != NULL && trace->published != NULL) return true;
    trace_free(trace);
    return fault_set(fault, "no memory for %d ticks", ticks);
}

void trace_free(Trace* trace)
{
    free(trace->raw);
    free(trace->published);
    *trace = (Trace){0};
}

static size_t place(const Trace* trace, int tick, int strand, int node)
{
    return ((size_t)tick * (size_t)trace->strands + (size_t)strand) * (size_t)trace->nodes +
           (size_t)node;
}

// --- the solver

// A copy's node is moved by a fixed number of its own, so that no two copies are alike.
static Vec3 beside(Vec3d node, int copy, int n)
{
    double size = copy == 0 || n == 0 ? 0.0 : BESIDE * GROOM_LENGTH_M, a = 2.4 * n + 1.7 * copy;
    return vec3_from(vec3d_mad(node, (Vec3d){sin(a), sin(2.0 * a + 1.0), cos(3.0 * a)}, size));
}

static void fill_rest(Vec3* rest, int links, int copies, const Groom* groom)
{
    Vec3d nodes[GROOM_LINKS + 1];
    for (int s = 0; s < copies * GROOM_STRANDS; ++s) {
        groom_nodes(groom, s % GROOM_STRANDS, links, nodes);
        for (int n = 0; n <= links; ++n)
            rest[s * (links + 1) + n] = beside(nodes[n], s / GROOM_STRANDS, n);
    }
}

static bool settle(const Solver* solver, Sim* sim, SimDefinition definition, Fault* fault)
{
    static const SimHead still = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    SimHead heads[MOST_SUBSTEPS];
    SimDefinition calm = definition;
    calm.damping_per_s = SETTLE_DAMPING;
    for (int s = 0; s < definition.substeps; ++s)
        heads[s] = still;
    if (!solver->tune(sim, &calm, fault)) return false;
    for (int tick = 0; tick < SETTLE_S * CLIP_RATE_HZ; ++tick)
        solver->step(sim, heads);
    return solver->tune(sim, &definition, fault);
}

static void record(Trace* trace, int tick, const Solver* solver, const Sim* sim,
                   const float rotation[9])
{
    solver->positions(sim, rotation, false, trace->raw + place(trace, tick, 0, 0));
    solver->positions(sim, rotation, true, trace->published + place(trace, tick, 0, 0));
}

static void play(Trace* trace, const Solver* solver, Sim* sim, int substeps, const Clip* clip)
{
    SimHead heads[MOST_SUBSTEPS] = {{.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}}};
    ClipReader reader = clip_begin(clip, substeps);
    record(trace, 0, solver, sim, heads[0].rotation);
    for (int tick = 1; tick <= trace->ticks; ++tick) {
        clip_next(&reader, heads);
        solver->step(sim, heads);
        record(trace, tick, solver, sim, heads[substeps - 1].rotation);
    }
    trace->lost = solver->quarantined(sim);
}

bool trace_simulate(Trace* trace, const Solver* solver, SimDefinition definition, int links,
                    int copies, const Groom* groom, const Clip* clip, Fault* fault)
{
    static Vec3 rest[TRACE_COPIES * GROOM_STRANDS * (GROOM_LINKS + 1)];
    fill_rest(rest, links, copies, groom);
    definition.rest = rest;
    definition.strands = copies * GROOM_STRANDS;
    definition.nodes = links + 1;
    definition.rate_hz = CLIP_RATE_HZ;
    if (!trace_prepare(trace, clip_ticks(clip), definition.strands, links + 1, fault)) return false;
    Sim* sim = solver->create(&definition, fault);
    bool done = sim != NULL &&
                (models[definition.model].has_shape || settle(solver, sim, definition, fault));
    if (done) play(trace, solver, sim, definition.substeps, clip);
    solver->destroy(sim);
    return done;
}

// --- rods

static Rod* create_rod(const Groom* groom, int strand, int links, double damping_per_s,
                       int steps_a_tick, Fault* fault)
{
    Vec3d natural[GROOM_LINKS + 1];
    groom_natural(groom, strand, links, natural);
    double bending = groom_bending(groom->gamma);
    return rod_create(
        &(RodDefinition){.nodes = links + 1,
                         .rest = natural,
                         .bending_nm2 = bending,
                         .twisting_nm2 = TWIST_PER_BEND * bending,
                         .stretching_n = HELD_STRETCHING * GROOM_GRAVITY * GROOM_LENGTH_M,
                         .density_kg_m = 1.0,
                         .gravity_m_s2 = GROOM_GRAVITY,
                         .damping_per_s = damping_per_s,
                         .dt_s = 1.0 / (CLIP_RATE_HZ * steps_a_tick),
                         .scheme = ROD_BDF2},
        fault);
}

static void see_rod(Trace* trace, int tick, int strand, int links, const Rod* rod, Quat turn)
{
    Vec3d nodes[GROOM_LINKS + 1];
    int stride = links / (trace->nodes - 1);
    rod_positions(rod, nodes);
    for (int n = 0; n < trace->nodes; ++n) {
        Vec3 node = vec3_from(quat_rotate(quat_conjugate(turn), nodes[n * stride]));
        trace->raw[place(trace, tick, strand, n)] = node;
        trace->published[place(trace, tick, strand, n)] = node;
    }
}

static bool step_rod(Rod* rod, const Clip* clip, double t, double drag_per_s, int* segment,
                     Quat* turn)
{
    MotionState state = clip_at(clip, t);
    double speed = sqrt(vec3d_dot(state.wind, state.wind));
    if (state.segment != *segment) rod_carry(rod, state.pose);
    rod_blow(rod, state.wind, drag_per_s * trig_smooth(speed / FULL_DRAG_M_S));
    *segment = state.segment;
    *turn = state.pose.orientation;
    return rod_step(rod, state.pose);
}

static bool trace_rod(Trace* trace, int strand, int links, Rod* rod, double drag_per_s,
                      int steps_a_tick, const Clip* clip, Fault* fault)
{
    MotionState start = clip_at(clip, 0.0);
    int segment = start.segment;
    Quat turn = start.pose.orientation;
    if (!rod_settle(rod, start.pose, (Vec3d){0, 0, clip->speed_m_s}))
        return fault_set(fault, "rod %d does not come to rest", strand);
    see_rod(trace, 0, strand, links, rod, turn);
    for (int step = 1; step <= trace->ticks * steps_a_tick; ++step) {
        double t = (double)step / (CLIP_RATE_HZ * steps_a_tick);
        if (!step_rod(rod, clip, t, drag_per_s, &segment, &turn))
            return fault_set(fault, "rod %d in %s: no solution at %.4f s", strand, clip->name, t);
        if (step % steps_a_tick == 0) see_rod(trace, step / steps_a_tick, strand, links, rod, turn);
    }
    return true;
}

bool trace_rods(Trace* trace, const Groom* groom, int links, int seen, double damping_per_s,
                double drag_per_s, int steps_a_tick, const Clip* clip, Fault* fault)
{
    if (!trace_prepare(trace, clip_ticks(clip), GROOM_STRANDS, seen + 1, fault)) return false;
    for (int s = 0; s < GROOM_STRANDS; ++s) {
        bool done = false;
        // Where Newton does not get there, it does with smaller steps.
        for (int steps = steps_a_tick; !done && steps <= 8 * steps_a_tick; steps *= 2) {
            Rod* rod = create_rod(groom, s, links, damping_per_s, steps, fault);
            if (rod == NULL) return false;
            done = trace_rod(trace, s, links, rod, drag_per_s, steps, clip, fault);
            rod_destroy(rod);
        }
        if (!done) return false;
    }
    return true;
}

// --- distances

static double square(Vec3 a, Vec3 b)
{
    Vec3d d = vec3d_sub(vec3d_from(a), vec3d_from(b));
    return vec3d_dot(d, d);
}

static Vec3 moved(const Trace* trace, int tick, int strand, int node)
{
    return vec3_sub(trace->published[place(trace, tick, strand, node)],
                    trace->published[place(trace, 0, strand, node)]);
}

// Of the tips' displacements from the start, of `trace` `lag` ticks later than of `truth`.
static double correlation(const Trace* trace, const Trace* truth, int stride, int lag)
{
    int tip = trace->nodes - 1, from = lag < 0 ? -lag : 0;
    int to = trace->ticks - (lag > 0 ? lag : 0);
    double sum = 0.0;
    for (int tick = from; tick <= to; ++tick)
        for (int s = 0; s < GROOM_STRANDS; ++s)
            sum += vec3d_dot(vec3d_from(moved(trace, tick + lag, s, tip)),
                             vec3d_from(moved(truth, tick, s, tip * stride)));
    return sum;
}

// The largest within half a swing of the head to either side; the parabola through it and its
// neighbours gives parts of a tick. NaN where there is none inside.
static double tip_lag_ms(const Trace* trace, const Trace* truth, int stride, const Clip* clip)
{
    double most = 0.0;
    int reach = (int)(0.5 * clip->swing_s * CLIP_RATE_HZ), best = reach;
    for (int lag = -reach; lag <= reach; ++lag) {
        double value = correlation(trace, truth, stride, lag);
        if (value > most) most = value, best = lag;
    }
    if (abs(best) == reach) return (double)NAN;
    double before = correlation(trace, truth, stride, best - 1);
    double after = correlation(trace, truth, stride, best + 1);
    double bend = before - 2.0 * most + after;
    double part = bend < 0.0 ? 0.5 * (before - after) / bend : 0.0;
    return (best + part) * 1000.0 / CLIP_RATE_HZ;
}

Distance trace_distance(const Trace* trace, const Trace* truth, int stride, const Clip* clip)
{
    double sum = 0.0, raw = 0.0, motion = 0.0, most = 0.0;
    for (int tick = 0; tick <= trace->ticks; ++tick)
        for (int s = 0; s < GROOM_STRANDS; ++s)
            for (int n = 1; n < trace->nodes; ++n) {
                size_t a = place(trace, tick, s, n), b = place(truth, tick, s, n * stride);
                double apart = square(trace->published[a], truth->published[b]);
                sum += apart;
                raw += square(trace->raw[a], truth->raw[b]);
                motion += square(moved(trace, tick, s, n), moved(truth, tick, s, n * stride));
                most = apart > most || !isfinite(apart) ? apart : most;
            }
    double count = (double)(trace->ticks + 1) * GROOM_STRANDS * (trace->nodes - 1);
    return (Distance){.rms = sqrt(sum / count) / GROOM_LENGTH_M,
                      .raw_rms = sqrt(raw / count) / GROOM_LENGTH_M,
                      .motion_rms = sqrt(motion / count) / GROOM_LENGTH_M,
                      .max = sqrt(most) / GROOM_LENGTH_M,
                      .tip_lag_ms = tip_lag_ms(trace, truth, stride, clip)};
}

double trace_spread(const Trace* trace)
{
    double sum = 0.0, count = 0.0;
    for (int tick = 0; tick <= trace->ticks; ++tick)
        for (int s = GROOM_STRANDS; s < trace->strands; ++s)
            for (int n = 1; n < trace->nodes; ++n, ++count)
                sum += square(trace->published[place(trace, tick, s, n)],
                              trace->published[place(trace, tick, s % GROOM_STRANDS, n)]);
    return count > 0.0 ? sqrt(sum / count) / GROOM_LENGTH_M : 0.0;
}

// --- conduct

static void look_at_strand(const Trace* trace, int tick, int s, const double* lengths,
                           Conduct* sums)
{
    const Vec3* raw = trace->raw + place(trace, tick, s, 0);
    const Vec3* published = trace->published + place(trace, tick, s, 0);
    for (int n = 1; n < trace->nodes; ++n) {
        double stretch = fabs(sqrt(square(raw[n], raw[n - 1])) / lengths[n] - 1.0);
        double projected = sqrt(square(raw[n], published[n]));
        sums->stretch_mean += stretch;
        sums->stretch_max = fmax(sums->stretch_max, stretch);
        sums->projection_mean_m += projected;
        sums->projection_max_m = fmax(sums->projection_max_m, projected);
    }
    Vec3 tip = moved(trace, tick, s, trace->nodes - 1);
    sums->tip_peak = fmax(sums->tip_peak, sqrt(square(tip, vec3(0, 0, 0))) / GROOM_LENGTH_M);
}

static void link_lengths(double* lengths, const Groom* groom, int strand, int links)
{
    Vec3d nodes[GROOM_LINKS + 1];
    groom_nodes(groom, strand, links, nodes);
    for (int n = 1; n <= links; ++n) {
        Vec3d link = vec3d_sub(nodes[n], nodes[n - 1]);
        lengths[n] = sqrt(vec3d_dot(link, link));
    }
}

Conduct trace_conduct(const Trace* trace, const Groom* groom, const Clip* clip)
{
    Conduct sums = {0};
    double lengths[GROOM_LINKS + 1];
    int rest = (int)ceil((clip->stop_s + 1.0) * CLIP_RATE_HZ - 1e-9);
    for (int s = 0; s < GROOM_STRANDS; ++s) {
        link_lengths(lengths, groom, s, trace->nodes - 1);
        for (int tick = 0; tick <= trace->ticks; ++tick)
            look_at_strand(trace, tick, s, lengths, &sums);
        for (int n = 1; n < trace->nodes; ++n) {
            double off = sqrt(square(moved(trace, rest, s, n), vec3(0, 0, 0)));
            sums.rest = fmax(sums.rest, off / GROOM_LENGTH_M);
        }
    }
    double count = (double)(trace->ticks + 1) * GROOM_STRANDS * (trace->nodes - 1);
    sums.stretch_mean /= count;
    sums.projection_mean_m /= count;
    return sums;
}
