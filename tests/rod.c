#include "tests/rod.h"

#include "tests/rod_elastic.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST_NEWTON 400
#define PRECISION   1e-10 // of forces, against force_n

// What a step leaves behind for the next, of one point.
typedef struct Past {
    Vec3d position, velocity;
} Past;

struct Rod {
    RodDefinition definition;
    Vec3d *rest, rest_tangent, rest_director; // head space; the latter two of the clamp
    RodElastic elastic;
    double* mass; // [nodes], kg
    RodShape now, trial;
    Past *last, *before; // [nodes], at the end of the last step and of the one before
    Past head_last, head_before;
    Quat head_turn;
    Vec3d wind_m_s;
    double drag_per_s;
    Vec3d* goal;       // [nodes], where the nodes would be at the end of the step without forces
    double inertia_s2; // how strongly the goal holds: mass x inertia is a stiffness; 0: statics
    double *gradient, *change, *matrix, *factor;
    double force_n; // what forces are measured against
    int steps, iterations;
    double* memory;
};

static void clamp(const Rod* rod, RodShape* shape, Quat turn)
{
    shape->position[0] = quat_rotate(turn, rod->rest[0]);
    shape->tangent[0] = quat_rotate(turn, rod->rest_tangent);
    shape->director[0] = quat_rotate(turn, rod->rest_director);
}

static void swap(Rod* rod)
{
    RodShape shape = rod->now;
    rod->now = rod->trial;
    rod->trial = shape;
}

static void assemble_nodes(const Rod* rod, const RodShape* shape, double inertia, double* gradient,
                           double* matrix)
{
    for (int j = 1; j < rod->definition.nodes; ++j) {
        double* g = gradient + (ptrdiff_t)ROD_BLOCK * (j - 1) + 1;
        double hold = rod->mass[j] * inertia;
        Vec3d off = vec3d_sub(shape->position[j], rod->goal[j]);
        g[0] += hold * off.x;
        g[1] += hold * off.y + rod->mass[j] * rod->definition.gravity_m_s2;
        g[2] += hold * off.z;
        for (int k = 1; matrix != NULL && k < ROD_BLOCK; ++k)
            matrix[ROD_ROW * (ROD_BLOCK * (j - 1) + k)] += hold;
    }
}

static int unknowns(const Rod* rod)
{
    return ROD_BLOCK * (rod->definition.nodes - 1);
}

// Gradient, and where `matrix` is not NULL the second derivatives, of what a step minimises.
static void assemble(const Rod* rod, const RodShape* shape, double inertia, double* gradient,
                     double* matrix)
{
    size_t n = (size_t)unknowns(rod);
    memset(gradient, 0, n * sizeof *gradient);
    if (matrix != NULL) memset(matrix, 0, n * ROD_ROW * sizeof *matrix);
    rod_elastic_assemble(&rod->elastic, shape, gradient, matrix);
    assemble_nodes(rod, shape, inertia, gradient, matrix);
}

// Potential energies; motion is left 0.
static RodEnergy energy_of(const Rod* rod, const RodShape* shape)
{
    RodElasticEnergy elastic = rod_elastic_energy(&rod->elastic, shape);
    RodEnergy energy = {.stretch = elastic.stretch, .bend = elastic.bend, .twist = elastic.twist};
    for (int j = 1; j < rod->definition.nodes; ++j)
        energy.gravity += rod->mass[j] * rod->definition.gravity_m_s2 * shape->position[j].y;
    return energy;
}

static double total(RodEnergy e)
{
    return e.stretch + e.bend + e.twist + e.gravity + e.motion;
}

// What a step minimises: potential energy and the pull of the goal (backward Euler and BDF2 as
// minimisation; its gradient is the equation of motion). `size`: of its terms, which rounding goes
// by.
static double objective(const Rod* rod, const RodShape* shape, double* size)
{
    RodEnergy e = energy_of(rod, shape);
    double pull = 0.0;
    for (int j = 1; j < rod->definition.nodes; ++j) {
        Vec3d off = vec3d_sub(shape->position[j], rod->goal[j]);
        pull += 0.5 * rod->mass[j] * rod->inertia_s2 * vec3d_dot(off, off);
    }
    *size = e.stretch + e.bend + e.twist + fabs(e.gravity) + pull;
    return total(e) + pull;
}

// The largest unbalanced force in units of force_n; torques as forces at an edge's length.
static double residual(const Rod* rod, const double* gradient)
{
    double largest = 0.0;
    for (int i = 0; i < unknowns(rod); ++i) {
        double g = fabs(gradient[i]);
        if (i % ROD_BLOCK == 0) g /= rod->elastic.share[i / ROD_BLOCK];
        if (isnan(g)) return HUGE_VAL;
        largest = fmax(largest, g);
    }
    return largest / rod->force_n;
}

// L D L^T of the band matrix `a` of `n` rows, in place; false where it is not positive definite.
static bool factorise(double* a, int n)
{
    for (int i = 0; i < n; ++i) {
        double* row = a + (ptrdiff_t)ROD_ROW * i;
        int first = i < ROD_BAND ? 0 : i - ROD_BAND;
        double whole = row[0];
        for (int j = first; j < i; ++j) { // row[i - j] is still L D
            const double* other = a + (ptrdiff_t)ROD_ROW * j;
            int from = j < ROD_BAND ? 0 : j - ROD_BAND;
            if (from < first) from = first;
            for (int k = from; k < j; ++k)
                row[i - j] -= row[i - k] * other[j - k];
        }
        for (int j = first; j < i; ++j) {
            double ld = row[i - j];
            row[i - j] = ld / a[ROD_ROW * j];
            row[0] -= ld * row[i - j];
        }
        if (!(row[0] > 1e-14 * fabs(whole))) return false;
    }
    return true;
}

// x = (L D L^T)^-1 x
static void substitute(const double* a, int n, double* x)
{
    for (int i = 0; i < n; ++i)
        for (int k = 1; k <= ROD_BAND && k <= i; ++k)
            x[i] -= a[ROD_ROW * i + k] * x[i - k];
    for (int i = 0; i < n; ++i)
        x[i] /= a[ROD_ROW * i];
    for (int i = n - 1; i >= 0; --i)
        for (int k = 1; k <= ROD_BAND && k <= i; ++k)
            x[i - k] -= a[ROD_ROW * i + k] * x[i];
}

// Newton's change, downhill in any case: where the matrix is not positive definite, its diagonal
// grows until it is.
static void direction(Rod* rod)
{
    int n = unknowns(rod);
    double largest = 0.0;
    for (int i = 0; i < n; ++i)
        largest = fmax(largest, fabs(rod->matrix[ROD_ROW * i]));
    for (double shift = 0.0; shift < 1e6; shift = shift == 0.0 ? 1e-9 : shift * 8.0) {
        memcpy(rod->factor, rod->matrix, (size_t)n * ROD_ROW * sizeof *rod->factor);
        for (int i = 0; i < n; ++i) {
            double own = i % ROD_BLOCK == 0
                             ? rod->definition.twisting_nm2 / rod->elastic.share[i / ROD_BLOCK]
                             : largest;
            rod->factor[ROD_ROW * i] += shift * own;
        }
        if (factorise(rod->factor, n)) break;
    }
    for (int i = 0; i < n; ++i)
        rod->change[i] = -rod->gradient[i];
    substitute(rod->factor, n, rod->change);
}

// The part of `change` that turns no edge by more than about a radian.
static double longest_step(const Rod* rod)
{
    double most = 1.0;
    Vec3d inner = {0, 0, 0};
    for (int j = 1; j < rod->definition.nodes; ++j) {
        const double* c = rod->change + (ptrdiff_t)ROD_BLOCK * (j - 1);
        Vec3d move = {c[1], c[2], c[3]}, by = vec3d_sub(move, inner);
        inner = move;
        most = fmax(most, sqrt(vec3d_dot(by, by)) / rod->elastic.rest_length[j]);
        most = fmax(most, fabs(c[0]));
    }
    return 1.0 / most;
}

// Moves along `change` as far as that lowers the objective; false where it does not. Next to the
// minimum (`near`) rounding hides what is left of the objective: there the whole change must halve
// the largest unbalanced force, or nothing moves.
static bool line_search(Rod* rod, double unbalanced, bool near)
{
    int nodes = rod->definition.nodes, n = unknowns(rod);
    double slope = 0.0, scale = longest_step(rod), size, unused;
    double here = objective(rod, &rod->now, &size);
    here += 8.0 * DBL_EPSILON * size; // in a statement of its own: objective() sets `size`
    for (int i = 0; i < n; ++i)
        slope += rod->gradient[i] * rod->change[i];
    for (int halvings = 0; halvings < 40; ++halvings, scale *= 0.5) {
        rod_elastic_move(nodes, &rod->trial, &rod->now, rod->change, scale);
        bool lower;
        if (near) {
            assemble(rod, &rod->trial, rod->inertia_s2, rod->gradient, NULL);
            lower = residual(rod, rod->gradient) < 0.5 * unbalanced;
        } else {
            lower = objective(rod, &rod->trial, &unused) <= here + 1e-4 * scale * slope;
        }
        if (lower) swap(rod);
        if (lower || near) return lower;
    }
    return false;
}

// The residual that rounding may leave: positions are known to DBL_EPSILON of their size, and EA
// answers.
static double rounding(const Rod* rod)
{
    double farthest = 0.0, shortest = HUGE_VAL;
    for (int j = 1; j < rod->definition.nodes; ++j) {
        farthest = fmax(farthest, vec3d_dot(rod->now.position[j], rod->now.position[j]));
        shortest = fmin(shortest, rod->elastic.rest_length[j]);
    }
    double strain = DBL_EPSILON * sqrt(farthest) / shortest;
    return 100.0 * rod->definition.stretching_n * strain / rod->force_n;
}

// To the minimum of the objective next to `now`: until every force is balanced to PRECISION, or to
// what rounding allows and Newton no longer halves it.
static bool minimise(Rod* rod)
{
    double noise = PRECISION + rounding(rod);
    for (rod->iterations = 0; rod->iterations < MOST_NEWTON; ++rod->iterations) {
        assemble(rod, &rod->now, rod->inertia_s2, rod->gradient, rod->matrix);
        double unbalanced = residual(rod, rod->gradient);
        if (unbalanced <= PRECISION) return true;
        direction(rod);
        bool near = unbalanced <= noise;
        if (!line_search(rod, unbalanced, near)) return near;
    }
    return false;
}

RodDefinition rod_circular(double young_pa, double radius_m, double density_kg_m3, double poisson)
{
    double area = acos(-1.0) * radius_m * radius_m;
    double bending = young_pa * area * radius_m * radius_m / 4.0;
    return (RodDefinition){.bending_nm2 = bending,
                           .twisting_nm2 = bending / (1.0 + poisson),
                           .stretching_n = young_pa * area,
                           .density_kg_m = density_kg_m3 * area,
                           .scheme = ROD_BDF2};
}

static bool definition_is_good(const RodDefinition* d, Fault* fault)
{
    if (d->nodes < 2 || d->nodes > 100000)
        return fault_set(fault, "nodes is %d: use 2 to 100000", d->nodes);
    if (d->rest == NULL) return fault_set(fault, "rest is NULL: give [nodes] positions");
    const struct {
        const char* name;
        double value;
        bool zero;
    } fields[] = {{"bending_nm2", d->bending_nm2, false},
                  {"twisting_nm2", d->twisting_nm2, false},
                  {"stretching_n", d->stretching_n, false},
                  {"density_kg_m", d->density_kg_m, false},
                  {"dt_s", d->dt_s, false},
                  {"gravity_m_s2", d->gravity_m_s2, true},
                  {"damping_per_s", d->damping_per_s, true}};
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; ++i)
        if (!isfinite(fields[i].value) || fields[i].value < 0.0 ||
            (fields[i].value == 0.0 && !fields[i].zero))
            return fault_set(fault, "%s is %g: use a finite number %s 0", fields[i].name,
                             fields[i].value, fields[i].zero ? "from" : "above");
    for (int j = 1; j < d->nodes; ++j) {
        Vec3d edge = vec3d_sub(d->rest[j], d->rest[j - 1]);
        if (!(vec3d_dot(edge, edge) > 0.0) || !isfinite(vec3d_dot(edge, edge)))
            return fault_set(fault, "rest: nodes %d and %d are in one place or nowhere", j - 1, j);
    }
    return true;
}

// Cuts `count` doubles off `memory`; with a NULL base it only counts.
static double* carve(double** memory, size_t* used, size_t count)
{
    double* part = *memory == NULL ? NULL : *memory + *used;
    *used += count;
    return part;
}

static void carve_shape(RodShape* shape, double** memory, size_t* used, size_t nodes)
{
    shape->position = (Vec3d*)carve(memory, used, 3 * nodes);
    shape->tangent = (Vec3d*)carve(memory, used, 3 * nodes);
    shape->director = (Vec3d*)carve(memory, used, 3 * nodes);
    shape->length = carve(memory, used, nodes);
    shape->twist = carve(memory, used, nodes);
}

// Hands out the arrays; returns how many doubles they are.
static size_t carve_all(Rod* rod)
{
    double** memory = &rod->memory;
    size_t used = 0, nodes = (size_t)rod->definition.nodes, n = ROD_BLOCK * (nodes - 1);
    rod->rest = (Vec3d*)carve(memory, &used, 3 * nodes);
    rod->elastic.rest_length = carve(memory, &used, nodes);
    rod->elastic.share = carve(memory, &used, nodes);
    rod->mass = carve(memory, &used, nodes);
    rod->elastic.rest_curvature = (Vec2d*)carve(memory, &used, 2 * nodes);
    carve_shape(&rod->now, memory, &used, nodes);
    carve_shape(&rod->trial, memory, &used, nodes);
    rod->last = (Past*)carve(memory, &used, 6 * nodes);
    rod->before = (Past*)carve(memory, &used, 6 * nodes);
    rod->goal = (Vec3d*)carve(memory, &used, 3 * nodes);
    rod->gradient = carve(memory, &used, n);
    rod->change = carve(memory, &used, n);
    rod->matrix = carve(memory, &used, n * ROD_ROW);
    rod->factor = carve(memory, &used, n * ROD_ROW);
    return used;
}

// The shape at rest, with frames that do not twist along it.
static void rest_shape(Rod* rod, Quat turn)
{
    RodShape* shape = &rod->now;
    clamp(rod, shape, turn);
    for (int j = 1; j < rod->definition.nodes; ++j)
        shape->position[j] = quat_rotate(turn, rod->rest[j]);
    rod_elastic_untwist(rod->definition.nodes, shape);
}

static void measure_rest(Rod* rod)
{
    const RodDefinition* d = &rod->definition;
    double length = 0.0, weight = 0.0;
    Vec3d first = vec3d_sub(rod->rest[1], rod->rest[0]);
    rod->rest_tangent = vec3d_scale(first, 1.0 / sqrt(vec3d_dot(first, first)));
    rod->rest_director = rod_elastic_across(rod->rest_tangent);
    rest_shape(rod, quat_identity());
    RodElastic* elastic = &rod->elastic;
    for (int j = 1; j < d->nodes; ++j) {
        elastic->rest_length[j] = rod->now.length[j];
        elastic->rest_curvature[j - 1] = rod_elastic_curvature(&rod->now, j - 1);
        length += rod->now.length[j];
    }
    for (int j = 1; j < d->nodes; ++j) {
        double inner = rod->now.length[j], before = j > 1 ? rod->now.length[j - 1] : 0.0;
        double after = j < d->nodes - 1 ? rod->now.length[j + 1] : d->whole_tip_mass ? inner : 0.0;
        elastic->share[j - 1] = 0.5 * (before + inner);
        rod->mass[j] = 0.5 * d->density_kg_m * (inner + after);
        weight += rod->mass[j] * d->gravity_m_s2;
    }
    rod->force_n = weight + d->bending_nm2 / (length * length);
}

// At rest relative to the head, as if it had always been so.
static void stop(Rod* rod)
{
    for (int j = 0; j < rod->definition.nodes; ++j)
        rod->last[j] = rod->before[j] = (Past){rod->now.position[j], {0, 0, 0}};
    rod->steps = 0;
}

Rod* rod_create(const RodDefinition* definition, Fault* fault)
{
    if (!definition_is_good(definition, fault)) return NULL;
    Rod* rod = calloc(1, sizeof *rod);
    if (rod != NULL) {
        rod->definition = *definition;
        rod->elastic = (RodElastic){.nodes = definition->nodes,
                                    .bending_nm2 = definition->bending_nm2,
                                    .twisting_nm2 = definition->twisting_nm2,
                                    .stretching_n = definition->stretching_n};
        rod->memory = calloc(carve_all(rod), sizeof(double));
    }
    if (rod == NULL || rod->memory == NULL) {
        free(rod);
        fault_set(fault, "no memory for %d nodes", definition->nodes);
        return NULL;
    }
    carve_all(rod);
    memcpy(rod->rest, definition->rest, (size_t)definition->nodes * sizeof *rod->rest);
    rod->definition.rest = rod->rest;
    measure_rest(rod);
    stop(rod);
    rod->head_turn = quat_identity();
    return rod;
}

void rod_destroy(Rod* rod)
{
    if (rod == NULL) return;
    free(rod->memory);
    free(rod);
}

bool rod_settle(Rod* rod, Pose head, Vec3d velocity_m_s)
{
    rest_shape(rod, head.orientation);
    rod->inertia_s2 = 0.0;
    bool found = minimise(rod);
    stop(rod);
    rod->head_last = rod->head_before = (Past){head.position, velocity_m_s};
    rod->head_turn = head.orientation;
    return found;
}

void rod_place(Rod* rod, const Vec3d* positions)
{
    RodShape* shape = &rod->trial;
    shape->position[0] = rod->now.position[0];
    shape->tangent[0] = rod->now.tangent[0];
    shape->director[0] = rod->now.director[0];
    for (int j = 1; j < rod->definition.nodes; ++j)
        shape->position[j] = positions[j];
    rod_elastic_follow(rod->definition.nodes, shape, &rod->now, NULL, 0.0);
    swap(rod);
    stop(rod);
}

// Where the differences of a scheme count from: velocity = rate (position - mean of the past), and
// acceleration likewise of velocity. BDF2: (3 x1 - 4 x0 + x-1) / (2 dt) = 3 / (2 dt) (x1 - mean).
static Past mean_past(Past last, Past before, bool euler)
{
    if (euler) return last;
    return (Past){
        vec3d_mad(vec3d_scale(last.position, 4.0 / 3.0), before.position, -1.0 / 3.0),
        vec3d_mad(vec3d_scale(last.velocity, 4.0 / 3.0), before.velocity, -1.0 / 3.0),
    };
}

// m (a + damping v + drag (v + v of the head - wind)) = force, with v = rate (u - mean) and
// a = rate (v - mean v) + a of the head, is
//     m (rate^2 + (damping + drag) rate) (u - goal) = force.
// `push` is what the head's acceleration and the air's move past it add to every node.
static void set_goals(Rod* rod, double rate, Vec3d push, bool euler)
{
    rod->inertia_s2 = rate * rate + (rod->definition.damping_per_s + rod->drag_per_s) * rate;
    for (int j = 0; j < rod->definition.nodes; ++j) {
        Past mean = mean_past(rod->last[j], rod->before[j], euler);
        Vec3d pull = vec3d_mad(push, mean.velocity, rate);
        rod->goal[j] = vec3d_mad(mean.position, pull, 1.0 / rod->inertia_s2);
    }
}

// Newton's start: everything goes on as it went, under the new clamp.
static void guess(Rod* rod, Quat turn)
{
    RodShape* shape = &rod->trial;
    clamp(rod, shape, turn);
    for (int j = 1; j < rod->definition.nodes; ++j)
        shape->position[j] =
            vec3d_mad(rod->last[j].position, rod->last[j].velocity, rod->definition.dt_s);
    rod_elastic_follow(rod->definition.nodes, shape, &rod->now, NULL, 0.0);
    swap(rod);
}

static Past moved(Past last, Past before, Vec3d to, double rate, bool euler)
{
    Past mean = mean_past(last, before, euler);
    return (Past){to, vec3d_scale(vec3d_sub(to, mean.position), rate)};
}

bool rod_step(Rod* rod, Pose head)
{
    bool euler = rod->definition.scheme == ROD_EULER || rod->steps == 0;
    double rate = (euler ? 1.0 : 1.5) / rod->definition.dt_s;
    Past at = moved(rod->head_last, rod->head_before, head.position, rate, euler);
    Past mean = mean_past(rod->head_last, rod->head_before, euler);
    Vec3d acceleration = vec3d_scale(vec3d_sub(at.velocity, mean.velocity), rate);
    rod->head_before = rod->head_last, rod->head_last = at;
    rod->head_turn = head.orientation;

    Vec3d air = vec3d_sub(rod->wind_m_s, at.velocity);
    set_goals(rod, rate, vec3d_mad(vec3d_scale(air, rod->drag_per_s), acceleration, -1.0), euler);
    guess(rod, head.orientation);
    bool found = minimise(rod);
    for (int j = 0; j < rod->definition.nodes; ++j) {
        Past last = rod->last[j];
        rod->last[j] = moved(last, rod->before[j], rod->now.position[j], rate, euler);
        rod->before[j] = last;
    }
    ++rod->steps;
    return found;
}

static void past_turn(Past* past, Quat turn)
{
    past->position = quat_rotate(turn, past->position);
    past->velocity = quat_rotate(turn, past->velocity);
}

void rod_blow(Rod* rod, Vec3d wind_m_s, double drag_per_s)
{
    rod->wind_m_s = wind_m_s;
    rod->drag_per_s = drag_per_s;
}

void rod_carry(Rod* rod, Pose head)
{
    Quat turn = quat_mul(head.orientation, quat_conjugate(rod->head_turn));
    for (int j = 0; j < rod->definition.nodes; ++j) {
        rod->now.position[j] = quat_rotate(turn, rod->now.position[j]);
        rod->now.tangent[j] = quat_rotate(turn, rod->now.tangent[j]);
        rod->now.director[j] = quat_rotate(turn, rod->now.director[j]);
        past_turn(&rod->last[j], turn);
        past_turn(&rod->before[j], turn);
    }
    Vec3d jump = vec3d_sub(head.position, rod->head_last.position);
    rod->head_last.position = head.position;
    rod->head_before.position = vec3d_add(rod->head_before.position, jump);
    rod->head_turn = head.orientation;
}

void rod_positions(const Rod* rod, Vec3d* positions)
{
    memcpy(positions, rod->now.position, (size_t)rod->definition.nodes * sizeof *positions);
}

RodEnergy rod_energy(const Rod* rod)
{
    RodEnergy energy = energy_of(rod, &rod->now);
    for (int j = 1; j < rod->definition.nodes; ++j) {
        Vec3d v = rod->last[j].velocity;
        energy.motion += 0.5 * rod->mass[j] * vec3d_dot(v, v);
    }
    return energy;
}

double rod_potential(Rod* rod, const double* change, double* gradient)
{
    if (change == NULL) {
        if (gradient != NULL) assemble(rod, &rod->now, 0.0, gradient, NULL);
        return total(energy_of(rod, &rod->now));
    }
    rod_elastic_move(rod->definition.nodes, &rod->trial, &rod->now, change, 1.0);
    if (gradient != NULL) assemble(rod, &rod->trial, 0.0, gradient, NULL);
    return total(energy_of(rod, &rod->trial));
}

int rod_iterations(const Rod* rod)
{
    return rod->iterations;
}
