#include "tests/strips.h"

#include "client/program.h"
#include "messages/random.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void* must(size_t count, size_t size)
{
    void* memory = calloc(count + 1, size);
    if (memory == NULL) abort();
    return memory;
}

static Strips allocate(int ribbons, int points)
{
    size_t n = (size_t)points;
    return (Strips){.ribbon_count = ribbons,
                    .point_count = points,
                    .first = must((size_t)ribbons + 1, sizeof(int)),
                    .at = must(n, sizeof(Vec3)),
                    .tangent = must(n, sizeof(Vec3)),
                    .half_width_m = must(n, sizeof(float)),
                    .fill = must(n, sizeof(float))};
}

Strips strips_make(int ribbons, int points)
{
    Strips strips = allocate(ribbons, ribbons * points);
    for (int r = 0; r <= ribbons; ++r)
        strips.first[r] = r * points;
    return strips;
}

void strips_free(Strips* strips)
{
    free(strips->first);
    free(strips->at);
    free(strips->tangent);
    free(strips->half_width_m);
    free(strips->fill);
    *strips = (Strips){0};
}

static Texel* read_texels(const Gl* gl, GLuint texture, int rows)
{
    Texel* texels = must((size_t)rows * UPDATE_WIDTH, sizeof(Texel));
    gl->BindTexture(GL_TEXTURE_2D, texture);
    gl->GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, texels);
    return texels;
}

static Vec3 turn(const float r[9], const float* v)
{
    return vec3(r[0] * v[0] + r[1] * v[1] + r[2] * v[2], r[3] * v[0] + r[4] * v[1] + r[5] * v[2],
                r[6] * v[0] + r[7] * v[1] + r[8] * v[2]);
}

// Where ribbons begin, as their indices say.
static void find_ribbons(Strips* strips, const Ribbons* ribbons)
{
    int ribbon = 0, point = 0;
    for (int i = 0; i < ribbons->index_count; ++i) {
        if (ribbons->indices[i] == RIBBONS_RESTART)
            strips->first[++ribbon] = point;
        else
            point += ribbons->indices[i] & 1;
    }
}

Strips strips_read(const Gl* gl, const Hair* hair, const float rotation[9])
{
    const Update* update = &hair->update;
    Strips strips = allocate(hair->ribbons.ribbon_count, hair->ribbons.point_count);
    Texel* at = read_texels(gl, update->targets[UPDATE_POSITIONS], update->rows);
    Texel* tangent = read_texels(gl, update->targets[UPDATE_TANGENTS], update->rows);
    for (int i = 0; i < strips.point_count; ++i) {
        strips.at[i] = turn(rotation, at[i]);
        strips.tangent[i] = turn(rotation, tangent[i]);
        strips.half_width_m[i] = at[i][3];
        strips.fill[i] = hair->ribbons.offsets[i][3];
    }
    free(at);
    free(tangent);
    find_ribbons(&strips, &hair->ribbons);
    return strips;
}

static GLuint make_texture(const Gl* gl, int rows, const void* texels)
{
    GLuint texture;
    gl->GenTextures(1, &texture);
    gl->BindTexture(GL_TEXTURE_2D, texture);
    gl->TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, UPDATE_WIDTH, rows, 0, GL_RGBA, GL_FLOAT, texels);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

static void make_indices(Hair* hair, const Gl* gl, const Strips* strips)
{
    size_t most = 2 * (size_t)strips->point_count + (size_t)strips->ribbon_count;
    uint32_t* indices = must(most, sizeof *indices);
    int count = 0;
    for (int r = 0; r < strips->ribbon_count; ++r) {
        for (int i = strips->first[r]; i < strips->first[r + 1]; ++i) {
            indices[count++] = 2 * (uint32_t)i;
            indices[count++] = 2 * (uint32_t)i + 1;
        }
        indices[count++] = RIBBONS_RESTART;
    }
    hair->ribbons.indices = indices;
    hair->ribbons.index_count = count;
    gl->GenVertexArrays(1, &hair->vao);
    gl->BindVertexArray(hair->vao);
    gl->GenBuffers(1, &hair->indices);
    gl->BindBuffer(GL_ELEMENT_ARRAY_BUFFER, hair->indices);
    gl->BufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)((size_t)count * sizeof *indices), indices,
                   GL_STATIC_DRAW);
    gl->BindVertexArray(0);
}

Hair strips_hair(const Strips* strips, const Gl* gl)
{
    Hair hair;
    memset(&hair, 0, sizeof hair);
    int rows = (strips->point_count + UPDATE_WIDTH - 1) / UPDATE_WIDTH;
    size_t texels = (size_t)rows * UPDATE_WIDTH;
    Texel *at = must(texels, sizeof(Texel)), *tangents = must(texels, sizeof(Texel));
    Texel *normals = must(texels, sizeof(Texel)), *offsets = must(texels, sizeof(Texel));
    for (int i = 0; i < strips->point_count; ++i) {
        Vec3 p = strips->at[i], t = strips->tangent[i];
        const Texel a = {p.x, p.y, p.z, strips->half_width_m[i]}, b = {t.x, t.y, t.z, 0.5f};
        memcpy(at[i], a, sizeof a);
        memcpy(tangents[i], b, sizeof b);
        normals[i][3] = random_unit(0x57a1u, (uint32_t)i);
        offsets[i][3] = strips->fill[i];
    }
    hair.update.rows = rows;
    hair.update.point_count = hair.ribbons.point_count = strips->point_count;
    hair.update.targets[UPDATE_POSITIONS] = make_texture(gl, rows, at);
    hair.update.targets[UPDATE_NORMALS] = make_texture(gl, rows, normals);
    hair.update.targets[UPDATE_TANGENTS] = make_texture(gl, rows, tangents);
    hair.update.tables[TABLE_OFFSETS] = make_texture(gl, rows, offsets);
    make_indices(&hair, gl, strips);
    free(at), free(tangents), free(normals), free(offsets);
    return hair;
}

static void find_edges(Lit* lit, int i)
{
    const Strips* strips = lit->strips;
    Vec3 side = vec3_cross(strips->tangent[i], lit->axes[2]);
    float length = vec3_length(side);
    side = vec3_scale(side, length > 1e-10f ? strips->half_width_m[i] / length : 0.0f);
    for (int edge = 0; edge < 2; ++edge) {
        Vec3 p = vec3_mad(strips->at[i], side, edge ? 1.0f : -1.0f);
        lit->x[edge][i] = (double)vec3_dot(p, lit->axes[0]);
        lit->y[edge][i] = (double)vec3_dot(p, lit->axes[1]);
    }
    lit->depth[i] = -(double)vec3_dot(strips->at[i], lit->axes[2]);
}

static void find_box(Lit* lit, int r)
{
    float low_x = INFINITY, high_x = -INFINITY, low_y = INFINITY, high_y = -INFINITY;
    for (int i = lit->strips->first[r]; i < lit->strips->first[r + 1]; ++i)
        for (int edge = 0; edge < 2; ++edge) {
            low_x = fminf(low_x, (float)lit->x[edge][i]),
            high_x = fmaxf(high_x, (float)lit->x[edge][i]);
            low_y = fminf(low_y, (float)lit->y[edge][i]),
            high_y = fmaxf(high_y, (float)lit->y[edge][i]);
        }
    lit->low_x[r] = low_x - 1e-6f, lit->high_x[r] = high_x + 1e-6f;
    lit->low_y[r] = low_y - 1e-6f, lit->high_y[r] = high_y + 1e-6f;
}

Lit lit_make(const Strips* strips, Vec3 light)
{
    size_t points = (size_t)strips->point_count, ribbons = (size_t)strips->ribbon_count;
    Lit lit = {.strips = strips, .depth = must(points, sizeof(double))};
    Vec3 up = fabsf(light.y) > 0.9f ? vec3(0, 0, 1) : vec3(0, 1, 0);
    lit.axes[2] = light;
    lit.axes[0] = vec3_normalise_or(vec3_cross(up, light), vec3(1, 0, 0));
    lit.axes[1] = vec3_cross(light, lit.axes[0]);
    for (int edge = 0; edge < 2; ++edge) {
        lit.x[edge] = must(points, sizeof(double));
        lit.y[edge] = must(points, sizeof(double));
    }
    lit.low_x = must(ribbons, sizeof(float)), lit.high_x = must(ribbons, sizeof(float));
    lit.low_y = must(ribbons, sizeof(float)), lit.high_y = must(ribbons, sizeof(float));
    for (int i = 0; i < strips->point_count; ++i)
        find_edges(&lit, i);
    for (int r = 0; r < strips->ribbon_count; ++r)
        find_box(&lit, r);
    return lit;
}

void lit_free(Lit* lit)
{
    for (int edge = 0; edge < 2; ++edge) {
        free(lit->x[edge]);
        free(lit->y[edge]);
    }
    free(lit->depth);
    free(lit->low_x), free(lit->high_x), free(lit->low_y), free(lit->high_y);
    *lit = (Lit){0};
}

// A corner of a strip: point and edge.
typedef struct Corner {
    double x, y, depth, fill;
} Corner;

static Corner corner(const Lit* lit, int i, int edge)
{
    return (Corner){lit->x[edge][i], lit->y[edge][i], lit->depth[i], (double)lit->strips->fill[i]};
}

// What triangle a, b, c leaves of light at x, y when it lies before `depth`: 1 where it does not.
static double left_by(Corner a, Corner b, Corner c, double x, double y, double depth)
{
    double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if (area == 0.0) return 1.0;
    double v = ((x - a.x) * (c.y - a.y) - (y - a.y) * (c.x - a.x)) / area;
    double w = ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)) / area;
    double u = 1.0 - v - w;
    if (u < 0.0 || v < 0.0 || w < 0.0) return 1.0;
    if (u * a.depth + v * b.depth + w * c.depth >= depth) return 1.0;
    return 1.0 - (u * a.fill + v * b.fill + w * c.fill);
}

double lit_transmittance(const Lit* lit, Vec3 place, int own)
{
    double x = (double)vec3_dot(place, lit->axes[0]), y = (double)vec3_dot(place, lit->axes[1]);
    double depth = -(double)vec3_dot(place, lit->axes[2]), product = 1.0;
    for (int r = 0; r < lit->strips->ribbon_count; ++r) {
        float fx = (float)x, fy = (float)y;
        if (fx < lit->low_x[r] || fx > lit->high_x[r] || fy < lit->low_y[r] || fy > lit->high_y[r])
            continue;
        if (r == own) continue;
        for (int i = lit->strips->first[r]; i + 1 < lit->strips->first[r + 1]; ++i) {
            Corner a = corner(lit, i, 0), b = corner(lit, i, 1);
            Corner c = corner(lit, i + 1, 0), d = corner(lit, i + 1, 1);
            if (fmax(fmax(a.x, b.x), fmax(c.x, d.x)) < x ||
                fmin(fmin(a.x, b.x), fmin(c.x, d.x)) > x)
                continue;
            product *= left_by(a, b, c, x, y, depth) * left_by(c, b, d, x, y, depth);
        }
    }
    return product;
}

static const char probe_text[] =
    "#include \"transmittance.glsl\"\n"
    "uniform sampler2D places;\n"
    "out vec4 result;\n"
    "void main()\n"
    "{\n"
    "    vec3 at = texelFetch(places, ivec2(gl_FragCoord.xy), 0).xyz;\n"
    "    result = vec4(hair_transmittance(at), body_light(at, 9), 0.0, 1.0);\n"
    "}\n";

// With the shaders of the program, a probe of theirs.
static GLuint build_probe(const Gl* gl, const Shadow* shadow, Fault* fault)
{
    size_t count = 0;
    while (shader_sources[count].name != NULL)
        ++count;
    ShaderSource* sources = must(count + 2, sizeof *sources);
    memcpy(sources, shader_sources, count * sizeof *sources);
    sources[count] = (ShaderSource){"probe.frag", probe_text};
    GLuint program =
        program_build_from(gl, sources, "fullscreen.vert", "probe.frag", shadow->defines, fault);
    free(sources);
    return program;
}

bool probe_create(Probe* probe, const Gl* gl, const Shadow* shadow, Fault* fault)
{
    memset(probe, 0, sizeof *probe);
    probe->program = build_probe(gl, shadow, fault);
    if (probe->program == 0) return false;
    shadow_samplers(gl, probe->program);
    program_sampler(gl, probe->program, "places", 0);
    gl->GenVertexArrays(1, &probe->vao);
    gl->GenFramebuffers(1, &probe->framebuffer);
    probe->places = make_texture(gl, 512, NULL);
    probe->target = make_texture(gl, 512, NULL);
    gl->BindFramebuffer(GL_FRAMEBUFFER, probe->framebuffer);
    gl->FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, probe->target, 0);
    return true;
}

static int rows_of(int count)
{
    if (count > PROBE_MOST) abort();
    return (count + PROBE_WIDTH - 1) / PROBE_WIDTH;
}

void probe_put(const Probe* probe, const Gl* gl, const Vec3* places, int count)
{
    int rows = rows_of(count);
    Texel* texels = must((size_t)rows * PROBE_WIDTH, sizeof(Texel));
    for (int i = 0; i < count; ++i)
        texels[i][0] = places[i].x, texels[i][1] = places[i].y, texels[i][2] = places[i].z;
    gl->BindTexture(GL_TEXTURE_2D, probe->places);
    gl->TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, PROBE_WIDTH, rows, GL_RGBA, GL_FLOAT, texels);
    free(texels);
}

void probe_draw(const Probe* probe, const Gl* gl, const Shadow* shadow, float extinction_per_m,
                int count)
{
    gl->BindFramebuffer(GL_FRAMEBUFFER, probe->framebuffer);
    gl->Viewport(0, 0, PROBE_WIDTH, rows_of(count));
    gl->Disable(GL_DEPTH_TEST);
    gl->UseProgram(probe->program);
    shadow_bind(shadow, gl, probe->program);
    gl->Uniform1f(program_uniform(gl, probe->program, "extinction"), extinction_per_m);
    gl->BindTexture(GL_TEXTURE_2D, probe->places);
    gl->BindVertexArray(probe->vao);
    gl->DrawArrays(GL_TRIANGLES, 0, 3);
}

void probe_run(const Probe* probe, const Gl* gl, const Shadow* shadow, float extinction_per_m,
               const Vec3* places, int count, float* transmittance, float* head)
{
    int rows = rows_of(count);
    Texel* texels = must((size_t)rows * PROBE_WIDTH, sizeof(Texel));
    probe_put(probe, gl, places, count);
    probe_draw(probe, gl, shadow, extinction_per_m, count);
    gl->ReadPixels(0, 0, PROBE_WIDTH, rows, GL_RGBA, GL_FLOAT, texels);
    for (int i = 0; i < count; ++i) {
        transmittance[i] = texels[i][0];
        if (head != NULL) head[i] = texels[i][1];
    }
    free(texels);
}

void probe_free(Probe* probe, const Gl* gl)
{
    gl->DeleteProgram(probe->program);
    gl->DeleteVertexArrays(1, &probe->vao);
    gl->DeleteFramebuffers(1, &probe->framebuffer);
    gl->DeleteTextures(1, &probe->places);
    gl->DeleteTextures(1, &probe->target);
}
