// The update pass on the GPU against messages/drawn.h in double, point by point.
#include "client/update.h"
#include "tests/drawing.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#define BOUND_MM 0.0005 // design 10

// Mesa 22.3's OSMesaDestroyContext forgets its default framebuffer (see test_gl.c).
const char* __lsan_default_suppressions(void);
const char* __lsan_default_suppressions(void)
{
    return "leak:libOSMesa.so";
}

static const char* const backends[] = {"egl", "osmesa"};

// A style on a context, and what the pass wrote.
typedef struct Bench {
    Gl* gl;
    Hairstyle* style;
    Ribbons ribbons;
    GuideTextures guides;
    Update update;
    GuidesView view;
    Texel* out[UPDATE_TARGETS];
    Vec3* rest_tangents;
} Bench;

static bool bench_open(Bench* bench, const char* backend, Hairstyle* style)
{
    Fault fault = {""};
    memset(bench, 0, sizeof *bench);
    bench->gl = drawing_open(backend);
    if (bench->gl == NULL) return false;
    bench->style = style;
    assert_true(ribbons_build(&bench->ribbons, style, &fault));
    assert_true(upload_create(&bench->guides, bench->gl, style, &fault));
    if (!update_create(&bench->update, bench->gl, style, &bench->ribbons, 0, &fault))
        fail_msg("%s", fault.text);
    bench->view = drawing_view(style);
    size_t texels = (size_t)bench->update.rows * UPDATE_WIDTH;
    for (int i = 0; i < UPDATE_TARGETS; ++i)
        bench->out[i] = test_malloc(texels * sizeof(Texel));
    bench->rest_tangents = test_malloc(sizeof(Vec3) * (size_t)(style->guide_count * style->nodes));
    for (int g = 0; g < style->guide_count; ++g)
        quantise_strand_tangents(bench->rest_tangents + g * style->nodes,
                                 style->rest + g * style->nodes, style->nodes);
    return true;
}

static void bench_close(Bench* bench)
{
    for (int i = 0; i < UPDATE_TARGETS; ++i)
        test_free(bench->out[i]);
    test_free(bench->rest_tangents);
    guides_view_free(&bench->view);
    update_free(&bench->update, bench->gl);
    upload_free(&bench->guides, bench->gl);
    ribbons_free(&bench->ribbons);
    gl_close(bench->gl);
}

static void bench_run(Bench* bench, float blend)
{
    const Gl* gl = bench->gl;
    Fault fault = {""};
    upload_rows(&bench->guides, gl, &bench->view);
    update_run(&bench->update, gl, &bench->guides, &bench->view, blend);
    for (int i = 0; i < UPDATE_TARGETS; ++i) {
        gl->BindTexture(GL_TEXTURE_2D, bench->update.targets[i]);
        gl->GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, bench->out[i]);
    }
    if (!gl_check(gl, "update", &fault)) fail_msg("%s", fault.text);
}

// What each row of the picture is made of: a share of its newest tick, the rest of the tick before;
// decoded and mixed in double, rounded to float once (1.5e-5 mm), as drawn.h takes it.
typedef struct Planes {
    Vec3 *positions, *tangents;
} Planes;

static Planes mixed_planes(const Bench* bench, double blend)
{
    int nodes = bench->style->nodes, count = bench->style->guide_count * nodes;
    Planes planes = {test_malloc(sizeof(Vec3) * (size_t)count),
                     test_malloc(sizeof(Vec3) * (size_t)count)};
    for (int i = 0; i < count; ++i) {
        const GuidesView* view = &bench->view;
        int row = i / nodes, now = view->row_tick[1][row] > view->row_tick[0][row];
        double p[3], t[3];
        for (int a = 0; a < 3; ++a) {
            double new_t = fmax(view->tangents[now][3 * i + a] / 32767.0, -1.0);
            double old_t = fmax(view->tangents[1 - now][3 * i + a] / 32767.0, -1.0);
            p[a] = blend * view->positions[now][3 * i + a] +
                   (1 - blend) * view->positions[1 - now][3 * i + a];
            t[a] = blend * new_t + (1 - blend) * old_t;
        }
        const Box* box = &bench->style->box;
        const double low[3] = {(double)box->low.x, (double)box->low.y, (double)box->low.z};
        const double high[3] = {(double)box->high.x, (double)box->high.y, (double)box->high.z};
        for (int a = 0; a < 3; ++a)
            p[a] = low[a] + (high[a] - low[a]) * p[a] / 65535.0;
        planes.positions[i] = vec3((float)p[0], (float)p[1], (float)p[2]);
        planes.tangents[i] = vec3((float)t[0], (float)t[1], (float)t[2]);
    }
    return planes;
}

static void planes_free(Planes* planes)
{
    test_free(planes->positions);
    test_free(planes->tangents);
}

// `v` at rest, turned as the guides of `point` have turned.
static Vec3d turned(const Bench* bench, const Planes* planes, DrawnPoint point, Vec3 v)
{
    static Vec3 nowhere[HAIRSTYLE_MAX_GUIDES * HAIRSTYLE_MAX_NODES];
    point.offset = v;
    return drawn_position(&point, bench->style->nodes, nowhere, planes->tangents,
                          bench->rest_tangents, NULL);
}

static Vec3d reference(const Bench* bench, const Planes* planes, int i)
{
    DrawnPoint point = ribbons_point(&bench->ribbons, i);
    Vec3d at = drawn_position(&point, bench->style->nodes, planes->positions, planes->tangents,
                              bench->rest_tangents, NULL);
    return drawn_push_out(at, bench->ribbons.colliders, bench->ribbons.collider_count);
}

static double distance(Vec3d a, const float* b)
{
    Vec3d d = {a.x - (double)b[0], a.y - (double)b[1], a.z - (double)b[2]};
    return sqrt(vec3d_dot(d, d));
}

// Largest distance of any point from the reference, mm. Normals and tangents turn along.
static double worst_mm(const Bench* bench, double blend)
{
    Planes planes = mixed_planes(bench, blend);
    double worst = 0, worst_turn = 0;
    for (int i = 0; i < bench->ribbons.point_count; ++i) {
        double d = distance(reference(bench, &planes, i), bench->out[UPDATE_POSITIONS][i]);
        if (!(d <= worst)) worst = d;
        if (isnan(worst)) break;
        if (i % 7 != 0) continue; // enough: they take the same turn
        DrawnPoint point = ribbons_point(&bench->ribbons, i);
        const float *t = bench->ribbons.tangents[i], *n = bench->ribbons.normals[i];
        Vec3d along = turned(bench, &planes, point, vec3(t[0], t[1], t[2]));
        Vec3d out = turned(bench, &planes, point, vec3(n[0], n[1], n[2]));
        double dt = distance(along, bench->out[UPDATE_TANGENTS][i]);
        double dn = distance(out, bench->out[UPDATE_NORMALS][i]);
        if (!(dt <= worst_turn)) worst_turn = dt;
        if (!(dn <= worst_turn)) worst_turn = dn;
    }
    planes_free(&planes);
    if (!(worst_turn <= 1e-4)) fail_msg("a tangent or normal is %g off", worst_turn);
    return worst * 1000.0;
}

static double largest_move_mm(const Bench* bench, int layer)
{
    double most = 0;
    for (int i = 0; i < bench->style->guide_count * bench->style->nodes; ++i) {
        Vec3 at = dequantise_position(bench->view.positions[layer] + 3 * i, &bench->style->box);
        most = fmax(most, (double)vec3_length(vec3_sub(at, bench->style->rest[i])));
    }
    return most * 1000.0;
}

static void check_style(const char* name)
{
    Hairstyle* style = drawing_style(name);
    if (style == NULL) skip();
    int opened = 0;
    for (int b = 0; b < 2; ++b) {
        Bench bench;
        if (!bench_open(&bench, backends[b], style)) continue;
        ++opened;
        drawing_put_tick(&bench.view, style, 0, 0, 0.0f);
        bench_run(&bench, 1.0f);
        double rest = worst_mm(&bench, 1.0), bent = 0, moved = 0;
        for (int tick = 1; tick <= 3; ++tick) {
            drawing_put_tick(&bench.view, style, tick, (uint32_t)tick, 0.4f * (float)tick);
            bench_run(&bench, 1.0f);
            bent = fmax(bent, worst_mm(&bench, 1.0));
            moved = fmax(moved, largest_move_mm(&bench, tick & 1));
        }
        printf("%s on %s: %d points, at rest %.6f mm, bent (by up to %.0f mm) %.6f mm\n", name,
               backends[b], bench.ribbons.point_count, rest, moved, bent);
        assert_true(rest <= BOUND_MM);
        assert_true(bent <= BOUND_MM);
        assert_true(moved > 20.0);
        bench_close(&bench);
    }
    hairstyle_destroy(style);
    if (opened == 0) skip();
}

static void every_point_of_long_agrees_with_the_reference(void** state)
{
    (void)state;
    check_style("long");
}

static void every_point_of_bob_agrees_with_the_reference(void** state)
{
    (void)state;
    check_style("bob");
}

static void every_point_of_an_imported_groom_agrees_with_the_reference(void** state)
{
    (void)state;
    check_style("ponytail");
}

static Bench open_any(Hairstyle* style)
{
    Bench bench;
    if (bench_open(&bench, "osmesa", style) || bench_open(&bench, "egl", style)) return bench;
    hairstyle_destroy(style);
    skip();
    return bench;
}

static double farthest_mm(const Bench* bench, Texel* other)
{
    double most = 0;
    for (int i = 0; i < bench->ribbons.point_count; ++i) {
        Vec3d at = {(double)other[i][0], (double)other[i][1], (double)other[i][2]};
        most = fmax(most, distance(at, bench->out[UPDATE_POSITIONS][i]));
    }
    return most * 1000.0;
}

static void blend_shows_the_older_the_mean_and_the_newer_tick(void** state)
{
    (void)state;
    Bench bench = open_any(drawing_style("bob"));
    size_t bytes = (size_t)bench.ribbons.point_count * sizeof(Texel);
    Texel *older = test_malloc(bytes), *newer = test_malloc(bytes);
    drawing_put_tick(&bench.view, bench.style, 6, 61, 0.5f);
    bench_run(&bench, 1.0f);
    memcpy(older, bench.out[UPDATE_POSITIONS], bytes);
    drawing_put_tick(&bench.view, bench.style, 7, 62, 0.5f);
    bench_run(&bench, 1.0f);
    memcpy(newer, bench.out[UPDATE_POSITIONS], bytes);
    assert_true(farthest_mm(&bench, older) > 20.0);

    bench_run(&bench, 0.0f);
    assert_true(farthest_mm(&bench, older) == 0.0);
    static const float shares[] = {0.0f, 0.25f, 0.5f, 1.0f};
    for (int i = 0; i < 4; ++i) {
        bench_run(&bench, shares[i]);
        double worst = worst_mm(&bench, (double)shares[i]);
        if (worst > BOUND_MM) fail_msg("blend %g: %g mm off", (double)shares[i], worst);
    }
    bench_run(&bench, 1.0f);
    assert_true(farthest_mm(&bench, newer) == 0.0);
    test_free(older);
    test_free(newer);
    hairstyle_destroy(bench.style);
    bench_close(&bench);
}

// Two of three rows lose their block of tick 9: their newest is 8, in the other layer.
static void rows_without_the_newest_tick_show_their_own_newest(void** state)
{
    (void)state;
    Bench bench = open_any(drawing_style("bob"));
    drawing_put_tick(&bench.view, bench.style, 8, 81, 0.5f);
    bench_run(&bench, 1.0f);
    for (int row = 0; row < bench.style->guide_count; row += 3) {
        Vec3 nodes[HAIRSTYLE_MAX_NODES];
        drawing_bend(nodes, bench.style, row, 82, 0.9f);
        drawing_put_row(&bench.view, bench.style, row, 9, nodes);
    }
    // What layer 1 holds of the other rows must not be looked at.
    for (int row = 0; row < bench.style->guide_count; ++row) {
        size_t at = (size_t)(row * bench.style->nodes * 3);
        if (row % 3 != 0)
            memset(bench.view.positions[1] + at, 0xee, (size_t)bench.style->nodes * 6);
    }
    int64_t bytes = bench.guides.bytes;
    bench_run(&bench, 1.0f);
    assert_true(worst_mm(&bench, 1.0) <= BOUND_MM);
    int rows = (bench.style->guide_count + 2) / 3;
    assert_int_equal(bench.guides.bytes - bytes, 12 * rows * bench.style->nodes);

    // A late row of tick 8 does not take the place of tick 9.
    drawing_put_tick(&bench.view, bench.style, 8, 83, 0.2f);
    for (int row = 0; row < bench.style->guide_count; ++row)
        bench.guides.row_tick[0][row] = 6; // as though 8 had not come before
    bench_run(&bench, 1.0f);
    assert_true(worst_mm(&bench, 1.0) <= BOUND_MM);
    hairstyle_destroy(bench.style);
    bench_close(&bench);
}

static void rows_that_never_came_are_drawn_at_rest(void** state)
{
    (void)state;
    Bench bench = open_any(drawing_style("bob"));
    assert_false(upload_rows(&bench.guides, bench.gl, &bench.view));
    bench_run(&bench, 1.0f);
    assert_int_equal(bench.guides.bytes, 0);
    drawing_put_tick(&bench.view, bench.style, 0, 0, 0.0f); // for the reference only
    assert_true(worst_mm(&bench, 1.0) <= BOUND_MM);
    hairstyle_destroy(bench.style);
    bench_close(&bench);
}

static void what_was_dropped_is_not_mixed_with_what_came_after(void** state)
{
    (void)state;
    Bench bench = open_any(drawing_style("bob"));
    drawing_put_tick(&bench.view, bench.style, 100, 1, 0.5f);
    bench_run(&bench, 1.0f);
    for (int layer = 0; layer < 2; ++layer)
        for (int row = 0; row < HAIRSTYLE_MAX_GUIDES; ++row)
            bench.view.row_tick[layer][row] = -1;
    ++bench.view.generation; // a new epoch, or the same one from its start
    drawing_put_tick(&bench.view, bench.style, 3, 2, 0.5f); // lower than what was held
    bench_run(&bench, 1.0f);
    assert_true(worst_mm(&bench, 1.0) <= BOUND_MM);
    hairstyle_destroy(bench.style);
    bench_close(&bench);
}

// Zero tangents are legal bytes on the wire, and opposed ones blend to zero: drawn.h then leaves
// offsets unturned, and so must the GPU, without a NaN.
static void tangents_without_a_direction_leave_offsets_unturned(void** state)
{
    (void)state;
    Bench bench = open_any(drawing_style("bob"));
    drawing_put_tick(&bench.view, bench.style, 0, 1, 0.5f);
    memset(bench.view.tangents[0], 0,
           (size_t)(bench.style->guide_count * bench.style->nodes * 3) * sizeof(int16_t));
    bench_run(&bench, 1.0f);
    double worst = worst_mm(&bench, 1.0);
    hairstyle_destroy(bench.style);
    bench_close(&bench);
    if (!(worst <= BOUND_MM)) fail_msg("%g mm off", worst);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_point_of_long_agrees_with_the_reference),
        cmocka_unit_test(every_point_of_bob_agrees_with_the_reference),
        cmocka_unit_test(every_point_of_an_imported_groom_agrees_with_the_reference),
        cmocka_unit_test(blend_shows_the_older_the_mean_and_the_newer_tick),
        cmocka_unit_test(rows_without_the_newest_tick_show_their_own_newest),
        cmocka_unit_test(rows_that_never_came_are_drawn_at_rest),
        cmocka_unit_test(what_was_dropped_is_not_mixed_with_what_came_after),
        cmocka_unit_test(tangents_without_a_direction_leave_offsets_unturned),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
