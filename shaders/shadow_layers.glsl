// Opacity shadow maps: optical depth between the two planes round a place, mixed by how near it is to
// each (the hat weights max(0, 1 - |z - zi| / dz) of thesis 5.7 are that). Four texels are mixed as
// transmittance, the share of light that comes through, and not as depth.
#include "shadow_place.glsl"
#include "deep_place.glsl"
uniform sampler2DArray hair_layers;
uniform float layer_depths[LAYERS];
uniform float layer_unit; // optical depth that is stored as 1

float stored(ivec2 texel, int plane)
{
    return plane < 0 ? 0.0 : texelFetch(hair_layers, ivec3(texel, plane >> 2), 0)[plane & 3];
}

// The first plane that is not before `depth`.
int plane_behind(float depth)
{
    int low = 0, high = LAYERS - 1;
    while (low < high) {
        int middle = (low + high) >> 1;
        if (layer_depths[middle] < depth) low = middle + 1;
        else high = middle;
    }
    return low;
}

float texel_transmittance(ivec2 texel, float z)
{
    if (!is_in_map(texel, ivec2(shadow_size))) return 1.0;
    float depth = clamp(layer_place(z, texel), 0.0, layer_depths[LAYERS - 1]);
    int plane = plane_behind(depth);
    float before = plane > 0 ? layer_depths[plane - 1] : 0.0;
    float part = (depth - before) / (layer_depths[plane] - before);
    float optical = mix(stored(texel, plane - 1), stored(texel, plane), part);
    return exp(-layer_unit * optical);
}

float hair_transmittance(vec3 position)
{
    vec3 at = light_place(hair_light_matrix, position);
    float z = at.z - hair_bias / hair_light_span;
    vec2 corner = at.xy * vec2(ivec2(shadow_size)) - 0.5, f = fract(corner);
    ivec2 texel = ivec2(floor(corner));
    vec2 low = vec2(texel_transmittance(texel, z), texel_transmittance(texel + ivec2(1, 0), z));
    vec2 high = vec2(texel_transmittance(texel + ivec2(0, 1), z),
                     texel_transmittance(texel + ivec2(1, 1), z));
    vec2 mixed = mix(low, high, f.y);
    return mix(mixed.x, mixed.y, f.x);
}

// On skin: sixteen texels, since whole shadows of single ribbons are seen there. `taps` is 16, or 0
// where the answer is not needed.
float hair_transmittance_wide(vec3 position, int taps)
{
    vec3 at = light_place(hair_light_matrix, position);
    float z = at.z - hair_bias / hair_light_span, sum = 0.0;
    ivec2 texel = ivec2(floor(at.xy * vec2(ivec2(shadow_size))));
    for (int i = 0; i < taps; ++i)
        sum += texel_transmittance(texel + ivec2(2 * (i & 3) - 3, 2 * (i >> 2) - 3), z);
    return sum / 16.0;
}
