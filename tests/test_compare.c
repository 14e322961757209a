// How far pictures are apart: FLIP against the paper's formulas taken word for word, the figures of
// linear light against sums made by hand, and hair-compare with sound, hostile and wrong files.
#include "messages/random.h"
#include "tests/compare.h"
#include "tests/flip.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static Image make(int width, int height)
{
    Image image;
    Fault fault = {""};
    if (!image_create(&image, width, height, &fault)) fail_msg("%s", fault.text);
    return image;
}

static Image make_flat(int width, int height, unsigned rgb)
{
    Image image = make(width, height);
    for (int i = 0; i < width * height; ++i)
        for (int k = 0; k < 3; ++k)
            image.rgba[4 * i + k] = (uint8_t)(rgb >> (16 - 8 * k));
    return image;
}

// Noise over blocks: it has flat places, edges and points.
static Image make_noise(int width, int height, uint32_t seed)
{
    Image image = make(width, height);
    for (int i = 0; i < 4 * width * height; ++i) {
        uint32_t block = (uint32_t)(i / 4 % width / 4 + 64 * (i / 4 / width / 3) + 4096 * (i & 3));
        float value = random_unit(seed, block) + 0.1f * random_unit(seed ^ 77u, (uint32_t)i);
        image.rgba[i] = (uint8_t)(255.0f * fminf(value, 1.0f));
    }
    return image;
}

static Comparison compare(const Image* a, const Image* b)
{
    Comparison comparison;
    Fault fault = {""};
    if (!compare_images(&comparison, a, b, FLIP_PIXELS_PER_DEGREE, NULL, &fault))
        fail_msg("%s", fault.text);
    return comparison;
}

static void assert_close(double is, double want, double within)
{
    if (!(fabs(is - want) <= within)) fail_msg("is %.9g, want %.9g within %g", is, want, within);
}

// --- FLIP

static double flip_of_flat(unsigned a, unsigned b)
{
    Image one = make_flat(24, 17, a), other = make_flat(24, 17, b);
    Comparison comparison = compare(&one, &other);
    image_free(&one);
    image_free(&other);
    assert_close(comparison.flip_p99, comparison.flip, 1e-6);
    return comparison.flip;
}

static void flat_colours_have_the_published_flip(void** state)
{
    (void)state;
    assert_close((double)flip_largest_difference(), 41.2761, 1e-4);
    assert_close(flip_of_flat(0x00FF00, 0x0000FF), 1.0, 5e-7);
    assert_close(flip_of_flat(0x000000, 0xFFFFFF), 0.967380, 5e-7);
    assert_true(flip_of_flat(0x7F3A90, 0x7F3A90) == 0.0);
}

// The paper's formulas in double, point by point and not separated: the yardstick of flip.c.
typedef struct Truth {
    int width, height;
    double ppd;
    double* opponent; // [pixel][3]
} Truth;

static const double to_xyz[3][3] = {
    {10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
    {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
    {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}};

static double white(int row)
{
    return to_xyz[row][0] + to_xyz[row][1] + to_xyz[row][2];
}

static Truth truth_of(const Image* image, double ppd)
{
    Truth t = {image->width, image->height, ppd, NULL};
    t.opponent = calloc((size_t)(3 * t.width * t.height), sizeof(double));
    for (int i = 0; i < t.width * t.height; ++i) {
        double xyz[3] = {0, 0, 0};
        for (int k = 0; k < 3; ++k) {
            double c = image->rgba[4 * i + k] / 255.0;
            c = c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
            for (int row = 0; row < 3; ++row)
                xyz[row] += to_xyz[row][k] * c / white(row);
        }
        t.opponent[3 * i] = 116 * xyz[1] - 16;
        t.opponent[3 * i + 1] = 500 * (xyz[0] - xyz[1]);
        t.opponent[3 * i + 2] = 200 * (xyz[1] - xyz[2]);
    }
    return t;
}

static int clamp(int i, int count)
{
    return i < 0 ? 0 : i >= count ? count - 1 : i;
}

static double pixel(const Truth* t, int x, int y, int channel)
{
    return t->opponent[3 * (clamp(y, t->height) * t->width + clamp(x, t->width)) + channel];
}

static double sensitivity(int channel, double degrees2)
{
    static const double a1[3] = {1, 1, 34.1}, b1[3] = {0.0047, 0.0053, 0.04};
    double a2 = channel == 2 ? 13.5 : 0, b2 = channel == 2 ? 0.025 : 1e-5;
    double first =
        a1[channel] * sqrt(M_PI / b1[channel]) * exp(-M_PI * M_PI * degrees2 / b1[channel]);
    return first + a2 * sqrt(M_PI / b2) * exp(-M_PI * M_PI * degrees2 / b2);
}

static void truth_lab(const Truth* t, int x, int y, double lab[3])
{
    int r = (int)ceil(3 * sqrt(0.04 / (2 * M_PI * M_PI)) * t->ppd);
    double seen[3];
    for (int channel = 0; channel < 3; ++channel) {
        double sum = 0, weights = 0;
        for (int dy = -r; dy <= r; ++dy)
            for (int dx = -r; dx <= r; ++dx) {
                double w = sensitivity(channel, (dx * dx + dy * dy) / (t->ppd * t->ppd));
                sum += w * pixel(t, x + dx, y + dy, channel);
                weights += w;
            }
        seen[channel] = sum / weights;
    }
    double luma = (seen[0] + 16) / 116;
    double xyz[3] = {(seen[1] / 500 + luma) * white(0), luma, (luma - seen[2] / 200) * white(2)};
    // Cramer's rule for linear RGB.
    const double(*m)[3] = to_xyz;
    double minor[3] = {m[1][1] * m[2][2] - m[1][2] * m[2][1], m[1][2] * m[2][0] - m[1][0] * m[2][2],
                       m[1][0] * m[2][1] - m[1][1] * m[2][0]};
    double det = m[0][0] * minor[0] + m[0][1] * minor[1] + m[0][2] * minor[2];
    double f[3] = {0, 0, 0};
    for (int k = 0; k < 3; ++k) {
        double n[3][3];
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 3; ++column)
                n[row][column] = column == k ? xyz[row] : m[row][column];
        double c = (n[0][0] * (n[1][1] * n[2][2] - n[1][2] * n[2][1]) -
                    n[0][1] * (n[1][0] * n[2][2] - n[1][2] * n[2][0]) +
                    n[0][2] * (n[1][0] * n[2][1] - n[1][1] * n[2][0])) /
                   det;
        c = fmin(fmax(c, 0), 1);
        for (int row = 0; row < 3; ++row)
            f[row] += m[row][k] * c / white(row);
    }
    for (int row = 0; row < 3; ++row)
        f[row] = f[row] > 216.0 / 24389 ? cbrt(f[row]) : f[row] * 841 / 108 + 4.0 / 29;
    lab[0] = 116 * f[1] - 16;
    lab[1] = 0.01 * lab[0] * 500 * (f[0] - f[1]);
    lab[2] = 0.01 * lab[0] * 200 * (f[1] - f[2]);
}

// Edge (order 1) or point (order 2) strength, by two-dimensional kernels.
static double truth_feature(const Truth* t, int x, int y, int order)
{
    double s = 0.5 * 0.082 * t->ppd, sum[2] = {0, 0}, above = 0, below = 0;
    int r = (int)ceil(3 * s);
    for (int pass = 0; pass < 2; ++pass)
        for (int dy = -r; dy <= r; ++dy)
            for (int dx = -r; dx <= r; ++dx) {
                double g = exp(-(dx * dx + dy * dy) / (2 * s * s));
                double k = order == 1 ? -dx * g : (dx * dx / (s * s) - 1) * g;
                if (pass == 0) *(k > 0 ? &above : &below) += fabs(k);
                if (pass == 0) continue;
                k /= k > 0 ? above : below;
                sum[0] += k * (pixel(t, x + dx, y + dy, 0) + 16) / 116;
                sum[1] += k * (pixel(t, x + dy, y + dx, 0) + 16) / 116;
            }
    return hypot(sum[0], sum[1]);
}

static double truth_flip(const Truth* a, const Truth* b, int x, int y)
{
    double p[3], q[3], largest = 41.2760985;
    truth_lab(a, x, y, p);
    truth_lab(b, x, y, q);
    double colour = pow(fabs(p[0] - q[0]) + hypot(p[1] - q[1], p[2] - q[2]), 0.7);
    colour = colour < 0.4 * largest ? colour * 0.95 / (0.4 * largest)
                                    : 0.95 + 0.05 * (colour - 0.4 * largest) / (0.6 * largest);
    double feature = fmax(fabs(truth_feature(a, x, y, 1) - truth_feature(b, x, y, 1)),
                          fabs(truth_feature(a, x, y, 2) - truth_feature(b, x, y, 2)));
    return pow(colour, 1 - sqrt(feature / sqrt(2)));
}

static void every_pixel_has_the_flip_of_the_papers_formulas(void** state)
{
    (void)state;
    static const float distances[] = {12.0f, 40.0f, 67.02f};
    Image a = make_noise(26, 19, 1), b = make_noise(26, 19, 2);
    for (int y = 0; y < 19; ++y) // the right half nearly alike: small differences count, too
        for (int x = 13; x < 26; ++x)
            for (int k = 0; k < 3; ++k)
                b.rgba[4 * (26 * y + x) + k] = (uint8_t)(a.rgba[4 * (26 * y + x) + k] / 2 + 60);
    for (size_t d = 0; d < 3; ++d) {
        float map[26 * 19];
        Fault fault = {""};
        assert_true(flip_map(map, &a, &b, distances[d], &fault));
        Truth of_a = truth_of(&a, (double)distances[d]), of_b = truth_of(&b, (double)distances[d]);
        for (int i = 0; i < 26 * 19; ++i)
            assert_close((double)map[i], truth_flip(&of_a, &of_b, i % 26, i / 26), 2e-5);
        free(of_a.opponent);
        free(of_b.opponent);
    }
    image_free(&a);
    image_free(&b);
}

static void no_picture_differs_from_itself_and_two_differ_both_ways_alike(void** state)
{
    (void)state;
    static const int sizes[][2] = {{1, 1}, {1, 9}, {33, 2}, {70, 41}};
    for (size_t s = 0; s < 4; ++s) {
        Image a = make_noise(sizes[s][0], sizes[s][1], 3), b = make_noise(a.width, a.height, 4);
        Comparison same = compare(&a, &a), there = compare(&a, &b), back = compare(&b, &a);
        for (int i = 0; i < COMPARE_FIGURES; ++i) {
            assert_true(compare_figure(&same, i) == 0.0);
            assert_true(compare_figure(&there, i) > 0.0);
            assert_true(compare_figure(&there, i) == compare_figure(&back, i));
        }
        assert_true(there.flip_p99 <= 1.0 && there.max <= 1.0);
        assert_memory_equal(there.histogram, back.histogram, sizeof back.histogram);
        image_free(&a);
        image_free(&b);
    }
}

// --- linear light

static void figures_of_light_are_sums_over_pixels(void** state)
{
    (void)state;
    Image a = make_flat(10, 20, 0x000000), b = make_flat(10, 20, 0x000000);
    const double half = pow((128 / 255.0 + 0.055) / 1.055, 2.4); // of code 128
    b.rgba[4 * 7 + 1] = 128;
    b.rgba[4 * 100] = 255;
    Comparison two = compare(&a, &b);
    assert_close(two.rmse, sqrt((1 + half * half) / 600), 1e-12);
    assert_close(two.max, 1.0, 1e-12);
    assert_true(two.codes == 255.0);
    assert_true(two.p99 == 0.0); // 198 of 200 pixels are alike: 99 %
    assert_int_equal(two.histogram[0], 598);
    assert_int_equal(two.histogram[128], 1);
    assert_int_equal(two.histogram[255], 1);
    b.rgba[4 * 150 + 2] = 128;
    assert_close(compare(&a, &b).p99, half, 1e-7);
    image_free(&a);
    image_free(&b);
}

static void alpha_is_not_looked_at(void** state)
{
    (void)state;
    Image a = make_noise(9, 9, 5), b = make_noise(9, 9, 5);
    for (int i = 0; i < 81; ++i)
        b.rgba[4 * i + 3] ^= 0xFF;
    Comparison comparison = compare(&a, &b);
    for (int i = 0; i < COMPARE_FIGURES; ++i)
        assert_true(compare_figure(&comparison, i) == 0.0);
    image_free(&a);
    image_free(&b);
}

static void what_cannot_be_compared_is_refused(void** state)
{
    (void)state;
    Fault fault = {""};
    float map[16];
    Image a = make(4, 4), b = make(4, 3), huge = {.width = 16384, .height = 1025};
    assert_false(flip_map(map, &a, &b, 67.0f, &fault));
    assert_non_null(strstr(fault.text, "4x3"));
    assert_false(flip_map(map, &huge, &huge, 67.0f, &fault));
    assert_non_null(strstr(fault.text, "too many"));
    assert_false(flip_map(map, &a, &a, 701.0f, &fault));
    assert_false(flip_map(map, &a, &a, NAN, &fault));
    image_free(&a);
    image_free(&b);
}

// --- the program

static char folder[64];

static const char* path(const char* name)
{
    static char paths[4][128];
    static int next;
    char* to = paths[next++ % 4];
    snprintf(to, sizeof paths[0], "%s/%s", folder, name);
    return to;
}

static void write_file(const char* name, const void* bytes, size_t count)
{
    FILE* file = fopen(path(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, count, file), count);
    assert_int_equal(fclose(file), 0);
}

static size_t read_file(const char* name, char* bytes, size_t most)
{
    FILE* file = fopen(path(name), "rb");
    assert_non_null(file);
    size_t count = fread(bytes, 1, most, file);
    assert_int_equal(fclose(file), 0);
    return count;
}

// Runs hair-compare in the folder; what it said on standard output and error. Its exit status.
static int run(const char* arguments, char said[8192])
{
    char line[512];
    snprintf(line, sizeof line, "cd %s && 2>&1 %s/hair-compare %s", folder, BIN_DIR, arguments);
    FILE* pipe = popen(line, "r");
    assert_non_null(pipe);
    said[fread(said, 1, 8191, pipe)] = '\0';
    int status = pclose(pipe);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

// One line of at most a few hundred letters.
static bool is_line(const char* said)
{
    size_t length = strlen(said);
    return length > 20 && length < 400 && strchr(said, '\n') == said + length - 1;
}

static int make_files(void** state)
{
    (void)state;
    snprintf(folder, sizeof folder, P_tmpdir "/strandcast-compare-XXXXXX");
    if (mkdtemp(folder) == NULL) return -1;
    Fault fault = {""};
    Image a = make_noise(64, 48, 6), b = make_noise(64, 48, 6), c = make_noise(48, 64, 6);
    for (int i = 0; i < 64; ++i)
        b.rgba[4 * i] ^= 40;
    bool written = image_write_png(&a, path("a.png"), true, &fault) &&
                   image_write_png(&b, path("b.png"), false, &fault) &&
                   image_write_png(&c, path("c.png"), true, &fault);
    image_free(&a);
    image_free(&b);
    image_free(&c);
    return written ? 0 : -1;
}

static int remove_files(void** state)
{
    (void)state;
    char line[128];
    snprintf(line, sizeof line, "rm -r %s", folder);
    return system(line);
}

static void the_status_says_whether_all_bounds_hold(void** state)
{
    (void)state;
    char said[8192], arguments[128];
    Image a, b;
    Fault fault = {""};
    assert_true(image_read_png(&a, path("a.png"), &fault));
    assert_true(image_read_png(&b, path("b.png"), &fault));
    Comparison is = compare(&a, &b);
    assert_int_equal(run("a.png b.png", said), 0); // no bound
    assert_int_equal(run("--max-codes 0 a.png a.png", said), 0);
    for (int i = 0; i < COMPARE_FIGURES; ++i) {
        double value = compare_figure(&is, i);
        for (int beyond = 0; beyond < 2; ++beyond) {
            snprintf(arguments, sizeof arguments, "--max-%s %.17g a.png b.png",
                     compare_figures[i].name, value * (beyond ? 0.999 : 1.001));
            assert_int_equal(run(arguments, said), beyond);
            assert_int_equal(strstr(said, "BEYOND") != NULL, beyond);
        }
    }
    assert_int_equal(run("-q --max-flip 1 --max-rmse 0 a.png b.png", said), 1);
    assert_string_equal(said, "");
    image_free(&a);
    image_free(&b);
}

static void json_has_every_figure(void** state)
{
    (void)state;
    char said[8192];
    assert_int_equal(run("--json --max-codes 3 a.png b.png", said), 1);
    json_t* json = json_loads(said, 0, NULL);
    assert_non_null(json);
    for (int i = 0; i < COMPARE_FIGURES; ++i)
        assert_true(json_real_value(json_object_get(json, compare_figures[i].name)) > 0 ||
                    json_integer_value(json_object_get(json, compare_figures[i].name)) > 0);
    assert_true(json_is_false(json_object_get(json, "within")));
    json_t* histogram = json_object_get(json, "histogram");
    assert_int_equal(json_array_size(histogram), 256);
    json_int_t sum = 0;
    for (size_t i = 0; i < 256; ++i)
        sum += json_integer_value(json_array_get(histogram, i));
    assert_int_equal(sum, 3 * 64 * 48);
    json_decref(json);
}

static void the_heat_map_is_black_but_where_they_differ(void** state)
{
    (void)state;
    char said[8192];
    Image heat;
    Fault fault = {""};
    assert_int_equal(run("--heat heat.png a.png b.png", said), 0);
    assert_true(image_read_png(&heat, path("heat.png"), &fault));
    assert_int_equal(heat.width, 64);
    assert_int_equal(heat.height, 48);
    assert_true(heat.rgba[4 * 10] > 40);                       // row 0 differs
    for (size_t i = 4 * 64 * 30; i < (size_t)4 * 64 * 48; ++i) // 30 rows on nobody sees it
        assert_int_equal(heat.rgba[i], i % 4 == 3 ? 255 : 0);
    image_free(&heat);
}

static void expect_refusal(const char* arguments, const char* words)
{
    char said[8192];
    int status = run(arguments, said);
    if (status != 2 || !is_line(said) || strstr(said, words) == NULL)
        fail_msg("hair-compare %s ended %d and said: %s", arguments, status, said);
}

static void bad_files_get_one_line_and_status_2(void** state)
{
    (void)state;
    static char png[65536];
    size_t size = read_file("a.png", png, sizeof png);
    write_file("cut.png", png, size / 2);
    write_file("head.png", png, 30);
    write_file("empty.png", png, 0);
    write_file("text.png", "not a picture at all", 20);
    png[size / 2] ^= 0x55;
    write_file("bent.png", png, size);
    png[size / 2] ^= 0x55;
    memcpy(png + 16, "\x7F\xFF\xFF\xFF\x7F\xFF\xFF\xFF",
           8); // a size that nobody has; its sum is wrong
    write_file("huge.png", png, size);
    static const char* const files[] = {"cut.png",  "head.png", "empty.png", "text.png",
                                        "bent.png", "huge.png", "none.png",  "."};
    for (size_t i = 0; i < sizeof files / sizeof files[0]; ++i) {
        char arguments[64];
        snprintf(arguments, sizeof arguments, "a.png %s", files[i]);
        expect_refusal(arguments, files[i]);
        snprintf(arguments, sizeof arguments, "%s a.png", files[i]);
        expect_refusal(arguments, files[i]);
    }
    expect_refusal("a.png c.png", "64x48");
    expect_refusal("--heat none/heat.png a.png b.png", "none/heat.png");
    expect_refusal("a.png b.png >/dev/full", "standard output");
}

static void wrong_arguments_end_with_status_2(void** state)
{
    (void)state;
    static const char* const wrong[] = {"",
                                        "a.png",
                                        "a.png b.png c.png",
                                        "--max-flip -1 a.png b.png",
                                        "--nonsense",
                                        "--max-flip x a b",
                                        "--ppd 0 a b",
                                        "--max-rmse nan a.png b.png"};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
        char said[8192];
        if (run(wrong[i], said) != 2 || said[0] == '\0') fail_msg("'%s': %s", wrong[i], said);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flat_colours_have_the_published_flip),
        cmocka_unit_test(every_pixel_has_the_flip_of_the_papers_formulas),
        cmocka_unit_test(no_picture_differs_from_itself_and_two_differ_both_ways_alike),
        cmocka_unit_test(figures_of_light_are_sums_over_pixels),
        cmocka_unit_test(alpha_is_not_looked_at),
        cmocka_unit_test(what_cannot_be_compared_is_refused),
        cmocka_unit_test(the_status_says_whether_all_bounds_hold),
        cmocka_unit_test(json_has_every_figure),
        cmocka_unit_test(the_heat_map_is_black_but_where_they_differ),
        cmocka_unit_test(bad_files_get_one_line_and_status_2),
        cmocka_unit_test(wrong_arguments_end_with_status_2),
    };
    return cmocka_run_group_tests(tests, make_files, remove_files);
}
