#include "client/fibres.h"

#include "messages/random.h"
#include "messages/trig.h"

#include <stdlib.h>

typedef struct Ranked {
    float height;
    int at;
} Ranked;

static int by_height(const void* a, const void* b)
{
    const Ranked *x = a, *y = b;
    if (x->height != y->height) return x->height < y->height ? -1 : 1;
    return x->at - y->at; // a total order: the same texture from every qsort
}

// Where strand `s` lies across the layer at `v` (0..1), in strand spacings; it wanders, and tiles.
static double centre(uint32_t seed, int s, double v)
{
    double a = (double)random_signed(seed, (uint32_t)s * 4u) * 0.5;
    double phase = 6.283185307 * (double)random_unit(seed, (uint32_t)s * 4u + 1u);
    double b = 0.55 * trig_sin(6.283185307 * v + phase);
    double c = 0.25 * trig_sin(6.283185307 * 3.0 * v + 2.0 * phase);
    return s + 0.5 + a + b + c;
}

// How high the nearest strand stands at u of a row with these centres: 1 on its axis, falling to
// the sides.
static float height(uint32_t seed, double u, const double* centres)
{
    double x = u * FIBRES_STRANDS, best = -1e9;
    for (int s = 0; s < FIBRES_STRANDS; ++s) {
        double d = x - centres[s];
        d -= FIBRES_STRANDS * floor(d / FIBRES_STRANDS + 0.5);
        double weight = 0.6 + 0.8 * (double)random_unit(seed, (uint32_t)s * 4u + 2u);
        double h = 1.0 - fabs(d) / weight;
        if (h > best) best = h;
    }
    return (float)best;
}

// Ranks of `count` heights, spread evenly over a byte.
static void rank(unsigned char* ranks, Ranked* order, int count)
{
    qsort(order, (size_t)count, sizeof *order, by_height);
    for (int i = 0; i < count; ++i)
        ranks[order[i].at] = (unsigned char)((int64_t)(2 * i + 1) * 256 / (2 * count));
}

bool fibres_ranks(unsigned char* ranks, int layer)
{
    int count = FIBRES_SIZE * FIBRES_SIZE;
    Ranked* order = malloc((size_t)count * sizeof *order);
    if (order == NULL) return false;
    uint32_t seed = 0xF1B0u + (uint32_t)layer;
    for (int row = 0; row < FIBRES_SIZE; ++row) {
        double centres[FIBRES_STRANDS];
        for (int s = 0; s < FIBRES_STRANDS; ++s)
            centres[s] = centre(seed, s, (double)row / FIBRES_SIZE);
        for (int column = 0; column < FIBRES_SIZE; ++column) {
            int i = row * FIBRES_SIZE + column;
            order[i] = (Ranked){height(seed, (column + 0.5) / FIBRES_SIZE, centres), i};
        }
    }
    rank(ranks, order, count);
    free(order);
    return true;
}

bool fibres_halve(unsigned char* half, const unsigned char* ranks, int size)
{
    int side = size / 2;
    Ranked* order = malloc((size_t)(side * side) * sizeof *order);
    if (order == NULL) return false;
    for (int i = 0; i < side * side; ++i) {
        const unsigned char* at = ranks + 2 * (i / side) * size + 2 * (i % side);
        order[i] = (Ranked){(float)(at[0] + at[1] + at[size] + at[size + 1]), i};
    }
    rank(half, order, side * side);
    free(order);
    return true;
}

// Level by level, as `ranks` is halved in place.
static bool upload_levels(const Gl* gl, unsigned char* ranks)
{
    gl->PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    for (int level = 0, size = FIBRES_SIZE; level < FIBRES_LEVELS; ++level, size /= 2) {
        gl->TexImage3D(GL_TEXTURE_2D_ARRAY, level, GL_R8, size, size, FIBRES_LAYERS, 0, GL_RED,
                       GL_UNSIGNED_BYTE, ranks);
        for (int layer = 0; layer < FIBRES_LAYERS; ++layer) {
            // In place: what is written lies before all that is still to be read.
            unsigned char* to = ranks + layer * (size / 2) * (size / 2);
            if (!fibres_halve(to, ranks + layer * size * size, size)) return false;
        }
    }
    return true;
}

GLuint fibres_create(const Gl* gl, Fault* fault)
{
    size_t layer_bytes = (size_t)FIBRES_SIZE * FIBRES_SIZE;
    unsigned char* ranks = malloc(layer_bytes * FIBRES_LAYERS);
    bool made = ranks != NULL;
    for (int layer = 0; made && layer < FIBRES_LAYERS; ++layer)
        made = fibres_ranks(ranks + layer_bytes * (size_t)layer, layer);
    GLuint texture = 0;
    if (made) {
        gl->GenTextures(1, &texture);
        gl->BindTexture(GL_TEXTURE_2D_ARRAY, texture);
        made = upload_levels(gl, ranks);
        gl->TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAX_LEVEL, FIBRES_LEVELS - 1);
        gl->TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
        gl->TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
        gl->TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_S, GL_REPEAT);
        gl->TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_T, GL_REPEAT);
    }
    free(ranks);
    if (made) return texture;
    gl->DeleteTextures(1, &texture);
    fault_set(fault, "no memory for the fibre texture");
    return 0;
}
