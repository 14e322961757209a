#include "client/hair.h"

#include "client/program.h"

#include <string.h>

// How much further apart vertices of the mannequin may be where pixels are so wide, by eye: noses
// and ears keep their outline.
static const struct {
    float pixel_m, spacing;
} coarser[HAIR_COARSER] = {{0.0013f, 1.5f}, {0.0040f, 3.0f}};

static bool build_bodies(Hair* hair, const Gl* gl, const Hairstyle* style, Fault* fault)
{
    for (int i = 0; i < HAIR_COARSER; ++i)
        if (!body_build(&hair->coarser[i], gl, style, &hair->ribbons, coarser[i].spacing, fault))
            return false;
    return body_build(&hair->body, gl, style, &hair->ribbons, 1.0f, fault);
}

const Body* hair_body(const Hair* hair, float pixel_m)
{
    for (int i = HAIR_COARSER - 1; i >= 0; --i)
        if (pixel_m > coarser[i].pixel_m && hair->coarser[i].index_count > 0)
            return &hair->coarser[i];
    return &hair->body;
}

bool hair_create(Hair* hair, const Gl* gl, const Hairstyle* style, Lod lod, int path, Fault* fault)
{
    memset(hair, 0, sizeof *hair);
    hair->style = style;
    hair->material = style->material;
    if (!ribbons_build_lod(&hair->ribbons, style, lod, fault) ||
        !upload_create(&hair->guides, gl, style, fault) ||
        !update_create(&hair->update, gl, style, &hair->ribbons, path, fault) ||
        !build_bodies(hair, gl, style, fault) ||
        !order_create(&hair->order, gl, &hair->ribbons, style, fault)) {
        hair_free(hair, gl);
        return false;
    }
    gl->GenVertexArrays(1, &hair->vao);
    gl->BindVertexArray(hair->vao);
    gl->GenBuffers(1, &hair->indices);
    gl->BindBuffer(GL_ELEMENT_ARRAY_BUFFER, hair->indices);
    gl->BufferData(GL_ELEMENT_ARRAY_BUFFER,
                   (GLsizeiptr)((size_t)hair->ribbons.index_count * sizeof(uint32_t)),
                   hair->ribbons.indices, GL_STATIC_DRAW);
    gl->BindVertexArray(0);
    return true;
}

void hair_free(Hair* hair, const Gl* gl)
{
    ribbons_free(&hair->ribbons);
    upload_free(&hair->guides, gl);
    update_free(&hair->update, gl);
    body_free(&hair->body, gl);
    for (int i = 0; i < HAIR_COARSER; ++i)
        body_free(&hair->coarser[i], gl);
    order_free(&hair->order, gl);
    gl->DeleteVertexArrays(1, &hair->vao);
    gl->DeleteBuffers(1, &hair->indices);
    memset(hair, 0, sizeof *hair);
}

const char* hair_defines(bool evaluated)
{
    return evaluated ? "#define POINTS_EVALUATED\n" : "";
}

void hair_samplers(const Gl* gl, GLuint program)
{
    update_samplers(gl, program);
    program_sampler(gl, program, "drawn_positions", UNIT_POSITIONS);
    program_sampler(gl, program, "drawn_normals", UNIT_NORMALS);
    program_sampler(gl, program, "drawn_tangents", UNIT_TANGENTS);
    program_sampler(gl, program, "fibre_ranks", UNIT_FIBRES);
}

void hair_bind_points(const Hair* hair, const Gl* gl)
{
    const Update* update = &hair->update;
    for (GLenum i = 0; i < UPDATE_TARGETS; ++i) {
        gl->ActiveTexture(GL_TEXTURE0 + UNIT_POSITIONS + i);
        gl->BindTexture(GL_TEXTURE_2D, update->targets[i]);
    }
    update_bind(update, gl);
}

static int draw(const Hair* hair, const Gl* gl, GLuint fibres, GLuint vao, int index_count)
{
    if (index_count == 0) return 0;
    hair_bind_points(hair, gl);
    gl->ActiveTexture(GL_TEXTURE0 + UNIT_FIBRES);
    gl->BindTexture(GL_TEXTURE_2D_ARRAY, fibres);
    gl->ActiveTexture(GL_TEXTURE0);
    gl->Enable(GL_PRIMITIVE_RESTART);
    gl->PrimitiveRestartIndex(RIBBONS_RESTART);
    gl->BindVertexArray(vao);
    gl->DrawElements(GL_TRIANGLE_STRIP, index_count, GL_UNSIGNED_INT, NULL);
    gl->Disable(GL_PRIMITIVE_RESTART);
    return 1;
}

int hair_draw(const Hair* hair, const Gl* gl, GLuint fibres)
{
    return draw(hair, gl, fibres, hair->vao, hair->ribbons.index_count);
}

int hair_draw_sorted(const Hair* hair, const Gl* gl, GLuint fibres)
{
    return draw(hair, gl, fibres, hair->order.vao, hair->order.index_count);
}
