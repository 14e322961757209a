// Failure maps D and I: where a joint does not answer, and where a frame turns over.
#include "server/models.h"
#include "server/strands.h"
#include "tests/maps.h"

#include <math.h>

#define DEGREES (M_PI / 180.0)

// D ---------------------------------------------------------------------------------------------

// How far the last of two links, bent from the first by `bend` at rest, turns along `azimuth` of a
// push across it within 1/60 s, when nothing holds it. 0 is in the plane of the bend.
static bool pushed(ModelKind model, double bend, double azimuth, double* turned)
{
    SimDefinition d = trial_bare(model, 2);
    Trial trial = {.links = 2};
    float link = (float)(TRIAL_LENGTH_M / 2), s = (float)sin(bend), c = (float)cos(bend);
    Vec3 way = vec3(s, -c, 0), push = vec3_scale(vec3(c, s, 0), (float)cos(azimuth));
    d.substeps = TRIAL_SUBSTEPS;
    d.stiffness_s2 = 0;
    d.joint_damping_per_s = 0;
    push.z = (float)sin(azimuth);
    trial.rest[1] = vec3(0, -link, 0);
    trial.rest[2] = vec3_mad(trial.rest[1], way, link);
    if (!trial_start(&trial, d)) return false;
    double dt = 1.0 / (d.rate_hz * d.substeps);
    float rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    trial_head(&trial, rotation, vec3_scale(push, (float)(-TRIAL_GRAVITY * dt * dt)));
    trial_run(&trial, 1.0 / d.rate_hz);
    Vec3 last = vec3_scale(vec3_sub(trial.now[2], trial.now[1]), 1.0f / link);
    *turned = (double)vec3_dot(vec3_sub(last, way), push);
    trial_end(&trial);
    return true;
}

// x is the rest angle of a joint, y the azimuth of the push, degrees.
static Point azimuth_at(const Panel* panel, double x, double y)
{
    double got, wanted;
    if (!pushed(panel->model, x * DEGREES, y * DEGREES, &got) ||
        !pushed(MODEL_FOREST, 0.0, 0.0, &wanted))
        return (Point){.panel = panel->name};
    double ratio = got / wanted;
    return (Point){panel->name, x, y, ratio < TRIAL_STIFF ? "stiff" : "calm", ratio};
}

void map_azimuth(Points* points)
{
    static const ModelKind kinds[] = {MODEL_FOREST_Z, MODEL_FOREST};
    for (int i = 0; i < 2; ++i) {
        int first = points->count;
        panel_measure(&(Panel){.name = models[kinds[i]].name,
                               .model = kinds[i],
                               .x = {0, 180, 30, false},
                               .y = {0, 180, 30, false},
                               .measure = azimuth_at},
                      points);
        for (int k = first; k < points->count; ++k) {
            const Point* p = &points->all[k];
            double s = sin(p->x * DEGREES) * sin(p->y * DEGREES), c = cos(p->y * DEGREES);
            double wanted = kinds[i] == MODEL_FOREST ? 1.0 : c * c + s * s;
            points_judge(points, p->panel, "response", p->value, wanted, false);
        }
    }
}

// I ---------------------------------------------------------------------------------------------

// The second link bent by `bend` from the first, towards the axis that the frame carries (azimuth
// 0) or across it. Three links; at rest the third stands along the carried axis, so that where it
// is predicted is that axis.
static bool bent(Trial* trial, ModelKind model, double bend, double azimuth, Vec3* way)
{
    float link = (float)(TRIAL_LENGTH_M / 3), s = (float)sin(bend), c = (float)cos(bend);
    *trial = (Trial){.links = 3};
    *way = vec3(s * (float)cos(azimuth), -c, s * (float)sin(azimuth));
    for (int n = 1; n <= 3; ++n)
        trial->rest[n] = vec3_mad(trial->rest[n - 1], n < 3 ? vec3(0, -1, 0) : vec3(1, 0, 0), link);
    if (!trial_start(trial, trial_bare(model, 3))) return false;
    Block* block = &trial->sim->blocks[0];
    for (int n = 2; n <= 3; ++n)
        for (int l = 0; l < LANES; ++l) {
            Vec3 place = vec3_mad(trial->rest[1], *way, (float)(n - 1) * link);
            lane_set(&block->position[n], l, place);
            lane_set(&block->previous[n], l, place);
        }
    sim_step(trial->sim, trial->heads);
    return true;
}

// `axis` carried from straight down to `way` by the least rotation.
static Vec3 transported(Vec3 axis, Vec3 way)
{
    Vec3 down = vec3(0, -1, 0);
    return vec3_mad(axis, vec3_add(down, way), -vec3_dot(axis, way) / (1.0f + vec3_dot(down, way)));
}

// x is the bend, y its azimuth, degrees; the value is how far the frame is twisted about the link
// against parallel transport, degrees. The printed T and B change sign at every link even where it
// is straight; that is taken off here.
static Point frames_at(const Panel* panel, double x, double y)
{
    Trial trial;
    Vec3 way, wanted, got;
    bool is_printed = panel->model == MODEL_CASCADE_THESIS;
    if (!bent(&trial, panel->model, x * DEGREES, y * DEGREES, &way))
        return (Point){.panel = panel->name};
    const Block* block = &trial.sim->blocks[0];
    wanted = transported(is_printed ? vec3(0, 0, 1) : vec3(1, 0, 0), way);
    got = lane_get(&block->predicted[is_printed ? 2 : 3], 0);
    if (is_printed) got = vec3_scale(got, -1.0f);
    trial_end(&trial);
    double twist = trial_degrees(got, wanted);
    return (Point){panel->name, x, y, twist > 90.0 ? "flip" : "calm", twist};
}

// |B|: what is left of an offset across the link.
static Point shrink_at(const Panel* panel, double x, double y)
{
    Trial trial;
    Vec3 way;
    if (!bent(&trial, panel->model, x * DEGREES, y * DEGREES, &way))
        return (Point){.panel = panel->name};
    double length = (double)vec3_length(lane_get(&trial.sim->blocks[0].predicted[2], 0));
    trial_end(&trial);
    return (Point){panel->name, x, y, length < TRIAL_STIFF ? "stiff" : "calm", length};
}

// cos(bend) = -tan(azimuth)^2
static double flip_edge(const Panel* panel, double x, double y)
{
    double t = tan(y * DEGREES);
    (void)panel;
    (void)x;
    return t < 1.0 ? acos(-t * t) / DEGREES : (double)NAN;
}

void map_frames(Points* points)
{
    Panel panel = {.name = models[MODEL_CASCADE_THESIS].name,
                   .model = MODEL_CASCADE_THESIS,
                   .x = {0, 180, 30, false},
                   .y = {0, 90, 30, false},
                   .measure = frames_at,
                   .derived = flip_edge};
    panel_measure(&panel, points);
    panel.name = "cascade-thesis/length";
    panel.measure = shrink_at;
    panel.derived = NULL;
    int first = points->count;
    panel_measure(&panel, points);
    for (int i = first; i < points->count; ++i) {
        const Point* p = &points->all[i];
        double along = sin(p->x * DEGREES) * cos(p->y * DEGREES);
        points_judge(points, panel.name, "length", p->value, sqrt(1.0 - along * along), false);
    }
    panel.name = models[MODEL_CASCADE].name;
    panel.model = MODEL_CASCADE;
    panel.measure = frames_at;
    first = points->count;
    panel_measure(&panel, points);
    for (int i = first; i < points->count; ++i)
        points_judge(points, panel.name, "degrees", points->all[i].value, 0.0, false);
}
