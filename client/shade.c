#include "client/shade.h"

#include "client/extent.h"
#include "client/program.h"

#include <stdio.h>
#include <string.h>

// How fast hair dims light: e-fold in 11 mm. Chosen by eye: less looks like glass, more hides the
// locks.
#define EXTINCTION_PER_M 90.0f

ShadeOptions shade_default(void)
{
    return (ShadeOptions){.width = 1024,
                          .height = 768,
                          .samples = 4,
                          .shading = shading_default(),
                          // The three lights of a photographer, 3 : 0.6 : 2.
                          .light_strength = {3.0f, 0.6f, 2.0f, 0.25f},
                          .shadow = shadow_default(),
                          .light_yaw_deg = 40.0f,
                          .light_pitch_deg = 45.0f};
}

static bool complete(const Gl* gl, const char* what, Fault* fault)
{
    if (gl->CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return true;
    return fault_set(fault, "the driver refuses the %s framebuffer", what);
}

static bool create_multisampled(Shade* shade, const Gl* gl, Fault* fault)
{
    int width = shade->options.width, height = shade->options.height;
    gl->GenFramebuffers(1, &shade->multisampled);
    gl->BindFramebuffer(GL_FRAMEBUFFER, shade->multisampled);
    gl->GenRenderbuffers(1, &shade->colour);
    gl->BindRenderbuffer(GL_RENDERBUFFER, shade->colour);
    int samples = shade->samples > 1 ? shade->samples : 0;
    gl->RenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_RGBA16F, width, height);
    gl->FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                                shade->colour);
    gl->GenRenderbuffers(1, &shade->depth);
    gl->BindRenderbuffer(GL_RENDERBUFFER, shade->depth);
    gl->RenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_DEPTH_COMPONENT32F, width,
                                       height);
    gl->FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, shade->depth);
    if (!complete(gl, "multisampled", fault)) return false;
    // A driver may give more than was asked (llvmpipe has 1 or 4); the sample mask must know.
    GLint given = 0;
    gl->GetIntegerv(GL_SAMPLES, &given);
    if (shade->samples > 1 && given > 1) shade->samples = given;
    return true;
}

// One sample a pixel, of the picture's size.
static bool create_target(const Shade* shade, const Gl* gl, GLint format, GLuint* framebuffer,
                          GLuint* texture, Fault* fault)
{
    gl->GenFramebuffers(1, framebuffer);
    gl->BindFramebuffer(GL_FRAMEBUFFER, *framebuffer);
    gl->GenTextures(1, texture);
    gl->BindTexture(GL_TEXTURE_2D, *texture);
    gl->TexImage2D(GL_TEXTURE_2D, 0, format, shade->options.width, shade->options.height, 0,
                   GL_RGBA, format == GL_RGBA8 ? GL_UNSIGNED_BYTE : GL_FLOAT, NULL);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    gl->FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, *texture, 0);
    return complete(gl, "output", fault);
}

static GLuint build_hair(const Shade* shade, const Gl* gl, TransparencyStep step, Fault* fault)
{
    char defines[TRANSPARENCY_DEFINES + 64];
    transparency_defines(defines, shade->transparency, shade->samples, step);
    strcat(defines, hair_defines(update_paths[shade->options.update].evaluated));
    GLuint program = program_build(gl, "hair.vert", "hair.frag", defines, fault);
    if (program == 0) return 0;
    hair_samplers(gl, program);
    light_samplers(gl, program);
    return program;
}

static bool build_programs(Shade* shade, const Gl* gl, const Shadow* shadow, Fault* fault)
{
    bool pre_z = shade->options.pre_z;
    shade->transparency = transparency_choose(shade->options.transparency, shade->samples);
    shade->hair_program = build_hair(shade, gl, pre_z ? STEP_AFTER_DEPTH : STEP_ALONE, fault);
    if (shade->hair_program == 0) return false;
    if (pre_z) shade->depth_program = build_hair(shade, gl, STEP_DEPTH, fault);
    if (pre_z && shade->depth_program == 0) return false;
    char defines[SHADING_DEFINES_BYTES + SHADOW_DEFINES_BYTES];
    shading_defines(&shade->options.shading, defines);
    strcat(defines, shadow->defines);
    shade->body_program = program_build(gl, "body.vert", "body.frag", defines, fault);
    if (shade->body_program == 0) return false;
    shading_samplers(gl, shade->body_program);
    shadow_samplers(gl, shade->body_program);
    shade->background_program =
        program_build(gl, "fullscreen.vert", "background.frag", NULL, fault);
    if (shade->background_program == 0) return false;
    shade->resolve_program = program_build(gl, "fullscreen.vert", "resolve.frag", NULL, fault);
    if (shade->resolve_program == 0) return false;
    program_sampler(gl, shade->resolve_program, "radiance", 0);
    return true;
}

static void place_lights(Shade* shade)
{
    float yaw = shade->options.light_yaw_deg, pitch = shade->options.light_pitch_deg;
    shade->lights.key = camera_direction(yaw, pitch);
    shade->lights.fill = camera_direction(yaw - 100.0f, 10.0f);
    shade->lights.rim = camera_direction(yaw + 120.0f, 35.0f);
    memcpy(shade->lights.strength, shade->options.light_strength, sizeof shade->lights.strength);
    shade->lights.extinction_per_m = EXTINCTION_PER_M;
}

void shade_set_light(Shade* shade, float yaw_deg, float pitch_deg)
{
    shade->options.light_yaw_deg = yaw_deg;
    shade->options.light_pitch_deg = pitch_deg;
    place_lights(shade);
}

static void draw_background(const Shade* shade, const Gl* gl)
{
    Vec3 low = {0.055f, 0.06f, 0.07f}, high = {0.30f, 0.31f, 0.33f};
    if (shade->options.has_background) low = high = shade->options.background;
    gl->UseProgram(shade->background_program);
    program_uniform3(gl, shade->background_program, "background_low", low);
    program_uniform3(gl, shade->background_program, "background_high", high);
    gl->Uniform1i(program_uniform(gl, shade->background_program, "coverage_only"),
                  shade->options.view != VIEW_SHADED);
    gl->Disable(GL_DEPTH_TEST);
    gl->BindVertexArray(shade->vao);
    gl->DrawArrays(GL_TRIANGLES, 0, 3);
    gl->Enable(GL_DEPTH_TEST);
}

static void resolve(const Shade* shade, const Gl* gl, GLuint into)
{
    int width = shade->options.width, height = shade->options.height;
    gl->BindFramebuffer(GL_READ_FRAMEBUFFER, shade->multisampled);
    gl->BindFramebuffer(GL_DRAW_FRAMEBUFFER, shade->resolved);
    gl->BlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    gl->BindFramebuffer(GL_FRAMEBUFFER, into);
    gl->Disable(GL_DEPTH_TEST);
    gl->UseProgram(shade->resolve_program);
    gl->Uniform1i(program_uniform(gl, shade->resolve_program, "coverage_only"),
                  shade->options.view == VIEW_COVERAGE);
    gl->Uniform1i(program_uniform(gl, shade->resolve_program, "transmittance_only"),
                  shade->options.view == VIEW_TRANSMITTANCE);
    gl->ActiveTexture(GL_TEXTURE0);
    gl->BindTexture(GL_TEXTURE_2D, shade->resolved_texture);
    gl->BindVertexArray(shade->vao);
    gl->DrawArrays(GL_TRIANGLES, 0, 3);
}

// The backdrop stays the same from picture to picture.
static void keep_backdrop(const Shade* shade, const Gl* gl)
{
    gl->BindFramebuffer(GL_FRAMEBUFFER, shade->multisampled);
    gl->Viewport(0, 0, shade->options.width, shade->options.height);
    draw_background(shade, gl);
    resolve(shade, gl, shade->backdrop);
}

bool shade_create(Shade* shade, const Gl* gl, const ShadeOptions* options, const Shadow* shadow,
                  Fault* fault)
{
    memset(shade, 0, sizeof *shade);
    shade->options = *options;
    int limit = gl->sample_mask ? gl->max_samples : 1;
    shade->samples = options->samples < limit ? options->samples : limit;
    place_lights(shade);
    gl->GenVertexArrays(1, &shade->vao);
    if (create_multisampled(shade, gl, fault) && build_programs(shade, gl, shadow, fault) &&
        create_target(shade, gl, GL_RGBA16F, &shade->resolved, &shade->resolved_texture, fault) &&
        create_target(shade, gl, GL_RGBA8, &shade->backdrop, &shade->backdrop_texture, fault) &&
        create_target(shade, gl, GL_RGBA8, &shade->output, &shade->output_texture, fault)) {
        keep_backdrop(shade, gl);
        return true;
    }
    shade_free(shade, gl);
    return false;
}

void shade_free(Shade* shade, const Gl* gl)
{
    gl->DeleteProgram(shade->hair_program);
    gl->DeleteProgram(shade->depth_program);
    gl->DeleteProgram(shade->body_program);
    gl->DeleteProgram(shade->background_program);
    gl->DeleteProgram(shade->resolve_program);
    gl->DeleteFramebuffers(1, &shade->multisampled);
    gl->DeleteFramebuffers(1, &shade->resolved);
    gl->DeleteFramebuffers(1, &shade->output);
    gl->DeleteFramebuffers(1, &shade->backdrop);
    gl->DeleteRenderbuffers(1, &shade->colour);
    gl->DeleteRenderbuffers(1, &shade->depth);
    gl->DeleteTextures(1, &shade->resolved_texture);
    gl->DeleteTextures(1, &shade->output_texture);
    gl->DeleteTextures(1, &shade->backdrop_texture);
    gl->DeleteVertexArrays(1, &shade->vao);
    memset(shade, 0, sizeof *shade);
}

float shade_pixel_angle(const Shade* shade, const Camera* camera)
{
    return 2.0f / camera->projection.m[1][1] / (float)shade->options.height;
}

// What hair.frag and body.frag share.
static void use_program(const Shade* shade, const Gl* gl, GLuint program, const Shadow* shadow,
                        const Hair* hair, const Frame* frame)
{
    const Camera* camera = &frame->camera;
    const HairMaterial* material = &hair->material;
    Mat4 view_projection = matrix_mul(&camera->projection, &camera->view);
    gl->UseProgram(program);
    gl->UniformMatrix4fv(program_uniform(gl, program, "view_projection"), 1, GL_FALSE,
                         &view_projection.m[0][0]);
    gl->UniformMatrix3fv(program_uniform(gl, program, "head_rotation"), 1, GL_TRUE,
                         frame->rotation);
    program_uniform3(gl, program, "eye", camera->eye);
    lights_bind(&shade->lights, gl, program);
    program_uniform3(gl, program, "root_colour", material->root_colour);
    gl->Uniform1f(program_uniform(gl, program, "pixel_angle"), shade_pixel_angle(shade, camera));
    gl->Uniform1i(program_uniform(gl, program, "coverage_only"),
                  shade->options.view == VIEW_COVERAGE);
    gl->Uniform1i(program_uniform(gl, program, "transmittance_only"),
                  shade->options.view == VIEW_TRANSMITTANCE);
    shadow_bind(shadow, gl, program);
}

bool shade_sorts(const Shade* shade, OrderBy* by, bool* far_first)
{
    ShadeSort sort = shade->options.sort;
    *far_first = transparency_variants[shade->transparency].blends;
    *by = sort == SORT_WISPS ? ORDER_WISPS : ORDER_SEGMENTS;
    return sort == SORT_AUTO ? *far_first : sort != SORT_OFF;
}

// One step of hair, with its program in use. Returns the draw calls.
static int draw_hair(const Shade* shade, const Gl* gl, const Hair* hair, GLuint fibres,
                     TransparencyStep step)
{
    OrderBy by;
    bool far_first;
    transparency_begin(gl, shade->transparency, shade->samples, step);
    int calls = shade_sorts(shade, &by, &far_first) ? hair_draw_sorted(hair, gl, fibres)
                                                    : hair_draw(hair, gl, fibres);
    transparency_end(gl);
    return calls;
}

// Leaves only the part of the picture to be drawn that can hold hair or head.
static void put_backdrop(const Shade* shade, const Gl* gl, const Frame* frame)
{
    int width = shade->options.width, height = shade->options.height;
    gl->BindFramebuffer(GL_READ_FRAMEBUFFER, shade->backdrop);
    gl->BindFramebuffer(GL_DRAW_FRAMEBUFFER, shade->output);
    gl->BlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    Mat4 view_projection = matrix_mul(&frame->camera.projection, &frame->camera.view);
    Extent seen = extent_seen(&view_projection, frame->drawn, width, height);
    gl->Scissor(seen.x, seen.y, seen.width, seen.height);
    gl->Enable(GL_SCISSOR_TEST);
}

int shade_run(const Shade* shade, const Gl* gl, const Hair* hair, const Shadow* shadow,
              const Light* light, const Frame* frame)
{
    put_backdrop(shade, gl, frame);
    gl->BindFramebuffer(GL_FRAMEBUFFER, shade->multisampled);
    gl->Viewport(0, 0, shade->options.width, shade->options.height);
    if (shade->samples > 1) gl->Enable(GL_MULTISAMPLE);
    gl->DepthMask(GL_TRUE);
    gl->ClearDepth(1.0);
    gl->Clear(GL_DEPTH_BUFFER_BIT);
    draw_background(shade, gl);
    use_program(shade, gl, shade->body_program, shadow, hair, frame);
    shading_bind(&light->shading, gl, shade->body_program);
    const Body* body = hair_body(hair, frame->pixel_m);
    gl->Uniform1i(program_uniform(gl, shade->body_program, "fine_mesh"), body->is_mannequin);
    int calls = body_draw(body, gl);
    light_show(light, gl);
    if (shade->options.pre_z) {
        use_program(shade, gl, shade->depth_program, shadow, hair, frame);
        calls += draw_hair(shade, gl, hair, shadow->fibres, STEP_DEPTH);
    }
    use_program(shade, gl, shade->hair_program, shadow, hair, frame);
    calls += draw_hair(shade, gl, hair, shadow->fibres,
                       shade->options.pre_z ? STEP_AFTER_DEPTH : STEP_ALONE);
    resolve(shade, gl, shade->output);
    gl->Disable(GL_SCISSOR_TEST);
    return calls + 2; // and background and resolve
}

void shade_read(const Shade* shade, const Gl* gl, Image* image)
{
    gl->BindFramebuffer(GL_FRAMEBUFFER, shade->output);
    gl->ReadBuffer(GL_COLOR_ATTACHMENT0);
    gl->PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl->ReadPixels(0, 0, image->width, image->height, GL_RGBA, GL_UNSIGNED_BYTE, image->rgba);
    image_flip(image);
}
