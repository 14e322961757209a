#include "tests/shade_points.h"

#include "client/program.h"
#include "messages/random.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define WIDTH 256

const HairMaterial shade_points_grey = {{0.5f, 0.5f, 0.5f}, {0.5f, 0.5f, 0.5f}, {0, 0, 0}};

static const char shader[] =
    "#include \"shading.glsl\"\n"
    "uniform sampler2D lights, views, tangents;\n"
    "uniform vec3 root_colour, tip_colour;\n"
    "layout(location = 0) out vec4 out_body;\n"
    "layout(location = 1) out vec4 out_shine;\n"
    "void main()\n"
    "{\n"
    "    ivec2 at = ivec2(gl_FragCoord.xy);\n"
    "    vec4 light_along = texelFetch(lights, at, 0);\n"
    "    vec3 light = light_along.xyz, view = texelFetch(views, at, 0).xyz;\n"
    "    vec3 tangent = texelFetch(tangents, at, 0).xyz;\n"
    "    Strand strand = Strand(tangent, vec3(0), mix(root_colour, tip_colour, light_along.w),\n"
    "                           light_along.w, 1.0);\n"
    "    Lobes lobes = EXPRESSION;\n"
    "    out_body = vec4(lobes.body, 1);\n"
    "    out_shine = vec4(lobes.shine, 1);\n"
    "}\n";

static GLuint build(const Gl* gl, const ShadingOptions* options, const char* expression,
                    Fault* fault)
{
    ShaderSource sources[128];
    int count = 0;
    for (; shader_sources[count].name != NULL && count < 120; ++count)
        sources[count] = shader_sources[count];
    sources[count++] = (ShaderSource){"points.frag", shader};
    sources[count] = (ShaderSource){NULL, NULL};
    char choice[SHADING_DEFINES_BYTES], defines[512];
    shading_defines(options, choice);
    snprintf(defines, sizeof defines, "%s#define EXPRESSION %s\n", choice,
             expression != NULL ? expression : "strand_shade(strand, light, view)");
    return program_build_from(gl, sources, "fullscreen.vert", "points.frag", defines, fault);
}

static GLuint texture(const Gl* gl, GLenum unit, int rows, const float* texels)
{
    GLuint name;
    gl->GenTextures(1, &name);
    gl->ActiveTexture(GL_TEXTURE0 + unit);
    gl->BindTexture(GL_TEXTURE_2D, name);
    gl->TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, WIDTH, rows, 0, GL_RGBA, GL_FLOAT, texels);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return name;
}

// Textures of what goes in (lights, views, tangents) and comes out (body, shine).
enum { IN = 3, OUT = 2 };

static void put_points(const Gl* gl, const ShadePoint* points, int count, int rows, float* room,
                       GLuint textures[IN + OUT])
{
    for (GLenum t = 0; t < IN; ++t) {
        memset(room, 0, (size_t)(rows * WIDTH) * 4 * sizeof *room);
        for (int i = 0; i < count; ++i) {
            const ShadePoint* p = &points[i];
            memcpy(room + 4 * i,
                   t == 0   ? p->light
                   : t == 1 ? p->view
                            : p->tangent,
                   3 * sizeof *room);
            room[4 * i + 3] = p->along;
        }
        textures[t] = texture(gl, t, rows, room);
    }
    for (GLenum t = IN; t < IN + OUT; ++t)
        textures[t] = texture(gl, IN, rows, NULL);
}

static void draw(const Gl* gl, GLuint program, int rows, const GLuint textures[IN + OUT],
                 GLuint names[2])
{
    static const GLenum buffers[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    gl->GenFramebuffers(1, &names[0]);
    gl->GenVertexArrays(1, &names[1]);
    gl->BindFramebuffer(GL_FRAMEBUFFER, names[0]);
    for (int i = 0; i < OUT; ++i)
        gl->FramebufferTexture2D(GL_FRAMEBUFFER, buffers[i], GL_TEXTURE_2D, textures[IN + i], 0);
    gl->DrawBuffers(OUT, buffers);
    gl->Viewport(0, 0, WIDTH, rows);
    gl->Disable(GL_DEPTH_TEST);
    gl->UseProgram(program);
    gl->BindVertexArray(names[1]);
    gl->DrawArrays(GL_TRIANGLES, 0, 3);
}

static void take_points(const Gl* gl, const GLuint textures[IN + OUT], float* room, int count,
                        ShadedPoint* out)
{
    for (int t = 0; t < OUT; ++t) {
        gl->ActiveTexture(GL_TEXTURE0);
        gl->BindTexture(GL_TEXTURE_2D, textures[IN + t]);
        gl->GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, room);
        for (int i = 0; i < count; ++i)
            memcpy(t == 0 ? out[i].body : out[i].shine, room + 4 * i, 3 * sizeof *room);
    }
}

bool shade_points(const Gl* gl, const ShadingOptions* options, const HairMaterial* material,
                  const char* expression, const ShadePoint* points, int count, ShadedPoint* out,
                  Fault* fault)
{
    int rows = (count + WIDTH - 1) / WIDTH;
    float* room = malloc((size_t)(rows * WIDTH) * 4 * sizeof *room);
    GLuint program = build(gl, options, expression, fault);
    Shading shading;
    if (room == NULL || program == 0 || !shading_create(&shading, gl, options, fault)) {
        free(room);
        return false;
    }
    GLuint textures[IN + OUT], names[2];
    program_sampler(gl, program, "lights", 0);
    program_sampler(gl, program, "views", 1);
    program_sampler(gl, program, "tangents", 2);
    shading_samplers(gl, program);
    shading_update(&shading, gl, material);
    put_points(gl, points, count, rows, room, textures);
    program_uniform3(gl, program, "root_colour", material->root_colour);
    program_uniform3(gl, program, "tip_colour", material->tip_colour);
    shading_bind(&shading, gl, program);
    draw(gl, program, rows, textures, names);
    take_points(gl, textures, room, count, out);
    gl->DeleteFramebuffers(1, &names[0]);
    gl->DeleteVertexArrays(1, &names[1]);
    gl->DeleteTextures(IN + OUT, textures);
    gl->DeleteProgram(program);
    shading_free(&shading, gl);
    free(room);
    return gl_check(gl, "shade_points", fault);
}

void shade_points_aim(float out[3], double theta_deg, double phi_deg)
{
    double theta = theta_deg * M_PI / 180.0, phi = phi_deg * M_PI / 180.0;
    out[0] = (float)(cos(theta) * cos(phi));
    out[1] = (float)sin(theta);
    out[2] = (float)(cos(theta) * sin(phi));
}

static void direction(float out[3], uint32_t seed, uint32_t draw)
{
    double y = 2.0 * (double)random_unit(seed, draw) - 1.0;
    double turn = 2.0 * M_PI * (double)random_unit(seed, draw + 1), r = sqrt(1.0 - y * y);
    out[0] = (float)(r * cos(turn));
    out[1] = (float)y;
    out[2] = (float)(r * sin(turn));
}

void shade_points_random(ShadePoint* points, int count, uint32_t seed)
{
    for (int i = 0; i < count; ++i) {
        points[i] = (ShadePoint){.tangent = {0, 1, 0}};
        direction(points[i].light, seed, 4 * (uint32_t)i);
        direction(points[i].view, seed, 4 * (uint32_t)i + 2);
    }
}

void shade_points_exact(const Fibre* fibre, const ShadePoint* points, int count, ShadedPoint* out)
{
    for (int i = 0; i < count; ++i) {
        double light[3], view[3], tangent[3], along = (double)points[i].along;
        for (int a = 0; a < 3; ++a) {
            light[a] = (double)points[i].light[a];
            view[a] = (double)points[i].view[a];
            tangent[a] = (double)points[i].tangent[a];
        }
        Scatter s = marschner_scatter(fibre, tangent, light, view);
        for (int c = 0; c < 3; ++c) {
            double root = s.lobe[LOBE_TT][c] + s.lobe[LOBE_TRT][c];
            double tip = s.lobe[LOBE_TT][c + 3] + s.lobe[LOBE_TRT][c + 3];
            out[i].body[c] = (float)(root + (tip - root) * along);
            out[i].shine[c] = (float)s.lobe[LOBE_R][c];
        }
    }
}

static int by_size(const void* a, const void* b)
{
    double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

static double code(double linear)
{
    double c = fmin(fmax(linear, 0.0), 1.0);
    return 255.0 * (c <= 0.0031308 ? 12.92 * c : 1.055 * pow(c, 1.0 / 2.4) - 0.055);
}

static double sent(const ShadedPoint* point, int c)
{
    return (double)point->body[c] + (double)point->shine[c];
}

CodeErrors shade_points_errors(const ShadedPoint* exact, const ShadedPoint* shaded, int count)
{
    int values = 3 * count;
    double* sorted = malloc((size_t)values * sizeof *sorted);
    if (sorted == NULL) abort();
    for (int i = 0; i < values; ++i)
        sorted[i] = sent(&exact[i / 3], i % 3);
    qsort(sorted, (size_t)values, sizeof *sorted, by_size);
    double white = sorted[(int)(0.995 * values)], sum = 0, squares = 0;
    for (int i = 0; i < values; ++i) {
        double a = sent(&exact[i / 3], i % 3), b = sent(&shaded[i / 3], i % 3);
        sorted[i] = isfinite(b) ? fabs(code(a / white) - code(b / white)) : 1e9;
        sum += sorted[i];
        squares += (a - b) * (a - b) / (white * white);
    }
    qsort(sorted, (size_t)values, sizeof *sorted, by_size);
    CodeErrors errors = {sum / values, sorted[(int)(0.99 * values)], sorted[values - 1],
                         sqrt(squares / values)};
    free(sorted);
    return errors;
}

ShadingOptions shade_points_alone(ShadingKind kind, const Fibre* fibre)
{
    ShadingOptions options = shading_default();
    options.kind = kind;
    options.fibre = *fibre;
    options.has_absorption = true;
    options.shine = vec3(1, 1, 1);
    options.through = 1.0f;
    options.diffuse = options.wrap = 0.0f;
    options.most = 1e9f;
    return options;
}

bool shade_points_furnace(const Gl* gl, const ShadingOptions* options, double theta_deg,
                          double* sum, Fault* fault)
{
    enum { THETAS = 600, PHIS = 100, COUNT = THETAS * PHIS };
    ShadePoint* points = calloc(COUNT, sizeof *points);
    ShadedPoint* shaded = calloc(COUNT, sizeof *shaded);
    for (int i = 0; i < COUNT && points != NULL; ++i) {
        double theta = -90.0 + 180.0 * (i / PHIS + 0.5) / THETAS;
        points[i].tangent[1] = 1.0f;
        shade_points_aim(points[i].light, theta, 360.0 * (i % PHIS + 0.5) / PHIS);
        shade_points_aim(points[i].view, theta_deg, 0.0);
    }
    bool done = points != NULL && shaded != NULL &&
                shade_points(gl, options, &shade_points_grey, NULL, points, COUNT, shaded, fault);
    *sum = 0;
    for (int i = 0; i < COUNT && done; ++i) {
        double theta = M_PI * ((i / PHIS + 0.5) / THETAS - 0.5);
        *sum += sent(&shaded[i], 1) * cos(theta) * (M_PI / THETAS) * (2.0 * M_PI / PHIS);
    }
    free(points);
    free(shaded);
    return done;
}

Fibre shade_points_fibre(MarschnerAzimuth azimuth)
{
    Fibre fibre = marschner_fibre();
    for (int c = 0; c < MARSCHNER_CHANNELS; ++c)
        fibre.absorption[c] = 0.2;
    fibre.norm = NORM_PAPER;
    fibre.azimuth = azimuth;
    return fibre;
}
