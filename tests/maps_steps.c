// Failure maps A, B, C and G: where a step is too long, by stiffness, damping and nodes.
#include "server/models.h"
#include "tests/maps.h"
#include "tests/modes.h"

#include <math.h>
#include <string.h>

#define RATE_HZ 60.0
#define STEP2   (RATE_HZ * RATE_HZ) // k dt^2 times this is k
#define LINKS   7
#define SWEEPS  8    // of map B
#define KEPT    0.97 // of velocity after a step, where it is not the axis

static Point kicked(const Panel* panel, SimDefinition d, int links, double x, double y)
{
    Trial trial;
    trial_straight(&trial, links, vec3(0, -1, 0));
    if (!trial_start(&trial, d)) return (Point){.panel = panel->name};
    trial_kick(&trial);
    Watch watch = trial_watch(&trial);
    trial_end(&trial);
    return (Point){panel->name, x, y, watch_class(&watch), watch.away};
}

// A ---------------------------------------------------------------------------------------------

// x is the k dt^2 / m that the model's row in the table of bounds makes of it: of the stiffest
// mode of a long strand. y is c.
static Point verlet_at(const Panel* panel, double x, double y)
{
    SimDefinition d = trial_bare(panel->model, LINKS);
    d.stiffness_s2 = (float)(x * STEP2 / models[panel->model].stiffest_mode);
    d.damping_per_s = trial_damping(y);
    return kicked(panel, d, LINKS, x, y);
}

static double verlet_edge(const Panel* panel, double x, double y)
{
    (void)x;
    return 2.0 * (1.0 + y) * models[panel->model].stiffest_mode /
           modes_stiffest(panel->model, LINKS, NULL);
}

// A cascade that hangs straight, linearised across: a = -A y, nodes 1 ... N, and what a step's
// sweeps of length correction carry through link n, in parts of a link.
typedef struct Linear {
    double a[LINKS + 1][LINKS + 1]; // [node][node], node 0 the root; 1/s^2
    double carried[LINKS + 1];
} Linear;

// `k` is of joint 0 ... N - 1: space n draws node n + 1 to 2 y[n] - y[n-1], and a part `down` of it
// node n - 2 to 2 y[n-1] - y[n].
static void printed_rows(Linear* linear, const double* k, double down)
{
    linear->a[1][1] += k[0];
    for (int n = 1; n < LINKS; ++n) {
        linear->a[n + 1][n + 1] += k[n];
        linear->a[n + 1][n] -= 2.0 * k[n];
        linear->a[n + 1][n - 1] += k[n];
    }
    for (int n = 3; n <= LINKS; ++n) {
        linear->a[n - 2][n - 2] += down * k[n - 1];
        linear->a[n - 2][n - 1] -= 2.0 * down * k[n - 1];
        linear->a[n - 2][n] += down * k[n - 1];
    }
}

// D^T S D (modes.h).
static void mended_rows(Linear* linear, const double* k)
{
    for (int joint = 0; joint < LINKS; ++joint)
        for (int i = 0; i < LINKS; ++i)
            for (int j = 0; j < LINKS; ++j)
                linear->a[i + 1][j + 1] += (joint == 0 ? 2.0 : 1.0) * k[joint] *
                                           modes_joint(MODEL_CASCADE, joint, i) *
                                           modes_joint(MODEL_CASCADE, joint, j);
}

// A sweep turns a link's share of the tension with the link: a force that sees the step's own
// end. It is therefore no stiffness to be added to A, and steadies what A makes zigzag.
static void sweep(const Linear* linear, double* y)
{
    for (int n = 1; n <= LINKS; ++n) {
        double before = n > 1 ? y[n - 1] : 0.0;
        double turned = linear->carried[n] / SWEEPS * (y[n] - before);
        y[n] -= turned;
        if (n > 1) y[n - 1] += turned;
    }
}

// y' = S (y + c (y - y_prev) - A y dt^2)
static void linear_step(const Linear* linear, double* y, double* previous)
{
    double next[LINKS + 1] = {0};
    for (int i = 1; i <= LINKS; ++i) {
        double force = 0.0;
        for (int j = 1; j <= LINKS; ++j)
            force += linear->a[i][j] * y[j];
        next[i] = y[i] + KEPT * (y[i] - previous[i]) - force / STEP2;
    }
    for (int i = 0; i < SWEEPS; ++i)
        sweep(linear, next);
    memcpy(previous, y, (LINKS + 1) * sizeof *y);
    memcpy(y, next, (LINKS + 1) * sizeof *y);
}

#define STATES (2 * LINKS)

static double square(double m[STATES][STATES])
{
    static _Thread_local double product[STATES][STATES];
    double most = 0.0;
    for (int i = 0; i < STATES; ++i)
        for (int j = 0; j < STATES; ++j) {
            double sum = 0.0;
            for (int k = 0; k < STATES; ++k)
                sum += m[i][k] * m[k][j];
            product[i][j] = sum;
            most = fmax(most, fabs(sum));
        }
    for (int i = 0; i < STATES; ++i)
        for (int j = 0; j < STATES; ++j)
            m[i][j] = product[i][j] / most;
    return most;
}

// The logarithm of what a step makes of the motion that grows most, by 2^24 steps.
static double growth(const Linear* linear)
{
    double m[STATES][STATES] = {{0}}, logarithm = 0.0;
    for (int j = 0; j < STATES; ++j) {
        double y[LINKS + 1] = {0}, previous[LINKS + 1] = {0};
        *(j < LINKS ? &y[j + 1] : &previous[j - LINKS + 1]) = 1.0;
        linear_step(linear, y, previous);
        for (int i = 0; i < LINKS; ++i) {
            m[i][j] = y[i + 1];
            m[LINKS + i][j] = previous[i + 1];
        }
    }
    for (int pass = 0; pass < 24; ++pass)
        logarithm = 2.0 * logarithm + log(square(m));
    return logarithm / (1 << 24);
}

// B ---------------------------------------------------------------------------------------------

// As stiffness falls along the strand, where joint 1 has k: joint i at i links from the root.
static void shares_of(int fall_off, double* share)
{
    SimDefinition d = sim_default();
    d.stiffness_s2 = 1;
    d.fall_off_per_m = TRIAL_FALL_OFF;
    d.fall_off_power = fall_off;
    for (int i = 0; i < LINKS; ++i)
        share[i] = (double)model_stiffness(&d, (float)(TRIAL_LENGTH_M * i / LINKS));
}

// x is k dt^2 / m, y the downward springs' share.
static Point cascade_at(const Panel* panel, double x, double y)
{
    SimDefinition d = trial_bare(panel->model, LINKS);
    d.stiffness_s2 = (float)(x * STEP2);
    d.damping_per_s = trial_damping(KEPT);
    d.down_share = (float)y;
    d.iterations = SWEEPS;
    d.fall_off_power = panel->fall_off;
    // Compensation leaves gravity out as printed. The corrected cascade's joints would carry it,
    // which is nothing where the strand hangs straight: it goes without.
    bool is_felt = panel->has_gravity || panel->model == MODEL_CASCADE_THESIS;
    d.gravity_m_s2 = is_felt ? (float)TRIAL_GRAVITY : 0.0f;
    d.gravity_compensation = !panel->has_gravity;
    return kicked(panel, d, LINKS, x, y);
}

static bool grows(const Panel* panel, double x, double y)
{
    double k[LINKS];
    Linear linear = {0};
    shares_of(panel->fall_off, k);
    for (int i = 0; i < LINKS; ++i)
        k[i] *= x * STEP2;
    if (panel->model == MODEL_CASCADE)
        mended_rows(&linear, k);
    else
        printed_rows(&linear, k, y);
    for (int n = 1; n <= LINKS && panel->has_gravity; ++n)
        linear.carried[n] = (LINKS + 1 - n) * TRIAL_GRAVITY * LINKS / (TRIAL_LENGTH_M * STEP2);
    return growth(&linear) > 1e-6;
}

// Where the linear strand begins to grow.
static double linear_edge(const Panel* panel, double x, double y)
{
    double low = -1.0, high = 0.0;
    (void)x;
    while (high < panel->x.count && !grows(panel, axis_at(&panel->x, high), y))
        low = high++;
    if (low < 0.0 || high >= panel->x.count) return (double)NAN;
    for (int pass = 0; pass < 10; ++pass) {
        double middle = 0.5 * (low + high);
        *(grows(panel, axis_at(&panel->x, middle), y) ? &high : &low) = middle;
    }
    return axis_at(&panel->x, high);
}

// C ---------------------------------------------------------------------------------------------

// x is k dt^2 / J, y is v dt / J of the joints (forest-z) or of all velocity, 1 - c (forest).
static Point forest_at(const Panel* panel, double x, double y)
{
    SimDefinition d = trial_bare(panel->model, LINKS);
    d.stiffness_s2 = (float)(x * STEP2);
    d.joint_damping_per_s = (float)(y * RATE_HZ);
    if (panel->model == MODEL_FOREST) d.damping_per_s = trial_damping(1.0 - y);
    return kicked(panel, d, LINKS, x, y);
}

// Forward Euler: above v and, for much damping, below what the stiffest mode needs.
static double euler_edge(const Panel* panel, double x, double y)
{
    (void)panel;
    double least = 2.0 * (y - 2.0 / modes_laplacian(LINKS, LINKS));
    return fabs(x - y) < fabs(x - least) ? y : least;
}

static double symplectic_edge(const Panel* panel, double x, double y)
{
    (void)x;
    return 2.0 * (2.0 - y) / modes_stiffest(panel->model, LINKS, NULL);
}

// G ---------------------------------------------------------------------------------------------

// x as in A, y is the number of nodes.
static Point nodes_at(const Panel* panel, double x, double y)
{
    int links = (int)lround(y) - 1;
    SimDefinition d = trial_bare(panel->model, links);
    d.stiffness_s2 = (float)(x * STEP2);
    d.damping_per_s = trial_damping(KEPT);
    return kicked(panel, d, links, x, y);
}

static double nodes_edge(const Panel* panel, double x, double y)
{
    (void)x;
    return 2.0 * (1.0 + KEPT) / modes_stiffest(panel->model, (int)lround(y) - 1, NULL);
}

// x is the number of nodes, y that of sweeps: the longest link of a chain that hangs, at 240 Hz.
static Point hanging_at(const Panel* panel, double x, double y)
{
    int links = (int)lround(x) - 1;
    SimDefinition d = trial_bare(MODEL_PLAIN, links);
    Trial trial;
    d.rate_hz = 240;
    d.gravity_m_s2 = (float)TRIAL_GRAVITY;
    d.damping_per_s = 8;
    d.iterations = (int)lround(y);
    trial_straight(&trial, links, vec3(0, -1, 0));
    if (!trial_start(&trial, d)) return (Point){.panel = panel->name};
    trial_run(&trial, TRIAL_S);
    double stretch = trial_stretch(&trial);
    trial_end(&trial);
    return (Point){panel->name, x, y, stretch > TRIAL_STRETCH ? "stretched" : "calm", stretch};
}

// The maps --------------------------------------------------------------------------------------

void map_verlet(Points* points)
{
    static const ModelKind kinds[] = {MODEL_SPRING, MODEL_CASCADE, MODEL_FOREST,
                                      MODEL_CASCADE_THESIS};
    for (int i = 0; i < 4; ++i) {
        bool is_printed = kinds[i] == MODEL_CASCADE_THESIS; // its bound is no promise: see B
        panel_measure(&(Panel){.name = models[kinds[i]].name,
                               .model = kinds[i],
                               .x = {1e-2, 8, 40, true},
                               .y = {0, 1, 30, false},
                               .measure = verlet_at,
                               .derived = is_printed ? NULL : verlet_edge},
                      points);
    }
}

void map_cascades(Points* points)
{
    static const char* const names[] = {"uniform/weightless",   "uniform/heavy",
                                        "linear/weightless",    "linear/heavy",
                                        "quadratic/weightless", "quadratic/heavy"};
    static const char* const mended[] = {"mended/uniform/weightless",   "mended/uniform/heavy",
                                         "mended/linear/weightless",    "mended/linear/heavy",
                                         "mended/quadratic/weightless", "mended/quadratic/heavy"};
    for (int i = 0; i < 6; ++i) {
        Panel panel = {.name = names[i],
                       .model = MODEL_CASCADE_THESIS,
                       .fall_off = i / 2,
                       .has_gravity = i % 2 == 1,
                       .x = {1e-3, 1, 30, true},
                       .y = {0, 1.5, 25, false},
                       .measure = cascade_at,
                       .derived = linear_edge,
                       .is_first_edge_alone = true};
        panel_measure(&panel, points);
        panel.name = mended[i];
        panel.model = MODEL_CASCADE;
        panel.y = (Scale){0.5, 1.5, 1, false}; // it has kd = ku, whatever the share
        panel_measure(&panel, points);
    }
}

void map_forests(Points* points)
{
    Panel panel = {.name = "forest-z",
                   .model = MODEL_FOREST_Z,
                   .x = {0, 1.2, 40, false},
                   .y = {0, 1.2, 40, false},
                   .measure = forest_at,
                   .derived = euler_edge,
                   .is_absolute = true};
    panel_measure(&panel, points);
    panel.name = "forest";
    panel.model = MODEL_FOREST;
    panel.y = (Scale){0, 1, 30, false}; // no step takes more than all of a velocity
    panel.derived = symplectic_edge;
    panel_measure(&panel, points);
}

void map_nodes(Points* points)
{
    static const ModelKind kinds[] = {MODEL_SPRING, MODEL_CASCADE, MODEL_FOREST};
    for (int i = 0; i < 3; ++i)
        panel_edges(&(Panel){.name = models[kinds[i]].name,
                             .model = kinds[i],
                             .x = {0.05, 8, 24, true},
                             .y = {1.5, 32.5, 31, false},
                             .measure = nodes_at,
                             .derived = nodes_edge,
                             .is_first_edge_alone = true},
                    points);
    Panel hanging = {.name = "stretch",
                     .x = {1.5, 32.5, 31, false},
                     .y = {0.5, 4.5, 4, false},
                     .measure = hanging_at};
    int first = points->count;
    panel_measure(&hanging, points);
    for (int i = first; i < points->count; ++i) {
        Point* point = &points->all[i];
        double links = point->x - 1.0, link = TRIAL_LENGTH_M / links;
        double wanted = (links - 1.0) * TRIAL_GRAVITY / (240.0 * 240.0 * link);
        if (point->y == 1.0 && links > 1.0)
            points_judge(points, "stretch", "one sweep", point->value, wanted, true);
    }
}
