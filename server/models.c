#include "server/models.h"

#include "messages/trig.h"

#include <string.h>

const Model models[MODEL_COUNT] = {
    [MODEL_SPRING] = {"spring", "each node on a spring to its rest place (thesis 4.4)", true, false,
                      1.0},
    // The beam's stiffness matrix k D^T D has eigenvalues up to 16 k, the chain's Laplacian up to 4
    // k.
    [MODEL_CASCADE] = {"cascade",
                       "springs in the joints push and push back (thesis 4.3, corrected)", true,
                       true, 16.0},
    [MODEL_FOREST] = {"forest", "links turn in sprung joints (thesis 4.2, corrected)", true, true,
                      4.0},
    [MODEL_PLAIN] = {"plain", "a chain that only hangs (Nalu)", false, false, 0.0},
};

ModelKind model_find(const char* name)
{
    int kind = 0;
    while (kind < MODEL_COUNT && strcmp(models[kind].name, name) != 0)
        ++kind;
    return (ModelKind)kind;
}

double model_stiffness_bound(const SimDefinition* d)
{
    double steps_hz = d->rate_hz * d->substeps, mode = models[d->model].stiffest_mode;
    double kept = trig_exp(-(double)d->damping_per_s / steps_hz);
    double passed = trig_exp(-(double)d->drag_per_s / steps_hz); // what a wind leaves (air.h)
    return mode > 0.0 ? 2.0 * (passed + kept) * steps_hz * steps_hz / mode : 1e30;
}

float model_stiffness(const SimDefinition* definition, float from_root_m)
{
    float reach = definition->fall_off_per_m * from_root_m;
    float stiffness = definition->stiffness_s2;
    for (int a = 0; a < definition->fall_off_power && reach > 1.0f; ++a)
        stiffness /= reach;
    return stiffness;
}
