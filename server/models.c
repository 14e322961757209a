#include "server/models.h"

#include "messages/trig.h"

#include <string.h>

// Of springs to rest places, 1600 1/s^2 falling with the square of 16 L leaves 80 at the tip of a
// strand of 28 cm, twice what gravity gives a pendulum of that length, and 39 at 40 cm. A chain of
// joints is a rod, the same all along: 12,000 is Gamma = 7 at 28 cm, and five sixths of what the
// cascade is stable to at 240 steps a second. With the springs' values its tips buckled under their
// own weight and came back another way each time (tests/test_clips.c).
#define SPRINGS .stiffness_s2 = 1600.0f, .fall_off_power = 2
#define JOINTS  .stiffness_s2 = 12000.0f, .fall_off_power = 0

const Model models[MODEL_COUNT] = {
    [MODEL_SPRING] = {.name = "spring",
                      .help = "each node on a spring to its rest place (thesis 4.4)",
                      SPRINGS,
                      .has_shape = true,
                      .drops_gravity = true,
                      .stiffest_mode = 1.0},
    // The beam's stiffness matrix k D^T D has eigenvalues up to 16 k, the chain's Laplacian up to 4
    // k.
    [MODEL_CASCADE] = {.name = "cascade",
                       .help = "springs in the joints push and push back (thesis 4.3, corrected)",
                       JOINTS,
                       .length = LENGTH_DIRECT,
                       .has_shape = true,
                       .has_hinges = true,
                       .stiffest_mode = 16.0},
    [MODEL_FOREST] = {.name = "forest",
                      .help = "links turn in sprung joints (thesis 4.2, corrected)",
                      JOINTS,
                      .has_shape = true,
                      .has_hinges = true,
                      .stiffest_mode = 4.0},
    [MODEL_PLAIN] = {.name = "plain",
                     .help = "a chain that only hangs (Nalu)",
                     SPRINGS,
                     .length = LENGTH_DIRECT},
    // Up to 4 k for each of the two springs of a node.
    [MODEL_CASCADE_THESIS] = {.name = "cascade-thesis",
                              .help = "springs in the joints that nothing pushes back (thesis 4.3)",
                              SPRINGS,
                              .has_shape = true,
                              .drops_gravity = true,
                              .stiffest_mode = 8.0},
    [MODEL_FOREST_Z] = {.name = "forest-z",
                        .help = "two angles a joint, which lock (thesis 4.2)",
                        SPRINGS,
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

void model_use(SimDefinition* definition, ModelKind model)
{
    definition->model = model;
    definition->stiffness_s2 = models[model].stiffness_s2;
    definition->fall_off_power = models[model].fall_off_power;
    definition->length = models[model].length;
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

static bool is_within(const SimDefinition* d, const char* field, double value, double bound,
                      Fault* fault)
{
    return value <= bound ||
           fault_set(
               fault, "simulation: %s is %g; %s at %g Hz and %d substeps is stable to %.*f: %s",
               field, value, models[d->model].name, d->rate_hz, d->substeps, bound < 100 ? 3 : 0,
               bound,
               d->force ? "forced: strands will shake, and those that are lost go back to rest"
                        : "lower it, raise either, or --force it");
}

bool model_is_stable(const SimDefinition* d, Fault* fault)
{
    return is_within(d, "stiffness_s2", (double)d->stiffness_s2, model_stiffness_bound(d), fault) &&
           is_within(d, "joint_damping_per_s", (double)d->joint_damping_per_s,
                     model_joint_damping_bound(d), fault);
}

float model_stiffness(const SimDefinition* definition, float from_root_m)
{
    float reach = definition->fall_off_per_m * from_root_m;
    float stiffness = definition->stiffness_s2;
    for (int a = 0; a < definition->fall_off_power && reach > 1.0f; ++a)
        stiffness /= reach;
    return stiffness;
}
