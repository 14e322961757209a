#include "client/shadow_map.h"

#include "client/program.h"

bool shadow_map_create(ShadowMap* map, const Gl* gl, int size, Fault* fault)
{
    gl->GenTextures(1, &map->texture);
    gl->BindTexture(GL_TEXTURE_2D, map->texture);
    gl->TexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, size, size, 0, GL_DEPTH_COMPONENT,
                   GL_FLOAT, NULL);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    gl->GenFramebuffers(1, &map->framebuffer);
    gl->BindFramebuffer(GL_FRAMEBUFFER, map->framebuffer);
    gl->FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, map->texture, 0);
    static const GLenum none = GL_NONE;
    gl->DrawBuffers(1, &none);
    gl->ReadBuffer(GL_NONE);
    if (gl->CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return true;
    return fault_set(fault, "the driver refuses a %d x %d depth texture", size, size);
}

void shadow_map_free(ShadowMap* map, const Gl* gl)
{
    gl->DeleteTextures(1, &map->texture);
    gl->DeleteFramebuffers(1, &map->framebuffer);
}

void shadow_map_use(const ShadowMap* map, const Gl* gl, GLuint framebuffer, GLuint program,
                    int size, Vec3 light, const float rotation[9])
{
    gl->BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    gl->Viewport(0, 0, size, size);
    gl->UseProgram(program);
    gl->UniformMatrix4fv(program_uniform(gl, program, "light_matrix"), 1, GL_FALSE,
                         &map->matrix.m[0][0]);
    gl->UniformMatrix3fv(program_uniform(gl, program, "head_rotation"), 1, GL_TRUE, rotation);
    program_uniform3(gl, program, "light_direction", light);
}

int shadow_map_draw_hair(const Shadow* shadow, const Gl* gl, const Hair* hair, Vec3 light,
                         const float rotation[9], float least_m)
{
    const ShadowMap* map = &shadow->hair;
    shadow_map_use(map, gl, map->framebuffer, shadow->hair_program, shadow->size, light, rotation);
    gl->Enable(GL_DEPTH_TEST);
    gl->DepthMask(GL_TRUE);
    gl->ClearDepth(1.0);
    gl->Clear(GL_DEPTH_BUFFER_BIT);
    gl->Uniform1f(program_uniform(gl, shadow->hair_program, "texel_m"), least_m);
    gl->Enable(GL_DEPTH_CLAMP); // hair before the near plane shades what is behind it too
    int calls = hair_draw(hair, gl, shadow->fibres);
    gl->Disable(GL_DEPTH_CLAMP);
    return calls;
}
