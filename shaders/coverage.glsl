// How much of a fragment is kept where hair covers a part of it. client/transparency.c has the
// variants and the state that goes with each; TRANSPARENCY is one of these.
#define TEST     1 // all or nothing
#define COVERAGE 2 // GL takes a share of the samples, by alpha
#define HASH     3 // a share of the samples, chosen by a hash, so that layers accumulate as they should
#define BLEND    4 // a share of the colour
#include "fibres.glsl"
#include "hash.glsl"

// From this share on hair hides what is behind it, for a pass that only writes depth.
const float BLEND_OPAQUE = 0.99;

// One draw for each hair, not each pixel: a hair thinner than a pixel is then a faint line instead
// of dots, and does not sparkle when it moves.
int hashed_samples(float coverage, uint salt)
{
    float dither = float(salt >> 8u) * (1.0 / 16777216.0);
    int count = int(floor(coverage * float(SAMPLES) + dither));
    if (count <= 0) return 0;
    int first = int(hash(salt) % uint(SAMPLES));
    int run = (1 << min(count, SAMPLES)) - 1;
    return ((run << first) | (run >> (SAMPLES - first))) & ((1 << SAMPLES) - 1);
}

// Returns alpha, and in `own` a random number of the hair, 0..1.
float keep_covered(vec3 place, float fill, float random, out float own)
{
    uint salt = hash(floatBitsToUint(random) ^ uint(fibre_cell(place) & 0xFFFF));
    own = float(hash(salt + 1u) >> 8u) * (1.0 / 16777216.0);
#if TRANSPARENCY == BLEND
    float alpha = fibre_alpha(place, fill);
    if (alpha < (DEPTH_STEP != 0 ? BLEND_OPAQUE : 0.002)) discard;
    return alpha;
#elif AFTER_DEPTH
    return 1.0; // the depth test keeps what the pass before kept
#elif TRANSPARENCY == HASH
    int mask = hashed_samples(fibre_coverage(place, fill), salt);
    if (mask == 0) discard;
    gl_SampleMask[0] = mask;
    return 1.0;
#elif TRANSPARENCY == COVERAGE && SAMPLES > 1
    return fibre_alpha_to_mask(place, fill);
#elif TRANSPARENCY == COVERAGE
    if (fibre_alpha_to_mask(place, fill) < 0.5) discard;
    return 1.0;
#else
    if (!fibre_covers_pixel(place, fill)) discard;
    return 1.0;
#endif
}
