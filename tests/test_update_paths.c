// Every way to run the update pass against messages/drawn.h in double, on guides that the daemon
// simulated and the wire carried.
#include "client/draw.h"
#include "client/program.h"
#include "server/daemon.h"
#include "tests/drawing.h"
#include "tests/golden.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#define BOUND_MM 0.0005 // design 10
#define TICKS    300
#define STEP     37 // odd, so that both layers come; EVERY_TICK=1 checks all of them
#define PATHS    5

// Mesa 22.3's OSMesaDestroyContext forgets its default framebuffer (see test_gl.c).
const char* __lsan_default_suppressions(void);
const char* __lsan_default_suppressions(void)
{
    return "leak:libOSMesa.so";
}

// A character under a motion, and what was received of it.
typedef struct Actor {
    Daemon* daemon;
    Receive* receive;
    GuidesView view;
    const Hairstyle* style;
} Actor;

typedef struct Bench {
    const Gl* gl;
    Ribbons ribbons;
    GuideTextures guides;
    Update updates[PATHS];
    GLuint capture, captured; // for the path that keeps nothing: where its points are
    Vec3 *positions, *tangents, *rest_tangents, *nowhere;
    Vec3d *exact, *straight; // every point, in double
    Texel* out;
    double worst_mm[PATHS], from_cubic_mm; // the latter of straight lines, double
} Bench;

static void take_message(void* context, int64_t utime, const char* channel, const uint8_t* bytes,
                         size_t size)
{
    Actor* actor = context;
    receive_message(actor->receive, channel, bytes, size, utime);
}

static void actor_step(Actor* actor)
{
    daemon_tick(actor->daemon);
    daemon_publish_slice(actor->daemon, 0, 1);
    receive_take(actor->receive, &actor->view);
}

static void actor_open(Actor* actor, const LoadOptions* load)
{
    Fault fault = {""};
    int slot = 0, version;
    bool complete = false;
    DaemonOptions options = daemon_default();
    options.load = *load;
    options.motion = "shake";
    options.characters = 1;
    options.fast = true;
    memset(actor, 0, sizeof *actor);
    assert_true(guides_view_init(&actor->view, slot, &fault));
    actor->daemon = daemon_create(&options, &fault);
    if (actor->daemon == NULL) fail_msg("%s", fault.text);
    actor->receive = receive_create(&slot, 1, (Notice){0}, &fault);
    assert_non_null(actor->receive);
    daemon_add_sink(actor->daemon, (DaemonSink){take_message, actor});
    daemon_publish_styles(actor->daemon);
    actor_step(actor);
    actor->style = receive_style(actor->receive, actor->view.style_hash, &version, &complete);
    assert_true(actor->style != NULL && complete);
}

static void actor_close(Actor* actor)
{
    guides_view_free(&actor->view);
    receive_destroy(actor->receive);
    daemon_destroy(actor->daemon);
}

static void bench_open(Bench* bench, const Gl* gl, const Hairstyle* style)
{
    Fault fault = {""};
    size_t nodes = (size_t)(style->guide_count * style->nodes);
    memset(bench, 0, sizeof *bench);
    bench->gl = gl;
    assert_true(ribbons_build(&bench->ribbons, style, &fault));
    assert_true(upload_create(&bench->guides, gl, style, &fault));
    for (int p = 0; p < PATHS; ++p)
        if (!update_create(&bench->updates[p], gl, style, &bench->ribbons, p, &fault))
            fail_msg("%s", fault.text);
    assert_null(update_paths[PATHS].name);
    bench->capture =
        program_build_feedback(gl, "update.vert", update_captured, UPDATE_TARGETS, NULL, &fault);
    if (bench->capture == 0) fail_msg("%s", fault.text);
    update_samplers(gl, bench->capture);
    size_t points = (size_t)bench->updates[0].rows * UPDATE_WIDTH;
    gl->GenBuffers(1, &bench->captured);
    gl->BindBuffer(GL_ARRAY_BUFFER, bench->captured);
    gl->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(3 * points * sizeof(Texel)), NULL,
                   GL_DYNAMIC_READ);
    bench->positions = test_malloc(nodes * sizeof(Vec3));
    bench->tangents = test_malloc(nodes * sizeof(Vec3));
    bench->nowhere = test_calloc(nodes, sizeof(Vec3));
    bench->rest_tangents = hairstyle_rest_tangents(style);
    bench->exact = test_malloc(points * sizeof(Vec3d));
    bench->straight = test_malloc(points * sizeof(Vec3d));
    bench->out = test_malloc(points * sizeof(Texel));
}

static void bench_close(Bench* bench)
{
    const Gl* gl = bench->gl;
    for (int p = 0; p < PATHS; ++p)
        update_free(&bench->updates[p], gl);
    gl->DeleteProgram(bench->capture);
    gl->DeleteBuffers(1, &bench->captured);
    upload_free(&bench->guides, gl);
    ribbons_free(&bench->ribbons);
    test_free(bench->positions);
    test_free(bench->tangents);
    test_free(bench->nowhere);
    free(bench->rest_tangents);
    test_free(bench->exact);
    test_free(bench->straight);
    test_free(bench->out);
}

static void decode(Bench* bench, const Actor* actor)
{
    const Hairstyle* style = actor->style;
    const GuidesView* view = &actor->view;
    for (int i = 0; i < style->guide_count * style->nodes; ++i) {
        int row = i / style->nodes, now = view->row_tick[1][row] > view->row_tick[0][row];
        bench->positions[i] = dequantise_position(view->positions[now] + 3 * i, &style->box);
        const int16_t* t = view->tangents[now] + 3 * i; // not made unit again, as in the textures
        bench->tangents[i] =
            vec3((float)fmax(t[0] / 32767.0, -1.0), (float)fmax(t[1] / 32767.0, -1.0),
                 (float)fmax(t[2] / 32767.0, -1.0));
    }
}

// Where straight lines between nodes are.
static Vec3d on_lines(const DrawnPoint* point, int nodes, const Vec3* positions)
{
    int k = (int)point->height < nodes - 2 ? (int)point->height : nodes - 2;
    double f = (double)point->height - k;
    Vec3d sum = {0, 0, 0};
    for (int j = 0; j < 3; ++j) {
        const Vec3* at = positions + point->guide[j] * nodes + k;
        Vec3d here =
            vec3d_add(vec3d_scale(vec3d_from(at[0]), 1 - f), vec3d_scale(vec3d_from(at[1]), f));
        sum = vec3d_add(sum, vec3d_scale(here, (double)point->weight[j]));
    }
    return sum;
}

static void find_references(Bench* bench, const Actor* actor)
{
    const Ribbons* ribbons = &bench->ribbons;
    int nodes = actor->style->nodes;
    decode(bench, actor);
    for (int i = 0; i < ribbons->point_count; ++i) {
        DrawnPoint point = ribbons_point(ribbons, i);
        Vec3d at = drawn_position(&point, nodes, bench->positions, bench->tangents,
                                  bench->rest_tangents, NULL);
        Vec3d offset = drawn_position(&point, nodes, bench->nowhere, bench->tangents,
                                      bench->rest_tangents, NULL);
        Vec3d lines = vec3d_add(on_lines(&point, nodes, bench->positions), offset);
        bench->exact[i] = drawn_push_out(at, ribbons->colliders, ribbons->collider_count);
        bench->straight[i] = drawn_push_out(lines, ribbons->colliders, ribbons->collider_count);
        Vec3d d = vec3d_sub(bench->straight[i], bench->exact[i]);
        bench->from_cubic_mm = fmax(bench->from_cubic_mm, sqrt(vec3d_dot(d, d)) * 1000.0);
    }
}

// What a program that draws ribbons finds in its vertex shader.
static void capture(const Bench* bench, const Update* update)
{
    const Gl* gl = bench->gl;
    for (GLuint i = 0; i < UPDATE_TARGETS; ++i)
        gl->BindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, i,
                           i == 0 ? bench->captured : bench->updates[1].feedback[i]);
    gl->UseProgram(bench->capture);
    update_bind(update, gl);
    gl->BindVertexArray(update->vao);
    gl->Enable(GL_RASTERIZER_DISCARD);
    gl->BeginTransformFeedback(GL_POINTS);
    gl->DrawArrays(GL_POINTS, 0, update->point_count);
    gl->EndTransformFeedback();
    gl->Disable(GL_RASTERIZER_DISCARD);
    for (GLuint i = 0; i < UPDATE_TARGETS; ++i)
        gl->BindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, i, 0);
    gl->BindBuffer(GL_ARRAY_BUFFER, bench->captured);
    gl->GetBufferSubData(GL_ARRAY_BUFFER, 0,
                         (GLsizeiptr)((size_t)update->point_count * sizeof(Texel)), bench->out);
}

static void run_path(Bench* bench, const Actor* actor, int p)
{
    const Gl* gl = bench->gl;
    Update* update = &bench->updates[p];
    Fault fault = {""};
    // What was there before must not pass for what was written.
    memset(bench->out, 0xff, (size_t)update->rows * UPDATE_WIDTH * sizeof(Texel));
    update_run(update, gl, &bench->guides, &actor->view, 1.0f);
    if (update->path->evaluated) {
        capture(bench, update);
    } else {
        gl->BindTexture(GL_TEXTURE_2D, update->targets[UPDATE_POSITIONS]);
        gl->GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, bench->out);
    }
    if (!gl_check(gl, update->path->name, &fault)) fail_msg("%s", fault.text);
}

static void check_tick(Bench* bench, const Actor* actor)
{
    find_references(bench, actor);
    upload_rows(&bench->guides, bench->gl, &actor->view);
    for (int p = 0; p < PATHS; ++p) {
        run_path(bench, actor, p);
        const Vec3d* exact = p == update_find_path("linear") ? bench->straight : bench->exact;
        for (int i = 0; i < bench->ribbons.point_count; ++i) {
            const float* out = bench->out[i];
            Vec3d d = {exact[i].x - (double)out[0], exact[i].y - (double)out[1],
                       exact[i].z - (double)out[2]};
            double mm = sqrt(vec3d_dot(d, d)) * 1000.0;
            if (!(mm <= bench->worst_mm[p])) bench->worst_mm[p] = mm;
            if (isnan(mm)) fail_msg("%s: point %d is no number", update_paths[p].name, i);
        }
    }
}

// The filter's weights have all bits on llvmpipe, and 8 on many GPUs. Reading 0.01 of a node beside
// the place moved points by 3.8 mm at most here, by the turn of their offsets; half a step of 8
// bits is 0.002.
static double bound_mm(const Gl* gl, int p)
{
    return p == update_find_path("linear") && !gl->software ? 1.0 : BOUND_MM;
}

static void check_style(const LoadOptions* load)
{
    Gl* gl = drawing_open("egl");
    if (gl == NULL) gl = drawing_open("osmesa");
    if (gl == NULL) skip();
    Actor actor;
    Bench bench;
    actor_open(&actor, load);
    bench_open(&bench, gl, actor.style);
    int step = getenv("EVERY_TICK") != NULL ? 1 : STEP, checked = 0;
    for (int tick = 0; tick < TICKS; ++tick, actor_step(&actor)) {
        if (tick % step != step / 2) continue;
        check_tick(&bench, &actor);
        ++checked;
    }
    printf("%s, %d points, %d ticks, mm:", actor.style->name, bench.ribbons.point_count, checked);
    for (int p = 0; p < PATHS; ++p)
        printf(" %s %.6f", update_paths[p].name, bench.worst_mm[p]);
    printf("; straight lines from the cubic %.2f\n", bench.from_cubic_mm);
    for (int p = 0; p < PATHS; ++p) {
        if (!(bench.worst_mm[p] <= bound_mm(gl, p)))
            fail_msg("%s: %g mm off", update_paths[p].name, bench.worst_mm[p]);
    }
    bench_close(&bench);
    actor_close(&actor);
    gl_close(gl);
}

static void every_path_agrees_with_the_reference_on_long(void** state)
{
    (void)state;
    check_style(&(LoadOptions){.styles = {"long"}, .style_count = 1});
}

static void every_path_agrees_with_the_reference_on_bob(void** state)
{
    (void)state;
    check_style(&(LoadOptions){.styles = {"bob"}, .style_count = 1});
}

static void every_path_agrees_with_the_reference_on_curly(void** state)
{
    (void)state;
    check_style(&(LoadOptions){.styles = {"curly"}, .style_count = 1});
}

static void every_path_agrees_with_the_reference_on_an_imported_groom(void** state)
{
    (void)state;
    if (!drawing_has_assets()) skip();
    check_style(&(LoadOptions){
        .styles = {DRAWING_ASSETS "ponytail_back.tfx", DRAWING_ASSETS "ponytail_side.tfx",
                   DRAWING_ASSETS "ponytail_front_top.tfx", DRAWING_ASSETS "ponytail_tail_v31.tfx"},
        .style_count = 4,
        .head = DRAWING_ASSETS "ponytail_head.obj"});
}

static void draw_with(Gl* gl, const char* path, const char* shadows, bool pre_z, Image* image)
{
    Fault fault = {""};
    Hairstyle* style = drawing_style("bob");
    GuidesView view = drawing_view(style);
    CameraOptions camera = camera_default();
    ShadeOptions options = shade_default();
    Drawing drawing;
    options.width = 200, options.height = 150;
    options.pre_z = pre_z;
    options.update = update_find_path(path);
    options.shadow.method = shadow_find_method(shadows);
    assert_true(image_create(image, options.width, options.height, &fault));
    if (!draw_create(&drawing, gl, &options, &camera, &fault)) fail_msg("%s", fault.text);
    assert_true(draw_set_style(&drawing, style, 1, 1, &fault));
    for (int tick = 4; tick <= 5; ++tick) { // the second says whether the first is left behind
        drawing_put_tick(&view, style, tick, (uint32_t)tick, 0.2f * (float)(tick - 3));
        assert_true(draw_picture(&drawing, &view, image));
    }
    draw_free(&drawing);
    guides_view_free(&view);
    hairstyle_destroy(style);
    if (!gl_check(gl, path, &fault)) fail_msg("%s", fault.text);
}

// The CPU's points are some 1e-4 mm from the GPU's, which decides single samples of hashed
// coverage.
static void every_path_draws_the_same_picture(void** state)
{
    (void)state;
    static const struct {
        const char* shadows;
        bool pre_z;
    } by[] = {{"depth", true}, {"deep", false}};
    static const char* const paths[] = {"vertex", "buffer", "cpu"};
    Gl* gl = drawing_open("egl");
    if (gl == NULL) gl = drawing_open("osmesa");
    if (gl == NULL) skip();
    Fault fault = {""};
    for (int b = 0; b < 2; ++b) {
        Image pass;
        draw_with(gl, "pass", by[b].shadows, by[b].pre_z, &pass);
        for (int p = 0; p < (b == 0 ? 1 : 3); ++p) {
            Image other;
            Comparison c;
            draw_with(gl, paths[p], by[b].shadows, by[b].pre_z, &other);
            assert_true(compare_images(&c, &pass, &other, 67.0f, NULL, &fault));
            printf("%s, %s shadows: FLIP %.5f, RMSE %.5f, p99 %.5f\n", paths[p], by[b].shadows,
                   c.flip, c.rmse, c.p99);
            image_free(&other);
            bool rounded = strcmp(paths[p], "cpu") == 0;
            assert_true(rounded ? c.flip <= 0.01 && c.rmse <= 0.015 : golden_is_within(&c));
        }
        image_free(&pass);
    }
    gl_close(gl);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_path_agrees_with_the_reference_on_long),
        cmocka_unit_test(every_path_agrees_with_the_reference_on_bob),
        cmocka_unit_test(every_path_agrees_with_the_reference_on_curly),
        cmocka_unit_test(every_path_agrees_with_the_reference_on_an_imported_groom),
        cmocka_unit_test(every_path_draws_the_same_picture),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
