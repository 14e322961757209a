// How hair lets through what is behind it: variants as a table, each a case of
// shaders/coverage.glsl and the fixed-function state it wants.
#pragma once

#include "client/gl.h"

typedef enum Transparency {
    TRANSPARENCY_AUTO, // hash at 2 or more samples, test at 1
    TRANSPARENCY_TEST,
    TRANSPARENCY_COVERAGE,
    TRANSPARENCY_HASH,
    TRANSPARENCY_BLEND,
    TRANSPARENCIES
} Transparency;

typedef struct TransparencyVariant {
    const char* name;
    int least_samples; // with fewer, `test` is drawn
    bool to_coverage;  // GL's own alpha to coverage
    bool blends;       // with what is there already: wants wisps from back to front
} TransparencyVariant;

extern const TransparencyVariant transparency_variants[TRANSPARENCIES];

// Hair is drawn once, or first as depth alone (pre-z) and then where it is what is seen.
typedef enum TransparencyStep { STEP_ALONE, STEP_DEPTH, STEP_AFTER_DEPTH } TransparencyStep;

// What is drawn where `asked` is wanted and a pixel has so many samples; never AUTO.
Transparency transparency_choose(Transparency asked, int samples);

// The defines that coverage.glsl wants, with a step's program.
#define TRANSPARENCY_DEFINES 160
void transparency_defines(char text[TRANSPARENCY_DEFINES], Transparency transparency, int samples,
                          TransparencyStep step);

// State for a step, depth test included, and back to none of it.
void transparency_begin(const Gl* gl, Transparency transparency, int samples,
                        TransparencyStep step);
void transparency_end(const Gl* gl);
