#include "client/upload.h"

#include "messages/quantise.h"

#include <stdlib.h>
#include <string.h>

static GLuint create_texture(const Gl* gl, GLint format, int guides, int nodes)
{
    GLuint texture = 0;
    gl->GenTextures(1, &texture);
    gl->BindTexture(GL_TEXTURE_2D_ARRAY, texture);
    GLenum type = format == GL_RGBA16 ? GL_UNSIGNED_SHORT : GL_SHORT;
    gl->TexImage3D(GL_TEXTURE_2D_ARRAY, 0, format, nodes, guides, 2, 0, GL_RGB, type, NULL);
    // For the path `linear` alone; all others fetch texels, which no filter touches.
    gl->TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl->TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    return texture;
}

static void put_rows(const GuideTextures* textures, const Gl* gl, int layer, int first, int count,
                     const uint16_t* positions, const int16_t* tangents)
{
    gl->PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    gl->BindTexture(GL_TEXTURE_2D_ARRAY, textures->positions);
    gl->TexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, first, layer, textures->nodes, count, 1, GL_RGB,
                      GL_UNSIGNED_SHORT, positions);
    gl->BindTexture(GL_TEXTURE_2D_ARRAY, textures->tangents);
    gl->TexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, first, layer, textures->nodes, count, 1, GL_RGB,
                      GL_SHORT, tangents);
}

static bool put_rest(const GuideTextures* textures, const Gl* gl, const Hairstyle* style)
{
    size_t nodes = (size_t)style->guide_count * (size_t)style->nodes;
    uint16_t* positions = malloc(nodes * 3 * sizeof *positions);
    int16_t* tangents = malloc(nodes * 3 * sizeof *tangents);
    bool made = positions != NULL && tangents != NULL;
    for (int g = 0; made && g < style->guide_count; ++g) {
        Vec3 along[HAIRSTYLE_MAX_NODES];
        quantise_strand_tangents(along, style->rest + g * style->nodes, style->nodes);
        for (int n = 0; n < style->nodes; ++n) {
            int i = g * style->nodes + n;
            quantise_position(positions + 3 * i, style->rest[i], &style->box);
            quantise_tangent(tangents + 3 * i, along[n]);
        }
    }
    for (int layer = 0; made && layer < 2; ++layer)
        put_rows(textures, gl, layer, 0, style->guide_count, positions, tangents);
    free(positions);
    free(tangents);
    return made;
}

static void forget(GuideTextures* textures)
{
    for (int layer = 0; layer < 2; ++layer)
        for (int row = 0; row < HAIRSTYLE_MAX_GUIDES; ++row)
            textures->row_tick[layer][row] = -1;
}

bool upload_create(GuideTextures* textures, const Gl* gl, const Hairstyle* style, Fault* fault)
{
    memset(textures, 0, sizeof *textures);
    textures->guides = style->guide_count;
    textures->nodes = style->nodes;
    textures->positions = create_texture(gl, GL_RGBA16, style->guide_count, style->nodes);
    textures->tangents = create_texture(gl, GL_RGBA16_SNORM, style->guide_count, style->nodes);
    forget(textures);
    if (put_rest(textures, gl, style)) return true;
    upload_free(textures, gl);
    return fault_set(fault, "no memory for %d guides", style->guide_count);
}

void upload_free(GuideTextures* textures, const Gl* gl)
{
    gl->DeleteTextures(1, &textures->positions);
    gl->DeleteTextures(1, &textures->tangents);
    memset(textures, 0, sizeof *textures);
}

// Rows [first, first + result) of a layer that the view has and the textures lack.
static int fresh_run(const GuideTextures* textures, const GuidesView* view, int layer, int first)
{
    int row = first;
    while (row < textures->guides && view->row_tick[layer][row] >= 0 &&
           view->row_tick[layer][row] != textures->row_tick[layer][row])
        ++row;
    return row - first;
}

static void choose_newest(GuideTextures* textures)
{
    for (int row = 0; row < textures->guides; ++row) {
        GLuint bit = 1u << (row & 31);
        GLuint* word = &textures->newest[row >> 5];
        bool second = textures->row_tick[1][row] > textures->row_tick[0][row];
        *word = second ? *word | bit : *word & ~bit;
    }
}

bool upload_rows(GuideTextures* textures, const Gl* gl, const GuidesView* view)
{
    if (view->nodes != textures->nodes) return false;
    // An epoch, a jump back in a log: a layer that still holds a higher tick would pass for newest.
    if (view->generation != textures->generation) forget(textures);
    textures->generation = view->generation;
    bool any = false;
    for (int layer = 0; layer < 2; ++layer)
        for (int row = 0; row < textures->guides; ++row) {
            int run = fresh_run(textures, view, layer, row);
            if (run == 0) continue;
            size_t at = (size_t)row * (size_t)textures->nodes * 3;
            put_rows(textures, gl, layer, row, run, view->positions[layer] + at,
                     view->tangents[layer] + at);
            memcpy(&textures->row_tick[layer][row], &view->row_tick[layer][row],
                   (size_t)run * sizeof(int32_t));
            textures->bytes += (int64_t)run * textures->nodes * FRAME_NODE_BYTES;
            row += run; // and the row behind the run is not fresh
            any = true;
        }
    if (any) choose_newest(textures);
    return any;
}
