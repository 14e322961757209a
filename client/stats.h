// Counters of a run as JSON, with the keys that design.md fixes.
#pragma once

#include "client/draw.h"

// Writes to `path` ("-": standard output). False with a fault where it cannot.
bool stats_write(const char* path, const Drawing* drawing, const GuidesView* view,
                 const ReceiveCounters* counters, double hair_pixels, Fault* fault);
