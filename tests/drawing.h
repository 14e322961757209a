// What the tests of the drawing side share: contexts or a loud skip, styles, and views of guides
// made by hand.
#pragma once

#include "client/gl.h"
#include "client/receive.h"
#include "messages/frame.h"
#include "messages/quantise.h"
#include "messages/random.h"
#include "server/groom.h"
#include "server/load.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define DRAWING_ASSETS SOURCE_DIR "/../shared/assets/"

// The back end asked for and no other, or NULL after saying why.
static inline Gl* drawing_open(const char* which)
{
    Fault fault = {""};
    Gl* gl = gl_open(which, NULL, &fault);
    if (gl != NULL && strcmp(gl->backend, which) == 0) return gl;
    if (gl != NULL) gl_close(gl);
    printf("SKIPPED: no %s on this machine. %s\n", which, fault.text);
    return NULL;
}

static inline bool drawing_has_assets(void)
{
    if (access(DRAWING_ASSETS "ponytail_tail_v31.tfx", R_OK) == 0) return true;
    printf("SKIPPED: no %s\n", DRAWING_ASSETS);
    return false;
}

// Built-in by name; "ponytail" is the imported groom with its head (NULL without the assets).
static inline Hairstyle* drawing_style(const char* name)
{
    Fault fault = {""};
    Hairstyle* style = NULL;
    if (strcmp(name, "long") == 0) style = groom_long(&fault);
    if (strcmp(name, "bob") == 0) style = groom_bob(&fault);
    if (strcmp(name, "ponytail") == 0) {
        if (!drawing_has_assets()) return NULL;
        LoadOptions options = {.styles = {DRAWING_ASSETS "ponytail_back.tfx",
                                          DRAWING_ASSETS "ponytail_side.tfx",
                                          DRAWING_ASSETS "ponytail_front_top.tfx",
                                          DRAWING_ASSETS "ponytail_tail_v31.tfx"},
                               .style_count = 4,
                               .head = DRAWING_ASSETS "ponytail_head.obj"};
        style = load_style(&options, NULL, &fault);
    }
    if (style == NULL) {
        fprintf(stderr, "style %s: %s\n", name, fault.text);
        abort();
    }
    return style;
}

// A view that holds nothing yet of a character that wears `style`.
static inline GuidesView drawing_view(const Hairstyle* style)
{
    GuidesView view;
    Fault fault = {""};
    if (!guides_view_init(&view, 0, &fault)) abort();
    view.any = true;
    view.epoch = 1;
    view.guides = style->guide_count;
    view.nodes = style->nodes;
    view.pose = pose_identity();
    for (int layer = 0; layer < 2; ++layer) {
        for (int row = 0; row < HAIRSTYLE_MAX_GUIDES; ++row)
            view.row_tick[layer][row] = -1;
        view.layer[layer] = (GuidesLayer){.tick = -1, .pose = pose_identity()};
    }
    return view;
}

// Row `row` at `tick` into the view, quantised.
static inline void drawing_put_row(GuidesView* view, const Hairstyle* style, int row, int32_t tick,
                                   const Vec3* nodes)
{
    Vec3 along[HAIRSTYLE_MAX_NODES];
    int layer = tick & 1;
    quantise_strand_tangents(along, nodes, style->nodes);
    for (int n = 0; n < style->nodes; ++n) {
        int i = 3 * (row * style->nodes + n);
        quantise_position(view->positions[layer] + i, nodes[n], &style->box);
        quantise_tangent(view->tangents[layer] + i, along[n]);
    }
    view->row_tick[layer][row] = tick;
    view->layer[layer].tick = tick;
    if (tick > view->tick) view->tick = tick;
}

// Guide `row`, its links turned towards a direction of their own, more so to the tip; lengths stay.
// `bend` 1 moves tips by up to the strand's length.
static inline void drawing_bend(Vec3* nodes, const Hairstyle* style, int row, uint32_t seed,
                                float bend)
{
    const Vec3* rest = style->rest + row * style->nodes;
    nodes[0] = rest[0];
    for (int n = 1; n < style->nodes; ++n) {
        Vec3 link = vec3_sub(rest[n], rest[n - 1]);
        float length = vec3_length(link), along = (float)n / (float)(style->nodes - 1);
        uint32_t key = (uint32_t)(row * 64 + n / 3) * 3u;
        Vec3 pull = {random_signed(seed, key), random_signed(seed, key + 1),
                     random_signed(seed, key + 2)};
        link = vec3_mad(vec3_scale(link, 1.0f / fmaxf(length, 1e-9f)), pull, bend * along);
        nodes[n] = vec3_mad(nodes[n - 1], vec3_normalise_or(link, vec3(0, -1, 0)), length);
    }
}

// Every row at `tick`: bent by `bend` as `seed` says; 0 is the rest pose.
static inline void drawing_put_tick(GuidesView* view, const Hairstyle* style, int32_t tick,
                                    uint32_t seed, float bend)
{
    for (int row = 0; row < style->guide_count; ++row) {
        Vec3 nodes[HAIRSTYLE_MAX_NODES];
        drawing_bend(nodes, style, row, seed, bend);
        drawing_put_row(view, style, row, tick, nodes);
    }
    view->complete = true;
}
