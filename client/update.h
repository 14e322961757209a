// Update pass: guide textures -> position, normal, tangent of every ribbon point. How, is a row of
// update_paths: the formula is the same, of shaders/point_formula.glsl or update_cpu.c.
#pragma once

#include "client/gl.h"
#include "client/ribbons.h"
#include "client/upload.h"

#define UPDATE_WIDTH 512 // texels across the tables and targets

enum { UPDATE_POSITIONS, UPDATE_NORMALS, UPDATE_TANGENTS, UPDATE_TARGETS };
enum { TABLE_GUIDES, TABLE_WEIGHTS, TABLE_OFFSETS, TABLE_TANGENTS, TABLE_NORMALS, UPDATE_TABLES };
// Texture units of the formula, behind all that programs which draw ribbons have of their own.
enum { UPDATE_UNIT = 16, UPDATE_UNITS = 3 + UPDATE_TABLES };

// What the formula knows besides textures; shaders/points_block.glsl has the same.
typedef struct PointsBlock {
    float box_low[4]; // w 1: each row's newest tick; 0: the one before; between, mixes
    float box_size[4];
    GLint capsules[4];
    GLuint newest[HAIRSTYLE_MAX_GUIDES / 32];
    float capsule_from[HAIRSTYLE_MAX_COLLIDERS][4], capsule_to[HAIRSTYLE_MAX_COLLIDERS][4];
} PointsBlock;

typedef struct Update Update;
typedef struct UpdateCpu UpdateCpu; // of update_cpu.c

// Guides as textures and, for the CPU, as they came.
typedef struct UpdateGuides {
    const GuideTextures* textures;
    const GuidesView* view;
    float blend;
} UpdateGuides;

typedef struct UpdatePath {
    const char *name, *help;
    // Programs that draw ribbons evaluate the formula themselves; there are no targets.
    bool evaluated;
    // False with a fault; what was made is freed by update_free.
    bool (*create)(Update* update, const Gl* gl, const Hairstyle* style, Fault* fault);
    // Fills the targets; the formula's textures and block are bound. Returns the draw calls.
    int (*run)(const Update* update, const Gl* gl, const UpdateGuides* guides);
} UpdatePath;

extern const UpdatePath update_paths[]; // ended by a row without a name
int update_find_path(const char* name); // its row, or -1

struct Update {
    const UpdatePath* path;
    GLuint program, framebuffer, vao;
    GLuint block;                           // uniform buffer of a PointsBlock
    GLuint feedback[UPDATE_TARGETS];        // vertex buffers of the path `buffer`
    GLuint targets[UPDATE_TARGETS];         // RGBA32F: xyz + half width, + random, + along
    GLuint tables[UPDATE_TABLES];           // RGBA32F, static
    GLuint rest_tangents;                   // RGBA32F, x node, y guide
    GLuint guide_positions, guide_tangents; // not owned; of the last run
    PointsBlock constants;
    UpdateCpu* cpu;
    Ribbons ribbons; // not owned: tables of the style
    int rows;        // of the tables
    int point_count;
};

// The tables of `ribbons` must outlive it.
bool update_create(Update* update, const Gl* gl, const Hairstyle* style, const Ribbons* ribbons,
                   int path, Fault* fault);
void update_free(Update* update, const Gl* gl);

// Runs the path. `blend` 1 shows each row's newest tick, 0 the one before, between mixes. `view` is
// what was uploaded last. Returns the draw calls.
int update_run(Update* update, const Gl* gl, const GuideTextures* textures, const GuidesView* view,
               float blend);

// For programs that evaluate the formula: points their samplers at UPDATE_UNIT and following, once;
// binds what is there, before each draw.
void update_samplers(const Gl* gl, GLuint program);
void update_bind(const Update* update, const Gl* gl);

// Names of what update.vert writes, in the order of the targets.
extern const char* const update_captured[UPDATE_TARGETS];

// Shared by the paths. `texels` is memory, or an offset into the bound unpack buffer.
void update_put_texels(const Gl* gl, GLuint texture, int count, const void* texels);

// The paths, for the table alone.
bool update_pass_create(Update* update, const Gl* gl, const Hairstyle* style, Fault* fault);
bool update_linear_create(Update* update, const Gl* gl, const Hairstyle* style, Fault* fault);
int update_pass_run(const Update* update, const Gl* gl, const UpdateGuides* guides);
bool update_buffer_create(Update* update, const Gl* gl, const Hairstyle* style, Fault* fault);
int update_buffer_run(const Update* update, const Gl* gl, const UpdateGuides* guides);
bool update_cpu_create(Update* update, const Gl* gl, const Hairstyle* style, Fault* fault);
int update_cpu_run(const Update* update, const Gl* gl, const UpdateGuides* guides);
void update_cpu_free(Update* update);
