// Pictures: what is uploaded and drawn for them, that back ends agree on them to the bit, and how
// close the imported groom comes to the path-traced masks.
#include "client/draw.h"
#include "client/stats.h"
#include "messages/style.h"
#include "tests/drawing.h"
#include "tests/inbound.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <jansson.h>

#define WIDTH  160
#define HEIGHT 120
#define BYTES  (WIDTH * HEIGHT * 4)

// Mesa 22.3's OSMesaDestroyContext forgets its default framebuffer (see test_gl.c).
const char* __lsan_default_suppressions(void);
const char* __lsan_default_suppressions(void)
{
    return "leak:libOSMesa.so";
}

// --- allocations asked for by our own code: callers inside this executable, not drivers

static int64_t own_allocations;

#ifdef __SANITIZE_ADDRESS__
#define COUNTS_ALLOCATIONS 0
#else
#define COUNTS_ALLOCATIONS 1
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* old, size_t size);
extern const char __executable_start, etext;

static void count_own(const void* caller)
{
    own_allocations += (uintptr_t)caller >= (uintptr_t)&__executable_start &&
                       (uintptr_t)caller < (uintptr_t)&etext;
}

void* malloc(size_t size)
{
    count_own(__builtin_return_address(0));
    return __libc_malloc(size);
}

void* calloc(size_t count, size_t size)
{
    count_own(__builtin_return_address(0));
    return __libc_calloc(count, size);
}

void* realloc(void* old, size_t size)
{
    count_own(__builtin_return_address(0));
    return __libc_realloc(old, size);
}
#endif

// --- a stage: context, style, drawing, view, picture

typedef struct Stage {
    Gl* gl;
    const Hairstyle* style;
    Drawing drawing;
    GuidesView view;
    Image image;
} Stage;

static ShadeOptions small_picture(ShadeView view)
{
    ShadeOptions options = shade_default();
    options.width = WIDTH;
    options.height = HEIGHT;
    options.view = view;
    return options;
}

static bool stage_open(Stage* stage, const char* backend, const Hairstyle* style,
                       ShadeOptions options, CameraOptions camera)
{
    Fault fault = {""};
    memset(stage, 0, sizeof *stage);
    stage->gl = drawing_open(backend);
    if (stage->gl == NULL) return false;
    stage->style = style;
    stage->view = drawing_view(style);
    if (!draw_create(&stage->drawing, stage->gl, &options, &camera, &fault) ||
        !draw_set_style(&stage->drawing, style, 7, 1, &fault) ||
        !image_create(&stage->image, options.width, options.height, &fault))
        fail_msg("%s", fault.text);
    return true;
}

static void stage_close(Stage* stage)
{
    Fault fault = {""};
    if (!gl_check(stage->gl, "drawing", &fault)) fail_msg("%s", fault.text);
    draw_free(&stage->drawing);
    guides_view_free(&stage->view);
    image_free(&stage->image);
    gl_close(stage->gl);
}

static void must_draw(Stage* stage)
{
    assert_true(draw_picture(&stage->drawing, &stage->view, &stage->image));
}

// Any real one; else the test is skipped.
static Stage open_any(const Hairstyle* style, ShadeView view)
{
    Stage stage;
    if (stage_open(&stage, "osmesa", style, small_picture(view), camera_default()) ||
        stage_open(&stage, "egl", style, small_picture(view), camera_default()))
        return stage;
    skip();
    return stage;
}

// `bob` without its head, which takes a second to make; `long_hair` with it.
static Hairstyle *bob, *long_hair;

static int grow_styles(void** state)
{
    (void)state;
    bob = drawing_style("bob");
    bob->head_kind = HEAD_NONE;
    long_hair = drawing_style("long");
    return 0;
}

static int free_styles(void** state)
{
    (void)state;
    hairstyle_destroy(bob);
    hairstyle_destroy(long_hair);
    return 0;
}

// --- what is uploaded and drawn

static void a_new_tick_uploads_12_bytes_a_node_and_nothing_else_does(void** state)
{
    (void)state;
    Stage stage = open_any(bob, VIEW_SHADED);
    int64_t tick_bytes = 12 * bob->guide_count * bob->nodes;
    for (int tick = 0; tick < 3; ++tick) {
        drawing_put_tick(&stage.view, bob, tick, (uint32_t)tick, 0.2f);
        must_draw(&stage);
        assert_int_equal(stage.drawing.uploaded_bytes, (tick + 1) * tick_bytes);
    }
    int64_t calls = stage.drawing.draw_calls, frames = stage.drawing.frames;
    uint8_t* before = test_malloc(BYTES);
    memcpy(before, stage.image.rgba, BYTES);
    must_draw(&stage);
    assert_int_equal(stage.drawing.uploaded_bytes, 3 * tick_bytes);
    assert_int_equal(stage.drawing.draw_calls, calls);
    assert_int_equal(stage.drawing.frames, frames + 1);
    assert_memory_equal(stage.image.rgba, before, BYTES);
    test_free(before);
    stage_close(&stage);
}

static void one_new_row_uploads_one_row(void** state)
{
    (void)state;
    Stage stage = open_any(bob, VIEW_SHADED);
    drawing_put_tick(&stage.view, bob, 0, 0, 0.0f);
    must_draw(&stage);
    int64_t bytes = stage.drawing.uploaded_bytes, calls = stage.drawing.draw_calls;
    Vec3 nodes[HAIRSTYLE_MAX_NODES];
    drawing_bend(nodes, bob, 5, 1, 0.5f);
    drawing_put_row(&stage.view, bob, 5, 1, nodes);
    must_draw(&stage);
    assert_int_equal(stage.drawing.uploaded_bytes - bytes, 12 * bob->nodes);
    assert_true(stage.drawing.draw_calls > calls);
    stage_close(&stage);
}

static int real_draws;
static void(APIENTRYP real_arrays)(GLenum, GLint, GLsizei);
static void(APIENTRYP real_elements)(GLenum, GLsizei, GLenum, const void*);

static void APIENTRY counted_arrays(GLenum mode, GLint first, GLsizei count)
{
    ++real_draws;
    real_arrays(mode, first, count);
}

static void APIENTRY counted_elements(GLenum mode, GLsizei count, GLenum type, const void* at)
{
    ++real_draws;
    real_elements(mode, count, type, at);
}

static void draw_calls_are_the_calls_made(void** state)
{
    (void)state;
    Stage stage;
    assert_true(
        stage_open(&stage, "null", long_hair, small_picture(VIEW_SHADED), camera_default()));
    real_arrays = stage.gl->DrawArrays;
    real_elements = stage.gl->DrawElements;
    stage.gl->DrawArrays = counted_arrays;
    stage.gl->DrawElements = counted_elements;
    real_draws = 0;
    for (int tick = 0; tick < 3; ++tick) {
        drawing_put_tick(&stage.view, long_hair, tick, 0, 0.0f);
        must_draw(&stage);
        assert_int_equal(stage.drawing.draw_calls, real_draws);
    }
    assert_true(real_draws > 0);
    stage_close(&stage);
}

// The passes of a picture, by their draw calls: update 1, shadow 3 (deep), light 1, shade 4.
static void shadows_stay_while_only_the_camera_moves(void** state)
{
    (void)state;
    Stage stage;
    assert_true(
        stage_open(&stage, "null", long_hair, small_picture(VIEW_SHADED), camera_default()));
    drawing_put_tick(&stage.view, long_hair, 0, 0, 0.0f);
    must_draw(&stage);
    assert_int_equal(stage.drawing.draw_calls, 9);
    CameraOptions camera = camera_default();
    camera.yaw_deg = 80;
    draw_set_camera(&stage.drawing, &camera);
    must_draw(&stage);
    assert_int_equal(stage.drawing.draw_calls, 9 + 5);
    draw_set_light(&stage.drawing, 10, 20);
    must_draw(&stage);
    assert_int_equal(stage.drawing.draw_calls, 9 + 5 + 8);
    must_draw(&stage);
    assert_int_equal(stage.drawing.draw_calls, 9 + 5 + 8);
    stage.view.pose.orientation = quat_normalise((Quat){0, 0.3, 0, 1});
    drawing_put_tick(&stage.view, long_hair, 1, 0, 0.0f);
    must_draw(&stage);
    assert_int_equal(stage.drawing.draw_calls, 9 + 5 + 8 + 9);
    stage_close(&stage);
}

// What moves piece by piece is what was there from the start.
static void a_camera_and_a_light_that_moved_draw_as_if_they_had_stood_there(void** state)
{
    (void)state;
    ShadeOptions options = small_picture(VIEW_SHADED);
    CameraOptions there = camera_default();
    there.yaw_deg = 200;
    Stage moved = open_any(bob, VIEW_SHADED), stood;
    drawing_put_tick(&moved.view, bob, 0, 0, 0.0f);
    must_draw(&moved);
    draw_set_camera(&moved.drawing, &there);
    must_draw(&moved);
    draw_set_light(&moved.drawing, 170, 30);
    must_draw(&moved);
    options.light_yaw_deg = 170;
    options.light_pitch_deg = 30;
    assert_true(stage_open(&stood, moved.gl->backend, bob, options, there));
    drawing_put_tick(&stood.view, bob, 0, 0, 0.0f);
    must_draw(&stood);
    assert_memory_equal(moved.image.rgba, stood.image.rgba, BYTES);
    stage_close(&stood);
    assert_true(gl_make_current(moved.gl));
    stage_close(&moved);
}

// Grey is the share of key light that arrives; without shadows all of it does.
static void transmittance_view_shows_the_share_of_light_that_arrives(void** state)
{
    (void)state;
    const char* const methods[] = {"none", "depth", "opacity", "deep"};
    for (int m = 0; m < 4; ++m) {
        Stage stage;
        ShadeOptions options = small_picture(VIEW_TRANSMITTANCE);
        options.shadow.method = shadow_find_method(methods[m]);
        if (!stage_open(&stage, "egl", long_hair, options, camera_default()) &&
            !stage_open(&stage, "osmesa", long_hair, options, camera_default()))
            skip();
        drawing_put_tick(&stage.view, long_hair, 0, 0, 0.0f);
        must_draw(&stage);
        int full = 0, part = 0, none = 0;
        for (int i = 0; i < WIDTH * HEIGHT; ++i) {
            const uint8_t* c = stage.image.rgba + 4 * i;
            assert_true(c[0] == c[1] && c[1] == c[2]);
            if (c[3] != 255) continue; // all hair
            full += c[0] == 255, part += c[0] > 0 && c[0] < 255, none += c[0] == 0;
        }
        printf("%s: of hair pixels %d in full light, %d in part, %d in none\n", methods[m], full,
               part, none);
        assert_true(m == 0 ? full > 100 && part == 0 && none == 0 : part > 100);
        stage_close(&stage);
    }
}

static void nothing_is_drawn_before_there_is_a_style(void** state)
{
    (void)state;
    Stage stage;
    Fault fault = {""};
    assert_true(stage_open(&stage, "null", bob, small_picture(VIEW_SHADED), camera_default()));
    Drawing bare;
    CameraOptions camera = camera_default();
    ShadeOptions options = small_picture(VIEW_SHADED);
    assert_true(draw_create(&bare, stage.gl, &options, &camera, &fault));
    assert_false(draw_picture(&bare, &stage.view, &stage.image));
    draw_free(&bare);
    stage_close(&stage);
}

// --- pictures

static void egl_and_osmesa_draw_the_same_picture(void** state)
{
    (void)state;
    Stage a, b;
    ShadeOptions options = small_picture(VIEW_SHADED);
    if (!stage_open(&a, "osmesa", long_hair, options, camera_default())) skip();
    bool both = stage_open(&b, "egl", long_hair, options, camera_default());
    bool same_driver = both && b.gl->software;
    if (both && !same_driver) printf("SKIPPED: EGL is %s, not llvmpipe\n", b.gl->renderer);
    Pose pose = {{0, 0, 0}, quat_normalise((Quat){0.1, 0.2, 0.05, 1})};
    if (same_driver) {
        drawing_put_tick(&b.view, long_hair, 0, 3, 0.3f);
        b.view.pose = pose;
        must_draw(&b);
    }
    assert_true(gl_make_current(a.gl));
    drawing_put_tick(&a.view, long_hair, 0, 3, 0.3f);
    a.view.pose = pose;
    must_draw(&a);
    if (same_driver) assert_memory_equal(a.image.rgba, b.image.rgba, BYTES);
    stage_close(&a);
    if (both) assert_true(gl_make_current(b.gl));
    if (both) stage_close(&b);
    if (!same_driver) skip();
}

static void another_tick_or_pose_is_another_picture(void** state)
{
    (void)state;
    Stage stage = open_any(bob, VIEW_SHADED);
    uint8_t* before = test_malloc(BYTES);
    drawing_put_tick(&stage.view, bob, 0, 0, 0.0f);
    must_draw(&stage);
    memcpy(before, stage.image.rgba, BYTES);
    drawing_put_tick(&stage.view, bob, 1, 1, 0.5f);
    must_draw(&stage);
    assert_memory_not_equal(before, stage.image.rgba, BYTES);
    drawing_put_tick(&stage.view, bob, 2, 0, 0.0f); // as tick 0: the same picture again
    must_draw(&stage);
    assert_memory_equal(before, stage.image.rgba, BYTES);
    drawing_put_tick(&stage.view, bob, 3, 0, 0.0f);
    stage.view.pose.orientation = quat_normalise((Quat){0, 0.3, 0, 1});
    must_draw(&stage);
    assert_memory_not_equal(before, stage.image.rgba, BYTES);
    // Where the head is, however far, changes nothing: the camera goes with it.
    drawing_put_tick(&stage.view, bob, 4, 0, 0.0f);
    stage.view.pose = (Pose){{100e3, 5, -3e6}, quat_identity()};
    must_draw(&stage);
    assert_memory_equal(before, stage.image.rgba, BYTES);
    test_free(before);
    stage_close(&stage);
}

static void coverage_view_shows_the_alpha_of_the_shaded_view(void** state)
{
    (void)state;
    Stage shaded = open_any(long_hair, VIEW_SHADED);
    drawing_put_tick(&shaded.view, long_hair, 0, 0, 0.0f);
    must_draw(&shaded);
    Stage cover = open_any(long_hair, VIEW_COVERAGE);
    drawing_put_tick(&cover.view, long_hair, 0, 0, 0.0f);
    must_draw(&cover);
    double pixels = draw_hair_pixels(&shaded.image), sum = 0;
    for (int i = 0; i < WIDTH * HEIGHT; ++i) {
        const uint8_t *s = shaded.image.rgba + 4 * i, *c = cover.image.rgba + 4 * i;
        assert_int_equal(s[3], c[3]);
        assert_true(c[0] == c[3] && c[1] == c[3] && c[2] == c[3]);
        sum += s[3] / 255.0;
    }
    assert_true(fabs(sum - pixels) < 1e-6);
    printf("long: %.0f hair pixels of %d\n", pixels, WIDTH * HEIGHT);
    assert_true(pixels > 0.01 * WIDTH * HEIGHT && pixels < 0.6 * WIDTH * HEIGHT);
    assert_true(draw_hair_pixels(&cover.image) == pixels);
    stage_close(&cover);
    assert_true(gl_make_current(shaded.gl));
    stage_close(&shaded);
}

static void null_back_end_makes_the_same_calls_and_leaves_the_picture(void** state)
{
    (void)state;
    Stage real = open_any(bob, VIEW_SHADED), null;
    drawing_put_tick(&real.view, bob, 0, 0, 0.0f);
    must_draw(&real);
    assert_true(stage_open(&null, "null", bob, small_picture(VIEW_SHADED), camera_default()));
    memset(null.image.rgba, 9, BYTES);
    drawing_put_tick(&null.view, bob, 0, 0, 0.0f);
    must_draw(&null);
    assert_int_equal(null.drawing.draw_calls, real.drawing.draw_calls);
    assert_int_equal(null.drawing.uploaded_bytes, real.drawing.uploaded_bytes);
    for (int i = 0; i < BYTES; ++i)
        assert_int_equal(null.image.rgba[i], 9);
    stage_close(&null);
    assert_true(gl_make_current(real.gl));
    stage_close(&real);
}

static void one_sample_draws_too(void** state)
{
    (void)state;
    Stage stage;
    ShadeOptions options = small_picture(VIEW_SHADED);
    options.samples = 1;
    if (!stage_open(&stage, "osmesa", bob, options, camera_default())) skip();
    drawing_put_tick(&stage.view, bob, 0, 0, 0.0f);
    must_draw(&stage);
    for (int i = 3; i < BYTES; i += 4)
        assert_true(stage.image.rgba[i] == 0 || stage.image.rgba[i] == 255);
    assert_true(draw_hair_pixels(&stage.image) > 0.03 * WIDTH * HEIGHT);
    stage_close(&stage);
}

// --- styles that lack something

// Before any row has come, too: where it was combed.
static void style_is_drawn_at_rest_before_any_row(void** state)
{
    (void)state;
    Stage stage = open_any(bob, VIEW_SHADED);
    must_draw(&stage);
    assert_true(draw_hair_pixels(&stage.image) > 0.03 * WIDTH * HEIGHT);
    assert_int_equal(stage.drawing.uploaded_bytes, 0);
    stage_close(&stage);
}

static void style_without_a_head_is_drawn(void** state)
{
    (void)state;
    Hairstyle* style = inbound_style(1, 0);
    assert_int_equal(style->head_kind, HEAD_NONE);
    Stage stage = open_any(style, VIEW_SHADED);
    drawing_put_tick(&stage.view, style, 0, 0, 0.0f);
    must_draw(&stage);
    assert_true(draw_hair_pixels(&stage.image) > 1.0);
    stage_close(&stage);
    hairstyle_destroy(style);
}

// The fast lane alone draws what it has; the bulk lane then brings the rest as a new version.
static void style_without_its_bulk_lane_draws_what_it_has(void** state)
{
    (void)state;
    Fault fault = {""};
    StyleBytes bytes = inbound_style_bytes(3, 60);
    size_t bulk_size;
    uint64_t bulk_hash;
    Hairstyle* style = style_decode_fast(bytes.lane[STYLE_FAST], bytes.size[STYLE_FAST], &bulk_size,
                                         &bulk_hash, &fault);
    assert_non_null(style);
    assert_null(style->strands);
    Stage stage = open_any(style, VIEW_SHADED);
    drawing_put_tick(&stage.view, style, 0, 0, 0.0f);
    must_draw(&stage);
    assert_true(draw_hair_pixels(&stage.image) == 0.0);
    int64_t uploaded = stage.drawing.uploaded_bytes;

    assert_true(style_decode_bulk(style, bytes.lane[STYLE_BULK], bytes.size[STYLE_BULK], &fault));
    assert_true(draw_set_style(&stage.drawing, style, 7, 2, &fault));
    must_draw(&stage); // no new tick: what is held is shown on the new style
    assert_true(draw_hair_pixels(&stage.image) > 1.0);
    assert_int_equal(stage.drawing.uploaded_bytes - uploaded, 12 * style->guide_count * 8);
    stage_close(&stage);
    style_bytes_free(&bytes);
    hairstyle_destroy(style);
}

static void same_style_again_costs_nothing(void** state)
{
    (void)state;
    Fault fault = {""};
    Stage stage = open_any(bob, VIEW_SHADED);
    drawing_put_tick(&stage.view, bob, 0, 0, 0.0f);
    must_draw(&stage);
    GLuint table = stage.drawing.hair.update.tables[0];
    int64_t calls = stage.drawing.draw_calls;
    assert_true(draw_set_style(&stage.drawing, bob, 7, 1, &fault));
    must_draw(&stage);
    assert_int_equal(stage.drawing.draw_calls, calls);
    assert_int_equal(stage.drawing.hair.update.tables[0], table);
    stage_close(&stage);
}

// --- steady state

static void counter_sees_our_own_allocations(void** state)
{
    (void)state;
    if (!COUNTS_ALLOCATIONS) skip();
    Image image;
    Fault fault = {""};
    int64_t before = own_allocations;
    assert_true(image_create(&image, 8, 8, &fault)); // of a library linked in
    assert_int_equal(own_allocations - before, 1);
    image_free(&image);
}

static void steady_state_allocates_nothing(void** state)
{
    (void)state;
    if (!COUNTS_ALLOCATIONS) {
        printf("SKIPPED: the sanitizer owns malloc\n");
        skip();
    }
    Fault fault = {""};
    Stage stage = open_any(bob, VIEW_SHADED);
    stage.drawing.timed = true;
    int64_t began = 0;
    for (int tick = 0; tick < 4; ++tick) {
        drawing_put_tick(&stage.view, bob, tick, (uint32_t)tick, 0.2f);
        if (tick == 1) began = own_allocations;
        assert_true(draw_set_style(&stage.drawing, bob, 7, 1, &fault));
        must_draw(&stage);
        must_draw(&stage);
        draw_hair_pixels(&stage.image);
    }
    assert_int_equal(own_allocations, began);
    stage_close(&stage);
}

static void table_of_a_fibre_is_made_anew_without_an_allocation(void** state)
{
    (void)state;
    if (!COUNTS_ALLOCATIONS) {
        printf("SKIPPED: the sanitizer owns malloc\n");
        skip();
    }
    ShadeOptions options = small_picture(VIEW_SHADED);
    options.shading.kind = SHADING_MARSCHNER;
    Stage stage;
    if (!stage_open(&stage, "osmesa", bob, options, camera_default()) &&
        !stage_open(&stage, "egl", bob, options, camera_default()))
        skip();
    int64_t began = 0;
    for (int tick = 0; tick < 4; ++tick) {
        drawing_put_tick(&stage.view, bob, tick, (uint32_t)tick, 0.2f);
        stage.drawing.light.shading.options.fibre.beta_deg = 5.0 + tick / 2;
        if (tick == 1) began = own_allocations;
        must_draw(&stage);
    }
    assert_int_equal(own_allocations, began);
    assert_int_equal(stage.drawing.light.shading.tables_made, 2);
    stage_close(&stage);
}

// The colour that was asked for, and no other, is seen in the picture.
static void hair_takes_the_colour_that_is_asked_for(void** state)
{
    (void)state;
    double red[2] = {0, 0}, green[2] = {0, 0};
    for (int i = 0; i < 2; ++i) {
        ShadeOptions options = small_picture(VIEW_SHADED);
        options.shading.kind = SHADING_MARSCHNER;
        options.has_colour = true;
        options.colour = i == 0 ? 0 : 3; // blond, red
        Stage stage;
        if (!stage_open(&stage, "osmesa", bob, options, camera_default()) &&
            !stage_open(&stage, "egl", bob, options, camera_default()))
            skip();
        drawing_put_tick(&stage.view, bob, 0, 1, 0.0f);
        must_draw(&stage);
        for (int p = 0; p < WIDTH * HEIGHT; ++p)
            if (stage.image.rgba[4 * p + 3] == 255) {
                red[i] += stage.image.rgba[4 * p];
                green[i] += stage.image.rgba[4 * p + 1];
            }
        stage_close(&stage);
    }
    assert_true(green[0] > 0.75 * red[0]);
    assert_true(green[1] < 0.60 * red[1] && green[1] > 0.0);
}

// --- statistics

static void stats_have_the_fixed_keys_and_true_counts(void** state)
{
    (void)state;
    static const char* const keys[] = {"renderer",   "version",     "backend",      "slot",
                                       "epoch",      "tick",        "payload_hash", "style_hash",
                                       "frames",     "bytes",       "datagrams",    "epoch_changes",
                                       "draw_calls", "hair_pixels", "passes"};
    Stage stage;
    Fault fault = {""};
    ReceiveCounters counters = {.datagrams = 11, .lost = 2, .bytes = 12345};
    assert_true(stage_open(&stage, "null", bob, small_picture(VIEW_SHADED), camera_default()));
    stage.drawing.timed = true;
    for (int tick = 0; tick < 3; ++tick) {
        drawing_put_tick(&stage.view, bob, tick, (uint32_t)tick, 0.2f);
        must_draw(&stage);
    }
    char path[64] = P_tmpdir "/test_draw.XXXXXX";
    close(mkstemp(path));
    if (!stats_write(path, &stage.drawing, &stage.view, &counters, 12.5, &fault))
        fail_msg("%s", fault.text);
    json_t* root = json_load_file(path, JSON_REJECT_DUPLICATES, NULL);
    assert_non_null(root);
    assert_int_equal(json_object_size(root), sizeof keys / sizeof *keys);
    for (size_t i = 0; i < sizeof keys / sizeof *keys; ++i)
        if (json_object_get(root, keys[i]) == NULL) fail_msg("no key %s", keys[i]);
    assert_int_equal(json_integer_value(json_object_get(root, "tick")), 2);
    assert_int_equal(json_integer_value(json_object_get(root, "draw_calls")),
                     stage.drawing.draw_calls);
    json_t* bytes = json_object_get(root, "bytes");
    assert_int_equal(json_integer_value(json_object_get(bytes, "received")), 12345);
    assert_int_equal(json_integer_value(json_object_get(bytes, "uploaded")),
                     3 * 12 * bob->guide_count * bob->nodes);
    char hash[20];
    snprintf(hash, sizeof hash, "%016llx",
             (unsigned long long)frame_payload_hash(stage.view.positions[0], stage.view.tangents[0],
                                                    bob->guide_count, bob->nodes));
    assert_string_equal(json_string_value(json_object_get(root, "payload_hash")), hash);
    json_t* passes = json_object_get(root, "passes");
    for (int pass = 0; pass < PASSES; ++pass)
        assert_true(json_real_value(json_object_get(json_object_get(passes, draw_pass_names[pass]),
                                                    "median_ms")) >= 0);
    json_decref(root);
    unlink(path);
    assert_false(
        stats_write("/nowhere/stats.json", &stage.drawing, &stage.view, &counters, 0, &fault));
    assert_non_null(strstr(fault.text, "--stats: cannot write /nowhere/stats.json: No such file"));
    stage_close(&stage);
}

// --- against the path-traced reference

// Acceptance asks for 0.35 and 0.70; hair three times too thick passes those (+32 %, 0.74).
#define WITHIN    0.15 // of the mask's sum
#define LEAST_IOU 0.75 // of pixels more than half covered

// The masks are linear and say so (gAMA 1); reading a PNG converts to sRGB.
static void check_mask(const char* name, float yaw_deg, const Hairstyle* style)
{
    char path[300];
    Image mask;
    Fault fault = {""};
    snprintf(path, sizeof path, DRAWING_ASSETS "reference/mask_%s.png", name);
    if (!image_read_png(&mask, path, &fault)) fail_msg("%s", fault.text);
    ShadeOptions options = shade_default();
    options.view = VIEW_COVERAGE;
    CameraOptions camera = {.has_target = true,
                            .has_distance = true,
                            .target = {0.0f, 0.216f, 0.0f},
                            .distance_m = 0.7f,
                            .yaw_deg = yaw_deg,
                            .pitch_deg = 5.0f,
                            .fov_deg = 45.0f};
    Stage stage;
    if (!stage_open(&stage, "osmesa", style, options, camera) &&
        !stage_open(&stage, "egl", style, options, camera))
        skip();
    assert_int_equal(mask.width, stage.image.width);
    assert_int_equal(mask.height, stage.image.height);
    drawing_put_tick(&stage.view, style, 0, 0, 0.0f);
    must_draw(&stage);
    int64_t both = 0, either = 0;
    double ours = 0, theirs = 0;
    for (int i = 0; i < mask.width * mask.height; ++i) {
        double a = stage.image.rgba[4 * i + 3], b = 255.0 * image_linear(mask.rgba[4 * i]);
        ours += a / 255.0, theirs += b / 255.0;
        both += a > 127.5 && b > 127.5;
        either += a > 127.5 || b > 127.5;
    }
    double ratio = ours / theirs, iou = (double)both / (double)either;
    printf("%s: %.0f hair pixels, the mask %.0f: %+.1f %%; IoU %.3f\n", name, ours, theirs,
           100.0 * (ratio - 1.0), iou);
    image_free(&mask);
    stage_close(&stage);
    assert_true(fabs(ratio - 1.0) <= WITHIN);
    assert_true(iou >= LEAST_IOU);
}

static void imported_groom_covers_what_the_path_traced_masks_cover(void** state)
{
    (void)state;
    Hairstyle* style = drawing_style("ponytail");
    if (style == NULL) skip();
    check_mask("front", 0.0f, style);
    check_mask("threequarter", 35.0f, style);
    check_mask("back", 180.0f, style);
    hairstyle_destroy(style);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_new_tick_uploads_12_bytes_a_node_and_nothing_else_does),
        cmocka_unit_test(one_new_row_uploads_one_row),
        cmocka_unit_test(draw_calls_are_the_calls_made),
        cmocka_unit_test(shadows_stay_while_only_the_camera_moves),
        cmocka_unit_test(a_camera_and_a_light_that_moved_draw_as_if_they_had_stood_there),
        cmocka_unit_test(transmittance_view_shows_the_share_of_light_that_arrives),
        cmocka_unit_test(nothing_is_drawn_before_there_is_a_style),
        cmocka_unit_test(egl_and_osmesa_draw_the_same_picture),
        cmocka_unit_test(another_tick_or_pose_is_another_picture),
        cmocka_unit_test(coverage_view_shows_the_alpha_of_the_shaded_view),
        cmocka_unit_test(null_back_end_makes_the_same_calls_and_leaves_the_picture),
        cmocka_unit_test(one_sample_draws_too),
        cmocka_unit_test(style_is_drawn_at_rest_before_any_row),
        cmocka_unit_test(style_without_a_head_is_drawn),
        cmocka_unit_test(style_without_its_bulk_lane_draws_what_it_has),
        cmocka_unit_test(same_style_again_costs_nothing),
        cmocka_unit_test(counter_sees_our_own_allocations),
        cmocka_unit_test(steady_state_allocates_nothing),
        cmocka_unit_test(table_of_a_fibre_is_made_anew_without_an_allocation),
        cmocka_unit_test(hair_takes_the_colour_that_is_asked_for),
        cmocka_unit_test(stats_have_the_fixed_keys_and_true_counts),
        cmocka_unit_test(imported_groom_covers_what_the_path_traced_masks_cover),
    };
    return cmocka_run_group_tests(tests, grow_styles, free_styles);
}
