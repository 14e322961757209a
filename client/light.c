#include "client/light.h"

#include "client/program.h"

#include <string.h>

bool light_create(Light* light, const Gl* gl, const ShadingOptions* shading, const Shadow* shadow,
                  Fault* fault)
{
    memset(light, 0, sizeof *light);
    char defines[SHADING_DEFINES_BYTES + SHADOW_DEFINES_BYTES + 32];
    shading_defines(shading, defines);
    strcat(defines, shadow->defines);
    light->each = shadow->options.all_lights;
    if (light->each) strcat(defines, "#define EACH_LIGHT\n");
    if (!shading_create(&light->shading, gl, shading, fault)) return false;
    light->program = program_build(gl, "fullscreen.vert", "light.frag", defines, fault);
    if (light->program == 0) return false;
    shading_samplers(gl, light->program);
    hair_samplers(gl, light->program);
    shadow_samplers(gl, light->program);
    gl->GenVertexArrays(1, &light->vao);
    gl->GenFramebuffers(1, &light->framebuffer);
    return true;
}

void light_free(Light* light, const Gl* gl)
{
    shading_free(&light->shading, gl);
    gl->DeleteProgram(light->program);
    gl->DeleteVertexArrays(1, &light->vao);
    gl->DeleteFramebuffers(1, &light->framebuffer);
    gl->DeleteTextures(LIGHT_TARGETS, light->targets);
    memset(light, 0, sizeof *light);
}

static GLuint create_target(const Gl* gl, int rows)
{
    GLuint target;
    gl->GenTextures(1, &target);
    gl->BindTexture(GL_TEXTURE_2D, target);
    gl->TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA16F, UPDATE_WIDTH, rows, 0, GL_RGBA, GL_FLOAT, NULL);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return target;
}

// False where the driver cannot draw into them.
static bool attach(const Light* light, const Gl* gl, const GLuint targets[LIGHT_TARGETS])
{
    static const GLenum buffers[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    gl->BindFramebuffer(GL_FRAMEBUFFER, light->framebuffer);
    for (int i = 0; i < LIGHT_TARGETS; ++i)
        gl->FramebufferTexture2D(GL_FRAMEBUFFER, buffers[i], GL_TEXTURE_2D, targets[i], 0);
    gl->DrawBuffers(LIGHT_TARGETS, buffers);
    return gl->CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

bool light_fit(Light* light, const Gl* gl, const Update* update, Fault* fault)
{
    GLuint targets[LIGHT_TARGETS];
    for (int i = 0; i < LIGHT_TARGETS; ++i)
        targets[i] = create_target(gl, update->rows);
    if (!attach(light, gl, targets)) {
        attach(light, gl, light->targets);
        gl->DeleteTextures(LIGHT_TARGETS, targets);
        return fault_set(fault, "the driver refuses two RGBA16F targets of %dx%d", UPDATE_WIDTH,
                         update->rows);
    }
    gl->DeleteTextures(LIGHT_TARGETS, light->targets);
    memcpy(light->targets, targets, sizeof targets);
    light->rows = update->rows;
    return true;
}

void lights_bind(const Lights* lights, const Gl* gl, GLuint program)
{
    program_uniform3(gl, program, "key_direction", lights->key);
    program_uniform3(gl, program, "fill_direction", lights->fill);
    program_uniform3(gl, program, "rim_direction", lights->rim);
    gl->Uniform4fv(program_uniform(gl, program, "light_strength"), 1, lights->strength);
    gl->Uniform1f(program_uniform(gl, program, "extinction"), lights->extinction_per_m);
}

void light_samplers(const Gl* gl, GLuint program)
{
    program_sampler(gl, program, "light_body", UNIT_FREE + 2);
    program_sampler(gl, program, "light_shine", UNIT_FREE + 3);
}

void light_show(const Light* light, const Gl* gl)
{
    for (GLenum i = 0; i < LIGHT_TARGETS; ++i) {
        gl->ActiveTexture(GL_TEXTURE0 + UNIT_FREE + 2 + i);
        gl->BindTexture(GL_TEXTURE_2D, light->targets[i]);
    }
    gl->ActiveTexture(GL_TEXTURE0);
}

// One light after another, each with its own shadows; their radiances add up in the targets.
static int draw_each(const Light* light, const Gl* gl, const Shadow* const* shadows,
                     const Lights* lights)
{
    const Vec3 directions[LIGHT_SKY] = {lights->key, lights->fill, lights->rim};
    gl->BlendFunc(GL_ONE, GL_ONE);
    for (int i = 0; i < LIGHT_SKY; ++i) {
        if (i == 1) gl->Enable(GL_BLEND); // the first replaces what the last picture left
        shadow_bind(shadows[i], gl, light->program);
        program_uniform3(gl, light->program, "light_direction", directions[i]);
        gl->Uniform1f(program_uniform(gl, light->program, "irradiance"), lights->strength[i]);
        gl->DrawArrays(GL_TRIANGLES, 0, 3);
    }
    gl->Disable(GL_BLEND);
    return LIGHT_SKY;
}

int light_run(Light* light, const Gl* gl, const Hair* hair, const Shadow* const* shadows,
              const Lights* lights, const Frame* frame, bool transmittance)
{
    shading_update(&light->shading, gl, &hair->material);
    gl->BindFramebuffer(GL_FRAMEBUFFER, light->framebuffer);
    gl->Viewport(0, 0, UPDATE_WIDTH, light->rows);
    gl->Disable(GL_DEPTH_TEST);
    gl->UseProgram(light->program);
    gl->UniformMatrix3fv(program_uniform(gl, light->program, "head_rotation"), 1, GL_TRUE,
                         frame->rotation);
    program_uniform3(gl, light->program, "eye", frame->camera.eye);
    program_uniform3(gl, light->program, "root_colour", hair->material.root_colour);
    program_uniform3(gl, light->program, "tip_colour", hair->material.tip_colour);
    gl->Uniform1i(program_uniform(gl, light->program, "transmittance_only"), transmittance);
    lights_bind(lights, gl, light->program);
    shadow_bind(shadows[LIGHT_KEY], gl, light->program);
    shading_bind(&light->shading, gl, light->program);
    hair_bind_points(hair, gl);
    gl->BindVertexArray(light->vao);
    if (light->each && !transmittance) return draw_each(light, gl, shadows, lights);
    gl->DrawArrays(GL_TRIANGLES, 0, 3);
    return 1;
}
