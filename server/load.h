// From names and files to hairstyles: built-in styles, style JSON, .tfx grooms.
#pragma once

#include "messages/hairstyle.h"

#define LOAD_MAX_FILES 16

#define LOAD_TFX3_UNIT_M  0.0027 // what AMD's ponytail is in (pupils 62.5 mm apart)
#define LOAD_GUIDES       64
#define LOAD_NODES        8
#define LOAD_HALF_HEAD_M  0.108 // crown to head centre: half of chin to crown
#define LOAD_TIP_SPREAD   0.75  // of the roots' spread (RMS): tips closer together than that meet
#define LOAD_SMALL_HAIR_M 0.05
#define LOAD_LARGE_HAIR_M 3.0

// How a style is made. Zero means default everywhere.
typedef struct LoadOptions {
    const char* styles[LOAD_MAX_FILES]; // one built-in name, one .json, or .tfx sections
    int style_count;
    const char* head;      // .obj, or NULL
    double unit_m;         // metres per file unit; 0: 0.0027 for .tfx 3, 1 for .tfx 4
    bool keep_axes;        // do not negate z (.tfx version 3 only)
    int guides, nodes;     // of an imported groom; 0: 64 and 8
    const char* both_ends; // which sections obey their both-ends flag: NULL or "auto",
                           // "none", or a comma list of section names
} LoadOptions;

// Whether anything is set that only imported grooms heed.
bool load_has_groom_options(const LoadOptions* options);

// The style, or NULL with a fault that names file, field, value and fix. Notices tell defaults that
// were assumed (units, axes) and oddities found (degenerate strands, unlikely head size).
//
// "auto" obeys a both-ends flag only where the section's tips converge (LOAD_TIP_SPREAD): AMD's
// ponytail has the flag on its free-hanging tail too, by an export mistake (ratios: 0.52 where
// combed to the band, 5.9 in the tail).
Hairstyle* load_style(const LoadOptions* options, const Notice* notice, Fault* fault);

// Names of the built-in styles, NULL-terminated.
extern const char* const load_builtin_styles[];

// Prints what --info prints: sections, counts, lengths, sums as in FORMAT.md, guides, lanes, hash.
bool load_print_info(const LoadOptions* options, const Notice* notice, Fault* fault);
