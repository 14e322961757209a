#include "coverage.glsl"

in vec3 v_body, v_shine, v_place;
flat in float v_random;
in float v_fill;
uniform int coverage_only, transmittance_only;

layout(location = 0) out vec4 out_radiance; // a: how much of this is hair

void main()
{
    float own;
    float alpha = keep_covered(v_place, v_fill, v_random, own);
    float tone = 0.55 + 0.6 * own + 0.3 * fract(v_random * 37.0); // hairs differ, locks too
    vec3 radiance = v_body * tone + v_shine * (0.4 + 1.2 * own);
    if (transmittance_only != 0) radiance = v_body;
    out_radiance = vec4(coverage_only != 0 ? vec3(1.0) : radiance, alpha);
}
