// How much of the key light arrives at a point: the one thing that shading asks of shadows.
//
// Modified shadow map (thesis 3.3.2, end): T = exp(-k dz), dz the distance in light direction below
// the first hair. Between hair and head both ways: hair dims the head by the same law, with the
// crossed hair capped (below it there is air: a void must not count as hair), the head blocks wholly.
uniform sampler2D hair_depth, body_depth;
uniform mat4 hair_light_matrix, body_light_matrix; // to clip space, orthographic
uniform float hair_light_span, body_light_span;    // metres from near to far
uniform float extinction;                          // k, 1/m

const float HAIR_BIAS_M = 0.002;   // a ribbon must not shade itself
const float BODY_BIAS_M = 0.004;   // skin and roots lie on the surface that casts
const float HAIR_THICKEST_M = 0.03;

float depth_below(sampler2D map, vec3 at, ivec2 shift, float span)
{
    ivec2 size = textureSize(map, 0);
    ivec2 texel = ivec2(floor(at.xy * vec2(size))) + shift;
    if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, size))) return 0.0;
    return (at.z - texelFetch(map, texel, 0).r) * span;
}

vec3 light_place(mat4 matrix, vec3 position)
{
    return (matrix * vec4(position, 1.0)).xyz * 0.5 + 0.5;
}

// On skin: sixteen texels, since whole shadows of single ribbons are seen there.
float hair_transmittance_wide(vec3 position, float cap)
{
    vec3 at = light_place(hair_light_matrix, position);
    float sum = 0.0;
    for (int i = 0; i < 16; ++i) {
        ivec2 tap = ivec2(2 * (i & 3) - 3, 2 * (i >> 2) - 3);
        float dz = depth_below(hair_depth, at, tap, hair_light_span) - HAIR_BIAS_M;
        sum += exp(-extinction * clamp(dz, 0.0, cap));
    }
    return sum / 16.0;
}

float hair_transmittance(vec3 position, float cap)
{
    vec3 at = light_place(hair_light_matrix, position);
    const ivec2 taps[5] = ivec2[](ivec2(0), ivec2(2, 1), ivec2(-1, 2), ivec2(-2, -1), ivec2(1, -2));
    float sum = 0.0;
    for (int i = 0; i < 5; ++i) {
        float dz = depth_below(hair_depth, at, taps[i], hair_light_span) - HAIR_BIAS_M;
        sum += exp(-extinction * clamp(dz, 0.0, cap));
    }
    return sum * 0.2;
}

float body_light(vec3 position)
{
    // Three by three texels, the outer ones weighed by where the point lies in the middle one: edges
    // fade over two texels without steps.
    vec3 at = light_place(body_light_matrix, position);
    vec2 f = fract(at.xy * vec2(textureSize(body_depth, 0)));
    float sum = 0.0;
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
            float dz = depth_below(body_depth, at, ivec2(x, y), body_light_span);
            vec2 w = vec2(x < 0 ? 1.0 - f.x : x > 0 ? f.x : 1.0, y < 0 ? 1.0 - f.y : y > 0 ? f.y : 1.0);
            sum += dz > BODY_BIAS_M ? 0.0 : w.x * w.y;
        }
    return sum * 0.25;
}

float hair_lit(vec3 position)
{
    return hair_transmittance(position, HAIR_THICKEST_M) * body_light(position);
}

float skin_lit(vec3 position, vec3 normal)
{
    return hair_transmittance_wide(position, HAIR_THICKEST_M) * body_light(position + normal * 0.003);
}
