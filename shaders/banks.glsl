// Banks 1994, as Heidrich and Seidel 1998 put it into tables: of all normals that a thread has, the
// one that lies nearest to light or half vector. A table was cheaper than two roots then; here it is
// not.
#include "lights.glsl"
#include "strand.glsl"

float banks_diffuse(vec3 tangent, vec3 light)
{
    float tl = dot(tangent, light);
    return sqrt(max(1.0 - tl * tl, 0.0));
}

// With a mirrored ray (Phong), V.R.
float banks_phong(vec3 tangent, vec3 light, vec3 view, float exponent)
{
    float tl = dot(tangent, light), tv = dot(tangent, view);
    return pow(max(sqrt(max((1.0 - tl * tl) * (1.0 - tv * tv), 0.0)) - tl * tv, 0.0), exponent);
}

// With a half vector (Blinn), H.N'.
float banks_blinn(vec3 tangent, vec3 light, vec3 view, float exponent)
{
    vec3 both = light + view;
    float th = dot(tangent, both) * inversesqrt(max(dot(both, both), 1e-12));
    return pow(max(1.0 - th * th, 0.0), 0.5 * exponent);
}

// One highlight on the tangent itself, white, where Kajiya has two that lean apart.
Lobes banks_shade(Strand s, vec3 light, vec3 view)
{
    float wrap = faces(s.normal, light);
    vec3 body = s.colour * banks_diffuse(s.tangent, light) * INV_PI;
    return Lobes(body * wrap, vec3(0.07 * banks_blinn(s.tangent, light, view, 160.0) * wrap));
}
