// Counter-based random numbers: the same key gives the same bits on every machine and in any order.
#pragma once

#include <stdint.h>

// PCG-RXS-M-XS 32 (O'Neill 2014), used as a hash.
static inline uint32_t random_hash(uint32_t n)
{
    uint32_t s = n * 747796405u + 2891336453u;
    uint32_t w = ((s >> ((s >> 28) + 4)) ^ s) * 277803737u;
    return (w >> 22) ^ w;
}

static inline uint32_t random_hash2(uint32_t a, uint32_t b)
{
    return random_hash(a ^ random_hash(b));
}

// Uniform in [0, 1): 24 bits, exact in float. `seed` names the thing, `n` the draw.
static inline float random_unit(uint32_t seed, uint32_t n)
{
    return (float)(random_hash2(seed, n) >> 8) * (1.0f / 16777216.0f);
}

// Uniform in [-1, 1).
static inline float random_signed(uint32_t seed, uint32_t n)
{
    return 2.0f * random_unit(seed, n) - 1.0f;
}
