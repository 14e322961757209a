// A kernel: all stages of a substep, compiled for one instruction set from one text (kernel.c).
//
// Only + - * / and sqrt are used and nothing is contracted or reordered, so every kernel gives the
// same bits. Kernels rather than the compiler's function clones: clones cannot be chosen by name,
// so no test could compare them, and clang 14 cannot share them between files.
#pragma once

#include "server/sim.h"

typedef struct Block Block;
typedef struct Substep Substep;

#define KERNEL_GANG 2 // blocks side by side; four no longer fit the first cache

typedef struct Kernel {
    const char* name; // of the instruction set
    int width;        // floats that one instruction works on
    // Some substeps, as a rule all of a tick, of `count` blocks, 1 to KERNEL_GANG; they stay in the
    // cache meanwhile.
    void (*step)(Block* blocks, int count, const Substep* substeps, int substep_count);
} Kernel;

// The widest that this processor has for NULL; else the one of that name, or NULL where the build
// or the processor lacks it.
const Kernel* kernel_find(const char* name);

// "avx512, avx2, sse2, scalar": those that can run here, for messages.
const char* kernel_names(void);
