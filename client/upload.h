// Guide rows to textures: the bytes of the wire go to the GPU as they are.
#pragma once

#include "client/gl.h"
#include "client/receive.h"

// Positions RGBA16 and tangents RGBA16_SNORM, x node, y guide, two layers: tick & 1. Every row is
// uploaded once; the last two ticks stay.
typedef struct GuideTextures {
    GLuint positions, tangents;
    int guides, nodes;
    int32_t row_tick[2][HAIRSTYLE_MAX_GUIDES]; // what each layer holds; -1 nothing
    uint32_t generation;                       // of the view that was taken last
    GLuint newest[HAIRSTYLE_MAX_GUIDES / 32];  // bit per row: the layer of its newest tick
    int64_t bytes;                             // uploaded so far: 12 a node
} GuideTextures;

// Starts with every row of both layers at the style's rest pose, so that a row that never comes is
// drawn where it was combed.
bool upload_create(GuideTextures* textures, const Gl* gl, const Hairstyle* style, Fault* fault);
void upload_free(GuideTextures* textures, const Gl* gl);

// Uploads the rows of `view` that the textures lack; true if there were any.
bool upload_rows(GuideTextures* textures, const Gl* gl, const GuidesView* view);
