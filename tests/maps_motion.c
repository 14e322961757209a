// Failure maps E, F and K: where lengths, the head and the sphere under the hair are not kept.
#include "server/models.h"
#include "tests/maps.h"

#include <math.h>
#include <string.h>

#define LINKS  7
#define LINK_M (TRIAL_LENGTH_M / LINKS)

// E ---------------------------------------------------------------------------------------------

// x is the number of sweeps, y is dt: the longest link of a chain that hangs.
static Point hanging_at(const Panel* panel, double x, double y)
{
    SimDefinition d = trial_bare(MODEL_PLAIN, LINKS);
    Trial trial;
    d.rate_hz = 1.0 / y;
    d.iterations = (int)lround(x);
    d.gravity_m_s2 = (float)TRIAL_GRAVITY;
    d.damping_per_s = 5;
    trial_straight(&trial, LINKS, vec3(0, -1, 0));
    if (!trial_start(&trial, d)) return (Point){.panel = panel->name};
    trial_run(&trial, TRIAL_S);
    double stretch = trial_stretch(&trial);
    trial_end(&trial);
    return (Point){panel->name, x, y, stretch > TRIAL_STRETCH ? "stretched" : "calm", stretch};
}

void map_iterations(Points* points)
{
    double half = sqrt(2.0); // bins about 1, 2, 4 ... 64
    panel_measure(&(Panel){.name = "plain",
                           .x = {1.0 / half, 64.0 * half, 7, true},
                           .y = {1e-3, 0.05, 26, true},
                           .measure = hanging_at},
                  points);
    for (int i = 0; i < points->count; ++i) {
        const Point* point = &points->all[i];
        double wanted = (LINKS - 1) * TRIAL_GRAVITY * point->y * point->y / LINK_M;
        if (lround(point->x) == 1)
            points_judge(points, "plain", "one sweep", point->value, wanted, true);
    }
}

// F ---------------------------------------------------------------------------------------------

#define SCALP_M 0.09 // from the axis to the root

// Smooth to full speed within the first second: what has been turned through by then.
static double turned_through(double rate, double t)
{
    return t >= 1.0 ? rate * (t - 0.5) : rate * t * t * t * (1.0 - 0.5 * t);
}

// A tick, with the head where it is at `t`; the strand in head space.
static void spin_to(Trial* trial, double rate, double t, Vec3* in_head)
{
    float rotation[9];
    trial_rotation(turned_through(rate, t), 1, rotation);
    trial_head(trial, rotation, vec3(0, 0, 0));
    sim_step(trial->sim, trial->heads);
    sim_positions(trial->sim, rotation, false, in_head);
}

// What the nodes of a strand have gone through in head space.
typedef struct Path {
    Vec3 first[LINKS + 1], last[LINKS + 1];
    double length[LINKS + 1];
} Path;

static void path_add(Path* path, const Vec3* now, bool is_first)
{
    for (int n = 0; n <= LINKS; ++n) {
        if (is_first) path->first[n] = path->last[n] = now[n];
        path->length[n] += (double)vec3_length(vec3_sub(now[n], path->last[n]));
        path->last[n] = now[n];
    }
}

// How much longer a node's way was than the straight one: to and fro, not slowly to where it stays.
static double path_detour(const Path* path)
{
    double most = 0.0;
    for (int n = 0; n <= LINKS; ++n) {
        double straight = (double)vec3_length(vec3_sub(path->last[n], path->first[n]));
        most = fmax(most, path->length[n] - straight);
    }
    return most;
}

static SimDefinition spun(ModelKind model, double dt)
{
    SimDefinition d = sim_default();
    model_use(&d, model);
    d.strands = 1;
    d.nodes = LINKS + 1;
    d.rate_hz = 1.0 / dt;
    d.substeps = 1;
    d.force = true;
    return d;
}

// x is the head's rate, y is dt: the longest link of a strand that stands off the head as it spins,
// with everything else as its model has it by default. Flutter is a detour of 1 % in the last 2 s.
static Point spin_at(const Panel* panel, double x, double y)
{
    Trial trial;
    Path path = {.length = {0}};
    Vec3 now[LINKS + 1];
    double stretch = 0.0;
    trial_straight(&trial, LINKS, vec3(1, 0, 0));
    for (int n = 0; n <= LINKS; ++n)
        trial.rest[n].x += (float)SCALP_M;
    if (!trial_start(&trial, spun(panel->model, y))) return (Point){.panel = panel->name};
    int ticks = (int)lround(TRIAL_S / y), window = (int)lround(TRIAL_WINDOW_S / y);
    for (int tick = 1; tick <= ticks; ++tick) {
        spin_to(&trial, x, tick * y, now);
        if (tick <= ticks - window) continue;
        trial_read(&trial);
        stretch = fmax(stretch, trial_stretch(&trial));
        path_add(&path, now, tick == ticks - window + 1);
    }
    bool is_lost = sim_quarantined(trial.sim) > 0 || !isfinite(stretch);
    bool is_fluttering = path_detour(&path) > TRIAL_AWAY * TRIAL_LENGTH_M;
    trial_end(&trial);
    const char* class = stretch > TRIAL_STRETCH ? "stretched" : "calm";
    class = is_lost ? "lost" : is_fluttering ? "flutter" : class;
    return (Point){panel->name, x, y, class, stretch};
}

// The rate at which a chain's first link is longer by a tenth: (rate dt)^2 times the sum of radii
// over the length of a link, of the nodes beyond it. The spring's own springs hold some of it.
static double spin_edge(const Panel* panel, double x, double y)
{
    double radii = 0.0;
    (void)panel;
    (void)x;
    for (int n = 2; n <= LINKS; ++n)
        radii += SCALP_M + n * LINK_M;
    return sqrt(TRIAL_STRETCH * LINK_M / radii) / y;
}

void map_spin(Points* points)
{
    static const ModelKind kinds[] = {MODEL_SPRING, MODEL_CASCADE, MODEL_FOREST};
    for (int i = 0; i < 3; ++i)
        panel_measure(&(Panel){.name = models[kinds[i]].name,
                               .model = kinds[i],
                               .x = {1, 100, 32, true},
                               .y = {1e-3, 0.05, 28, true},
                               .measure = spin_at,
                               .derived = kinds[i] == MODEL_SPRING ? spin_edge : NULL,
                               .is_first_edge_alone = true,
                               .is_edge_of_stretch = true},
                      points);
}

// K ---------------------------------------------------------------------------------------------

#define CUT     1e-3 // of the sphere's radius: a link is inside
#define DRAPE_S 2.0
#define SWEEP_S 6.0
#define SWEEP   1.05 // radians to each side
#define SWEEPS  16   // of length correction, so that a link is as long as it is

// From the origin to the link between a and b.
static double link_distance(Vec3 a, Vec3 b)
{
    Vec3 ab = vec3_sub(b, a);
    float t = -vec3_dot(a, ab) / fmaxf(vec3_dot(ab, ab), 1e-12f);
    t = fminf(fmaxf(t, 0.0f), 1.0f);
    return (double)vec3_length(vec3_mad(a, ab, t));
}

static double nearest_link(const Trial* trial)
{
    double least = 1e30;
    for (int n = 1; n <= trial->links; ++n)
        least = fmin(least, link_distance(trial->now[n - 1], trial->now[n]));
    return least;
}

// A plain chain laid over a sphere, which then rolls under it. x is the length of a link and y the
// radius of a pearl, both in radii of the sphere; the value is how deep a link comes, in the same.
static Point swept_at(const Panel* panel, double x, double y)
{
    double radius = LINK_M / x, pearl = y * radius, least = 1e30;
    Collider sphere = collider_sphere((Sphere){{0, 0, 0}, (float)radius});
    SimDefinition d = trial_bare(MODEL_PLAIN, LINKS);
    Trial trial;
    d.substeps = 4;
    d.iterations = SWEEPS;
    d.gravity_m_s2 = (float)TRIAL_GRAVITY;
    d.damping_per_s = 8;
    d.colliders = &sphere;
    d.collider_count = 1;
    d.collide = panel->collide;
    d.pearl_radius_m = (float)pearl;
    trial_straight(&trial, LINKS, vec3(1, 0, 0));
    for (int n = 0; n <= LINKS; ++n)
        trial.rest[n].y += (float)(radius + pearl);
    if (!trial_start(&trial, d)) return (Point){.panel = panel->name};
    int ticks = (int)lround((DRAPE_S + SWEEP_S) * d.rate_hz);
    for (int tick = 0; tick < ticks; ++tick) {
        for (int s = 0; s < d.substeps; ++s) {
            double t = (tick + (s + 1.0) / d.substeps) / d.rate_hz - DRAPE_S;
            double angle = t > 0.0 ? SWEEP * sin(2.0 * M_PI * 0.5 * t) : 0.0;
            trial_rotation(angle, 2, trial.heads[s].rotation);
        }
        sim_step(trial.sim, trial.heads);
        trial_read(&trial);
        least = fmin(least, nearest_link(&trial));
    }
    bool is_lost = sim_quarantined(trial.sim) > 0;
    trial_end(&trial);
    double depth = fmax(1.0 - least / radius, 0.0);
    return (Point){panel->name, x, y, is_lost ? "lost" : depth > CUT ? "cut" : "calm", depth};
}

// A link that lies with both ends on the sphere of the pearls' middles is the deepest.
static double chord_edge(const Panel* panel, double x, double y)
{
    (void)panel;
    (void)x;
    return 2.0 * sqrt((1.0 + y) * (1.0 + y) - (1.0 - CUT) * (1.0 - CUT));
}

void map_colliders(Points* points)
{
    Panel panel = {.name = "pearl",
                   .collide = COLLIDE_PEARL,
                   .x = {0.05, 2, 32, true},
                   .y = {0, 0.4, 32, false},
                   .measure = swept_at,
                   .derived = chord_edge,
                   .is_first_edge_alone = true};
    panel_measure(&panel, points);
    panel.name = "segment";
    panel.collide = COLLIDE_SEGMENT;
    panel.derived = NULL; // only long, thin links cut at all
    panel_measure(&panel, points);
    panel.name = "point"; // a pearl of no radius
    panel.collide = COLLIDE_PEARL;
    panel.y = (Scale){-0.5, 0.5, 1, false};
    panel.derived = NULL;
    int first = points->count;
    panel_measure(&panel, points);
    for (int i = first; i < points->count; ++i) {
        const Point* point = &points->all[i];
        double wanted = 1.0 - sqrt(1.0 - 0.25 * point->x * point->x);
        if (point->x < 1.0) // a longer one may lie across the sphere as well as on it
            points_judge(points, "point", "depth, links to a radius", point->value, wanted, true);
    }
}
