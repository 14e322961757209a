// Shading pass: background, head, hair into a multisampled linear target; then resolved to sRGB.
#pragma once

#include "client/camera.h"
#include "client/image.h"
#include "client/light.h"
#include "client/transparency.h"

typedef enum ShadeSort { SORT_AUTO, SORT_OFF, SORT_WISPS, SORT_SEGMENTS } ShadeSort;
typedef enum ShadeView { VIEW_SHADED, VIEW_COVERAGE, VIEW_TRANSMITTANCE } ShadeView;

// Everything about a picture that stays from frame to frame.
typedef struct ShadeOptions {
    int width, height;
    int samples; // 1, 2, 4 or 8; lowered to what the driver has
    Transparency transparency;
    bool pre_z;     // hair's depth first, then only what is seen of it is shaded
    ShadeSort sort; // by distance, each picture; auto: segments where they are blended
    ShadeView view;
    ShadingOptions shading;
    bool has_colour; // of hair, instead of the style's
    int colour;      // shading_colour
    ShadowOptions shadow;
    Lod lod;
    int update; // row of update_paths
    bool has_background;
    Vec3 background;                      // linear; without it a soft grey backdrop
    float light_yaw_deg, light_pitch_deg; // of the key light; fill and rim keep their places to it
    float light_strength[LIGHT_STRENGTHS];
} ShadeOptions;

typedef struct Shade {
    ShadeOptions options;
    int samples;
    Transparency transparency; // what is drawn of what was asked
    GLuint hair_program, body_program, background_program, resolve_program;
    GLuint depth_program;               // of hair; 0 without pre-z
    GLuint multisampled, colour, depth; // framebuffer and renderbuffers
    GLuint resolved, resolved_texture;  // one sample a pixel, linear, RGBA16F
    GLuint output, output_texture;      // sRGB, RGBA8
    GLuint backdrop, backdrop_texture;  // the same without hair and head
    GLuint vao;
    Lights lights;
} Shade;

ShadeOptions shade_default(void);
bool shade_create(Shade* shade, const Gl* gl, const ShadeOptions* options, const Shadow* shadow,
                  Fault* fault);
// Turns the key light; fill and rim keep their places to it.
void shade_set_light(Shade* shade, float yaw_deg, float pitch_deg);
void shade_free(Shade* shade, const Gl* gl);

// Whether hair must be sorted before a picture, by what, and which comes first.
bool shade_sorts(const Shade* shade, OrderBy* by, bool* far_first);

// Metres that a pixel spans at one metre.
float shade_pixel_angle(const Shade* shade, const Camera* camera);

// Draws one picture of `hair`. Returns the draw calls made.
int shade_run(const Shade* shade, const Gl* gl, const Hair* hair, const Shadow* shadow,
              const Light* light, const Frame* frame);

// Reads the picture back; `image` must have the options' size.
void shade_read(const Shade* shade, const Gl* gl, Image* image);
