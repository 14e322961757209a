#include "client/shadow.h"

#include "client/program.h"

#include <string.h>

static bool create_map(ShadowMap* map, const Gl* gl, Fault* fault)
{
    gl->GenTextures(1, &map->texture);
    gl->BindTexture(GL_TEXTURE_2D, map->texture);
    gl->TexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, SHADOW_SIZE, SHADOW_SIZE, 0,
                   GL_DEPTH_COMPONENT, GL_FLOAT, NULL);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    gl->GenFramebuffers(1, &map->framebuffer);
    gl->BindFramebuffer(GL_FRAMEBUFFER, map->framebuffer);
    gl->FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, map->texture, 0);
    static const GLenum none = GL_NONE;
    gl->DrawBuffers(1, &none);
    gl->ReadBuffer(GL_NONE);
    if (gl->CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return true;
    return fault_set(fault, "the driver refuses a %d x %d depth texture", SHADOW_SIZE, SHADOW_SIZE);
}

bool shadow_create(Shadow* shadow, const Gl* gl, GLuint fibres, Fault* fault)
{
    memset(shadow, 0, sizeof *shadow);
    shadow->fibres = fibres;
    shadow->hair_program = program_build(gl, "hair_depth.vert", "hair_depth.frag", NULL, fault);
    if (shadow->hair_program == 0) return false;
    hair_samplers(gl, shadow->hair_program);
    shadow->body_program = program_build(gl, "body_depth.vert", "body_depth.frag", NULL, fault);
    return shadow->body_program != 0 && create_map(&shadow->hair, gl, fault) &&
           create_map(&shadow->body, gl, fault);
}

static void free_map(ShadowMap* map, const Gl* gl)
{
    gl->DeleteTextures(1, &map->texture);
    gl->DeleteFramebuffers(1, &map->framebuffer);
}

void shadow_free(Shadow* shadow, const Gl* gl)
{
    free_map(&shadow->hair, gl);
    free_map(&shadow->body, gl);
    gl->DeleteProgram(shadow->hair_program);
    gl->DeleteProgram(shadow->body_program);
    memset(shadow, 0, sizeof *shadow);
}

// An orthographic view from the light that holds the sphere round `box`. The sphere, not the box,
// so that texels keep their size while the head turns and shadows do not crawl.
static void fit(ShadowMap* map, Vec3 light, Box box)
{
    Vec3 middle = vec3_scale(vec3_add(box.low, box.high), 0.5f);
    float radius = 0.5f * vec3_length(vec3_sub(box.high, box.low)) + 0.005f;
    Vec3 from = vec3_mad(middle, light, radius);
    bool steep = fabsf(light.y) > 0.95f;
    const float up[3] = {0, steep ? 0 : 1, steep ? 1 : 0};
    const float eye[3] = {from.x, from.y, from.z}, to[3] = {middle.x, middle.y, middle.z};
    Mat4 view = matrix_look_at(eye, to, up), ortho = matrix_ortho(radius);
    map->matrix = matrix_mul(&ortho, &view);
    map->span_m = 2.0f * radius;
}

static void begin(const ShadowMap* map, const Gl* gl, GLuint program, const float rotation[9])
{
    gl->BindFramebuffer(GL_FRAMEBUFFER, map->framebuffer);
    gl->Viewport(0, 0, SHADOW_SIZE, SHADOW_SIZE);
    gl->Enable(GL_DEPTH_TEST);
    gl->DepthMask(GL_TRUE);
    gl->ClearDepth(1.0);
    gl->Clear(GL_DEPTH_BUFFER_BIT);
    gl->UseProgram(program);
    gl->UniformMatrix4fv(program_uniform(gl, program, "light_matrix"), 1, GL_FALSE,
                         &map->matrix.m[0][0]);
    gl->UniformMatrix3fv(program_uniform(gl, program, "head_rotation"), 1, GL_TRUE, rotation);
}

// The box round a rotated box.
static Box rotate_box(Box box, const float r[9])
{
    Vec3 middle = vec3_scale(vec3_add(box.low, box.high), 0.5f);
    Vec3 half = vec3_scale(vec3_sub(box.high, box.low), 0.5f);
    Vec3 m = vec3(r[0] * middle.x + r[1] * middle.y + r[2] * middle.z,
                  r[3] * middle.x + r[4] * middle.y + r[5] * middle.z,
                  r[6] * middle.x + r[7] * middle.y + r[8] * middle.z);
    Vec3 h = vec3(fabsf(r[0]) * half.x + fabsf(r[1]) * half.y + fabsf(r[2]) * half.z,
                  fabsf(r[3]) * half.x + fabsf(r[4]) * half.y + fabsf(r[5]) * half.z,
                  fabsf(r[6]) * half.x + fabsf(r[7]) * half.y + fabsf(r[8]) * half.z);
    return (Box){vec3_sub(m, h), vec3_add(m, h)};
}

int shadow_run(Shadow* shadow, const Gl* gl, const Hair* hair, Vec3 light, const Frame* frame)
{
    fit(&shadow->hair, light, frame->bounds);
    begin(&shadow->hair, gl, shadow->hair_program, frame->rotation);
    program_uniform3(gl, shadow->hair_program, "light_direction", light);
    int calls = hair_draw(hair, gl, shadow->fibres);
    Box body =
        hair->body.index_count > 0 ? rotate_box(hair->body.box, frame->rotation) : frame->bounds;
    fit(&shadow->body, light, body);
    begin(&shadow->body, gl, shadow->body_program, frame->rotation);
    return calls + body_draw(&hair->body, gl);
}

void shadow_samplers(const Gl* gl, GLuint program)
{
    program_sampler(gl, program, "hair_depth", UNIT_FREE);
    program_sampler(gl, program, "body_depth", UNIT_FREE + 1);
}

static void bind_map(const ShadowMap* map, const Gl* gl, GLenum unit, GLint matrix, GLint span)
{
    gl->ActiveTexture(GL_TEXTURE0 + unit);
    gl->BindTexture(GL_TEXTURE_2D, map->texture);
    gl->UniformMatrix4fv(matrix, 1, GL_FALSE, &map->matrix.m[0][0]);
    gl->Uniform1f(span, map->span_m);
}

void shadow_bind(const Shadow* shadow, const Gl* gl, GLuint program)
{
    bind_map(&shadow->hair, gl, UNIT_FREE, program_uniform(gl, program, "hair_light_matrix"),
             program_uniform(gl, program, "hair_light_span"));
    bind_map(&shadow->body, gl, UNIT_FREE + 1, program_uniform(gl, program, "body_light_matrix"),
             program_uniform(gl, program, "body_light_span"));
    gl->ActiveTexture(GL_TEXTURE0);
}
