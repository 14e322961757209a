// The groom of the path-traced pictures in ../shared/assets/reference, strand for strand: the
// imported guides of AMD's ponytail, each with follow hairs around it by the rule that scene.json
// states. Our renderer and theirs then show the same hair.
#pragma once

#include "server/import.h"

#define FOLLOW_PER_GUIDE 4
#define FOLLOW_SECTIONS  4

// Files in the order that numbers the guides.
extern const char* const follow_files[FOLLOW_SECTIONS];

// Number `n` of the rule's sequence, 0..1: a PCG hash.
double follow_random(uint32_t n);

// Follow hair `follow` (0..FOLLOW_PER_GUIDE - 1) of a guide whose number over all files is `guide`:
// `points` x 3 numbers, file units and axes.
void follow_strand(float* out, const float* guide_points, int points, uint32_t guide,
                   uint32_t follow);

// Guides and follow hairs as a style of imported strands, each drawn as one hair of 0.16 mm at the
// root and 0.04 mm at the tip, with the head; NULL with a fault. `folder` ends with '/'.
Hairstyle* follow_style(const char* folder, Fault* fault);
