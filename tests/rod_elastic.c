#include "tests/rod_elastic.h"

#include <math.h>
#include <stddef.h>

#define LOCAL 8 // unknowns of a vertex: edge e (3), edge f (3), angle of e, angle of f

// One number of a vertex (curvature along one axis, or twist) with its derivatives; of the second
// ones the upper half. (A loop that copies it to the lower half is wrong code with gcc 12 at -O1.)
typedef struct Measure {
    double value, gradient[LOCAL], hessian[LOCAL][LOCAL];
} Measure;

// A vertex: edges e before and f after it.
typedef struct Vertex {
    Vec3d te, tf, kb, mean; // tangents, curvature binormal, (te + tf) / chi
    double chi, e, f;       // 1 + te . tf; lengths, m
    Vec3d m1e, m1f, m2e, m2f;
} Vertex;

static Vec3d unit(Vec3d a)
{
    return vec3d_scale(a, 1.0 / sqrt(vec3d_dot(a, a)));
}

Vec3d rod_elastic_across(Vec3d a)
{
    double x = fabs(a.x), y = fabs(a.y), z = fabs(a.z);
    Vec3d axis = x <= y && x <= z ? (Vec3d){1, 0, 0} : y <= z ? (Vec3d){0, 1, 0} : (Vec3d){0, 0, 1};
    return unit(vec3d_cross(a, axis));
}

// Turns `v` with the smallest rotation that turns the unit vector `from` into `to`.
static Vec3d transport(Vec3d v, Vec3d from, Vec3d to)
{
    double c = vec3d_dot(from, to);
    if (c < -1.0 + 1e-12) return v; // any axis would do; v is across both
    Vec3d b = vec3d_cross(from, to);
    Vec3d turned = vec3d_mad(vec3d_scale(v, c), vec3d_cross(b, v), 1.0);
    return vec3d_mad(turned, b, vec3d_dot(b, v) / (1.0 + c));
}

// How far `director` of f is turned about f's tangent against that of e, transported along the rod.
// rad, the one of its values (they differ by full turns) that is next to `near`.
static double twist_between(const RodShape* shape, int vertex, double near)
{
    Vec3d tf = shape->tangent[vertex + 1], mf = shape->director[vertex + 1];
    Vec3d me = transport(shape->director[vertex], shape->tangent[vertex], tf);
    double angle = atan2(vec3d_dot(vec3d_cross(me, mf), tf), vec3d_dot(me, mf));
    double turn = 2.0 * acos(-1.0);
    return angle + turn * round((near - angle) / turn);
}

static void edge_measure(RodShape* shape, int j)
{
    Vec3d edge = vec3d_sub(shape->position[j], shape->position[j - 1]);
    shape->length[j] = sqrt(vec3d_dot(edge, edge));
    shape->tangent[j] = vec3d_scale(edge, 1.0 / shape->length[j]);
}

void rod_elastic_untwist(int nodes, RodShape* shape)
{
    for (int j = 1; j < nodes; ++j) {
        edge_measure(shape, j);
        shape->director[j] =
            transport(shape->director[j - 1], shape->tangent[j - 1], shape->tangent[j]);
        shape->twist[j - 1] = 0.0;
    }
}

void rod_elastic_follow(int nodes, RodShape* shape, const RodShape* from, const double* change,
                        double scale)
{
    for (int j = 1; j < nodes; ++j) {
        edge_measure(shape, j);
        Vec3d t = shape->tangent[j], d = transport(from->director[j], from->tangent[j], t);
        d = unit(vec3d_mad(d, t, -vec3d_dot(d, t))); // against rounding
        double angle = change == NULL ? 0.0 : scale * change[ROD_BLOCK * (j - 1)];
        shape->director[j] = vec3d_mad(vec3d_scale(d, cos(angle)), vec3d_cross(t, d), sin(angle));
    }
    for (int i = 0; i < nodes - 1; ++i)
        shape->twist[i] = twist_between(shape, i, from->twist[i]);
}

void rod_elastic_move(int nodes, RodShape* shape, const RodShape* from, const double* change,
                      double scale)
{
    shape->position[0] = from->position[0];
    shape->tangent[0] = from->tangent[0];
    shape->director[0] = from->director[0];
    Vec3d inner = {0, 0, 0};
    for (int j = 1; j < nodes; ++j) {
        const double* c = change + (ptrdiff_t)ROD_BLOCK * (j - 1);
        Vec3d move = {c[1], c[2], c[3]}, by = vec3d_scale(vec3d_sub(move, inner), scale);
        inner = move;
        Vec3d t = from->tangent[j];
        double along = vec3d_dot(by, t), length = from->length[j];
        Vec3d side = vec3d_scale(vec3d_mad(by, t, -along), 1.0 / length);
        double angle = sqrt(vec3d_dot(side, side)), s = angle > 1e-9 ? sin(angle) / angle : 1.0;
        Vec3d turned = vec3d_mad(vec3d_scale(t, cos(angle)), side, s);
        shape->position[j] = vec3d_mad(shape->position[j - 1], turned, length + along);
    }
    rod_elastic_follow(nodes, shape, from, change, scale);
}

// kb = 2 te x tf / (1 + te . tf), of length 2 tan(turn / 2) (Bergou 2008).
static Vertex vertex_at(const RodShape* shape, int i)
{
    Vertex v = {.te = shape->tangent[i], .tf = shape->tangent[i + 1], .f = shape->length[i + 1]};
    v.e = i > 0 ? shape->length[i] : 1.0; // the clamp does not move, whatever its length
    v.chi = 1.0 + vec3d_dot(v.te, v.tf);
    v.kb = vec3d_scale(vec3d_cross(v.te, v.tf), 2.0 / v.chi);
    v.mean = vec3d_scale(vec3d_add(v.te, v.tf), 1.0 / v.chi);
    v.m1e = shape->director[i], v.m1f = shape->director[i + 1];
    v.m2e = vec3d_cross(v.te, v.m1e), v.m2f = vec3d_cross(v.tf, v.m1f);
    return v;
}

// (kb . (m2e + m2f) / 2, -kb . (m1e + m1f) / 2)
Vec2d rod_elastic_curvature(const RodShape* shape, int i)
{
    Vertex v = vertex_at(shape, i);
    return (Vec2d){0.5 * vec3d_dot(v.kb, vec3d_add(v.m2e, v.m2f)),
                   -0.5 * vec3d_dot(v.kb, vec3d_add(v.m1e, v.m1f))};
}

// hessian block += s a b^T
static void outer(Measure* m, int row, int column, Vec3d a, Vec3d b, double s)
{
    double p[3] = {a.x, a.y, a.z}, q[3] = {b.x, b.y, b.z};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            m->hessian[row + i][column + j] += s * p[i] * q[j];
}

static void outer_both(Measure* m, int at, Vec3d a, Vec3d b, double s)
{
    outer(m, at, at, a, b, s);
    outer(m, at, at, b, a, s);
}

static void diagonal(Measure* m, int row, int column, double s)
{
    for (int i = 0; i < 3; ++i)
        m->hessian[row + i][column + i] += s;
}

// hessian block += s [a]x, where [a]x b = a x b
static void skew(Measure* m, int row, int column, Vec3d a, double s)
{
    double p[3] = {a.x, a.y, a.z};
    for (int i = 0; i < 3; ++i) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        m->hessian[row + j][column + i] += s * p[k];
        m->hessian[row + i][column + j] -= s * p[k];
    }
}

static void put(double* to, Vec3d a)
{
    to[0] = a.x, to[1] = a.y, to[2] = a.z;
}

// kb . (pe + pf) / 2, where a turn of the frame moves p to -q and q to p: with (p, q) = (m2, m1)
// the first curvature, with (-m1, m2) the second. Gradient: Bergou 2010; second
// derivatives: Jawed 2018, symmetric part. Without `second` no hessian.
static void measure_curvature(Measure* m, const Vertex* v, Vec3d pe, Vec3d pf, Vec3d qe, Vec3d qf,
                              bool second)
{
    Vec3d p = vec3d_scale(vec3d_add(pe, pf), 1.0 / v->chi), mean = v->mean;
    Vec3d a = vec3d_cross(v->tf, p), b = vec3d_cross(v->te, p);
    double e = 1.0 / v->e, f = 1.0 / v->f, k = 0.5 * vec3d_dot(v->kb, vec3d_add(pe, pf));
    *m = (Measure){.value = k};
    put(m->gradient, vec3d_scale(vec3d_mad(a, mean, -k), e));
    put(m->gradient + 3, vec3d_scale(vec3d_mad(b, mean, k), -f));
    m->gradient[6] = -0.5 * vec3d_dot(v->kb, qe);
    m->gradient[7] = -0.5 * vec3d_dot(v->kb, qf);
    if (!second) return;

    outer(m, 0, 0, mean, mean, 2.0 * k * e * e);
    outer_both(m, 0, a, mean, -e * e);
    diagonal(m, 0, 0, -k / v->chi * e * e);
    outer(m, 0, 0, v->te, v->te, k / v->chi * e * e);
    outer_both(m, 0, v->kb, pe, 0.25 * e * e);

    outer(m, 3, 3, mean, mean, 2.0 * k * f * f);
    outer_both(m, 3, b, mean, f * f);
    diagonal(m, 3, 3, -k / v->chi * f * f);
    outer(m, 3, 3, v->tf, v->tf, k / v->chi * f * f);
    outer_both(m, 3, v->kb, pf, 0.25 * f * f);

    outer(m, 0, 3, mean, mean, 2.0 * k * e * f);
    outer(m, 0, 3, a, mean, -e * f);
    outer(m, 0, 3, mean, b, e * f);
    diagonal(m, 0, 3, -k / v->chi * e * f);
    outer(m, 0, 3, v->te, v->tf, -k / v->chi * e * f);
    skew(m, 0, 3, p, -e * f);

    const Vec3d q[2] = {qe, qf};
    for (int i = 0; i < 2; ++i) {
        Vec3d along = vec3d_scale(mean, 0.5 * vec3d_dot(v->kb, q[i]));
        Vec3d by_e = vec3d_scale(vec3d_mad(along, vec3d_cross(v->tf, q[i]), -1.0 / v->chi), e);
        Vec3d by_f = vec3d_scale(vec3d_mad(along, vec3d_cross(v->te, q[i]), 1.0 / v->chi), f);
        double column[6] = {by_e.x, by_e.y, by_e.z, by_f.x, by_f.y, by_f.z};
        for (int j = 0; j < 6; ++j)
            m->hessian[j][6 + i] = column[j];
    }
    m->hessian[6][6] = -0.5 * vec3d_dot(v->kb, pe);
    m->hessian[7][7] = -0.5 * vec3d_dot(v->kb, pf);
}

// Bergou 2008 (the twist that bending makes) and Jawed 2018.
static void measure_twist(Measure* m, const Vertex* v, double value, bool second)
{
    double e = 1.0 / v->e, f = 1.0 / v->f;
    *m = (Measure){.value = value};
    put(m->gradient, vec3d_scale(v->kb, 0.5 * e));
    put(m->gradient + 3, vec3d_scale(v->kb, 0.5 * f));
    m->gradient[6] = -1.0;
    m->gradient[7] = 1.0;
    if (!second) return;

    outer_both(m, 0, v->kb, vec3d_add(v->te, v->mean), -0.25 * e * e);
    outer_both(m, 3, v->kb, vec3d_add(v->tf, v->mean), -0.25 * f * f);
    skew(m, 0, 3, v->te, e * f / v->chi);
    outer(m, 0, 3, v->kb, v->mean, -0.5 * e * f);
}

// Which unknowns a vertex's local ones move: edge e is position i less position i - 1.
typedef struct Places {
    int plus[LOCAL], minus[LOCAL]; // -1: none, fixed
} Places;

static Places places_of(int i)
{
    Places p;
    for (int k = 0; k < 3; ++k) {
        p.plus[k] = i > 0 ? ROD_BLOCK * (i - 1) + 1 + k : -1;
        p.minus[k] = i > 1 ? ROD_BLOCK * (i - 2) + 1 + k : -1;
        p.plus[3 + k] = ROD_BLOCK * i + 1 + k;
        p.minus[3 + k] = p.plus[k];
    }
    p.plus[6] = i > 0 ? ROD_BLOCK * (i - 1) : -1;
    p.plus[7] = ROD_BLOCK * i;
    p.minus[6] = p.minus[7] = -1;
    return p;
}

static void matrix_add(double* matrix, int row, int column, double value)
{
    if (row >= 0 && column >= 0 && column <= row) matrix[ROD_ROW * row + row - column] += value;
}

// Adds stiffness (gradient of value^2 / 2 from its rest) of one measure to gradient and matrix.
static void scatter(const Measure* m, const Places* p, double rest, double stiffness,
                    double* gradient, double* matrix)
{
    double off = stiffness * (m->value - rest);
    for (int i = 0; i < LOCAL; ++i) {
        if (p->plus[i] >= 0) gradient[p->plus[i]] += off * m->gradient[i];
        if (p->minus[i] >= 0) gradient[p->minus[i]] -= off * m->gradient[i];
    }
    if (matrix == NULL) return;
    for (int i = 0; i < LOCAL; ++i)
        for (int j = 0; j < LOCAL; ++j) {
            double second = i < j ? m->hessian[i][j] : m->hessian[j][i];
            double h = stiffness * m->gradient[i] * m->gradient[j] + off * second;
            matrix_add(matrix, p->plus[i], p->plus[j], h);
            matrix_add(matrix, p->plus[i], p->minus[j], -h);
            matrix_add(matrix, p->minus[i], p->plus[j], -h);
            matrix_add(matrix, p->minus[i], p->minus[j], h);
        }
}

static void assemble_vertices(const RodElastic* rod, const RodShape* shape, double* gradient,
                              double* matrix)
{
    bool second = matrix != NULL;
    for (int i = 0; i < rod->nodes - 1; ++i) {
        Vertex v = vertex_at(shape, i);
        Places p = places_of(i);
        Measure m;
        double bend = rod->bending_nm2 / rod->share[i], twist = rod->twisting_nm2 / rod->share[i];
        measure_curvature(&m, &v, v.m2e, v.m2f, v.m1e, v.m1f, second);
        scatter(&m, &p, rod->rest_curvature[i].x, bend, gradient, matrix);
        Vec3d pe = vec3d_scale(v.m1e, -1.0), pf = vec3d_scale(v.m1f, -1.0);
        measure_curvature(&m, &v, pe, pf, v.m2e, v.m2f, second);
        scatter(&m, &p, rod->rest_curvature[i].y, bend, gradient, matrix);
        measure_twist(&m, &v, shape->twist[i], second);
        scatter(&m, &p, 0.0, twist, gradient, matrix);
    }
}

// E = EA l (|e| / l - 1)^2 / 2 of every edge: force EA (|e| / l - 1) along it.
static void assemble_edges(const RodElastic* rod, const RodShape* shape, double* gradient,
                           double* matrix)
{
    double ea = rod->stretching_n;
    for (int j = 1; j < rod->nodes; ++j) {
        double strain = shape->length[j] / rod->rest_length[j] - 1.0;
        double along = ea / rod->rest_length[j], side = ea * strain / shape->length[j];
        double t[3];
        put(t, shape->tangent[j]);
        int outer_at = ROD_BLOCK * (j - 1) + 1, inner_at = j > 1 ? outer_at - ROD_BLOCK : -1;
        for (int r = 0; r < 3; ++r) {
            gradient[outer_at + r] += ea * strain * t[r];
            if (inner_at >= 0) gradient[inner_at + r] -= ea * strain * t[r];
            for (int c = 0; matrix != NULL && c < 3; ++c) {
                double h = (along - side) * t[r] * t[c] + (r == c ? side : 0.0);
                matrix_add(matrix, outer_at + r, outer_at + c, h);
                if (inner_at < 0) continue;
                matrix_add(matrix, inner_at + r, inner_at + c, h);
                matrix_add(matrix, outer_at + r, inner_at + c, -h);
            }
        }
    }
}

void rod_elastic_assemble(const RodElastic* rod, const RodShape* shape, double* gradient,
                          double* matrix)
{
    assemble_vertices(rod, shape, gradient, matrix);
    assemble_edges(rod, shape, gradient, matrix);
}

// EI |kappa - rest|^2 / (2 l), l the length that a
// vertex stands for (Bergou 2008).
RodElasticEnergy rod_elastic_energy(const RodElastic* rod, const RodShape* shape)
{
    RodElasticEnergy energy = {0};
    for (int i = 0; i < rod->nodes - 1; ++i) {
        Vec2d k = rod_elastic_curvature(shape, i), rest = rod->rest_curvature[i];
        double x = k.x - rest.x, y = k.y - rest.y, twist = shape->twist[i];
        energy.bend += 0.5 * rod->bending_nm2 / rod->share[i] * (x * x + y * y);
        energy.twist += 0.5 * rod->twisting_nm2 / rod->share[i] * twist * twist;
        double strain = shape->length[i + 1] / rod->rest_length[i + 1] - 1.0;
        energy.stretch += 0.5 * rod->stretching_n * rod->rest_length[i + 1] * strain * strain;
    }
    return energy;
}
