// Shadow pass: depth of hair and of head as the key light sees them (shaders/transmittance.glsl
// says what is made of it).
#pragma once

#include "client/camera.h"
#include "client/hair.h"
#include "client/matrix.h"

#define SHADOW_SIZE                                                                                \
    512 // texels across either map: 1.5 mm on long hair; 1024 costs 0.2 s more on llvmpipe

typedef struct ShadowMap {
    GLuint texture, framebuffer;
    Mat4 matrix;  // head-relative world to clip space
    float span_m; // near to far
} ShadowMap;

typedef struct Shadow {
    ShadowMap hair, body;
    GLuint hair_program, body_program, fibres;
} Shadow;

bool shadow_create(Shadow* shadow, const Gl* gl, GLuint fibres, Fault* fault);
void shadow_free(Shadow* shadow, const Gl* gl);

// Renders both maps for light from direction `light` (towards it, world axes). Returns the draw
// calls.
int shadow_run(Shadow* shadow, const Gl* gl, const Hair* hair, Vec3 light, const Frame* frame);

// Gives a shading program the maps, on units UNIT_FREE and UNIT_FREE + 1.
void shadow_samplers(const Gl* gl, GLuint program);
void shadow_bind(const Shadow* shadow, const Gl* gl, GLuint program);
