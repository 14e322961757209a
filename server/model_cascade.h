// The cascading-spaces model (thesis 4.3), corrected to an elastic one: a spring in every joint
// draws the link to where the frame of the link before would have it.
//
// As printed each spring pulls its node and nothing pushes back on the joint, so forces are not
// conservative: the strand gains energy and flutters (notes/simulation.md 0.1, 4.3). Here joint n
// has the energy V = K (1 - a.d), K = k d^2 times the mass of a node, hence the moment K sin(phi)
// on link n and its opposite on link n - 1, each as a couple of forces on the link's ends, across
// the link. For small angles that is k (y[n] - 2 y[n-1] + y[n-2]) on three nodes: the beam with EI
// = k d^3, and 2 EI / d^3 at the clamped root. The moment is largest at 90 degrees: beyond it the
// joint folds.
#pragma once

#include "server/frames.h"

static void cascade_weigh(Block* block, const Substep* substep)
{
    real gravity = (real)substep->gravity_m_s2;
    for (int n = 0; n < block->nodes; ++n) {
        Lanes3* f = &block->acceleration[n];
        const Lanes* mass = &block->mass[n];
        LANE_LOOP
        for (int l = 0; l < LANES; ++l) {
            f->x[l] = 0;
            f->y[l] = -gravity * mass->v[l];
            f->z[l] = 0;
        }
    }
}

// Adds K (d x a), the moment that turns d towards a.
static inline void cascade_spring(Block* block, int n)
{
    const Lanes3 *d = &block->direction[n], *a = &block->predicted[n];
    Lanes3* moment = &block->moment[n];
    const real* hinge = block->hinge[n].v;
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real dx = d->x[l], dy = d->y[l], dz = d->z[l], ax = a->x[l], ay = a->y[l], az = a->z[l];
        moment->x[l] += hinge[l] * (dy * az - dz * ay);
        moment->y[l] += hinge[l] * (dz * ax - dx * az);
        moment->z[l] += hinge[l] * (dx * ay - dy * ax);
    }
}

// `sign` times the moment of joint `joint` on link n, as a couple: moment x d / length at the outer
// end, the opposite at the inner one.
static inline void cascade_couple(Block* block, int joint, int n, real sign)
{
    const Lanes3 *moment = &block->moment[joint], *d = &block->direction[n];
    Lanes3 *inner = &block->acceleration[n - 1], *outer = &block->acceleration[n];
    const real* length = block->length[n].v;
    LANE_LOOP
    for (int l = 0; l < LANES; ++l) {
        real k = sign / (length[l] > LEAST_LENGTH_M ? length[l] : LEAST_LENGTH_M);
        real fx = k * (moment->y[l] * d->z[l] - moment->z[l] * d->y[l]);
        real fy = k * (moment->z[l] * d->x[l] - moment->x[l] * d->z[l]);
        real fz = k * (moment->x[l] * d->y[l] - moment->y[l] * d->x[l]);
        outer->x[l] += fx;
        outer->y[l] += fy;
        outer->z[l] += fz;
        inner->x[l] -= fx;
        inner->y[l] -= fy;
        inner->z[l] -= fz;
    }
}

static void cascade_divide_by_mass(Block* block)
{
    for (int n = 1; n < block->nodes; ++n) {
        Lanes3* f = &block->acceleration[n];
        const Lanes* mass = &block->mass[n];
        LANE_LOOP
        for (int l = 0; l < LANES; ++l) {
            real inverse = 1 / mass->v[l];
            f->x[l] *= inverse;
            f->y[l] *= inverse;
            f->z[l] *= inverse;
        }
    }
}

static void cascade_accelerate(Block* block, const Substep* substep)
{
    frames_follow(block, substep);
    cascade_weigh(block, substep);
    for (int n = 1; n < block->nodes; ++n) {
        cascade_spring(block, n);
        cascade_couple(block, n, n, 1);
        if (n > 1) cascade_couple(block, n, n - 1, -1); // the head takes the root's
    }
    cascade_divide_by_mass(block);
}
