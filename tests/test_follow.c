// The strands of hair-bench reference are the path tracer's: numbers, check strands and the sum of
// all coordinates are those that ../shared/assets/reference/scene.json states.
#include "client/draw.h"
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

// Masks' files say that they are linear, so that reading them made sRGB codes of what they hold.
static double mask_pixels(const char* view)
{
    char path[300];
    Image mask;
    Fault fault = {""};
    snprintf(path, sizeof path, DRAWING_ASSETS "reference/mask_%s.png", view);
    if (!image_read_png(&mask, path, &fault)) fail_msg("%s", fault.text);
    double sum = 0.0;
    for (int i = 0; i < mask.width * mask.height; ++i)
        sum += image_linear(mask.rgba[4 * i]);
    image_free(&mask);
    return sum;
}

static double drawn_pixels(const Gl* gl, const Hairstyle* style, float yaw_deg, float distance_m)
{
    ShadeOptions options = shade_default();
    options.view = VIEW_COVERAGE;
    CameraOptions camera = {.has_distance = true,
                            .distance_m = distance_m,
                            .yaw_deg = yaw_deg,
                            .pitch_deg = 5.0f,
                            .fov_deg = 45.0f};
    Drawing drawing;
    Image image;
    Fault fault = {""};
    GuidesView guides = drawing_view(style);
    drawing_put_tick(&guides, style, 0, 0, 0.0f);
    if (!image_create(&image, options.width, options.height, &fault) ||
        !draw_create(&drawing, gl, &options, &camera, &fault) ||
        !draw_set_style(&drawing, style, 1, 0, &fault) || !draw_picture(&drawing, &guides, &image))
        fail_msg("%s", fault.text);
    double pixels = draw_hair_pixels(&image);
    draw_free(&drawing);
    image_free(&image);
    guides_view_free(&guides);
    return pixels;
}

// Hairs of 0.08 mm radius, a tenth of a pixel: nothing is drawn thinner than a pixel, so what a
// pixel is covered by must come from the strand textures.
static void hairs_thinner_than_a_pixel_cover_what_the_masks_cover(void** state)
{
    (void)state;
    static const struct {
        const char* name;
        float yaw_deg, distance_m;
    } views[] = {{"front", 0, 0.7f},
                 {"threequarter", 35, 0.7f},
                 {"back", 180, 0.7f},
                 {"backwide", 180, 1.0f}};
    if (!drawing_has_assets()) skip();
    Gl* gl = drawing_open("egl");
    if (gl == NULL) skip();
    Fault fault = {""};
    Hairstyle* style = follow_style(DRAWING_ASSETS, &fault);
    if (style == NULL) fail_msg("%s", fault.text);
    for (size_t i = 0; i < sizeof views / sizeof views[0]; ++i) {
        double ratio = drawn_pixels(gl, style, views[i].yaw_deg, views[i].distance_m) /
                       mask_pixels(views[i].name);
        print_message("%s: %+.1f %% of the mask\n", views[i].name, 100.0 * (ratio - 1.0));
        assert_true(fabs(ratio - 1.0) < 0.05);
    }
    hairstyle_destroy(style);
    gl_close(gl);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(follow_random_is_the_pcg_hash_that_scene_json_tests),
        cmocka_unit_test(follow_style_holds_the_strands_of_the_path_traced_pictures),
        cmocka_unit_test(hairs_thinner_than_a_pixel_cover_what_the_masks_cover),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
