#include "server/fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// The inside is sampled on a grid of about this many cells along the longest edge of the box.
// Chosen spheres are measured against the triangles again, so the grid's step does not show in
// them.
#define CELLS_ALONG 96
#define MARGIN      2      // empty cells round the mesh
#define MAX_RADIUS  0.5f   // m; larger than any head
#define MIN_RADIUS  0.010f // m; smaller ones move no hair and cost as much

typedef struct Grid {
    int size[3];
    size_t cells;
    float step;
    Vec3 low;        // centre of cell (0, 0, 0)
    int16_t* votes;  // [z][y][x]: signed crossings beyond the cell, summed over six directions
    int32_t* square; // squared distance to the nearest cell outside, in cells; 0: outside
    uint16_t* open;  // [z][y][x + 1]: cells inside and not yet covered, summed along the row
    int inside;
} Grid;

typedef struct Candidate {
    int cell[3];
    float radius; // cells
    int gain;     // upper bound of the cells it would newly cover
} Candidate;

static size_t index_of(const Grid* grid, int x, int y, int z)
{
    return ((size_t)z * (size_t)grid->size[1] + (size_t)y) * (size_t)grid->size[0] + (size_t)x;
}

static float axis_of(Vec3 v, int axis)
{
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

// Inside ----------------------------------------------------------------------------------------

// Adds the triangle's signed crossing to every cell of a column along `axis`: +1 where the ray
// towards +axis leaves through it, and the same for the ray towards -axis. The mean of such signed
// counts over all directions is the generalised winding number (Jacobson, Kavan and
// Sorkine-Hornung 2013); six directions suffice for a vote, where the solid angles of every
// triangle at every cell would take an arc tangent each.
static void vote_column(Grid* grid, int axis, const int at[3], float depth, int sign)
{
    int cell[3] = {at[0], at[1], at[2]};
    for (cell[axis] = 0; cell[axis] < grid->size[axis]; ++cell[axis]) {
        bool before = (float)cell[axis] < depth;
        grid->votes[index_of(grid, cell[0], cell[1], cell[2])] += (int16_t)(before ? sign : -sign);
    }
}

static int clamp_cell(float value, int size)
{
    return value < 0.0f ? 0 : value > (float)(size - 1) ? size - 1 : (int)value;
}

// Twice the signed area of (a, b, p) in the plane.
static float edge(const float a[2], const float b[2], float px, float py)
{
    return (b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0]);
}

// Corners in cells along (u, v, axis).
static void vote_triangle(Grid* grid, int axis, const float corner[3][2], const float depth[3])
{
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    float area = edge(corner[0], corner[1], corner[2][0], corner[2][1]);
    if (area == 0.0f) return;
    float u_low = fminf(corner[0][0], fminf(corner[1][0], corner[2][0]));
    float u_high = fmaxf(corner[0][0], fmaxf(corner[1][0], corner[2][0]));
    float v_low = fminf(corner[0][1], fminf(corner[1][1], corner[2][1]));
    float v_high = fmaxf(corner[0][1], fmaxf(corner[1][1], corner[2][1]));
    int at[3];
    for (at[u] = clamp_cell(ceilf(u_low), grid->size[u]); (float)at[u] <= u_high; ++at[u])
        for (at[v] = clamp_cell(ceilf(v_low), grid->size[v]); (float)at[v] <= v_high; ++at[v]) {
            // Half a thousandth of a cell aside: rays then miss vertices and edges of meshes that
            // were modelled on round numbers.
            float px = (float)at[u] + 0.00051f, py = (float)at[v] + 0.00037f;
            float w0 = edge(corner[1], corner[2], px, py) / area;
            float w1 = edge(corner[2], corner[0], px, py) / area;
            float w2 = 1.0f - w0 - w1;
            if (w0 < 0.0f || w1 < 0.0f || w2 < 0.0f) continue;
            at[axis] = 0;
            vote_column(grid, axis, at, w0 * depth[0] + w1 * depth[1] + w2 * depth[2],
                        area > 0.0f ? 1 : -1);
        }
}

static void vote_mesh(Grid* grid, const HeadMesh* mesh)
{
    for (int t = 0; t < mesh->index_count; t += 3)
        for (int axis = 0; axis < 3; ++axis) {
            float corner[3][2], depth[3];
            for (int i = 0; i < 3; ++i) {
                Vec3 p = mesh->positions[mesh->indices[t + i]];
                p = vec3_scale(vec3_sub(p, grid->low), 1.0f / grid->step);
                corner[i][0] = axis_of(p, (axis + 1) % 3);
                corner[i][1] = axis_of(p, (axis + 2) % 3);
                depth[i] = axis_of(p, axis);
            }
            vote_triangle(grid, axis, (const float(*)[2])corner, depth);
        }
}

// Distance to the outside -----------------------------------------------------------------------

// One pass of the exact squared distance transform: lower envelope of parabolas (Felzenszwalb and
// Huttenlocher 2012). `f` in and out, `count` cells a `stride` apart.
static void transform_row(int32_t* f, size_t stride, int count)
{
    int32_t value[CELLS_ALONG + 2 * MARGIN + 2];
    int site[CELLS_ALONG + 2 * MARGIN + 2], sites = 0;
    float from[CELLS_ALONG + 2 * MARGIN + 3];
    for (int q = 0; q < count; ++q) {
        value[q] = f[(size_t)q * stride];
        float s = -INFINITY;
        while (sites > 0) {
            int p = site[sites - 1];
            s = ((float)(value[q] + q * q) - (float)(value[p] + p * p)) / (float)(2 * (q - p));
            if (s > from[sites - 1]) break;
            --sites;
            s = -INFINITY;
        }
        site[sites] = q;
        from[sites++] = s;
    }
    for (int q = 0, k = 0; q < count; ++q) {
        while (k + 1 < sites && from[k + 1] < (float)q)
            ++k;
        int d = q - site[k];
        f[(size_t)q * stride] = d * d + value[site[k]];
    }
}

static void find_distances(Grid* grid)
{
    const int32_t far = 1 << 20; // above any squared distance in the grid, exact in float
    for (size_t i = 0; i < grid->cells; ++i) {
        bool inside = grid->votes[i] > 3; // of six: winding number above one half
        grid->square[i] = inside ? far : 0;
        grid->inside += inside;
    }
    const int* n = grid->size;
    for (int z = 0; z < n[2]; ++z)
        for (int y = 0; y < n[1]; ++y)
            transform_row(grid->square + index_of(grid, 0, y, z), 1, n[0]);
    for (int z = 0; z < n[2]; ++z)
        for (int x = 0; x < n[0]; ++x)
            transform_row(grid->square + index_of(grid, x, 0, z), (size_t)n[0], n[1]);
    for (int y = 0; y < n[1]; ++y)
        for (int x = 0; x < n[0]; ++x)
            transform_row(grid->square + index_of(grid, x, y, 0), (size_t)n[0] * (size_t)n[1],
                          n[2]);
}

// Choosing --------------------------------------------------------------------------------------

static uint16_t* open_row(const Grid* grid, int y, int z)
{
    return grid->open +
           ((size_t)z * (size_t)grid->size[1] + (size_t)y) * (size_t)(grid->size[0] + 1);
}

static void open_inside(Grid* grid)
{
    for (int z = 0; z < grid->size[2]; ++z)
        for (int y = 0; y < grid->size[1]; ++y) {
            uint16_t* row = open_row(grid, y, z);
            row[0] = 0;
            for (int x = 0; x < grid->size[0]; ++x)
                row[x + 1] = (uint16_t)(row[x] + (grid->square[index_of(grid, x, y, z)] > 0));
        }
}

// Closes cells [low, high] of a row.
static void close_run(uint16_t* row, int size, int low, int high)
{
    uint16_t closed = (uint16_t)(row[high + 1] - row[low]);
    for (int x = low; x <= high; ++x)
        row[x + 1] = row[low];
    for (int x = high + 1; x < size; ++x)
        row[x + 1] = (uint16_t)(row[x + 1] - closed);
}

// Open cells in a ball; with `cover` it closes them. Rows' running sums make this the work of a
// disc.
static int count_ball(Grid* grid, const int cell[3], float radius, bool cover)
{
    int reach = (int)radius, count = 0;
    for (int dz = -reach; dz <= reach; ++dz)
        for (int dy = -reach; dy <= reach; ++dy) {
            float left = radius * radius - (float)(dy * dy + dz * dz);
            int y = cell[1] + dy, z = cell[2] + dz;
            if (left < 0.0f || y < 0 || z < 0 || y >= grid->size[1] || z >= grid->size[2]) continue;
            int half = (int)sqrtf(left);
            int low = cell[0] - half, high = cell[0] + half;
            low = low < 0 ? 0 : low;
            high = high >= grid->size[0] ? grid->size[0] - 1 : high;
            uint16_t* row = open_row(grid, y, z);
            count += row[high + 1] - row[low];
            if (cover) close_run(row, grid->size[0], low, high);
        }
    return count;
}

// Whether a neighbouring ball holds this one (nearly) whole: then it is not worth trying.
static bool is_maximal(const Grid* grid, int x, int y, int z)
{
    float radius = sqrtf((float)grid->square[index_of(grid, x, y, z)]);
    for (int i = 0; i < 27; ++i) {
        int dx = i % 3 - 1, dy = i / 3 % 3 - 1, dz = i / 9 - 1;
        if (i == 13) continue;
        float other = sqrtf((float)grid->square[index_of(grid, x + dx, y + dy, z + dz)]);
        if (other >= radius + 0.95f * sqrtf((float)(dx * dx + dy * dy + dz * dz))) return false;
    }
    return true;
}

static int by_gain(const void* a, const void* b)
{
    const Candidate *first = a, *second = b;
    if (second->gain != first->gain) return second->gain > first->gain ? 1 : -1;
    for (int axis = 2; axis >= 0; --axis) // a total order: the same spheres from every qsort
        if (first->cell[axis] != second->cell[axis])
            return first->cell[axis] < second->cell[axis] ? -1 : 1;
    return 0;
}

// NULL where there is no memory; at most one per inside cell.
static Candidate* find_candidates(const Grid* grid, int* count)
{
    Candidate* candidates = malloc(((size_t)grid->inside + 1) * sizeof *candidates);
    if (candidates == NULL) return NULL;
    float least = MIN_RADIUS / grid->step;
    for (int z = 1; z < grid->size[2] - 1; ++z)
        for (int y = 1; y < grid->size[1] - 1; ++y)
            for (int x = 1; x < grid->size[0] - 1; ++x) {
                float square = (float)grid->square[index_of(grid, x, y, z)];
                if (square < least * least || !is_maximal(grid, x, y, z)) continue;
                float radius = sqrtf(square);
                candidates[(*count)++] =
                    (Candidate){{x, y, z}, radius, (int)(4.5f * radius * radius * radius) + 8};
            }
    qsort(candidates, (size_t)*count, sizeof *candidates, by_gain);
    return candidates;
}

// Lazy greedy choice (Minoux 1978): gains only fall as cells close, so a candidate whose old gain
// is below the best new one need not be counted again.
static int best_candidate(Grid* grid, Candidate* candidates, int count)
{
    int best = -1, best_gain = 0;
    for (int i = 0; i < count; ++i) {
        if (candidates[i].gain <= best_gain) continue;
        candidates[i].gain = count_ball(grid, candidates[i].cell, candidates[i].radius, false);
        if (candidates[i].gain <= best_gain) continue;
        best_gain = candidates[i].gain;
        best = i;
    }
    return best;
}

// Measuring -------------------------------------------------------------------------------------

// Squared distance from p to the segment from a along ab.
static float segment_square(Vec3 p, Vec3 a, Vec3 ab)
{
    float length = vec3_dot(ab, ab);
    float t = length > 0.0f ? vec3_dot(vec3_sub(p, a), ab) / length : 0.0f;
    Vec3 d = vec3_sub(p, vec3_mad(a, ab, fminf(fmaxf(t, 0.0f), 1.0f)));
    return vec3_dot(d, d);
}

// The plane's distance where p lies over the triangle, else that of the nearest edge.
static float triangle_square(Vec3 p, Vec3 a, Vec3 b, Vec3 c)
{
    Vec3 ab = vec3_sub(b, a), bc = vec3_sub(c, b), ca = vec3_sub(a, c);
    Vec3 normal = vec3_cross(ab, bc);
    float area = vec3_dot(normal, normal);
    if (area > 0.0f && vec3_dot(vec3_cross(normal, ab), vec3_sub(p, a)) >= 0.0f &&
        vec3_dot(vec3_cross(normal, bc), vec3_sub(p, b)) >= 0.0f &&
        vec3_dot(vec3_cross(normal, ca), vec3_sub(p, c)) >= 0.0f) {
        float height = vec3_dot(vec3_sub(p, a), normal);
        return height * height / area;
    }
    return fminf(segment_square(p, a, ab),
                 fminf(segment_square(p, b, bc), segment_square(p, c, ca)));
}

static float distance_to_mesh(const HeadMesh* mesh, Vec3 p)
{
    float best = INFINITY;
    for (int t = 0; t < mesh->index_count; t += 3) {
        const uint32_t* v = mesh->indices + t;
        float d =
            triangle_square(p, mesh->positions[v[0]], mesh->positions[v[1]], mesh->positions[v[2]]);
        best = fminf(best, d);
    }
    return sqrtf(best);
}

// The grid's radius reaches to the centre of the nearest cell outside: true to a cell. The mesh's
// own distance replaces it, except where an inner surface (mouth, a double wall) is nearer than
// that.
static float true_radius(const Grid* grid, const HeadMesh* mesh, const Candidate* candidate,
                         Vec3 centre)
{
    float exact = distance_to_mesh(mesh, centre) / grid->step;
    float radius = candidate->radius - 0.5f;
    if (fabsf(exact - radius) < 2.0f) radius = exact;
    return fminf(radius * grid->step, MAX_RADIUS);
}

// All of it -------------------------------------------------------------------------------------

static void lay_out_grid(Grid* grid, const HeadMesh* mesh)
{
    Vec3 low = mesh->positions[mesh->indices[0]], high = low;
    for (int i = 0; i < mesh->index_count; ++i) {
        Vec3 p = mesh->positions[mesh->indices[i]];
        low = vec3(fminf(low.x, p.x), fminf(low.y, p.y), fminf(low.z, p.z));
        high = vec3(fmaxf(high.x, p.x), fmaxf(high.y, p.y), fmaxf(high.z, p.z));
    }
    Vec3 extent = vec3_sub(high, low);
    grid->step = fmaxf(extent.x, fmaxf(extent.y, extent.z)) / CELLS_ALONG;
    if (!(grid->step > 1e-6f)) grid->step = 1e-6f; // a mesh of one point has no inside
    float margin = MARGIN * grid->step;
    grid->low = vec3_sub(low, vec3(margin, margin, margin));
    for (int axis = 0; axis < 3; ++axis)
        grid->size[axis] = (int)(axis_of(extent, axis) / grid->step) + 1 + 2 * MARGIN;
    grid->cells = (size_t)grid->size[0] * (size_t)grid->size[1] * (size_t)grid->size[2];
}

static int choose(Sphere* spheres, int capacity, Grid* grid, const HeadMesh* mesh,
                  Candidate* candidates, int candidate_count)
{
    int count = 0;
    while (count < capacity) {
        int best = best_candidate(grid, candidates, candidate_count);
        if (best < 0) break;
        Candidate* chosen = &candidates[best];
        Vec3 offset = vec3((float)chosen->cell[0], (float)chosen->cell[1], (float)chosen->cell[2]);
        Vec3 centre = vec3_mad(grid->low, offset, grid->step);
        float radius = true_radius(grid, mesh, chosen, centre);
        int gain = count_ball(grid, chosen->cell, fmaxf(radius / grid->step, 0.0f), true);
        chosen->gain = 0; // chosen or too small: never again
        if (radius >= MIN_RADIUS && gain > 0) spheres[count++] = (Sphere){centre, radius};
    }
    return count;
}

static int count_open(const Grid* grid)
{
    int count = 0;
    for (int z = 0; z < grid->size[2]; ++z)
        for (int y = 0; y < grid->size[1]; ++y)
            count += open_row(grid, y, z)[grid->size[0]];
    return count;
}

// Volumes in cubic metres.
typedef struct Coverage {
    double inside, open;
} Coverage;

static int fit_surface(Sphere* spheres, int capacity, const HeadMesh* mesh, Coverage* coverage)
{
    if (mesh->index_count == 0 || capacity <= 0) return 0;
    Grid grid = {0};
    lay_out_grid(&grid, mesh);
    size_t rows = (size_t)grid.size[1] * (size_t)grid.size[2];
    grid.votes = calloc(grid.cells, sizeof *grid.votes);
    grid.square = calloc(grid.cells, sizeof *grid.square);
    grid.open = calloc(rows * (size_t)(grid.size[0] + 1), sizeof *grid.open);
    int count = 0, candidate_count = 0;
    Candidate* candidates = NULL;
    if (grid.votes != NULL && grid.square != NULL && grid.open != NULL) {
        vote_mesh(&grid, mesh);
        find_distances(&grid);
        open_inside(&grid);
        candidates = find_candidates(&grid, &candidate_count);
    }
    if (candidates != NULL) {
        count = choose(spheres, capacity, &grid, mesh, candidates, candidate_count);
        double cell = (double)grid.step * (double)grid.step * (double)grid.step;
        coverage->inside += cell * grid.inside;
        coverage->open += cell * count_open(&grid);
    }
    free(candidates);
    free(grid.votes);
    free(grid.square);
    free(grid.open);
    return count;
}

// The triangles of the parts that are skin, or of those that are not; positions stay shared.
static HeadMesh pick_parts(const HeadMesh* mesh, bool is_skin, uint32_t* indices)
{
    HeadMesh picked = *mesh;
    picked.indices = indices;
    picked.index_count = 0;
    for (int i = 0; i < mesh->part_count; ++i) {
        const HeadPart* part = &mesh->parts[i];
        if (part->is_skin != is_skin) continue;
        memcpy(indices + picked.index_count, mesh->indices + part->first_index,
               part->index_count * sizeof *indices);
        picked.index_count += (int)part->index_count;
    }
    return picked;
}

int fit_spheres(Sphere* spheres, int capacity, const HeadMesh* mesh, float* covered)
{
    if (covered != NULL) *covered = 0.0f;
    if (mesh->index_count == 0) return 0;
    uint32_t* indices = malloc((size_t)mesh->index_count * sizeof *indices);
    if (indices == NULL) return 0;
    Coverage coverage = {0};
    HeadMesh rest = pick_parts(mesh, false, indices);
    int skin_capacity = rest.index_count > 0 ? capacity - capacity / 2 : capacity;
    HeadMesh skin = pick_parts(mesh, true, indices);
    int count = fit_surface(spheres, skin_capacity, &skin, &coverage);
    rest = pick_parts(mesh, false, indices);
    count += fit_surface(spheres + count, capacity - count, &rest, &coverage);
    free(indices);
    if (covered != NULL && coverage.inside > 0.0)
        *covered = (float)(1.0 - coverage.open / coverage.inside);
    return count;
}
