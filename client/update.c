#include "client/update.h"

#include "client/program.h"

#include <stdlib.h>
#include <string.h>

static GLuint float_texture(const Gl* gl, int width, int height)
{
    GLuint texture = 0;
    gl->GenTextures(1, &texture);
    gl->BindTexture(GL_TEXTURE_2D, texture);
    gl->TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, width, height, 0, GL_RGBA, GL_FLOAT, NULL);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

// `count` texels into a table: whole rows, then what is left of the last.
static GLuint table(const Gl* gl, Texel* texels, int count, int rows)
{
    GLuint texture = float_texture(gl, UPDATE_WIDTH, rows);
    int full = count / UPDATE_WIDTH, rest = count % UPDATE_WIDTH;
    if (full > 0)
        gl->TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, UPDATE_WIDTH, full, GL_RGBA, GL_FLOAT, texels);
    if (rest > 0)
        gl->TexSubImage2D(GL_TEXTURE_2D, 0, 0, full, rest, 1, GL_RGBA, GL_FLOAT,
                          texels[full * UPDATE_WIDTH]);
    return texture;
}

static bool upload_rest(Update* update, const Gl* gl, const Hairstyle* style, Fault* fault)
{
    Vec3* tangents = hairstyle_rest_tangents(style);
    if (tangents == NULL) return fault_set(fault, "no memory for tangents at rest");
    update->rest_tangents = float_texture(gl, style->nodes, style->guide_count);
    gl->TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, style->nodes, style->guide_count, GL_RGB, GL_FLOAT,
                      tangents);
    free(tangents);
    return true;
}

static void put_colliders(const Gl* gl, GLuint program, const Ribbons* ribbons)
{
    float from[HAIRSTYLE_MAX_COLLIDERS][4], to[HAIRSTYLE_MAX_COLLIDERS][4];
    for (int i = 0; i < ribbons->collider_count; ++i) {
        const Collider* c = &ribbons->colliders[i];
        memcpy(from[i], (const float[4]){c->from.x, c->from.y, c->from.z, c->radius}, 16);
        memcpy(to[i], (const float[4]){c->to.x, c->to.y, c->to.z, 0}, 16);
    }
    gl->Uniform1i(program_uniform(gl, program, "capsules"), ribbons->collider_count);
    if (ribbons->collider_count == 0) return;
    gl->Uniform4fv(program_uniform(gl, program, "capsule_from"), ribbons->collider_count, from[0]);
    gl->Uniform4fv(program_uniform(gl, program, "capsule_to"), ribbons->collider_count, to[0]);
}

static bool build_program(Update* update, const Gl* gl, const Hairstyle* style,
                          const Ribbons* ribbons, Fault* fault)
{
    update->program = program_build(gl, "fullscreen.vert", "update.frag", NULL, fault);
    if (update->program == 0) return false;
    static const char* const samplers[] = {"guide_positions", "guide_tangents", "rest_tangents",
                                           "table_guides",    "table_weights",  "table_offsets",
                                           "table_tangents",  "table_normals"};
    for (int i = 0; i < 8; ++i)
        program_sampler(gl, update->program, samplers[i], i);
    gl->UseProgram(update->program);
    program_uniform3(gl, update->program, "box_low", style->box.low);
    program_uniform3(gl, update->program, "box_size", vec3_sub(style->box.high, style->box.low));
    put_colliders(gl, update->program, ribbons);
    update->blend = program_uniform(gl, update->program, "blend");
    update->newest = program_uniform(gl, update->program, "newest");
    return true;
}

static bool build_targets(Update* update, const Gl* gl, Fault* fault)
{
    static const GLenum buffers[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1,
                                     GL_COLOR_ATTACHMENT2};
    gl->GenFramebuffers(1, &update->framebuffer);
    gl->BindFramebuffer(GL_FRAMEBUFFER, update->framebuffer);
    for (int i = 0; i < UPDATE_TARGETS; ++i) {
        update->targets[i] = float_texture(gl, UPDATE_WIDTH, update->rows);
        gl->FramebufferTexture2D(GL_FRAMEBUFFER, buffers[i], GL_TEXTURE_2D, update->targets[i], 0);
    }
    gl->DrawBuffers(UPDATE_TARGETS, buffers);
    if (gl->CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return true;
    return fault_set(fault, "the driver refuses three RGBA32F targets of %dx%d", UPDATE_WIDTH,
                     update->rows);
}

bool update_create(Update* update, const Gl* gl, const Hairstyle* style, const Ribbons* ribbons,
                   Fault* fault)
{
    memset(update, 0, sizeof *update);
    update->point_count = ribbons->point_count;
    update->rows = (ribbons->point_count + UPDATE_WIDTH - 1) / UPDATE_WIDTH;
    if (update->rows < 1) update->rows = 1;
    if (update->rows > gl->max_texture_size)
        return fault_set(fault, "%d ribbon points need a texture of %d rows; this GL stops at %d",
                         ribbons->point_count, update->rows, gl->max_texture_size);
    Texel* const texels[UPDATE_TABLES] = {ribbons->guides, ribbons->weights, ribbons->offsets,
                                          ribbons->tangents, ribbons->normals};
    for (int i = 0; i < UPDATE_TABLES; ++i)
        update->tables[i] = table(gl, texels[i], ribbons->point_count, update->rows);
    gl->GenVertexArrays(1, &update->vao);
    if (upload_rest(update, gl, style, fault) && build_program(update, gl, style, ribbons, fault) &&
        build_targets(update, gl, fault))
        return true;
    update_free(update, gl);
    return false;
}

void update_free(Update* update, const Gl* gl)
{
    gl->DeleteProgram(update->program);
    gl->DeleteFramebuffers(1, &update->framebuffer);
    gl->DeleteVertexArrays(1, &update->vao);
    gl->DeleteTextures(UPDATE_TARGETS, update->targets);
    gl->DeleteTextures(UPDATE_TABLES, update->tables);
    gl->DeleteTextures(1, &update->rest_tangents);
    memset(update, 0, sizeof *update);
}

static void bind(const Gl* gl, GLenum unit, GLenum target, GLuint texture)
{
    gl->ActiveTexture(GL_TEXTURE0 + unit);
    gl->BindTexture(target, texture);
}

void update_run(const Update* update, const Gl* gl, const GuideTextures* textures, float blend)
{
    gl->BindFramebuffer(GL_FRAMEBUFFER, update->framebuffer);
    gl->Viewport(0, 0, UPDATE_WIDTH, update->rows);
    gl->Disable(GL_DEPTH_TEST);
    gl->UseProgram(update->program);
    gl->Uniform1f(update->blend, blend);
    gl->Uniform1uiv(update->newest, HAIRSTYLE_MAX_GUIDES / 32, textures->newest);
    bind(gl, 0, GL_TEXTURE_2D_ARRAY, textures->positions);
    bind(gl, 1, GL_TEXTURE_2D_ARRAY, textures->tangents);
    bind(gl, 2, GL_TEXTURE_2D, update->rest_tangents);
    for (GLenum i = 0; i < UPDATE_TABLES; ++i)
        bind(gl, 3 + i, GL_TEXTURE_2D, update->tables[i]);
    gl->BindVertexArray(update->vao);
    gl->DrawArrays(GL_TRIANGLES, 0, 3);
    gl->ActiveTexture(GL_TEXTURE0);
}
