#include "client/update.h"

#include "client/program.h"

#include <stdlib.h>
#include <string.h>

#define BLOCK_BINDING 0

const UpdatePath update_paths[] = {
    {.name = "pass",
     .help = "a fragment a point, into textures",
     .create = update_pass_create,
     .run = update_pass_run},
    {.name = "buffer",
     .help = "a vertex a point, fed back into buffers and copied to textures",
     .create = update_buffer_create,
     .run = update_buffer_run},
    {.name = "vertex", .help = "wherever a point is asked for, nothing kept", .evaluated = true},
    {.name = "cpu",
     .help = "on the CPU, uploaded to textures",
     .create = update_cpu_create,
     .run = update_cpu_run},
    // The thesis, 5.5: straight between nodes, and as exact as the texture unit's weights.
    {.name = "linear",
     .help = "as pass, but guides straight between nodes, by the texture unit's filter",
     .create = update_linear_create,
     .run = update_pass_run},
    {0}};

const char* const update_captured[UPDATE_TARGETS] = {"out_position", "out_normal", "out_tangent"};

int update_find_path(const char* name)
{
    for (int i = 0; update_paths[i].name != NULL; ++i)
        if (strcmp(update_paths[i].name, name) == 0) return i;
    return -1;
}

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

// Whole rows, then what is left of the last.
void update_put_texels(const Gl* gl, GLuint texture, int count, const void* texels)
{
    int full = count / UPDATE_WIDTH, rest = count % UPDATE_WIDTH;
    const char* left = (const char*)texels + (size_t)full * UPDATE_WIDTH * sizeof(Texel);
    gl->BindTexture(GL_TEXTURE_2D, texture);
    if (full > 0)
        gl->TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, UPDATE_WIDTH, full, GL_RGBA, GL_FLOAT, texels);
    if (rest > 0) gl->TexSubImage2D(GL_TEXTURE_2D, 0, 0, full, rest, 1, GL_RGBA, GL_FLOAT, left);
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

static void fill_constants(PointsBlock* block, const Hairstyle* style, const Ribbons* ribbons)
{
    Vec3 low = style->box.low, size = vec3_sub(style->box.high, style->box.low);
    memcpy(block->box_low, (const float[4]){low.x, low.y, low.z, 1}, 16);
    memcpy(block->box_size, (const float[4]){size.x, size.y, size.z, 0}, 16);
    block->capsules[0] = ribbons->collider_count;
    for (int i = 0; i < ribbons->collider_count; ++i) {
        const Collider* c = &ribbons->colliders[i];
        const float from[4] = {c->from.x, c->from.y, c->from.z, c->radius};
        const float to[4] = {c->to.x, c->to.y, c->to.z, 0};
        memcpy(block->capsule_from[i], from, sizeof from);
        memcpy(block->capsule_to[i], to, sizeof to);
    }
}

static void create_block(Update* update, const Gl* gl)
{
    gl->GenBuffers(1, &update->block);
    gl->BindBuffer(GL_UNIFORM_BUFFER, update->block);
    gl->BufferData(GL_UNIFORM_BUFFER, sizeof update->constants, &update->constants,
                   GL_DYNAMIC_DRAW);
    gl->BindBuffer(GL_UNIFORM_BUFFER, 0);
}

bool update_create(Update* update, const Gl* gl, const Hairstyle* style, const Ribbons* ribbons,
                   int path, Fault* fault)
{
    memset(update, 0, sizeof *update);
    update->path = &update_paths[path];
    update->ribbons = *ribbons;
    update->point_count = ribbons->point_count;
    update->rows = (ribbons->point_count + UPDATE_WIDTH - 1) / UPDATE_WIDTH;
    if (update->rows < 1) update->rows = 1;
    if (update->rows > gl->max_texture_size)
        return fault_set(fault, "%d ribbon points need a texture of %d rows; this GL stops at %d",
                         ribbons->point_count, update->rows, gl->max_texture_size);
    Texel* const texels[UPDATE_TABLES] = {ribbons->guides, ribbons->weights, ribbons->offsets,
                                          ribbons->tangents, ribbons->normals};
    for (int i = 0; i < UPDATE_TABLES; ++i) {
        update->tables[i] = float_texture(gl, UPDATE_WIDTH, update->rows);
        update_put_texels(gl, update->tables[i], ribbons->point_count, texels[i]);
    }
    for (int i = 0; i < UPDATE_TARGETS && !update->path->evaluated; ++i)
        update->targets[i] = float_texture(gl, UPDATE_WIDTH, update->rows);
    gl->GenVertexArrays(1, &update->vao);
    fill_constants(&update->constants, style, ribbons);
    create_block(update, gl);
    if (upload_rest(update, gl, style, fault) &&
        (update->path->create == NULL || update->path->create(update, gl, style, fault)))
        return true;
    update_free(update, gl);
    return false;
}

void update_free(Update* update, const Gl* gl)
{
    gl->DeleteProgram(update->program);
    gl->DeleteFramebuffers(1, &update->framebuffer);
    gl->DeleteVertexArrays(1, &update->vao);
    gl->DeleteBuffers(1, &update->block);
    gl->DeleteBuffers(UPDATE_TARGETS, update->feedback);
    gl->DeleteTextures(UPDATE_TARGETS, update->targets);
    gl->DeleteTextures(UPDATE_TABLES, update->tables);
    gl->DeleteTextures(1, &update->rest_tangents);
    update_cpu_free(update);
    memset(update, 0, sizeof *update);
}

void update_samplers(const Gl* gl, GLuint program)
{
    static const char* const samplers[UPDATE_UNITS] = {
        "guide_positions", "guide_tangents", "rest_tangents",  "table_guides",
        "table_weights",   "table_offsets",  "table_tangents", "table_normals"};
    for (int i = 0; i < UPDATE_UNITS; ++i)
        program_sampler(gl, program, samplers[i], UPDATE_UNIT + i);
    program_block(gl, program, "PointsBlock", BLOCK_BINDING);
}

static void bind(const Gl* gl, GLenum unit, GLenum target, GLuint texture)
{
    gl->ActiveTexture(GL_TEXTURE0 + UPDATE_UNIT + unit);
    gl->BindTexture(target, texture);
}

void update_bind(const Update* update, const Gl* gl)
{
    bind(gl, 0, GL_TEXTURE_2D_ARRAY, update->guide_positions);
    bind(gl, 1, GL_TEXTURE_2D_ARRAY, update->guide_tangents);
    bind(gl, 2, GL_TEXTURE_2D, update->rest_tangents);
    for (GLenum i = 0; i < UPDATE_TABLES; ++i)
        bind(gl, 3 + i, GL_TEXTURE_2D, update->tables[i]);
    gl->ActiveTexture(GL_TEXTURE0);
    gl->BindBufferBase(GL_UNIFORM_BUFFER, BLOCK_BINDING, update->block);
}

int update_run(Update* update, const Gl* gl, const GuideTextures* textures, const GuidesView* view,
               float blend)
{
    PointsBlock* constants = &update->constants;
    update->guide_positions = textures->positions;
    update->guide_tangents = textures->tangents;
    constants->box_low[3] = blend;
    memcpy(constants->newest, textures->newest, sizeof constants->newest);
    gl->BindBuffer(GL_UNIFORM_BUFFER, update->block);
    gl->BufferSubData(GL_UNIFORM_BUFFER, 0, sizeof *constants, constants);
    gl->BindBuffer(GL_UNIFORM_BUFFER, 0);
    if (update->path->run == NULL) return 0;
    update_bind(update, gl);
    return update->path->run(update, gl, &(UpdateGuides){textures, view, blend});
}
