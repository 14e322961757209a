#include "client/marschner.h"

#include <math.h>
#include <string.h>

#define DEG (M_PI / 180.0)

// The paper's replacement of the caustic: width, strength, least size, and over which range of the
// effective index it fades where the caustic goes.
#define CAUSTIC_WIDTH    (10.0 * DEG)
#define CAUSTIC_STRENGTH 1.0
#define CAUSTIC_MOST     0.5
#define CAUSTIC_FADE     0.3

Fibre marschner_fibre(void)
{
    return (Fibre){.eta = 1.55, .alpha_deg = -7.5, .beta_deg = 7.5, .width_deg = 10.0};
}

double marschner_absorption(double albedo)
{
    double r = 0.3; // azimuthal roughness in the fit
    double fit = 5.969 + r * (-0.215 + r * (2.532 + r * (-10.73 + r * (5.574 + r * 0.245))));
    double root = log(fmin(fmax(albedo, 1e-4), 1.0)) / fit;
    return root * root;
}

FibreOptics marschner_optics(double eta, double cos_d)
{
    double c = fmin(fmax(cos_d, 1e-6), 1.0), sin2 = 1.0 - c * c;
    double root = sqrt(eta * eta - sin2);
    return (FibreOptics){root / c, eta * eta * c / root, root / eta};
}

// Fresnel's reflectance of an unpolarised ray, with the one refraction angle that both indices
// share.
static double fresnel(const FibreOptics* optics, double cos_i, double cos_t)
{
    double s = (cos_i - optics->index_s * cos_t) / (cos_i + optics->index_s * cos_t);
    double p = (optics->index_p * cos_i - cos_t) / (optics->index_p * cos_i + cos_t);
    return 0.5 * (s * s + p * p);
}

static double cos_refracted(const FibreOptics* optics, double gamma)
{
    double h = sin(gamma) / optics->index_s;
    return sqrt(1.0 - h * h);
}

double marschner_attenuation(const FibreOptics* optics, int lobe, double gamma, double absorption)
{
    double cos_t = cos_refracted(optics, gamma);
    double f = fresnel(optics, cos(gamma), cos_t);
    if (lobe == LOBE_R) return f;
    double once = exp(-absorption * 2.0 * cos_t / optics->cos_t);
    double through = (1.0 - f) * (1.0 - f) * once;
    return lobe == LOBE_TT ? through : through * f * once;
}

static void attenuations(const Fibre* fibre, const FibreOptics* optics, int lobe, double gamma,
                         double out[MARSCHNER_CHANNELS])
{
    double clear = marschner_attenuation(optics, lobe, gamma, 0.0);
    double chord = 2.0 * cos_refracted(optics, gamma) / optics->cos_t;
    for (int c = 0; c < MARSCHNER_CHANNELS; ++c)
        out[c] = clear * (lobe > 0 ? exp(-fibre->absorption[c] * chord * lobe) : 1.0);
}

// Gauss and Legendre's eight points, on panels of 0..pi/2.
static const double gauss_x[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                  0.9602898564975363};
static const double gauss_w[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                  0.1012285362903763};

static double gauss_point(int panels, int i, double* weight)
{
    double half = M_PI / 4.0 / panels;
    int k = i % 8;
    double x = k < 4 ? -gauss_x[k] : gauss_x[k - 4];
    *weight = gauss_w[k % 4] * half;
    return (2 * (i / 8) + 1 + x) * half;
}

double marschner_energy(double eta, double cos_d, int lobe, double absorption)
{
    FibreOptics optics = marschner_optics(eta, cos_d);
    double sum = 0, weight;
    for (int i = 0; i < 8 * 64; ++i) {
        double gamma = gauss_point(64, i, &weight);
        sum += weight * cos(gamma) * marschner_attenuation(&optics, lobe, gamma, absorption);
    }
    return sum;
}

double marschner_tail(double eta, double cos_d, double absorption)
{
    FibreOptics optics = marschner_optics(eta, cos_d);
    double sum = 0, weight;
    for (int i = 0; i < 8 * 64; ++i) {
        double gamma = gauss_point(64, i, &weight), cos_t = cos_refracted(&optics, gamma);
        double ft =
            fresnel(&optics, cos(gamma), cos_t) * exp(-absorption * 2.0 * cos_t / optics.cos_t);
        double trt = marschner_attenuation(&optics, LOBE_TRT, gamma, absorption);
        sum += weight * cos(gamma) * trt * ft / (1.0 - ft);
    }
    return sum;
}

// Where a ray that enters at gamma leaves, p refractions inside; and the derivative by gamma.
static double exit_angle(const FibreOptics* optics, int p, double gamma)
{
    return 2.0 * p * asin(sin(gamma) / optics->index_s) - 2.0 * gamma + p * M_PI;
}

static double exit_slope(const FibreOptics* optics, int p, double gamma)
{
    double s = sin(gamma);
    return 2.0 * p * cos(gamma) / sqrt(optics->index_s * optics->index_s - s * s) - 2.0;
}

// Adds what leaves towards `phi` of rays that enter from `low` to `high`, where the exit angle is
// monotone. Bisection, to the last bit: f has one sign change or none.
static void add_root(const Fibre* fibre, const FibreOptics* optics, int p, double phi, double low,
                     double high, double out[MARSCHNER_CHANNELS])
{
    double at_low = exit_angle(optics, p, low) - phi, at_high = exit_angle(optics, p, high) - phi;
    if ((at_low > 0.0) == (at_high > 0.0)) return;
    for (int i = 0; i < 200; ++i) {
        double middle = 0.5 * (low + high);
        if (middle == low || middle == high) break;
        bool like_low = (exit_angle(optics, p, middle) - phi > 0.0) == (at_low > 0.0);
        *(like_low ? &low : &high) = middle;
    }
    double gamma = 0.5 * (low + high), a[MARSCHNER_CHANNELS];
    double weight = cos(gamma) / (2.0 * fabs(exit_slope(optics, p, gamma)));
    attenuations(fibre, optics, p, gamma, a);
    for (int c = 0; c < MARSCHNER_CHANNELS; ++c)
        out[c] += a[c] * weight;
}

// Sine of the entry angle at which TRT turns back, below an index of 2.
static double turning_point(const FibreOptics* optics)
{
    return sqrt((4.0 - optics->index_s * optics->index_s) / 3.0);
}

static void add_exact(const Fibre* fibre, const FibreOptics* optics, int lobe, double phi,
                      double out[MARSCHNER_CHANNELS])
{
    if (lobe == LOBE_R) {
        double half = 0.5 * fabs(remainder(phi, 2.0 * M_PI));
        double n = marschner_attenuation(optics, LOBE_R, half, 0.0) * cos(half) / 4.0;
        for (int c = 0; c < MARSCHNER_CHANNELS; ++c)
            out[c] += n;
        return;
    }
    double end = 0.5 * M_PI;
    bool turns = lobe == LOBE_TRT && optics->index_s < 2.0;
    double turn = turns ? asin(turning_point(optics)) : 0.0;
    for (int k = -2; k <= 3; ++k) {
        double towards = phi + 2.0 * M_PI * k;
        if (!turns) {
            add_root(fibre, optics, lobe, towards, -end, end, out);
            continue;
        }
        add_root(fibre, optics, lobe, towards, -end, -turn, out);
        add_root(fibre, optics, lobe, towards, -turn, turn, out);
        add_root(fibre, optics, lobe, towards, turn, end, out);
    }
}

double marschner_caustic(double eta, double cos_d)
{
    FibreOptics optics = marschner_optics(eta, cos_d);
    if (optics.index_s >= 2.0) return (double)NAN;
    double gamma = asin(turning_point(&optics));
    return fabs(remainder(exit_angle(&optics, 2, gamma), 2.0 * M_PI));
}

static double gauss(double x, double deviation)
{
    double t = x / deviation;
    return exp(-0.5 * t * t) / (deviation * sqrt(2.0 * M_PI));
}

// The paper's appendix: takes the caustic's peak away and puts a Gaussian of its energy there. It
// fades out as the index passes 2 and the caustic goes (the paper prints it the other way round).
static void replace_caustic(const Fibre* fibre, const FibreOptics* optics, double phi,
                            double out[MARSCHNER_CHANNELS])
{
    double n = optics->index_s, h = 0.0, at = 0.0, size = CAUSTIC_MOST, fade = 1.0;
    if (n < 2.0) {
        h = turning_point(optics);
        at = remainder(exit_angle(optics, 2, asin(h)), 2.0 * M_PI);
        double bend = 4.0 * h / pow(n * n - h * h, 1.5) - 2.0 * h / pow(1.0 - h * h, 1.5);
        size = fmin(CAUSTIC_MOST, 2.0 * sqrt(2.0 * CAUSTIC_WIDTH / fabs(bend)));
    } else {
        double t = fmin((n - 2.0) / CAUSTIC_FADE, 1.0);
        fade = 1.0 - t * t * (3.0 - 2.0 * t);
    }
    double left = gauss(remainder(phi - at, 2.0 * M_PI), CAUSTIC_WIDTH);
    double right = gauss(remainder(phi + at, 2.0 * M_PI), CAUSTIC_WIDTH);
    double peak = gauss(0.0, CAUSTIC_WIDTH), a[MARSCHNER_CHANNELS];
    attenuations(fibre, optics, LOBE_TRT, asin(h), a);
    for (int c = 0; c < MARSCHNER_CHANNELS; ++c) {
        out[c] *= (1.0 - fade * left / peak) * (1.0 - fade * right / peak);
        out[c] += fade * CAUSTIC_STRENGTH * a[c] * size * (left + right);
    }
}

static double wrapped_gauss(double x, double deviation)
{
    double d = fabs(remainder(x, 2.0 * M_PI));
    if (d > 9.0 * deviation) return 0.0;
    double sum = gauss(d, deviation);
    for (int k = 1; 2.0 * M_PI * k - d < 9.0 * deviation; ++k)
        sum += gauss(2.0 * M_PI * k - d, deviation) + gauss(2.0 * M_PI * k + d, deviation);
    return sum;
}

// N = 1/2 int A(h) G(phi - exit(h)) dh. Rays at h and -h leave at opposite azimuths. Panels are no
// wider than the blur, so that eight points see all of it.
static void add_rough(const Fibre* fibre, const FibreOptics* optics, int lobe, const double* phi,
                      int count, Scatter* out)
{
    double deviation = fibre->width_deg * DEG, weight, a[MARSCHNER_CHANNELS];
    int panels = (int)ceil(0.5 * M_PI / deviation);
    if (panels < 6) panels = 6;
    for (int i = 0; i < 8 * panels; ++i) {
        double gamma = gauss_point(panels, i, &weight), exit = exit_angle(optics, lobe, gamma);
        attenuations(fibre, optics, lobe, gamma, a);
        weight *= 0.5 * cos(gamma);
        for (int j = 0; j < count; ++j) {
            double g = weight * (wrapped_gauss(phi[j] - exit, deviation) +
                                 wrapped_gauss(phi[j] + exit, deviation));
            if (g == 0.0) continue;
            for (int c = 0; c < MARSCHNER_CHANNELS; ++c)
                out[j].lobe[lobe][c] += a[c] * g;
        }
    }
}

void marschner_azimuths(const Fibre* fibre, double cos_d, const double* phi, int count,
                        Scatter* out)
{
    FibreOptics optics = marschner_optics(fibre->eta, cos_d);
    memset(out, 0, sizeof *out * (size_t)count);
    for (int lobe = 0; lobe < LOBES; ++lobe) {
        if (fibre->azimuth == AZIMUTH_ROUGH) {
            add_rough(fibre, &optics, lobe, phi, count, out);
            continue;
        }
        for (int j = 0; j < count; ++j)
            add_exact(fibre, &optics, lobe, phi[j], out[j].lobe[lobe]);
    }
    for (int j = 0; j < count; ++j) {
        double* trt = out[j].lobe[LOBE_TRT];
        if (fibre->azimuth == AZIMUTH_CAUSTIC) replace_caustic(fibre, &optics, phi[j], trt);
        for (int c = 0; c < MARSCHNER_CHANNELS && fibre->azimuth == AZIMUTH_CLAMPED; ++c)
            trt[c] = fmin(trt[c], MARSCHNER_CLAMP_AT);
    }
}

double marschner_tilt(const Fibre* fibre, int lobe)
{
    static const double scales[LOBES] = {1.0, -0.5, -1.5};
    if (fibre->tt_as_trt && lobe == LOBE_TT) lobe = LOBE_TRT;
    return fibre->alpha_deg * DEG * scales[lobe];
}

double marschner_spread(const Fibre* fibre, int lobe)
{
    static const double scales[LOBES] = {1.0, 0.5, 2.0};
    if (fibre->tt_as_trt && lobe == LOBE_TT) lobe = LOBE_TRT;
    return fibre->beta_deg * DEG * scales[lobe];
}

// ln of the modified Bessel function of order 0.
static double log_bessel(double x)
{
    if (x > 30.0) {
        double y = 1.0 / (8.0 * x);
        double series = 1.0 + y * (1.0 + y * (4.5 + y * (37.5 + y * (459.375 + y * 7441.875))));
        return x - 0.5 * log(2.0 * M_PI * x) + log(series);
    }
    double sum = 1.0, term = 1.0;
    for (int i = 1; i < 80; ++i)
        sum += term *= 0.25 * x * x / (i * i);
    return log(sum);
}

double marschner_deon_norm(double v)
{
    return 1.0 / v + log(v * (1.0 - exp(-2.0 / v)));
}

static double cosine(double sine)
{
    return sqrt(fmax(1.0 - sine * sine, 0.0));
}

// The cone tilts to theta_i + theta_r = 2 alpha: as if the eye stood at theta_r - 2 alpha. The
// spread is of theta_h, which moves half as far as theta_i: hence (2 beta)^2.
static double deon(double tilt, double spread, double sin_i, double sin_r)
{
    double v = 4.0 * spread * spread;
    double sin_o = sin_r * cos(2.0 * tilt) - cosine(sin_r) * sin(2.0 * tilt);
    double along = sin_i * sin_o / v, across = cosine(sin_i) * cosine(sin_o) / v;
    return exp(log_bessel(across) - along - marschner_deon_norm(v));
}

static double cos_difference(double sin_i, double sin_r)
{
    return sqrt(fmax(0.5 * (1.0 + cosine(sin_i) * cosine(sin_r) + sin_i * sin_r), 1e-12));
}

double marschner_longitudinal(const Fibre* fibre, int lobe, double sin_i, double sin_r)
{
    double tilt = marschner_tilt(fibre, lobe), spread = marschner_spread(fibre, lobe);
    if (fibre->norm == NORM_DEON) return deon(tilt, spread, sin_i, sin_r);
    double cos_d = cos_difference(sin_i, sin_r);
    double theta_h = asin(fmin(fmax(0.5 * (sin_i + sin_r) / cos_d, -1.0), 1.0));
    double area = fibre->norm == NORM_HALF ? 0.5 : 1.0;
    return area * gauss(theta_h - tilt, spread) * cosine(sin_i) / (cos_d * cos_d);
}

double marschner_row(const Fibre* fibre, double sin_i, double sin_r)
{
    return fibre->norm == NORM_DEON ? cosine(sin_r) : cos_difference(sin_i, sin_r);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Scatter marschner_scatter(const Fibre* fibre, const double tangent[3], const double light[3],
                          const double view[3])
{
    double sin_i = dot(light, tangent), sin_r = dot(view, tangent);
    double across = (dot(light, view) - sin_i * sin_r) / fmax(cosine(sin_i) * cosine(sin_r), 1e-12);
    double phi = acos(fmin(fmax(across, -1.0), 1.0));
    Scatter scatter;
    marschner_azimuths(fibre, marschner_row(fibre, sin_i, sin_r), &phi, 1, &scatter);
    for (int lobe = 0; lobe < LOBES; ++lobe) {
        double m = marschner_longitudinal(fibre, lobe, sin_i, sin_r);
        for (int c = 0; c < MARSCHNER_CHANNELS; ++c)
            scatter.lobe[lobe][c] *= m;
    }
    return scatter;
}
