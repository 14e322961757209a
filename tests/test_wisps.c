// What wisps follow besides their guides (thesis 5.4, Koster 2004): where they stand, maps over the
// scalp, widths, curls, magnets. On one square of straight guides, where all of it can be told.
#include "client/fibres.h"
#include "client/ribbons.h"
#include "client/scatter.h"
#include "server/groom.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define NODES   9
#define SIDE_M  0.10f
#define LONG_M  0.24f
#define POINTS  40
#define WISPS   200
#define WIDTH_M 0.004f

// Guides 0 and 1 at x = 0, 2 and 3 at x = SIDE_M; two triangles.
static Hairstyle* square(void)
{
    Fault fault = {""};
    Hairstyle* style = hairstyle_create();
    assert_true(hairstyle_set_guides(style, 4, NODES, &fault));
    for (int g = 0; g < 4; ++g)
        for (int n = 0; n < NODES; ++n)
            style->rest[g * NODES + n] =
                vec3(g < 2 ? 0 : SIDE_M, -LONG_M * (float)n / (NODES - 1), g % 2 ? SIDE_M : 0);
    style->triangles = calloc(2, sizeof *style->triangles);
    style->triangles[0] = (ScalpTriangle){{0, 1, 2}};
    style->triangles[1] = (ScalpTriangle){{2, 1, 3}};
    style->triangle_count = 2;
    style->set_count = 1;
    style->sets[0] = (StrandSet){.name = "square",
                                 .kind = STRANDS_GROWN,
                                 .guide_count = 4,
                                 .triangle_count = 2,
                                 .strand_count = WISPS,
                                 .points = POINTS,
                                 .root_width_m = WIDTH_M,
                                 .tip_width_m = WIDTH_M,
                                 .fibres = 9};
    assert_true(hairstyle_add_maps(style, &fault));
    hairstyle_fit_box(style);
    return style;
}

static Ribbons must_build(const Hairstyle* style)
{
    Fault fault = {""};
    Ribbons ribbons;
    if (!hairstyle_validate(style, &fault) || !ribbons_build(&ribbons, style, &fault))
        fail_msg("%s", fault.text);
    return ribbons;
}

static Vec3 place(const Ribbons* ribbons, const Hairstyle* style, int i)
{
    Vec3* tangents = hairstyle_rest_tangents(style);
    DrawnPoint point = ribbons_point(ribbons, i);
    Vec3d at = drawn_position(&point, style->nodes, style->rest, tangents, tangents, NULL);
    free(tangents);
    return vec3_from(at);
}

static bool is_root(const Ribbons* ribbons, int i)
{
    return i == 0 || ribbons->tangents[i][3] < ribbons->tangents[i - 1][3];
}

// Wisps inside: those at the scalp's end are thinner and shorter, which is another test's matter.
static int inside_points(const Hairstyle* style)
{
    return (style->sets[0].strand_count - (int)(0.26f * (float)style->sets[0].strand_count)) *
           style->sets[0].points;
}

// A wisp's root as long as its ribbon: rows of `points`.
static Vec3 tip(const Ribbons* ribbons, const Hairstyle* style, int wisp)
{
    return place(ribbons, style, wisp * style->sets[0].points + style->sets[0].points - 1);
}

static void set_map(Hairstyle* style, ScalpMap map, uint8_t low_x, uint8_t high_x)
{
    for (int g = 0; g < 4; ++g)
        style->maps[g * MAP_COUNT + map] = g < 2 ? low_x : high_x;
}

// Distances to the nearest root, in spacings of the hexagonal lattice, which is the widest. Of
// chance the mean is 0.5 / 1.0746 = 0.465 (Clark and Evans 1954).
static void roots_keep_away_from_each_other(void** state)
{
    (void)state;
    enum { COUNT = 1500 };
    static ScatterRoot roots[COUNT];
    static Vec3 at[COUNT];
    Hairstyle* style = square();
    assert_int_equal(scatter_roots(roots, COUNT, style, &style->sets[0], SCATTER_ACROSS), COUNT);
    for (int i = 0; i < COUNT; ++i) {
        const uint16_t* guide = style->triangles[roots[i].triangle].guide;
        at[i] = vec3_scale(style->rest[guide[0] * NODES], roots[i].weight.x);
        at[i] = vec3_mad(at[i], style->rest[guide[1] * NODES], roots[i].weight.y);
        at[i] = vec3_mad(at[i], style->rest[guide[2] * NODES], roots[i].weight.z);
    }
    double widest = 1.0746 * (double)SIDE_M / sqrt((double)COUNT), sum = 0, least = 1;
    for (int i = 0; i < COUNT; ++i) {
        double nearest = 1;
        for (int k = 0; k < COUNT; ++k)
            if (k != i) nearest = fmin(nearest, (double)vec3_length(vec3_sub(at[i], at[k])));
        sum += nearest / widest / COUNT;
        least = fmin(least, nearest / widest);
    }
    printf("nearest root: mean %.3f, least %.3f of the widest spacing; chance 0.465\n", sum, least);
    assert_true(sum > 0.72);
    assert_true(least > 0.4);
    hairstyle_destroy(style);
}

// Twice as dense on one side: of a density that rises as a line from 1/3 to 1, the denser half of
// the square holds 5/8.
static void roots_follow_the_density_map(void** state)
{
    (void)state;
    enum { COUNT = 2000 };
    static ScatterRoot roots[COUNT];
    Hairstyle* style = square();
    set_map(style, MAP_DENSITY, 40, 120);
    int found = scatter_roots(roots, COUNT, style, &style->sets[0], SCATTER_ACROSS), dense = 0;
    for (int i = 0; i < found; ++i) {
        const uint16_t* guide = style->triangles[roots[i].triangle].guide;
        const float of[3] = {roots[i].weight.x, roots[i].weight.y, roots[i].weight.z};
        float x = 0;
        for (int k = 0; k < 3; ++k)
            x += of[k] * style->rest[guide[k] * NODES].x;
        dense += x > 0.5f * SIDE_M;
    }
    printf("%.3f of the roots on the denser half: 0.625\n", (double)dense / found);
    assert_int_equal(found, COUNT);
    assert_true(fabs((double)dense / found - 0.625) < 0.02);
    hairstyle_destroy(style);
}

static void wisps_are_as_long_as_the_length_map_says(void** state)
{
    (void)state;
    Hairstyle* style = square();
    set_map(style, MAP_LENGTH, 64, 64);
    Ribbons ribbons = must_build(style);
    for (int w = 0; w < inside_points(style) / POINTS; ++w) {
        float y = tip(&ribbons, style, w).y;
        assert_true(y >= -0.5f * LONG_M - 1e-5f && y <= -0.43f * LONG_M + 1e-5f);
    }
    ribbons_free(&ribbons);
    hairstyle_destroy(style);
}

// In the middle of the square, away from the scalp's end.
static float half_width(const Ribbons* ribbons, const Hairstyle* style, float along)
{
    for (int w = 0; w < inside_points(style) / POINTS; ++w) {
        Vec3 root = place(ribbons, style, w * POINTS);
        if (fabsf(root.x - 0.4f * SIDE_M) > 0.02f || fabsf(root.z - 0.4f * SIDE_M) > 0.02f)
            continue;
        int k = 0;
        while (k < POINTS - 1 && ribbons->tangents[w * POINTS + k][3] < along)
            ++k;
        return ribbons->weights[w * POINTS + k][3];
    }
    fail_msg("no wisp in the middle");
    return 0;
}

// 4 a (1 - a) of a belly, a^3 of a taper; past the first eighth, where a lock leaves the skin.
static void widths_follow_the_profile_and_the_map(void** state)
{
    (void)state;
    Hairstyle* style = square();
    style->forms[0] = (WispForm){.belly = 0.5f, .taper = 0.6f};
    set_map(style, MAP_WIDTH, 192, 192);
    Ribbons ribbons = must_build(style);
    double full = 0.5 * 1.5 * (double)WIDTH_M;
    double middle = (double)half_width(&ribbons, style, 0.5f);
    double end = (double)half_width(&ribbons, style, 1.0f);
    assert_true(fabs(end / full - 0.4) < 1e-4);
    assert_true(fabs(middle / full - 1.5 * (1.0 - 0.6 / 8)) < 0.03); // a point near the half
    ribbons_free(&ribbons);
    hairstyle_destroy(style);
}

// On a cylinder round where the wisp would be: its radius 0.7 to 1.3 of the form's, by lock, and
// 0.8 to 1.2 of its turns.
static void curls_wind_on_a_cylinder(void** state)
{
    (void)state;
    const float radius = 0.012f, turns = 4.0f;
    Hairstyle* style = square();
    Ribbons straight = must_build(style);
    style->forms[0] = (WispForm){.curl_radius_m = radius, .curl_turns = turns};
    Ribbons curled = must_build(style);
    for (int w = 0; w < inside_points(style) / POINTS; ++w) {
        double wound = 0, before = 0;
        for (int k = POINTS / 2; k < POINTS; ++k) { // open by then
            DrawnPoint a = ribbons_point(&straight, w * POINTS + k);
            DrawnPoint b = ribbons_point(&curled, w * POINTS + k);
            Vec3 root = vec3_sub(b.offset, a.offset);
            // Points of a straight wisp lie elsewhere along it: off the axis is across it.
            double r = sqrt((double)(root.x * root.x + root.z * root.z));
            assert_true(r > 0.69 * (double)radius && r < 1.31 * (double)radius);
            double angle = atan2((double)root.z, (double)root.x);
            if (k > POINTS / 2) {
                double step = angle - before;
                step -= 2 * M_PI * floor(step / (2 * M_PI) + 0.5);
                wound += step / (2 * M_PI);
            }
            before = angle;
        }
        double part = (POINTS - 1 - POINTS / 2) / (POINTS - 1.0);
        assert_true(fabs(wound) > 0.79 * (double)turns * part);
        assert_true(fabs(wound) < 1.21 * (double)turns * part);
    }
    ribbons_free(&straight);
    ribbons_free(&curled);
    hairstyle_destroy(style);
}

static double offset_at(const Hairstyle* style, double along)
{
    Ribbons ribbons = must_build(style);
    double sum = 0;
    for (int w = 0; w < inside_points(style) / POINTS; ++w) {
        DrawnPoint point = ribbons_point(&ribbons, w * POINTS + (int)(along * (POINTS - 1)));
        sum += (double)vec3_length(point.offset);
    }
    ribbons_free(&ribbons);
    return sum / (inside_points(style) / POINTS);
}

static void stiff_hair_curls_further_from_its_root(void** state)
{
    (void)state;
    Hairstyle* style = square();
    style->forms[0] = (WispForm){.curl_radius_m = 0.01f, .curl_turns = 3};
    double soft = offset_at(style, 0.4);
    style->forms[0].curl_stiffness = 0.8f;
    double stiff = offset_at(style, 0.4), end = offset_at(style, 1.0);
    assert_true(soft > 0.007);
    assert_true(stiff < 0.0005); // nothing before 0.48
    assert_true(end > 0.007);
    hairstyle_destroy(style);
}

// Wisps of one lock begin their curls alike; rotation turns each by up to so much, the map scales
// it.
static double phase_spread(const Hairstyle* style)
{
    Ribbons ribbons = must_build(style);
    double most = 0;
    for (int w = 0; w < inside_points(style) / POINTS; ++w) {
        double nearest = 1e9, spread = 0;
        Vec3 a = ribbons_point(&ribbons, w * POINTS + POINTS - 1).offset;
        Vec3 root = place(&ribbons, style, w * POINTS);
        for (int v = 0; v < inside_points(style) / POINTS; ++v) {
            double apart = (double)vec3_length(vec3_sub(place(&ribbons, style, v * POINTS), root));
            if (v == w || apart > nearest) continue;
            nearest = apart;
            Vec3 b = ribbons_point(&ribbons, v * POINTS + POINTS - 1).offset;
            spread = (double)vec3_length(vec3_sub(a, b));
        }
        most += spread;
    }
    ribbons_free(&ribbons);
    return most / (inside_points(style) / POINTS);
}

static void rotation_turns_wisps_of_a_lock_apart(void** state)
{
    (void)state;
    Hairstyle* style = square();
    style->forms[0] = (WispForm){.curl_radius_m = 0.01f, .curl_turns = 2};
    double alike = phase_spread(style);
    style->forms[0].rotation_rad = 3.0f;
    double apart = phase_spread(style);
    set_map(style, MAP_ROTATION, 0, 0);
    double mapped = phase_spread(style);
    assert_true(apart > 1.5 * alike);
    assert_true(mapped == alike);
    hairstyle_destroy(style);
}

static double distance_to(const Hairstyle* style, Vec3 at)
{
    Ribbons ribbons = must_build(style);
    double sum = 0;
    for (int w = 0; w < 40; ++w)
        sum += (double)vec3_length(vec3_sub(tip(&ribbons, style, w), at)) / 40;
    ribbons_free(&ribbons);
    return sum;
}

static void magnets_attract_and_repel_within_their_reach(void** state)
{
    (void)state;
    const Vec3 at = {0.15f, -0.2f, 0.05f};
    Hairstyle* style = square();
    double none = distance_to(style, at);
    style->magnet_count = 1;
    style->magnets[0] = (Magnet){at, 0.3f, 0.5f};
    double pulled = distance_to(style, at);
    style->magnets[0].pull = -0.5f;
    double pushed = distance_to(style, at);
    style->magnets[0].reach_m = 0.01f;
    double beyond = distance_to(style, at);
    printf("tips are %.1f mm from a magnet that pulls, %.1f by one that pushes, %.1f without\n",
           pulled * 1e3, pushed * 1e3, none * 1e3);
    assert_true(pulled < 0.85 * none);
    assert_true(pushed > 1.15 * none);
    assert_true(beyond == none);
    hairstyle_destroy(style);
}

static void ribbons_have_the_segments_that_the_map_says(void** state)
{
    (void)state;
    Hairstyle* style = square();
    set_map(style, MAP_SEGMENTS, 64, 64);
    style->sets[0].points = 17;
    Ribbons ribbons = must_build(style);
    int points = 0, ribbons_seen = 0;
    for (int i = 0; i <= ribbons.point_count; ++i, ++points) {
        if (i < ribbons.point_count && !is_root(&ribbons, i)) continue;
        if (i > 0) assert_int_equal(points, 9);
        points = 0;
        ++ribbons_seen;
    }
    assert_int_equal(ribbons_seen - 1, WISPS);
    assert_int_equal(ribbons.index_count, WISPS * (2 * 9 + 1));
    ribbons_free(&ribbons);
    hairstyle_destroy(style);
}

// The quarter of a ribbon's random number is its layer.
static void the_map_chooses_the_strand_texture(void** state)
{
    (void)state;
    for (int layer = 0; layer < FIBRES_LAYERS; ++layer) {
        Hairstyle* style = square();
        set_map(style, MAP_TEXTURE, (uint8_t)(layer + 1), (uint8_t)(layer + 1));
        Ribbons ribbons = must_build(style);
        for (int i = 0; i < ribbons.point_count; ++i)
            assert_int_equal((int)(ribbons.normals[i][3] * FIBRES_LAYERS), layer);
        ribbons_free(&ribbons);
        hairstyle_destroy(style);
    }
    Hairstyle* style = square();
    Ribbons ribbons = must_build(style);
    int count[FIBRES_LAYERS] = {0};
    for (int w = 0; w < WISPS; ++w)
        ++count[(int)(ribbons.normals[w * POINTS][3] * FIBRES_LAYERS)];
    for (int layer = 0; layer < FIBRES_LAYERS; ++layer)
        assert_true(count[layer] > WISPS / 8);
    ribbons_free(&ribbons);
    hairstyle_destroy(style);
}

// Tips of a lock meet: nearest tips come closer than their roots are.
static void clumps_draw_tips_together(void** state)
{
    (void)state;
    Hairstyle* style = square();
    double ratio[2];
    for (int clumped = 0; clumped < 2; ++clumped) {
        style->forms[0].clump = 0.9f * (float)clumped;
        Ribbons ribbons = must_build(style);
        double tips = 0, roots = 0;
        for (int w = 0; w < 60; ++w) {
            double tip_m = 1, root_m = 1;
            for (int v = 0; v < 148; ++v) {
                if (v == w) continue;
                Vec3 d = vec3_sub(tip(&ribbons, style, w), tip(&ribbons, style, v));
                d.y = 0; // lengths differ
                tip_m = fmin(tip_m, (double)vec3_length(d));
                d = vec3_sub(place(&ribbons, style, w * POINTS),
                             place(&ribbons, style, v * POINTS));
                root_m = fmin(root_m, (double)vec3_length(d));
            }
            tips += tip_m;
            roots += root_m;
        }
        ratio[clumped] = tips / roots;
        ribbons_free(&ribbons);
    }
    assert_true(fabs(ratio[0] - 1.0) < 0.01);
    assert_true(ratio[1] < 0.4);
    hairstyle_destroy(style);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(roots_keep_away_from_each_other),
        cmocka_unit_test(roots_follow_the_density_map),
        cmocka_unit_test(wisps_are_as_long_as_the_length_map_says),
        cmocka_unit_test(widths_follow_the_profile_and_the_map),
        cmocka_unit_test(curls_wind_on_a_cylinder),
        cmocka_unit_test(stiff_hair_curls_further_from_its_root),
        cmocka_unit_test(rotation_turns_wisps_of_a_lock_apart),
        cmocka_unit_test(magnets_attract_and_repel_within_their_reach),
        cmocka_unit_test(ribbons_have_the_segments_that_the_map_says),
        cmocka_unit_test(the_map_chooses_the_strand_texture),
        cmocka_unit_test(clumps_draw_tips_together),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
