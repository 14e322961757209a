// One strand without a head, for the tests of the models.
#pragma once

#include "messages/vec.h"
#include "server/sim.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#define MAX_LINKS 64
#define GRAVITY   9.81
#define LENGTH_M  0.28
#define MAX_SUBS  64

// cmocka's own compares floats.
#define assert_near(a, b, tolerance)                                                               \
    do {                                                                                           \
        double near_got = (double)(a), near_wanted = (b);                                          \
        if (!(fabs(near_got - near_wanted) <= (tolerance)))                                        \
            fail_msg("%.9g is not %.9g", near_got, near_wanted);                                   \
    } while (0)

static const float identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

// One strand of `links` links along `way`.
typedef struct Strand {
    Vec3 rest[MAX_LINKS + 1];
    int links;
    Sim* sim;
    int substeps;
} Strand;

static inline SimDefinition bare(ModelKind model, int links)
{
    SimDefinition d = sim_default();
    d.model = model;
    d.strands = 1;
    d.nodes = links + 1;
    d.substeps = MAX_SUBS;
    d.gravity_m_s2 = (float)GRAVITY;
    d.gravity_compensation = false;
    d.fall_off_power = 0;
    d.damping_per_s = 0;
    d.iterations = 1;
    d.outermost = false; // the head's acceleration is then a force on all, as gravity is
    return d;
}

static inline void straight(Strand* strand, int links, Vec3 way)
{
    strand->links = links;
    for (int n = 0; n <= links; ++n)
        strand->rest[n] = vec3_scale(way, (float)(LENGTH_M * n / links));
}

static inline void start(Strand* strand, SimDefinition d)
{
    Fault fault = {0};
    d.rest = strand->rest;
    strand->substeps = d.substeps;
    strand->sim = sim_create(&d, &fault);
    if (strand->sim == NULL) fail_msg("%s", fault.text);
    sim_reset(strand->sim, identity);
}

static inline void run(Strand* strand, int ticks)
{
    SimHead heads[MAX_SUBS] = {0};
    for (int s = 0; s < strand->substeps; ++s)
        memcpy(heads[s].rotation, identity, sizeof identity);
    for (int i = 0; i < ticks; ++i)
        sim_step(strand->sim, heads);
}

static inline Vec3 node(const Strand* strand, int n)
{
    Vec3 now[MAX_LINKS + 1], before[MAX_LINKS + 1];
    sim_state(strand->sim, now, before);
    return now[n];
}

// k/m of the hinge chain that has the elastica's Gamma = rho A g L^3 / (E I).
static inline float hinge_stiffness(double gamma, int links)
{
    return (float)(GRAVITY / LENGTH_M * pow(links, 4) / gamma);
}
