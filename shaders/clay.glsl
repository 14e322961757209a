// White clay: each fibre a diffuse cylinder of albedo 0.8, to judge light and shadow without colour or
// highlight, and against a path tracer's clay. The mean of Lambert's law over the width that is seen:
// 1/2 of the integral over visible normals gamma of cos gamma max(cos(gamma - phi), 0) is
// ((pi - phi) cos phi + sin phi) / 4, phi the azimuth between light and eye.
#include "lights.glsl"
#include "strand.glsl"

const float CLAY_ALBEDO = 0.8;

Lobes clay_shade(Strand s, vec3 light, vec3 view)
{
    vec3 across_light = light - dot(light, s.tangent) * s.tangent;
    vec3 across_view = view - dot(view, s.tangent) * s.tangent;
    float cos_i = length(across_light);
    float c = dot(across_light, across_view) / max(cos_i * length(across_view), 1e-6);
    c = clamp(c, -1.0, 1.0);
    float seen = ((3.14159265 - acos(c)) * c + sqrt(1.0 - c * c)) * 0.25;
    return Lobes(vec3(CLAY_ALBEDO * INV_PI * cos_i * seen), vec3(0.0));
}
