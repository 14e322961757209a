// Stiffest modes of strands as the models see them, by eigenvalues of N links: what a stability
// bound that was measured is held against.
#pragma once

#include "server/sim.h"

#include <math.h>

#define MODES_LINKS 64

// The largest eigenvalue of a symmetric matrix, by powers.
static inline double modes_largest(const double* m, int size)
{
    double v[MODES_LINKS], w[MODES_LINKS], value = 0.0;
    for (int i = 0; i < size; ++i)
        v[i] = i % 2 == 0 ? 1.0 : -1.0;
    for (int pass = 0; pass < 3000; ++pass) {
        double sum = 0.0;
        for (int i = 0; i < size; ++i) {
            w[i] = 0.0;
            for (int j = 0; j < size; ++j)
                w[i] += m[i * size + j] * v[j];
            sum += w[i] * w[i];
        }
        value = sqrt(sum);
        for (int i = 0; i < size; ++i)
            v[i] = w[i] / value;
    }
    return value;
}

// Rows of D, one a joint: the angle of joint n for displacements y (cascade) or directions
// (forest).
static inline double modes_joint(ModelKind model, int joint, int column)
{
    int back = joint - column;
    if (model == MODEL_FOREST) return back == 0 ? 1 : back == 1 ? -1 : 0;
    return back == 0 ? 1 : back == 1 ? -2 : back == 2 ? 1 : 0;
}

// w^2 / k of the stiffest mode of N links, where joint n is `share`[n - 1] times as stiff as k
// (NULL: all alike): of D^T S D, S twice the share at the clamped root. Node or link n stands in
// column n - 1; in the cascade y0 = 0 and node -1 lies on the clamp.
static inline double modes_stiffest(ModelKind model, int links, const double* share)
{
    double m[MODES_LINKS * MODES_LINKS] = {0};
    if (model == MODEL_SPRING) return 1.0;
    for (int joint = 0; joint < links; ++joint) {
        double k = (joint == 0 ? 2.0 : 1.0) * (share != NULL ? share[joint] : 1.0);
        for (int i = 0; i < links; ++i)
            for (int j = 0; j < links; ++j)
                m[i * links + j] += k * modes_joint(model, joint, i) * modes_joint(model, joint, j);
    }
    return modes_largest(m, links);
}

// Of the chain without a clamp, as forest-z is printed: its Laplacian's mode 1 ... N.
static inline double modes_laplacian(int links, int mode)
{
    double s = sin((2 * mode - 1) * 3.14159265358979 / (2 * (2 * links + 1)));
    return 4 * s * s;
}
