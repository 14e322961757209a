// The shadings as a GL context computes them, on single strands, against closed forms and against
// the fibre in double (client/marschner.h).
#include "tests/drawing.h"
#include "tests/shade_points.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

enum { PAIRS = 60000 };
static ShadePoint points[PAIRS];
static ShadedPoint exact[PAIRS], shaded[PAIRS];

// Mesa 22.3's OSMesaDestroyContext forgets its default framebuffer (see test_gl.c).
const char* __lsan_default_suppressions(void);
const char* __lsan_default_suppressions(void)
{
    return "leak:libOSMesa.so";
}

static Gl* open_any(void)
{
    Gl* gl = drawing_open("egl");
    if (gl == NULL) gl = drawing_open("osmesa");
    if (gl == NULL) skip();
    return gl;
}

static void shade(const Gl* gl, const ShadingOptions* options, const char* expression, int count)
{
    Fault fault = {""};
    if (!shade_points(gl, options, &shade_points_grey, expression, points, count, shaded, &fault))
        fail_msg("%s", fault.text);
}

// --- closed forms

// shared/tables/kk_hs_points.csv, T = +Y, exponent 40: theta_i, theta_r, dphi (degrees), sin(T, L),
// the Kajiya highlight for an outward light, and Heidrich and Seidel's L.N', (V.R)^40, (H.N')^40.
static const double closed_forms[][8] = {
    {0, 0, 0, 1.000000000, 1, 1.000000000, 1, 1},
    {0, 30, 0, 1.000000000, 0.00317121194, 1.000000000, 0.00317121194, 0.249891293},
    {30, -30, 0, 0.866025404, 1, 0.866025404, 1, 1},
    {30, 30, 0, 0.866025404, 9.09494702e-13, 0.866025404, 9.09494702e-13, 0.00317121194},
    {30, -25, 60, 0.866025404, 0.858556817, 0.866025404, 0.858556817, 0.950505952},
    {-20, 20, 90, 0.939692621, 1, 0.939692621, 1, 1},
    {60, -60, 180, 0.500000000, 1, 0.500000000, 1, 1},
    {45, -45, 120, 0.707106781, 1, 0.707106781, 1, 1},
    {80, -80, 10, 0.173648178, 1, 0.173648178, 1, 1},
    {0, 0, 170, 1.000000000, 1, 1.000000000, 1, 1},
};
enum { CLOSED_FORMS = sizeof closed_forms / sizeof closed_forms[0] };

// Column `column` of the table against an expression of light, view and strand.
static void check_closed_form(const Gl* gl, const char* expression, int column)
{
    ShadingOptions options = shading_default();
    for (int i = 0; i < CLOSED_FORMS; ++i) {
        points[i] = (ShadePoint){.tangent = {0, 1, 0}};
        shade_points_aim(points[i].light, closed_forms[i][0], 25.0);
        shade_points_aim(points[i].view, closed_forms[i][1], 25.0 + closed_forms[i][2]);
    }
    shade(gl, &options, expression, CLOSED_FORMS);
    for (int i = 0; i < CLOSED_FORMS; ++i) {
        double off = fabs((double)shaded[i].body[0] - closed_forms[i][column]);
        if (!(off <= 1e-5))
            fail_msg("%s, row %d: %.7f, table %.7f", expression, i, (double)shaded[i].body[0],
                     closed_forms[i][column]);
    }
}

static void kajiya_agrees_with_its_closed_form(void** state)
{
    (void)state;
    Gl* gl = open_any();
    check_closed_form(gl, "Lobes(vec3(kajiya_diffuse(strand.tangent, light)), vec3(0))", 3);
    check_closed_form(
        gl, "Lobes(vec3(kajiya_specular(strand.tangent, light, view, 40.0)), vec3(0))", 4);
    gl_close(gl);
}

static void banks_agrees_with_its_closed_form(void** state)
{
    (void)state;
    Gl* gl = open_any();
    check_closed_form(gl, "Lobes(vec3(banks_diffuse(strand.tangent, light)), vec3(0))", 5);
    check_closed_form(gl, "Lobes(vec3(banks_phong(strand.tangent, light, view, 40.0)), vec3(0))",
                      6);
    check_closed_form(gl, "Lobes(vec3(banks_blinn(strand.tangent, light, view, 40.0)), vec3(0))",
                      7);
    gl_close(gl);
}

// llvmpipe's own asin is 4e-4 off.
static void angles_are_exact_to_a_few_millionths(void** state)
{
    (void)state;
    Gl* gl = open_any();
    ShadingOptions options = shading_default();
    enum { COUNT = 5000 };
    shade_points_random(points, COUNT, 9);
    shade(gl, &options, "Lobes(vec3(arc_sin(light.y)), vec3(arc_between(light, view)))", COUNT);
    for (int i = 0; i < COUNT; ++i) {
        const float *a = points[i].light, *b = points[i].view;
        double apart = 0, together = 0;
        for (int c = 0; c < 3; ++c) {
            apart += pow((double)a[c] - (double)b[c], 2);
            together += pow((double)a[c] + (double)b[c], 2);
        }
        double between = 2.0 * atan2(sqrt(apart), sqrt(together));
        assert_true(fabs((double)shaded[i].body[0] - asin((double)a[1])) <= 1e-6);
        assert_true(fabs((double)shaded[i].shine[0] - between) <= 3e-6);
    }
    gl_close(gl);
}

// --- the fibre

static CodeErrors errors_of(const Gl* gl, const Fibre* fibre, int size, TableFormat format,
                            TableLayout layout)
{
    ShadingOptions options = shade_points_alone(SHADING_MARSCHNER, fibre);
    options.table_size = size;
    options.format = format;
    options.layout = layout;
    shade(gl, &options, NULL, PAIRS);
    return shade_points_errors(exact, shaded, PAIRS);
}

// marschner_endtoend.csv, "improved": fp16 0.39 codes at most, 8 bits 0.78 (99 %) and 4.7 (most);
// "nalu": 4.1 to 4.2 (99 %), 91 at most.
static void tables_err_by_half_a_code_and_those_of_nalu_by_four(void** state)
{
    (void)state;
    Gl* gl = open_any();
    Fibre fibre = shade_points_fibre(AZIMUTH_CAUSTIC);
    shade_points_random(points, PAIRS, 7);
    shade_points_exact(&fibre, points, PAIRS, exact);
    CodeErrors half = errors_of(gl, &fibre, 128, TABLE_HALF, LAYOUT_ENDS);
    CodeErrors byte = errors_of(gl, &fibre, 128, TABLE_BYTE, LAYOUT_ENDS);
    CodeErrors nalu = errors_of(gl, &fibre, 128, TABLE_BYTE, LAYOUT_NALU);
    printf("sRGB codes, 99 %% and most: fp16 %.2f %.2f, 8 bits %.2f %.2f, Nalu %.2f %.2f\n",
           half.p99, half.most, byte.p99, byte.most, nalu.p99, nalu.most);
    assert_true(half.p99 <= 0.1 && half.most <= 0.5);
    assert_true(byte.p99 <= 1.0 && byte.most <= 5.0);
    assert_true(nalu.p99 >= 3.5 && nalu.p99 <= 5.0 && nalu.most >= 50.0);
    gl_close(gl);
}

// What pictures are drawn with: its own table's size, blurred, another colour at the tip, all
// norms.
static void default_table_errs_by_less_than_half_a_code(void** state)
{
    (void)state;
    static const double absorption[MARSCHNER_CHANNELS] = {0.05, 0.2, 0.6, 0.02, 0.1, 0.3};
    Gl* gl = open_any();
    enum { COUNT = 20000 };
    for (int norm = 0; norm < NORMS; ++norm) {
        Fibre fibre = marschner_fibre();
        fibre.norm = (MarschnerNorm)norm;
        memcpy(fibre.absorption, absorption, sizeof absorption);
        shade_points_random(points, COUNT, 11);
        for (int i = 0; i < COUNT; ++i)
            points[i].along = (float)i / COUNT;
        shade_points_exact(&fibre, points, COUNT, exact);
        ShadingOptions options = shade_points_alone(SHADING_MARSCHNER, &fibre);
        shade(gl, &options, NULL, COUNT);
        CodeErrors errors = shade_points_errors(exact, shaded, COUNT);
        printf("norm %d: 99 %% within %.3f codes, all within %.3f\n", norm, errors.p99,
               errors.most);
        assert_true(errors.p99 <= 0.3 && errors.most <= 0.5);
    }
    gl_close(gl);
}

// marschner_energy.csv, sigma_a 0, column sum012, over theta.
static const double sums[][2] = {{0, 0.9924181464},  {15, 0.9919882331}, {30, 0.9903676438},
                                 {45, 0.9860299035}, {60, 0.9728336061}, {75, 0.9219243680}};

static void white_furnace_of_the_shader_keeps_what_the_lobes_have(void** state)
{
    (void)state;
    Gl* gl = open_any();
    Fibre fibre = marschner_fibre();
    fibre.norm = NORM_DEON;
    ShadingOptions options = shade_points_alone(SHADING_MARSCHNER, &fibre);
    for (size_t i = 0; i < sizeof sums / sizeof sums[0]; ++i) {
        Fault fault = {""};
        double sum;
        if (!shade_points_furnace(gl, &options, sums[i][0], &sum, &fault))
            fail_msg("%s", fault.text);
        printf("theta %2.0f: %.5f of the light, table %.5f\n", sums[i][0], sum, sums[i][1]);
        assert_true(fabs(sum - sums[i][1]) <= 1e-3);
    }
    gl_close(gl);
}

// --- what else shading promises

static void tables_are_made_anew_only_when_something_changed(void** state)
{
    (void)state;
    Gl* gl = open_any();
    Fault fault = {""};
    ShadingOptions options = shading_default();
    options.kind = SHADING_MARSCHNER;
    Shading shading;
    assert_true(shading_create(&shading, gl, &options, &fault));
    HairMaterial material = shade_points_grey;
    for (int i = 0; i < 3; ++i)
        shading_update(&shading, gl, &material);
    assert_int_equal(shading.tables_made, 1);
    Fibre* fibre = &shading.options.fibre;
    double* live[] = {&fibre->eta, &fibre->alpha_deg, &fibre->beta_deg, &fibre->width_deg};
    for (int i = 0; i < 4; ++i) {
        *live[i] *= 1.1;
        shading_update(&shading, gl, &material);
        shading_update(&shading, gl, &material);
        assert_int_equal(shading.tables_made, 2 + i);
    }
    material.tip_colour.z *= 0.5f;
    shading_update(&shading, gl, &material);
    assert_int_equal(shading.tables_made, 6);
    shading.options.has_absorption = true;
    shading_update(&shading, gl, &material);
    fibre->absorption[4] = 0.7;
    shading_update(&shading, gl, &material);
    assert_int_equal(shading.tables_made, 8);
    shading.options.shine.x = 0.5f; // a uniform
    shading_update(&shading, gl, &material);
    assert_int_equal(shading.tables_made, 8);
    shading_free(&shading, gl);
    gl_close(gl);
}

static void every_part_has_a_weight_of_its_own(void** state)
{
    (void)state;
    Gl* gl = open_any();
    Fibre fibre = marschner_fibre();
    ShadingOptions options = shade_points_alone(SHADING_MARSCHNER, &fibre);
    enum { COUNT = 500 };
    static ShadedPoint plain[COUNT];
    shade_points_random(points, COUNT, 3);
    shade(gl, &options, NULL, COUNT);
    memcpy(plain, shaded, sizeof plain);
    options.shine = vec3(0.5f, 1.0f, 2.0f);
    options.through = 1.5f;
    options.diffuse = 0.25f;
    shade(gl, &options, NULL, COUNT);
    for (int i = 0; i < COUNT; ++i) {
        double sine = (double)points[i].light[1], cosine = sqrt(1.0 - sine * sine);
        double diffuse = 0.25 * 0.5 * cosine / M_PI; // weight, grey, Lambert of a cylinder
        for (int c = 0; c < 3; ++c) {
            double body = 1.5 * (double)plain[i].body[c], shine = (double)plain[i].shine[c];
            double scale = c == 0 ? 0.5 : c == 1 ? 1.0 : 2.0;
            assert_true(fabs((double)shaded[i].body[c] - body - diffuse) <= 1e-5 * (1.0 + body));
            assert_true(fabs((double)shaded[i].shine[c] - scale * shine) <= 1e-5 * (1.0 + shine));
        }
    }
    gl_close(gl);
}

static void hair_of_a_colour_scatters_that_colour(void** state)
{
    (void)state;
    Gl* gl = open_any();
    ShadingOptions options = shading_default();
    options.kind = SHADING_MARSCHNER;
    options.diffuse = options.wrap = 0.0f;
    Fault fault = {""};
    for (int colour = 0; shading_colour_names[colour] != NULL; ++colour) {
        HairMaterial material = shade_points_grey;
        shading_colour(colour, &material);
        double sent[3] = {0, 0, 0};
        enum { COUNT = 2000 };
        shade_points_random(points, COUNT, 5);
        assert_true(shade_points(gl, &options, &material, NULL, points, COUNT, shaded, &fault));
        for (int i = 0; i < COUNT; ++i)
            for (int c = 0; c < 3; ++c)
                sent[c] += (double)shaded[i].body[c];
        assert_true(sent[0] > sent[1] && sent[1] > sent[2]); // all four are warm
    }
    gl_close(gl);
}

static void parameters_are_read_by_name_and_wrong_ones_refused(void** state)
{
    (void)state;
    Fault fault = {""};
    ShadingOptions options = shading_default();
    assert_true(shading_parse(&options,
                              "eta=1.6,alpha=-5,beta=8,width=20,shine=2,through=3,diffuse=0.5,"
                              "norm=deon",
                              &fault));
    const Fibre* fibre = &options.fibre;
    assert_true(fibre->eta == 1.6 && fibre->alpha_deg == -5.0 && fibre->beta_deg == 8.0 &&
                fibre->width_deg == 20.0 && fibre->norm == NORM_DEON);
    assert_true(options.shine.x == 2.0f && options.shine.y == 2.0f && options.shine.z == 2.0f &&
                options.through == 3.0f && options.diffuse == 0.5f);
    static const char* const wrong[] = {"beta",     "beta=",   "beta=0",    "beta=nan",
                                        "beta=6x",  "gamma=1", "norm=full", ",beta=6",
                                        "beta=6,,", "=3",      "width=91,", "eta=1e999"};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
        fault.text[0] = '\0';
        if (shading_parse(&options, wrong[i], &fault)) fail_msg("%s was taken", wrong[i]);
        assert_true(fault.text[0] != '\0');
    }
}

// Light or eye along the strand, both, opposite, the same, straight through; every shading and
// norm.
static void no_direction_makes_a_spike(void** state)
{
    (void)state;
    static const float directions[][3] = {{0, 1, 0},         {0, -1, 0},
                                          {1, 0, 0},         {0, 0.999999f, 1e-3f},
                                          {0.5f, 0.866f, 0}, {-0.5f, -0.866f, 0}};
    enum { DIRECTIONS = sizeof directions / sizeof directions[0] };
    enum { COUNT = DIRECTIONS * DIRECTIONS };
    Gl* gl = open_any();
    for (int kind = 0; kind < SHADINGS; ++kind)
        for (int norm = 0; norm < NORMS; ++norm) {
            Fibre fibre = marschner_fibre();
            fibre.norm = (MarschnerNorm)norm;
            ShadingOptions options = shade_points_alone((ShadingKind)kind, &fibre);
            options.most = shading_default().most;
            for (int i = 0; i < COUNT; ++i) {
                points[i] = (ShadePoint){.tangent = {0, 1, 0}};
                memcpy(points[i].light, directions[i / DIRECTIONS], sizeof points[i].light);
                memcpy(points[i].view, directions[i % DIRECTIONS], sizeof points[i].view);
            }
            shade(gl, &options, NULL, COUNT);
            for (int i = 0; i < COUNT; ++i)
                for (int c = 0; c < 3; ++c) {
                    float body = shaded[i].body[c], shine = shaded[i].shine[c];
                    assert_true(body >= 0.0f && body <= options.most && shine >= 0.0f &&
                                shine <= options.most);
                }
        }
    gl_close(gl);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kajiya_agrees_with_its_closed_form),
        cmocka_unit_test(banks_agrees_with_its_closed_form),
        cmocka_unit_test(angles_are_exact_to_a_few_millionths),
        cmocka_unit_test(tables_err_by_half_a_code_and_those_of_nalu_by_four),
        cmocka_unit_test(default_table_errs_by_less_than_half_a_code),
        cmocka_unit_test(white_furnace_of_the_shader_keeps_what_the_lobes_have),
        cmocka_unit_test(tables_are_made_anew_only_when_something_changed),
        cmocka_unit_test(every_part_has_a_weight_of_its_own),
        cmocka_unit_test(hair_of_a_colour_scatters_that_colour),
        cmocka_unit_test(parameters_are_read_by_name_and_wrong_ones_refused),
        cmocka_unit_test(no_direction_makes_a_spike),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
