// The shaders of a shading, run on single strands: directions in, radiance out, in floating point.
// What the accuracy tests and hair-bench shading hold against closed forms and client/marschner.h.
#pragma once

#include "client/shading.h"

typedef struct ShadePoint {
    float light[3], view[3], tangent[3]; // unit
    float along;                         // 0 root to 1 tip
} ShadePoint;

typedef struct ShadedPoint {
    float body[3], shine[3];
} ShadedPoint;

// The function under test and its arguments `point` (a ShadePoint) and `strand`, as a GLSL
// expression that makes a Lobes; NULL is the shading itself.
extern const HairMaterial shade_points_grey; // where no colour matters
bool shade_points(const Gl* gl, const ShadingOptions* options, const HairMaterial* material,
                  const char* expression, const ShadePoint* points, int count, ShadedPoint* out,
                  Fault* fault);

// (theta, phi) as a direction, for a strand along +Y.
void shade_points_aim(float out[3], double theta_deg, double phi_deg);

// `count` pairs of directions, each uniform over the sphere, all at strands along +Y.
void shade_points_random(ShadePoint* points, int count, uint32_t seed);

// The exact function of the same points, body and shine as the shader splits them.
void shade_points_exact(const Fibre* fibre, const ShadePoint* points, int count, ShadedPoint* out);

// A strand of marschner that stands alone, as the exact function has it: nothing in it stands for
// other strands, and no lobe is cut.
ShadingOptions shade_points_alone(ShadingKind kind, const Fibre* fibre);

// How far two lists are apart, red, green and blue alike: in sRGB codes of 8 bits, 99.5 % of
// `exact` being shown below white; and the mean linear error over the mean.
typedef struct CodeErrors {
    double mean, p99, most, rms_linear;
} CodeErrors;

CodeErrors shade_points_errors(const ShadedPoint* exact, const ShadedPoint* shaded, int count);

// What a strand sends to an eye at inclination `theta_deg` where light 1 comes from everywhere, by
// midpoints: 1 is all of it.
bool shade_points_furnace(const Gl* gl, const ShadingOptions* options, double theta_deg,
                          double* sum, Fault* fault);

// A fibre as marschner_endtoend.csv has it, grey: eta 1.55, sigma 0.2, alpha -7.5, beta 7.5.
Fibre shade_points_fibre(MarschnerAzimuth azimuth);
