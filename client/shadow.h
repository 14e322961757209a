// Shadow pass: how much of a light hair and head let through.
//
// A method is a row of shadow_methods: a file here that draws what it needs from the light, and a
// file of shaders/ with its two functions of a place, which shaders/transmittance.glsl calls. The
// head has a depth map of its own in every method but `none`: it is opaque, and layers suit only
// what is not (thesis 5.7.1).
#pragma once

#include "client/camera.h"
#include "client/hair.h"
#include "client/matrix.h"

#define SHADOW_MAX_LAYERS    128
#define SHADOW_DEFINES_BYTES 128
#define SHADOW_MAX_PASSES    4  // of 8 targets, which every OpenGL 3.3 has, with 4 layers each
#define SHADOW_LEAST_SIZE    64 // texels across
#define SHADOW_MOST_SIZE     1024

// How thick layers are, from the light: alike; as 1:2:3 ...; each `growth` times the one before.
typedef enum ShadowSpacing { SPACING_EVEN, SPACING_RISING, SPACING_EXPONENTIAL } ShadowSpacing;
// Of layers. 8 bits round every strand to 1/255 and end at T = 0.004: a chart point.
typedef enum ShadowFormat { SHADOW_RGBA16F, SHADOW_RGBA8, SHADOW_RGBA32F } ShadowFormat;

typedef struct ShadowTuning {
    float
        bias_m; // how far before its place a look-up stands, so that a ribbon hardly shades itself
    ShadowSpacing spacing;
    float growth;
    float reach_m; // deep: what its layers share, from the first hair on, but for the last, which
                   // has the rest; 0: they share all
} ShadowTuning;

typedef struct ShadowOptions {
    int method;   // row of shadow_methods
    int size;     // texels across
    bool follows; // fewer where the head is small in the picture: half, a quarter
    int layers;   // 0: as the row says
    ShadowFormat format;
    const ShadowTuning* tuning; // NULL: the row's
    bool evaluated;             // of update_paths: programs find ribbon points themselves
    bool all_lights;            // fill and rim cast shadows too, by maps half as wide
} ShadowOptions;

// Texture units, with those of hair.h.
enum { UNIT_HAIR_DEPTH = UNIT_FREE, UNIT_BODY_DEPTH, UNIT_HAIR_LAYERS = UNIT_FREE + 8 };

typedef struct ShadowMap {
    GLuint texture, framebuffer;
    Mat4 matrix;   // head-relative world to clip space
    float span_m;  // near to far
    float texel_m; // across
} ShadowMap;

// Optical depth in front of planes, four planes a slice of an array.
typedef struct ShadowLayers {
    GLuint texture, program;
    GLuint framebuffers[SHADOW_MAX_PASSES];
    int targets, passes;             // slices drawn at once, and how often
    float depths[SHADOW_MAX_LAYERS]; // where planes are, 0 near .. 1 far; -1: no plane
} ShadowLayers;

typedef struct ShadowMethod ShadowMethod;

typedef struct Shadow {
    ShadowOptions options;
    ShadowTuning tuning;
    const ShadowMethod* method;
    int size;             // texels across that are drawn and read, of those there are
    ShadowMap hair, body; // `hair` has a texture where the method needs first depths
    ShadowLayers layers;
    GLuint hair_program, body_program, fibres;
    char defines[SHADOW_DEFINES_BYTES]; // for programs that look shadows up
} Shadow;

struct ShadowMethod {
    const char *name, *help;
    const char* look_up; // file of shaders/, without .glsl
    int least_layers, most_layers, layers;
    ShadowTuning tuning;
    // False with a fault; what was made is freed by shadow_free.
    bool (*create)(Shadow* shadow, const Gl* gl, Fault* fault);
    // Renders hair; `hair` is fitted. Returns the draw calls.
    int (*draw)(const Shadow* shadow, const Gl* gl, const Hair* hair, Vec3 light,
                const float rotation[9]);
};

extern const ShadowMethod shadow_methods[]; // ended by a row without a name
int shadow_find_method(const char* name);   // its row, or -1

ShadowOptions shadow_default(void);
// For fill or rim.
ShadowOptions shadow_smaller(const ShadowOptions* key);
bool shadow_create(Shadow* shadow, const Gl* gl, const ShadowOptions* options, GLuint fibres,
                   Fault* fault);
void shadow_free(Shadow* shadow, const Gl* gl);

// Takes as many texels as the picture can show. True where they are not as many as before: then
// shadows must be drawn anew.
bool shadow_resize(Shadow* shadow, const Frame* frame);

// Renders what the method needs for light from direction `light` (towards it, world axes). Returns
// the draw calls.
int shadow_run(Shadow* shadow, const Gl* gl, const Hair* hair, Vec3 light, const Frame* frame);

// Gives a shading program (built with shadow.defines) what was rendered, on units from UNIT_FREE
// on.
void shadow_samplers(const Gl* gl, GLuint program);
void shadow_bind(const Shadow* shadow, const Gl* gl, GLuint program);
