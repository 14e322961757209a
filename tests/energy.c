#include "tests/energy.h"

#include "server/models.h"

#include <math.h>
#include <string.h>

#define LINKS      7
#define NODES      (LINKS + 1)
#define LENGTH_M   0.28
#define RATE_HZ    60
#define SECONDS    1
#define KICK_M_S   0.3
#define MOST_STEPS 256
#define LINK_M     (LENGTH_M / LINKS)

static Vec3d link_of(const Vec3* nodes, int n)
{
    return n == 0 ? (Vec3d){0, -1, 0} : vec3d_sub(vec3d_from(nodes[n]), vec3d_from(nodes[n - 1]));
}

static double turn_at(const Vec3* nodes, int n)
{
    Vec3d a = link_of(nodes, n - 1), b = link_of(nodes, n), across = vec3d_cross(a, b);
    return atan2(sqrt(vec3d_dot(across, across)), vec3d_dot(a, b));
}

// What bends joint n to `turn`, over the mass of a node: cascade.h, forest.h.
static double joint(const SimDefinition* d, int n, double turn)
{
    double k = (double)model_stiffness(d, (float)(LINK_M * (n - 1))) * LINK_M * LINK_M;
    if (n == 1) k *= 2.0;
    return d->model == MODEL_CASCADE ? k * (1.0 - cos(turn)) : 0.5 * k * turn * turn;
}

// Above rest, over the mass of a node.
static double potential(const SimDefinition* d, const Vec3* nodes)
{
    double sum = 0.0;
    for (int n = 1; n < NODES; ++n) {
        Vec3d off = vec3d_sub(vec3d_from(nodes[n]), vec3d_from(d->rest[n]));
        if (models[d->model].has_hinges) sum += joint(d, n, turn_at(nodes, n));
        if (d->model == MODEL_SPRING)
            sum += 0.5 * (double)model_stiffness(d, (float)(LINK_M * n)) * vec3d_dot(off, off);
        else
            sum += (double)d->gravity_m_s2 * off.y;
    }
    return sum;
}

// The forest's inertia is that of each link about its own joint.
static double motion(const SimDefinition* d, const Vec3* now, const Vec3* before, double dt)
{
    double sum = 0.0;
    for (int n = 1; n < NODES; ++n) {
        Vec3d a = vec3d_from(now[n]), b = vec3d_from(before[n]);
        if (d->model == MODEL_FOREST) a = link_of(now, n), b = link_of(before, n);
        Vec3d v = vec3d_scale(vec3d_sub(a, b), 1.0 / dt);
        sum += 0.5 * vec3d_dot(v, v);
    }
    return sum;
}

// Between the last two steps, where Verlet's velocity is.
static double energy_of(const SimDefinition* d, const Sim* sim)
{
    Vec3 now[NODES], before[NODES];
    sim_state(sim, now, before);
    return motion(d, now, before, 1.0 / (d->rate_hz * d->substeps)) +
           0.5 * (potential(d, now) + potential(d, before));
}

// Slope of a line through y(0), y(1) ... by least squares.
static double slope(const double* y, int count)
{
    double middle = 0.5 * (count - 1), above = 0.0, below = 0.0;
    for (int i = 0; i < count; ++i) {
        above += (i - middle) * y[i];
        below += (i - middle) * (i - middle);
    }
    return above / below;
}

static double watch(const SimDefinition* d, Sim* sim)
{
    SimHead heads[MOST_STEPS] = {0};
    double energy[SECONDS * RATE_HZ];
    for (int s = 0; s < d->substeps; ++s)
        memcpy(heads[s].rotation, (const float[9]){1, 0, 0, 0, 1, 0, 0, 0, 1},
               sizeof heads[s].rotation);
    heads[0].second_difference.x = (float)(-KICK_M_S / (d->rate_hz * d->substeps));
    for (int tick = 0; tick < SECONDS * RATE_HZ; ++tick) {
        sim_step(sim, heads);
        heads[0].second_difference.x = 0.0f;
        energy[tick] = energy_of(d, sim);
    }
    return slope(energy, SECONDS * RATE_HZ) * RATE_HZ / energy[0];
}

bool energy_drift(SimDefinition definition, double* drift_per_s, int64_t* lost, Fault* fault)
{
    Vec3 rest[NODES];
    *drift_per_s = (double)NAN;
    if (definition.model == MODEL_CASCADE_THESIS || definition.model == MODEL_FOREST_Z) return true;
    for (int n = 0; n < NODES; ++n)
        rest[n] = vec3(0, (float)(-LINK_M * n), 0);
    definition.strands = 1;
    definition.nodes = NODES;
    definition.rest = rest;
    definition.rate_hz = RATE_HZ;
    definition.damping_per_s = 0.0f;
    Sim* sim = sim_create(&definition, fault);
    if (sim == NULL) return false;
    *drift_per_s = watch(&definition, sim);
    *lost = sim_quarantined(sim);
    sim_destroy(sim);
    return true;
}
