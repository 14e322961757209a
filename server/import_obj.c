#include "server/import.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

// Head space knows metres only; a head further than this from its origin has the wrong unit.
#define FARTHEST_M 90.0f

// How much raw data we hold before indices pick from it: enough for any head that fits a HeadMesh.
#define MAX_RAW (16 * HAIRSTYLE_MAX_VERTICES)

// Colours by name, first match wins: "headband" is a band before it is a head, "body_skin" a
// garment. Linear reflectances of assets' path-traced reference.
typedef struct Paint {
    const char* fragment;
    Vec3 albedo;
    bool is_skin;
} Paint;

static const Paint paints[] = {
    {"band", {0.05f, 0.05f, 0.05f}, false},  {"tie", {0.05f, 0.05f, 0.05f}, false},
    {"eye", {0.6f, 0.6f, 0.6f}, false},      {"teeth", {0.6f, 0.6f, 0.6f}, false},
    {"tongue", {0.5f, 0.3f, 0.3f}, false},   {"jacket", {0.18f, 0.18f, 0.18f}, false},
    {"cloth", {0.18f, 0.18f, 0.18f}, false}, {"shirt", {0.18f, 0.18f, 0.18f}, false},
    {"head", {0.50f, 0.41f, 0.385f}, true},  {"skin", {0.50f, 0.41f, 0.385f}, true},
    {"face", {0.50f, 0.41f, 0.385f}, true},  {"body", {0.18f, 0.18f, 0.18f}, false},
    {"", {0.50f, 0.41f, 0.385f}, false}, // whatever else
};

enum { PAINTS = sizeof paints / sizeof *paints };

// A growing table of three-vectors.
typedef struct Table {
    Vec3* at;
    int count, capacity;
} Table;

typedef struct Triangle {
    uint32_t vertex[3];
    uint8_t paint;
} Triangle;

// Which mesh vertex a pair of position and normal became: open addressing, key 0 is empty.
typedef struct Pair {
    uint64_t key;
    uint32_t vertex;
} Pair;

#define PAIR_SLOTS (1u << 18) // 4 x HAIRSTYLE_MAX_VERTICES: never more than a quarter full

typedef struct Reader {
    const char* at; // into the text, which ends with a NUL
    int line;
    const char* path;
    float unit_m;
    bool negate_z;
    Table positions, normals;
    Pair* pairs;
    HeadMesh* mesh;
    bool* has_normal; // of mesh vertex
    Triangle* triangles;
    int triangle_count;
    uint8_t paint;
    bool has_objects; // `o` was seen: `g` no longer names parts
    bool used[PAINTS];
    Fault* fault;
} Reader;

static bool refuse(Reader* reader, const char* what)
{
    return fault_set(reader->fault, "%.200s: line %d: %s", reader->path, reader->line, what);
}

static bool end_of_line(const Reader* reader)
{
    char c = *reader->at;
    return c == '\n' || c == '\r' || c == '#' || c == 0;
}

static void skip_blanks(Reader* reader)
{
    while (*reader->at == ' ' || *reader->at == '\t')
        ++reader->at;
}

static bool push(Reader* reader, Table* table, Vec3 value)
{
    if (table->count == MAX_RAW) return refuse(reader, "too many vertices; decimate the mesh");
    if (table->count == table->capacity) {
        int capacity = table->capacity > 0 ? 2 * table->capacity : 4096;
        Vec3* grown = realloc(table->at, (size_t)capacity * sizeof *grown);
        if (grown == NULL) return refuse(reader, "no memory");
        table->at = grown;
        table->capacity = capacity;
    }
    table->at[table->count++] = value;
    return true;
}

static bool read_vector(Reader* reader, Vec3* value)
{
    float numbers[3];
    for (int i = 0; i < 3; ++i) {
        skip_blanks(reader);
        if (end_of_line(reader)) return refuse(reader, "three numbers are wanted");
        char* end;
        numbers[i] = strtof(reader->at, &end);
        if (end == reader->at || !isfinite(numbers[i]))
            return refuse(reader, "not a finite number");
        reader->at = end;
    }
    *value = vec3(numbers[0], numbers[1], numbers[2]);
    if (reader->negate_z) value->z = -value->z;
    return true;
}

static bool read_position(Reader* reader)
{
    Vec3 value;
    if (!read_vector(reader, &value)) return false;
    value = vec3_scale(value, reader->unit_m);
    if (!(vec3_length(value) < FARTHEST_M))
        return refuse(reader, "a vertex beyond 90 m of the origin; give the file's unit");
    return push(reader, &reader->positions, value);
}

static bool read_normal(Reader* reader)
{
    Vec3 value;
    if (!read_vector(reader, &value)) return false;
    return push(reader, &reader->normals, vec3_normalise_or(value, vec3(0, 1, 0)));
}

// Faces -----------------------------------------------------------------------------------------

// One index, 1-based or counted back from the end; false where there is none of it.
static bool read_index(Reader* reader, int count, int* index)
{
    char* end;
    // strtol alone would walk over the line's end to the next number.
    if (!isdigit((unsigned char)*reader->at) && *reader->at != '-')
        return refuse(reader, "an index is wanted: v, v/vt, v//vn or v/vt/vn");
    long value = strtol(reader->at, &end, 10);
    reader->at = end;
    if (value < 0) value += (long)count + 1;
    if (value < 1 || value > count) return refuse(reader, "an index outside what came before");
    *index = (int)value - 1;
    return true;
}

static void skip_texture(Reader* reader)
{
    while (isdigit((unsigned char)*reader->at) || *reader->at == '-')
        ++reader->at;
}

// v, v/vt, v//vn or v/vt/vn; normal -1 where there is none.
static bool read_corner(Reader* reader, int* position, int* normal)
{
    *normal = -1;
    if (!read_index(reader, reader->positions.count, position)) return false;
    if (*reader->at != '/') return true;
    ++reader->at;
    skip_texture(reader);
    if (*reader->at != '/') return true;
    ++reader->at;
    return read_index(reader, reader->normals.count, normal);
}

static bool add_vertex(Reader* reader, int position, int normal, uint32_t* vertex)
{
    HeadMesh* mesh = reader->mesh;
    if (mesh->vertex_count == HAIRSTYLE_MAX_VERTICES)
        return refuse(reader, "more than 65535 vertices; decimate the mesh");
    *vertex = (uint32_t)mesh->vertex_count++;
    mesh->positions[*vertex] = reader->positions.at[position];
    reader->has_normal[*vertex] = normal >= 0;
    mesh->normals[*vertex] = normal >= 0 ? reader->normals.at[normal] : vec3(0, 0, 0);
    return true;
}

static bool find_vertex(Reader* reader, int position, int normal, uint32_t* vertex)
{
    uint64_t key = ((uint64_t)position + 1) << 32 | (uint32_t)(normal + 1);
    uint64_t mixed = key * 0x9e3779b97f4a7c15u;
    uint32_t slot = (uint32_t)(mixed >> 32) & (PAIR_SLOTS - 1);
    while (reader->pairs[slot].key != 0 && reader->pairs[slot].key != key)
        slot = (slot + 1) & (PAIR_SLOTS - 1);
    Pair* pair = &reader->pairs[slot];
    if (pair->key == 0) {
        if (!add_vertex(reader, position, normal, &pair->vertex)) return false;
        pair->key = key;
    }
    *vertex = pair->vertex;
    return true;
}

static bool add_triangle(Reader* reader, uint32_t a, uint32_t b, uint32_t c)
{
    if (reader->triangle_count == HAIRSTYLE_MAX_INDICES / 3)
        return refuse(reader, "more than 131072 triangles; decimate the mesh");
    // A mirrored face seen from outside turns the other way.
    Triangle triangle = {{a, reader->negate_z ? c : b, reader->negate_z ? b : c}, reader->paint};
    reader->triangles[reader->triangle_count++] = triangle;
    reader->used[reader->paint] = true;
    return true;
}

static bool read_face(Reader* reader)
{
    uint32_t first = 0, before = 0;
    int corners = 0;
    for (skip_blanks(reader); !end_of_line(reader); skip_blanks(reader)) {
        int position, normal;
        uint32_t vertex;
        if (!read_corner(reader, &position, &normal)) return false;
        if (!find_vertex(reader, position, normal, &vertex)) return false;
        if (corners == 0) first = vertex;
        if (corners >= 2 && !add_triangle(reader, first, before, vertex)) return false;
        before = vertex;
        ++corners;
    }
    return corners >= 3 || refuse(reader, "a face of fewer than three corners");
}

// Lines -----------------------------------------------------------------------------------------

static uint8_t paint_of(const char* name, size_t length)
{
    for (int i = 0; i < PAINTS; ++i) {
        size_t wanted = strlen(paints[i].fragment);
        for (size_t at = 0; at + wanted <= length; ++at)
            if (strncasecmp(name + at, paints[i].fragment, wanted) == 0) return (uint8_t)i;
    }
    return PAINTS - 1;
}

static void read_name(Reader* reader, bool is_object)
{
    if (is_object) reader->has_objects = true;
    // Exporters write material subsets as groups inside an object: the object's name says more.
    if (!is_object && reader->has_objects) return;
    skip_blanks(reader);
    reader->paint = paint_of(reader->at, strcspn(reader->at, "\r\n"));
}

static bool is_word(const Reader* reader, const char* word)
{
    size_t length = strlen(word);
    char after =
        reader->at[0] != 0 && strncmp(reader->at, word, length) == 0 ? reader->at[length] : 'x';
    return after == ' ' || after == '\t';
}

static bool read_line(Reader* reader)
{
    skip_blanks(reader);
    if (is_word(reader, "v")) {
        reader->at += 1;
        return read_position(reader);
    }
    if (is_word(reader, "vn")) {
        reader->at += 2;
        return read_normal(reader);
    }
    if (is_word(reader, "f")) {
        reader->at += 1;
        return read_face(reader);
    }
    if (is_word(reader, "o") || is_word(reader, "g")) {
        bool is_object = *reader->at == 'o';
        reader->at += 1;
        read_name(reader, is_object);
    }
    return true; // vt, s, usemtl, comments: nothing of ours
}

static bool read_lines(Reader* reader)
{
    while (*reader->at != 0) {
        ++reader->line;
        if (!read_line(reader)) return false;
        reader->at += strcspn(reader->at, "\n");
        if (*reader->at == '\n') ++reader->at;
    }
    if (reader->triangle_count == 0)
        return fault_set(reader->fault, "%.200s: no faces: not a Wavefront .obj mesh",
                         reader->path);
    return true;
}

// Finishing -------------------------------------------------------------------------------------

// Area-weighted normals for corners that came without (the cross product's length is the weight).
static void make_normals(Reader* reader)
{
    HeadMesh* mesh = reader->mesh;
    for (int t = 0; t < reader->triangle_count; ++t) {
        const uint32_t* v = reader->triangles[t].vertex;
        Vec3 a = mesh->positions[v[0]];
        Vec3 face =
            vec3_cross(vec3_sub(mesh->positions[v[1]], a), vec3_sub(mesh->positions[v[2]], a));
        for (int i = 0; i < 3; ++i)
            if (!reader->has_normal[v[i]])
                mesh->normals[v[i]] = vec3_add(mesh->normals[v[i]], face);
    }
    for (int v = 0; v < mesh->vertex_count; ++v) {
        // Faces are millimetres: scaled up, so that the least length is not taken for none.
        Vec3 normal = vec3_scale(mesh->normals[v], 1e6f);
        mesh->normals[v] = vec3_normalise_or(normal, vec3(0, 1, 0));
    }
}

// Triangles of one colour become one part, in the order of the table.
static void write_parts(Reader* reader)
{
    HeadMesh* mesh = reader->mesh;
    for (int paint = 0; paint < PAINTS; ++paint) {
        if (!reader->used[paint]) continue;
        HeadPart* part = &mesh->parts[mesh->part_count++];
        *part = (HeadPart){.first_index = (uint32_t)mesh->index_count,
                           .albedo = paints[paint].albedo,
                           .is_skin = paints[paint].is_skin};
        for (int t = 0; t < reader->triangle_count; ++t) {
            if (reader->triangles[t].paint != paint) continue;
            memcpy(mesh->indices + mesh->index_count, reader->triangles[t].vertex,
                   sizeof reader->triangles[t].vertex);
            mesh->index_count += 3;
        }
        part->index_count = (uint32_t)mesh->index_count - part->first_index;
    }
    if (mesh->part_count == 1) mesh->parts[0].is_skin = true;
}

static bool allocate(Reader* reader)
{
    HeadMesh* mesh = reader->mesh;
    mesh->positions = malloc(HAIRSTYLE_MAX_VERTICES * sizeof *mesh->positions);
    mesh->normals = malloc(HAIRSTYLE_MAX_VERTICES * sizeof *mesh->normals);
    mesh->indices = malloc(HAIRSTYLE_MAX_INDICES * sizeof *mesh->indices);
    reader->has_normal = malloc(HAIRSTYLE_MAX_VERTICES * sizeof *reader->has_normal);
    reader->triangles = malloc(HAIRSTYLE_MAX_INDICES / 3 * sizeof *reader->triangles);
    reader->pairs = calloc(PAIR_SLOTS, sizeof *reader->pairs);
    return mesh->positions != NULL && mesh->normals != NULL && mesh->indices != NULL &&
           reader->has_normal != NULL && reader->triangles != NULL && reader->pairs != NULL;
}

static void release(Reader* reader)
{
    free(reader->positions.at);
    free(reader->normals.at);
    free(reader->pairs);
    free(reader->has_normal);
    free(reader->triangles);
}

bool import_obj(HeadMesh* mesh, const char* path, float unit_m, bool negate_z, Fault* fault)
{
    *mesh = (HeadMesh){0};
    size_t size = 0;
    char* text = (char*)import_read_file(path, IMPORT_MAX_OBJ_BYTES, &size, fault);
    if (text == NULL) return false;
    Reader reader = {.at = text,
                     .path = path,
                     .unit_m = unit_m,
                     .negate_z = negate_z,
                     .mesh = mesh,
                     .paint = PAINTS - 1,
                     .fault = fault};
    bool sound = allocate(&reader) || fault_set(fault, "%.200s: no memory", path);
    sound = sound && read_lines(&reader);
    if (sound) {
        make_normals(&reader);
        write_parts(&reader);
    }
    release(&reader);
    free(text);
    if (!sound) head_mesh_free(mesh);
    return sound;
}
