// One picture: upload -> update -> shadow -> light -> shade -> read. draw.c is its table of
// contents.
#pragma once

#include "client/receive.h"
#include "client/shade.h"

enum { PASS_UPLOAD, PASS_UPDATE, PASS_SHADOW, PASS_LIGHT, PASS_SHADE, PASS_READ, PASSES };
extern const char* const draw_pass_names[PASSES];

#define DRAW_TIMES 512 // of each pass are kept, for median and p95

typedef struct DrawTimes {
    float ms[PASSES][DRAW_TIMES];           // rings; CPU clock around glFinish
    float processor_ms[PASSES][DRAW_TIMES]; // of all threads of this process, a software GL's too
    int64_t count[PASSES];
} DrawTimes;

typedef struct Drawing {
    const Gl* gl;
    ShadeOptions options;
    CameraOptions camera;
    Shade shade;
    Shadow shadow;    // of the key light
    Shadow others[2]; // of fill and rim, with ShadowOptions.all_lights
    Light light;
    GLuint fibres;
    Hair hair;
    Box still;     // extent_still of it
    float stray_m; // extent_stray of it
    uint64_t style_hash;
    int style_version;
    bool has_style;
    bool moved, lit, looked; // guides or pose; the key light; the camera: since the last picture
    Frame frame;             // of the last picture
    int64_t uploaded_bytes;
    int64_t draw_calls;
    int64_t frames;
    bool timed; // wait for every pass and keep its time
    DrawTimes* times;
} Drawing;

bool draw_create(Drawing* drawing, const Gl* gl, const ShadeOptions* options,
                 const CameraOptions* camera, Fault* fault);
void draw_free(Drawing* drawing);

// Takes on a style (or a newer version of it): grows, binds and uploads what never changes.
bool draw_set_style(Drawing* drawing, const Hairstyle* style, uint64_t hash, int version,
                    Fault* fault);

// Looks from elsewhere, and turns the key light, from the next picture on.
void draw_set_camera(Drawing* drawing, const CameraOptions* camera);
void draw_set_light(Drawing* drawing, float yaw_deg, float pitch_deg);

// Draws the newest state of `view` into `image`. What did not move is not done again: no guides, no
// upload and no update; neither guides, head nor light, no shadows; nothing at all, no picture, and
// `image` keeps what it has. False where there is no style yet.
bool draw_picture(Drawing* drawing, const GuidesView* view, Image* image);

// Sum of hair coverage over a picture: its alpha channel, in pixels.
double draw_hair_pixels(const Image* image);
