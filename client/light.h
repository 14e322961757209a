// Light pass: what every ribbon point sends to the eye, once per point, before anything is
// rasterised.
//
// Light changes along a hair and not across a ribbon, and points are a few pixels apart. Shading
// each fragment instead, most of which coverage throws away, cost three times as much on llvmpipe
// (2.2 s against 0.7 s for the ponytail, one look-up of shadows a fragment; one run, busy machine);
// shading each vertex costs twice the points, on the one thread where llvmpipe runs vertex shaders.
#pragma once

#include "client/camera.h"
#include "client/shading.h"
#include "client/shadow.h"

enum { LIGHT_KEY, LIGHT_FILL, LIGHT_RIM, LIGHT_SKY, LIGHT_STRENGTHS };
enum { LIGHT_BODY, LIGHT_SHINE, LIGHT_TARGETS };

// Towards key, fill and rim light, unit, world axes.
typedef struct Lights {
    Vec3 key, fill, rim;
    float strength[LIGHT_STRENGTHS]; // irradiance of the three; radiance of the sky
    float extinction_per_m;          // of hair, for transmittance
} Lights;

typedef struct Light {
    GLuint program, framebuffer, vao;
    Shading shading;
    bool each;                     // a run for every light, with that light's shadows
    GLuint targets[LIGHT_TARGETS]; // RGBA16F, as wide as the update targets
    int rows;
} Light;

// `shadow`: of the key light.
bool light_create(Light* light, const Gl* gl, const ShadingOptions* shading, const Shadow* shadow,
                  Fault* fault);
void light_free(Light* light, const Gl* gl);
// Makes room for a style's points. False with a fault, and then there is room as before.
bool light_fit(Light* light, const Gl* gl, const Update* update, Fault* fault);

// Gives a program the uniforms of shaders/lights.glsl and transmittance.glsl.
void lights_bind(const Lights* lights, const Gl* gl, GLuint program);

// Gives a program that draws ribbons what the pass left, on units UNIT_FREE + 2 and + 3.
void light_samplers(const Gl* gl, GLuint program);
void light_show(const Light* light, const Gl* gl);

// `shadows` are those of key, fill and rim light; of the key alone where it was created without
// ShadowOptions.all_lights. `transmittance`: instead, how much of the key light arrives. Returns
// the draw calls.
int light_run(Light* light, const Gl* gl, const Hair* hair, const Shadow* const* shadows,
              const Lights* lights, const Frame* frame, bool transmittance);
