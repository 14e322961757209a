#include "tests/follow.h"

#include "server/bind.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FILE_UNIT_M    0.0027
#define RADIUS         0.4 // of a guide's follow hairs, file units
#define TIP_SEPARATION 5.0
#define GUIDES         64
#define NODES          8
#define ROOT_WIDTH_M   0.00016f
#define TIP_WIDTH_M    0.00004f
#define OPAQUE_FIBRES  1000.0f // more than fit on a ribbon: each is one hair, and a hair is opaque

const char* const follow_files[FOLLOW_SECTIONS] = {
    "ponytail_back.tfx", "ponytail_side.tfx", "ponytail_front_top.tfx", "ponytail_tail_v31.tfx"};

double follow_random(uint32_t n)
{
    uint32_t s = n * 747796405u + 2891336453u;
    uint32_t w = ((s >> ((s >> 28) + 4)) ^ s) * 277803737u;
    return (double)((w >> 22) ^ w) / 4294967296.0;
}

// t0, t1 across the guide's first link, file axes.
static void frame_across(const float* p, Vec3d* t0, Vec3d* t1)
{
    Vec3d d = {(double)p[3] - (double)p[0], (double)p[4] - (double)p[1],
               (double)p[5] - (double)p[2]};
    double length = sqrt(vec3d_dot(d, d));
    d = vec3d_scale(d, length > 0 ? 1.0 / length : 0.0);
    Vec3d e = {1, 0, 0};
    double least = fabs(d.x);
    if (fabs(d.y) < least) e = (Vec3d){0, 1, 0}, least = fabs(d.y);
    if (fabs(d.z) < least) e = (Vec3d){0, 0, 1};
    Vec3d side = {d.y * e.z - d.z * e.y, d.z * e.x - d.x * e.z, d.x * e.y - d.y * e.x};
    length = sqrt(vec3d_dot(side, side));
    *t0 = vec3d_scale(side, length > 0 ? 1.0 / length : 0.0);
    *t1 = (Vec3d){d.y * t0->z - d.z * t0->y, d.z * t0->x - d.x * t0->z, d.x * t0->y - d.y * t0->x};
}

void follow_strand(float* out, const float* guide_points, int points, uint32_t guide,
                   uint32_t follow)
{
    Vec3d t0, t1;
    frame_across(guide_points, &t0, &t1);
    uint32_t n = 2 * FOLLOW_PER_GUIDE * guide + 2 * follow;
    double a = RADIUS * (2.0 * follow_random(n) - 1.0);
    double b = RADIUS * (2.0 * follow_random(n + 1) - 1.0);
    for (int k = 0; k < points; ++k) {
        double spread = TIP_SEPARATION * k / points + 1.0;
        out[3 * k] = (float)((double)guide_points[3 * k] + (a * t0.x + b * t1.x) * spread);
        out[3 * k + 1] = (float)((double)guide_points[3 * k + 1] + (a * t0.y + b * t1.y) * spread);
        out[3 * k + 2] = (float)((double)guide_points[3 * k + 2] + (a * t0.z + b * t1.z) * spread);
    }
}

static Vec3 to_head_space(const float* p)
{
    return vec3((float)((double)p[0] * FILE_UNIT_M), (float)((double)p[1] * FILE_UNIT_M),
                (float)(-(double)p[2] * FILE_UNIT_M));
}

// Guide, its follow hairs, the next guide: metres.
static Vec3* grow_section(const ImportedStrands* file, uint32_t first_guide)
{
    size_t points = (size_t)file->points, strands = (size_t)file->strands * (1 + FOLLOW_PER_GUIDE);
    Vec3* grown = malloc(strands * points * sizeof *grown);
    float strand[3 * HAIRSTYLE_MAX_POINTS];
    if (grown == NULL || points > HAIRSTYLE_MAX_POINTS) {
        free(grown);
        return NULL;
    }
    Vec3* at = grown;
    for (int g = 0; g < file->strands; ++g) {
        const float* guide = file->positions + 3 * points * (size_t)g;
        for (uint32_t f = 0; f <= FOLLOW_PER_GUIDE; ++f) {
            if (f > 0) follow_strand(strand, guide, file->points, first_guide + (uint32_t)g, f - 1);
            const float* from = f > 0 ? strand : guide;
            for (size_t k = 0; k < points; ++k)
                *at++ = to_head_space(from + 3 * k);
        }
    }
    return grown;
}

static bool read_section(BindSection* section, ImportedStrands* file, const char* folder, int i,
                         uint32_t first_guide, Fault* fault)
{
    char path[512];
    snprintf(path, sizeof path, "%s%s", folder, follow_files[i]);
    if (!import_tfx(file, path, fault)) return false;
    Vec3* points = grow_section(file, first_guide);
    if (points == NULL) return fault_set(fault, "no memory for %s", path);
    *section = (BindSection){file->name, points, file->strands * (1 + FOLLOW_PER_GUIDE),
                             file->points, false};
    return true;
}

static bool bind_all(Hairstyle* style, const char* folder, Fault* fault)
{
    BindSection sections[FOLLOW_SECTIONS];
    ImportedStrands files[FOLLOW_SECTIONS];
    memset(sections, 0, sizeof sections);
    memset(files, 0, sizeof files);
    uint32_t guides = 0;
    bool read = true;
    for (int i = 0; i < FOLLOW_SECTIONS && read; ++i) {
        read = read_section(&sections[i], &files[i], folder, i, guides, fault);
        guides += (uint32_t)files[i].strands;
    }
    bool bound = read && bind_sections(style, sections, FOLLOW_SECTIONS, GUIDES, NODES, fault);
    for (int i = 0; i < FOLLOW_SECTIONS; ++i) {
        free((void*)sections[i].points);
        import_free(&files[i]);
    }
    return bound;
}

static bool build(Hairstyle* style, const char* folder, Fault* fault)
{
    char head[512];
    snprintf(head, sizeof head, "%sponytail_head.obj", folder);
    snprintf(style->name, sizeof style->name, "reference");
    if (!bind_all(style, folder, fault) ||
        !import_obj(&style->head, head, (float)FILE_UNIT_M, true, fault))
        return false;
    style->head_kind = HEAD_MESH;
    style->head_centre = vec3(0.0f, 0.216f, 0.0f);
    for (int i = 0; i < style->set_count; ++i) {
        style->sets[i].root_width_m = ROOT_WIDTH_M;
        style->sets[i].tip_width_m = TIP_WIDTH_M;
        style->sets[i].fibres = OPAQUE_FIBRES;
    }
    return hairstyle_validate(style, fault);
}

Hairstyle* follow_style(const char* folder, Fault* fault)
{
    Hairstyle* style = hairstyle_create();
    if (style == NULL) {
        fault_set(fault, "no memory for a style");
        return NULL;
    }
    if (build(style, folder, fault)) return style;
    hairstyle_destroy(style);
    return NULL;
}
