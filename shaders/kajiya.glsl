// Kajiya and Kay 1989, with outward light and view vectors: a strand reflects into the cone
// T.V = -T.L, so the specular base is sin sin - (T.L)(T.V). (The thesis prints +, which is right only
// for a light vector that points along the ray.)
#include "lights.glsl"
#include "strand.glsl"

float kajiya_diffuse(vec3 tangent, vec3 light)
{
    float tl = dot(tangent, light);
    return sqrt(max(1.0 - tl * tl, 0.0));
}

float kajiya_specular(vec3 tangent, vec3 light, vec3 view, float exponent)
{
    float tl = dot(tangent, light), tv = dot(tangent, view);
    float base = sqrt(max((1.0 - tl * tl) * (1.0 - tv * tv), 0.0)) - tl * tv;
    return pow(max(base, 0.0), exponent);
}

// Radiance towards `view` for irradiance 1 from `light`. Two highlights, as real hair has: the first
// is the light's colour and leans to the root, the second the hair's and leans to the tip
// (Marschner 2003 measured 5-10 degrees; Scheuermann 2004 shifts the tangent for it).
Lobes kajiya_shade(Strand s, vec3 light, vec3 view)
{
    float wrap = faces(s.normal, light);
    vec3 towards_root = normalize(s.tangent - 0.10 * s.normal);
    vec3 towards_tip = normalize(s.tangent + 0.14 * s.normal);
    float second = kajiya_specular(towards_tip, light, view, 14.0);
    float first = kajiya_specular(towards_root, light, view, 80.0);
    vec3 body = s.colour * (kajiya_diffuse(s.tangent, light) * INV_PI + 0.75 * second);
    return Lobes(body * wrap, vec3(0.055 * first * wrap));
}
