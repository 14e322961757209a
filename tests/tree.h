// The Adaptive Wisp Tree over a simulation of any model (thesis 4.1; Bertails, Kim, Cani and
// Neumann 2003): strands that move alike are simulated as one.
//
// Two levels. A wisp is the strands of one block (strands.h), chosen by place: lanes of a vector
// that all do the same are no cheaper one by one, so nothing smaller than a block is worth
// splitting. Its super-strand is the mean of its members, one lane in a second simulation of the
// same model. The nodes of a wisp are merged from the root on and split from `first` on. A merged
// node costs its members nothing: each is where the super-node is plus an offset that turns with
// the head. Offsets have the mean zero, so that the centre of mass is the super-node whatever the
// head does; so has the rest of how they lay when they merged, which dies away.
//
// A node splits where its acceleration times its radius is above a bound and its child has split. A
// node merges where no member moves against the mean, none has left the radius, and it would not
// split at once; from the root to the tip. The super-node is then put to the centre of mass and the
// mean velocity. In a partly split wisp the members' free ends hang on the merged part as on a head
// of their own, and what they do to it comes back once a tick, as the centre of mass of the split
// nodes. The forest models place each node from the one before and know no inner end that is moved
// from outside, so a wisp of theirs is split or merged as a whole.
#pragma once

#include "server/sim.h"
#include "tests/contact.h"

typedef struct Tree Tree;

typedef struct TreeOptions {
    float split_m2_s2;  // the bound on acceleration times radius
    float merge_m_s;    // of a member against the mean
    float loose;        // how far from the mean a member may be to merge, in radii at rest
    float settle_per_s; // what a member was off its place when it merged decays as exp(-settle t)
    int most_merged;    // nodes of a strand, from the root; 1 keeps everything split
    bool has_contact;   // between merged cylinders
    ContactOptions contact;
} TreeOptions;

TreeOptions tree_default(void);

// Everything is merged at first. NULL with a fault: as sim_create, and where strands are tied.
Tree* tree_create(const SimDefinition* definition, const TreeOptions* options, Fault* fault);
void tree_destroy(Tree* tree);

// As their namesakes in sim.h, strands in the order of the definition.
void tree_step(Tree* tree, const SimHead* heads);
void tree_reset(Tree* tree, const float rotation[9]);
void tree_positions(const Tree* tree, const float rotation[9], bool project, Vec3* positions);
void tree_state(const Tree* tree, Vec3* positions, Vec3* previous);

int tree_wisps(const Tree* tree);
int tree_wisp_of(const Tree* tree, int strand);
// Its nodes before it are merged: 1 all split, as many as there are nodes: all merged.
int tree_first(const Tree* tree, int wisp);
// Of all nodes but the roots.
double tree_split_share(const Tree* tree);

// Splits or merges by hand, whatever the criteria say of it; they go on from there.
void tree_move_first(Tree* tree, int wisp, int first);
