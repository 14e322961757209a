#include "tests/trial.h"

#include "server/models.h"
#include "server/strands.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const float upright[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

SimDefinition trial_bare(ModelKind model, int links)
{
    SimDefinition d = sim_default();
    d.model = model;
    d.length = LENGTH_SWEEPS;
    d.strands = 1;
    d.nodes = links + 1;
    d.substeps = 1;
    d.gravity_m_s2 = 0;
    d.gravity_compensation = false;
    d.stiffness_s2 = 0;
    d.fall_off_per_m = TRIAL_FALL_OFF;
    d.fall_off_power = 0;
    d.damping_per_s = 0;
    d.iterations = 1;
    d.force = true;
    return d;
}

float trial_damping(double kept)
{
    return (float)(-60.0 * log(kept));
}

void trial_straight(Trial* trial, int links, Vec3 way)
{
    trial->links = links;
    for (int n = 0; n <= links; ++n)
        trial->rest[n] = vec3_scale(way, (float)(TRIAL_LENGTH_M * n / links));
}

bool trial_start(Trial* trial, SimDefinition definition)
{
    Fault fault = {0};
    definition.rest = trial->rest;
    trial->definition = definition;
    trial->sim = sim_create(&definition, &fault);
    if (trial->sim == NULL) {
        fprintf(stderr, "hair-bench: %s\n", fault.text);
        return false;
    }
    trial_head(trial, upright, vec3(0, 0, 0));
    trial_read(trial);
    return true;
}

void trial_end(Trial* trial)
{
    sim_destroy(trial->sim);
    trial->sim = NULL;
}

void trial_head(Trial* trial, const float rotation[9], Vec3 push)
{
    memset(trial->heads, 0, sizeof trial->heads);
    for (int s = 0; s < trial->definition.substeps; ++s) {
        memcpy(trial->heads[s].rotation, rotation, sizeof trial->heads[s].rotation);
        trial->heads[s].second_difference = push;
    }
}

void trial_run(Trial* trial, double seconds)
{
    int64_t ticks = llround(seconds * trial->definition.rate_hz);
    for (int64_t tick = 0; tick < ticks; ++tick)
        sim_step(trial->sim, trial->heads);
    trial_read(trial);
}

void trial_read(Trial* trial)
{
    sim_state(trial->sim, trial->now, trial->before);
}

// forest-z knows nodes by its angles: the first joint turns the strand, the second turns it back.
// Its straight strand does not feel a push along y, so all of it goes along x.
static void kick_angles(Block* block, int links)
{
    float angle = (float)(TRIAL_KICK_M * links / TRIAL_LENGTH_M);
    for (int l = 0; l < LANES; ++l) {
        block->angle[1].phi[l] = angle;
        if (links > 1) block->angle[2].phi[l] = -angle;
    }
}

// Written into the state, because a push of the head is another thing for every model.
void trial_kick(Trial* trial)
{
    Block* block = &trial->sim->blocks[0];
    Vec3 aside = vec3_scale(vec3(0.96f, 0, 0.28f), (float)TRIAL_KICK_M);
    if (models[trial->definition.model].has_angles) {
        kick_angles(block, trial->links);
        return;
    }
    for (int n = 1; n <= trial->links; ++n)
        for (int l = 0; l < LANES; ++l) {
            lane_set(&block->position[n], l, vec3_add(trial->rest[n], aside));
            lane_set(&block->previous[n], l, vec3_add(trial->rest[n], aside));
        }
}

void trial_rotation(double angle, int axis, float rotation[9])
{
    float c = (float)cos(angle), s = (float)sin(angle);
    const float roll[9] = {c, -s, 0, s, c, 0, 0, 0, 1}, yaw[9] = {c, 0, s, 0, 1, 0, -s, 0, c};
    memcpy(rotation, axis == 2 ? roll : yaw, sizeof roll);
}

double trial_degrees(Vec3 a, Vec3 b)
{
    double across = (double)vec3_length(vec3_cross(a, b));
    return atan2(across, (double)vec3_dot(a, b)) * 180.0 / M_PI;
}

double trial_stretch(const Trial* trial)
{
    double most = 0.0;
    for (int n = 1; n <= trial->links; ++n) {
        double length = (double)vec3_length(vec3_sub(trial->now[n], trial->now[n - 1]));
        double rest = (double)vec3_length(vec3_sub(trial->rest[n], trial->rest[n - 1]));
        most = fmax(most, length / rest - 1.0);
    }
    return most;
}

// What is along the line is stretch, a class of its own.
static double away_from_line(const Trial* trial)
{
    double most = 0.0;
    Vec3 way = vec3_normalise_or(trial->rest[trial->links], vec3(0, -1, 0));
    for (int n = 1; n <= trial->links; ++n) {
        Vec3 off = vec3_sub(trial->now[n], trial->rest[n]);
        off = vec3_mad(off, way, -vec3_dot(off, way));
        most = fmax(most, (double)vec3_length(off));
    }
    return most / TRIAL_LENGTH_M;
}

// Sum of squares of velocities. Not of potential energy: the printed models have none.
static double motion_of(const Trial* trial)
{
    double sum = 0.0, rate = trial->definition.rate_hz * trial->definition.substeps;
    for (int n = 1; n <= trial->links; ++n) {
        double step = (double)vec3_length(vec3_sub(trial->now[n], trial->before[n]));
        sum += step * step * rate * rate;
    }
    return sum;
}

Watch trial_watch(Trial* trial)
{
    Watch watch = {0};
    int ticks = (int)lround(TRIAL_S * trial->definition.rate_hz);
    int window = (int)lround(TRIAL_WINDOW_S * trial->definition.rate_hz);
    for (int tick = 0; tick < ticks && !watch.is_lost; ++tick) {
        sim_step(trial->sim, trial->heads);
        watch.is_lost = sim_quarantined(trial->sim) > 0;
        bool is_first = tick < window, is_last = tick >= ticks - window;
        if (!is_first && !is_last) continue;
        trial_read(trial);
        double motion = motion_of(trial) / window;
        *(is_first ? &watch.first : &watch.last) += motion;
        watch.is_lost |= !isfinite(motion);
        if (!is_last) continue;
        watch.away = fmax(watch.away, away_from_line(trial));
        watch.stretch = fmax(watch.stretch, trial_stretch(trial));
    }
    return watch;
}

const char* watch_class(const Watch* watch)
{
    if (watch->is_lost) return "lost";
    if (watch->away > TRIAL_AWAY || watch->last > watch->first) return "flutter";
    return watch->stretch > TRIAL_STRETCH ? "stretched" : "calm";
}

bool is_calm(const char* class)
{
    return strcmp(class, "calm") == 0 || strcmp(class, "stretched") == 0;
}

// --- Maps --------------------------------------------------------------------------------------

void points_add(Points* points, Point point)
{
    if (points->count == points->capacity) {
        int capacity = 2 * points->capacity + 1024;
        Point* all = realloc(points->all, (size_t)capacity * sizeof *all);
        if (all == NULL) {
            points->has_failed = true;
            return;
        }
        points->all = all;
        points->capacity = capacity;
    }
    points->has_failed |= point.class == NULL;
    points->all[points->count++] = point;
}

static Verdict* verdict_on(Points* points, const char* panel, const char* what, bool is_relative)
{
    int i = 0;
    while (i < points->verdict_count && (strcmp(points->verdicts[i].panel, panel) != 0 ||
                                         strcmp(points->verdicts[i].what, what) != 0))
        ++i;
    if (i == POINTS_VERDICTS) return NULL;
    if (i == points->verdict_count)
        points->verdicts[points->verdict_count++] =
            (Verdict){.panel = panel, .what = what, .is_relative = is_relative};
    return &points->verdicts[i];
}

void points_judge(Points* points, const char* panel, const char* what, double got, double wanted,
                  bool is_relative)
{
    Verdict* verdict = verdict_on(points, panel, what, is_relative);
    if (verdict == NULL) {
        points->has_failed = true;
        return;
    }
    double off = is_relative ? got / wanted - 1.0 : got - wanted;
    verdict->mean += (off - verdict->mean) / ++verdict->count;
    if (!(fabs(off) <= fabs(verdict->worst))) verdict->worst = off;
}

double axis_at(const Scale* axis, double i)
{
    double part = (i + 0.5) / axis->count;
    return axis->is_log ? axis->low * pow(axis->high / axis->low, part)
                        : axis->low + (axis->high - axis->low) * part;
}

static bool is_inside(const Panel* panel, const Point* point)
{
    if (point->class == NULL || !is_calm(point->class)) return false;
    return !panel->is_edge_of_stretch || strcmp(point->class, "stretched") != 0;
}

// Of the edge between bins i and i + 1 of a row.
static double bisected(const Panel* panel, double y, int i, bool is_calm_below)
{
    double low = i, high = i + 1;
    for (int pass = 0; pass < 8; ++pass) {
        double middle = 0.5 * (low + high);
        Point point = panel->measure(panel, axis_at(&panel->x, middle), y);
        *(is_inside(panel, &point) == is_calm_below ? &low : &high) = middle;
    }
    return axis_at(&panel->x, 0.5 * (low + high));
}

static void row_edges(const Panel* panel, Points* points, const Point* row, double y)
{
    for (int i = 0; i + 1 < panel->x.count; ++i) {
        bool calm = is_inside(panel, &row[i]);
        if (calm == is_inside(panel, &row[i + 1])) continue;
        double x = bisected(panel, y, i, calm), wanted = panel->derived(panel, x, y);
#pragma omp critical
        points_add(points, (Point){panel->name, x, y, "edge", wanted});
        if (panel->is_first_edge_alone) return;
    }
}

static int by_place(const void* a, const void* b)
{
    const Point *p = a, *q = b;
    return p->y != q->y ? (p->y > q->y) - (p->y < q->y) : (p->x > q->x) - (p->x < q->x);
}

static void measure(const Panel* panel, Points* points, bool wants_bins)
{
    int width = panel->x.count, count = width * panel->y.count;
    Point* bins = calloc((size_t)count, sizeof *bins);
    if (bins == NULL) {
        points->has_failed = true;
        return;
    }
#pragma omp parallel for schedule(dynamic, 4)
    for (int i = 0; i < count; ++i)
        bins[i] =
            panel->measure(panel, axis_at(&panel->x, i % width), axis_at(&panel->y, i / width));
    for (int i = 0; i < count && wants_bins; ++i)
        points_add(points, bins[i]);
    int first = points->count;
    if (panel->derived != NULL) {
#pragma omp parallel for schedule(dynamic, 1)
        for (int row = 0; row < panel->y.count; ++row)
            row_edges(panel, points, &bins[row * width], axis_at(&panel->y, row));
    }
    free(bins);
    if (points->count == first) return;
    // Threads end in any order; the CSV is the same every time.
    qsort(points->all + first, (size_t)(points->count - first), sizeof *points->all, by_place);
    for (const Point* edge = points->all + first; edge < points->all + points->count; ++edge)
        if (isfinite(edge->value))
            points_judge(points, panel->name, "edge", edge->x, edge->value, !panel->is_absolute);
}

void panel_measure(const Panel* panel, Points* points)
{
    measure(panel, points, true);
}

void panel_edges(const Panel* panel, Points* points)
{
    measure(panel, points, false);
}
