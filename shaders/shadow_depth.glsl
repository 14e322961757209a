// Modified shadow map (thesis 3.3.2, end): T = exp(-k dz), dz the distance in light direction below
// the first hair. The crossed hair is capped: below it there is air, and a void must not count as
// hair.
#include "shadow_place.glsl"
uniform sampler2D hair_depth;
uniform float extinction; // k, 1/m
const float HAIR_THICKEST_M = 0.03;

float below_first_hair(vec3 at, ivec2 shift)
{
    ivec2 size = ivec2(shadow_size), texel = ivec2(floor(at.xy * vec2(size))) + shift;
    if (!is_in_map(texel, size)) return 1.0;
    // Not behind the far plane: there a texel without hair would be hair.
    float dz = (min(at.z, 1.0) - texelFetch(hair_depth, texel, 0).r) * hair_light_span - hair_bias;
    return exp(-extinction * clamp(dz, 0.0, HAIR_THICKEST_M));
}

float hair_transmittance(vec3 position)
{
    vec3 at = light_place(hair_light_matrix, position);
    const ivec2 taps[5] = ivec2[](ivec2(0), ivec2(2, 1), ivec2(-1, 2), ivec2(-2, -1), ivec2(1, -2));
    float sum = 0.0;
    for (int i = 0; i < 5; ++i)
        sum += below_first_hair(at, taps[i]);
    return sum * 0.2;
}

// On skin: sixteen texels, since whole shadows of single ribbons are seen there. `taps` is 16, or 0
// where the answer is not needed.
float hair_transmittance_wide(vec3 position, int taps)
{
    vec3 at = light_place(hair_light_matrix, position);
    float sum = 0.0;
    for (int i = 0; i < taps; ++i)
        sum += below_first_hair(at, ivec2(2 * (i & 3) - 3, 2 * (i >> 2) - 3));
    return sum / 16.0;
}
