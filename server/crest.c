#include "server/crest.h"

#include "messages/mannequin.h"
#include "messages/trig.h"

#include <stdlib.h>
#include <string.h>

#define ROWS      24
#define NODES     8
#define HIGHEST_M 0.14f // of the fin over the skull
#define LOWEST_M  0.06f // at its ends
#define FRONT_RAD 1.00  // from straight up, forwards
#define BACK_RAD  -1.90
#define ZIGZAG_M  0.0006f // rows stand to either side of the middle: drawn strands need a scalp
#define SWEPT_RAD 0.5     // how far the foremost row leans back

static const Vec3 MIDDLE = {0.0f, 0.2200f, -0.0150f};

static Vec3 skin_at(Vec3 way)
{
    return mannequin_project(vec3_mad(MIDDLE, way, 0.11f), 0.0f);
}

// In the middle plane, `angle` from straight up, forwards.
static Vec3 away(double angle)
{
    return vec3(0, (float)trig_cos(angle), (float)trig_sin(angle));
}

static void lay_row(Vec3* nodes, int row)
{
    float part = (float)row / (ROWS - 1);
    double angle = FRONT_RAD + (BACK_RAD - FRONT_RAD) * (double)part;
    Vec3 up = away(angle), lean = away(angle - SWEPT_RAD * (1.0 - (double)part));
    float height = LOWEST_M + (HIGHEST_M - LOWEST_M) * (float)trig_sin(TRIG_PI * (double)part);
    nodes[0] = skin_at(up);
    nodes[0].x = row % 2 == 0 ? ZIGZAG_M : -ZIGZAG_M;
    for (int n = 1; n < NODES; ++n) {
        float along = (float)n / (NODES - 1);
        Vec3 way = vec3_normalise_or(vec3_lerp(up, lean, along), up);
        nodes[n] = vec3_mad(nodes[n - 1], way, height / (NODES - 1));
        nodes[n].x *= 1.0f - along;
    }
}

static bool fill(Hairstyle* style, Fault* fault)
{
    if (!hairstyle_set_guides(style, ROWS, NODES, fault)) return false;
    style->triangle_count = ROWS - 2;
    style->triangles = malloc((size_t)style->triangle_count * sizeof *style->triangles);
    if (!style->triangles) return fault_set(fault, "crest: out of memory; free some memory");
    for (int row = 0; row < ROWS; ++row) {
        lay_row(style->rest + row * NODES, row);
        style->weight[row * NODES + 1] = 90; // of 255: spines are stiff where they leave the skin
        if (row + 2 < ROWS)
            style->triangles[row] =
                (ScalpTriangle){{(uint16_t)row, (uint16_t)(row + 1), (uint16_t)(row + 2)}};
    }
    style->holds[style->hold_count++] = (Hold){HOLD_CLOTH, 0, ROWS, 0};
    return true;
}

static void dress(Hairstyle* style)
{
    strcpy(style->name, "crest");
    style->seed = 4;
    style->set_count = 1;
    style->sets[0] = (StrandSet){.name = "fin",
                                 .kind = STRANDS_GROWN,
                                 .guide_count = ROWS,
                                 .triangle_count = ROWS - 2,
                                 .strand_count = 2600,
                                 .points = 17,
                                 .root_width_m = 0.0020f,
                                 .tip_width_m = 0.0030f,
                                 .fibres = 9.0f};
    style->collider_count = mannequin_colliders(style->colliders, HAIRSTYLE_MAX_COLLIDERS);
    style->material.root_colour = vec3(0.02f, 0.10f, 0.16f);
    style->material.tip_colour = vec3(0.10f, 0.45f, 0.50f);
    style->head_kind = HEAD_MANNEQUIN;
    style->head_centre = MANNEQUIN_CENTRE;
    hairstyle_fit_box(style);
}

Hairstyle* crest_style(Fault* fault)
{
    Hairstyle* style = hairstyle_create();
    if (style == NULL) {
        fault_set(fault, "crest: out of memory; free some memory");
        return NULL;
    }
    bool made = fill(style, fault);
    if (made) dress(style);
    if (made && hairstyle_validate(style, fault)) return style;
    hairstyle_destroy(style);
    return NULL;
}
