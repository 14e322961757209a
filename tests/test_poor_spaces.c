// Poor triangle spaces (thesis 5.4.3): three guides that span no triangle, or another one now than
// at rest. Ribbons hang on a centre line and a width, so nothing may flip, spike or be no number.
#include "client/update.h"
#include "tests/drawing.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#define NODES   6
#define WISPS   40
#define POINTS  12
#define LINK_M  0.02f
#define WIDEST  0.004f
#define STRAY_M 0.008f

// Mesa 22.3's OSMesaDestroyContext forgets its default framebuffer (see test_gl.c).
const char* __lsan_default_suppressions(void);
const char* __lsan_default_suppressions(void)
{
    return "leak:libOSMesa.so";
}

// One patch of scalp with these three roots; guides hang `link_m` a link.
static Hairstyle* patch(const Vec3 root[3], float link_m)
{
    Fault fault = {""};
    Hairstyle* style = hairstyle_create();
    assert_true(hairstyle_set_guides(style, 3, NODES, &fault));
    for (int i = 0; i < 3 * NODES; ++i)
        style->rest[i] = vec3_mad(root[i / NODES], vec3(0, -1, 0), link_m * (float)(i % NODES));
    style->triangles = calloc(1, sizeof *style->triangles);
    style->triangles[0] = (ScalpTriangle){{0, 1, 2}};
    style->triangle_count = style->set_count = 1;
    style->sets[0] = (StrandSet){.name = "patch",
                                 .kind = STRANDS_GROWN,
                                 .guide_count = 3,
                                 .triangle_count = 1,
                                 .strand_count = WISPS,
                                 .points = POINTS,
                                 .root_width_m = WIDEST,
                                 .tip_width_m = WIDEST,
                                 .fibres = 9,
                                 .jitter_m = STRAY_M};
    style->forms[0] = (WispForm){
        .taper = 0.5f, .clump = 0.5f, .curl_radius_m = STRAY_M, .curl_turns = 2, .rotation_rad = 1};
    hairstyle_fit_box(style);
    if (!hairstyle_validate(style, &fault)) fail_msg("%s", fault.text);
    return style;
}

static bool is_number(const float* texel)
{
    return isfinite(texel[0]) && isfinite(texel[1]) && isfinite(texel[2]) && isfinite(texel[3]);
}

static Ribbons must_build(const Hairstyle* style)
{
    Fault fault = {""};
    Ribbons ribbons;
    if (!ribbons_build(&ribbons, style, &fault)) fail_msg("%s", fault.text);
    for (int i = 0; i < ribbons.point_count; ++i) {
        assert_true(is_number(ribbons.guides[i]) && is_number(ribbons.weights[i]));
        assert_true(is_number(ribbons.offsets[i]) && is_number(ribbons.normals[i]));
        assert_true(is_number(ribbons.tangents[i]));
        assert_true(ribbons.weights[i][3] <= 0.5f * WIDEST * 1.001f);
    }
    return ribbons;
}

// Every edge of every ribbon is at most as long as the guides and what strays from them allow, and
// every point is near them: no spike.
static void check_places(const Ribbons* ribbons, const Vec3d* at, const Vec3* nodes, float link_m)
{
    Vec3 low = nodes[0], high = nodes[0];
    for (int i = 0; i < 3 * NODES; ++i)
        low = vec3_min(low, nodes[i]), high = vec3_max(high, nodes[i]);
    // Two hundredths: jitter, curl and clump, each at its most; the cubic leaves a link by a
    // quarter of it.
    double room = 0.02 + 0.25 * (double)link_m, edge = (NODES - 1.0) / (POINTS - 1.0) * 2.5;
    for (int i = 0; i < ribbons->point_count; ++i) {
        assert_true(isfinite(at[i].x) && isfinite(at[i].y) && isfinite(at[i].z));
        assert_true(at[i].x > (double)low.x - room && at[i].x < (double)high.x + room);
        assert_true(at[i].y > (double)low.y - room && at[i].y < (double)high.y + room);
        assert_true(at[i].z > (double)low.z - room && at[i].z < (double)high.z + room);
        if (ribbons->guides[i][3] == 0.0f || i == 0) continue;
        Vec3d d = vec3d_sub(at[i], at[i - 1]);
        double most = edge * (double)link_m + 0.02;
        if (!(sqrt(vec3d_dot(d, d)) <= most)) fail_msg("an edge of %g m", sqrt(vec3d_dot(d, d)));
    }
}

static void check(Hairstyle* style, const Vec3* nodes, float link_m)
{
    Ribbons ribbons = must_build(style);
    Vec3* rest = hairstyle_rest_tangents(style);
    Vec3 now[3 * NODES];
    for (int g = 0; g < 3; ++g)
        quantise_strand_tangents(now + g * NODES, nodes + g * NODES, NODES);
    Vec3d* at = test_malloc((size_t)(ribbons.point_count + 1) * sizeof *at);
    for (int i = 0; i < ribbons.point_count; ++i) {
        DrawnPoint point = ribbons_point(&ribbons, i);
        at[i] = drawn_position(&point, NODES, nodes, now, rest, NULL);
    }
    check_places(&ribbons, at, nodes, link_m);
    test_free(at);
    free(rest);
    ribbons_free(&ribbons);
}

static void check_rest(const Vec3 root[3], float link_m)
{
    Hairstyle* style = patch(root, link_m);
    check(style, style->rest, link_m);
    hairstyle_destroy(style);
}

// Scalp of no area grows nothing where all of it is so, and no nonsense where a part is.
static void a_degenerate_triangle_grows_no_spike(void** state)
{
    (void)state;
    check_rest((const Vec3[3]){{0, 0, 0}, {0.01f, 0, 0}, {0.03f, 0, 0}}, LINK_M); // in a line
    check_rest((const Vec3[3]){{0, 0, 0}, {0, 0, 0}, {0.03f, 0, 0}}, LINK_M);     // two at one
    check_rest((const Vec3[3]){{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, LINK_M);         // all
    check_rest((const Vec3[3]){{0, 0, 0}, {0.03f, 0, 0}, {0, 0, 1e-7f}}, LINK_M); // a sliver
}

static void a_strand_of_no_length_is_no_spike(void** state)
{
    (void)state;
    const Vec3 root[3] = {{0, 0, 0}, {0.03f, 0, 0}, {0, 0, 0.03f}};
    check_rest(root, 0.0f);
    check_rest(root, 1e-9f);
    Hairstyle* style = patch(root, LINK_M); // one of three
    for (int n = 1; n < NODES; ++n)
        style->rest[n] = style->rest[0];
    check(style, style->rest, LINK_M);
    hairstyle_destroy(style);
}

// The middle of figure 5.4.3: the space closes to a line, and to a point, further along.
static void a_space_that_closes_is_no_spike(void** state)
{
    (void)state;
    const Vec3 root[3] = {{0, 0, 0}, {0.03f, 0, 0}, {0, 0, 0.03f}};
    Hairstyle* style = patch(root, LINK_M);
    Vec3 nodes[3 * NODES];
    for (int mode = 0; mode < 2; ++mode) {
        memcpy(nodes, style->rest, sizeof nodes);
        for (int n = 1; n < NODES; ++n) {
            Vec3 middle = vec3_lerp(nodes[n], nodes[NODES + n], 0.5f);
            nodes[2 * NODES + n] = middle;
            if (mode == 1) nodes[n] = nodes[NODES + n] = middle;
        }
        check(style, nodes, LINK_M + 0.03f);
    }
    hairstyle_destroy(style);
}

// Its right: one guide crosses to the other side of the two others, and folds back.
static void a_space_that_switches_its_topology_is_no_spike(void** state)
{
    (void)state;
    const Vec3 root[3] = {{0, 0, 0}, {0.03f, 0, 0}, {0, 0, 0.03f}};
    Hairstyle* style = patch(root, LINK_M);
    Vec3 nodes[3 * NODES];
    memcpy(nodes, style->rest, sizeof nodes);
    for (int n = 1; n < NODES; ++n)
        nodes[2 * NODES + n] = vec3_mad(nodes[2 * NODES + n], vec3(0.02f, 0, -0.03f), (float)n / 2);
    check(style, nodes, LINK_M + 0.03f);
    for (int n = 3; n < NODES; ++n) // up again: tangents of guides are opposed there
        nodes[n].y = nodes[2].y + LINK_M * (float)(n - 2);
    check(style, nodes, LINK_M + 0.04f);
    memcpy(nodes, style->rest, sizeof nodes);
    for (int i = 0; i < 3 * NODES; ++i) // all of them: the tangent now is the opposite of rest's
        if (i % NODES > 2) nodes[i].y = nodes[i - 1].y + LINK_M;
    check(style, nodes, LINK_M);
    hairstyle_destroy(style);
}

// Bends the guides and runs the pass; all that it writes is numbers. `first` is the first point.
static void draw_numbers(const Gl* gl, const Hairstyle* style, const Ribbons* ribbons, Texel first)
{
    Fault fault = {""};
    GuideTextures guides;
    Update update;
    GuidesView view = drawing_view(style);
    assert_true(upload_create(&guides, gl, style, &fault));
    assert_true(update_create(&update, gl, style, ribbons, 0, &fault));
    drawing_put_tick(&view, style, 1, 5, 0.9f);
    upload_rows(&guides, gl, &view);
    update_run(&update, gl, &guides, &view, 1.0f);
    Texel* out = test_malloc((size_t)update.rows * UPDATE_WIDTH * sizeof *out);
    for (int target = 0; target < UPDATE_TARGETS; ++target) {
        gl->BindTexture(GL_TEXTURE_2D, update.targets[target]);
        gl->GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, out);
        for (int i = 0; i < ribbons->point_count; ++i)
            assert_true(is_number(out[i]));
        if (target == UPDATE_POSITIONS) memcpy(first, out[0], sizeof(Texel));
    }
    test_free(out);
    guides_view_free(&view);
    update_free(&update, gl);
    upload_free(&guides, gl);
}

// The same through the update pass, where a float may overflow that a double does not.
static void the_update_pass_draws_poor_spaces_as_numbers(void** state)
{
    (void)state;
    Gl* gl = drawing_open("osmesa");
    if (gl == NULL) gl = drawing_open("egl");
    if (gl == NULL) skip();
    static const Vec3 roots[3][3] = {{{0, 0, 0}, {0.03f, 0, 0}, {0, 0, 1e-7f}},
                                     {{0, 0, 0}, {0.03f, 0, 0}, {0, 0, 0.03f}},
                                     {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}};
    static const float links[3] = {LINK_M, 0.0f, LINK_M};
    for (int c = 0; c < 3; ++c) {
        Hairstyle* style = patch(roots[c], links[c]);
        Ribbons ribbons = must_build(style);
        Texel first;
        draw_numbers(gl, style, &ribbons, first);
        // A capsule whose axis a point is on, exactly.
        ribbons.collider_count = 1;
        ribbons.colliders[0] = collider_sphere((Sphere){{first[0], first[1], first[2]}, 0.01f});
        draw_numbers(gl, style, &ribbons, first);
        ribbons_free(&ribbons);
        hairstyle_destroy(style);
    }
    gl_close(gl);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_degenerate_triangle_grows_no_spike),
        cmocka_unit_test(a_strand_of_no_length_is_no_spike),
        cmocka_unit_test(a_space_that_closes_is_no_spike),
        cmocka_unit_test(a_space_that_switches_its_topology_is_no_spike),
        cmocka_unit_test(the_update_pass_draws_poor_spaces_as_numbers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
