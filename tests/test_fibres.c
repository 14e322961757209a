// The pattern of hairs on a ribbon: ranks that make any fill come out right, and that tile.
#include "client/fibres.h"
#include "tests/drawing.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#define TEXELS (FIBRES_SIZE * FIBRES_SIZE)

// Mesa 22.3's OSMesaDestroyContext forgets its default framebuffer (see test_gl.c).
const char* __lsan_default_suppressions(void);
const char* __lsan_default_suppressions(void)
{
    return "leak:libOSMesa.so";
}

static unsigned char ranks[FIBRES_LAYERS][TEXELS], hairs[FIBRES_LAYERS][TEXELS];

static int make_ranks(void** state)
{
    (void)state;
    for (int layer = 0; layer < FIBRES_LAYERS; ++layer)
        if (!fibres_ranks(ranks[layer], hairs[layer], layer)) return 1;
    return 0;
}

static void ranks_are_spread_evenly(void** state)
{
    (void)state;
    for (int layer = 0; layer < FIBRES_LAYERS; ++layer) {
        int count[256] = {0};
        for (int i = 0; i < TEXELS; ++i)
            ++count[ranks[layer][i]];
        for (int r = 0; r < 256; ++r)
            assert_in_range(count[r], TEXELS / 256 - 1, TEXELS / 256 + 1);
    }
}

// As shaders/fibres.glsl decides, for a fragment on a texel's centre.
static void coverage_is_the_fill_asked_for(void** state)
{
    (void)state;
    for (int layer = 0; layer < FIBRES_LAYERS; ++layer)
        for (int step = 0; step <= 1000; ++step) {
            double fill = step / 1000.0;
            int covered = 0;
            for (int i = 0; i < TEXELS; ++i)
                covered += ranks[layer][i] / 255.0 > 1.0 - fill;
            if (fabs((double)covered / TEXELS - fill) > 1.0 / 256.0 + 1e-9)
                fail_msg("fill %g covers %g", fill, (double)covered / TEXELS);
        }
}

// Mean step between texels i and j of every row (or column).
static double mean_step(const unsigned char* layer, int i, int j, bool across)
{
    int64_t sum = 0;
    for (int k = 0; k < FIBRES_SIZE; ++k) {
        int a = across ? k * FIBRES_SIZE + i : i * FIBRES_SIZE + k;
        int b = across ? k * FIBRES_SIZE + j : j * FIBRES_SIZE + k;
        sum += abs(layer[a] - layer[b]);
    }
    return (double)sum / FIBRES_SIZE;
}

static void pattern_tiles_both_ways(void** state)
{
    (void)state;
    for (int layer = 0; layer < FIBRES_LAYERS; ++layer)
        for (int across = 0; across < 2; ++across) {
            double most = 0;
            for (int i = 0; i + 1 < FIBRES_SIZE; ++i)
                most = fmax(most, mean_step(ranks[layer], i, i + 1, across));
            double seam = mean_step(ranks[layer], FIBRES_SIZE - 1, 0, across);
            if (seam > most) fail_msg("seam %g, elsewhere at most %g", seam, most);
        }
}

// Hairs run along: a step along is far smaller than one across.
static void hairs_run_along(void** state)
{
    (void)state;
    for (int layer = 0; layer < FIBRES_LAYERS; ++layer) {
        double along = 0, across = 0;
        for (int i = 0; i + 1 < FIBRES_SIZE; ++i) {
            along += mean_step(ranks[layer], i, i + 1, false);
            across += mean_step(ranks[layer], i, i + 1, true);
        }
        assert_true(across > 2.0 * along);
    }
}

static void layers_differ(void** state)
{
    (void)state;
    for (int a = 0; a < FIBRES_LAYERS; ++a)
        for (int b = a + 1; b < FIBRES_LAYERS; ++b) {
            int same = 0;
            for (int i = 0; i < TEXELS; ++i)
                same += ranks[a][i] == ranks[b][i];
            assert_true(same < TEXELS / 16);
        }
}

// On every level, for the fills that hair has: what is covered is the fill, so hair gets neither
// thinner nor thicker where it is further away.
static void coverage_is_kept_on_every_level(void** state)
{
    (void)state;
    static unsigned char level[2][TEXELS];
    for (int layer = 0; layer < FIBRES_LAYERS; ++layer) {
        memcpy(level[0], ranks[layer], TEXELS);
        for (int l = 1; l < FIBRES_LEVELS; ++l) {
            int texels = fibres_side(l) * fibres_side(l);
            assert_true(fibres_halve(level[l & 1], level[~l & 1], fibres_side(l - 1)));
            for (int step = 1; step < 20; ++step) {
                int covered = 0;
                for (int i = 0; i < texels; ++i)
                    covered += level[l & 1][i] / 255.0 > 1.0 - step / 20.0;
                double off = (double)covered / texels - step / 20.0;
                if (fabs(off) > 0.02)
                    fail_msg("layer %d, level %d: fill %g is off by %g", layer, l, step / 20.0,
                             off);
            }
        }
    }
}

// A hair is a run of texels round the highest of them, and all sixteen are there.
static void every_texel_says_which_hair_it_is_of(void** state)
{
    (void)state;
    for (int layer = 0; layer < FIBRES_LAYERS; ++layer) {
        int count[FIBRES_STRANDS] = {0}, borders = 0;
        for (int i = 0; i < TEXELS; ++i) {
            assert_true(hairs[layer][i] < FIBRES_STRANDS);
            ++count[hairs[layer][i]];
            int next = i % FIBRES_SIZE == FIBRES_SIZE - 1 ? i + 1 - FIBRES_SIZE : i + 1;
            borders += hairs[layer][i] != hairs[layer][next];
        }
        for (int s = 0; s < FIBRES_STRANDS; ++s)
            assert_true(count[s] > 0);
        assert_true(borders < 24 * FIBRES_SIZE); // a row
    }
}

static void texture_holds_the_ranks(void** state)
{
    (void)state;
    static unsigned char held[FIBRES_LAYERS][TEXELS];
    Gl* gl = drawing_open("osmesa");
    if (gl == NULL) gl = drawing_open("egl");
    if (gl == NULL) skip();
    Fault fault = {""};
    GLuint texture = fibres_create(gl, &fault);
    assert_int_not_equal(texture, 0);
    gl->BindTexture(GL_TEXTURE_2D_ARRAY, texture);
    gl->PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl->GetTexImage(GL_TEXTURE_2D_ARRAY, 0, GL_RED, GL_UNSIGNED_BYTE, held);
    assert_true(gl_check(gl, "fibres", &fault));
    assert_memory_equal(held, ranks, sizeof held);
    gl->DeleteTextures(1, &texture);
    gl_close(gl);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ranks_are_spread_evenly),
        cmocka_unit_test(coverage_is_the_fill_asked_for),
        cmocka_unit_test(pattern_tiles_both_ways),
        cmocka_unit_test(hairs_run_along),
        cmocka_unit_test(layers_differ),
        cmocka_unit_test(texture_holds_the_ranks),
        cmocka_unit_test(coverage_is_kept_on_every_level),
        cmocka_unit_test(every_texel_says_which_hair_it_is_of),
    };
    return cmocka_run_group_tests(tests, make_ranks, NULL);
}
