#include "tests/stage.h"

#include "tests/drawing.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define WISPS  2600 // of `long`
#define WIDEST 6.0f

// As its ribbons are scaled, so are the fibres on them: the same share of each is hair.
static Hairstyle* grow(const StageHair* hair, Fault* fault)
{
    Hairstyle* style = groom_long(fault);
    if (style == NULL) return NULL;
    StrandSet* set = &style->sets[0];
    float wider = fminf((float)WISPS / (float)hair->wisps, WIDEST);
    set->strand_count = hair->wisps;
    set->points = hair->points;
    set->root_width_m *= wider;
    set->tip_width_m *= wider;
    set->fibres *= wider;
    return style;
}

bool stage_open(Stage* stage, const Gl* gl, const StageHair* hair, const ShadeOptions* options,
                const CameraOptions* camera, Fault* fault)
{
    memset(stage, 0, sizeof *stage);
    stage->style = grow(hair, fault);
    if (stage->style == NULL) return false;
    stage->view = drawing_view(stage->style);
    stage->can_draw = draw_create(&stage->drawing, gl, options, camera, fault);
    if (!stage->can_draw || !draw_set_style(&stage->drawing, stage->style, 1, 1, fault) ||
        !image_create(&stage->image, options->width, options->height, fault))
        return false;
    stage->drawing.timed = true;
    stage_move(stage);
    return true;
}

void stage_close(Stage* stage)
{
    if (stage->can_draw) draw_free(&stage->drawing);
    if (stage->style != NULL) guides_view_free(&stage->view);
    image_free(&stage->image);
    hairstyle_destroy(stage->style);
}

void stage_move(Stage* stage)
{
    float bend = 0.10f + 0.05f * sinf(0.3f * (float)stage->tick);
    drawing_put_tick(&stage->view, stage->style, stage->tick++, 5, bend);
}

double stage_draw(Stage* stage)
{
    stage->drawing.moved = true;
    int64_t began = base_monotonic_us();
    draw_picture(&stage->drawing, &stage->view, &stage->image);
    return 1e-3 * (double)(base_monotonic_us() - began);
}

static int ascending(const void* a, const void* b)
{
    double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

double stage_quantile(double* values, int count, double share)
{
    qsort(values, (size_t)count, sizeof *values, ascending);
    int at = (int)ceil(share * count) - 1;
    return values[at < 0 ? 0 : at];
}

static double quantile_of_ring(const float* ring, int64_t count, double share)
{
    double ms[DRAW_TIMES];
    int held = count < DRAW_TIMES ? (int)count : DRAW_TIMES;
    for (int i = 0; i < held; ++i)
        ms[i] = (double)ring[i];
    return held > 0 ? stage_quantile(ms, held, share) : 0.0;
}

double stage_pass_ms(const Stage* stage, int pass, double share)
{
    const DrawTimes* times = stage->drawing.times;
    return quantile_of_ring(times->ms[pass], times->count[pass], share);
}

double stage_processor_ms(const Stage* stage, int pass, double share)
{
    const DrawTimes* times = stage->drawing.times;
    return quantile_of_ring(times->processor_ms[pass], times->count[pass], share);
}

void stage_forget(Stage* stage)
{
    memset(stage->drawing.times->count, 0, sizeof stage->drawing.times->count);
}
