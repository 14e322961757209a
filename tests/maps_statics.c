// Failure maps H and J: where a strand comes to rest, by the daemon and by the models' laws.
#include "server/models.h"
#include "server/strands.h"
#include "tests/maps.h"

#include <math.h>
#include <string.h>

#define LINKS   7
#define LINK_M  (TRIAL_LENGTH_M / LINKS)
#define DEGREES (M_PI / 180.0)

// The law of a strand in a plane ---------------------------------------------------------------

// A clamped chain under gravity: angles of its links from straight down, hinges over the mass of a
// node, m^2/s^2, gravity times what hangs at each link's end, m/s^2. The cascade's joints have
// moments K sin(phi), the forest's K phi.
typedef struct Law {
    ModelKind model;
    double angle[LINKS + 1], hinge[LINKS + 1], load[LINKS + 1];
} Law;

static Law law_of(const SimDefinition* d)
{
    Law law = {.model = d->model};
    double outboard = 0.0;
    for (int n = LINKS; n >= 1; --n) {
        double k = (double)model_stiffness(d, (float)(LINK_M * (n - 1)));
        outboard += n == LINKS ? (double)d->tip_mass : 1.0;
        law.hinge[n] = (n == 1 ? 2.0 : 1.0) * k * LINK_M * LINK_M;
        law.load[n] = outboard * LINK_M; // times gravity
    }
    return law;
}

static double joint_moment(const Law* law, int n)
{
    double phi = law->angle[n] - law->angle[n - 1];
    return law->hinge[n] * (law->model == MODEL_CASCADE ? sin(phi) : phi);
}

static double joint_stiffness(const Law* law, int n)
{
    double phi = law->angle[n] - law->angle[n - 1];
    return law->hinge[n] * (law->model == MODEL_CASCADE ? cos(phi) : 1.0);
}

// Newton to the equilibrium next to the angles as they are, under `gravity`. False where there is
// none: the stiffness is no longer positive, and the strand snaps.
static bool law_settle(Law* law, double gravity)
{
    double step = 1.0;
    for (int pass = 0; pass < 50 && step > 1e-12; ++pass) {
        double pivot[LINKS + 2], right[LINKS + 2], turn = 0.0;
        for (int n = 1; n <= LINKS; ++n) {
            double outer = n < LINKS ? joint_moment(law, n + 1) : 0.0;
            double pull = gravity * law->load[n];
            right[n] = outer - joint_moment(law, n) - pull * sin(law->angle[n]);
            pivot[n] = joint_stiffness(law, n) + pull * cos(law->angle[n]) +
                       (n < LINKS ? joint_stiffness(law, n + 1) : 0.0);
            if (n == 1) continue;
            double part = joint_stiffness(law, n) / pivot[n - 1];
            pivot[n] -= part * joint_stiffness(law, n);
            right[n] += part * right[n - 1];
        }
        step = 0.0;
        for (int n = 1; n <= LINKS; ++n)
            if (!(pivot[n] > 0.0)) return false;
        for (int n = LINKS; n >= 1; --n) {
            double next = n < LINKS ? joint_stiffness(law, n + 1) * turn : 0.0;
            turn = (right[n] + next) / pivot[n];
            law->angle[n] += turn;
            step = fmax(step, fabs(turn));
        }
    }
    return step <= 1e-12;
}

static void law_turn(Law* law, double angle)
{
    for (int n = 0; n <= LINKS; ++n)
        law->angle[n] += angle;
}

// H ---------------------------------------------------------------------------------------------

// From where rest would be, in lengths of the strand; `tilt` is where it would point.
static double law_away(const Law* law, double tilt)
{
    double x = 0.0, y = 0.0, most = 0.0;
    for (int n = 1; n <= LINKS; ++n) {
        x += LINK_M * (sin(law->angle[n]) - sin(tilt));
        y += LINK_M * (cos(law->angle[n]) - cos(tilt));
        most = fmax(most, hypot(x, y));
    }
    return most / TRIAL_LENGTH_M;
}

static SimDefinition defaults(ModelKind model)
{
    SimDefinition d = sim_default();
    model_use(&d, model);
    d.strands = 1;
    d.nodes = LINKS + 1;
    return d;
}

// x is the tilt, degrees: within a second, and then nine of rest. The value is the largest distance
// of a node from its rest place, in lengths of the strand.
static Point tilt_at(const Panel* panel, double x, double y)
{
    SimDefinition d = defaults(panel->model);
    Trial trial;
    float rotation[9];
    double most = 0.0;
    trial_straight(&trial, LINKS, vec3(0, -1, 0));
    if (!trial_start(&trial, d)) return (Point){.panel = panel->name};
    for (int tick = 1; tick <= (int)(TRIAL_S * d.rate_hz); ++tick) {
        double t = fmin(tick / d.rate_hz, 1.0);
        trial_rotation(x * DEGREES * t * t * (3.0 - 2.0 * t), 2, rotation);
        trial_head(&trial, rotation, vec3(0, 0, 0));
        sim_step(trial.sim, trial.heads);
    }
    trial_read(&trial);
    for (int n = 0; n <= LINKS; ++n) {
        Vec3 off = vec3_sub(trial.now[n], rotate(rotation, trial.rest[n]));
        most = fmax(most, (double)vec3_length(off) / TRIAL_LENGTH_M);
    }
    bool is_lost = sim_quarantined(trial.sim) > 0 || !isfinite(most);
    trial_end(&trial);
    return (Point){panel->name, x, y, is_lost ? "lost" : most > TRIAL_AWAY ? "away" : "calm", most};
}

// Turned by a degree at a time, so that the equilibrium is the one that the strand comes to.
static void add_law(Points* points, const Panel* panel, int first)
{
    SimDefinition d = defaults(panel->model);
    Law law = law_of(&d);
    bool is_there = true;
    for (int degrees = 1; degrees <= 180 && is_there; ++degrees) {
        law_turn(&law, DEGREES);
        is_there = law_settle(&law, TRIAL_GRAVITY);
        double away = law_away(&law, degrees * DEGREES);
        if (!is_there || degrees % 5 != 0) continue;
        points_add(points, (Point){panel->name, degrees, 0, "law", away});
        for (int i = first; i < points->count; ++i) {
            const Point* p = &points->all[i];
            if (fabs(p->x - degrees) < 1e-6 && strcmp(p->class, "law") != 0)
                points_judge(points, panel->name, "rest", p->value, away, false);
        }
    }
}

void map_tilt(Points* points)
{
    static const ModelKind kinds[] = {MODEL_SPRING, MODEL_CASCADE, MODEL_FOREST};
    for (int i = 0; i < 3; ++i) {
        int first = points->count;
        Panel panel = {.name = models[kinds[i]].name,
                       .model = kinds[i],
                       .x = {-2.5, 182.5, 37, false},
                       .y = {-0.5, 0.5, 1, false},
                       .measure = tilt_at};
        panel_measure(&panel, points);
        if (kinds[i] != MODEL_SPRING) add_law(points, &panel, first);
        for (int k = first; k < points->count && kinds[i] == MODEL_SPRING; ++k)
            points_judge(points, panel.name, "rest", points->all[k].value, 0.0, false);
    }
}

// J ---------------------------------------------------------------------------------------------

#define LOAD_S   6.0 // gravity comes in so slowly that nothing swings
#define SETTLE_S 4.0

// With half a node's mass at the tip, k of the hinge chain that has this Gamma, and steps half as
// long as its bound allows: float resolves no force over a shorter one.
static SimDefinition hinged(ModelKind model, double gamma)
{
    SimDefinition d = trial_bare(model, LINKS);
    d.stiffness_s2 = (float)(TRIAL_GRAVITY / TRIAL_LENGTH_M * pow(LINKS, 4) / gamma);
    d.tip_mass = 0.5f;
    d.damping_per_s = 25;
    d.iterations = 32;
    d.substeps = 4;
    while (2.0 * (double)d.stiffness_s2 > model_stiffness_bound(&d))
        d.substeps += 4;
    return d;
}

static bool load(Trial* trial, const SimDefinition* d)
{
    SimDefinition tuned = *d;
    Fault fault;
    int ticks = (int)(LOAD_S * d->rate_hz);
    for (int tick = 1; tick <= ticks; ++tick) {
        tuned.gravity_m_s2 = (float)(TRIAL_GRAVITY * tick / ticks);
        if (!sim_tune(trial->sim, &tuned, &fault)) return false;
        sim_step(trial->sim, trial->heads);
    }
    trial_run(trial, SETTLE_S);
    return true;
}

// The largest bend of a joint, degrees; the root's is against `way`.
static double largest_bend(const Trial* trial, Vec3 way)
{
    double most = 0.0;
    for (int n = 1; n <= trial->links; ++n) {
        Vec3 link = vec3_sub(trial->now[n], trial->now[n - 1]);
        most = fmax(most, trial_degrees(way, link));
        way = link;
    }
    return most;
}

// x is Gamma, y where the root points, degrees from straight down. The value is the largest bend of
// a joint, degrees.
static Point fold_at(const Panel* panel, double x, double y)
{
    SimDefinition d = hinged(panel->model, x);
    Trial trial;
    Vec3 way = vec3((float)sin(y * DEGREES), (float)-cos(y * DEGREES), 0);
    trial_straight(&trial, LINKS, way);
    if (!trial_start(&trial, d)) return (Point){.panel = panel->name};
    bool is_loaded = load(&trial, &d), is_lost = sim_quarantined(trial.sim) > 0;
    double bend = largest_bend(&trial, way);
    trial_end(&trial);
    if (!is_loaded) return (Point){.panel = panel->name};
    const char* class = is_lost || !isfinite(bend) ? "lost" : bend > 90.0 ? "fold" : "calm";
    return (Point){panel->name, x, y, class, bend};
}

static double law_bend(const Law* law)
{
    double most = 0.0;
    for (int n = 1; n <= LINKS; ++n)
        most = fmax(most, fabs(law->angle[n] - law->angle[n - 1]));
    return most;
}

// Does the law have an equilibrium all the way to this Gamma, and no joint beyond its largest
// moment, k d^2 at 90 degrees?
static bool stands(double gamma, double root)
{
    SimDefinition d = hinged(MODEL_CASCADE, gamma);
    Law law = law_of(&d);
    bool is_there = true;
    law_turn(&law, root);
    for (int part = 1; part <= 400 && is_there; ++part)
        is_there = law_settle(&law, TRIAL_GRAVITY * part / 400.0) && law_bend(&law) < 0.5 * M_PI;
    return is_there;
}

static double fold_edge(const Panel* panel, double x, double y)
{
    double low = panel->x.low, high = panel->x.high;
    (void)x;
    if (!stands(low, y * DEGREES) || stands(high, y * DEGREES)) return (double)NAN;
    for (int pass = 0; pass < 24; ++pass) {
        double middle = sqrt(low * high);
        *(stands(middle, y * DEGREES) ? &low : &high) = middle;
    }
    return low;
}

void map_fold(Points* points)
{
    static const ModelKind kinds[] = {MODEL_CASCADE, MODEL_FOREST};
    for (int i = 0; i < 2; ++i)
        panel_measure(&(Panel){.name = models[kinds[i]].name,
                               .model = kinds[i],
                               .x = {1, 1000, 36, true},
                               .y = {0, 180, 30, false},
                               .measure = fold_at,
                               .derived = kinds[i] == MODEL_CASCADE ? fold_edge : NULL,
                               .is_first_edge_alone = true},
                      points);
}
