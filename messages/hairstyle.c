#include "messages/hairstyle.h"

#include "messages/quantise.h"

#include <stdlib.h>
#include <string.h>

// Nothing of a hairstyle is further from the neck than this; it keeps squares finite in float.
#define FARTHEST_M 100.0f

Hairstyle* hairstyle_create(void)
{
    Hairstyle* style = calloc(1, sizeof *style);
    if (style == NULL) return NULL;
    style->seed = 1;
    // A dark brown that lightens towards the tips, over a light skin.
    style->material = (HairMaterial){.root_colour = {0.055f, 0.028f, 0.014f},
                                     .tip_colour = {0.110f, 0.058f, 0.028f},
                                     .skin_colour = {0.560f, 0.340f, 0.245f}};
    return style;
}

void head_mesh_free(HeadMesh* mesh)
{
    free(mesh->positions);
    free(mesh->normals);
    free(mesh->indices);
    *mesh = (HeadMesh){0};
}

void hairstyle_destroy(Hairstyle* style)
{
    if (style == NULL) return;
    free(style->rest);
    free(style->weight);
    free(style->maps);
    free(style->triangles);
    free(style->strands);
    free(style->offsets);
    head_mesh_free(&style->head);
    free(style);
}

static bool check_guide_counts(int guide_count, int nodes, Fault* fault)
{
    if (guide_count < 1 || guide_count > HAIRSTYLE_MAX_GUIDES)
        return fault_set(fault, "%d guides: a style takes 1 to %d", guide_count,
                         HAIRSTYLE_MAX_GUIDES);
    if (nodes < HAIRSTYLE_MIN_NODES || nodes > HAIRSTYLE_MAX_NODES)
        return fault_set(fault, "%d nodes a guide: a style takes %d to %d", nodes,
                         HAIRSTYLE_MIN_NODES, HAIRSTYLE_MAX_NODES);
    return true;
}

bool hairstyle_set_guides(Hairstyle* style, int guide_count, int nodes, Fault* fault)
{
    if (!check_guide_counts(guide_count, nodes, fault)) return false;
    size_t count = (size_t)guide_count * (size_t)nodes;
    Vec3* rest = calloc(count, sizeof *rest);
    uint8_t* weight = malloc(count);
    if (rest == NULL || weight == NULL) {
        free(rest);
        free(weight);
        return fault_set(fault, "no memory for %d guides of %d nodes", guide_count, nodes);
    }
    memset(weight, 255, count);
    for (int guide = 0; guide < guide_count; ++guide)
        weight[guide * nodes] = 0;
    free(style->rest);
    free(style->weight);
    free(style->maps); // they were of other guides
    style->maps = NULL;
    style->rest = rest;
    style->weight = weight;
    style->guide_count = guide_count;
    style->nodes = nodes;
    return true;
}

bool hairstyle_add_maps(Hairstyle* style, Fault* fault)
{
    size_t count = (size_t)style->guide_count * MAP_COUNT;
    uint8_t* maps = malloc(count + 1);
    if (maps == NULL) return fault_set(fault, "no memory for the maps of the scalp");
    for (size_t i = 0; i < count; ++i)
        maps[i] = i % MAP_COUNT == MAP_TEXTURE ? 0 : MAP_ONE;
    free(style->maps);
    style->maps = maps;
    return true;
}

float hairstyle_guide_length(const Hairstyle* style, int guide)
{
    const Vec3* node = style->rest + (size_t)guide * (size_t)style->nodes;
    double length = 0.0;
    for (int i = 1; i < style->nodes; ++i)
        length += (double)vec3_length(vec3_sub(node[i], node[i - 1]));
    return (float)length;
}

Vec3* hairstyle_rest_tangents(const Hairstyle* style)
{
    size_t nodes = (size_t)style->nodes;
    Vec3* tangents = malloc(((size_t)style->guide_count * nodes + 1) * sizeof *tangents);
    for (size_t g = 0; tangents != NULL && g < (size_t)style->guide_count; ++g)
        quantise_strand_tangents(tangents + g * nodes, style->rest + g * nodes, style->nodes);
    return tangents;
}

void hairstyle_fit_box(Hairstyle* style)
{
    // A box without volume could not be divided by; a millimetre is below any real hairstyle.
    const float least = 0.001f;
    Box box = {{FARTHEST_M, FARTHEST_M, FARTHEST_M}, {-FARTHEST_M, -FARTHEST_M, -FARTHEST_M}};
    for (int guide = 0; guide < style->guide_count; ++guide) {
        Vec3 root = style->rest[(size_t)guide * (size_t)style->nodes];
        float r = fmaxf(least, HAIRSTYLE_SCALE_LENGTH * hairstyle_guide_length(style, guide));
        Vec3 reach = {r, r, r};
        box.low = vec3_min(box.low, vec3_sub(root, reach));
        box.high = vec3_max(box.high, vec3_add(root, reach));
    }
    style->box = box;
}

// The audit -------------------------------------------------------------------------------------

static bool in_range(float value, float low, float high)
{
    return value >= low && value <= high; // false for NaN
}

static bool near_head(Vec3 p)
{
    return in_range(p.x, -FARTHEST_M, FARTHEST_M) && in_range(p.y, -FARTHEST_M, FARTHEST_M) &&
           in_range(p.z, -FARTHEST_M, FARTHEST_M);
}

static bool check_collider(const Collider* c, int number, Fault* fault)
{
    if (!near_head(c->from) || !near_head(c->to) || !in_range(c->radius, 0.0f, FARTHEST_M))
        return fault_set(fault, "collider %d: ends and radius must be finite", number);
    return (c->body >= 0 && c->body < BODY_COUNT) ||
           fault_set(fault, "collider %d: body %d: 0 the head, 1 the torso", number, c->body);
}

static bool is_reflectance(Vec3 c)
{
    return in_range(c.x, 0.0f, 1.0f) && in_range(c.y, 0.0f, 1.0f) && in_range(c.z, 0.0f, 1.0f);
}

bool hairstyle_is_name(const char* text)
{
    size_t length = strnlen(text, HAIRSTYLE_NAME_BYTES);
    for (size_t i = 0; i < length; ++i)
        if (text[i] < ' ' || text[i] > '~') return false;
    return length > strspn(text, " ") && length < HAIRSTYLE_NAME_BYTES;
}

static bool is_name(const char name[HAIRSTYLE_NAME_BYTES])
{
    for (int i = 0; i < HAIRSTYLE_NAME_BYTES; ++i) {
        if (name[i] == '\0') return true;
        if (name[i] < ' ' || name[i] > '~') return false;
    }
    return false;
}

// Whether [first, first + count) lies in [0, total).
static bool is_run(int first, int count, int total)
{
    return first >= 0 && count >= 0 && first <= total && count <= total - first;
}

static bool check_guides(const Hairstyle* style, Fault* fault)
{
    if (!check_guide_counts(style->guide_count, style->nodes, fault)) return false;
    if (style->rest == NULL || style->weight == NULL)
        return fault_set(fault, "guides: %d of them but no table", style->guide_count);
    for (int i = 0; i < style->guide_count * style->nodes; ++i)
        if (!near_head(style->rest[i]))
            return fault_set(fault,
                             "guide %d, node %d: not a finite number within %.0f m of the head",
                             i / style->nodes, i % style->nodes, (double)FARTHEST_M);
    Vec3 low = style->box.low, high = style->box.high;
    // Balls of long guides at the limit reach beyond it, hence the larger cap.
    if (!(low.x < high.x && low.y < high.y && low.z < high.z) ||
        !in_range(vec3_length(vec3_sub(high, low)), 0.0f, 1e5f))
        return fault_set(fault, "box: low must be below high on every axis (hairstyle_fit_box)");
    return true;
}

static bool check_look(const Hairstyle* style, Fault* fault)
{
    if (!is_name(style->name)) return fault_set(fault, "name: must be printable, under 32 bytes");
    if (style->collider_count < 0 || style->collider_count > HAIRSTYLE_MAX_COLLIDERS)
        return fault_set(fault, "%d colliders: at most %d", style->collider_count,
                         HAIRSTYLE_MAX_COLLIDERS);
    for (int i = 0; i < style->collider_count; ++i)
        if (!check_collider(&style->colliders[i], i, fault)) return false;
    const HairMaterial* m = &style->material;
    if (!is_reflectance(m->root_colour) || !is_reflectance(m->tip_colour) ||
        !is_reflectance(m->skin_colour))
        return fault_set(fault, "material: colours are linear reflectances from 0 to 1");
    if (style->head_kind < HEAD_NONE || style->head_kind > HEAD_MESH)
        return fault_set(fault, "head kind %d: 0 none, 1 mannequin or 2 mesh", style->head_kind);
    return near_head(style->head_centre) ||
           fault_set(fault, "head centre is %.4g m away, at most %g: is the unit right (--unit)?",
                     (double)vec3_length(style->head_centre), (double)FARTHEST_M);
}

static bool check_holds(const Hairstyle* style, Fault* fault)
{
    if (style->hold_count < 0 || style->hold_count > HAIRSTYLE_MAX_HOLDS)
        return fault_set(fault, "%d holds: at most %d", style->hold_count, HAIRSTYLE_MAX_HOLDS);
    for (int i = 0; i < style->hold_count; ++i) {
        const Hold* h = &style->holds[i];
        if (h->kind != HOLD_BAND && h->kind != HOLD_CLOTH)
            return fault_set(fault, "hold %d: kind %d: 1 a band, 2 cloth", i, h->kind);
        if (!is_run(h->first_guide, h->guide_count, style->guide_count) || h->guide_count < 2)
            return fault_set(fault, "hold %d: guides %d + %d of %d", i, h->first_guide,
                             h->guide_count, style->guide_count);
        if (h->node < 0 || h->node >= style->nodes)
            return fault_set(fault, "hold %d: node %d of %d", i, h->node, style->nodes);
    }
    return true;
}

static bool check_triangles(const Hairstyle* style, Fault* fault)
{
    if (style->triangle_count < 0 || style->triangle_count > HAIRSTYLE_MAX_TRIANGLES)
        return fault_set(fault, "%d scalp triangles: at most %d", style->triangle_count,
                         HAIRSTYLE_MAX_TRIANGLES);
    if (style->triangle_count > 0 && style->triangles == NULL)
        return fault_set(fault, "%d scalp triangles but no table", style->triangle_count);
    for (int i = 0; i < style->triangle_count; ++i)
        for (int k = 0; k < 3; ++k)
            if (style->triangles[i].guide[k] >= style->guide_count)
                return fault_set(fault, "scalp triangle %d: guide %d of %d", i,
                                 style->triangles[i].guide[k], style->guide_count);
    return true;
}

static bool is_guide_of(const StrandSet* set, int guide)
{
    return guide >= set->first_guide && guide < set->first_guide + set->guide_count;
}

static bool check_set_numbers(const StrandSet* set, int i, Fault* fault)
{
    if (!is_name(set->name))
        return fault_set(fault, "set %d: its name must be printable, under 32 bytes", i);
    if (set->points < 2 || set->points > HAIRSTYLE_MAX_POINTS)
        return fault_set(fault, "set %d: %d points a strand: 2 to %d", i, set->points,
                         HAIRSTYLE_MAX_POINTS);
    if (set->strand_count < 0 || set->strand_count > HAIRSTYLE_MAX_STRANDS)
        return fault_set(fault, "set %d: %d strands: at most %d", i, set->strand_count,
                         HAIRSTYLE_MAX_STRANDS);
    if (!in_range(set->root_width_m, 0.0f, 1.0f) || !in_range(set->tip_width_m, 0.0f, 1.0f))
        return fault_set(fault, "set %d: ribbon widths are metres from 0 to 1", i);
    if (!in_range(set->fibres, 0.0f, 1e6f))
        return fault_set(fault, "set %d: fibres a ribbon: 0 to 1e6", i);
    if (!in_range(set->jitter_m, 0.0f, 1.0f))
        return fault_set(fault, "set %d: jitter is metres from 0 to 1", i);
    return true;
}

static bool check_form(const WispForm* form, int i, Fault* fault)
{
    if (!in_range(form->belly, 0.0f, 10.0f) || !in_range(form->taper, 0.0f, 1.0f) ||
        !in_range(form->clump, 0.0f, 1.0f))
        return fault_set(fault, "set %d: belly 0 to 10, taper and clump 0 to 1", i);
    if (!in_range(form->curl_radius_m, 0.0f, 1.0f) ||
        !in_range(form->curl_turns, -100.0f, 100.0f) || !in_range(form->curl_stiffness, 0.0f, 1.0f))
        return fault_set(
            fault, "set %d: curls have 0 to 1 m of radius, up to 100 turns, stiffness 0 to 1", i);
    return in_range(form->rotation_rad, 0.0f, 6.3f) ||
           fault_set(fault, "set %d: rotation is radians from 0 to 6.3", i);
}

static bool check_magnets(const Hairstyle* style, Fault* fault)
{
    if (style->magnet_count < 0 || style->magnet_count > HAIRSTYLE_MAX_MAGNETS)
        return fault_set(fault, "%d magnets: at most %d", style->magnet_count,
                         HAIRSTYLE_MAX_MAGNETS);
    for (int i = 0; i < style->magnet_count; ++i) {
        const Magnet* m = &style->magnets[i];
        if (!near_head(m->at) || !in_range(m->reach_m, 0.0f, FARTHEST_M) ||
            !in_range(m->pull, -1.0f, 1.0f))
            return fault_set(fault, "magnet %d: place and reach must be finite, pull -1 to 1", i);
    }
    return true;
}

static bool check_grown(const Hairstyle* style, const StrandSet* set, int i, Fault* fault)
{
    if (set->triangle_count < 1 ||
        !is_run(set->first_triangle, set->triangle_count, style->triangle_count))
        return fault_set(fault, "set %d: scalp triangles %d + %d of %d", i, set->first_triangle,
                         set->triangle_count, style->triangle_count);
    for (int t = 0; t < set->triangle_count; ++t)
        for (int k = 0; k < 3; ++k)
            if (!is_guide_of(set, style->triangles[set->first_triangle + t].guide[k]))
                return fault_set(fault, "set %d: scalp triangle %d uses a guide of another set", i,
                                 set->first_triangle + t);
    return true;
}

static bool check_bound_strand(const StrandSet* set, const BoundStrand* strand, int s, Fault* fault)
{
    for (int k = 0; k < 3; ++k)
        if (!is_guide_of(set, strand->guide[k]))
            return fault_set(fault, "strand %d: guide %d is not of its set", s, strand->guide[k]);
    if (strand->weight[0] + strand->weight[1] + strand->weight[2] != 65535)
        return fault_set(fault, "strand %d: its weights must sum to 65535", s);
    return true;
}

// Explicit sets follow each other in both tables without a gap, so that the counts alone (fast
// lane) fix how large the tables (bulk lane) must be. Before the bulk lane came both are empty.
static bool check_explicit(const Hairstyle* style, const StrandSet* set, int i, int first_strand,
                           int first_offset, Fault* fault)
{
    if (set->first_strand != first_strand || set->first_offset != first_offset)
        return fault_set(fault,
                         "set %d: starts at strand %d, offset %d; the sets before it end at %d, %d",
                         i, set->first_strand, set->first_offset, first_strand, first_offset);
    if (style->strand_count == 0) return true;
    if (!is_run(first_strand, set->strand_count, style->strand_count) ||
        !is_run(first_offset, set->strand_count * set->points, style->offset_count))
        return fault_set(fault, "set %d: %d strands of %d points pass the end of the table", i,
                         set->strand_count, set->points);
    for (int s = 0; s < set->strand_count; ++s)
        if (!check_bound_strand(set, style->strands + first_strand + s, first_strand + s, fault))
            return false;
    return true;
}

static bool claim_guides(const Hairstyle* style, const StrandSet* set, int i, bool* taken,
                         Fault* fault)
{
    if (set->guide_count < 1 || !is_run(set->first_guide, set->guide_count, style->guide_count))
        return fault_set(fault, "set %d: guides %d + %d of %d", i, set->first_guide,
                         set->guide_count, style->guide_count);
    for (int guide = set->first_guide; guide < set->first_guide + set->guide_count; ++guide) {
        if (taken[guide]) return fault_set(fault, "set %d: guide %d is in two sets", i, guide);
        taken[guide] = true;
    }
    return true;
}

static bool check_sets(const Hairstyle* style, Fault* fault)
{
    if (style->set_count < 1 || style->set_count > HAIRSTYLE_MAX_SETS)
        return fault_set(fault, "%d strand sets: 1 to %d", style->set_count, HAIRSTYLE_MAX_SETS);
    bool taken[HAIRSTYLE_MAX_GUIDES] = {false};
    int guides = 0, strands = 0, offsets = 0;
    for (int i = 0; i < style->set_count; ++i) {
        const StrandSet* set = &style->sets[i];
        if (!check_set_numbers(set, i, fault) || !check_form(&style->forms[i], i, fault))
            return false;
        if (!claim_guides(style, set, i, taken, fault)) return false;
        guides += set->guide_count;
        if (set->kind == STRANDS_GROWN) {
            if (!check_grown(style, set, i, fault)) return false;
        } else if (set->kind == STRANDS_EXPLICIT) {
            if (!check_explicit(style, set, i, strands, offsets, fault)) return false;
            strands += set->strand_count;
            offsets += set->strand_count * set->points;
        } else {
            return fault_set(fault, "set %d: kind %d: 1 grown or 2 explicit", i, set->kind);
        }
    }
    if (guides != style->guide_count)
        return fault_set(fault, "%d guides, but the sets hold %d", style->guide_count, guides);
    if (strands > HAIRSTYLE_MAX_STRANDS)
        return fault_set(fault, "%d explicit strands: at most %d", strands, HAIRSTYLE_MAX_STRANDS);
    bool has_bulk = style->strand_count != 0;
    if (has_bulk && (style->strand_count != strands || style->offset_count != offsets))
        return fault_set(fault, "%d strands and %d offsets, but the sets hold %d and %d",
                         style->strand_count, style->offset_count, strands, offsets);
    return true;
}

static bool check_strand_tables(const Hairstyle* style, Fault* fault)
{
    if (style->strand_count < 0 || style->strand_count > HAIRSTYLE_MAX_STRANDS ||
        style->offset_count < 0 ||
        style->offset_count > HAIRSTYLE_MAX_STRANDS * HAIRSTYLE_MAX_POINTS)
        return fault_set(fault, "%d strands, %d offsets: at most %d strands of %d points",
                         style->strand_count, style->offset_count, HAIRSTYLE_MAX_STRANDS,
                         HAIRSTYLE_MAX_POINTS);
    if ((style->strand_count == 0) != (style->offset_count == 0) ||
        (style->strand_count > 0 && (style->strands == NULL || style->offsets == NULL)))
        return fault_set(fault, "%d strands with %d offsets: a table is missing",
                         style->strand_count, style->offset_count);
    if (!in_range(style->offset_scale_m, 0.0f, 1.0f))
        return fault_set(fault, "offset scale: metres from 0 to 1");
    return true;
}

static bool check_head_parts(const HeadMesh* mesh, Fault* fault)
{
    if (mesh->part_count < 0 || mesh->part_count > HAIRSTYLE_MAX_PARTS)
        return fault_set(fault, "head: %d parts: at most %d", mesh->part_count,
                         HAIRSTYLE_MAX_PARTS);
    for (int i = 0; i < mesh->part_count; ++i) {
        const HeadPart* part = &mesh->parts[i];
        uint32_t total = (uint32_t)mesh->index_count;
        if (part->first_index % 3 != 0 || part->index_count % 3 != 0 || part->first_index > total ||
            part->index_count > total - part->first_index)
            return fault_set(fault, "head part %d: indices %u + %u of %d", i, part->first_index,
                             part->index_count, mesh->index_count);
        if (!is_reflectance(part->albedo))
            return fault_set(fault, "head part %d: its albedo is a reflectance from 0 to 1", i);
    }
    return true;
}

static bool check_head(const HeadMesh* mesh, Fault* fault)
{
    if (mesh->vertex_count < 0 || mesh->vertex_count > HAIRSTYLE_MAX_VERTICES)
        return fault_set(fault, "head: %d vertices: at most %d", mesh->vertex_count,
                         HAIRSTYLE_MAX_VERTICES);
    if (mesh->index_count < 0 || mesh->index_count > HAIRSTYLE_MAX_INDICES ||
        mesh->index_count % 3 != 0)
        return fault_set(fault, "head: %d indices: at most %d, in threes", mesh->index_count,
                         HAIRSTYLE_MAX_INDICES);
    if ((mesh->vertex_count > 0 && (mesh->positions == NULL || mesh->normals == NULL)) ||
        (mesh->index_count > 0 && mesh->indices == NULL))
        return fault_set(fault, "head: %d vertices, %d indices: a table is missing",
                         mesh->vertex_count, mesh->index_count);
    for (int i = 0; i < mesh->vertex_count; ++i)
        if (!near_head(mesh->positions[i]) || !vec3_finite(mesh->normals[i]))
            return fault_set(fault, "head vertex %d: not a finite number within %.0f m", i,
                             (double)FARTHEST_M);
    for (int i = 0; i < mesh->index_count; ++i)
        if (mesh->indices[i] >= (uint32_t)mesh->vertex_count)
            return fault_set(fault, "head index %d: vertex %u of %d", i, mesh->indices[i],
                             mesh->vertex_count);
    return check_head_parts(mesh, fault);
}

bool hairstyle_validate(const Hairstyle* style, Fault* fault)
{
    return check_look(style, fault) && check_guides(style, fault) &&
           check_triangles(style, fault) && check_holds(style, fault) &&
           check_magnets(style, fault) && check_strand_tables(style, fault) &&
           check_sets(style, fault) && check_head(&style->head, fault);
}
