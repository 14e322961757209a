// One style on the GPU: everything that is drawn of a head, and how to draw its ribbons.
#pragma once

#include "client/body.h"
#include "client/order.h"
#include "client/update.h"

#define HAIR_COARSER 2

typedef struct Hair {
    const Hairstyle* style; // not owned
    HairMaterial material;  // the style's, or another that was asked for
    Ribbons ribbons;
    GuideTextures guides;
    Update update;
    Body body;
    Body coarser[HAIR_COARSER]; // the same for small pictures of it; empty where there is none
    Order order;
    GLuint vao, indices;
} Hair;

// `path` is a row of update_paths.
bool hair_create(Hair* hair, const Gl* gl, const Hairstyle* style, Lod lod, int path, Fault* fault);
void hair_free(Hair* hair, const Gl* gl);

// The head for a picture whose pixels (or a shadow map whose texels) are `pixel_m` wide there.
const Body* hair_body(const Hair* hair, float pixel_m);

// Texture units that points.glsl and fibres.glsl read, besides those of update.h.
enum { UNIT_POSITIONS, UNIT_NORMALS, UNIT_TANGENTS, UNIT_FIBRES, UNIT_FREE };

// For programs that draw ribbons: how they find points. "" or a line.
const char* hair_defines(bool evaluated);
// Points a program's ribbon samplers at those units; once after building it.
void hair_samplers(const Gl* gl, GLuint program);
// Binds what says where ribbon points are, for a program that has those samplers.
void hair_bind_points(const Hair* hair, const Gl* gl);
// Binds the style's tables and draws all ribbons with the program in use. Returns the draw calls:
// 1, or 0 where there is nothing to draw.
int hair_draw(const Hair* hair, const Gl* gl, GLuint fibres);
// The same in the order of the last order_sort.
int hair_draw_sorted(const Hair* hair, const Gl* gl, GLuint fibres);
