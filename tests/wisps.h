// What the files of the tree share: its state, and how members lie about their super-node.
#pragma once

#include "messages/trig.h"
#include "tests/tree.h"

#define SETTLED_AT 12.0 // e-folds after which what is left of an offset is nothing

// What a partly split wisp holds of its driven nodes while it steps. A gang of them a thread.
typedef struct Held {
    Lanes3* rest;
    Lanes3* offset; // of driven nodes, head space
    Lanes *keep, *inverse_mass, *inner_part, *outer_part;
    void* memory;
} Held;

struct Tree {
    TreeOptions options;
    Sim *members, *centres;
    int wisps, nodes, threads;
    int* order;         // which strand of the definition is the n-th of `members`
    int* first;         // of each wisp
    int* most;          // ... and how far it may merge
    float* mass;        // of a super-node, in members
    Lanes3* offset;     // [wisp][node] from the super-node at rest, head space, m
    Lanes3* strayed;    // [wisp][node] what that was off when it merged
    int64_t* merged_at; // [wisp][node] tick
    Lanes* rest_radius; // [block of centres][node], m
    Lanes* radius;      // ... of what has merged
    Lanes3* velocity;   // [block of centres][node] of super-nodes at the end of the tick before
    Lanes* heat;        // [block of centres][node] acceleration times radius
    Lanes3* trace;      // [substep][block of centres][node] where they were
    Held* held;         // of each thread
    Contact* contact;
    float rotation[9], before[9]; // of the head at the end of the last two substeps
    int64_t tick;
    bool from_root; // the model's forces begin at the root, so a part of a strand cannot do without
    // A model that places each node from the one before throws a free end whose inner nodes are
    // then put elsewhere: a wisp of it is split or not.
    bool whole;
};

// origin + turn v
static inline void place_lanes(Lanes3* to, Vec3 origin, const float turn[9], const Lanes3* v)
{
    for (int l = 0; l < LANES; ++l) {
        real x = v->x[l], y = v->y[l], z = v->z[l];
        to->x[l] = (real)origin.x + ((real)turn[0] * x + (real)turn[1] * y + (real)turn[2] * z);
        to->y[l] = (real)origin.y + ((real)turn[3] * x + (real)turn[4] * y + (real)turn[5] * z);
        to->z[l] = (real)origin.z + ((real)turn[6] * x + (real)turn[7] * y + (real)turn[8] * z);
    }
}

// The inverse of turn applied to v - origin.
static inline void unplace_lanes(Lanes3* to, Vec3 origin, const float turn[9], const Lanes3* v)
{
    for (int l = 0; l < LANES; ++l) {
        real x = v->x[l] - (real)origin.x, y = v->y[l] - (real)origin.y,
             z = v->z[l] - (real)origin.z;
        to->x[l] = (real)turn[0] * x + (real)turn[3] * y + (real)turn[6] * z;
        to->y[l] = (real)turn[1] * x + (real)turn[4] * y + (real)turn[7] * z;
        to->z[l] = (real)turn[2] * x + (real)turn[5] * y + (real)turn[8] * z;
    }
}

static inline void shift_lanes(Lanes3* to, Vec3 origin, const Lanes3* v)
{
    for (int l = 0; l < LANES; ++l) {
        to->x[l] = (real)origin.x + v->x[l];
        to->y[l] = (real)origin.y + v->y[l];
        to->z[l] = (real)origin.z + v->z[l];
    }
}

static inline Vec3 centre_at(const Tree* tree, int wisp, int n)
{
    return lane_get(&tree->centres->blocks[wisp / LANES].position[n], wisp % LANES);
}

static inline Vec3 centre_was_at(const Tree* tree, int wisp, int n)
{
    return lane_get(&tree->centres->blocks[wisp / LANES].previous[n], wisp % LANES);
}

// Roots are the head's, but in a partly split wisp nobody writes them to the members.
static inline bool is_merged(const Tree* tree, int wisp, int n)
{
    return tree->first[wisp] > 1 && n < tree->first[wisp];
}

// Of something that each super-node has a number of.
static inline real* number_of(const Tree* tree, Lanes* numbers, int wisp, int n)
{
    return &numbers[wisp / LANES * tree->nodes + n].v[wisp % LANES];
}

// Where members are from their super-node, head space.
static inline void offset_of(const Tree* tree, int wisp, int n, Lanes3* to)
{
    int at = wisp * tree->nodes + n;
    double age_s = (double)(tree->tick - tree->merged_at[at]) / tree->members->definition.rate_hz;
    double folds = (double)tree->options.settle_per_s * age_s;
    *to = tree->offset[at];
    if (folds > SETTLED_AT) return;
    real left = (real)trig_exp(-folds);
    const Lanes3* strayed = &tree->strayed[at];
    for (int l = 0; l < LANES; ++l) {
        to->x[l] += left * strayed->x[l];
        to->y[l] += left * strayed->y[l];
        to->z[l] += left * strayed->z[l];
    }
}

static inline real farthest2(const Lanes3* v)
{
    real most = 0;
    for (int l = 0; l < LANES; ++l) {
        real square = v->x[l] * v->x[l] + v->y[l] * v->y[l] + v->z[l] * v->z[l];
        most = square > most ? square : most;
    }
    return most;
}
