// Promises of server/groom.h: both styles are hair on a head, not wires through it.
#include "server/groom.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on
#include "messages/mannequin.h"
#include "messages/random.h"

#include <string.h>
#include <xxhash.h>

typedef struct Case {
    Hairstyle* (*make)(Fault* fault);
    const char* name;
    float shortest_m, longest_m; // of its guides
    float hem_low_m, hem_high_m; // where its tips may end
    float parted_m;              // how far node 2 of the first guides combs away from the parting
    float mixed_m;               // least height of mixes; short links leave a chord in the skull
    uint64_t hash;
} Case;

static Case cases[] = {
    {groom_long, "long", 0.20f, 0.44f, -0.10f, 0.02f, 0.03f, 0.001f, 0xaf48207156b676cull},
    {groom_bob, "bob", 0.04f, 0.33f, 0.085f, 0.125f, 0.03f, 0.001f, 0x5dc364441b069147ull},
    {groom_curly, "curly", 0.09f, 0.37f, 0.03f, 0.085f, 0.03f, 0.001f, 0x6399dd3bacff48c8ull},
    {groom_short, "short", 0.05f, 0.09f, 0.08f, 0.34f, 0.015f, -0.001f, 0xc69395a15e0d38bull},
};
#define CASES ((int)(sizeof cases / sizeof cases[0]))

static Hairstyle* styles[CASES];

static int make_styles(void** state)
{
    (void)state;
    for (int c = 0; c < CASES; ++c) {
        Fault fault = {0};
        styles[c] = cases[c].make(&fault);
        if (!styles[c]) return -1;
    }
    return 0;
}

static int free_styles(void** state)
{
    (void)state;
    for (int c = 0; c < CASES; ++c)
        hairstyle_destroy(styles[c]);
    return 0;
}

static Vec3 node(const Hairstyle* style, int guide, int index)
{
    return style->rest[guide * style->nodes + index];
}

static void groom_styles_are_valid_and_complete(void** state)
{
    (void)state;
    for (int c = 0; c < CASES; ++c) {
        const Hairstyle* s = styles[c];
        Fault fault = {0};
        assert_true(hairstyle_validate(s, &fault));
        assert_string_equal(s->name, cases[c].name);
        assert_int_equal(s->guide_count, 64);
        assert_int_equal(s->nodes, 8);
        assert_int_equal(s->set_count, 1);
        assert_int_equal(s->sets[0].kind, STRANDS_GROWN);
        assert_int_equal(s->sets[0].guide_count, s->guide_count);
        assert_int_equal(s->sets[0].triangle_count, s->triangle_count);
        assert_true(s->sets[0].strand_count > 1000);
        assert_int_equal(s->head_kind, HEAD_MANNEQUIN);
        assert_true(s->head_centre.y == MANNEQUIN_CENTRE.y);
        assert_true(s->collider_count >= 6);
    }
}

static void groom_weights_rise_from_skin_to_physics(void** state)
{
    (void)state;
    for (int c = 0; c < CASES; ++c)
        for (int g = 0; g < styles[c]->guide_count; ++g) {
            const uint8_t* weight = styles[c]->weight + g * styles[c]->nodes;
            assert_int_equal(weight[0], 0);
            assert_true(weight[1] > 0 && weight[1] < 128);
            for (int k = 2; k < styles[c]->nodes; ++k)
                assert_int_equal(weight[k], 255);
        }
}

static void groom_roots_sit_on_the_scalp(void** state)
{
    (void)state;
    for (int c = 0; c < CASES; ++c)
        for (int g = 0; g < styles[c]->guide_count; ++g) {
            Vec3 root = node(styles[c], g, 0);
            assert_true(fabsf(mannequin_distance(root)) < 0.0002f);
            assert_true(mannequin_scalp(root) > 0.2f);
        }
}

static void groom_guides_stay_outside_the_head(void** state)
{
    (void)state;
    for (int c = 0; c < CASES; ++c)
        for (int g = 0; g < styles[c]->guide_count; ++g)
            for (int k = 1; k < styles[c]->nodes; ++k) {
                Vec3 a = node(styles[c], g, k - 1), b = node(styles[c], g, k);
                assert_true(mannequin_distance(b) > 0.002f);
                for (int q = 1; q < 4; ++q)
                    assert_true(mannequin_distance(vec3_lerp(a, b, 0.25f * (float)q)) > 0.0f);
            }
}

static void groom_guides_have_their_styles_length_and_hem(void** state)
{
    (void)state;
    for (int c = 0; c < CASES; ++c)
        for (int g = 0; g < styles[c]->guide_count; ++g) {
            float length = hairstyle_guide_length(styles[c], g);
            Vec3 tip = node(styles[c], g, styles[c]->nodes - 1);
            assert_true(length > cases[c].shortest_m && length < cases[c].longest_m);
            assert_true(tip.y > cases[c].hem_low_m && tip.y < cases[c].hem_high_m);
        }
}

static void groom_segments_are_even(void** state)
{
    (void)state;
    for (int c = 0; c < CASES; ++c)
        for (int g = 0; g < styles[c]->guide_count; ++g) {
            float even = hairstyle_guide_length(styles[c], g) / (float)(styles[c]->nodes - 1);
            for (int k = 1; k < styles[c]->nodes; ++k) {
                Vec3 d = vec3_sub(node(styles[c], g, k), node(styles[c], g, k - 1));
                float length = vec3_length(d);
                assert_true(length > 0.6f * even && length < 1.4f * even);
            }
        }
}

// Eyes, nose, mouth and chin: nothing hangs over them.
static void groom_keeps_the_face_free(void** state)
{
    (void)state;
    for (int c = 0; c < CASES; ++c)
        for (int g = 0; g < styles[c]->guide_count; ++g)
            for (int k = 1; k < styles[c]->nodes; ++k)
                for (int q = 0; q < 4; ++q) {
                    Vec3 a = node(styles[c], g, k - 1), b = node(styles[c], g, k);
                    Vec3 p = vec3_lerp(a, b, 0.25f * (float)q);
                    assert_false(fabsf(p.x) < 0.050f && p.y < 0.228f && p.z > 0.02f);
                }
}

// Wisps are barycentric mixes: a patch of scalp whose guides part company grows rubbish.
static void groom_neighbours_are_coherent(void** state)
{
    (void)state;
    for (int c = 0; c < CASES; ++c)
        for (int t = 0; t < styles[c]->triangle_count; ++t)
            for (int e = 0; e < 3; ++e) {
                int a = styles[c]->triangles[t].guide[e];
                int b = styles[c]->triangles[t].guide[(e + 1) % 3];
                for (int k = 0; k < styles[c]->nodes; ++k) {
                    Vec3 apart = vec3_sub(node(styles[c], a, k), node(styles[c], b, k));
                    assert_true(vec3_length(apart) < 0.100f);
                }
            }
}

static void groom_mixed_strands_stay_outside_the_head(void** state)
{
    (void)state;
    for (int c = 0; c < CASES; ++c)
        for (uint32_t i = 0; i < 4000; ++i) {
            const Hairstyle* s = styles[c];
            const ScalpTriangle* t = &s->triangles[i % (uint32_t)s->triangle_count];
            float u = random_unit(1, i), v = random_unit(2, i) * (1.0f - u);
            for (int k = 1; k < s->nodes; ++k) {
                Vec3 p = vec3_scale(node(s, t->guide[0], k), 1.0f - u - v);
                p = vec3_mad(p, node(s, t->guide[1], k), u);
                p = vec3_mad(p, node(s, t->guide[2], k), v);
                // The rims of the ears poke 4 mm into the mix at worst, under hair.
                bool ear = fabsf(p.x) > 0.075f && p.y < 0.235f;
                assert_true(mannequin_distance(p) > (ear ? -0.004f : cases[c].mixed_m));
            }
        }
}

static bool covered(const Hairstyle* style, Vec3 direction)
{
    for (int t = 0; t < style->triangle_count; ++t) {
        Vec3 corner[3];
        for (int i = 0; i < 3; ++i)
            corner[i] =
                vec3_sub(node(style, style->triangles[t].guide[i], 0), vec3(0, 0.22f, -0.015f));
        int inside = 0;
        for (int i = 0; i < 3; ++i)
            inside += vec3_dot(vec3_cross(corner[i], corner[(i + 1) % 3]), direction) > 0.0f;
        if (inside == 3) return true;
    }
    return false;
}

static void groom_grows_nothing_on_bare_skin(void** state)
{
    (void)state;
    for (int c = 0; c < CASES; ++c)
        for (int t = 0; t < styles[c]->triangle_count; ++t) {
            Vec3 middle = {0, 0, 0};
            for (int i = 0; i < 3; ++i)
                middle = vec3_mad(middle, node(styles[c], styles[c]->triangles[t].guide[i], 0),
                                  1.0f / 3.0f);
            assert_true(mannequin_scalp(mannequin_project(middle, 0.0f)) > 0.2f);
        }
}

// Triangles face outwards and tile the scalp: only the parting and a hem thinner than a wisp are
// bare.
static void groom_triangles_cover_the_scalp(void** state)
{
    (void)state;
    for (int c = 0; c < CASES; ++c) {
        int scalp = 0, bare = 0;
        for (uint32_t i = 0; i < 3000; ++i) {
            Vec3 d = {random_signed(3, 3 * i), random_signed(3, 3 * i + 1),
                      random_signed(3, 3 * i + 2)};
            d = vec3_normalise_or(d, vec3(0, 1, 0));
            Vec3 p = vec3_mad(vec3(0, 0.22f, -0.015f), d, 0.2f);
            for (int k = 0; k < 40; ++k)
                p = vec3_mad(p, d, -0.8f * mannequin_distance(p));
            if (mannequin_scalp(p) < 0.95f) continue;
            ++scalp;
            bare += !covered(styles[c], d);
        }
        assert_true(scalp > 500);
        assert_true(bare * 20 < scalp); // under 5 %
    }
}

// No patch of scalp reaches over the parting: at its front, roots within 5 mm of each other comb
// to opposite sides and share no triangle.
static void groom_parting_divides_the_hair(void** state)
{
    (void)state;
    for (int c = 0; c < CASES; ++c) {
        Vec3 left = node(styles[c], 0, 0), right = node(styles[c], 1, 0);
        assert_true(vec3_length(vec3_sub(left, right)) < 0.007f);
        assert_true(node(styles[c], 0, 2).x > left.x + cases[c].parted_m);
        assert_true(node(styles[c], 1, 2).x < right.x - cases[c].parted_m);
        for (int t = 0; t < styles[c]->triangle_count; ++t) {
            bool has[2] = {false, false};
            for (int i = 0; i < 3; ++i)
                if (styles[c]->triangles[t].guide[i] < 10) // five pairs: even left, odd right
                    has[styles[c]->triangles[t].guide[i] % 2] = true;
            assert_false(has[0] && has[1]);
        }
    }
}

// Changes only when the style does; holds over compilers and -O levels.
static void groom_is_the_same_bits_everywhere(void** state)
{
    (void)state;
    for (int c = 0; c < CASES; ++c) {
        const Hairstyle* s = styles[c];
        size_t nodes = (size_t)s->guide_count * (size_t)s->nodes;
        XXH64_hash_t hash =
            XXH64(s->rest, nodes * sizeof *s->rest, 0) ^
            XXH64(s->triangles, (size_t)s->triangle_count * sizeof *s->triangles, 1);
        assert_int_equal(hash, cases[c].hash);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(groom_styles_are_valid_and_complete),
        cmocka_unit_test(groom_weights_rise_from_skin_to_physics),
        cmocka_unit_test(groom_roots_sit_on_the_scalp),
        cmocka_unit_test(groom_guides_stay_outside_the_head),
        cmocka_unit_test(groom_guides_have_their_styles_length_and_hem),
        cmocka_unit_test(groom_segments_are_even),
        cmocka_unit_test(groom_keeps_the_face_free),
        cmocka_unit_test(groom_neighbours_are_coherent),
        cmocka_unit_test(groom_mixed_strands_stay_outside_the_head),
        cmocka_unit_test(groom_grows_nothing_on_bare_skin),
        cmocka_unit_test(groom_triangles_cover_the_scalp),
        cmocka_unit_test(groom_parting_divides_the_hair),
        cmocka_unit_test(groom_is_the_same_bits_everywhere),
    };
    return cmocka_run_group_tests(tests, make_styles, free_styles);
}
