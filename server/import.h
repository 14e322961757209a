// Files from elsewhere -> plain arrays. Hostile files give a fault; nothing is trusted.
#pragma once

#include "messages/hairstyle.h"

#define IMPORT_MAX_TFX_BYTES  ((size_t)512 << 20)
#define IMPORT_MAX_OBJ_BYTES  ((size_t)128 << 20)
#define IMPORT_MAX_COORDINATE 1e7  // file units; beyond it a file is not a groom
#define IMPORT_DEGENERATE     1e-4 // of the mean length: a strand shorter than this is no strand

// One .tfx file, in its own units and axes.
typedef struct ImportedStrands {
    char name[HAIRSTYLE_NAME_BYTES]; // from the file name
    float version;                   // 3.0 or 4.0
    int strands, points;             // points of every strand
    float* positions;                // [strand][point][3]
    bool both_ends;                  // version 3: its flag; version 4: every last w is 0
    // Sums over the file as it is, in double, for --info and FORMAT.md's check values.
    double sum[3], low[3], high[3];
    double mean_length, min_length, max_length, total_length;
    int degenerate; // strands shorter than IMPORT_DEGENERATE of the mean, or of no length
} ImportedStrands;

bool import_tfx(ImportedStrands* imported, const char* path, Fault* fault);
void import_free(ImportedStrands* imported);

// Polyline length of a strand, file units; and whether that is too short to be one.
double import_strand_length(const ImportedStrands* imported, int strand);
bool import_is_degenerate(const ImportedStrands* imported, double length);

// Wavefront .obj: triangles (polygons are fanned), objects become parts with a colour guessed from
// their name; objects of one colour share a part. Positions in file units, scaled by `unit_m`; with
// `negate_z` also mirrored and the faces turned round. Missing normals are made. Bounded by
// HAIRSTYLE_MAX_*. On a fault `mesh` is empty.
bool import_obj(HeadMesh* mesh, const char* path, float unit_m, bool negate_z, Fault* fault);

// A whole regular file of at most `cap` bytes, with a NUL after it; NULL with a fault. free() it.
uint8_t* import_read_file(const char* path, size_t cap, size_t* size, Fault* fault);

// A file's name without folder and extension, cut to fit.
void import_stem(char name[HAIRSTYLE_NAME_BYTES], const char* path);
