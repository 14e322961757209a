#include "messages/quantise.h"
#include "messages/random.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#define POINTS 1000000u

// shared/tables/quant.csv, row "16" of positions: a cube of 300 mm, 16 bits.
#define TABLE_EDGE_M    0.3f
#define TABLE_MAX_3D_MM 0.00396
#define TABLE_RMS_3D_MM 0.00229
// shared/tables/quant.csv, "xyz snorm16 renorm": uniform random unit vectors.
#define TABLE_MEAN_DEG 0.000659
#define TABLE_MAX_DEG  0.001500

static Vec3 random_point(uint32_t seed, uint32_t i, float low, float high)
{
    return vec3(low + (high - low) * random_unit(seed, 3 * i),
                low + (high - low) * random_unit(seed, 3 * i + 1),
                low + (high - low) * random_unit(seed, 3 * i + 2));
}

static double distance(Vec3 a, Vec3 b)
{
    Vec3d d = vec3d_sub(vec3d_from(a), vec3d_from(b));
    return sqrt(vec3d_dot(d, d));
}

static void quantise_position_holds_its_bound_and_the_table(void** state)
{
    (void)state;
    Box box = {{0, 0, 0}, {TABLE_EDGE_M, TABLE_EDGE_M, TABLE_EDGE_M}};
    double bound = (double)quantise_error_bound_m(&box), worst = 0.0, sum = 0.0;
    for (uint32_t i = 0; i < POINTS; ++i) {
        Vec3 p = random_point(1, i, 0.0f, TABLE_EDGE_M);
        uint16_t texel[3];
        assert_int_equal(quantise_position(texel, p, &box), 0);
        double error = distance(p, dequantise_position(texel, &box));
        worst = error > worst ? error : worst;
        sum += error * error;
    }
    assert_true(worst <= bound);
    // Design 4's figure, and the rounding of three floats.
    assert_true(bound <= (double)TABLE_EDGE_M * (0.87 / 65535.0 + 0x1p-23));
    assert_true(worst * 1e3 <= TABLE_MAX_3D_MM + 0.00002);
    assert_true(worst * 1e3 >= 0.9 * TABLE_MAX_3D_MM); // the measurement sees the worst case
    assert_true(fabs(sqrt(sum / POINTS) * 1e3 - TABLE_RMS_3D_MM) < 0.00001);
}

static void quantise_position_holds_its_bound_in_a_lopsided_far_box(void** state)
{
    (void)state;
    Box box = {{-3.7f, 40.0f, 0.001f}, {-1.2f, 40.4f, 0.0023f}};
    double bound = (double)quantise_error_bound_m(&box);
    for (uint32_t i = 0; i < 100000; ++i) {
        Vec3 u = random_point(2, i, 0.0f, 1.0f);
        Vec3 p = vec3(box.low.x + u.x * 2.4f, box.low.y + u.y * 0.39f, box.low.z + u.z * 0.0012f);
        uint16_t texel[3];
        assert_int_equal(quantise_position(texel, p, &box), 0);
        assert_true(distance(p, dequantise_position(texel, &box)) <= bound);
    }
}

static void quantise_position_keeps_every_texel_through_a_round_trip(void** state)
{
    (void)state;
    Box box = {{-0.25f, -0.1f, -0.31f}, {0.17f, 0.4f, 0.29f}};
    for (int n = 0; n <= 65535; ++n) {
        uint16_t texel[3] = {(uint16_t)n, (uint16_t)(65535 - n), (uint16_t)(n ^ 0x5555)}, back[3];
        quantise_position(back, dequantise_position(texel, &box), &box);
        assert_memory_equal(texel, back, sizeof texel);
    }
}

static void quantise_position_clamps_and_counts_what_is_outside(void** state)
{
    (void)state;
    Box box = {{-1, -1, -1}, {1, 1, 1}};
    uint16_t t[3];
    assert_int_equal(quantise_position(t, vec3(-2, 0, 5), &box), 2);
    assert_int_equal(t[0], 0);
    assert_int_equal(t[2], 65535);
    assert_int_equal(quantise_position(t, vec3(1, 1, -1), &box), 0);
    assert_int_equal(quantise_position(t, vec3(1e30f, -1e30f, 9), &box), 3);
}

static void quantise_position_puts_what_is_not_finite_in_the_middle(void** state)
{
    (void)state;
    Box box = {{-1, -1, -1}, {1, 1, 1}};
    const Vec3 bad[] = {{NAN, 0, 0}, {0, INFINITY, 0}, {0, 0, -INFINITY}};
    for (int i = 0; i < 3; ++i) {
        uint16_t t[3];
        assert_int_equal(quantise_position(t, bad[i], &box), 3);
        assert_true(vec3_length(dequantise_position(t, &box)) < 1e-4f);
    }
}

static Vec3 random_unit_vector(uint32_t i)
{
    for (uint32_t n = 0;; ++n) {
        Vec3 v = random_point(3 + n, i, -1.0f, 1.0f);
        float length = vec3_length(v);
        if (length > 0.1f && length < 1.0f) return vec3_scale(v, 1.0f / length);
    }
}

static double angle_deg(Vec3 a, Vec3 b)
{
    Vec3d u = vec3d_from(a), v = vec3d_from(b), c = vec3d_cross(u, v);
    return atan2(sqrt(vec3d_dot(c, c)), vec3d_dot(u, v)) * 57.29577951308232;
}

static void quantise_tangent_holds_the_table(void** state)
{
    (void)state;
    double worst = 0.0, sum = 0.0;
    for (uint32_t i = 0; i < POINTS; ++i) {
        Vec3 t = random_unit_vector(i);
        int16_t texel[3];
        quantise_tangent(texel, t);
        double error = angle_deg(t, dequantise_tangent(texel));
        worst = error > worst ? error : worst;
        sum += error;
    }
    // Float inputs and outputs add 2^-24 each to what the table measured in double.
    assert_true(worst <= TABLE_MAX_DEG + 0.00002);
    assert_true(worst >= 0.9 * TABLE_MAX_DEG);
    assert_true(fabs(sum / POINTS - TABLE_MEAN_DEG) < 0.00001);
}

static void quantise_tangent_points_down_where_there_is_no_direction(void** state)
{
    (void)state;
    const Vec3 bad[] = {{0, 0, 0}, {NAN, 1, 0}, {INFINITY, 0, 0}};
    for (int i = 0; i < 3; ++i) {
        int16_t t[3];
        quantise_tangent(t, bad[i]);
        assert_int_equal(t[0], 0);
        assert_int_equal(t[1], -32767);
        assert_int_equal(t[2], 0);
    }
    const int16_t zero[3] = {0, 0, 0};
    assert_true(dequantise_tangent(zero).y == -1.0f);
}

static void quantise_tangent_needs_no_unit_length(void** state)
{
    (void)state;
    int16_t a[3], b[3];
    quantise_tangent(a, vec3(0.6f, -0.8f, 0.0f));
    quantise_tangent(b, vec3(600.0f, -800.0f, 0.0f));
    assert_memory_equal(a, b, sizeof a);
    const int16_t lowest[3] = {-32768, 0, 0};
    assert_true(dequantise_tangent(lowest).x == -1.0f);
}

static void quantise_strand_tangents_are_central_and_repeat_where_degenerate(void** state)
{
    (void)state;
    const Vec3 line[5] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 0, 0}, {1, 0, 0}};
    Vec3 t[5];
    quantise_strand_tangents(t, line, 5);
    assert_true(t[0].x == 1.0f);                                  // one-sided
    assert_true(fabsf(t[1].x - t[1].y) < 1e-6f && t[1].x > 0.7f); // central
    assert_true(t[2].x == t[1].x && t[2].y == t[1].y);            // x(3) == x(1): repeated
    assert_true(t[3].y == -1.0f);                                 // x(4) - x(2)
    assert_true(t[4].y == -1.0f);                                 // x(4) == x(3): repeated
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quantise_position_holds_its_bound_and_the_table),
        cmocka_unit_test(quantise_position_holds_its_bound_in_a_lopsided_far_box),
        cmocka_unit_test(quantise_position_keeps_every_texel_through_a_round_trip),
        cmocka_unit_test(quantise_position_clamps_and_counts_what_is_outside),
        cmocka_unit_test(quantise_position_puts_what_is_not_finite_in_the_middle),
        cmocka_unit_test(quantise_tangent_holds_the_table),
        cmocka_unit_test(quantise_tangent_points_down_where_there_is_no_direction),
        cmocka_unit_test(quantise_tangent_needs_no_unit_length),
        cmocka_unit_test(quantise_strand_tangents_are_central_and_repeat_where_degenerate),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
