#include "client/body.h"

#include "messages/mannequin.h"

#include <stdlib.h>
#include <string.h>

typedef struct Vertex {
    Vec3 position, normal;
    float albedo[3], scalp;
    Vec3 root_tangent;
} Vertex;

typedef struct Root {
    Vec3 position, tangent;
} Root;

// Skin this near to a root is scalp, metres. Roots of imported grooms lie 2-4 mm apart; much wider
// and the forehead turns brown.
#define SCALP_REACH_M 0.006f

// Of one cell of the grid so many roots count at most: five times as many as hairs grow there on a
// real head, and few enough that a style with all of its roots in one cell does not stall a client.
#define SCALP_MOST 1024

// A root that may be within reach of points of `cell`.
typedef struct Near {
    uint64_t cell;
    uint32_t root;
} Near;

// Roots by place. A root is listed in every cell that its reach touches, so that a vertex looks at
// its own cell only and adds roots up in the order of the style, as without a grid.
typedef struct Grid {
    Root* roots;
    Near* nears; // by cell, then root
    int root_count, near_count;
} Grid;

// Where a ribbon's point `i` is at rest; roots only, so at height 0 of its guides.
static Vec3 root_place(const Hairstyle* style, const Ribbons* ribbons, int i)
{
    const float *g = ribbons->guides[i], *w = ribbons->weights[i], *o = ribbons->offsets[i];
    Vec3 place = vec3(o[0], o[1], o[2]);
    for (int j = 0; j < 3; ++j)
        place = vec3_mad(place, style->rest[(int)g[j] * style->nodes], w[j]);
    return place;
}

static void collect_roots(Grid* grid, const Hairstyle* style, const Ribbons* ribbons)
{
    for (int i = 0; i < ribbons->point_count; ++i) {
        const float* t = ribbons->tangents[i];
        if (t[3] > 0.0f) continue;
        Vec3 place = root_place(style, ribbons, i);
        grid->roots[grid->root_count++] = (Root){place, vec3(t[0], t[1], t[2])};
    }
}

// Cells are a little wider than what list_cells spans: a root touches two along an axis at most.
static uint64_t cell_along(double place_m)
{
    double cell = floor(place_m / (2.01 * (double)SCALP_REACH_M));
    return (uint64_t)(fmin(fmax(cell, -1e6), 1e6) + 1e6); // 21 bits; styles may be anywhere
}

static uint64_t cell_key(uint64_t x, uint64_t y, uint64_t z)
{
    return x << 42 | y << 21 | z;
}

static void list_cells(Grid* grid, uint32_t root)
{
    const double reach = 1.001 * (double)SCALP_REACH_M; // rounding may not lose one
    Vec3d p = vec3d_from(grid->roots[root].position);
    for (uint64_t x = cell_along(p.x - reach); x <= cell_along(p.x + reach); ++x)
        for (uint64_t y = cell_along(p.y - reach); y <= cell_along(p.y + reach); ++y)
            for (uint64_t z = cell_along(p.z - reach); z <= cell_along(p.z + reach); ++z)
                grid->nears[grid->near_count++] = (Near){cell_key(x, y, z), root};
}

static int by_cell(const void* a, const void* b)
{
    const Near *m = a, *n = b;
    if (m->cell != n->cell) return m->cell < n->cell ? -1 : 1;
    return (m->root > n->root) - (m->root < n->root);
}

static void grid_free(Grid* grid)
{
    free(grid->roots);
    free(grid->nears);
}

static bool grid_build(Grid* grid, const Hairstyle* style, const Ribbons* ribbons)
{
    size_t most = (size_t)ribbons->ribbon_count;
    *grid = (Grid){calloc(most + 1, sizeof(Root)), calloc(8 * most + 1, sizeof(Near)), 0, 0};
    if (grid->roots == NULL || grid->nears == NULL) return false;
    collect_roots(grid, style, ribbons);
    for (int root = 0; root < grid->root_count; ++root)
        list_cells(grid, (uint32_t)root);
    qsort(grid->nears, (size_t)grid->near_count, sizeof *grid->nears, by_cell);
    return true;
}

// Index of the first entry of `cell`, or of where it would be.
static int first_near(const Grid* grid, uint64_t cell)
{
    int low = 0, high = grid->near_count;
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (grid->nears[middle].cell < cell)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

// How much hair grows at `vertex`, from the roots around it: their number within reach, faded; and
// the mean of their directions.
static void grow_on(Vertex* vertex, const Grid* grid)
{
    float sum = 0.0f;
    Vec3 tangent = {0, 0, 0};
    Vec3d p = vec3d_from(vertex->position);
    uint64_t cell = cell_key(cell_along(p.x), cell_along(p.y), cell_along(p.z));
    int first = first_near(grid, cell);
    for (int i = first; i < grid->near_count && i < first + SCALP_MOST; ++i) {
        if (grid->nears[i].cell != cell) break;
        const Root* root = &grid->roots[grid->nears[i].root];
        Vec3 d = vec3_sub(root->position, vertex->position);
        float near = 1.0f - vec3_dot(d, d) / (SCALP_REACH_M * SCALP_REACH_M);
        if (near <= 0.0f) continue;
        sum += near * near;
        tangent = vec3_mad(tangent, root->tangent, near * near);
    }
    vertex->scalp = fminf(sum * 0.8f, 1.0f);
    vertex->root_tangent = vec3_normalise_or(tangent, vec3(0, -1, 0));
}

// Scalp of the mannequin, given how much hair grow_on found: whole well inside its hairline, and
// over the border as ragged as the roots there, so that hair does not end on a drawn line.
static float soften_border(const Vertex* vertex)
{
    float scalp = mannequin_scalp(vertex->position);
    return scalp * fmaxf(scalp, fminf(2.0f * vertex->scalp, 1.0f));
}

// Whether grow_on has been there: what it leaves has length one.
static bool is_grown(const Vertex* vertex)
{
    return vec3_dot(vertex->root_tangent, vertex->root_tangent) > 0.0f;
}

static void fill_vertices(Vertex* vertices, const HeadMesh* mesh, const Hairstyle* style,
                          const Grid* grid)
{
    for (int i = 0; i < mesh->vertex_count; ++i) {
        vertices[i].position = mesh->positions[i];
        vertices[i].normal = mesh->normals[i];
    }
    for (int p = 0; p < mesh->part_count; ++p) {
        const HeadPart* part = &mesh->parts[p];
        for (uint32_t k = 0; k < part->index_count; ++k) {
            Vertex* v = &vertices[mesh->indices[part->first_index + k]];
            v->albedo[0] = part->albedo.x, v->albedo[1] = part->albedo.y;
            v->albedo[2] = part->albedo.z;
            if (!part->is_skin || is_grown(v)) continue;
            grow_on(v, grid);
            if (style->head_kind == HEAD_MANNEQUIN) v->scalp = soften_border(v);
        }
    }
}

static void attribute(const Gl* gl, GLuint index, int size, size_t offset)
{
    gl->EnableVertexAttribArray(index);
    gl->VertexAttribPointer(index, size, GL_FLOAT, GL_FALSE, sizeof(Vertex), (const void*)offset);
}

static void upload(Body* body, const Gl* gl, const Vertex* vertices, const HeadMesh* mesh)
{
    gl->GenVertexArrays(1, &body->vao);
    gl->BindVertexArray(body->vao);
    gl->GenBuffers(1, &body->vertices);
    gl->BindBuffer(GL_ARRAY_BUFFER, body->vertices);
    gl->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)mesh->vertex_count * sizeof(Vertex)),
                   vertices, GL_STATIC_DRAW);
    attribute(gl, 0, 3, offsetof(Vertex, position));
    attribute(gl, 1, 3, offsetof(Vertex, normal));
    attribute(gl, 2, 4, offsetof(Vertex, albedo));
    attribute(gl, 3, 3, offsetof(Vertex, root_tangent));
    gl->GenBuffers(1, &body->indices);
    gl->BindBuffer(GL_ELEMENT_ARRAY_BUFFER, body->indices);
    gl->BufferData(GL_ELEMENT_ARRAY_BUFFER,
                   (GLsizeiptr)((size_t)mesh->index_count * sizeof(uint32_t)), mesh->indices,
                   GL_STATIC_DRAW);
    gl->BindVertexArray(0);
    body->index_count = mesh->index_count;
}

static Box bounds(const HeadMesh* mesh)
{
    Box box = {mesh->positions[0], mesh->positions[0]};
    for (int i = 1; i < mesh->vertex_count; ++i) {
        box.low = vec3_min(box.low, mesh->positions[i]);
        box.high = vec3_max(box.high, mesh->positions[i]);
    }
    return box;
}

static bool build_from(Body* body, const Gl* gl, const HeadMesh* mesh, const Hairstyle* style,
                       const Ribbons* ribbons, Fault* fault)
{
    if (mesh->vertex_count == 0 || mesh->index_count == 0) return true;
    Vertex* vertices = calloc((size_t)mesh->vertex_count, sizeof *vertices);
    Grid grid;
    bool made = grid_build(&grid, style, ribbons) && vertices != NULL;
    if (made) {
        fill_vertices(vertices, mesh, style, &grid);
        upload(body, gl, vertices, mesh);
        body->box = bounds(mesh);
    }
    free(vertices);
    grid_free(&grid);
    return made || fault_set(fault, "no memory for the head's %d vertices", mesh->vertex_count);
}

bool body_build(Body* body, const Gl* gl, const Hairstyle* style, const Ribbons* ribbons,
                float spacing, Fault* fault)
{
    memset(body, 0, sizeof *body);
    if (style->head_kind == HEAD_MESH && spacing == 1.0f)
        return build_from(body, gl, &style->head, style, ribbons, fault);
    if (style->head_kind != HEAD_MANNEQUIN) return true;
    HeadMesh mesh = {0};
    bool built = mannequin_mesh(&mesh, spacing, style->material.skin_colour, fault) &&
                 build_from(body, gl, &mesh, style, ribbons, fault);
    head_mesh_free(&mesh);
    body->is_mannequin = true;
    return built;
}

int body_draw(const Body* body, const Gl* gl)
{
    if (body->index_count == 0) return 0;
    if (body->is_mannequin) gl->Enable(GL_CULL_FACE);
    gl->BindVertexArray(body->vao);
    gl->DrawElements(GL_TRIANGLES, body->index_count, GL_UNSIGNED_INT, NULL);
    gl->Disable(GL_CULL_FACE);
    return 1;
}

void body_free(Body* body, const Gl* gl)
{
    gl->DeleteVertexArrays(1, &body->vao);
    gl->DeleteBuffers(1, &body->vertices);
    gl->DeleteBuffers(1, &body->indices);
    memset(body, 0, sizeof *body);
}
