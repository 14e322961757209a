// .tfx files (version 3) made by tests: hairs that hang from a circle.
#pragma once

#include "tests/process.h"

#define TFX_HEADER_BYTES 296

// `length` and the circle in file units. `points` from 4 to 64, a power of two.
static inline uint8_t* tfx_bytes(int strands, int points, float length, size_t* size)
{
    *size = TFX_HEADER_BYTES + (size_t)strands * (size_t)points * 12;
    uint8_t* bytes = calloc(1, *size);
    assert_non_null(bytes);
    float version = 3.0f;
    uint32_t counts[2] = {(uint32_t)strands, (uint32_t)points}, offset = TFX_HEADER_BYTES;
    memcpy(bytes, &version, 4);
    memcpy(bytes + 4, counts, 8);
    memcpy(bytes + 144, &offset, 4);
    float* out = (float*)(void*)(bytes + TFX_HEADER_BYTES);
    for (int s = 0; s < strands; ++s)
        for (int p = 0; p < points; ++p) {
            int along = s % 8, across = s / 8;
            *out++ = 3.0f * (float)(along - 4);
            *out++ = 60.0f - length * (float)p / (float)(points - 1);
            *out++ = 3.0f * (float)(across - 4);
        }
    return bytes;
}

static inline void tfx_write(const char* path, int strands, int points, float length)
{
    size_t size;
    uint8_t* bytes = tfx_bytes(strands, points, length, &size);
    file_write(path, bytes, size);
    free(bytes);
}
