// How far two pictures are apart, in figures: in linear light, in 8-bit codes, and as a viewer sees
// it. hair-compare prints them, test_golden and the studies judge by them.
#pragma once

#include "client/image.h"

typedef struct Comparison {
    // Of linear light, 0 to 1, alpha aside. A pixel differs by the largest of its three channels.
    double rmse; // over pixels and channels
    double p99;  // 99 % of all pixels differ by this or less
    double max;
    double codes;           // largest difference of an 8-bit code
    double flip, flip_p99;  // of tests/flip.h
    int64_t histogram[256]; // channels by difference of codes
} Comparison;

// A figure by name: what hair-compare prints, and what --max-NAME bounds.
typedef struct CompareFigure {
    const char* name;
    const char* what;
    size_t offset; // of a double in Comparison
} CompareFigure;

#define COMPARE_FIGURES 6
extern const CompareFigure compare_figures[COMPARE_FIGURES];
double compare_figure(const Comparison* comparison, int figure);

// `map` may be NULL; else it takes FLIP of every pixel. False with a fault where FLIP cannot be
// had.
bool compare_images(Comparison* comparison, const Image* a, const Image* b, float pixels_per_degree,
                    float* map, Fault* fault);

// 0 to 1 as black, red, yellow, white. `image` has the map's size.
void compare_heat(Image* image, const float* map);
