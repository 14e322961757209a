// Transparency: how much hair covers by each variant, from the fibre pattern to whole pictures,
// what sorting promises, and a camera inside the hair.
#include "client/draw.h"
#include "client/fibres.h"
#include "client/program.h"
#include "tests/allocations.h"
#include "tests/drawing.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#define SIDE 256

// Mesa 22.3's OSMesaDestroyContext forgets its default framebuffer (see test_gl.c).
const char* __lsan_default_suppressions(void);
const char* __lsan_default_suppressions(void)
{
    return "leak:libOSMesa.so";
}

static Gl* gl;
static Hairstyle* bob; // without its head

static int set_up(void** state)
{
    (void)state;
    gl = drawing_open("egl");
    if (gl == NULL) gl = drawing_open("osmesa");
    bob = drawing_style("bob");
    bob->head_kind = HEAD_NONE;
    return 0;
}

static int tear_down(void** state)
{
    (void)state;
    hairstyle_destroy(bob);
    if (gl != NULL) gl_close(gl);
    return 0;
}

static void need_samples(int samples)
{
    if (gl != NULL && gl->max_samples >= samples && (gl->sample_mask || samples == 1)) return;
    printf("SKIPPED: no GL with %d samples a pixel\n", samples);
    skip();
}

static void assert_close(double is, double want, double within, const char* what)
{
    if (!(fabs(is - want) <= within))
        fail_msg("%s is %.5f, want %.5f +- %g", what, is, want, within);
}

// --- the pattern

static void every_mip_level_covers_what_the_fill_says(void** state)
{
    (void)state;
    need_samples(1);
    Fault fault = {""};
    GLuint fibres = fibres_create(gl, &fault);
    assert_int_not_equal(fibres, 0);
    static float ranks[FIBRES_LAYERS * FIBRES_SIZE * FIBRES_SIZE];
    for (int level = 0, size = FIBRES_SIZE; level < FIBRES_LEVELS; ++level, size /= 2) {
        gl->BindTexture(GL_TEXTURE_2D_ARRAY, fibres);
        gl->GetTexImage(GL_TEXTURE_2D_ARRAY, level, GL_RED, GL_FLOAT, ranks);
        for (int layer = 0; layer < FIBRES_LAYERS; ++layer)
            for (int percent = 2; percent < 100; percent += 3) {
                int covered = 0;
                for (int i = layer * size * size; i < (layer + 1) * size * size; ++i)
                    covered += ranks[i] > 1.0f - 0.01f * (float)percent;
                assert_close((double)covered / (size * size), 0.01 * percent, 0.02, "coverage");
            }
    }
    gl->DeleteTextures(1, &fibres);
}

// --- coverage.glsl, on a square of pixels

// `step` apart, so that a pixel is wider than a fibre and its coverage is the fill; 0: the first
// texel of the pattern everywhere. Each row is a hair of its own, in each layer.
static const char square_shader[] =
    "#include \"coverage.glsl\"\n"
    "uniform float fill, layer, step_x;\n"
    "layout(location = 0) out vec4 out_radiance;\n"
    "void main()\n"
    "{\n"
    "    vec3 place = vec3(gl_FragCoord.x * step_x + 0.5 / 256.0, 0.5 / 256.0, 0.0);\n"
    "    float own, random = layer + floor(gl_FragCoord.y) / 512.0;\n"
    "    float alpha = keep_covered(place, fill, random, own);\n"
    "    out_radiance = vec4(1.0, 1.0, 1.0, alpha);\n"
    "}\n";

typedef struct Square {
    GLuint multisampled, samples, resolved, texture, vao, fibres, program;
    Transparency transparency;
    int sample_count;
} Square;

static void build_square_program(Square* square)
{
    ShaderSource sources[64];
    int count = 0;
    for (; shader_sources[count].name != NULL; ++count)
        sources[count] = shader_sources[count];
    sources[count++] = (ShaderSource){"square.frag", square_shader};
    sources[count] = (ShaderSource){NULL, NULL};
    char defines[TRANSPARENCY_DEFINES];
    Fault fault = {""};
    transparency_defines(defines, square->transparency, square->sample_count, STEP_ALONE);
    square->program =
        program_build_from(gl, sources, "fullscreen.vert", "square.frag", defines, &fault);
    if (square->program == 0) fail_msg("%s", fault.text);
    program_sampler(gl, square->program, "fibre_ranks", 0);
}

static Square open_square(Transparency transparency, int samples)
{
    Square s = {.transparency = transparency, .sample_count = samples};
    Fault fault = {""};
    need_samples(samples);
    s.fibres = fibres_create(gl, &fault);
    build_square_program(&s);
    gl->GenVertexArrays(1, &s.vao);
    gl->GenFramebuffers(1, &s.multisampled);
    gl->GenRenderbuffers(1, &s.samples);
    gl->BindFramebuffer(GL_FRAMEBUFFER, s.multisampled);
    gl->BindRenderbuffer(GL_RENDERBUFFER, s.samples);
    gl->RenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_RGBA16F, SIDE, SIDE);
    gl->FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, s.samples);
    assert_int_equal(gl->CheckFramebufferStatus(GL_FRAMEBUFFER), GL_FRAMEBUFFER_COMPLETE);
    gl->ClearColor(0, 0, 0, 0);
    gl->Clear(GL_COLOR_BUFFER_BIT);
    gl->GenFramebuffers(1, &s.resolved);
    gl->GenTextures(1, &s.texture);
    gl->BindFramebuffer(GL_FRAMEBUFFER, s.resolved);
    gl->BindTexture(GL_TEXTURE_2D, s.texture);
    gl->TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA16F, SIDE, SIDE, 0, GL_RGBA, GL_FLOAT, NULL);
    gl->FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, s.texture, 0);
    return s;
}

static void close_square(Square* s)
{
    Fault fault = {""};
    if (!gl_check(gl, "a square", &fault)) fail_msg("%s", fault.text);
    gl->DeleteProgram(s->program);
    gl->DeleteFramebuffers(1, &s->multisampled);
    gl->DeleteFramebuffers(1, &s->resolved);
    gl->DeleteRenderbuffers(1, &s->samples);
    gl->DeleteTextures(1, &s->texture);
    gl->DeleteTextures(1, &s->fibres);
    gl->DeleteVertexArrays(1, &s->vao);
}

static void draw_layer(const Square* s, float fill, float step, int layer)
{
    gl->BindFramebuffer(GL_FRAMEBUFFER, s->multisampled);
    gl->Viewport(0, 0, SIDE, SIDE);
    gl->Enable(GL_MULTISAMPLE);
    gl->UseProgram(s->program);
    gl->Uniform1f(program_uniform(gl, s->program, "fill"), fill);
    gl->Uniform1f(program_uniform(gl, s->program, "step_x"), step);
    gl->Uniform1f(program_uniform(gl, s->program, "layer"), (float)(layer + 1));
    gl->BindTexture(GL_TEXTURE_2D_ARRAY, s->fibres);
    gl->BindVertexArray(s->vao);
    transparency_begin(gl, s->transparency, s->sample_count, STEP_ALONE);
    gl->DrawArrays(GL_TRIANGLES, 0, 3);
    transparency_end(gl);
}

// Mean alpha of what was drawn; clears it.
static double mean_alpha(const Square* s)
{
    static float rgba[SIDE * SIDE * 4];
    gl->BindFramebuffer(GL_READ_FRAMEBUFFER, s->multisampled);
    gl->BindFramebuffer(GL_DRAW_FRAMEBUFFER, s->resolved);
    gl->BlitFramebuffer(0, 0, SIDE, SIDE, 0, 0, SIDE, SIDE, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    gl->BindTexture(GL_TEXTURE_2D, s->texture);
    gl->GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, rgba);
    gl->BindFramebuffer(GL_FRAMEBUFFER, s->multisampled);
    gl->Clear(GL_COLOR_BUFFER_BIT);
    double sum = 0;
    for (int i = 0; i < SIDE * SIDE; ++i)
        sum += (double)rgba[4 * i + 3];
    return sum / (SIDE * SIDE);
}

static void hashed_masks_keep_the_share_that_is_covered(void** state)
{
    (void)state;
    Square square = open_square(TRANSPARENCY_HASH, 4);
    for (int percent = 1; percent <= 100; percent += 3) {
        draw_layer(&square, 0.01f * (float)percent, 0.11f, percent);
        assert_close(mean_alpha(&square), 0.01 * percent, 0.005, "share of samples");
    }
    close_square(&square);
}

// The fill at which the first texel of the pattern is half covered.
static float half_fill(void)
{
    static unsigned char ranks[FIBRES_SIZE * FIBRES_SIZE], hairs[FIBRES_SIZE * FIBRES_SIZE];
    assert_true(fibres_ranks(ranks, hairs, 0));
    return 1.0f - (float)ranks[0] / 255.0f;
}

static double three_layers(Transparency transparency, int samples, float fill, float step)
{
    Square square = open_square(transparency, samples);
    draw_layer(&square, fill, step, 0);
    assert_close(mean_alpha(&square), 0.5, 0.005, "one layer of 0.5");
    for (int layer = 0; layer < 3; ++layer)
        draw_layer(&square, fill, step, layer);
    double alpha = mean_alpha(&square);
    close_square(&square);
    return alpha;
}

static void three_layers_of_a_half_cover_seven_eighths(void** state)
{
    (void)state;
    assert_close(three_layers(TRANSPARENCY_HASH, 4, 0.5f, 0.11f), 0.875, 0.01, "hash");
    assert_close(three_layers(TRANSPARENCY_BLEND, 4, half_fill(), 0.0f), 0.875, 0.01, "blend");
    // GL's own masks need not accumulate, and llvmpipe's never do: why hash is the default. (It
    // rounds up, so that the alpha of 0.4 here keeps two of four samples.)
    double fixed = three_layers(TRANSPARENCY_COVERAGE, 4, half_fill() - 0.002f, 0.0f);
    if (gl->software) assert_close(fixed, 0.5, 0.01, "coverage");
}

// --- pictures

typedef struct Stage {
    Drawing drawing;
    GuidesView view;
    Image image;
} Stage;

static void open_stage(Stage* stage, const Gl* with, const ShadeOptions* options,
                       const CameraOptions* camera)
{
    Fault fault = {""};
    memset(stage, 0, sizeof *stage);
    stage->view = drawing_view(bob);
    drawing_put_tick(&stage->view, bob, 0, 0, 0.0f);
    if (!draw_create(&stage->drawing, with, options, camera, &fault) ||
        !draw_set_style(&stage->drawing, bob, 7, 1, &fault) ||
        !image_create(&stage->image, options->width, options->height, &fault))
        fail_msg("%s", fault.text);
}

static void draw_stage(Stage* stage)
{
    stage->drawing.moved = true;
    assert_true(draw_picture(&stage->drawing, &stage->view, &stage->image));
}

static void close_stage(Stage* stage)
{
    draw_free(&stage->drawing);
    guides_view_free(&stage->view);
    image_free(&stage->image);
}

static double covered_share(Transparency transparency, int samples, int width, int height)
{
    ShadeOptions options = shade_default();
    options.width = width;
    options.height = height;
    options.samples = samples;
    options.transparency = transparency;
    options.view = VIEW_COVERAGE;
    CameraOptions camera = camera_default();
    camera.has_distance = true;
    camera.distance_m = 7.0f;
    camera.fov_deg = 4.0f;
    Stage stage;
    open_stage(&stage, gl, &options, &camera);
    draw_stage(&stage);
    double share = draw_hair_pixels(&stage.image) / (width * height);
    close_stage(&stage);
    return share;
}

// The same eye, and pixels of 1.1 mm and of 8 mm: only how finely hair is seen differs.
static void hair_covers_the_same_from_close_and_from_far(void** state)
{
    (void)state;
    static const struct {
        Transparency transparency;
        int samples;
    } variants[] = {{TRANSPARENCY_TEST, 1},
                    {TRANSPARENCY_COVERAGE, 4},
                    {TRANSPARENCY_HASH, 4},
                    {TRANSPARENCY_BLEND, 1},
                    {TRANSPARENCY_BLEND, 4}};
    for (size_t i = 0; i < sizeof variants / sizeof variants[0]; ++i) {
        need_samples(variants[i].samples);
        Transparency t = variants[i].transparency;
        double close = covered_share(t, variants[i].samples, 576, 432);
        double far = covered_share(t, variants[i].samples, 80, 60);
        print_message("%s, %d samples: %.4f close, %.4f far: %+.1f %%\n",
                      transparency_variants[t].name, variants[i].samples, close, far,
                      100 * (far / close - 1));
        if (fabs(far / close - 1) >= 0.05)
            fail_msg("%s covers %.4f close and %.4f far", transparency_variants[t].name, close,
                     far);
    }
}

static void depth_first_changes_no_picture_but_where_hairs_tie(void** state)
{
    (void)state;
    need_samples(4);
    static const Transparency variants[] = {TRANSPARENCY_TEST, TRANSPARENCY_COVERAGE,
                                            TRANSPARENCY_HASH};
    ShadeOptions options = shade_default();
    options.width = 240;
    options.height = 180;
    CameraOptions camera = camera_default();
    for (int i = 0; i < 3; ++i) {
        Stage once, twice;
        options.transparency = variants[i];
        options.pre_z = false;
        open_stage(&once, gl, &options, &camera);
        draw_stage(&once);
        options.pre_z = true;
        open_stage(&twice, gl, &options, &camera);
        draw_stage(&twice);
        assert_int_equal(twice.drawing.draw_calls, once.drawing.draw_calls + 1);
        int changed = 0;
        for (int p = 0; p < 240 * 180; ++p)
            changed += memcmp(once.image.rgba + 4 * p, twice.image.rgba + 4 * p, 4) != 0;
        if (changed > 240 * 180 / 500)
            fail_msg("%s: %d pixels changed", transparency_variants[variants[i]].name, changed);
        close_stage(&once);
        close_stage(&twice);
    }
}

// --- sorting

static void sorted_strips_are_all_strips_and_the_far_ones_come_first(void** state)
{
    (void)state;
    Fault fault = {""};
    Gl* null = gl_open("null", NULL, &fault);
    ShadeOptions options = shade_default();
    CameraOptions camera = camera_default();
    Stage stage;
    open_stage(&stage, null, &options, &camera);
    drawing_put_tick(&stage.view, bob, 1, 3, 0.4f);
    Hair* hair = &stage.drawing.hair;
    const Ribbons* ribbons = &hair->ribbons;
    const Vec3 eye = {0.3f, 0.3f, 0.4f};
    Vec3* along = hairstyle_rest_tangents(bob);
    for (int by = 0; by < ORDER_KINDS; ++by) {
        order_sort(&hair->order, null, ribbons, bob, &stage.view, eye, (OrderBy)by, true);
        int items = by == ORDER_WISPS ? ribbons->ribbon_count
                                      : ribbons->point_count - ribbons->ribbon_count;
        int most = by == ORDER_WISPS ? ribbons->index_count : 5 * items;
        assert_int_equal(hair->order.count[by], items);
        assert_int_equal(hair->order.index_count, most);
        uint8_t* seen = test_calloc((size_t)ribbons->point_count, 1);
        double before = 1e9;
        for (int i = 0, start = 0; i < most; ++i) {
            uint32_t index = hair->order.indices[i];
            if (index != RIBBONS_RESTART) {
                ++seen[index / 2];
                continue;
            }
            // Where its middle is, by the positions that order.c took and by none of its sums.
            uint32_t first = hair->order.indices[start] / 2;
            uint32_t points = (uint32_t)(i - start) / 2;
            Vec3 middle = vec3_scale(vec3_add(hair->order.points[first + (points - 1) / 2],
                                              hair->order.points[first + points / 2]),
                                     0.5f);
            double distance = (double)vec3_length(vec3_sub(middle, eye));
            assert_true(distance <= before + 2e-5); // a step of the keys
            before = distance;
            start = i + 1;
        }
        for (int p = 0; p < ribbons->point_count; ++p)
            assert_in_range(seen[p], 2, by == ORDER_WISPS ? 2 : 4);
        test_free(seen);
    }
    free(along);
    close_stage(&stage);
    gl_close(null);
}

// Offsets are not turned, guides are straight between nodes: what that costs against the drawn
// place.
static void sorted_places_are_within_a_wisp_of_the_drawn_ones(void** state)
{
    (void)state;
    Fault fault = {""};
    Gl* null = gl_open("null", NULL, &fault);
    ShadeOptions options = shade_default();
    CameraOptions camera = camera_default();
    Stage stage;
    open_stage(&stage, null, &options, &camera);
    drawing_put_tick(&stage.view, bob, 1, 3, 0.4f);
    Hair* hair = &stage.drawing.hair;
    order_sort(&hair->order, null, &hair->ribbons, bob, &stage.view, vec3(0, 0, 1), ORDER_WISPS,
               true);
    int nodes = bob->guide_count * bob->nodes;
    Vec3* at = test_malloc((size_t)nodes * sizeof *at);
    Vec3* along = test_malloc((size_t)nodes * sizeof *along);
    Vec3* rest_along = hairstyle_rest_tangents(bob);
    for (int i = 0; i < nodes; ++i) {
        at[i] = dequantise_position(stage.view.positions[1] + 3 * i, &bob->box);
        for (int k = 0; k < 3; ++k)
            (&along[i].x)[k] = (float)stage.view.tangents[1][3 * i + k] / 32767.0f;
    }
    double squares = 0;
    for (int i = 0; i < hair->ribbons.point_count; ++i) {
        DrawnPoint point = ribbons_point(&hair->ribbons, i);
        Vec3d drawn = drawn_position(&point, bob->nodes, at, along, rest_along, NULL);
        Vec3 off = vec3_sub(vec3_from(drawn), hair->order.points[i]);
        squares += (double)vec3_dot(off, off);
    }
    double rms_m = sqrt(squares / hair->ribbons.point_count);
    print_message("bent hair is sorted as if %.2f mm from where it is drawn\n", 1e3 * rms_m);
    assert_true(rms_m < 0.004);
    free(rest_along);
    test_free(at);
    test_free(along);
    close_stage(&stage);
    gl_close(null);
}

static void sorting_allocates_nothing(void** state)
{
    (void)state;
    Fault fault = {""};
    Gl* null = gl_open("null", NULL, &fault);
    ShadeOptions options = shade_default();
    options.transparency = TRANSPARENCY_BLEND;
    options.width = options.height = 32;
    CameraOptions camera = camera_default();
    Stage stage;
    open_stage(&stage, null, &options, &camera);
    draw_stage(&stage);
    int before = allocations;
    for (int i = 0; i < 5; ++i)
        draw_stage(&stage);
    if (COUNTS_ALLOCATIONS) assert_int_equal(allocations, before);
    close_stage(&stage);
    gl_close(null);
}

// --- a camera inside the hair

// The largest radiance of a picture; fails where any is not a number or below 0.
static float largest_radiance(const Stage* stage)
{
    static float rgba[160 * 120 * 4];
    gl->BindTexture(GL_TEXTURE_2D, stage->drawing.shade.resolved_texture);
    gl->GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, rgba);
    float most = 0.0f;
    for (int i = 0; i < 160 * 120 * 4; ++i) {
        if (!(rgba[i] >= 0.0f && rgba[i] < 1e6f))
            fail_msg("pixel %d is %g", i / 4, (double)rgba[i]);
        if (i % 4 != 3) most = fmaxf(most, rgba[i]);
        if (i % 4 == 3 && !(rgba[i] <= 1.001f)) fail_msg("coverage %g", (double)rgba[i]);
    }
    return most;
}

// Every number that the passes before left, of every point.
static void expect_finite_points(const Stage* stage)
{
    const Hair* hair = &stage->drawing.hair;
    size_t texels = (size_t)hair->update.rows * UPDATE_WIDTH;
    Texel* at = test_malloc(texels * sizeof *at);
    for (int target = 0; target < LIGHT_TARGETS; ++target) {
        gl->BindTexture(GL_TEXTURE_2D, stage->drawing.light.targets[target]);
        gl->GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, at);
        for (int i = 0; i < 4 * hair->update.point_count; ++i)
            if (!isfinite(at[i / 4][i % 4])) fail_msg("light of point %d is not a number", i / 4);
    }
    test_free(at);
}

// Ribbon point `i` at rest as the GPU has it, or one after it that the camera can stand on exactly.
static Vec3 exact_place(const Stage* stage, int* i)
{
    const Hair* hair = &stage->drawing.hair;
    size_t texels = (size_t)hair->update.rows * UPDATE_WIDTH;
    Texel* at = test_malloc(texels * sizeof *at);
    gl->BindTexture(GL_TEXTURE_2D, hair->update.targets[UPDATE_POSITIONS]);
    gl->GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, at);
    volatile float back = 0.0f;
    for (; *i < hair->update.point_count; ++*i) {
        back = at[*i][2] - 0.05f;
        if (back + 0.05f == at[*i][2]) break;
    }
    assert_true(*i < hair->update.point_count);
    Vec3 place = vec3(at[*i][0], at[*i][1], at[*i][2]);
    test_free(at);
    return place;
}

static void a_camera_inside_the_hair_sees_no_spike_and_no_nan(void** state)
{
    (void)state;
    need_samples(4);
    static const Transparency variants[] = {TRANSPARENCY_HASH, TRANSPARENCY_BLEND};
    ShadeOptions options = shade_default();
    options.width = 160;
    options.height = 120;
    for (int v = 0; v < 2; ++v) {
        options.transparency = variants[v];
        CameraOptions camera = camera_default();
        Stage stage;
        open_stage(&stage, gl, &options, &camera);
        draw_stage(&stage);
        float usual = largest_radiance(&stage);
        camera.has_target = camera.has_distance = true;
        camera.distance_m = 0.05f;
        camera.yaw_deg = camera.pitch_deg = 0.0f;
        for (int i = 700; i < stage.drawing.hair.update.point_count; i += 4001) {
            Vec3 place = exact_place(&stage, &i); // on a hair, to the bit
            camera.target = vec3(place.x, place.y, place.z - 0.05f);
            stage.drawing.camera = camera;
            draw_stage(&stage);
            expect_finite_points(&stage);
            float most = largest_radiance(&stage);
            if (most > 2.0f * usual)
                fail_msg("radiance %g from inside, %g from outside", (double)most, (double)usual);
        }
        close_stage(&stage);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_mip_level_covers_what_the_fill_says),
        cmocka_unit_test(hashed_masks_keep_the_share_that_is_covered),
        cmocka_unit_test(three_layers_of_a_half_cover_seven_eighths),
        cmocka_unit_test(hair_covers_the_same_from_close_and_from_far),
        cmocka_unit_test(depth_first_changes_no_picture_but_where_hairs_tie),
        cmocka_unit_test(sorted_strips_are_all_strips_and_the_far_ones_come_first),
        cmocka_unit_test(sorted_places_are_within_a_wisp_of_the_drawn_ones),
        cmocka_unit_test(sorting_allocates_nothing),
        cmocka_unit_test(a_camera_inside_the_hair_sees_no_spike_and_no_nan),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
