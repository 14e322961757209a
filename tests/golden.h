// The golden pictures: scenes that are drawn as `hair-client --embedded` draws them, and what they
// looked like when somebody approved them (tests/golden, written by scripts/approve).
#pragma once

#include "client/draw.h"
#include "client/options.h"
#include "server/daemon.h"
#include "tests/compare.h"

// A scene is options of hair-client, so that whatever the program can draw can be a scene.
typedef struct GoldenScene {
    const char* name;
    const char* options; // with one --tick, and neither --embedded nor --out
} GoldenScene;

#define GOLDEN_MOST 32
extern const GoldenScene golden_scenes[];          // ended by a name that is NULL
const GoldenScene* golden_scene(const char* name); // NULL where there is none

// A scene up to its tick, ready to be drawn; tests change it before. Zero before the first.
typedef struct Golden {
    char words[512]; // of the scene's options, and where each begins
    char* argv[64];
    Options options;
    Gl* gl; // not owned
    Daemon* daemon;
    Receive* receive;
    GuidesView view;
    Drawing drawing;
    ShadeOptions made_for;
    bool can_draw;
    Image image;
} Golden;

// Parses the scene's options; wrong ones end the process, as those of hair-client do.
void golden_parse(Golden* golden, const GoldenScene* scene);
// Simulates to `options.first_tick` and makes everything that draws. False with a fault, which also
// names samples that the renderer has not. Close it in both cases.
bool golden_open(Golden* golden, Gl* gl, Fault* fault);
bool golden_draw(Golden* golden, Fault* fault); // into `image`, alpha made 255
// What is compiled stays for the next scene, which then has it as it was left.
void golden_close(Golden* golden);
void golden_free(Golden* golden);

// Everything of a renderer that decides about bits, as far as GL tells.
void golden_renderer(const Gl* gl, char* text, size_t size);

uint64_t golden_hash(const Image* image);

// How far a picture by another renderer may be from the approved one. Single pixels decide
// otherwise there, at edges of hair: Mesa's softpipe, which shares no rasteriser with llvmpipe, has
// FLIP up to 0.0026, RMSE up to 0.005, and 99 % of its pixels are the same. What test_golden breaks
// is beyond.
bool golden_is_within(const Comparison* comparison);
