#include "tests/compare.h"

#include "tests/flip.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const CompareFigure compare_figures[COMPARE_FIGURES] = {
    {"rmse", "root mean square difference of linear light", offsetof(Comparison, rmse)},
    {"p99", "99 % of all pixels differ by this or less, linear light", offsetof(Comparison, p99)},
    {"max", "largest difference, linear light", offsetof(Comparison, max)},
    {"codes", "largest difference of 8-bit codes", offsetof(Comparison, codes)},
    {"flip", "mean FLIP", offsetof(Comparison, flip)},
    {"flip-p99", "99 % of all pixels have this FLIP or less", offsetof(Comparison, flip_p99)},
};

double compare_figure(const Comparison* comparison, int figure)
{
    double value;
    memcpy(&value, (const char*)comparison + compare_figures[figure].offset, sizeof value);
    return value;
}

static int ascending(const void* a, const void* b)
{
    float x = *(const float*)a, y = *(const float*)b;
    return (x > y) - (x < y);
}

// The least value that 99 % of all do not pass; puts them in order.
static double percentile_99(float* values, size_t count)
{
    qsort(values, count, sizeof *values, ascending);
    return (double)values[(count * 99 + 99) / 100 - 1];
}

// Fills in the figures of linear light and of codes. `each`: room for a value per pixel.
static void compare_light(Comparison* c, const Image* a, const Image* b, float* each)
{
    double linear[256], squares = 0;
    for (int i = 0; i < 256; ++i)
        linear[i] = image_linear((uint8_t)i);
    size_t count = (size_t)a->width * (size_t)a->height;
    for (size_t i = 0; i < count; ++i) {
        double most = 0;
        for (size_t k = 4 * i; k < 4 * i + 3; ++k) {
            double d = fabs(linear[a->rgba[k]] - linear[b->rgba[k]]);
            squares += d * d;
            most = fmax(most, d);
            ++c->histogram[abs(a->rgba[k] - b->rgba[k])];
        }
        each[i] = (float)most;
        c->max = fmax(c->max, most);
    }
    c->rmse = sqrt(squares / (3.0 * (double)count));
    c->p99 = percentile_99(each, count);
    for (int i = 0; i < 256; ++i)
        if (c->histogram[i] > 0) c->codes = i;
}

bool compare_images(Comparison* comparison, const Image* a, const Image* b, float pixels_per_degree,
                    float* map, Fault* fault)
{
    size_t count = (size_t)a->width * (size_t)a->height;
    *comparison = (Comparison){0};
    float* each = malloc(count * sizeof *each);
    if (each == NULL) return fault_set(fault, "no memory to compare %zu pixels", count);
    bool compared = flip_map(each, a, b, pixels_per_degree, fault);
    if (compared) {
        if (map != NULL) memcpy(map, each, count * sizeof *map);
        for (size_t i = 0; i < count; ++i)
            comparison->flip += (double)each[i];
        comparison->flip /= (double)count;
        comparison->flip_p99 = percentile_99(each, count);
        compare_light(comparison, a, b, each);
    }
    free(each);
    return compared;
}

void compare_heat(Image* image, const float* map)
{
    for (int i = 0; i < image->width * image->height; ++i)
        for (int k = 0; k < 4; ++k) {
            float heat = 3.0f * map[i] - (float)k;
            heat = heat < 0.0f ? 0.0f : heat > 1.0f ? 1.0f : heat;
            image->rgba[4 * i + k] = k == 3 ? 255 : (uint8_t)(255.0f * heat + 0.5f);
        }
}
