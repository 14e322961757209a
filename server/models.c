#include "server/models.h"

#include "messages/trig.h"

#include <string.h>

const Model models[MODEL_COUNT] = {
    [MODEL_SPRING] = {.name = "spring",
                      .help = "each node on a spring to its rest place (thesis 4.4)",
                      .has_shape = true,
                      .drops_gravity = true,
                      .stiffest_mode = 1.0},
    // The beam's stiffness matrix k D^T D has eigenvalues up to 16 k, the chain's Laplacian up to 4
    // k.
    [MODEL_CASCADE] = {.name = "cascade",
                       .help = "springs in the joints push and push back (thesis 4.3, corrected)",
                       .has_shape = true,
                       .has_hinges = true,
                       .stiffest_mode = 16.0},
    [MODEL_FOREST] = {.name = "forest",
                      .help = "links turn in sprung joints (thesis 4.2, corrected)",
                      .has_shape = true,
                      .has_hinges = true,
                      .stiffest_mode = 4.0},
    [MODEL_PLAIN] = {.name = "plain", .help = "a chain that only hangs (Nalu)"},
    // Up to 4 k for each of the two springs of a node.
    [MODEL_CASCADE_THESIS] = {.name = "cascade-thesis",
                              .help = "springs in the joints that nothing pushes back (thesis 4.3)",
                              .has_shape = true,
                              .drops_gravity = true,
                              .stiffest_mode = 8.0},
    [MODEL_FOREST_Z] = {.name = "forest-z",
                        .help = "two angles a joint, which lock (thesis 4.2)",
                        .has_shape = true,
                        .drops_gravity = true,
                        .has_angles = true},
};

const char* const collide_names[COLLIDE_COUNT + 1] = {
    [COLLIDE_POINT] = "point", [COLLIDE_PEARL] = "pearl", [COLLIDE_SEGMENT] = "segment"};
const char* const length_names[LENGTH_COUNT + 1] = {
    [LENGTH_SWEEPS] = "sweeps", [LENGTH_DIRECT] = "direct"};

int choice_find(const char* const* names, const char* name)
{
    int i = 0;
    while (names[i] != NULL && strcmp(names[i], name) != 0)
        ++i;
    return i;
}

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
    if (models[d->model].has_angles) return (double)d->joint_damping_per_s * steps_hz;
    double kept = trig_exp(-(double)d->damping_per_s / steps_hz);
    double passed = trig_exp(-(double)d->drag_per_s / steps_hz); // what a wind leaves (air.h)
    return mode > 0.0 ? 2.0 * (passed + kept) * steps_hz * steps_hz / mode : 1e30;
}

double model_joint_damping_bound(const SimDefinition* d)
{
    return models[d->model].has_angles ? 0.5 * d->rate_hz * d->substeps : 1e30;
}

float model_stiffness(const SimDefinition* definition, float from_root_m)
{
    float reach = definition->fall_off_per_m * from_root_m;
    float stiffness = definition->stiffness_s2;
    for (int a = 0; a < definition->fall_off_power && reach > 1.0f; ++a)
        stiffness /= reach;
    return stiffness;
}
