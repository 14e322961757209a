// Shading pass: background, head, hair into a multisampled linear target; then resolved to sRGB.
#pragma once

#include "client/camera.h"
#include "client/image.h"
#include "client/light.h"

typedef enum Transparency { TRANSPARENCY_AUTO, TRANSPARENCY_TEST, TRANSPARENCY_HASH } Transparency;
typedef enum ShadeView { VIEW_SHADED, VIEW_COVERAGE } ShadeView;

// Everything about a picture that stays from frame to frame.
typedef struct ShadeOptions {
    int width, height;
    int samples;               // 1, 2 or 4; lowered to what the driver has
    Transparency transparency; // auto: hash at 2 or more samples, test at 1
    ShadeView view;
    Lod lod;
    bool has_background;
    Vec3 background;                      // linear; without it a soft grey backdrop
    float light_yaw_deg, light_pitch_deg; // of the key light; fill and rim keep their places to it
} ShadeOptions;

typedef struct Shade {
    ShadeOptions options;
    int samples;
    GLuint hair_program, body_program, background_program, resolve_program;
    GLuint multisampled, colour, depth; // framebuffer and renderbuffers
    GLuint resolved, resolved_texture;  // one sample a pixel, linear, RGBA16F
    GLuint output, output_texture;      // sRGB, RGBA8
    GLuint vao;
    Lights lights;
} Shade;

ShadeOptions shade_default(void);
bool shade_create(Shade* shade, const Gl* gl, const ShadeOptions* options, Fault* fault);
void shade_free(Shade* shade, const Gl* gl);

// Draws one picture of `hair`. Returns the draw calls made.
int shade_run(const Shade* shade, const Gl* gl, const Hair* hair, const Shadow* shadow,
              const Light* light, const Frame* frame);

// Reads the picture back; `image` must have the options' size.
void shade_read(const Shade* shade, const Gl* gl, Image* image);
