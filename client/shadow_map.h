// What shadow methods share: depth maps, and stacks of layers of optical depth.
#pragma once

#include "client/shadow.h"

// A depth texture and its framebuffer.
bool shadow_map_create(ShadowMap* map, const Gl* gl, int size, Fault* fault);
void shadow_map_free(ShadowMap* map, const Gl* gl);
// Makes the map's framebuffer and `program` current for light from `light`; clears nothing.
void shadow_map_use(const ShadowMap* map, const Gl* gl, GLuint framebuffer, GLuint program,
                    int size, Vec3 light, const float rotation[9]);
// Clears the depth map and draws hair into it with shadow->hair_program, no ribbon thinner than
// `least_m`.
int shadow_map_draw_hair(const Shadow* shadow, const Gl* gl, const Hair* hair, Vec3 light,
                         const float rotation[9], float least_m);

// Planes as the options space them, the array that holds them, and the program that fills it.
// `defines` are the program's own and may be NULL.
bool shadow_layers_create(Shadow* shadow, const Gl* gl, const char* defines, Fault* fault);
void shadow_layers_free(ShadowLayers* layers, const Gl* gl);
int shadow_layers_draw(const Shadow* shadow, const Gl* gl, const Hair* hair, Vec3 light,
                       const float rotation[9]);
// Optical depth that is stored as 1: more than 1 where stored numbers end there.
float shadow_layers_unit(const ShadowOptions* options);

// Rows of shadow_methods.
bool shadow_depth_create(Shadow* shadow, const Gl* gl, Fault* fault);
int shadow_depth_draw(const Shadow* shadow, const Gl* gl, const Hair* hair, Vec3 light,
                      const float rotation[9]);
bool shadow_opacity_create(Shadow* shadow, const Gl* gl, Fault* fault);
bool shadow_deep_create(Shadow* shadow, const Gl* gl, Fault* fault);
int shadow_deep_draw(const Shadow* shadow, const Gl* gl, const Hair* hair, Vec3 light,
                     const float rotation[9]);
