// Scene files: which styles, which characters, which physics. Schema: server/README.md.
#pragma once

#include "messages/channels.h"
#include "server/load.h"
#include "server/sim.h"

#define SCENE_MAX_STYLES 16

typedef struct SceneStyle {
    char name[HAIRSTYLE_NAME_BYTES]; // what characters call it
    LoadOptions load;                // its strings belong to the scene
} SceneStyle;

typedef struct SceneCharacter {
    int slot;
    int style;          // of the scene's styles
    const char* motion; // NULL: the daemon's
    Vec3d position;     // of the head when nothing moves it, m
} SceneCharacter;

typedef struct Scene {
    int style_count, character_count;
    SceneStyle styles[SCENE_MAX_STYLES];
    SceneCharacter characters[CHANNEL_MAX_SLOTS];
    char** strings; // what the style's paths point to
    int string_count;
} Scene;

// Reads a scene; values for the simulation go over those in `sim`. NULL with a fault that names
// file, line, column and key.
Scene* scene_load(const char* path, SimDefinition* sim, Fault* fault);
void scene_destroy(Scene* scene);
