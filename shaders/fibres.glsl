// How much of a fragment hair covers: fibres side by side on a ribbon.
//
// The texture holds ranks: values spread evenly over 0..1, so that `rank > 1 - fill` is true on
// exactly `fill` of the ribbon, whatever the fill. Its smaller levels are ranked anew, so that this
// holds on each of them. Where a fibre is thinner than a pixel, its fill itself is the coverage.
uniform sampler2DArray fibre_ranks; // rank; which hair, in sixteenths, on level 0

// Which hair of the pattern `place` is on.
int fibre_cell(vec3 place)
{
    ivec2 size = textureSize(fibre_ranks, 0).xy;
    ivec2 at = ivec2(floor(fract(place.xy) * vec2(size)));
    float hair = texelFetch(fibre_ranks, ivec3(min(at, size - 1), int(place.z)), 0).g;
    return int(hair * 15.94) + 16 * int(floor(place.x));
}

// Coverage 0..1, smooth: for hashed sample masks.
float fibre_coverage(vec3 place, float fill)
{
    vec2 size = vec2(textureSize(fibre_ranks, 0).xy);
    float texels = max(fwidth(place.x) * size.x, 1e-4); // of level 0 that a pixel spans
    float level = clamp(floor(log2(texels) + 0.5), 0.0, 4.0);
    float rank = textureLod(fibre_ranks, place, level).r;
    float soft = clamp(0.02 * texels, 0.02, 0.5);
    float sharp = clamp((rank - (1.0 - fill)) / soft + 0.5, 0.0, 1.0);
    return mix(sharp, fill, clamp((texels - 4.0) / 6.0, 0.0, 1.0));
}

// Covered or not: for alpha tests; right on average.
bool fibre_covers(vec3 place, float fill)
{
    return texture(fibre_ranks, place).r > 1.0 - fill;
}
