// A character to be drawn again and again, for the studies of pictures: a style of any number of
// wisps, rows that move, and the times of each pass.
#pragma once

#include "client/draw.h"

// Of the style `long`: fewer wisps are wider, so that they cover as much, up to six times.
typedef struct StageHair {
    int triangles, wisps, points;
} StageHair;

typedef struct Stage {
    Hairstyle* style;
    Drawing drawing;
    bool can_draw;
    GuidesView view;
    Image image;
    int32_t tick;
} Stage;

bool stage_open(Stage* stage, const Gl* gl, const StageHair* hair, const ShadeOptions* options,
                const CameraOptions* camera, Fault* fault);
void stage_close(Stage* stage);

// New rows for all guides, as the next tick would bring them.
void stage_move(Stage* stage);
// Draws everything anew, also where nothing moved. Milliseconds of the whole.
double stage_draw(Stage* stage);

// The value that `share` of all are at or below; puts them in order.
double stage_quantile(double* values, int count, double share);
// The same of a pass, of the pictures since the last stage_forget: by the clock, and by the time
// that processors worked for it, which other programs here do not stretch.
double stage_pass_ms(const Stage* stage, int pass, double share);
double stage_processor_ms(const Stage* stage, int pass, double share);
void stage_forget(Stage* stage);
