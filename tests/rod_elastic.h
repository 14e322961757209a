// The elastic part of rod.c: shapes with their frames, energy and its derivatives. No time in it.
//
// Unknowns: for node j = 1 .. nodes - 1 a block of four, the angle of edge j (which ends in node j)
// and the position of node j. Vertex i (node i, between the edges i and i + 1) joins the positions
// of nodes i - 1 to i + 1 and two angles: 11 unknowns in a row, so the matrix of second derivatives
// has ROD_BAND diagonals on either side. Edge 0 is the clamp: it has a direction and a frame, but
// no unknowns; node 0 has none either.
#pragma once

#include "messages/vec.h"

#define ROD_BLOCK 4
#define ROD_BAND  10
#define ROD_ROW   (ROD_BAND + 1) // of the lower half, row by row: entry k of row i is column i - k

typedef struct Vec2d {
    double x, y;
} Vec2d;

typedef struct RodShape {
    Vec3d* position; // [nodes], m
    Vec3d* tangent;  // [nodes], of edges; unit
    Vec3d* director; // [nodes], of edges: the material's first axis across, unit; second: t x first
    double* length;  // [nodes], of edges, m; entry 0 unused
    double* twist;   // [nodes - 1], of vertices, rad, counted through full turns
} RodShape;

typedef struct RodElastic {
    int nodes;
    double bending_nm2, twisting_nm2, stretching_n; // E I, G J, E A
    double* rest_length;                            // [nodes], of edges, m
    double* share;                                  // [nodes - 1], length of a vertex, m
    Vec2d* rest_curvature;                          // [nodes - 1], along the directors, no unit
} RodElastic;

// J
typedef struct RodElasticEnergy {
    double stretch, bend, twist;
} RodElasticEnergy;

// Some unit vector across `a`, always the same.
Vec3d rod_elastic_across(Vec3d a);

// Tangents, lengths and frames from the positions and the clamp's frame; no twist.
void rod_elastic_untwist(int nodes, RodShape* shape);

// Tangents, lengths, frames and twist from the positions and the clamp's frame, the frames being
// those of `from` carried along in time (Bergou 2010) and then turned by the angles in
// scale * change (NULL: not at all).
void rod_elastic_follow(int nodes, RodShape* shape, const RodShape* from, const double* change,
                        double scale);

// `shape` = `from` with the unknowns moved by scale * change, to first order: what moves an edge
// across itself turns it, so that a large step bends the rod but does not stretch it. (Straight
// moves stretch it at second order, times EA: Newton then takes hundreds of small steps to an
// equilibrium.)
void rod_elastic_move(int nodes, RodShape* shape, const RodShape* from, const double* change,
                      double scale);

// Curvature of vertex `i` along its directors: kappa of Bergou 2010, of length 2
// tan(turn/2).
Vec2d rod_elastic_curvature(const RodShape* shape, int i);

RodElasticEnergy rod_elastic_energy(const RodElastic* rod, const RodShape* shape);

// Adds the energy's derivatives to `gradient` [unknowns] and, where it is not NULL, to `matrix`
// [unknowns][ROD_ROW]. Exact where no torque is left; else but for a term proportional to it.
void rod_elastic_assemble(const RodElastic* rod, const RodShape* shape, double* gradient,
                          double* matrix);
