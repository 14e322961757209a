// What a strand sends to the eye: which of the shadings, its parameters and its tables. The light
// pass (hair) and the shade pass (scalp) call it through shaders/shading.glsl.
#pragma once

#include "client/gl.h"
#include "client/marschner.h"
#include "messages/hairstyle.h"

typedef enum ShadingKind {
    SHADING_KAJIYA,
    SHADING_MARSCHNER,
    SHADING_BANKS,
    SHADING_CLAY,
    SHADINGS
} ShadingKind;

extern const char* const shading_names[SHADINGS + 1]; // as on the command line; NULL ends them

typedef enum TableFormat { TABLE_HALF, TABLE_BYTE, TABLE_FLOAT } TableFormat;
typedef enum TableLayout { LAYOUT_ENDS, LAYOUT_NALU } TableLayout; // shaders/marschner.glsl

// Every parameter may change from picture to picture, but for kind, size, format and layout.
typedef struct ShadingOptions {
    ShadingKind kind;
    Fibre fibre;
    bool has_absorption; // fibre's own is taken; otherwise it follows from the hair's colours
    Vec3 shine;          // colour of the first highlight (marschner)
    float through; // weight of TT and TRT: 1 is one fibre alone, what is more stands for light
                   // that other fibres send on, and has the hair's hue
    float diffuse; // weight of Kajiya's diffuse term, for light scattered by many fibres
    float wrap;    // 1: lights without shadows dim behind the head; 0: strands stand alone
    float most;    // what a lobe sends at most for irradiance 1: grazing R has no bound
    int table_size;
    TableFormat format;
    TableLayout layout;
} ShadingOptions;

typedef struct Shading {
    ShadingOptions options; // change them freely, but for those four
    Fibre made;             // what the tables hold
    bool has_tables;
    GLuint around, along;
    float around_scale[LOBES], along_scale[LOBES];
    float* texels; // room to make a table in
    int64_t tables_made;
} Shading;

ShadingOptions shading_default(void);

// Reads "beta=6,norm=deon" into the options; what there is: shading_parameters. False with a fault
// that names what is wrong, and then part of it may be taken.
extern const char shading_parameters[];
bool shading_parse(ShadingOptions* options, const char* text, Fault* fault);

// Lines for program_build that choose the shading.
#define SHADING_DEFINES_BYTES 128
void shading_defines(const ShadingOptions* options, char text[SHADING_DEFINES_BYTES]);

bool shading_create(Shading* shading, const Gl* gl, const ShadingOptions* options, Fault* fault);
void shading_free(Shading* shading, const Gl* gl);

// Makes the tables anew where something they depend on has changed.
void shading_update(Shading* shading, const Gl* gl, const HairMaterial* material);

// Gives a program the tables' units, once after building it; then uniforms and tables, while
// current.
void shading_samplers(const Gl* gl, GLuint program);
void shading_bind(const Shading* shading, const Gl* gl, GLuint program);

// Hair colours by name; NULL ends them. The second puts one into a material.
extern const char* const shading_colour_names[];
void shading_colour(int index, HairMaterial* material);
