// The strands of hair-bench reference are the path tracer's: numbers, check strands and the sum of
// all coordinates are those that ../shared/assets/reference/scene.json states.
#include "messages/drawn.h"
#include "tests/drawing.h"
#include "tests/follow.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
// cmocka.h needs the three above.
#include <cmocka.h>

static void follow_random_is_the_pcg_hash_that_scene_json_tests(void** state)
{
    (void)state;
    static const struct {
        uint32_t n;
        double value;
    } known[] = {{0, 129708002}, {1, 2831084092}, {2, 2055130248}, {100, 925481064}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; ++i)
        assert_true(follow_random(known[i].n) == known[i].value / 4294967296.0);
}

// A strand of the style in file units: number over all of them as scene.json counts.
static Vec3d strand_point(const Hairstyle* style, int strand, int point, const Vec3* tangents)
{
    const StrandSet* set = style->sets;
    while (strand >= set->first_strand + set->strand_count)
        ++set;
    DrawnPoint drawn;
    drawn_from_bound(&drawn, style, set, strand - set->first_strand, point);
    Vec3d p = drawn_position(&drawn, style->nodes, style->rest, tangents, tangents, NULL);
    return (Vec3d){p.x / 0.0027, p.y / 0.0027, -p.z / 0.0027};
}

static void follow_style_holds_the_strands_of_the_path_traced_pictures(void** state)
{
    (void)state;
    static const struct {
        int strand, point;
        Vec3d at;
    } known[] = {{1, 0, {4.9082325, 67.009207, 30.6004536}},
                 {1, 15, {1.6548645, 75.381299, 40.3447445}},
                 {5, 0, {17.7817745, 85.3119049, 29.9453106}},
                 {12000, 15, {13.3337984, 49.2798538, 30.8086433}},
                 {24664, 0, {0.6449185, 80.9911364, 45.3888723}},
                 {24664, 15, {6.1194918, 3.7664826, 76.6464271}}};
    static const Vec3d sum_of_all = {-325433.933, 36686886.179, 5768896.448};
    if (!drawing_has_assets()) skip();
    Fault fault = {""};
    Hairstyle* style = follow_style(DRAWING_ASSETS, &fault);
    if (style == NULL) fail_msg("%s", fault.text);
    Vec3* tangents = hairstyle_rest_tangents(style);
    assert_int_equal(style->strand_count, 24665);
    // An offset is exact to half a quantum of its scale on each axis.
    double quantum = (double)style->offset_scale_m / 0.0027;
    for (size_t i = 0; i < sizeof known / sizeof known[0]; ++i) {
        Vec3d p = strand_point(style, known[i].strand, known[i].point, tangents);
        Vec3d off = vec3d_sub(p, known[i].at);
        assert_true(sqrt(vec3d_dot(off, off)) < quantum + 1e-4);
    }
    Vec3d sum = {0, 0, 0};
    for (int s = 0; s < style->strand_count; ++s)
        for (int k = 0; k < 16; ++k)
            sum = vec3d_add(sum, strand_point(style, s, k, tangents));
    // Half a quantum, at random, of 394,640 points: five deviations.
    double bound = 5.0 * quantum * 0.29 * sqrt(394640.0);
    Vec3d off = vec3d_sub(sum, sum_of_all);
    print_message("quantum %.5f units; sum off by %.2f %.2f %.2f of at most %.2f\n", quantum, off.x,
                  off.y, off.z, bound);
    assert_true(fabs(off.x) < bound && fabs(off.y) < bound && fabs(off.z) < bound);
    free(tangents);
    hairstyle_destroy(style);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(follow_random_is_the_pcg_hash_that_scene_json_tests),
        cmocka_unit_test(follow_style_holds_the_strands_of_the_path_traced_pictures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
