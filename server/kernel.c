// All stages of a substep, once per instruction set: CMake compiles this file with
// KERNEL = avx512, avx2, sse2 and scalar. The stages are headers of static functions, so that the
// compiler sees a substep whole. One object is one kernel; nothing else has code in it that the
// others share, so no AVX-512 instruction can leak to where it is not wanted.
#include "server/strands.h"

#ifdef KERNEL_SCALAR
#define LANE_LOOP // the loop as it stands: what vectors are measured against
#define NEAR_LOOP
#else
#define LANE_LOOP _Pragma("omp simd")
#define NEAR_LOOP _Pragma("omp simd reduction(| : near)")
#endif

#include "server/air.h"
#include "server/collide.h"
#include "server/collide_links.h"
#include "server/frames.h"
#include "server/integrate.h"
#include "server/length.h"
#include "server/length_direct.h"
#include "server/model_cascade.h"
#include "server/model_cascade_thesis.h"
#include "server/model_forest.h"
#include "server/model_forest_z.h"
#include "server/model_plain.h"
#include "server/model_spring.h"
#include "server/quarantine.h"
#include "server/roots.h"
#include "server/shape.h"

// A model is a file of forces, and how they move nodes: a row.
typedef struct Stages {
    void (*accelerate)(Block*, const Substep*); // NULL where no node asks for another
    void (*move)(Block*, const Substep*);
    bool keeps_lengths; // by itself
} Stages;

static const Stages stages[MODEL_COUNT] = {
    [MODEL_SPRING] = {NULL, spring_move, false},
    [MODEL_CASCADE] = {cascade_accelerate, integrate_accelerated, false},
    [MODEL_FOREST] = {forest_accelerate, forest_swing, true},
    [MODEL_PLAIN] = {NULL, plain_move, false},
    [MODEL_CASCADE_THESIS] = {cascade_thesis_accelerate, integrate_accelerated, false},
    [MODEL_FOREST_Z] = {forest_z_accelerate, forest_z_turn, true},
};

// The table of contents of the dynamics: what happens in a substep, in which order. Of a few
// blocks: see length.h.
static void substep(Block* blocks, int count, const Substep* s, const Stages* model)
{
    for (int b = 0; b < count; ++b) {
        roots_place(&blocks[b], s->rotation);
        if (model->accelerate != NULL) model->accelerate(&blocks[b], s);
        model->move(&blocks[b], s);
        shape_blend(&blocks[b]);
    }
    if (!model->keeps_lengths && s->solve_directly) length_solve(blocks, count, s->iterations);
    if (!model->keeps_lengths && !s->solve_directly) length_correct(blocks, count, s->iterations);
    for (int b = 0; b < count; ++b) {
        collide_nodes(&blocks[b], s);
        if (s->collide_links) collide_links(&blocks[b], s);
    }
}

static void step(Block* blocks, int count, const Substep* substeps, int substep_count)
{
    for (int s = 0; s < substep_count; ++s)
        substep(blocks, count, &substeps[s], &stages[substeps[s].model]);
    for (int b = 0; b < count; ++b)
        quarantine_lost(&blocks[b], substeps[substep_count - 1].rotation);
}

#define JOIN(a, b)   JOINED(a, b)
#define JOINED(a, b) a##b
#define NAME(a)      NAMED(a)
#define NAMED(a)     #a

extern const Kernel JOIN(kernel_, KERNEL);
const Kernel JOIN(kernel_, KERNEL) = {NAME(KERNEL), KERNEL_WIDTH, step};
