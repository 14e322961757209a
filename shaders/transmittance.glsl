// How much of a light arrives at a point: the one thing that shading asks of shadows. The method
// (client/shadow.h) gives hair_transmittance and hair_transmittance_wide; the head blocks wholly.
#include SHADOWS
#include "shadow_place.glsl"
uniform sampler2D body_depth;
const float BODY_BIAS_M = 0.004; // skin and roots lie on the surface that casts

float body_texel(vec3 at, ivec2 shift)
{
    ivec2 size = ivec2(shadow_size), texel = ivec2(floor(at.xy * vec2(size))) + shift;
    if (!is_in_map(texel, size)) return 1.0;
    float dz = (at.z - texelFetch(body_depth, texel, 0).r) * body_light_span;
    return dz > BODY_BIAS_M ? 0.0 : 1.0;
}

float body_light(vec3 position, int taps)
{
    // Three by three texels, the outer ones weighed by where the point lies in the middle one: edges
    // fade over two texels without steps.
    vec3 at = light_place(body_light_matrix, position);
    vec2 f = fract(at.xy * vec2(ivec2(shadow_size)));
    float sum = 0.0;
    for (int i = 0; i < taps; ++i) {
        int x = i % 3 - 1, y = i / 3 - 1;
        vec2 w = vec2(x < 0 ? 1.0 - f.x : x > 0 ? f.x : 1.0, y < 0 ? 1.0 - f.y : y > 0 ? f.y : 1.0);
        sum += body_texel(at, ivec2(x, y)) * w.x * w.y;
    }
    return sum * 0.25;
}

float hair_lit(vec3 position)
{
    return hair_transmittance(position) * body_light(position, 9);
}

// Where it is not `needed` nothing is read, and what it returns means nothing. Loops of no rounds end
// on llvmpipe; both sides of an `if` it would work out.
float skin_lit(vec3 position, vec3 normal, bool needed)
{
    return hair_transmittance_wide(position, needed ? 16 : 0) *
           body_light(position + normal * 0.003, needed ? 9 : 0);
}
