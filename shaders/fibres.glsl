// How much of a fragment hair covers: fibres side by side on a ribbon.
//
// The texture holds ranks: values spread evenly over 0..1, so that `rank > 1 - fill` is true on
// exactly `fill` of the ribbon, whatever the fill. Its smaller levels are ranked anew, so that this
// holds on each of them. Where a fibre is thinner than a pixel, its fill itself is the coverage.
uniform sampler2DArray fibre_ranks; // rank; which hair, in sixteenths, on level 0
const int FIBRE_LEVELS = 5; // as in client/fibres.h

// Which hair of the pattern `place` is on.
int fibre_cell(vec3 place)
{
    ivec2 size = textureSize(fibre_ranks, 0).xy;
    ivec2 at = ivec2(floor(fract(place.xy) * vec2(size)));
    float hair = texelFetch(fibre_ranks, ivec3(min(at, size - 1), int(place.z)), 0).g;
    return int(hair * 15.94) + 16 * int(floor(place.x));
}

// 0 where fibres are wider than a pixel, 1 where they are so thin that their fill is the coverage.
float fibre_blur(float texels)
{
    return clamp((texels - 4.0) / 6.0, 0.0, 1.0);
}

// Texels of the pattern across a pixel.
float fibre_texels(vec3 place)
{
    return max(fwidth(place.x) * float(textureSize(fibre_ranks, 0).x), 1e-4);
}

// Coverage 0..1, smooth: for hashed sample masks.
float fibre_coverage(vec3 place, float fill)
{
    float texels = fibre_texels(place);
    float rank = textureLod(fibre_ranks, place, 0.0).r; // a filter on a coarser level eats thin hair
    float soft = clamp(0.02 * texels, 0.02, 0.5);
    float sharp = clamp((rank - (1.0 - fill)) / soft + 0.5, 0.0, 1.0);
    return mix(sharp, fill, fibre_blur(texels));
}

// The edges of fibres, sharpened to a pixel.
float fibre_sharp(vec3 place, float fill)
{
    float rank = texture(fibre_ranks, place).r;
    float slope = clamp(fwidth(rank), 0.02, 1.0);
    return clamp((rank - (1.0 - fill)) / slope + 0.5, 0.0, 1.0);
}

// Coverage 0..1: for blending.
float fibre_alpha(vec3 place, float fill)
{
    return mix(fibre_sharp(place, fill), fill, fibre_blur(fibre_texels(place)));
}

// Covered or not, for alpha tests; right on average.
bool fibre_covers(vec3 place, float fill)
{
    return textureLod(fibre_ranks, place, 0.0).r > 1.0 - fill;
}

// The same for the eye: where fibres are thin, by the one texel of the mip level whose texels are
// pixels. Dots become streaks, which is what thin hair looks like.
bool fibre_covers_pixel(vec3 place, float fill)
{
    float texels = fibre_texels(place);
    if (texels < 2.0) return fibre_covers(place, fill);
    int level = min(int(log2(texels) + 0.5), FIBRE_LEVELS - 1);
    vec2 size = vec2(textureSize(fibre_ranks, level).xy);
    return texelFetch(fibre_ranks, ivec3(fract(place.xy) * size, int(place.z)), level).r >
           1.0 - fill;
}

// For masks that do not accumulate, where layers of a small alpha would all be the same few
// samples: thin fibres are there or not.
float fibre_alpha_to_mask(vec3 place, float fill)
{
    float there = fibre_covers_pixel(place, fill) ? 1.0 : 0.0;
    return mix(fibre_sharp(place, fill), there, fibre_blur(fibre_texels(place)));
}
