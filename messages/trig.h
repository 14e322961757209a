// Sine, cosine, exponential and power from + - * / alone, so that motions and growth give the same
// bits on every machine (libm does not promise that). Double; errors below 1e-12 in the ranges
// that are stated. See notes on determinism in server/README.md.
#pragma once

#include <math.h>

#define TRIG_PI 3.14159265358979323846

// sin(x) for |x| < 1e6: reduced to [-pi/2, pi/2], then the Taylor series to x^17.
static inline double trig_sin(double x)
{
    double turns = floor(x / TRIG_PI + 0.5);
    double r = (x - turns * 3.141592653589793116) - turns * 1.2246467991473532e-16;
    double s = r * r;
    double sum = 1.0 / 355687428096000.0;
    sum = sum * s - 1.0 / 1307674368000.0;
    sum = sum * s + 1.0 / 6227020800.0;
    sum = sum * s - 1.0 / 39916800.0;
    sum = sum * s + 1.0 / 362880.0;
    sum = sum * s - 1.0 / 5040.0;
    sum = sum * s + 1.0 / 120.0;
    sum = sum * s - 1.0 / 6.0;
    sum = r + r * s * sum;
    return floor(turns * 0.5) * 2.0 == turns ? sum : -sum;
}

static inline double trig_cos(double x)
{
    return trig_sin(x + 0.5 * TRIG_PI);
}

// atan(x) for any x: halved twice below tan(pi/16), then the series to x^17.
static inline double trig_atan(double x)
{
    double t = fabs(x) > 1.0 ? 1.0 / x : x;
    for (int i = 0; i < 2; ++i)
        t = t / (1.0 + sqrt(1.0 + t * t));
    double s = t * t, sum = 0.0;
    for (int i = 17; i >= 1; i -= 2)
        sum = 1.0 / i - s * sum;
    sum *= 4.0 * t;
    if (fabs(x) <= 1.0) return sum;
    return (x > 0.0 ? 0.5 : -0.5) * TRIG_PI - sum;
}

// The angle of (x, y) from the x axis, -pi to pi; 0 for (0, 0).
static inline double trig_atan2(double y, double x)
{
    if (x == 0.0 && y == 0.0) return 0.0;
    if (fabs(y) > fabs(x)) return (y > 0.0 ? 0.5 : -0.5) * TRIG_PI - trig_atan(x / y);
    return trig_atan(y / x) + (x > 0.0 ? 0.0 : y >= 0.0 ? TRIG_PI : -TRIG_PI);
}

// exp(x) for x < 700, 0 below -700: halved ten times, Taylor to x^12, squared back.
static inline double trig_exp(double x)
{
    double r = x / 1024.0, sum = 1.0;
    if (x < -700.0) return 0.0;
    for (int i = 12; i >= 1; --i)
        sum = 1.0 + r * sum / i;
    for (int i = 0; i < 10; ++i)
        sum *= sum;
    return sum;
}

// log(x) for 1e-30 < x < 1e30: halved or doubled into [0.75, 1.5], then atanh's series.
static inline double trig_log(double x)
{
    double powers = 0.0;
    for (; x > 1.5; x *= 0.5)
        powers += 1.0;
    for (; x < 0.75; x *= 2.0)
        powers -= 1.0;
    double z = (x - 1.0) / (x + 1.0), s = z * z, sum = 0.0;
    for (int i = 25; i >= 1; i -= 2)
        sum = sum * s + 1.0 / i;
    return powers * 0.69314718055994530942 + 2.0 * z * sum;
}

// x^y for x > 0; 0 for x <= 0.
static inline double trig_pow(double x, double y)
{
    return x > 1e-30 ? trig_exp(y * trig_log(x)) : 0.0;
}

// Smootherstep of u clamped to 0..1: u^3 (10 - 15 u + 6 u^2); C2 at both ends.
static inline double trig_smooth(double u)
{
    u = u < 0.0 ? 0.0 : u > 1.0 ? 1.0 : u;
    return u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
}
