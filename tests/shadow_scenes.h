// Scenes whose shadows are known: analytic media cut into thin quads, and grooms. Each has places,
// and the exact product over the quads or strips that light crosses on its way to them.
#pragma once

#include "tests/strips.h"

// Media of ../shared/tables/shadow_layers.csv and shadow_sphere.csv, depth 0 near .. 1 far. Those
// of layers lean, so that one scene has every placement of its medium against the planes.
typedef enum SceneKind {
    SCENE_SLAB_FIT,       // 0.25 to 0.75: its faces are planes of 4, 8, 16
    SCENE_SLAB_UNALIGNED, // 0.5 thick, from 0 to 0.5
    SCENE_BLOB,           // Gaussian of 0.125 round 0.4 to 0.6
    SCENE_SHEETS,         // 0.04 thick at 0.05 to 0.15, and 0.10 thick 0.6 below it
    SCENE_IN_SHEETS,      // the same, with places in the sheets alone
    SCENE_SPHERE,         // as thick as near to far
    SCENE_KINDS
} SceneKind;
extern const char* const scene_names[SCENE_KINDS];

typedef struct Scene {
    Strips strips;
    Vec3 light;
    Frame frame;
    int count;
    Vec3* places;
    double* truth;
} Scene;

#define SCENE_SIZE_M 0.03f // near to far: within what the modified shadow map takes for hair

Scene scene_make(SceneKind kind, double tau, int quads, int places);
// `places` spread evenly over the ribbons' area; takes `strips` over.
Scene scene_groom(Strips strips, Vec3 light, const Frame* frame, int places);
// The quads, opaque: what the modified shadow map takes hair for. Truth stays.
void scene_make_opaque(Scene* scene);
void scene_free(Scene* scene);

typedef struct ShadowError {
    double rms, max, bias;
} ShadowError;

// Of transmittance at the scene's places, as `transmittance` has it.
ShadowError shadow_error(const Scene* scene, const float* transmittance);
// Renders `hair` by `options` and looks the places up. Ends the program where the driver refuses.
ShadowError shadow_measure(const Scene* scene, const Gl* gl, const Hair* hair, GLuint fibres,
                           const ShadowOptions* options, float extinction_per_m);
