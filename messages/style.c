#include "messages/style.h"

#include "messages/quantise.h"

#include <stdlib.h>
#include <string.h>
#include <xxhash.h>
#include <zlib.h>

#define MAGIC           0x59545348u // "HSTY"
#define RAW_MAX_BYTES   (16u * 1024 * 1024)
#define BULK_LEAD_BYTES 4   // raw size, before the deflated bytes
#define NORMAL_STEPS    511 // ten bits: 0.1 degrees (tables/quant.csv, "xyz snorm10 renorm")

// A cursor over bytes. One type for both directions lets one function describe a layout for writing
// and for reading, so that the two cannot drift apart.
typedef struct Cursor {
    uint8_t* out;
    const uint8_t* in;
    size_t at, size;
    uint32_t format; // of the style in transit; a written one is STYLE_FORMAT
    bool passed_end;
} Cursor;

static void carry_bytes(Cursor* cursor, void* value, size_t count)
{
    if (count > cursor->size - cursor->at) {
        cursor->passed_end = true;
        if (cursor->in != NULL) memset(value, 0, count);
        return;
    }
    if (cursor->in != NULL)
        memcpy(value, cursor->in + cursor->at, count);
    else
        memcpy(cursor->out + cursor->at, value, count);
    cursor->at += count;
}

static void carry_int(Cursor* cursor, int* value)
{
    int32_t number = *value;
    carry_bytes(cursor, &number, sizeof number);
    *value = number;
}

static void carry_vec3(Cursor* cursor, Vec3* value)
{
    carry_bytes(cursor, &value->x, 4);
    carry_bytes(cursor, &value->y, 4);
    carry_bytes(cursor, &value->z, 4);
}

// Bytes behind a name's end are made zero: they would be part of the style's identity.
static void carry_name(Cursor* cursor, char name[HAIRSTYLE_NAME_BYTES])
{
    char padded[HAIRSTYLE_NAME_BYTES] = {0};
    memcpy(padded, name, strnlen(name, HAIRSTYLE_NAME_BYTES));
    carry_bytes(cursor, padded, sizeof padded);
    memcpy(name, padded, strnlen(padded, HAIRSTYLE_NAME_BYTES));
    memset(name + strnlen(padded, HAIRSTYLE_NAME_BYTES), 0,
           HAIRSTYLE_NAME_BYTES - strnlen(padded, HAIRSTYLE_NAME_BYTES));
}

// Fast lane -------------------------------------------------------------------------------------

typedef struct FastLead {
    uint32_t magic, format, bulk_size;
    uint64_t bulk_hash;
} FastLead;

static void carry_lead(Cursor* cursor, FastLead* lead)
{
    carry_bytes(cursor, &lead->magic, 4);
    carry_bytes(cursor, &lead->format, 4);
    carry_bytes(cursor, &lead->bulk_size, 4);
    carry_bytes(cursor, &lead->bulk_hash, 8);
}

// `map_count`: MAP_COUNT, or 0 of a style without maps.
static void carry_fixed(Cursor* cursor, Hairstyle* style, int* map_count)
{
    carry_name(cursor, style->name);
    carry_bytes(cursor, &style->seed, 4);
    carry_int(cursor, &style->guide_count);
    carry_int(cursor, &style->nodes);
    carry_int(cursor, &style->set_count);
    carry_int(cursor, &style->triangle_count);
    carry_int(cursor, &style->collider_count);
    if (cursor->format >= 2) carry_int(cursor, &style->hold_count);
    if (cursor->format >= 3) {
        carry_int(cursor, &style->magnet_count);
        carry_int(cursor, map_count);
    }
    carry_int(cursor, &style->head_kind);
    carry_bytes(cursor, &style->offset_scale_m, 4);
    carry_vec3(cursor, &style->material.root_colour);
    carry_vec3(cursor, &style->material.tip_colour);
    carry_vec3(cursor, &style->material.skin_colour);
    carry_vec3(cursor, &style->head_centre);
    carry_vec3(cursor, &style->box.low);
    carry_vec3(cursor, &style->box.high);
}

static void carry_set(Cursor* cursor, StrandSet* set)
{
    carry_name(cursor, set->name);
    carry_int(cursor, &set->kind);
    carry_int(cursor, &set->first_guide);
    carry_int(cursor, &set->guide_count);
    carry_int(cursor, &set->first_triangle);
    carry_int(cursor, &set->triangle_count);
    carry_int(cursor, &set->first_strand);
    carry_int(cursor, &set->strand_count);
    carry_int(cursor, &set->first_offset);
    carry_int(cursor, &set->points);
    carry_bytes(cursor, &set->root_width_m, 4);
    carry_bytes(cursor, &set->tip_width_m, 4);
    carry_bytes(cursor, &set->fibres, 4);
    carry_bytes(cursor, &set->jitter_m, 4);
}

static void carry_form(Cursor* cursor, WispForm* form)
{
    carry_bytes(cursor, &form->belly, 4);
    carry_bytes(cursor, &form->taper, 4);
    carry_bytes(cursor, &form->curl_radius_m, 4);
    carry_bytes(cursor, &form->curl_turns, 4);
    carry_bytes(cursor, &form->curl_stiffness, 4);
    carry_bytes(cursor, &form->rotation_rad, 4);
    carry_bytes(cursor, &form->clump, 4);
}

static void carry_magnet(Cursor* cursor, Magnet* magnet)
{
    carry_vec3(cursor, &magnet->at);
    carry_bytes(cursor, &magnet->reach_m, 4);
    carry_bytes(cursor, &magnet->pull, 4);
}

// A collider of format 1 was a sphere of the head: a capsule whose ends are one point.
static void carry_collider(Cursor* cursor, Collider* collider)
{
    carry_vec3(cursor, &collider->from);
    if (cursor->format >= 2)
        carry_vec3(cursor, &collider->to);
    else
        collider->to = collider->from;
    carry_bytes(cursor, &collider->radius, 4);
    if (cursor->format >= 2) carry_int(cursor, &collider->body);
}

// Everything whose length the fixed part announced.
static void carry_tables(Cursor* cursor, Hairstyle* style)
{
    for (int i = 0; i < style->set_count; ++i)
        carry_set(cursor, &style->sets[i]);
    for (int i = 0; i < style->set_count && cursor->format >= 3; ++i)
        carry_form(cursor, &style->forms[i]);
    for (int i = 0; i < style->collider_count; ++i)
        carry_collider(cursor, &style->colliders[i]);
    for (int i = 0; i < style->hold_count; ++i) {
        carry_int(cursor, &style->holds[i].kind);
        carry_int(cursor, &style->holds[i].first_guide);
        carry_int(cursor, &style->holds[i].guide_count);
        carry_int(cursor, &style->holds[i].node);
    }
    for (int i = 0; i < style->magnet_count; ++i)
        carry_magnet(cursor, &style->magnets[i]);
    for (int i = 0; i < style->triangle_count; ++i)
        carry_bytes(cursor, style->triangles[i].guide, 6);
    for (int i = 0; i < style->guide_count * style->nodes; ++i)
        carry_vec3(cursor, &style->rest[i]);
    carry_bytes(cursor, style->weight, (size_t)(style->guide_count * style->nodes));
    if (style->maps != NULL)
        carry_bytes(cursor, style->maps, (size_t)style->guide_count * MAP_COUNT);
}

static bool allocate_tables(Hairstyle* style, int map_count, Fault* fault)
{
    if (style->set_count < 0 || style->set_count > HAIRSTYLE_MAX_SETS ||
        style->collider_count < 0 || style->collider_count > HAIRSTYLE_MAX_COLLIDERS ||
        style->hold_count < 0 || style->hold_count > HAIRSTYLE_MAX_HOLDS ||
        style->triangle_count < 0 || style->triangle_count > HAIRSTYLE_MAX_TRIANGLES)
        return fault_set(
            fault, "style: %d sets, %d colliders, %d holds, %d triangles: beyond the caps",
            style->set_count, style->collider_count, style->hold_count, style->triangle_count);
    if (style->magnet_count < 0 || style->magnet_count > HAIRSTYLE_MAX_MAGNETS ||
        (map_count != 0 && map_count != MAP_COUNT))
        return fault_set(fault, "style: %d magnets, at most %d; %d maps, 0 or %d",
                         style->magnet_count, HAIRSTYLE_MAX_MAGNETS, map_count, MAP_COUNT);
    if (!hairstyle_set_guides(style, style->guide_count, style->nodes, fault) ||
        (map_count > 0 && !hairstyle_add_maps(style, fault)))
        return false;
    style->triangles = calloc((size_t)style->triangle_count + 1, sizeof *style->triangles);
    return style->triangles != NULL || fault_set(fault, "style: no memory for its triangles");
}

static bool check_lead(const FastLead* lead, Fault* fault)
{
    if (lead->magic != MAGIC) return fault_set(fault, "style: these bytes are not a style");
    if (lead->format < STYLE_FORMAT_OLDEST || lead->format > STYLE_FORMAT)
        return fault_set(fault, "style: format %u; this program reads formats %d to %d",
                         lead->format, STYLE_FORMAT_OLDEST, STYLE_FORMAT);
    if (lead->bulk_size > STYLE_BULK_MAX_BYTES)
        return fault_set(fault, "style: a bulk lane of %u bytes; at most %d", lead->bulk_size,
                         STYLE_BULK_MAX_BYTES);
    return true;
}

static bool read_fast(Hairstyle* style, Cursor* cursor, Fault* fault)
{
    int map_count = 0;
    carry_fixed(cursor, style, &map_count);
    if (cursor->passed_end) return fault_set(fault, "style: cut off inside its fixed part");
    // The counts are read before the arrays exist; set_guides must see no pointers to free.
    if (!allocate_tables(style, map_count, fault)) return false;
    carry_tables(cursor, style);
    if (cursor->passed_end || cursor->at != cursor->size)
        return fault_set(fault, "style: %zu bytes, which disagrees with its counts", cursor->size);
    return hairstyle_validate(style, fault);
}

Hairstyle* style_decode_fast(const uint8_t* bytes, size_t size, size_t* bulk_size,
                             uint64_t* bulk_hash, Fault* fault)
{
    if (size > STYLE_FAST_MAX_BYTES) {
        fault_set(fault, "style: a fast lane of %zu bytes; at most %d", size, STYLE_FAST_MAX_BYTES);
        return NULL;
    }
    Cursor cursor = {.in = bytes, .size = size};
    FastLead lead = {0}; // stays zero where the bytes end first
    carry_lead(&cursor, &lead);
    if (!check_lead(&lead, fault)) return NULL;
    cursor.format = lead.format;
    Hairstyle* style = hairstyle_create();
    if (style == NULL) {
        fault_set(fault, "style: no memory");
        return NULL;
    }
    if (!read_fast(style, &cursor, fault)) {
        hairstyle_destroy(style);
        return NULL;
    }
    *bulk_size = lead.bulk_size;
    *bulk_hash = lead.bulk_hash;
    return style;
}

static bool encode_fast(StyleBytes* bytes, const Hairstyle* style, Fault* fault)
{
    uint8_t* lane = malloc(STYLE_FAST_MAX_BYTES);
    if (lane == NULL) return fault_set(fault, "style: no memory");
    FastLead lead = {MAGIC, STYLE_FORMAT, (uint32_t)bytes->size[STYLE_BULK],
                     style_hash(bytes->lane[STYLE_BULK], bytes->size[STYLE_BULK])};
    Cursor cursor = {.out = lane, .size = STYLE_FAST_MAX_BYTES, .format = STYLE_FORMAT};
    // carry_* writes through its pointer only when reading or to pad a name with zeros, and both
    // leave a copy's arrays as they are.
    Hairstyle copy = *style;
    int map_count = style->maps != NULL ? MAP_COUNT : 0;
    carry_lead(&cursor, &lead);
    carry_fixed(&cursor, &copy, &map_count);
    carry_tables(&cursor, &copy);
    if (cursor.passed_end) {
        free(lane);
        return fault_set(fault,
                         "style: %d guides of %d nodes and %d scalp triangles pass %d bytes; "
                         "use fewer guides or nodes",
                         style->guide_count, style->nodes, style->triangle_count,
                         STYLE_FAST_MAX_BYTES);
    }
    bytes->lane[STYLE_FAST] = lane;
    bytes->size[STYLE_FAST] = cursor.at;
    bytes->hash = style_hash(lane, cursor.at);
    return true;
}

// Bulk lane -------------------------------------------------------------------------------------
// A lead of counts, then only planes of 16-bit numbers: each is predicted from its neighbour, the
// difference zigzagged and its low and high bytes kept apart, which is what deflate likes.

typedef struct BulkLead {
    int strands, offsets, vertices, indices, parts;
    Box mesh_box;
} BulkLead;

#define BULK_LEAD_RAW_BYTES (5 * 4 + 6 * 4)
#define BULK_PART_RAW_BYTES (2 * 4 + 3 * 4 + 4)
#define STRAND_PLANES       6 // three guides, two weights (the third is the rest), tip height

static void carry_bulk_lead(Cursor* cursor, BulkLead* lead)
{
    carry_int(cursor, &lead->strands);
    carry_int(cursor, &lead->offsets);
    carry_int(cursor, &lead->vertices);
    carry_int(cursor, &lead->indices);
    carry_int(cursor, &lead->parts);
    carry_vec3(cursor, &lead->mesh_box.low);
    carry_vec3(cursor, &lead->mesh_box.high);
}

static void carry_part(Cursor* cursor, HeadPart* part)
{
    uint32_t is_skin = part->is_skin;
    carry_bytes(cursor, &part->first_index, 4);
    carry_bytes(cursor, &part->index_count, 4);
    carry_vec3(cursor, &part->albedo);
    carry_bytes(cursor, &is_skin, 4);
    part->is_skin = is_skin != 0;
}

static size_t raw_size(const BulkLead* lead)
{
    size_t numbers = (size_t)lead->strands * STRAND_PLANES + (size_t)lead->offsets * 3 +
                     (size_t)lead->vertices * 6 + (size_t)lead->indices;
    return BULK_LEAD_RAW_BYTES + (size_t)lead->parts * BULK_PART_RAW_BYTES + numbers * 2;
}

// A plane of numbers in transit: a row is a strand's points, a triangle or the whole plane.
typedef struct Plane {
    uint16_t* numbers;
    int count, row;
    bool is_curve; // rows are smooth: extrapolate
} Plane;

// The first of a row is predicted by the first of the row before, the rest by the number before or,
// along a strand, by the line through the two before: the real groom deflates to 325 KB with that,
// to 364 KB without.
static uint16_t predicted(const Plane* plane, int i)
{
    if (i == 0) return 0;
    int column = i % plane->row;
    if (column == 0) return plane->numbers[i - plane->row];
    if (column == 1 || !plane->is_curve) return plane->numbers[i - 1];
    return (uint16_t)(2 * plane->numbers[i - 1] - plane->numbers[i - 2]);
}

static uint16_t zigzag(uint16_t difference)
{
    return (uint16_t)((difference << 1) ^ (difference & 0x8000 ? 0xffff : 0));
}

static uint16_t unzigzag(uint16_t code)
{
    return (uint16_t)((code >> 1) ^ (code & 1 ? 0xffff : 0));
}

static void write_plane(Cursor* cursor, const Plane* plane)
{
    uint8_t* low = cursor->out + cursor->at;
    uint8_t* high = low + plane->count;
    for (int i = 0; i < plane->count; ++i) {
        uint16_t code = zigzag((uint16_t)(plane->numbers[i] - predicted(plane, i)));
        low[i] = (uint8_t)code;
        high[i] = (uint8_t)(code >> 8);
    }
}

static void read_plane(Cursor* cursor, const Plane* plane)
{
    const uint8_t* low = cursor->in + cursor->at;
    const uint8_t* high = low + plane->count;
    for (int i = 0; i < plane->count; ++i) {
        uint16_t code = (uint16_t)(low[i] | high[i] << 8);
        plane->numbers[i] = (uint16_t)(unzigzag(code) + predicted(plane, i));
    }
}

static void carry_plane(Cursor* cursor, const Plane* plane)
{
    size_t bytes = 2 * (size_t)plane->count;
    if (bytes > cursor->size - cursor->at) {
        cursor->passed_end = true;
        return;
    }
    if (cursor->in != NULL)
        read_plane(cursor, plane);
    else
        write_plane(cursor, plane);
    cursor->at += bytes;
}

// Every plane is one component, `offset` bytes into each structure of an array, `stride` bytes
// apart.
static void carry_component(Cursor* cursor, void* array, size_t offset, size_t stride, Plane plane)
{
    uint8_t* at = (uint8_t*)array + offset;
    if (cursor->in == NULL)
        for (int i = 0; i < plane.count; ++i)
            memcpy(&plane.numbers[i], at + stride * (size_t)i, 2);
    carry_plane(cursor, &plane);
    if (cursor->in != NULL && !cursor->passed_end)
        for (int i = 0; i < plane.count; ++i)
            memcpy(at + stride * (size_t)i, &plane.numbers[i], 2);
}

static void carry_strands(Cursor* cursor, uint16_t* scratch, BoundStrand* strands, int count)
{
    if (count == 0) return;
    Plane plane = {scratch, count, count, false};
    for (int k = 0; k < 3; ++k)
        carry_component(cursor, strands, offsetof(BoundStrand, guide) + 2 * (size_t)k,
                        sizeof *strands, plane);
    for (int k = 0; k < 2; ++k)
        carry_component(cursor, strands, offsetof(BoundStrand, weight) + 2 * (size_t)k,
                        sizeof *strands, plane);
    carry_component(cursor, strands, offsetof(BoundStrand, tip_height), sizeof *strands, plane);
    if (cursor->in == NULL) return;
    // Where two weights pass 65535 together the third wraps, the sum is wrong and validate says so.
    for (int i = 0; i < count; ++i)
        strands[i].weight[2] = (uint16_t)(65535 - strands[i].weight[0] - strands[i].weight[1]);
}

static void carry_offsets(Cursor* cursor, uint16_t* scratch, const Hairstyle* style,
                          StrandOffset* offsets)
{
    for (int i = 0; i < style->set_count; ++i) {
        const StrandSet* set = &style->sets[i];
        int count = set->strand_count * set->points;
        if (set->kind != STRANDS_EXPLICIT || count == 0) continue;
        StrandOffset* first = offsets + set->first_offset;
        Plane plane = {scratch, count, set->points, true};
        carry_component(cursor, first, offsetof(StrandOffset, x), sizeof *first, plane);
        carry_component(cursor, first, offsetof(StrandOffset, y), sizeof *first, plane);
        carry_component(cursor, first, offsetof(StrandOffset, z), sizeof *first, plane);
    }
}

// A head vertex in transit.
typedef struct MeshTexel {
    uint16_t position[3];
    int16_t normal[3];
} MeshTexel;

static void carry_mesh(Cursor* cursor, uint16_t* scratch, MeshTexel* texels, int vertices,
                       uint16_t* indices, int index_count)
{
    if (vertices == 0) return;
    Plane plane = {scratch, vertices, vertices, false};
    for (int k = 0; k < 3; ++k)
        carry_component(cursor, texels, offsetof(MeshTexel, position) + 2 * (size_t)k,
                        sizeof *texels, plane);
    for (int k = 0; k < 3; ++k)
        carry_component(cursor, texels, offsetof(MeshTexel, normal) + 2 * (size_t)k, sizeof *texels,
                        plane);
    if (index_count == 0) return;
    // A triangle's first corner is close to the one before's, its others to their neighbours.
    carry_component(cursor, indices, 0, sizeof *indices, (Plane){scratch, index_count, 3, false});
}

// What a bulk lane is made from or becomes: the tables of a style, with the mesh as integers.
typedef struct BulkTables {
    BulkLead lead;
    BoundStrand* strands;
    StrandOffset* offsets;
    MeshTexel* texels;
    uint16_t* indices;
    uint16_t* scratch;
    HeadPart parts[HAIRSTYLE_MAX_PARTS];
} BulkTables;

static void free_tables(BulkTables* tables)
{
    free(tables->strands);
    free(tables->offsets);
    free(tables->texels);
    free(tables->indices);
    free(tables->scratch);
}

static bool allocate_bulk(BulkTables* tables, Fault* fault)
{
    const BulkLead* lead = &tables->lead;
    int longest = lead->offsets;
    if (lead->strands > longest) longest = lead->strands;
    if (lead->vertices > longest) longest = lead->vertices;
    if (lead->indices > longest) longest = lead->indices;
    // One more of each: an empty table is still a pointer, and calloc(0) may be NULL.
    tables->strands = calloc((size_t)lead->strands + 1, sizeof *tables->strands);
    tables->offsets = calloc((size_t)lead->offsets + 1, sizeof *tables->offsets);
    tables->texels = calloc((size_t)lead->vertices + 1, sizeof *tables->texels);
    tables->indices = calloc((size_t)lead->indices + 1, sizeof *tables->indices);
    tables->scratch = calloc((size_t)longest + 1, sizeof *tables->scratch);
    if (tables->strands != NULL && tables->offsets != NULL && tables->texels != NULL &&
        tables->indices != NULL && tables->scratch != NULL)
        return true;
    return fault_set(fault, "style: no memory for %zu bytes of strands and head", raw_size(lead));
}

static void carry_bulk_tables(Cursor* cursor, BulkTables* tables, const Hairstyle* style)
{
    const BulkLead* lead = &tables->lead;
    for (int i = 0; i < lead->parts; ++i)
        carry_part(cursor, &tables->parts[i]);
    carry_strands(cursor, tables->scratch, tables->strands, lead->strands);
    if (lead->offsets > 0) carry_offsets(cursor, tables->scratch, style, tables->offsets);
    carry_mesh(cursor, tables->scratch, tables->texels, lead->vertices, tables->indices,
               lead->indices);
}

// What the sets announce the bulk lane to hold.
static void count_explicit(const Hairstyle* style, int* strands, int* offsets)
{
    *strands = *offsets = 0;
    for (int i = 0; i < style->set_count; ++i) {
        const StrandSet* set = &style->sets[i];
        if (set->kind != STRANDS_EXPLICIT) continue;
        *strands += set->strand_count;
        *offsets += set->strand_count * set->points;
    }
}

// Quantising the mesh ---------------------------------------------------------------------------

static Box mesh_box(const HeadMesh* mesh)
{
    if (mesh->vertex_count == 0) return (Box){0};
    Box box = {mesh->positions[0], mesh->positions[0]};
    for (int i = 1; i < mesh->vertex_count; ++i) {
        Vec3 p = mesh->positions[i];
        box.low = vec3(fminf(box.low.x, p.x), fminf(box.low.y, p.y), fminf(box.low.z, p.z));
        box.high = vec3(fmaxf(box.high.x, p.x), fmaxf(box.high.y, p.y), fmaxf(box.high.z, p.z));
    }
    return box;
}

static int16_t normal_step(float value)
{
    return (int16_t)(value * NORMAL_STEPS + (value < 0.0f ? -0.5f : 0.5f));
}

static void quantise_mesh(BulkTables* tables, const HeadMesh* mesh)
{
    for (int i = 0; i < mesh->vertex_count; ++i) {
        MeshTexel* texel = &tables->texels[i];
        quantise_position(texel->position, mesh->positions[i], &tables->lead.mesh_box);
        Vec3 n = vec3_normalise_or(mesh->normals[i], vec3(0.0f, 1.0f, 0.0f));
        texel->normal[0] = normal_step(n.x);
        texel->normal[1] = normal_step(n.y);
        texel->normal[2] = normal_step(n.z);
    }
    for (int i = 0; i < mesh->index_count; ++i)
        tables->indices[i] = (uint16_t)mesh->indices[i];
    memcpy(tables->parts, mesh->parts, sizeof tables->parts);
}

static bool dequantise_mesh(HeadMesh* mesh, const BulkTables* tables, Fault* fault)
{
    const BulkLead* lead = &tables->lead;
    mesh->vertex_count = lead->vertices;
    mesh->index_count = lead->indices;
    mesh->part_count = lead->parts;
    memcpy(mesh->parts, tables->parts, sizeof mesh->parts);
    if (lead->vertices == 0) return true;
    mesh->positions = malloc((size_t)lead->vertices * sizeof *mesh->positions);
    mesh->normals = malloc((size_t)lead->vertices * sizeof *mesh->normals);
    mesh->indices = malloc(((size_t)lead->indices + 1) * sizeof *mesh->indices);
    if (mesh->positions == NULL || mesh->normals == NULL || mesh->indices == NULL)
        return fault_set(fault, "style: no memory for a head of %d vertices", lead->vertices);
    for (int i = 0; i < lead->vertices; ++i) {
        const MeshTexel* texel = &tables->texels[i];
        mesh->positions[i] = dequantise_position(texel->position, &lead->mesh_box);
        Vec3 n = vec3(texel->normal[0], texel->normal[1], texel->normal[2]);
        mesh->normals[i] = vec3_normalise_or(n, vec3(0.0f, 1.0f, 0.0f));
    }
    for (int i = 0; i < lead->indices; ++i)
        mesh->indices[i] = tables->indices[i];
    return true;
}

// Encoding --------------------------------------------------------------------------------------

static bool deflate_lane(StyleBytes* bytes, const uint8_t* raw, size_t size, Fault* fault)
{
    uLongf deflated = compressBound((uLong)size);
    uint8_t* lane = malloc(BULK_LEAD_BYTES + deflated);
    if (lane == NULL || compress2(lane + BULK_LEAD_BYTES, &deflated, raw, (uLong)size, 9) != Z_OK) {
        free(lane);
        return fault_set(fault, "style: no memory to deflate %zu bytes", size);
    }
    if (BULK_LEAD_BYTES + deflated > STYLE_BULK_MAX_BYTES) {
        free(lane);
        return fault_set(fault,
                         "style: its strands and head deflate to %lu bytes, the cap is %d; "
                         "import fewer strands or points, or a coarser head",
                         (unsigned long)deflated, STYLE_BULK_MAX_BYTES);
    }
    uint32_t announced = (uint32_t)size;
    memcpy(lane, &announced, BULK_LEAD_BYTES);
    bytes->lane[STYLE_BULK] = lane;
    bytes->size[STYLE_BULK] = BULK_LEAD_BYTES + deflated;
    return true;
}

static bool fill_tables(BulkTables* tables, const Hairstyle* style, Fault* fault)
{
    const HeadMesh* mesh = &style->head;
    if (!allocate_bulk(tables, fault)) return false;
    if (tables->lead.strands > 0) {
        memcpy(tables->strands, style->strands,
               (size_t)tables->lead.strands * sizeof *tables->strands);
        memcpy(tables->offsets, style->offsets,
               (size_t)tables->lead.offsets * sizeof *tables->offsets);
    }
    if (tables->lead.vertices > 0) quantise_mesh(tables, mesh);
    return true;
}

static bool deflate_tables(StyleBytes* bytes, BulkTables* tables, const Hairstyle* style,
                           Fault* fault)
{
    size_t size = raw_size(&tables->lead);
    if (size > RAW_MAX_BYTES)
        return fault_set(fault,
                         "style: %zu bytes of strands and head, the cap is %u; import fewer "
                         "strands or points, or a coarser head",
                         size, RAW_MAX_BYTES);
    uint8_t* raw = malloc(size);
    if (raw == NULL) return fault_set(fault, "style: no memory for %zu bytes", size);
    Cursor cursor = {.out = raw, .size = size};
    carry_bulk_lead(&cursor, &tables->lead);
    carry_bulk_tables(&cursor, tables, style);
    bool deflated = deflate_lane(bytes, raw, size, fault);
    free(raw);
    return deflated;
}

static bool encode_bulk(StyleBytes* bytes, const Hairstyle* style, Fault* fault)
{
    BulkTables tables = {.lead = {.strands = style->strand_count, .offsets = style->offset_count}};
    int strands, offsets;
    count_explicit(style, &strands, &offsets);
    if (strands != style->strand_count)
        return fault_set(fault, "style: its sets hold %d imported strands, its table %d", strands,
                         style->strand_count);
    if (style->head_kind == HEAD_MESH) {
        const HeadMesh* mesh = &style->head;
        if (mesh->vertex_count == 0) return fault_set(fault, "style: its head mesh is missing");
        tables.lead.vertices = mesh->vertex_count;
        tables.lead.indices = mesh->index_count;
        tables.lead.parts = mesh->part_count;
        tables.lead.mesh_box = mesh_box(mesh);
    }
    if (tables.lead.strands == 0 && tables.lead.vertices == 0) return true;
    bool encoded =
        fill_tables(&tables, style, fault) && deflate_tables(bytes, &tables, style, fault);
    free_tables(&tables);
    return encoded;
}

bool style_encode(StyleBytes* bytes, const Hairstyle* style, Fault* fault)
{
    *bytes = (StyleBytes){0};
    if (hairstyle_validate(style, fault) && encode_bulk(bytes, style, fault) &&
        encode_fast(bytes, style, fault))
        return true;
    style_bytes_free(bytes);
    return false;
}

void style_bytes_free(StyleBytes* bytes)
{
    for (int lane = 0; lane < STYLE_LANES; ++lane)
        free(bytes->lane[lane]);
    *bytes = (StyleBytes){0};
}

uint64_t style_hash(const uint8_t* bytes, size_t size)
{
    return XXH64(bytes, size, 0);
}

// Decoding the bulk lane ------------------------------------------------------------------------

static uint8_t* inflate_lane(const uint8_t* bytes, size_t size, size_t* raw_bytes, Fault* fault)
{
    uint32_t announced = 0;
    if (size <= BULK_LEAD_BYTES || size > STYLE_BULK_MAX_BYTES) {
        fault_set(fault, "style: a bulk lane of %zu bytes; at most %d", size, STYLE_BULK_MAX_BYTES);
        return NULL;
    }
    memcpy(&announced, bytes, BULK_LEAD_BYTES);
    if (announced < BULK_LEAD_RAW_BYTES || announced > RAW_MAX_BYTES) {
        fault_set(fault, "style: a bulk lane that announces %u bytes; at most %u", announced,
                  RAW_MAX_BYTES);
        return NULL;
    }
    uint8_t* raw = malloc(announced);
    uLongf inflated = announced;
    uLong consumed = (uLong)(size - BULK_LEAD_BYTES);
    if (raw == NULL || uncompress2(raw, &inflated, bytes + BULK_LEAD_BYTES, &consumed) != Z_OK ||
        inflated != announced || consumed != size - BULK_LEAD_BYTES) {
        free(raw);
        fault_set(fault, "style: a bulk lane that does not inflate to the %u bytes it announces",
                  announced);
        return NULL;
    }
    *raw_bytes = announced;
    return raw;
}

static bool check_bulk_lead(const BulkLead* lead, const Hairstyle* style, size_t size, Fault* fault)
{
    int strands, offsets;
    count_explicit(style, &strands, &offsets);
    if (lead->strands != strands || lead->offsets != offsets)
        return fault_set(fault, "style: %d strands and %d offsets in bulk; its sets hold %d and %d",
                         lead->strands, lead->offsets, strands, offsets);
    bool wants_mesh = style->head_kind == HEAD_MESH;
    if (lead->vertices < 0 || lead->vertices > HAIRSTYLE_MAX_VERTICES || lead->indices < 0 ||
        lead->indices > HAIRSTYLE_MAX_INDICES || lead->parts < 0 ||
        lead->parts > HAIRSTYLE_MAX_PARTS || (lead->vertices > 0) != wants_mesh ||
        (!wants_mesh && (lead->indices > 0 || lead->parts > 0)))
        return fault_set(fault, "style: a head of %d vertices, %d indices, %d parts in bulk",
                         lead->vertices, lead->indices, lead->parts);
    if (raw_size(lead) != size)
        return fault_set(fault, "style: %zu bytes in bulk, its counts need %zu", size,
                         raw_size(lead));
    return true;
}

static bool read_bulk(BulkTables* tables, const Hairstyle* style, const uint8_t* raw, size_t size,
                      Fault* fault)
{
    Cursor cursor = {.in = raw, .size = size};
    carry_bulk_lead(&cursor, &tables->lead);
    if (!check_bulk_lead(&tables->lead, style, size, fault)) return false;
    if (!allocate_bulk(tables, fault)) return false;
    carry_bulk_tables(&cursor, tables, style);
    return !cursor.passed_end || fault_set(fault, "style: its bulk lane is cut off");
}

// Validates the style as it would be, then hands the new tables over; a fault leaves it as it was.
static bool adopt_tables(Hairstyle* style, BulkTables* tables, Fault* fault)
{
    Hairstyle next = *style;
    next.strand_count = tables->lead.strands;
    next.offset_count = tables->lead.offsets;
    next.strands = tables->strands;
    next.offsets = tables->offsets;
    next.head = (HeadMesh){0};
    if (!dequantise_mesh(&next.head, tables, fault) || !hairstyle_validate(&next, fault)) {
        head_mesh_free(&next.head);
        return false;
    }
    free(style->strands);
    free(style->offsets);
    head_mesh_free(&style->head);
    tables->strands = NULL;
    tables->offsets = NULL;
    *style = next;
    return true;
}

bool style_decode_bulk(Hairstyle* style, const uint8_t* bytes, size_t size, Fault* fault)
{
    size_t raw_bytes;
    uint8_t* raw = inflate_lane(bytes, size, &raw_bytes, fault);
    if (raw == NULL) return false;
    BulkTables tables = {0};
    bool decoded =
        read_bulk(&tables, style, raw, raw_bytes, fault) && adopt_tables(style, &tables, fault);
    free_tables(&tables);
    free(raw);
    return decoded;
}
