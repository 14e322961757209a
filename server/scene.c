#include "server/scene.h"

#include "server/models.h"
#include "server/motion.h"

#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define MAX_FILE_BYTES (1 << 20)
#define FARTHEST_M     1e8 // messages take heads within 1e9 m; the rest is for motion

// A value's place in the document, so that a fault can name its line: Jansson forgets lines once
// the syntax is right.
typedef struct Place {
    const struct Place* parent;
    const char* key; // in an object
    size_t index;    // in an array
} Place;

typedef struct Reader {
    const char* path;
    const char* text;
    Fault* fault;
} Reader;

// The text is known to be sound JSON, so the scanner below need not check it.

static const char* skip_space(const char* c)
{
    return c + strspn(c, " \t\r\n");
}

static const char* skip_string(const char* c)
{
    for (++c; *c != '"'; ++c)
        if (*c == '\\') ++c;
    return c + 1;
}

static const char* skip_value(const char* c)
{
    int depth = 0;
    do {
        c = skip_space(c);
        if (*c == '"') {
            c = skip_string(c);
        } else if (*c == '{' || *c == '[') {
            ++depth;
            ++c;
        } else if (*c == '}' || *c == ']') {
            --depth;
            ++c;
        } else if (*c == ',' || *c == ':') {
            ++c;
        } else {
            c += strcspn(c, " \t\r\n,:]}");
        }
    } while (depth > 0);
    return c;
}

static bool is_key(const char* quoted, const char* key)
{
    size_t length = strlen(key);
    return strncmp(quoted + 1, key, length) == 0 && quoted[1 + length] == '"';
}

static const char* find_member(const char* c, const char* key)
{
    if (*c != '{') return c; // a key above was written with escapes: near enough
    for (c = skip_space(c + 1); *c == '"'; c = skip_space(c)) {
        const char* value = skip_space(skip_space(skip_string(c)) + 1);
        if (is_key(c, key)) return c;
        c = skip_space(skip_value(value));
        if (*c == ',') ++c;
    }
    return c;
}

static const char* find_element(const char* c, size_t index)
{
    if (*c != '[') return c;
    c = skip_space(c + 1);
    for (; index > 0 && *c != ']'; --index)
        c = skip_space(skip_space(skip_value(c)) + 1);
    return c;
}

// Where `place` begins; a member's place is its key.
static const char* find(const char* text, const Place* place)
{
    if (place == NULL) return skip_space(text);
    const char* parent = find(text, place->parent);
    if (*parent == '"') parent = skip_space(skip_space(skip_string(parent)) + 1);
    return place->key != NULL ? find_member(parent, place->key)
                              : find_element(parent, place->index);
}

static bool fault_at(const Reader* reader, const Place* place, const char* what)
{
    int line = 1, column = 1;
    const char* end = find(reader->text, place);
    for (const char* c = reader->text; c < end; ++c) {
        column = *c == '\n' ? 1 : column + 1;
        line += *c == '\n';
    }
    return fault_set(reader->fault, "%s:%d:%d: %s", reader->path, line, column, what);
}

// "NAME" WHAT, where NAME is the key, or of an element of a list its number in the list's key.
static bool fault_named(const Reader* reader, const Place* place, const char* what)
{
    char text[200];
    if (place == NULL)
        snprintf(text, sizeof text, "the scene %s", what);
    else if (place->key != NULL)
        snprintf(text, sizeof text, "\"%.60s\" %s", place->key, what);
    else
        snprintf(text, sizeof text, "\"%.60s\"[%zu] %s",
                 place->parent != NULL && place->parent->key != NULL ? place->parent->key : "",
                 place->index, what);
    return fault_at(reader, place, text);
}

// One member that an object may have.
typedef struct Member Member;
struct Member {
    const char* key;
    bool (*read)(const Reader* reader, const Place* place, const json_t* value,
                 const Member* member, void* to);
    size_t offset;
    double low, high;
    bool required;
};

static bool read_object(const Reader* reader, const Place* place, const json_t* object,
                        const Member* members, void* to)
{
    if (!json_is_object(object)) return fault_named(reader, place, "must be an object { ... }");
    char text[200];
    const char* key;
    json_t* value;
    json_object_foreach((json_t*)object, key, value)
    {
        const Member* member = members;
        while (member->key != NULL && strcmp(member->key, key) != 0)
            ++member;
        Place here = {place, key, 0};
        if (member->key == NULL) {
            snprintf(text, sizeof text,
                     "unknown key \"%.60s\"; see the scene schema in "
                     "server/README.md",
                     key);
            return fault_at(reader, &here, text);
        }
        if (!member->read(reader, &here, value, member, to)) return false;
    }
    for (const Member* member = members; member->key != NULL; ++member)
        if (member->required && json_object_get(object, member->key) == NULL) {
            snprintf(text, sizeof text, "\"%s\" is missing here", member->key);
            return fault_at(reader, place, text);
        }
    return true;
}

static bool check_number(const Reader* reader, const Place* place, const json_t* value,
                         const Member* member, bool whole)
{
    bool kind = whole ? json_is_integer(value) : json_is_number(value);
    double number = json_number_value(value);
    if (kind && number >= member->low && number <= member->high) return true;
    char text[200],
        *shown = json_dumps(value, JSON_ENCODE_ANY | JSON_COMPACT | JSON_REAL_PRECISION(9));
    snprintf(text, sizeof text, "\"%s\" is %.40s; it must be %s from %g to %g", member->key,
             shown != NULL ? shown : "wrong", whole ? "a whole number" : "a number", member->low,
             member->high);
    free(shown);
    return fault_at(reader, place, text);
}

#define FIELD(type) (*(type*)((char*)to + member->offset))
#define READER(name)                                                                               \
    static bool name(const Reader* reader, const Place* place, const json_t* value,                \
                     const Member* member, void* to)

READER(read_double)
{
    if (!check_number(reader, place, value, member, false)) return false;
    FIELD(double) = json_number_value(value);
    return true;
}

READER(read_float)
{
    if (!check_number(reader, place, value, member, false)) return false;
    FIELD(float) = (float)json_number_value(value);
    return true;
}

READER(read_int)
{
    if (!check_number(reader, place, value, member, true)) return false;
    FIELD(int) = (int)json_integer_value(value);
    return true;
}

static bool read_choice(const Reader* reader, const Place* place, const json_t* value,
                        const Member* member, const char* const* names, int* to)
{
    const char* name = json_string_value(value);
    char text[160];
    int length = snprintf(text, sizeof text, "\"%s\" must be one of", member->key);
    for (int i = 0; names[i] != NULL; ++i) {
        if (name != NULL && strcmp(name, names[i]) == 0) {
            *to = i;
            return true;
        }
        if (length < (int)sizeof text)
            length += snprintf(text + length, sizeof text - (size_t)length, " %s", names[i]);
    }
    return fault_at(reader, place, text);
}

READER(read_collide)
{
    return read_choice(reader, place, value, member, collide_names, &FIELD(int));
}

READER(read_length)
{
    return read_choice(reader, place, value, member, length_names, &FIELD(int));
}

READER(read_position)
{
    if (!json_is_array(value) || json_array_size(value) != 3)
        return fault_at(reader, place, "\"position\" must be three numbers [x, y, z] in metres");
    double* at = &FIELD(Vec3d).x;
    for (size_t i = 0; i < 3; ++i)
        if (!check_number(reader, &(Place){place, NULL, i}, json_array_get(value, i), member,
                          false))
            return false;
        else
            at[i] = json_number_value(json_array_get(value, i));
    return true;
}

READER(read_motion)
{
    const Motion* motion = json_is_string(value) ? motion_find(json_string_value(value)) : NULL;
    if (motion == NULL)
        return fault_at(reader, place, "\"motion\" must be one of --help's motions");
    FIELD(const char*) = motion->name; // the table's string outlives the document
    return true;
}

READER(read_name)
{
    const char* name = json_string_value(value);
    if (name == NULL || !hairstyle_is_name(name))
        return fault_at(reader, place, "\"name\" must be 1 to 31 letters, digits, signs of ASCII");
    strcpy(((SceneStyle*)to)->name, name);
    (void)member;
    return true;
}

static const char* keep_string(Scene* scene, char* text)
{
    char** grown = realloc(scene->strings, ((size_t)scene->string_count + 1) * sizeof *grown);
    if (grown == NULL || text == NULL) {
        free(text);
        if (grown != NULL) scene->strings = grown;
        return NULL;
    }
    scene->strings = grown;
    return grown[scene->string_count++] = text;
}

// Paths in a scene start at the scene's own folder.
static const char* keep_path(Scene* scene, const char* scene_path, const char* path)
{
    const char* slash = strrchr(scene_path, '/');
    int folder = *path == '/' || slash == NULL ? 0 : (int)(slash - scene_path) + 1;
    char* text = NULL;
    if (asprintf(&text, "%.*s%s", folder, scene_path, path) < 0) return NULL;
    return keep_string(scene, text);
}

static bool add_source(const Reader* reader, const Place* place, const json_t* value, Scene* scene,
                       SceneStyle* style, bool is_path)
{
    const char* text = json_string_value(value);
    if (text == NULL) return fault_named(reader, place, "must be a text");
    if (style->load.style_count == LOAD_MAX_FILES)
        return fault_at(reader, place, "too many files for one style (16 at most)");
    const char* kept =
        is_path ? keep_path(scene, reader->path, text) : keep_string(scene, strdup(text));
    if (kept == NULL) return fault_set(reader->fault, "%s: no memory", reader->path);
    style->load.styles[style->load.style_count++] = kept;
    return true;
}

// Members of a style and of a character need the scene; it travels at the end of what they write
// to.
typedef struct StyleTarget {
    SceneStyle style;
    Scene* scene;
} StyleTarget;

typedef struct CharacterTarget {
    SceneCharacter character;
    const Scene* scene;
} CharacterTarget;

READER(read_files)
{
    StyleTarget* target = to;
    if (!json_is_array(value) || json_array_size(value) == 0)
        return fault_at(reader, place, "\"files\" must be a list of file names");
    for (size_t i = 0; i < json_array_size(value); ++i)
        if (!add_source(reader, &(Place){place, NULL, i}, json_array_get(value, i), target->scene,
                        &target->style, true))
            return false;
    (void)member;
    return true;
}

READER(read_builtin)
{
    StyleTarget* target = to;
    (void)member;
    return add_source(reader, place, value, target->scene, &target->style, false);
}

READER(read_head)
{
    StyleTarget* target = to;
    (void)member;
    if (!json_is_string(value)) return fault_at(reader, place, "\"head\" must be a file name");
    target->style.load.head = keep_path(target->scene, reader->path, json_string_value(value));
    return target->style.load.head != NULL ||
           fault_set(reader->fault, "%s: no memory", reader->path);
}

READER(read_style_of)
{
    CharacterTarget* target = to;
    const char* name = json_string_value(value);
    for (int i = 0; name != NULL && i < target->scene->style_count; ++i)
        if (strcmp(target->scene->styles[i].name, name) == 0) {
            target->character.style = i;
            return true;
        }
    (void)member;
    return fault_at(reader, place, "\"style\" must name one of \"styles\" (which come first)");
}

#define STYLE_AT(field)     offsetof(StyleTarget, style.load.field)
#define CHARACTER_AT(field) offsetof(CharacterTarget, character.field)

static const Member style_members[] = {
    {"name", read_name, 0, 0, 0, true},
    {"files", read_files, 0, 0, 0, false},
    {"builtin", read_builtin, 0, 0, 0, false},
    {"head", read_head, 0, 0, 0, false},
    {"unit_m", read_double, STYLE_AT(unit_m), 1e-6, 1000, false},
    {"guides", read_int, STYLE_AT(guides), 1, HAIRSTYLE_MAX_GUIDES, false},
    {"nodes", read_int, STYLE_AT(nodes), HAIRSTYLE_MIN_NODES, HAIRSTYLE_MAX_NODES, false},
    {0},
};

static const Member character_members[] = {
    {"slot", read_int, CHARACTER_AT(slot), 0, CHANNEL_MAX_SLOTS - 1, true},
    {"style", read_style_of, 0, 0, 0, false},
    {"motion", read_motion, CHARACTER_AT(motion), 0, 0, false},
    {"position", read_position, CHARACTER_AT(position), -FARTHEST_M, FARTHEST_M, false},
    {0},
};

static const Member simulation_members[] = {
    {"stiffness_s2", read_float, offsetof(SimDefinition, stiffness_s2), 0, 1e6, false},
    {"damping_per_s", read_float, offsetof(SimDefinition, damping_per_s), 0, 1e4, false},
    {"drag_per_s", read_float, offsetof(SimDefinition, drag_per_s), 0, 1e4, false},
    {"joint_damping_per_s", read_float, offsetof(SimDefinition, joint_damping_per_s), 0, 1e6,
     false},
    {"upside_down_share", read_float, offsetof(SimDefinition, upside_down_share), 0, 1, false},
    {"down_share", read_float, offsetof(SimDefinition, down_share), 0, 1, false},
    {"gravity_m_s2", read_float, offsetof(SimDefinition, gravity_m_s2), -1000, 1000, false},
    {"pearl_radius_m", read_float, offsetof(SimDefinition, pearl_radius_m), 0, 1, false},
    {"collide", read_collide, offsetof(SimDefinition, collide), 0, 0, false},
    {"length", read_length, offsetof(SimDefinition, length), 0, 0, false},
    {"fall_off_per_m", read_float, offsetof(SimDefinition, fall_off_per_m), 0, 1e6, false},
    {"fall_off_power", read_int, offsetof(SimDefinition, fall_off_power), 0, 3, false},
    {0},
};

static bool read_style(const Reader* reader, const Place* place, const json_t* value, Scene* scene)
{
    if (scene->style_count == SCENE_MAX_STYLES)
        return fault_at(reader, place, "more than 16 styles");
    StyleTarget target = {.scene = scene};
    if (!read_object(reader, place, value, style_members, &target)) return false;
    if ((json_object_get(value, "files") == NULL) == (json_object_get(value, "builtin") == NULL))
        return fault_at(reader, place, "a style needs either \"files\" or \"builtin\"");
    for (int i = 0; i < scene->style_count; ++i)
        if (strcmp(scene->styles[i].name, target.style.name) == 0)
            return fault_at(reader, place, "a style of this name is already there");
    scene->styles[scene->style_count++] = target.style;
    return true;
}

static bool read_character(const Reader* reader, const Place* place, const json_t* value,
                           Scene* scene)
{
    CharacterTarget target = {.scene = scene};
    if (!read_object(reader, place, value, character_members, &target)) return false;
    for (int i = 0; i < scene->character_count; ++i)
        if (scene->characters[i].slot == target.character.slot)
            return fault_at(reader, place, "this slot is already taken");
    scene->characters[scene->character_count++] = target.character;
    return true;
}

static bool read_list(const Reader* reader, const json_t* root, const char* key, Scene* scene,
                      bool (*read)(const Reader*, const Place*, const json_t*, Scene*))
{
    const json_t* list = json_object_get(root, key);
    Place here = {NULL, key, 0};
    if (list != NULL && !json_is_array(list))
        return fault_named(reader, &here, "must be a list [ ... ]");
    for (size_t i = 0; i < json_array_size(list); ++i)
        if (!read(reader, &(Place){&here, NULL, i}, json_array_get(list, i), scene)) return false;
    return true;
}

READER(read_simulation)
{
    (void)member;
    return read_object(reader, place, value, simulation_members, to);
}

READER(read_later)
{
    (void)reader, (void)place, (void)value, (void)member, (void)to;
    return true;
}

static const Member scene_members[] = {
    {"rate_hz", read_double, offsetof(SimDefinition, rate_hz), 1, 1000, false},
    {"substeps", read_int, offsetof(SimDefinition, substeps), 1, 64, false},
    {"iterations", read_int, offsetof(SimDefinition, iterations), 0, 64, false},
    {"simulation", read_simulation, 0, 0, 0, false},
    {"styles", read_later, 0, 0, 0, false},
    {"characters", read_later, 0, 0, 0, false},
    {0},
};

static bool read_scene(const Reader* reader, const json_t* root, SimDefinition* sim, Scene* scene)
{
    return read_object(reader, NULL, root, scene_members, sim) &&
           read_list(reader, root, "styles", scene, read_style) &&
           read_list(reader, root, "characters", scene, read_character);
}

// Without waiting for a pipe, and without reading a folder as an empty text.
static FILE* open_file(const char* path, Fault* fault)
{
    struct stat status;
    int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0) {
        fault_set(fault, "%s: cannot open this scene file: %s", path, strerror(errno));
        return NULL;
    }
    bool is_file = fstat(file, &status) == 0 && S_ISREG(status.st_mode);
    FILE* stream = is_file ? fdopen(file, "rb") : NULL;
    if (stream != NULL) return stream;
    close(file);
    fault_set(fault, "%s: %s", path, is_file ? "no memory" : "not a file; a scene must be one");
    return NULL;
}

static char* read_file(const char* path, Fault* fault)
{
    FILE* file = open_file(path, fault);
    if (file == NULL) return NULL;
    char* text = malloc(MAX_FILE_BYTES + 1);
    size_t size = text != NULL ? fread(text, 1, MAX_FILE_BYTES + 1, file) : 0;
    int error = ferror(file) ? errno : 0;
    fclose(file);
    if (error == 0 && text != NULL && size <= MAX_FILE_BYTES && memchr(text, '\0', size) == NULL) {
        text[size] = '\0';
        return text;
    }
    if (error != 0)
        fault_set(fault, "%s: cannot read this scene file: %s", path, strerror(error));
    else
        fault_set(fault, "%s: not a scene: larger than 1 MiB or not text", path);
    free(text);
    return NULL;
}

Scene* scene_load(const char* path, SimDefinition* sim, Fault* fault)
{
    char* text = read_file(path, fault);
    if (text == NULL) return NULL;
    json_error_t error;
    json_t* root = json_loads(text, JSON_REJECT_DUPLICATES, &error);
    Scene* scene = calloc(1, sizeof *scene);
    bool sound = root != NULL && scene != NULL;
    if (root == NULL) fault_set(fault, "%s:%d:%d: %s", path, error.line, error.column, error.text);
    Reader reader = {path, text, fault};
    sound = sound && read_scene(&reader, root, sim, scene);
    json_decref(root);
    free(text);
    if (sound) return scene;
    scene_destroy(scene);
    return NULL;
}

void scene_destroy(Scene* scene)
{
    if (scene == NULL) return;
    for (int i = 0; i < scene->string_count; ++i)
        free(scene->strings[i]);
    free(scene->strings);
    free(scene);
}
