// Update pass: guide textures -> position, normal, tangent of every ribbon point, on the GPU.
#pragma once

#include "client/gl.h"
#include "client/ribbons.h"
#include "client/upload.h"

#define UPDATE_WIDTH 512 // texels across the tables and targets

enum { UPDATE_POSITIONS, UPDATE_NORMALS, UPDATE_TANGENTS, UPDATE_TARGETS };
enum { TABLE_GUIDES, TABLE_WEIGHTS, TABLE_OFFSETS, TABLE_TANGENTS, TABLE_NORMALS, UPDATE_TABLES };

typedef struct Update {
    GLuint program, framebuffer, vao;
    GLuint targets[UPDATE_TARGETS]; // RGBA32F: xyz + half width, + random, + along
    GLuint tables[UPDATE_TABLES];   // RGBA32F, static
    GLuint rest_tangents;           // RGBA32F, x node, y guide
    GLint blend, newest;            // uniforms
    int rows;                       // of the tables
    int point_count;
} Update;

bool update_create(Update* update, const Gl* gl, const Hairstyle* style, const Ribbons* ribbons,
                   Fault* fault);
void update_free(Update* update, const Gl* gl);

// Draws the pass. `blend` 1 shows each row's newest tick, 0 the one before, between mixes.
void update_run(const Update* update, const Gl* gl, const GuideTextures* textures, float blend);
