// Marschner et al. 2003, whose twin in double is client/marschner.c: M along the hair is computed,
// N around it read from a table.
#include "lights.glsl"
#include "strand.glsl"
#include "kajiya.glsl"
#include "deon.glsl"
#include "marschner_tables.glsl"

uniform vec3 marschner_tilt, marschner_spread; // of R, TT, TRT, radians
uniform float marschner_area;                  // of M over theta_h; 0: M is d'Eon's
uniform vec3 marschner_deon_norm;              // of R, TT, TRT
uniform vec3 marschner_shine;                  // R's own colour
// Weights of TT and TRT, of Kajiya's diffuse term, of `faces`.
uniform float marschner_through, marschner_diffuse, marschner_wrap;
uniform float marschner_most; // of a lobe: along a strand that is lit from behind R has no bound

float largest(vec3 v)
{
    return max(v.r, max(v.g, v.b));
}

float squared(float x)
{
    return x * x;
}

// M cos theta_i / cos^2 theta_d of R, TT and TRT.
vec3 marschner_longitudinal(float sin_i, float cos_i, float sin_r, float cos_r, float cos_d)
{
    if (marschner_area == 0.0) {
        vec3 m;
        for (int lobe = 0; lobe < 3; ++lobe)
            m[lobe] = deon(sin_i, cos_i, sin_r, cos_r, marschner_tilt[lobe], marschner_spread[lobe],
                           marschner_deon_norm[lobe]);
        return m;
    }
#if MARSCHNER_NALU
    vec4 table = along_table(sin_i, sin_r);
    return table.rgb * marschner_along_scale * (cos_i / max(squared(table.a), 1e-6));
#else
    float half_angle = arc_sin(0.5 * (sin_i + sin_r) / cos_d);
    vec3 x = (vec3(half_angle) - marschner_tilt) / marschner_spread;
    vec3 gauss = exp(-0.5 * x * x) / (2.50662827463 * marschner_spread);
    return gauss * (marschner_area * cos_i / (cos_d * cos_d));
#endif
}

Lobes marschner_shade(Strand s, vec3 light, vec3 view)
{
    float sin_i = dot(light, s.tangent), sin_r = dot(view, s.tangent);
    vec3 across_light = light - sin_i * s.tangent, across_view = view - sin_r * s.tangent;
    float cos_i = length(across_light), cos_r = length(across_view);
    across_light /= max(cos_i, 1e-6);
    across_view /= max(cos_r, 1e-6);
    float cos_d = sqrt(max(0.5 * (1.0 + cos_i * cos_r + sin_i * sin_r), 1e-6));
    vec3 m = marschner_longitudinal(sin_i, cos_i, sin_r, cos_r, cos_d);
    float r;
    vec3 tt, trt;
#if MARSCHNER_NALU
    cos_d = along_table(sin_i, sin_r).a;
#endif
    float row = marschner_area == 0.0 ? cos_r : cos_d;
    marschner_azimuth(across_light, across_view, row, s.along, r, tt, trt);
    float diffuse = marschner_diffuse * INV_PI * kajiya_diffuse(s.tangent, light);
    float lit = mix(1.0, faces(s.normal, light), marschner_wrap);
    // What other fibres send on has crossed pigment once more than this fibre's own.
    vec3 hue = s.colour / max(largest(s.colour), 1e-6);
    vec3 through = (1.0 + s.among * (marschner_through - 1.0) * hue) * (m.y * tt + m.z * trt);
    vec3 body = through * min(1.0, marschner_most / max(largest(through), 1e-6)) +
                diffuse * s.colour;
    return Lobes(body * lit, marschner_shine * (min(m.x * r, marschner_most) * lit));
}
