// --shadow-lights all: fill and rim light are kept out as the key light is, by hair and head.
#include "client/draw.h"
#include "messages/mannequin.h"
#include "tests/drawing.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#define SIDE 64

// Mesa 22.3's OSMesaDestroyContext forgets its default framebuffer (see test_gl.c).
const char* __lsan_default_suppressions(void);
const char* __lsan_default_suppressions(void)
{
    return "leak:libOSMesa.so";
}

typedef struct Stage {
    Gl* gl;
    Hairstyle* style;
} Stage;

static int open_stage(void** state)
{
    static Stage stage;
    stage.gl = drawing_open("egl");
    if (stage.gl == NULL) stage.gl = drawing_open("osmesa");
    stage.style = drawing_style("bob");
    *state = &stage;
    return 0;
}

static int close_stage(void** state)
{
    Stage* stage = *state;
    Fault fault = {""};
    hairstyle_destroy(stage->style);
    if (stage->gl == NULL) return 0;
    bool sound = gl_check(stage->gl, "lights", &fault);
    if (!sound) fprintf(stderr, "%s\n", fault.text);
    gl_close(stage->gl);
    return sound ? 0 : -1;
}

// What the light pass left at every point of the bob, and where those points are.
typedef struct Lit {
    int count;
    float* radiance;  // four a point: red, green, blue, -
    float* positions; // x, y, z, half width
    Vec3 fill, rim;
} Lit;

static float* read_texture(const Gl* gl, GLuint texture, int rows)
{
    float* texels = malloc((size_t)(UPDATE_WIDTH * rows) * 4 * sizeof *texels);
    assert_non_null(texels);
    gl->BindTexture(GL_TEXTURE_2D, texture);
    gl->GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, texels);
    return texels;
}

static ShadeOptions one_light(int light, bool all_lights)
{
    ShadeOptions options = shade_default();
    options.width = options.height = SIDE;
    options.shadow.all_lights = all_lights;
    options.shading.kind = SHADING_MARSCHNER;
    options.shading.wrap = 0.0f; // nothing else keeps light out
    for (int i = 0; i < LIGHT_STRENGTHS; ++i)
        options.light_strength[i] = i == light ? 2.0f : 0.0f;
    return options;
}

static Lit draw_lit(const Stage* stage, const ShadeOptions* options)
{
    Drawing drawing;
    Image image;
    Fault fault = {""};
    CameraOptions camera = camera_default();
    GuidesView view = drawing_view(stage->style);
    if (!draw_create(&drawing, stage->gl, options, &camera, &fault) ||
        !draw_set_style(&drawing, stage->style, 1, 1, &fault) ||
        !image_create(&image, SIDE, SIDE, &fault))
        fail_msg("%s", fault.text);
    for (int row = 0; row < stage->style->guide_count; ++row)
        drawing_put_row(&view, stage->style, row, 0,
                        stage->style->rest + row * stage->style->nodes);
    assert_true(draw_picture(&drawing, &view, &image));
    const Update* update = &drawing.hair.update;
    Lit lit = {.count = drawing.hair.ribbons.point_count,
               .radiance = read_texture(stage->gl, drawing.light.targets[LIGHT_BODY], update->rows),
               .positions =
                   read_texture(stage->gl, update->targets[UPDATE_POSITIONS], update->rows),
               .fill = drawing.shade.lights.fill,
               .rim = drawing.shade.lights.rim};
    image_free(&image);
    guides_view_free(&view);
    draw_free(&drawing);
    return lit;
}

static void free_lit(Lit* lit)
{
    free(lit->radiance);
    free(lit->positions);
}

// Whether the way from `at` to a light leads more than 2 cm deep through the head.
static bool is_behind_head(Vec3 at, Vec3 light)
{
    for (float way_m = 0.01f; way_m < 0.3f; way_m += 0.005f)
        if (mannequin_distance(vec3_mad(at, light, way_m)) < -0.02f) return true;
    return false;
}

static int count_lit_behind_head(const Lit* lit, Vec3 light, int* behind)
{
    int count = *behind = 0;
    for (int i = 0; i < lit->count; ++i) {
        const float* p = lit->positions + 4 * i;
        if (!is_behind_head(vec3(p[0], p[1], p[2]), light)) continue;
        ++*behind;
        count += lit->radiance[4 * i] > 0.0f;
    }
    return count;
}

static void a_strand_behind_the_head_gets_no_fill_and_no_rim_light(void** state)
{
    const Stage* stage = *state;
    if (stage->gl == NULL) skip(); // drawing_open has said why
    for (int light = LIGHT_FILL; light <= LIGHT_RIM; ++light)
        for (int all = 0; all < 2; ++all) {
            ShadeOptions options = one_light(light, all);
            Lit lit = draw_lit(stage, &options);
            int behind;
            int count =
                count_lit_behind_head(&lit, light == LIGHT_FILL ? lit.fill : lit.rim, &behind);
            printf("light %d, %s: %d of %d points behind the head are lit\n", light,
                   all ? "all" : "key", count, behind);
            assert_true(behind > 100);
            assert_true(all ? count == 0 : count > behind / 20);
            free_lit(&lit);
        }
}

// A light alone is what the key light is where it stood there with a map of that size.
static void fill_and_rim_are_shaded_as_the_key_light_would_be_from_there(void** state)
{
    const Stage* stage = *state;
    if (stage->gl == NULL) skip();
    for (int light = LIGHT_FILL; light <= LIGHT_RIM; ++light) {
        ShadeOptions options = one_light(light, true), key = one_light(LIGHT_KEY, false);
        if (light == LIGHT_FILL)
            options.shadow.method = key.shadow.method = shadow_find_method("depth");
        key.shadow.size = shadow_smaller(&options.shadow).size;
        key.light_yaw_deg += light == LIGHT_FILL ? -100.0f : 120.0f; // shade.c, place_lights
        key.light_pitch_deg = light == LIGHT_FILL ? 10.0f : 35.0f;
        Lit lit = draw_lit(stage, &options), expected = draw_lit(stage, &key);
        int bright = 0;
        for (int i = 0; i < 4 * lit.count; ++i) {
            if (i % 4 == 3) continue;
            float most = fmaxf(lit.radiance[i], expected.radiance[i]);
            assert_true(fabsf(lit.radiance[i] - expected.radiance[i]) <= 2e-3f * most + 1e-6f);
            bright += most > 0.01f;
        }
        assert_true(bright > 500);
        free_lit(&lit);
        free_lit(&expected);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_strand_behind_the_head_gets_no_fill_and_no_rim_light),
        cmocka_unit_test(fill_and_rim_are_shaded_as_the_key_light_would_be_from_there),
    };
    return cmocka_run_group_tests(tests, open_stage, close_stage);
}
