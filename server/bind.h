// From an imported groom to guides that carry it.
//
// Guides are chosen per section (a share by strand count, at least BIND_MIN_GUIDES), spread evenly
// by farthest-point choice over root and shape, resampled by arc length to the style's nodes. Every
// strand, chosen or not, is bound to its three nearest guides of its own section: weights by
// inverse square distance, then a rest offset for each point that makes the rest pose exact to a
// quantum of the offset scale (< 0.1 mm, measured in the tests).
#pragma once

#include "messages/hairstyle.h"

#define BIND_MIN_GUIDES 8 // of a section; of a section with fewer strands, all of them

// `points` in head space metres: [strand][point][3]; `both_ends` pins the tip's two last nodes.
typedef struct BindSection {
    const char* name;
    const Vec3* points; // [strand][point]
    int strands, points_per_strand;
    bool both_ends;
} BindSection;

// Fills guides, weights, sets, strands, offsets and the box of `style`.
bool bind_sections(Hairstyle* style, const BindSection* sections, int section_count, int guides,
                   int nodes, Fault* fault);

// How many guides each section gets; they sum to `guides`. False with a fault where that cannot be.
bool bind_share_guides(int* shares, const BindSection* sections, int section_count, int guides,
                       Fault* fault);

// Resamples a polyline of `count` points to `nodes` points equally spaced along its length.
void bind_resample(Vec3* out, int nodes, const Vec3* points, int count);
