#include "server/load.h"

#include "messages/style.h"
#include "server/bind.h"
#include "server/crest.h"
#include "server/fit.h"
#include "server/groom.h"
#include "server/import.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PATH_BYTES      512
#define BOTH_ENDS_BYTES 512

const char* const load_builtin_styles[] = {"long",  "bob",   "ponytail", "curly",
                                           "short", "crest", NULL};

static Hairstyle* (*const growers[])(Fault*) = {groom_long,  groom_bob,   groom_ponytail,
                                                groom_curly, groom_short, crest_style};

// What options and style file come to: every path as it is opened, every default still zero.
typedef struct Recipe {
    char name[HAIRSTYLE_NAME_BYTES];
    char files[LOAD_MAX_FILES][PATH_BYTES];
    int file_count;
    char head[PATH_BYTES];
    double unit_m;
    bool keep_axes;
    int guides, nodes;
    char both_ends[BOTH_ENDS_BYTES];
    HairMaterial material;
    bool has_skin_colour;
} Recipe;

// The files of a recipe, read; sections as they are bound.
typedef struct Groom {
    Recipe recipe;
    ImportedStrands files[LOAD_MAX_FILES];
    char names[LOAD_MAX_FILES][HAIRSTYLE_NAME_BYTES]; // of sections
    Vec3* points[LOAD_MAX_FILES];                     // head space, without degenerate strands
    int strands[LOAD_MAX_FILES];                      // of these
    bool pinned[LOAD_MAX_FILES];
    double unit_m[LOAD_MAX_FILES];
    bool negate_z[LOAD_MAX_FILES];
    float covered; // of the head's inside, by colliders
} Groom;

static bool ends_with(const char* text, const char* end)
{
    size_t length = strlen(text), wanted = strlen(end);
    return length >= wanted && strcasecmp(text + length - wanted, end) == 0;
}

static int builtin_index(const char* name)
{
    for (int i = 0; load_builtin_styles[i] != NULL; ++i)
        if (strcmp(load_builtin_styles[i], name) == 0) return i;
    return -1;
}

static bool copy_text(char* to, size_t capacity, const char* from, const char* what, Fault* fault)
{
    if (strlen(from) >= capacity)
        return fault_set(fault, "%s: %.60s...: longer than %zu bytes", what, from, capacity - 1);
    memcpy(to, from, strlen(from) + 1);
    return true;
}

// Style JSON ------------------------------------------------------------------------------------

typedef struct Json {
    const char* path;
    const char* text; // of the file: Jansson forgets where values stood
    Recipe* recipe;
    Fault* fault;
} Json;

static bool wrong(const Json* json, const char* key, const char* wanted)
{
    // The first place that has the key in quotes: style files hold no key twice but colours' names,
    // and those are not looked for.
    char quoted[72];
    snprintf(quoted, sizeof quoted, "\"%.60s\"", key);
    const char* at = strstr(json->text, quoted);
    int line = 1, column = 1;
    for (const char* c = json->text; at != NULL && c < at; ++c) {
        column = *c == '\n' ? 1 : column + 1;
        line += *c == '\n';
    }
    return fault_set(json->fault, "%.200s: line %d, column %d: %s: %s", json->path, line, column,
                     quoted, wanted);
}

// Paths in a style file are relative to the file, so that a folder can be moved as one.
static bool resolve(const Json* json, char to[PATH_BYTES], const char* key, const json_t* value)
{
    if (!json_is_string(value)) return wrong(json, key, "must be a path in quotes");
    const char* path = json_string_value(value);
    const char* slash = path[0] == '/' ? NULL : strrchr(json->path, '/');
    int folder = slash != NULL ? (int)(slash - json->path + 1) : 0;
    int length = snprintf(to, PATH_BYTES, "%.*s%s", folder, json->path, path);
    return (length > 0 && length < PATH_BYTES) || wrong(json, key, "the path is too long");
}

static bool read_files(const Json* json, const char* key, const json_t* value)
{
    if (!json_is_array(value) || json_array_size(value) < 1 ||
        json_array_size(value) > LOAD_MAX_FILES)
        return wrong(json, key, "must be a list of 1 to 16 .tfx files");
    for (size_t i = 0; i < json_array_size(value); ++i)
        if (!resolve(json, json->recipe->files[i], key, json_array_get(value, i))) return false;
    json->recipe->file_count = (int)json_array_size(value);
    return true;
}

static bool read_name(const Json* json, const char* key, const json_t* value)
{
    const char* name = json_string_value(value);
    if (name == NULL || !hairstyle_is_name(name))
        return wrong(json, key, "must be 1 to 31 letters, digits, signs of ASCII");
    strcpy(json->recipe->name, name);
    return true;
}

static bool read_head(const Json* json, const char* key, const json_t* value)
{
    return resolve(json, json->recipe->head, key, value);
}

static bool read_unit(const Json* json, const char* key, const json_t* value)
{
    json->recipe->unit_m = json_number_value(value);
    return (json_is_number(value) && json->recipe->unit_m > 0.0) ||
           wrong(json, key, "must be a positive number of metres per file unit");
}

static bool read_keep_axes(const Json* json, const char* key, const json_t* value)
{
    json->recipe->keep_axes = json_is_true(value);
    return json_is_boolean(value) || wrong(json, key, "must be true or false");
}

static bool read_count(const Json* json, const char* key, const json_t* value, int most, int* count)
{
    json_int_t number = json_integer_value(value);
    if (!json_is_integer(value) || number < 1 || number > most)
        return wrong(json, key, "must be a whole number from 1 to its cap (1024 guides, 32 nodes)");
    *count = (int)number;
    return true;
}

static bool read_guides(const Json* json, const char* key, const json_t* value)
{
    return read_count(json, key, value, HAIRSTYLE_MAX_GUIDES, &json->recipe->guides);
}

static bool read_nodes(const Json* json, const char* key, const json_t* value)
{
    return read_count(json, key, value, HAIRSTYLE_MAX_NODES, &json->recipe->nodes);
}

static bool read_both_ends(const Json* json, const char* key, const json_t* value)
{
    if (!json_is_string(value))
        return wrong(json, key, "must be \"auto\", \"none\" or a comma list of section names");
    return copy_text(json->recipe->both_ends, BOTH_ENDS_BYTES, json_string_value(value), key,
                     json->fault);
}

static bool read_colour(const Json* json, const char* key, const json_t* value, Vec3* colour)
{
    float c[3];
    bool sound = json_is_array(value) && json_array_size(value) == 3;
    for (size_t i = 0; sound && i < 3; ++i) {
        double number = json_number_value(json_array_get(value, i));
        sound = json_is_number(json_array_get(value, i)) && number >= 0.0 && number <= 1.0;
        c[i] = (float)number;
    }
    if (!sound) return wrong(json, key, "must be three linear reflectances from 0 to 1");
    *colour = vec3(c[0], c[1], c[2]);
    return true;
}

static bool read_material(const Json* json, const char* key, const json_t* value)
{
    if (!json_is_object(value)) return wrong(json, key, "must be an object of colours");
    HairMaterial* material = &json->recipe->material;
    const char* name;
    json_t* colour;
    json_object_foreach((json_t*)value, name, colour)
    {
        Vec3* to = strcmp(name, "root_colour") == 0   ? &material->root_colour
                   : strcmp(name, "tip_colour") == 0  ? &material->tip_colour
                   : strcmp(name, "skin_colour") == 0 ? &material->skin_colour
                                                      : NULL;
        if (to == NULL)
            return wrong(json, name, "unknown in material; root_colour, tip_colour, skin_colour");
        if (!read_colour(json, name, colour, to)) return false;
        if (to == &material->skin_colour) json->recipe->has_skin_colour = true;
    }
    return true;
}

typedef struct Key {
    const char* name;
    bool (*read)(const Json* json, const char* key, const json_t* value);
} Key;

static const Key keys[] = {
    {"name", read_name},   {"files", read_files},         {"head", read_head},
    {"unit_m", read_unit}, {"keep_axes", read_keep_axes}, {"guides", read_guides},
    {"nodes", read_nodes}, {"both_ends", read_both_ends}, {"material", read_material},
};

static bool read_key(const Json* json, const char* name, const json_t* value)
{
    for (size_t i = 0; i < sizeof keys / sizeof *keys; ++i)
        if (strcmp(keys[i].name, name) == 0) return keys[i].read(json, name, value);
    return wrong(json, name,
                 "unknown key; a style has name files head unit_m keep_axes guides nodes "
                 "both_ends material");
}

static bool read_style_object(const Json* json, json_t* root)
{
    if (!json_is_object(root))
        return fault_set(json->fault, "%.200s: a style file holds one object", json->path);
    const char* name;
    json_t* value;
    json_object_foreach(root, name, value)
    {
        if (!read_key(json, name, value)) return false;
    }
    if (json->recipe->file_count == 0) return wrong(json, "files", "missing; list the .tfx files");
    return true;
}

static bool read_style_file(Recipe* recipe, const char* path, Fault* fault)
{
    size_t size = 0;
    char* text = (char*)import_read_file(path, (size_t)1 << 20, &size, fault);
    if (text == NULL) return false;
    import_stem(recipe->name, path);
    json_error_t error;
    json_t* root = json_loadb(text, size, JSON_REJECT_DUPLICATES, &error);
    if (root == NULL)
        fault_set(fault, "%.200s: line %d, column %d: %.120s", path, error.line, error.column,
                  error.text);
    Json json = {path, text, recipe, fault};
    bool sound = root != NULL && read_style_object(&json, root);
    json_decref(root);
    free(text);
    return sound;
}

// From options to a recipe ----------------------------------------------------------------------

static bool refuse_style(const char* name, Fault* fault)
{
    char names[80] = "";
    for (int i = 0; load_builtin_styles[i] != NULL; ++i) {
        size_t used = strlen(names);
        snprintf(names + used, sizeof names - used, "%s%s", i > 0 ? ", " : "",
                 load_builtin_styles[i]);
    }
    return fault_set(fault,
                     "style %.200s: unknown; give a built-in one (%s), one .json style file, or up "
                     "to %d .tfx files",
                     name, names, LOAD_MAX_FILES);
}

static bool take_files(Recipe* recipe, const LoadOptions* options, Fault* fault)
{
    for (int i = 0; i < options->style_count; ++i) {
        if (!ends_with(options->styles[i], ".tfx")) {
            if (ends_with(options->styles[i], ".json"))
                return fault_set(fault,
                                 "style %.200s: a .json style stands alone: give it once, without "
                                 "others",
                                 options->styles[i]);
            if (options->style_count == 1 || builtin_index(options->styles[i]) < 0)
                return refuse_style(options->styles[i], fault);
            return fault_set(fault, "style %.60s: a built-in style stands alone, without files",
                             options->styles[i]);
        }
        if (!copy_text(recipe->files[i], PATH_BYTES, options->styles[i], "style", fault))
            return false;
    }
    recipe->file_count = options->style_count;
    return true;
}

// Options given by hand win over the style file.
static bool take_overrides(Recipe* recipe, const LoadOptions* options, Fault* fault)
{
    if (options->unit_m != 0.0) recipe->unit_m = options->unit_m;
    if (options->keep_axes) recipe->keep_axes = true;
    if (options->guides != 0) recipe->guides = options->guides;
    if (options->nodes != 0) recipe->nodes = options->nodes;
    if (options->both_ends != NULL &&
        !copy_text(recipe->both_ends, BOTH_ENDS_BYTES, options->both_ends, "both_ends", fault))
        return false;
    if (options->head != NULL && !copy_text(recipe->head, PATH_BYTES, options->head, "head", fault))
        return false;
    if (!(recipe->unit_m >= 0.0 && recipe->unit_m <= 1000.0))
        return fault_set(fault, "unit: %g metres per file unit; give a number above 0",
                         recipe->unit_m);
    return true;
}

static bool make_recipe(Recipe* recipe, const LoadOptions* options, Fault* fault)
{
    *recipe = (Recipe){.material = {.root_colour = {0.028f, 0.015f, 0.009f},
                                    .tip_colour = {0.042f, 0.023f, 0.014f},
                                    .skin_colour = {0.50f, 0.41f, 0.385f}}};
    if (options->style_count < 1 || options->style_count > LOAD_MAX_FILES)
        return fault_set(fault, "%d styles: give 1 to %d", options->style_count, LOAD_MAX_FILES);
    for (int i = 0; i < options->style_count; ++i)
        if (options->styles[i] == NULL) return fault_set(fault, "style %d: no name", i);
    bool is_file = options->style_count == 1 && ends_with(options->styles[0], ".json");
    bool sound = is_file ? read_style_file(recipe, options->styles[0], fault)
                         : take_files(recipe, options, fault);
    return sound && take_overrides(recipe, options, fault);
}

// Sections --------------------------------------------------------------------------------------

// Files of one groom share a prefix (ponytail_back, ponytail_side); sections go by what differs.
static size_t common_prefix(const Groom* groom)
{
    if (groom->recipe.file_count < 2) return 0;
    const char* first = groom->files[0].name;
    size_t common = strlen(first);
    for (int i = 1; i < groom->recipe.file_count; ++i) {
        size_t same = 0;
        while (same < common && first[same] == groom->files[i].name[same])
            ++same;
        common = same;
    }
    while (common > 0 && first[common - 1] != '_' && first[common - 1] != '-')
        --common;
    for (int i = 0; i < groom->recipe.file_count; ++i)
        if (groom->files[i].name[common] == 0) return 0;
    return common;
}

static void name_sections(Groom* groom)
{
    size_t prefix = common_prefix(groom);
    for (int i = 0; i < groom->recipe.file_count; ++i)
        memmove(groom->names[i], groom->files[i].name + prefix,
                strlen(groom->files[i].name + prefix) + 1);
    if (groom->recipe.name[0] != 0) return;
    memcpy(groom->recipe.name, groom->files[0].name, HAIRSTYLE_NAME_BYTES);
    if (prefix > 1) groom->recipe.name[prefix - 1] = 0;
}

static Vec3 to_head_space(const float* p, double unit_m, bool negate_z)
{
    Vec3d v = {(double)p[0], (double)p[1], negate_z ? -(double)p[2] : (double)p[2]};
    return vec3_from(vec3d_scale(v, unit_m));
}

static bool make_section(Groom* groom, int i, const Notice* notice, Fault* fault)
{
    const ImportedStrands* file = &groom->files[i];
    size_t points = (size_t)file->points;
    groom->points[i] = malloc((size_t)file->strands * points * sizeof(Vec3));
    if (groom->points[i] == NULL) return fault_set(fault, "no memory for %s", file->name);
    for (int s = 0; s < file->strands; ++s) {
        if (import_is_degenerate(file, import_strand_length(file, s))) continue;
        for (size_t p = 0; p < points; ++p)
            groom->points[i][(size_t)groom->strands[i] * points + p] =
                to_head_space(file->positions + ((size_t)s * points + p) * 3, groom->unit_m[i],
                              groom->negate_z[i]);
        ++groom->strands[i];
    }
    if (groom->strands[i] == 0)
        return fault_set(fault, "%.200s: every strand has no length; mend the groom",
                         groom->recipe.files[i]);
    if (file->degenerate > 0)
        notice_say(notice, "%s: %d of %d strands dropped: shorter than 1e-4 of the mean length",
                   file->name, file->degenerate, file->strands);
    return true;
}

static double spread(const Vec3* points, int strands, int stride)
{
    Vec3d mean = {0, 0, 0};
    for (int s = 0; s < strands; ++s)
        mean = vec3d_add(mean, vec3d_from(points[(size_t)s * (size_t)stride]));
    mean = vec3d_scale(mean, 1.0 / strands);
    double sum = 0.0;
    for (int s = 0; s < strands; ++s) {
        Vec3d d = vec3d_sub(vec3d_from(points[(size_t)s * (size_t)stride]), mean);
        sum += vec3d_dot(d, d);
    }
    return sqrt(sum / strands);
}

static bool tips_converge(const Groom* groom, int i)
{
    int points = groom->files[i].points;
    double roots = spread(groom->points[i], groom->strands[i], points);
    double tips = spread(groom->points[i] + points - 1, groom->strands[i], points);
    return tips < LOAD_TIP_SPREAD * roots;
}

static bool is_listed(const char* list, const char* name)
{
    size_t length = strlen(name);
    for (const char* at = list; *at != 0;) {
        at += strspn(at, ", ");
        size_t span = strcspn(at, ",");
        if (span == length && strncmp(at, name, length) == 0) return true;
        at += span;
    }
    return false;
}

// Every name on the list must be a section's.
static bool check_list(const Groom* groom, const char* list, Fault* fault)
{
    for (const char* at = list; *at != 0;) {
        at += strspn(at, ", ");
        size_t span = strcspn(at, ",");
        bool known = span == 0;
        for (int i = 0; i < groom->recipe.file_count && !known; ++i)
            known = (strlen(groom->names[i]) == span && strncmp(groom->names[i], at, span) == 0) ||
                    (strlen(groom->files[i].name) == span &&
                     strncmp(groom->files[i].name, at, span) == 0);
        if (!known)
            return fault_set(fault,
                             "both_ends: no section is named %.*s; give auto, none or sections "
                             "such as %s",
                             (int)(span < 60 ? span : 60), at, groom->names[0]);
        at += span;
    }
    return true;
}

static bool decide_both_ends(Groom* groom, const Notice* notice, Fault* fault)
{
    const char* list = groom->recipe.both_ends;
    bool automatic = list[0] == 0 || strcmp(list, "auto") == 0;
    bool none = strcmp(list, "none") == 0;
    if (!automatic && !none && !check_list(groom, list, fault)) return false;
    for (int i = 0; i < groom->recipe.file_count; ++i) {
        bool listed = is_listed(list, groom->names[i]) || is_listed(list, groom->files[i].name);
        bool flag = groom->files[i].both_ends;
        groom->pinned[i] = flag && !none && (automatic ? tips_converge(groom, i) : listed);
        if (flag)
            notice_say(notice, "%s: both-ends flag %s%s", groom->names[i],
                       groom->pinned[i] ? "obeyed: tips are fixed to the head"
                                        : "not obeyed: tips are free",
                       !automatic         ? ""
                       : groom->pinned[i] ? " (they meet; --both-ends none frees them)"
                                          : " (they hang apart; --both-ends NAME fixes them)");
        else if (listed && !automatic && !none)
            notice_say(notice,
                       "%s: listed in both_ends, but its file has no such flag: tips stay "
                       "free",
                       groom->names[i]);
    }
    return true;
}

static void say_unit(const Groom* groom, int i, const Notice* notice)
{
    bool version_3 = groom->files[i].version == 3.0f;
    bool given = groom->recipe.unit_m > 0.0;
    char source[80];
    snprintf(source, sizeof source, given ? "given" : "default for .tfx %d; --unit changes it",
             version_3 ? 3 : 4);
    notice_say(notice, "%s: unit %g m (%s), %s", groom->files[i].name, groom->unit_m[i], source,
               groom->negate_z[i] ? "z negated (--keep-axes keeps it)" : "axes as in the file");
}

static bool read_groom_file(Groom* groom, int i, const Notice* notice, Fault* fault)
{
    const Recipe* recipe = &groom->recipe;
    if (!import_tfx(&groom->files[i], recipe->files[i], fault)) return false;
    bool version_3 = groom->files[i].version == 3.0f;
    double unit_m = version_3 ? LOAD_TFX3_UNIT_M : 1.0;
    groom->unit_m[i] = recipe->unit_m > 0.0 ? recipe->unit_m : unit_m;
    groom->negate_z[i] = version_3 && !recipe->keep_axes;
    // One line for the usual case: files of a groom that agree with the first.
    if (i == 0 || groom->unit_m[i] != groom->unit_m[0] || groom->negate_z[i] != groom->negate_z[0])
        say_unit(groom, i, notice);
    return make_section(groom, i, notice, fault);
}

static bool read_groom(Groom* groom, const LoadOptions* options, const Notice* notice, Fault* fault)
{
    if (!make_recipe(&groom->recipe, options, fault)) return false;
    for (int i = 0; i < groom->recipe.file_count; ++i)
        if (!read_groom_file(groom, i, notice, fault)) return false;
    name_sections(groom);
    return decide_both_ends(groom, notice, fault);
}

static void free_groom(Groom* groom)
{
    if (groom == NULL) return;
    for (int i = 0; i < LOAD_MAX_FILES; ++i) {
        import_free(&groom->files[i]);
        free(groom->points[i]);
    }
    free(groom);
}

// The style -------------------------------------------------------------------------------------

static int default_guides(const Groom* groom)
{
    int strands = 0, least = BIND_MIN_GUIDES * groom->recipe.file_count;
    for (int i = 0; i < groom->recipe.file_count; ++i)
        strands += groom->strands[i];
    int guides = least > LOAD_GUIDES ? least : LOAD_GUIDES;
    return strands < guides ? strands : guides;
}

static bool bind_groom(Hairstyle* style, const Groom* groom, Fault* fault)
{
    BindSection sections[LOAD_MAX_FILES];
    for (int i = 0; i < groom->recipe.file_count; ++i)
        sections[i] = (BindSection){groom->names[i], groom->points[i], groom->strands[i],
                                    groom->files[i].points, groom->pinned[i]};
    int guides = groom->recipe.guides != 0 ? groom->recipe.guides : default_guides(groom);
    int nodes = groom->recipe.nodes != 0 ? groom->recipe.nodes : LOAD_NODES;
    return bind_sections(style, sections, groom->recipe.file_count, guides, nodes, fault);
}

static void grow_box(Box* box, Vec3 p)
{
    box->low = vec3(fminf(box->low.x, p.x), fminf(box->low.y, p.y), fminf(box->low.z, p.z));
    box->high = vec3(fmaxf(box->high.x, p.x), fmaxf(box->high.y, p.y), fmaxf(box->high.z, p.z));
}

static Box empty_box(void)
{
    return (Box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

static Box hair_box(const Groom* groom)
{
    Box box = empty_box();
    for (int i = 0; i < groom->recipe.file_count; ++i)
        for (int p = 0; p < groom->strands[i] * groom->files[i].points; ++p)
            grow_box(&box, groom->points[i][p]);
    return box;
}

static Box skin_box(const HeadMesh* mesh)
{
    Box box = empty_box(), all = empty_box();
    for (int i = 0; i < mesh->part_count; ++i) {
        const HeadPart* part = &mesh->parts[i];
        for (uint32_t k = part->first_index; k < part->first_index + part->index_count; ++k) {
            Vec3 p = mesh->positions[mesh->indices[k]];
            grow_box(&all, p);
            if (part->is_skin) grow_box(&box, p);
        }
    }
    return box.low.x <= box.high.x ? box : all;
}

static Vec3 box_middle(const Box* box)
{
    return vec3_scale(vec3_add(box->low, box->high), 0.5f);
}

static void check_size(const Box* box, const char* what, const Notice* notice)
{
    Vec3 extent = vec3_sub(box->high, box->low);
    double size = (double)fmaxf(extent.x, fmaxf(extent.y, extent.z));
    if (size < LOAD_SMALL_HAIR_M || size > LOAD_LARGE_HAIR_M)
        notice_say(notice, "%s is %.3g m large, which is unlikely: is the unit right? (--unit)",
                   what, size);
}

static bool load_head(Hairstyle* style, Groom* groom, const Notice* notice, Fault* fault)
{
    const Recipe* recipe = &groom->recipe;
    if (!import_obj(&style->head, recipe->head, (float)groom->unit_m[0], groom->negate_z[0], fault))
        return false;
    style->head_kind = HEAD_MESH;
    for (int i = 0; i < style->head.part_count; ++i)
        if (style->head.parts[i].is_skin && recipe->has_skin_colour)
            style->head.parts[i].albedo = recipe->material.skin_colour;
    Box skin = skin_box(&style->head);
    check_size(&skin, "the head", notice);
    style->head_centre = box_middle(&skin);
    style->head_centre.y = skin.high.y - (float)LOAD_HALF_HEAD_M;
    Sphere spheres[FIT_SPHERES];
    style->collider_count = fit_spheres(spheres, FIT_SPHERES, &style->head, &groom->covered);
    for (int i = 0; i < style->collider_count; ++i)
        style->colliders[i] = collider_sphere(spheres[i]);
    return true;
}

static bool build_style(Hairstyle* style, Groom* groom, const Notice* notice, Fault* fault)
{
    memcpy(style->name, groom->recipe.name, HAIRSTYLE_NAME_BYTES);
    style->material = groom->recipe.material;
    Box hair = hair_box(groom);
    check_size(&hair, "the hair", notice);
    style->head_centre = box_middle(&hair);
    if (!bind_groom(style, groom, fault)) return false;
    if (groom->recipe.head[0] != 0 && !load_head(style, groom, notice, fault)) return false;
    return hairstyle_validate(style, fault) || fault_prefix(fault, groom->recipe.files[0]);
}

static Hairstyle* make_style(Groom* groom, const Notice* notice, Fault* fault)
{
    Hairstyle* style = hairstyle_create();
    if (style == NULL) fault_set(fault, "no memory for a style");
    if (style == NULL || build_style(style, groom, notice, fault)) return style;
    hairstyle_destroy(style);
    return NULL;
}

bool load_has_groom_options(const LoadOptions* options)
{
    return options->head != NULL || options->unit_m != 0.0 || options->keep_axes ||
           options->guides != 0 || options->nodes != 0 || options->both_ends != NULL;
}

// A built-in style; `*index` is -1 where the options name none.
static bool find_builtin(int* index, const LoadOptions* options, Fault* fault)
{
    *index = options->style_count == 1 && options->styles[0] != NULL
                 ? builtin_index(options->styles[0])
                 : -1;
    if (*index >= 0 && options->head != NULL)
        return fault_set(fault, "head %.150s: style %s brings its own; leave --head out",
                         options->head, options->styles[0]);
    if (*index >= 0 && load_has_groom_options(options))
        return fault_set(fault,
                         "style %s: unit, axes, guides, nodes and both ends are of imported "
                         "grooms; leave them out",
                         options->styles[0]);
    return true;
}

Hairstyle* load_style(const LoadOptions* options, const Notice* notice, Fault* fault)
{
    int builtin = -1;
    if (!find_builtin(&builtin, options, fault)) return NULL;
    if (builtin >= 0) return growers[builtin](fault);
    Groom* groom = calloc(1, sizeof *groom);
    if (groom == NULL) {
        fault_set(fault, "no memory for a groom");
        return NULL;
    }
    Hairstyle* style = NULL;
    if (read_groom(groom, options, notice, fault)) style = make_style(groom, notice, fault);
    free_groom(groom);
    return style;
}

// --info ----------------------------------------------------------------------------------------

static void print_strand(const char* label, const ImportedStrands* file, int strand)
{
    const float* root = file->positions + (size_t)strand * (size_t)file->points * 3;
    const float* tip = root + (file->points - 1) * 3;
    printf("  %-12s %.9g %.9g %.9g .. %.9g %.9g %.9g\n", label, (double)root[0], (double)root[1],
           (double)root[2], (double)tip[0], (double)tip[1], (double)tip[2]);
}

static void print_file(const Groom* groom, int i)
{
    const ImportedStrands* file = &groom->files[i];
    printf("file %s\n", groom->recipe.files[i]);
    printf("  version      %.1f\n", (double)file->version);
    printf("  strands      %d x %d vertices, both ends %d, degenerate %d\n", file->strands,
           file->points, file->both_ends, file->degenerate);
    printf("  bbox         %.4f %.4f %.4f .. %.4f %.4f %.4f\n", file->low[0], file->low[1],
           file->low[2], file->high[0], file->high[1], file->high[2]);
    printf("  length       mean %.6f, min %.6g, max %.6g, total %.6f\n", file->mean_length,
           file->min_length, file->max_length, file->total_length);
    printf("  sum          %.6f %.6f %.6f\n", file->sum[0], file->sum[1], file->sum[2]);
    print_strand("first strand", file, 0);
    print_strand("last strand", file, file->strands - 1);
    printf("  unit         %g m, %s\n", groom->unit_m[i],
           groom->negate_z[i] ? "z negated" : "axes as in the file");
}

static void print_set(const Hairstyle* style, const StrandSet* set)
{
    double length = 0.0;
    bool pinned = false;
    for (int g = set->first_guide; g < set->first_guide + set->guide_count; ++g) {
        length += (double)hairstyle_guide_length(style, g) / set->guide_count;
        pinned = pinned || style->weight[(size_t)(g + 1) * (size_t)style->nodes - 1] == 0;
    }
    printf("section %-16s %s, %d %s of %d points, %d guides of %.1f mm on average, tips %s\n",
           set->name, set->kind == STRANDS_GROWN ? "grown" : "imported", set->strand_count,
           set->kind == STRANDS_GROWN ? "wisps" : "strands", set->points, set->guide_count,
           1000.0 * length, pinned ? "fixed (both ends)" : "free");
}

static void print_collider(int number, const Collider* c)
{
    bool is_sphere = vec3_length(vec3_sub(c->to, c->from)) == 0.0f;
    printf("  %s %2d at %7.4f %7.4f %7.4f m", is_sphere ? "sphere" : "capsule", number,
           (double)c->from.x, (double)c->from.y, (double)c->from.z);
    if (!is_sphere)
        printf(" to %7.4f %7.4f %7.4f m", (double)c->to.x, (double)c->to.y, (double)c->to.z);
    printf(", radius %.4f m%s\n", (double)c->radius, c->body == BODY_TORSO ? ", of the torso" : "");
}

static bool print_style(const Hairstyle* style, float covered, Fault* fault)
{
    static const char* const heads[] = {"none", "mannequin", "mesh"};
    int strands = 0; // of every set: style->strand_count holds no grown ones
    for (int i = 0; i < style->set_count; ++i)
        strands += style->sets[i].strand_count;
    printf("style %s: %d guides x %d nodes, %d strands\n", style->name, style->guide_count,
           style->nodes, strands);
    for (int i = 0; i < style->set_count; ++i)
        print_set(style, &style->sets[i]);
    printf("box %.4f %.4f %.4f .. %.4f %.4f %.4f m\n", (double)style->box.low.x,
           (double)style->box.low.y, (double)style->box.low.z, (double)style->box.high.x,
           (double)style->box.high.y, (double)style->box.high.z);
    printf("head %s, centre %.4f %.4f %.4f m, %d vertices, %d triangles, %d parts\n",
           heads[style->head_kind], (double)style->head_centre.x, (double)style->head_centre.y,
           (double)style->head_centre.z, style->head.vertex_count, style->head.index_count / 3,
           style->head.part_count);
    printf("colliders %d", style->collider_count);
    if (covered > 0.0f) printf(", covering %.0f %% of the head's inside", 100.0 * (double)covered);
    printf("\n");
    for (int i = 0; i < style->collider_count; ++i)
        print_collider(i, &style->colliders[i]);
    StyleBytes bytes = {0};
    if (!style_encode(&bytes, style, fault)) return false;
    printf("lanes fast %zu bytes, bulk %zu bytes\n", bytes.size[STYLE_FAST],
           bytes.size[STYLE_BULK]);
    printf("style_hash %016llx\n", (unsigned long long)bytes.hash);
    style_bytes_free(&bytes);
    return true;
}

static bool print_groom(Groom* groom, const LoadOptions* options, const Notice* notice,
                        Fault* fault)
{
    if (!read_groom(groom, options, notice, fault)) return false;
    for (int i = 0; i < groom->recipe.file_count; ++i)
        print_file(groom, i);
    Hairstyle* style = make_style(groom, notice, fault);
    if (style == NULL) return false;
    bool sound = print_style(style, groom->covered, fault);
    hairstyle_destroy(style);
    return sound;
}

bool load_print_info(const LoadOptions* options, const Notice* notice, Fault* fault)
{
    int builtin = -1;
    if (!find_builtin(&builtin, options, fault)) return false;
    if (builtin >= 0) {
        Hairstyle* style = growers[builtin](fault);
        bool sound = style != NULL && print_style(style, 0.0f, fault);
        hairstyle_destroy(style);
        return sound;
    }
    Groom* groom = calloc(1, sizeof *groom);
    if (groom == NULL) return fault_set(fault, "no memory for a groom");
    bool sound = print_groom(groom, options, notice, fault);
    free_groom(groom);
    return sound;
}
