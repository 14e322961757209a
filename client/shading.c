#include "client/shading.h"

#include "client/program.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// The last units that every GL has; what passes read by themselves begins at 0.
enum { UNIT_AROUND = 14, UNIT_ALONG = 15 };

enum { LAYERS = 4, MAX_TABLE = 512 };

// A shading is a .glsl file with a function, and a row.
typedef struct ShadingRow {
    const char* function;
    bool has_tables;
} ShadingRow;

static const ShadingRow rows[SHADINGS] = {[SHADING_KAJIYA] = {"kajiya_shade", false},
                                          [SHADING_MARSCHNER] = {"marschner_shade", true},
                                          [SHADING_BANKS] = {"banks_shade", false},
                                          [SHADING_CLAY] = {"clay_shade", false}};
const char* const shading_names[SHADINGS + 1] = {"kajiya", "marschner", "banks", "clay", NULL};

typedef struct NamedColour {
    Vec3 root, tip;
} NamedColour;

static const NamedColour colours[] = {
    {{0.38f, 0.215f, 0.10f}, {0.62f, 0.41f, 0.22f}},         // blond
    {{0.060f, 0.024f, 0.010f}, {0.115f, 0.047f, 0.018f}},    // brown
    {{0.0095f, 0.0080f, 0.0075f}, {0.014f, 0.011f, 0.010f}}, // black
    {{0.15f, 0.036f, 0.012f}, {0.25f, 0.066f, 0.022f}},      // red
};
const char* const shading_colour_names[] = {"blond", "brown", "black", "red", NULL};

void shading_colour(int index, HairMaterial* material)
{
    material->root_colour = colours[index].root;
    material->tip_colour = colours[index].tip;
}

ShadingOptions shading_default(void)
{
    ShadingOptions options = {.kind = SHADING_KAJIYA,
                              .fibre = marschner_fibre(),
                              .shine = {1, 1, 1},
                              .through = 2.5f,
                              .diffuse = 1.0f,
                              .wrap = 1.0f,
                              .most = 0.5f,
                              .table_size = 64,
                              .format = TABLE_HALF,
                              .layout = LAYOUT_ENDS};
    options.fibre.beta_deg = 5.5;
    return options;
}

// A number that may be set by name. Where it is a float, `is_double` is false.
typedef struct Parameter {
    const char* name;
    size_t at;
    bool is_double;
    double least, most;
} Parameter;

const char shading_parameters[] = "eta, alpha, beta, width, shine, through, diffuse, norm";
static const Parameter parameters[] = {
    {"eta", offsetof(ShadingOptions, fibre.eta), true, 1.05, 4.0},
    {"alpha", offsetof(ShadingOptions, fibre.alpha_deg), true, -30.0, 30.0},
    {"beta", offsetof(ShadingOptions, fibre.beta_deg), true, 0.5, 45.0},
    {"width", offsetof(ShadingOptions, fibre.width_deg), true, 1.0, 90.0},
    {"through", offsetof(ShadingOptions, through), false, 0.0, 10.0},
    {"diffuse", offsetof(ShadingOptions, diffuse), false, 0.0, 10.0},
    {"shine", offsetof(ShadingOptions, shine.x), false, 0.0, 10.0},
};
static const char* const norms[NORMS] = {
    [NORM_HALF] = "half", [NORM_PAPER] = "paper", [NORM_DEON] = "deon"};

static bool set_number(ShadingOptions* options, const Parameter* parameter, const char* value,
                       Fault* fault)
{
    char* end;
    double number = strtod(value, &end);
    if (end == value || *end != '\0' || !(number >= parameter->least && number <= parameter->most))
        return fault_set(fault, "%s is a number from %g to %g", parameter->name, parameter->least,
                         parameter->most);
    float single = (float)number;
    char* to = (char*)options + parameter->at;
    if (parameter->is_double)
        memcpy(to, &number, sizeof number);
    else
        memcpy(to, &single, sizeof single);
    return true;
}

static bool set_parameter(ShadingOptions* options, const char* name, const char* value,
                          Fault* fault)
{
    if (strcmp(name, "norm") == 0) {
        for (int i = 0; i < NORMS; ++i)
            if (strcmp(value, norms[i]) == 0) {
                options->fibre.norm = (MarschnerNorm)i;
                return true;
            }
        return fault_set(fault, "norm is half, paper or deon");
    }
    for (size_t i = 0; i < sizeof parameters / sizeof parameters[0]; ++i)
        if (strcmp(name, parameters[i].name) == 0)
            return set_number(options, &parameters[i], value, fault);
    return fault_set(fault, "there is no %.40s; there are %s", name, shading_parameters);
}

bool shading_parse(ShadingOptions* options, const char* text, Fault* fault)
{
    for (const char* at = text; *at != '\0';) {
        char pair[64];
        size_t length = strcspn(at, ",");
        if (length == 0 || length >= sizeof pair) return fault_set(fault, "want NAME=VALUE,...");
        memcpy(pair, at, length);
        pair[length] = '\0';
        char* value = strchr(pair, '=');
        if (value == NULL) return fault_set(fault, "want NAME=VALUE,...");
        *value = '\0';
        if (!set_parameter(options, pair, value + 1, fault)) return false;
        at += length;
        at += *at == ',';
    }
    options->shine.y = options->shine.z = options->shine.x;
    return true;
}

void shading_defines(const ShadingOptions* options, char text[SHADING_DEFINES_BYTES])
{
    snprintf(text, SHADING_DEFINES_BYTES, "#define strand_shade %s\n#define MARSCHNER_NALU %d\n",
             rows[options->kind].function, options->layout == LAYOUT_NALU);
}

static GLint internal_format(TableFormat format)
{
    return format == TABLE_HALF ? GL_RGBA16F : format == TABLE_BYTE ? GL_RGBA8 : GL_RGBA32F;
}

static GLuint create_texture(const Gl* gl, GLenum target)
{
    GLuint texture;
    gl->GenTextures(1, &texture);
    gl->BindTexture(target, texture);
    gl->TexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl->TexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

bool shading_create(Shading* shading, const Gl* gl, const ShadingOptions* options, Fault* fault)
{
    memset(shading, 0, sizeof *shading);
    shading->options = *options;
    if (!rows[options->kind].has_tables) return true;
    int size = options->table_size;
    if (size < 2 || size > MAX_TABLE)
        return fault_set(fault, "a table of %d: want 2 to %d texels", size, MAX_TABLE);
    shading->texels = malloc((size_t)(LAYERS * size * size) * 4 * sizeof(float));
    if (shading->texels == NULL) return fault_set(fault, "no memory for the table of a fibre");
    GLint format = internal_format(options->format);
    shading->around = create_texture(gl, GL_TEXTURE_2D_ARRAY);
    gl->TexImage3D(GL_TEXTURE_2D_ARRAY, 0, format, size, size, LAYERS, 0, GL_RGBA, GL_FLOAT, NULL);
    if (options->layout == LAYOUT_NALU) {
        shading->along = create_texture(gl, GL_TEXTURE_2D);
        gl->TexImage2D(GL_TEXTURE_2D, 0, format, size, size, 0, GL_RGBA, GL_FLOAT, NULL);
    }
    return true;
}

void shading_free(Shading* shading, const Gl* gl)
{
    gl->DeleteTextures(1, &shading->around);
    gl->DeleteTextures(1, &shading->along);
    free(shading->texels);
    memset(shading, 0, sizeof *shading);
}

// What texel `i` of a row stands for, 0..1.
static double place(const Shading* shading, int i)
{
    int size = shading->options.table_size;
    return shading->options.layout == LAYOUT_NALU ? (i + 0.5) / size : (double)i / (size - 1);
}

static float* texel(const Shading* shading, int layer, int row, int column)
{
    int size = shading->options.table_size;
    return shading->texels + 4 * (size_t)((layer * size + row) * size + column);
}

static void put_around(const Shading* shading, int row, int column, const Scatter* n)
{
    for (int end = 0; end < 2; ++end)
        for (int c = 0; c < 4; ++c) {
            bool is_colour = c < 3;
            texel(shading, 2 * end, row, column)[c] =
                (float)(is_colour ? n->lobe[LOBE_TT][3 * end + c] : n->lobe[LOBE_R][0]);
            texel(shading, 2 * end + 1, row, column)[c] =
                (float)(is_colour ? n->lobe[LOBE_TRT][3 * end + c] : 0.0);
        }
}

// Which lobe component `c` of a texel of `layer` belongs to.
static int lobe_of(int layer, int c)
{
    return c == 3 ? LOBE_R : layer % 2 == 0 ? LOBE_TT : LOBE_TRT;
}

// Bytes hold 0..1: divides each lobe by its largest value. Floating point is left as it is.
static void scale_around(Shading* shading)
{
    int size = shading->options.table_size, floats = size * size * 4;
    float* most = shading->around_scale;
    bool scales = shading->options.format == TABLE_BYTE;
    most[0] = most[1] = most[2] = scales ? 1e-9f : 1.0f;
    for (int i = 0; scales && i < LAYERS * floats; ++i) {
        float* lobe = &most[lobe_of(i / floats, i % 4)];
        *lobe = fmaxf(*lobe, shading->texels[i]);
    }
    for (int i = 0; scales && i < LAYERS * floats; ++i)
        shading->texels[i] /= most[lobe_of(i / floats, i % 4)];
}

static void make_around(Shading* shading, const Gl* gl)
{
    int size = shading->options.table_size;
    double phi[MAX_TABLE];
    Scatter n[MAX_TABLE];
    for (int column = 0; column < size; ++column) {
        double x = place(shading, column);
        phi[column] = shading->options.layout == LAYOUT_NALU ? acos(2.0 * x - 1.0) : M_PI * x;
    }
    for (int row = 0; row < size; ++row) {
        marschner_azimuths(&shading->made, place(shading, row), phi, size, n);
        for (int column = 0; column < size; ++column)
            put_around(shading, row, column, &n[column]);
    }
    scale_around(shading);
    gl->BindTexture(GL_TEXTURE_2D_ARRAY, shading->around);
    gl->TexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, size, size, LAYERS, GL_RGBA, GL_FLOAT,
                      shading->texels);
}

// R, TT, TRT as Gaussians over theta_h, and cos theta_d in the fourth.
static void put_along(const Shading* shading, int row, int column)
{
    double sin_i = 2.0 * place(shading, column) - 1.0, sin_r = 2.0 * place(shading, row) - 1.0;
    double cos_i = sqrt(1.0 - sin_i * sin_i), cos_d = marschner_row(&shading->made, sin_i, sin_r);
    for (int lobe = 0; lobe < LOBES; ++lobe)
        texel(shading, 0, row, column)[lobe] =
            (float)(marschner_longitudinal(&shading->made, lobe, sin_i, sin_r) * cos_d * cos_d /
                    cos_i);
    texel(shading, 0, row, column)[3] = (float)cos_d;
}

static void make_along(Shading* shading, const Gl* gl)
{
    int size = shading->options.table_size;
    for (int i = 0; i < size * size; ++i)
        put_along(shading, i / size, i % size);
    for (int lobe = 0; lobe < LOBES; ++lobe) {
        float most = shading->options.format == TABLE_BYTE ? 1e-9f : 1.0f;
        for (int i = 0; shading->options.format == TABLE_BYTE && i < size * size; ++i)
            most = fmaxf(most, shading->texels[4 * i + lobe]);
        for (int i = 0; i < size * size; ++i)
            shading->texels[4 * i + lobe] /= most;
        shading->along_scale[lobe] = most;
    }
    gl->BindTexture(GL_TEXTURE_2D, shading->along);
    gl->TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, size, size, GL_RGBA, GL_FLOAT, shading->texels);
}

// The fibre as asked for; without an absorption of its own, with that of hair of these colours.
static Fibre wanted(const ShadingOptions* options, const HairMaterial* material)
{
    Fibre fibre = options->fibre;
    const float albedo[MARSCHNER_CHANNELS] = {material->root_colour.x, material->root_colour.y,
                                              material->root_colour.z, material->tip_colour.x,
                                              material->tip_colour.y,  material->tip_colour.z};
    for (int c = 0; c < MARSCHNER_CHANNELS && !options->has_absorption; ++c)
        fibre.absorption[c] = marschner_absorption((double)albedo[c]);
    return fibre;
}

static bool is_same(const Fibre* a, const Fibre* b)
{
    for (int c = 0; c < MARSCHNER_CHANNELS; ++c)
        if (a->absorption[c] != b->absorption[c]) return false;
    return a->eta == b->eta && a->alpha_deg == b->alpha_deg && a->beta_deg == b->beta_deg &&
           a->width_deg == b->width_deg && a->norm == b->norm && a->azimuth == b->azimuth &&
           a->tt_as_trt == b->tt_as_trt;
}

void shading_update(Shading* shading, const Gl* gl, const HairMaterial* material)
{
    if (shading->around == 0) return;
    Fibre fibre = wanted(&shading->options, material);
    if (shading->has_tables && is_same(&fibre, &shading->made)) return;
    shading->made = fibre;
    shading->has_tables = true;
    ++shading->tables_made;
    gl->ActiveTexture(GL_TEXTURE0);
    make_around(shading, gl);
    if (shading->along != 0) make_along(shading, gl);
}

void shading_samplers(const Gl* gl, GLuint program)
{
    program_sampler(gl, program, "marschner_around", UNIT_AROUND);
    program_sampler(gl, program, "marschner_along", UNIT_ALONG);
}

static void uniform_lobes(const Gl* gl, GLuint program, const char* name, const float v[LOBES])
{
    program_uniform3(gl, program, name, vec3(v[LOBE_R], v[LOBE_TT], v[LOBE_TRT]));
}

void shading_bind(const Shading* shading, const Gl* gl, GLuint program)
{
    if (shading->around == 0) return;
    const Fibre* fibre = &shading->made;
    float tilt[LOBES], spread[LOBES], norm[LOBES];
    for (int lobe = 0; lobe < LOBES; ++lobe) {
        double s = marschner_spread(fibre, lobe);
        tilt[lobe] = (float)marschner_tilt(fibre, lobe);
        spread[lobe] = (float)s;
        norm[lobe] = (float)marschner_deon_norm(4.0 * s * s);
    }
    static const float areas[NORMS] = {[NORM_HALF] = 0.5f, [NORM_PAPER] = 1.0f, [NORM_DEON] = 0.0f};
    uniform_lobes(gl, program, "marschner_tilt", tilt);
    uniform_lobes(gl, program, "marschner_spread", spread);
    uniform_lobes(gl, program, "marschner_deon_norm", norm);
    uniform_lobes(gl, program, "marschner_around_scale", shading->around_scale);
    uniform_lobes(gl, program, "marschner_along_scale", shading->along_scale);
    program_uniform3(gl, program, "marschner_shine", shading->options.shine);
    gl->Uniform1f(program_uniform(gl, program, "marschner_area"), areas[fibre->norm]);
    gl->Uniform1f(program_uniform(gl, program, "marschner_through"), shading->options.through);
    gl->Uniform1f(program_uniform(gl, program, "marschner_diffuse"), shading->options.diffuse);
    gl->Uniform1f(program_uniform(gl, program, "marschner_wrap"), shading->options.wrap);
    gl->Uniform1f(program_uniform(gl, program, "marschner_most"), shading->options.most);
    gl->ActiveTexture(GL_TEXTURE0 + UNIT_AROUND);
    gl->BindTexture(GL_TEXTURE_2D_ARRAY, shading->around);
    gl->ActiveTexture(GL_TEXTURE0 + UNIT_ALONG);
    gl->BindTexture(GL_TEXTURE_2D, shading->along);
    gl->ActiveTexture(GL_TEXTURE0);
}
