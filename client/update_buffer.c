// The formula a vertex a point, into vertex buffers by transform feedback: what "render to vertex
// buffer" of old has become. Ribbons have two vertices a point and the light pass none, so all that
// follows reads textures, and buffers are copied to them without the CPU.
#include "client/program.h"
#include "client/update.h"

bool update_buffer_create(Update* update, const Gl* gl, const Hairstyle* style, Fault* fault)
{
    (void)style;
    update->program =
        program_build_feedback(gl, "update.vert", update_captured, UPDATE_TARGETS, NULL, fault);
    if (update->program == 0) return false;
    update_samplers(gl, update->program);
    gl->GenBuffers(UPDATE_TARGETS, update->feedback);
    for (int i = 0; i < UPDATE_TARGETS; ++i) {
        gl->BindBuffer(GL_TRANSFORM_FEEDBACK_BUFFER, update->feedback[i]);
        gl->BufferData(GL_TRANSFORM_FEEDBACK_BUFFER,
                       (GLsizeiptr)((size_t)(update->point_count + 1) * sizeof(Texel)), NULL,
                       GL_DYNAMIC_COPY);
    }
    gl->BindBuffer(GL_TRANSFORM_FEEDBACK_BUFFER, 0);
    return true;
}

int update_buffer_run(const Update* update, const Gl* gl, const UpdateGuides* guides)
{
    (void)guides;
    gl->UseProgram(update->program);
    gl->BindVertexArray(update->vao);
    for (GLuint i = 0; i < UPDATE_TARGETS; ++i)
        gl->BindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, i, update->feedback[i]);
    gl->Enable(GL_RASTERIZER_DISCARD);
    gl->BeginTransformFeedback(GL_POINTS);
    gl->DrawArrays(GL_POINTS, 0, update->point_count);
    gl->EndTransformFeedback();
    gl->Disable(GL_RASTERIZER_DISCARD);
    for (GLuint i = 0; i < UPDATE_TARGETS; ++i)
        gl->BindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, i, 0);
    for (int i = 0; i < UPDATE_TARGETS; ++i) {
        gl->BindBuffer(GL_PIXEL_UNPACK_BUFFER, update->feedback[i]);
        update_put_texels(gl, update->targets[i], update->point_count, NULL);
    }
    gl->BindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
    return 1;
}
