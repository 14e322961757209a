// hair-compare: how far two pictures are apart, and whether that is too far.
#include "tests/compare.h"
#include "tests/flip.h"

#include <argp.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KEY_HEAT = 256, KEY_JSON, KEY_PPD, KEY_MAX }; // and one for each figure

typedef struct Options {
    const char* paths[2];
    int path_count;
    const char* heat;
    bool json, quiet;
    float pixels_per_degree;
    double most[COMPARE_FIGURES]; // infinity: not asked
} Options;

static const struct argp_option arguments[] = {
    {"heat", KEY_HEAT, "FILE.png", 0, "write where they differ: FLIP as black, red, yellow, white",
     0},
    {"json", KEY_JSON, 0, 0, "print one object, with all 256 bins of the histogram", 0},
    {"quiet", 'q', 0, 0, "print nothing but faults", 0},
    {"ppd", KEY_PPD, "N", 0, "pixels in a degree of the viewer's eye (default 67.02)", 0},
    {0, 0, 0, 0, "Bounds; beyond any of them the status is 1", 1},
    {"max-rmse", KEY_MAX, "X", 0, "root mean square difference of linear light", 0},
    {"max-p99", KEY_MAX + 1, "X", 0, "99 % of all pixels differ by this or less, linear light", 0},
    {"max-max", KEY_MAX + 2, "X", 0, "largest difference, linear light", 0},
    {"max-codes", KEY_MAX + 3, "N", 0, "largest difference of 8-bit codes", 0},
    {"max-flip", KEY_MAX + 4, "X", 0, "mean FLIP", 0},
    {"max-flip-p99", KEY_MAX + 5, "X", 0, "99 % of all pixels have this FLIP or less", 0},
    {0}};

static const char text[] =
    "Says how far two PNGs of one size are apart: in linear light (0 to 1), in 8-bit codes, and in "
    "FLIP, which is what a viewer sees who flips between them (0 the same, 1 as far as can be). "
    "Alpha is not looked at.\v"
    "Examples:\n"
    "  hair-compare a.png b.png\n"
    "  hair-compare --max-codes 0 a.png b.png && echo the same colours\n"
    "  hair-compare --max-flip 0.02 --max-rmse 0.01 --heat heat.png golden.png new.png\n"
    "  hair-compare --json a.png b.png | jq .flip\n"
    "Exit status: 0 within all bounds, 1 beyond one, 2 wrong arguments or pictures that cannot be "
    "compared.";

static double number(struct argp_state* state, const char* value, double low, double high)
{
    char* end;
    double n = strtod(value, &end);
    if (end == value || *end != '\0' || !(n >= low && n <= high))
        argp_error(state, "%s: want a number from %g to %g", value, low, high);
    return n;
}

static error_t parse(int key, char* value, struct argp_state* state)
{
    Options* options = state->input;
    if (key >= KEY_MAX && key < KEY_MAX + COMPARE_FIGURES) {
        options->most[key - KEY_MAX] = number(state, value, 0, 255);
        return 0;
    }
    switch (key) {
    case KEY_HEAT:
        options->heat = value;
        return 0;
    case KEY_JSON:
        options->json = true;
        return 0;
    case 'q':
        options->quiet = true;
        return 0;
    case KEY_PPD:
        options->pixels_per_degree = (float)number(state, value, 1, 700);
        return 0;
    case ARGP_KEY_ARG:
        if (options->path_count == 2) argp_error(state, "'%s': two pictures, no more", value);
        options->paths[options->path_count++] = value;
        return 0;
    case ARGP_KEY_END:
        if (options->path_count < 2) argp_error(state, "name two pictures");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static void print_text(const Comparison* c, const Options* options)
{
    for (int i = 0; i < COMPARE_FIGURES; ++i) {
        double value = compare_figure(c, i);
        printf("%-8s  %-10.6g  %s%s\n", compare_figures[i].name, value, compare_figures[i].what,
               value > options->most[i] ? "  BEYOND" : "");
    }
    int64_t all = 0, within = 0;
    for (int i = 0; i < 256; ++i)
        all += c->histogram[i];
    printf("codes that differ by at most");
    for (int i = 0, next = 0; i < 256; ++i) {
        within += c->histogram[i];
        if (i == next) printf("  %d: %.2f %%", i, 100.0 * (double)within / (double)all);
        if (i == next) next = next == 0 ? 1 : 2 * next;
    }
    printf("\n");
}

static void print_json(const Comparison* c, const Options* options, bool within)
{
    printf("{");
    for (int i = 0; i < COMPARE_FIGURES; ++i)
        printf("\"%s\": %.9g, ", compare_figures[i].name, compare_figure(c, i));
    printf("\"ppd\": %.9g, \"within\": %s, \"histogram\": [", (double)options->pixels_per_degree,
           within ? "true" : "false");
    for (int i = 0; i < 256; ++i)
        printf("%s%lld", i > 0 ? ", " : "", (long long)c->histogram[i]);
    printf("]}\n");
}

static bool check_same_size(const Options* options, const Image pictures[2], Fault* fault)
{
    const Image *a = &pictures[0], *b = &pictures[1];
    if (a->width == b->width && a->height == b->height) return true;
    return fault_set(fault, "%.90s is %dx%d and %.90s is %dx%d: want two of one size",
                     options->paths[0], a->width, a->height, options->paths[1], b->width,
                     b->height);
}

static bool write_heat(const Options* options, const Image* like, const float* map, Fault* fault)
{
    Image heat;
    if (!image_create(&heat, like->width, like->height, fault)) return false;
    compare_heat(&heat, map);
    bool written = image_write_png(&heat, options->heat, false, fault);
    image_free(&heat);
    return written;
}

static bool compare_files(const Options* options, Comparison* comparison, Fault* fault)
{
    Image pictures[2] = {{0}, {0}};
    float* map = NULL;
    bool done = image_read_png(&pictures[0], options->paths[0], fault) &&
                image_read_png(&pictures[1], options->paths[1], fault) &&
                check_same_size(options, pictures, fault);
    if (done && options->heat != NULL) {
        map = malloc((size_t)pictures[0].width * (size_t)pictures[0].height * sizeof *map);
        done = map != NULL || fault_set(fault, "no memory for the heat map");
    }
    done = done &&
           compare_images(comparison, &pictures[0], &pictures[1], options->pixels_per_degree, map,
                          fault) &&
           (map == NULL || write_heat(options, &pictures[0], map, fault));
    free(map);
    image_free(&pictures[0]);
    image_free(&pictures[1]);
    return done;
}

int main(int argc, char** argv)
{
    Options options = {.pixels_per_degree = FLIP_PIXELS_PER_DEGREE};
    for (int i = 0; i < COMPARE_FIGURES; ++i)
        options.most[i] = (double)INFINITY;
    static const struct argp argp = {arguments, parse, "A.png B.png", text, NULL, NULL, NULL};
    argp_program_version = "hair-compare (strandcast) " STRANDCAST_VERSION;
    argp_err_exit_status = 2;
    argp_parse(&argp, argc, argv, 0, NULL, &options);

    static Comparison comparison;
    Fault fault = {""};
    if (!compare_files(&options, &comparison, &fault)) {
        fprintf(stderr, "hair-compare: %s\n", fault.text);
        return 2;
    }
    bool within = true;
    for (int i = 0; i < COMPARE_FIGURES; ++i)
        within = within && compare_figure(&comparison, i) <= options.most[i];
    if (options.json)
        print_json(&comparison, &options, within);
    else if (!options.quiet)
        print_text(&comparison, &options);
    if (!base_stdout_written(&fault)) {
        fprintf(stderr, "hair-compare: %s\n", fault.text);
        return 2;
    }
    return within ? 0 : 1;
}
