#include "client/fibres.h"

#include "messages/random.h"
#include "messages/trig.h"

#include <stdlib.h>
#include <string.h>

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

// How the hairs of a layer lie, in spacings of hairs.
typedef struct Pattern {
    double slow, fast; // how far they wander along the layer
    double gather;     // how closely four of them keep together
    double uneven;     // how much they differ in width
} Pattern;

static const Pattern patterns[FIBRES_LAYERS] = {
    {0.35, 0.10, 0.0, 0.6},
    {0.55, 0.25, 0.0, 0.8},
    {0.50, 0.15, 0.55, 0.8},
    {1.10, 0.35, 0.15, 1.1},
};

static float random_of(uint32_t seed, int s, uint32_t draw)
{
    return random_unit(seed, (uint32_t)s * 4u + draw);
}

// Where hair `s` lies across the layer at `v` (0..1); it wanders, and tiles.
static double centre(const Pattern* pattern, uint32_t seed, int s, double v)
{
    double a = (double)random_of(seed, s, 0) - 0.5;
    double phase = 6.283185307 * (double)random_of(seed, s, 1);
    double b = pattern->slow * trig_sin(6.283185307 * v + phase);
    double c = pattern->fast * trig_sin(6.283185307 * 3.0 * v + 2.0 * phase);
    double from_middle = 1.5 - s % 4;
    double gathered = pattern->gather * (0.7 + 0.3 * trig_sin(6.283185307 * v + s / 4));
    return s + 0.5 + a + b + c + gathered * from_middle;
}

// How high the nearest hair stands at u of a row with these centres (1 on its axis, falling to the
// sides), and which it is.
static float height(const Pattern* pattern, uint32_t seed, double u, const double* centres,
                    unsigned char* hair)
{
    double x = u * FIBRES_STRANDS, best = -1e9;
    for (int s = 0; s < FIBRES_STRANDS; ++s) {
        double d = x - centres[s];
        d -= FIBRES_STRANDS * floor(d / FIBRES_STRANDS + 0.5);
        double weight = 1.0 + pattern->uneven * ((double)random_of(seed, s, 2) - 0.5);
        double h = 1.0 - fabs(d) / weight;
        if (h <= best) continue;
        best = h;
        *hair = (unsigned char)s;
    }
    return (float)best;
}

static void rank(unsigned char* ranks, Ranked* order, int count)
{
    qsort(order, (size_t)count, sizeof *order, by_height);
    for (int i = 0; i < count; ++i)
        ranks[order[i].at] = (unsigned char)((int64_t)i * 256 / count);
}

int fibres_side(int level)
{
    return FIBRES_SIZE >> level;
}

bool fibres_ranks(unsigned char* ranks, unsigned char* hairs, int layer)
{
    int count = FIBRES_SIZE * FIBRES_SIZE;
    Ranked* order = malloc((size_t)count * sizeof *order);
    if (order == NULL) return false;
    const Pattern* pattern = &patterns[layer];
    uint32_t seed = 0xF1B0u + (uint32_t)layer;
    for (int row = 0; row < FIBRES_SIZE; ++row) {
        double centres[FIBRES_STRANDS];
        for (int s = 0; s < FIBRES_STRANDS; ++s)
            centres[s] = centre(pattern, seed, s, (double)row / FIBRES_SIZE);
        for (int column = 0; column < FIBRES_SIZE; ++column) {
            int i = row * FIBRES_SIZE + column;
            double u = (column + 0.5) / FIBRES_SIZE;
            order[i] = (Ranked){height(pattern, seed, u, centres, &hairs[i]), i};
        }
    }
    rank(ranks, order, count);
    free(order);
    return true;
}

bool fibres_halve(unsigned char* ranks, const unsigned char* above, int side)
{
    int half = side / 2, count = half * half;
    Ranked* order = malloc((size_t)count * sizeof *order);
    if (order == NULL) return false;
    for (int row = 0; row < half; ++row)
        for (int column = 0; column < half; ++column) {
            const unsigned char* from = above + 2 * row * side + 2 * column;
            int sum = from[0] + from[1] + from[side] + from[side + 1];
            order[row * half + column] = (Ranked){(float)sum, row * half + column};
        }
    rank(ranks, order, count);
    free(order);
    return true;
}

// One layer of one level, interleaved. Which hair it is is read at the first level alone.
static void put_layer(const Gl* gl, int level, int layer, const unsigned char* ranks,
                      const unsigned char* hairs, unsigned char* texels)
{
    int side = fibres_side(level);
    for (int i = 0; i < side * side; ++i) {
        texels[2 * i] = ranks[i];
        texels[2 * i + 1] = level == 0 ? (unsigned char)(hairs[i] * (256 / FIBRES_STRANDS)) : 0;
    }
    gl->TexSubImage3D(GL_TEXTURE_2D_ARRAY, level, 0, 0, layer, side, side, 1, GL_RG,
                      GL_UNSIGNED_BYTE, texels);
}

static GLuint create_texture(const Gl* gl)
{
    GLuint texture = 0;
    gl->GenTextures(1, &texture);
    gl->BindTexture(GL_TEXTURE_2D_ARRAY, texture);
    gl->PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    for (int level = 0; level < FIBRES_LEVELS; ++level)
        gl->TexImage3D(GL_TEXTURE_2D_ARRAY, level, GL_RG8, fibres_side(level), fibres_side(level),
                       FIBRES_LAYERS, 0, GL_RG, GL_UNSIGNED_BYTE, NULL);
    // Levels are not mixed: the mean of two ranks is no rank.
    gl->TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_NEAREST);
    gl->TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl->TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAX_LEVEL, FIBRES_LEVELS - 1);
    gl->TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_S, GL_REPEAT);
    gl->TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_T, GL_REPEAT);
    return texture;
}

GLuint fibres_create(const Gl* gl, Fault* fault)
{
    size_t texels = (size_t)FIBRES_SIZE * FIBRES_SIZE;
    unsigned char* memory = malloc(5 * texels);
    unsigned char *hairs = memory + texels, *next = memory + 2 * texels;
    bool made = memory != NULL;
    GLuint texture = made ? create_texture(gl) : 0;
    for (int layer = 0; made && layer < FIBRES_LAYERS; ++layer) {
        made = fibres_ranks(memory, hairs, layer);
        for (int level = 0; made && level < FIBRES_LEVELS; ++level) {
            put_layer(gl, level, layer, memory, hairs, memory + 3 * texels);
            if (level + 1 == FIBRES_LEVELS) break;
            made = fibres_halve(next, memory, fibres_side(level));
            memcpy(memory, next, texels / 4);
        }
    }
    free(memory);
    if (made) return texture;
    if (texture != 0) gl->DeleteTextures(1, &texture);
    fault_set(fault, "no memory for the fibre texture");
    return 0;
}
