// How much of a fragment hair covers: fibres side by side on a ribbon.
//
// The texture holds ranks: values spread evenly over 0..1, so that `rank > 1 - fill` is true on
// exactly `fill` of the ribbon, whatever the fill. Averaging would pull ranks to a half and eat
// thin hair, so every mip level is ranked anew (client/fibres.c).
uniform sampler2DArray fibre_ranks;
const int FIBRE_LEVELS = 6; // of mips, as in client/fibres.h

// Which hair of the pattern `place` is on.
int fibre_cell(vec3 place)
{
    return int(floor(place.x * 16.0 + 0.4 * sin(12.566371 * place.y)));
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
    float rank = textureLod(fibre_ranks, place, 0.0).r;
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
