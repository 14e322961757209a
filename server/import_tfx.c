#include "server/import.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

// Where the fields that we read stand in the two headers. Version 3 and 4 order them differently,
// so the version float picks the layout before anything else is looked at.
typedef struct Layout {
    float version;
    size_t header_bytes, position_offset_at;
    size_t floats; // of a vertex
} Layout;

static const Layout layouts[] = {{3.0f, 296, 144, 3}, {4.0f, 160, 12, 4}};

enum { STRANDS_AT = 4, POINTS_AT = 8, BOTH_ENDS_AT = 16 };

static bool read_error(const char* path, Fault* fault)
{
    return fault_set(fault, "%.200s: cannot be read: %s", path, strerror(errno));
}

static bool file_size(const char* path, size_t cap, size_t* size, Fault* fault)
{
    struct stat status;
    if (stat(path, &status) != 0) return read_error(path, fault);
    if (!S_ISREG(status.st_mode)) return fault_set(fault, "%.200s: not a regular file", path);
    if ((uint64_t)status.st_size > cap)
        return fault_set(fault, "%.200s: %lld bytes, more than the %zu MiB taken; split it", path,
                         (long long)status.st_size, cap >> 20);
    *size = (size_t)status.st_size;
    return true;
}

uint8_t* import_read_file(const char* path, size_t cap, size_t* size, Fault* fault)
{
    if (!file_size(path, cap, size, fault)) return NULL;
    FILE* file = fopen(path, "rb");
    if (file == NULL) {
        read_error(path, fault);
        return NULL;
    }
    uint8_t* bytes = malloc(*size + 1);
    if (bytes == NULL) {
        fault_set(fault, "%.200s: no memory for its %zu bytes", path, *size);
    } else if (fread(bytes, 1, *size, file) != *size) {
        fault_set(fault, "%.200s: shrank while it was read; try again", path);
        free(bytes);
        bytes = NULL;
    } else {
        bytes[*size] = 0;
    }
    fclose(file);
    return bytes;
}

void import_stem(char name[HAIRSTYLE_NAME_BYTES], const char* path)
{
    const char* slash = strrchr(path, '/');
    const char* base = slash != NULL ? slash + 1 : path;
    const char* dot = strrchr(base, '.');
    size_t length = dot != NULL && dot != base ? (size_t)(dot - base) : strlen(base);
    if (length > HAIRSTYLE_NAME_BYTES - 1) length = HAIRSTYLE_NAME_BYTES - 1;
    for (size_t i = 0; i < length; ++i) // names travel in messages: printable ASCII only
        name[i] = base[i] >= ' ' && base[i] <= '~' ? base[i] : '_';
    name[length] = 0;
}

// The files are little-endian; so is every machine this runs on (style and frame check that too).
static uint32_t u32_at(const uint8_t* bytes, size_t offset)
{
    uint32_t value;
    memcpy(&value, bytes + offset, sizeof value);
    return value;
}

static float f32_at(const uint8_t* bytes, size_t offset)
{
    float value;
    memcpy(&value, bytes + offset, sizeof value);
    return value;
}

static const Layout* layout_of(const uint8_t* bytes, size_t size, const char* path, Fault* fault)
{
    if (size >= 7 && memcmp(bytes, "version", 7) == 0) {
        fault_set(fault, "%.200s: a text .tfx (version 2 or older); export it as version 3 or 4",
                  path);
        return NULL;
    }
    if (size < 4) {
        fault_set(fault, "%.200s: %zu bytes: not a .tfx file", path, size);
        return NULL;
    }
    float version = f32_at(bytes, 0);
    for (size_t i = 0; i < sizeof layouts / sizeof *layouts; ++i)
        if (version == layouts[i].version) return &layouts[i];
    fault_set(fault, "%.200s: version is %g: not a .tfx file of version 3 or 4", path,
              (double)version);
    return NULL;
}

static bool check_counts(uint32_t strands, uint32_t points, const char* path, Fault* fault)
{
    if (strands < 1 || strands > HAIRSTYLE_MAX_STRANDS)
        return fault_set(fault, "%.200s: strand count is %u, not 1 to %d; thin the groom", path,
                         strands, HAIRSTYLE_MAX_STRANDS);
    if (points < 2 || points > HAIRSTYLE_MAX_POINTS)
        return fault_set(fault,
                         "%.200s: vertices per strand is %u, not 2 to %d; resample the groom", path,
                         points, HAIRSTYLE_MAX_POINTS);
    return true;
}

// All in 64 bits: 65,536 x 64 x 16 + 2^32 cannot wrap.
static bool check_positions(uint64_t offset, uint64_t bytes, const Layout* layout, size_t size,
                            const char* path, Fault* fault)
{
    if (offset < layout->header_bytes || offset > size)
        return fault_set(fault,
                         "%.200s: offset of positions is %llu, outside %zu to %zu; export it again",
                         path, (unsigned long long)offset, layout->header_bytes, size);
    if (offset + bytes > size)
        return fault_set(fault,
                         "%.200s: its counts need %llu bytes but the file has %zu: truncated, or "
                         "the counts lie; export it again",
                         path, (unsigned long long)(offset + bytes), size);
    return true;
}

static bool copy_positions(ImportedStrands* out, const uint8_t* bytes, const Layout* layout,
                           const char* path, Fault* fault)
{
    size_t vertices = (size_t)out->strands * (size_t)out->points;
    for (size_t v = 0; v < vertices; ++v) {
        float* to = out->positions + 3 * v;
        memcpy(to, bytes + v * layout->floats * sizeof(float), 3 * sizeof(float));
        for (int axis = 0; axis < 3; ++axis)
            if (!(fabs((double)to[axis]) <= IMPORT_MAX_COORDINATE)) // false for NaN too
                return fault_set(fault,
                                 "%.200s: %c of strand %zu, vertex %zu is %g; mend the groom", path,
                                 "xyz"[axis], v / (size_t)out->points, v % (size_t)out->points,
                                 (double)to[axis]);
    }
    return true;
}

// Version 4 has no flag; w is the inverse mass of a vertex, so tips that are all 0 say the same.
static bool tips_are_fixed(const ImportedStrands* out, const uint8_t* bytes)
{
    for (size_t s = 1; s <= (size_t)out->strands; ++s)
        if (f32_at(bytes, (s * (size_t)out->points - 1) * 16 + 12) != 0.0f) return false;
    return true;
}

double import_strand_length(const ImportedStrands* imported, int strand)
{
    const float* p = imported->positions + (size_t)strand * (size_t)imported->points * 3;
    double length = 0.0;
    for (int i = 1; i < imported->points; ++i, p += 3) {
        double x = (double)p[3] - (double)p[0], y = (double)p[4] - (double)p[1];
        double z = (double)p[5] - (double)p[2];
        length += sqrt(x * x + y * y + z * z);
    }
    return length;
}

bool import_is_degenerate(const ImportedStrands* imported, double length)
{
    return !(length > IMPORT_DEGENERATE * imported->mean_length);
}

static void measure_vertices(ImportedStrands* out)
{
    size_t vertices = (size_t)out->strands * (size_t)out->points;
    for (int axis = 0; axis < 3; ++axis) {
        double low = HUGE_VAL, high = -HUGE_VAL, sum = 0.0;
        for (size_t v = 0; v < vertices; ++v) {
            double x = (double)out->positions[3 * v + (size_t)axis];
            sum += x;
            low = x < low ? x : low;
            high = x > high ? x : high;
        }
        out->sum[axis] = sum;
        out->low[axis] = low;
        out->high[axis] = high;
    }
}

static void measure_lengths(ImportedStrands* out)
{
    out->min_length = HUGE_VAL;
    for (int s = 0; s < out->strands; ++s) {
        double length = import_strand_length(out, s);
        out->total_length += length;
        if (length < out->min_length) out->min_length = length;
        if (length > out->max_length) out->max_length = length;
    }
    out->mean_length = out->total_length / out->strands;
    for (int s = 0; s < out->strands; ++s)
        out->degenerate += import_is_degenerate(out, import_strand_length(out, s));
}

static bool parse(ImportedStrands* out, const uint8_t* bytes, size_t size, const char* path,
                  Fault* fault)
{
    const Layout* layout = layout_of(bytes, size, path, fault);
    if (layout == NULL) return false;
    if (size < layout->header_bytes)
        return fault_set(fault, "%.200s: truncated: %zu bytes, its header alone takes %zu", path,
                         size, layout->header_bytes);
    uint32_t strands = u32_at(bytes, STRANDS_AT), points = u32_at(bytes, POINTS_AT);
    if (!check_counts(strands, points, path, fault)) return false;
    uint64_t offset = u32_at(bytes, layout->position_offset_at);
    uint64_t needed = (uint64_t)strands * points * layout->floats * sizeof(float);
    if (!check_positions(offset, needed, layout, size, path, fault)) return false;

    out->version = layout->version;
    out->strands = (int)strands;
    out->points = (int)points;
    out->positions = malloc((size_t)strands * points * 3 * sizeof(float));
    if (out->positions == NULL) return fault_set(fault, "%.200s: no memory", path);
    if (!copy_positions(out, bytes + offset, layout, path, fault)) return false;
    // One byte and three of padding in the original exporter: any bit counts.
    out->both_ends = layout->version == 3.0f ? u32_at(bytes, BOTH_ENDS_AT) != 0
                                             : tips_are_fixed(out, bytes + offset);
    measure_vertices(out);
    measure_lengths(out);
    return true;
}

bool import_tfx(ImportedStrands* imported, const char* path, Fault* fault)
{
    *imported = (ImportedStrands){0};
    size_t size = 0;
    uint8_t* bytes = import_read_file(path, IMPORT_MAX_TFX_BYTES, &size, fault);
    if (bytes == NULL) return false;
    import_stem(imported->name, path);
    bool sound = parse(imported, bytes, size, path, fault);
    free(bytes);
    if (!sound) import_free(imported);
    return sound;
}

void import_free(ImportedStrands* imported)
{
    free(imported->positions);
    *imported = (ImportedStrands){0};
}
