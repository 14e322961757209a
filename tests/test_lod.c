// Levels of detail: the thesis's triangles, and pictures that are covered alike.
#include "client/draw.h"
#include "tests/drawing.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#define STYLES 5
#define VIEWS  4
#define SIDE   160

// Mesa 22.3's OSMesaDestroyContext forgets its default framebuffer (see test_gl.c).
const char* __lsan_default_suppressions(void);
const char* __lsan_default_suppressions(void)
{
    return "leak:libOSMesa.so";
}

static Hairstyle* (*const makers[STYLES])(Fault*) = {groom_bob, groom_long, groom_ponytail,
                                                     groom_curly, groom_short};
static Hairstyle* styles[STYLES];

static int make_styles(void** state)
{
    (void)state;
    for (int s = 0; s < STYLES; ++s) {
        styles[s] = makers[s](NULL);
        if (styles[s] == NULL) return -1;
        styles[s]->head_kind = HEAD_NONE; // its mesh takes longer to make than all that is drawn
    }
    return 0;
}

static int free_styles(void** state)
{
    (void)state;
    for (int s = 0; s < STYLES; ++s)
        hairstyle_destroy(styles[s]);
    return 0;
}

static int triangles(const Ribbons* ribbons)
{
    return 2 * (ribbons->point_count - ribbons->ribbon_count);
}

// The thesis's table of whole frames (6.1.13): 7,800 triangles of hair close, 1,250 far.
static void levels_have_the_triangles_of_the_thesis(void** state)
{
    (void)state;
    static const int most[LODS] = {0, 7800, 2000, 1250};
    for (int s = 0; s < STYLES; ++s)
        for (int lod = LOD_CLOSE; lod <= LOD_FAR; ++lod) {
            Fault fault = {""};
            Ribbons ribbons;
            assert_true(ribbons_build_lod(&ribbons, styles[s], (Lod)lod, &fault));
            if (triangles(&ribbons) > most[lod] || triangles(&ribbons) < 0.95 * most[lod])
                fail_msg("%s, %s: %d triangles", styles[s]->name, lod_names[lod],
                         triangles(&ribbons));
            ribbons_free(&ribbons);
        }
}

static void imported_strands_are_thinned_out_alike(void** state)
{
    (void)state;
    Hairstyle* style = drawing_style("ponytail");
    if (style == NULL) skip();
    Fault fault = {""};
    Ribbons ribbons;
    assert_true(ribbons_build_lod(&ribbons, style, LOD_MEDIUM, &fault));
    assert_true(triangles(&ribbons) <= 2000);
    for (int i = 0; i < ribbons.point_count; ++i)
        assert_true(ribbons.weights[i][3] >= 0.0f && ribbons.offsets[i][3] <= 1.0f);
    ribbons_free(&ribbons);
    hairstyle_destroy(style);
}

static Drawing open_drawing(const Gl* gl)
{
    Fault fault = {""};
    Drawing drawing;
    ShadeOptions options = shade_default();
    options.width = options.height = SIDE;
    options.view = VIEW_COVERAGE;
    CameraOptions camera = camera_default();
    camera.has_distance = camera.has_target = true;
    camera.distance_m = 0.8f;
    camera.target = vec3(0, 0.16f, 0);
    if (!draw_create(&drawing, gl, &options, &camera, &fault)) fail_msg("%s", fault.text);
    return drawing;
}

// Over the views round the head: what one has more another may have less of, by the outline.
static double hair_pixels(Drawing* drawing, const Hairstyle* style, Lod lod)
{
    Fault fault = {""};
    Image image;
    GuidesView rest = drawing_view(style);
    double pixels = 0;
    drawing->options.lod = lod;
    if (!image_create(&image, SIDE, SIDE, &fault) ||
        !draw_set_style(drawing, style, style->seed, drawing->style_version + 1, &fault))
        fail_msg("%s", fault.text);
    for (int view = 0; view < VIEWS; ++view) {
        drawing->camera.yaw_deg = 25.0f + 360.0f / VIEWS * (float)view;
        drawing->moved = true;
        assert_true(draw_picture(drawing, &rest, &image));
        pixels += draw_hair_pixels(&image);
    }
    image_free(&image);
    guides_view_free(&rest);
    return pixels;
}

static void fewer_wisps_cover_as_much_of_the_picture(void** state)
{
    (void)state;
    Gl* gl = drawing_open("osmesa");
    if (gl == NULL) gl = drawing_open("egl");
    if (gl == NULL) skip();
    Drawing drawing = open_drawing(gl);
    int wrong = 0;
    for (int s = 0; s < STYLES; ++s) {
        double covered[LODS];
        for (int lod = LOD_FULL; lod <= LOD_FAR; ++lod)
            covered[lod] = hair_pixels(&drawing, styles[s], (Lod)lod);
        double close = covered[LOD_CLOSE] / covered[LOD_FULL] - 1.0;
        double medium = covered[LOD_MEDIUM] / covered[LOD_CLOSE] - 1.0;
        double far = covered[LOD_FAR] / covered[LOD_CLOSE] - 1.0;
        printf("%s: close %+.1f %% of full, medium %+.1f %% and far %+.1f %% of close\n",
               styles[s]->name, 100.0 * close, 100.0 * medium, 100.0 * far);
        wrong += !(fabs(close) < 0.05) + !(fabs(medium) < 0.05) + !(fabs(far) < 0.05);
    }
    draw_free(&drawing);
    gl_close(gl);
    assert_int_equal(wrong, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_have_the_triangles_of_the_thesis),
        cmocka_unit_test(imported_strands_are_thinned_out_alike),
        cmocka_unit_test(fewer_wisps_cover_as_much_of_the_picture),
    };
    return cmocka_run_group_tests(tests, make_styles, free_styles);
}
