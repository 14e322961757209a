// Which samples of a pixel a fragment keeps. HASH: as many as its coverage says on average, chosen by
// a hash, so layers accumulate as they should (a fixed mask never does). TEST: all or nothing.
#include "hash.glsl"
#include "fibres.glsl"

// Returns a random number of the hair, 0..1.
float keep_covered(vec3 place, float fill, float random)
{
    uint salt = hash(floatBitsToUint(random) ^ uint(fibre_cell(place) & 0xFFFF));
#if TRANSPARENCY_HASH
    float coverage = fibre_coverage(place, fill);
    // One draw for each hair, not each pixel: a hair thinner than a pixel is then a faint line
    // instead of dots, and does not sparkle when it moves.
    float dither = float(salt >> 8u) * (1.0 / 16777216.0);
    int count = int(floor(coverage * float(SAMPLES) + dither));
    if (count <= 0) discard;
    int first = int(hash(salt) % uint(SAMPLES));
    int run = (1 << min(count, SAMPLES)) - 1;
    int mask = ((run << first) | (run >> (SAMPLES - first))) & ((1 << SAMPLES) - 1);
    gl_SampleMask[0] = mask;
#else
    if (!fibre_covers(place, fill)) discard;
#endif
    return float(hash(salt + 1u) >> 8u) * (1.0 / 16777216.0);
}
