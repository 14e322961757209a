// The formula as a full-screen pass: a fragment a point, into three textures.
#include "client/program.h"
#include "client/update.h"

static bool attach_targets(Update* update, const Gl* gl, Fault* fault)
{
    static const GLenum buffers[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1,
                                     GL_COLOR_ATTACHMENT2};
    gl->GenFramebuffers(1, &update->framebuffer);
    gl->BindFramebuffer(GL_FRAMEBUFFER, update->framebuffer);
    for (int i = 0; i < UPDATE_TARGETS; ++i)
        gl->FramebufferTexture2D(GL_FRAMEBUFFER, buffers[i], GL_TEXTURE_2D, update->targets[i], 0);
    gl->DrawBuffers(UPDATE_TARGETS, buffers);
    if (gl->CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return true;
    return fault_set(fault, "the driver refuses three RGBA32F targets of %dx%d", UPDATE_WIDTH,
                     update->rows);
}

static bool create(Update* update, const Gl* gl, const char* defines, Fault* fault)
{
    update->program = program_build(gl, "fullscreen.vert", "update.frag", defines, fault);
    if (update->program == 0) return false;
    update_samplers(gl, update->program);
    return attach_targets(update, gl, fault);
}

bool update_pass_create(Update* update, const Gl* gl, const Hairstyle* style, Fault* fault)
{
    (void)style;
    return create(update, gl, NULL, fault);
}

bool update_linear_create(Update* update, const Gl* gl, const Hairstyle* style, Fault* fault)
{
    (void)style;
    return create(update, gl, "#define LINEAR_FETCH\n", fault);
}

int update_pass_run(const Update* update, const Gl* gl, const UpdateGuides* guides)
{
    (void)guides;
    gl->BindFramebuffer(GL_FRAMEBUFFER, update->framebuffer);
    gl->Viewport(0, 0, UPDATE_WIDTH, update->rows);
    gl->Disable(GL_DEPTH_TEST);
    gl->UseProgram(update->program);
    gl->BindVertexArray(update->vao);
    gl->DrawArrays(GL_TRIANGLES, 0, 3);
    return 1;
}
