// What one hair makes of light (Marschner et al. 2003), in double and without a GL: lobes R (off
// the surface), TT (through) and TRT (off the back wall), each a product of M along the hair and N
// around it. It makes the tables of the shader, and is the exact function that those are held to.
//
// Angles: theta is the inclination from the plane across the hair, towards the tip; theta_d half
// the difference of both inclinations; phi the azimuth between light and eye, 0 where both stand on
// one side. The fibre has radius 1. The notes say where the paper and its followers err: M has half
// the paper's weight (a mirror is delta(theta_i + theta_r), and theta_h is half that sum), and
// light crosses a chord of 2 cos gamma_t / cos theta_t.
#pragma once

#include <stdbool.h>

enum { LOBE_R, LOBE_TT, LOBE_TRT, LOBES };

// Absorption and what follows from it: red, green and blue at the root, then at the tip.
enum { MARSCHNER_CHANNELS = 6 };

// HALF is a Gaussian of area 1/2 over theta_h; PAPER the same of area 1, which sends twice the
// light that comes; DEON (d'Eon et al. 2011) conserves it exactly, tilt or not.
typedef enum MarschnerNorm { NORM_HALF, NORM_PAPER, NORM_DEON, NORMS } MarschnerNorm;

// How N is made. ROUGH: every ray's exit is blurred by a wrapped Gaussian (d'Eon 2011), so that
// there is no caustic and no energy is lost. EXACT: the smooth fibre, by its roots; infinite at
// caustics. CAUSTIC: the paper's replacement of the TRT caustic. CLAMPED: TRT cut off at CLAMP_AT.
typedef enum MarschnerAzimuth {
    AZIMUTH_ROUGH,
    AZIMUTH_EXACT,
    AZIMUTH_CAUSTIC,
    AZIMUTH_CLAMPED
} MarschnerAzimuth;

#define MARSCHNER_CLAMP_AT 0.5

typedef struct Fibre {
    double eta;       // index of refraction
    double alpha_deg; // tilt of R's cone; TT has -1/2 of it, TRT -3/2 (both follow from the scales)
    double beta_deg;  // width of R along the hair; TT has 1/2 of it, TRT twice
    double width_deg; // of ROUGH's blur around the hair, standard deviation
    double absorption[MARSCHNER_CHANNELS]; // per radius
    MarschnerNorm norm;
    MarschnerAzimuth azimuth;
    bool tt_as_trt; // M_TT = M_TRT, as one table less was once saved
} Fibre;

// Of a smooth fibre at one theta_d: its two effective indices (Bravais) and the refracted ray's
// slope.
typedef struct FibreOptics {
    double index_s, index_p, cos_t;
} FibreOptics;

typedef struct Scatter {
    double lobe[LOBES][MARSCHNER_CHANNELS];
} Scatter;

// Brown hair, uncoloured: eta 1.55, alpha -7.5, beta 7.5, width 10 degrees.
Fibre marschner_fibre(void);

// Absorption with which hair of many fibres has about this albedo, linear 0..1 (Chiang et al. 2016,
// their fit for an azimuthal roughness of 0.3).
double marschner_absorption(double albedo);

FibreOptics marschner_optics(double eta, double cos_d);

// What leaves by `lobe` of a ray that enters at `gamma`, for one absorption.
double marschner_attenuation(const FibreOptics* optics, int lobe, double gamma, double absorption);

// Mean of that over the fibre's width: the energy of a lobe. And of all later lobes together.
double marschner_energy(double eta, double cos_d, int lobe, double absorption);
double marschner_tail(double eta, double cos_d, double absorption);

// N of every lobe at `count` azimuths (radians).
void marschner_azimuths(const Fibre* fibre, double cos_d, const double* phi, int count,
                        Scatter* out);

// Where the caustic of TRT lies, radians; NAN where there is none.
double marschner_caustic(double eta, double cos_d);

// Tilt and width of M, radians.
double marschner_tilt(const Fibre* fibre, int lobe);
double marschner_spread(const Fibre* fibre, int lobe);

// M times cos theta_i / cos^2 theta_d (of DEON: M alone): all of a lobe but its N.
double marschner_longitudinal(const Fibre* fibre, int lobe, double sin_i, double sin_r);

// ln(2 v sinh(1 / v)): the norm of DEON's M at variance v.
double marschner_deon_norm(double v);

// cos theta_d, the row of N; DEON's has cos theta_r for it, so that energy is exact at every view.
double marschner_row(const Fibre* fibre, double sin_i, double sin_r);

// S cos theta_i: radiance towards unit `view` for irradiance 1 across the beam from unit `light`.
Scatter marschner_scatter(const Fibre* fibre, const double tangent[3], const double light[3],
                          const double view[3]);
