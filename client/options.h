// The command line of hair-client.
#pragma once

#include "client/shade.h"

#define OPTIONS_MAX_STYLES 16

typedef struct Options {
    // Where hair comes from: the bus (url, NULL the default), a log, or a daemon in this process.
    const char* url;
    const char* log;
    bool embedded;
    const char* styles[OPTIONS_MAX_STYLES]; // embedded only, as are head, unit and motion
    int style_count;
    const char* head;
    const char* motion;
    double unit_m;
    // What is drawn, and how.
    int slot;
    const char* backend;
    ShadeOptions shade;
    bool has_marschner; // parameters of that shading
    CameraOptions camera;
    // Which ticks.
    bool has_ticks;
    int32_t first_tick, last_tick, tick_step; // every tick_step-th; 1 is all
    int64_t epoch;                            // of a log; 0: its only one
    int64_t frames;                           // 0: no end (bus), or all ticks (log)
    double timeout_s;                         // 0: wait for ever
    // What comes out.
    const char* out;
    const char* stats;
    bool quiet, verbose;
} Options;

// Parses or ends the process: 0 for --help and --version, 2 with one line for a wrong argument.
Options options_parse(int argc, char** argv);
