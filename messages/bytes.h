// Numbers to bytes and back, at any alignment. LCM's header fields are big-endian, our payloads and
// style lanes little-endian. memcpy and a swap, because both compile to one instruction.
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
               "planes are copied to and from the wire as they lie in memory");

static inline void bytes_put_be16(uint8_t* at, uint16_t value)
{
    value = __builtin_bswap16(value);
    memcpy(at, &value, sizeof value);
}

static inline void bytes_put_be32(uint8_t* at, uint32_t value)
{
    value = __builtin_bswap32(value);
    memcpy(at, &value, sizeof value);
}

static inline void bytes_put_be64(uint8_t* at, uint64_t value)
{
    value = __builtin_bswap64(value);
    memcpy(at, &value, sizeof value);
}

static inline void bytes_put_be_double(uint8_t* at, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    bytes_put_be64(at, bits);
}

static inline void bytes_put_be_float(uint8_t* at, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    bytes_put_be32(at, bits);
}

static inline uint16_t bytes_get_be16(const uint8_t* at)
{
    uint16_t value;
    memcpy(&value, at, sizeof value);
    return __builtin_bswap16(value);
}

static inline uint32_t bytes_get_be32(const uint8_t* at)
{
    uint32_t value;
    memcpy(&value, at, sizeof value);
    return __builtin_bswap32(value);
}

static inline uint64_t bytes_get_be64(const uint8_t* at)
{
    uint64_t value;
    memcpy(&value, at, sizeof value);
    return __builtin_bswap64(value);
}

static inline double bytes_get_be_double(const uint8_t* at)
{
    uint64_t bits = bytes_get_be64(at);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static inline float bytes_get_be_float(const uint8_t* at)
{
    uint32_t bits = bytes_get_be32(at);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}
