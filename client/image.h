// Pictures in memory and as PNG.
#pragma once

#include "messages/base.h"

// Largest edge that is read or written: what GL textures reach here, and 1 GiB of pixels at most.
#define IMAGE_MAX_SIDE 16384

// 8 bits a channel, sRGB, top row first, rows without padding: width * height * 4 bytes.
typedef struct Image {
    int width, height;
    uint8_t* rgba;
} Image;

// Transparent black. False with a fault where the size is not 1..IMAGE_MAX_SIDE or memory is short.
bool image_create(Image* image, int width, int height, Fault* fault);
void image_free(Image* image);

// Linear light, 0 to 1, of an sRGB code (IEC 61966-2-1).
double image_linear(uint8_t code);

// Turns what glReadPixels wrote (bottom row first) the right way up, or back.
void image_flip(Image* image);

// The same bytes for the same picture, always. Without `alpha` the file is RGB.
// The file is written beside its place and then renamed: a full disk never costs what was there.
bool image_write_png(const Image* image, const char* path, bool alpha, Fault* fault);

// Any PNG, converted to 8-bit RGBA. `image` is set only on success; free it after.
bool image_read_png(Image* image, const char* path, Fault* fault);
