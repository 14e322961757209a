// Whether a model keeps its own energy where nothing damps it.
#pragma once

#include "server/sim.h"

// A strand that hangs straight is kicked sideways and left alone; the slope of its energy over some
// seconds, per second, against what it has above rest. NaN for the models as printed, which have
// none to keep. `lost` counts how often the strand was put back to rest.
bool energy_drift(SimDefinition definition, double* drift_per_s, int64_t* lost, Fault* fault);
