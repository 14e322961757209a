#include "client/image.h"

#include "client/replace.h"

#include <errno.h>
#include <math.h>
#include <png.h>
#include <stdlib.h>
#include <string.h>

// 256 MiB: a header of a few bytes may not make us ask for more.
#define MAX_PIXELS ((int64_t)1 << 26)

// Hair at 1024x768 with the Up filter: level 3 takes 22 ms, the default 6 takes 46 ms for 10 %
// less, level 1 19 ms for 2 % more. Sub is as fast and 1-9 % larger; no filter helps flat drawings
// only.
#define COMPRESSION 3

static bool check_size(int64_t width, int64_t height, Fault* fault)
{
    if (width < 1 || height < 1 || width > IMAGE_MAX_SIDE || height > IMAGE_MAX_SIDE ||
        width * height > MAX_PIXELS)
        return fault_set(fault, "picture of %lldx%lld: edges must be 1 to %d, pixels at most %lld",
                         (long long)width, (long long)height, IMAGE_MAX_SIDE,
                         (long long)MAX_PIXELS);
    return true;
}

bool image_create(Image* image, int width, int height, Fault* fault)
{
    *image = (Image){0};
    if (!check_size(width, height, fault)) return false;
    uint8_t* rgba = calloc((size_t)width * (size_t)height, 4);
    if (!rgba) return fault_set(fault, "out of memory for a picture of %dx%d", width, height);
    *image = (Image){width, height, rgba};
    return true;
}

void image_free(Image* image)
{
    free(image->rgba);
    *image = (Image){0};
}

double image_linear(uint8_t code)
{
    double c = code / 255.0;
    return c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
}

void image_flip(Image* image)
{
    const size_t stride = (size_t)image->width * 4;
    for (int top = 0, bottom = image->height - 1; top < bottom; top++, bottom--) {
        uint8_t* a = image->rgba + (size_t)top * stride;
        uint8_t* b = image->rgba + (size_t)bottom * stride;
        for (size_t i = 0; i < stride; i++) {
            const uint8_t kept = a[i];
            a[i] = b[i];
            b[i] = kept;
        }
    }
}

typedef struct PngError {
    char text[128];
    int number; // errno when libpng gave up
} PngError;

static void keep_error(png_structp png, png_const_charp text)
{
    PngError* error = png_get_error_ptr(png);
    error->number = errno;
    snprintf(error->text, sizeof error->text, "%s", text);
    png_longjmp(png, 1);
}

static void ignore_warning(png_structp png, png_const_charp text)
{
    (void)png, (void)text;
}

// No time, no text chunks: the file depends on the pixels only.
static void write_header(png_structp png, png_infop info, const Image* image, bool alpha)
{
    png_set_compression_level(png, COMPRESSION);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_UP);
    png_set_IHDR(png, info, (png_uint_32)image->width, (png_uint_32)image->height, 8,
                 alpha ? PNG_COLOR_TYPE_RGBA : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png, info);
    if (!alpha) png_set_filler(png, 0, PNG_FILLER_AFTER);
}

static void write_rows(png_structp png, const Image* image)
{
    for (int y = 0; y < image->height; y++)
        png_write_row(png, image->rgba + (size_t)y * (size_t)image->width * 4);
}

// Owns nothing and changes no variable, so that libpng may jump out of it.
static bool encode(png_structp png, png_infop info, const Image* image, bool alpha, FILE* file)
{
    if (setjmp(png_jmpbuf(png))) return false;
    png_init_io(png, file);
    write_header(png, info, image, alpha);
    write_rows(png, image);
    png_write_end(png, info);
    return true;
}

static bool write_png(const Image* image, bool alpha, FILE* file, PngError* error)
{
    png_structp png =
        png_create_write_struct(PNG_LIBPNG_VER_STRING, error, keep_error, ignore_warning);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    if (!info) snprintf(error->text, sizeof error->text, "out of memory");
    const bool ok = info && encode(png, info, image, alpha, file);
    png_destroy_write_struct(&png, &info);
    return ok;
}

bool image_write_png(const Image* image, const char* path, bool alpha, Fault* fault)
{
    Replace replace;
    if (!check_size(image->width, image->height, fault)) return false;
    FILE* file = replace_open(&replace, path, fault);
    if (!file) return false;
    PngError error = {.number = 0};
    if (write_png(image, alpha, file, &error)) return replace_close(&replace, file, fault);
    fault_set(fault, "cannot write %s: %s", path,
              ferror(file) ? strerror(error.number) : error.text);
    fclose(file);
    replace_abandon(&replace);
    return false;
}

static bool decode(Image* image, png_image* png, Fault* fault)
{
    // libpng has read the header only and keeps both below 2^31; image_create checks them.
    if (!image_create(image, (int)png->width, (int)png->height, fault)) return false;
    png->format = PNG_FORMAT_RGBA;
    if (png_image_finish_read(png, NULL, image->rgba, 0, NULL)) return true;
    image_free(image);
    return fault_set(fault, "not a sound PNG: %s", png->message);
}

// libpng's simplified interface: it converts every kind of PNG, and needs no setjmp here.
bool image_read_png(Image* image, const char* path, Fault* fault)
{
    *image = (Image){0};
    FILE* file = fopen(path, "rbe");
    if (!file) return fault_set(fault, "cannot read %s: %s", path, strerror(errno));
    png_image png = {.version = PNG_IMAGE_VERSION};
    bool ok;
    if (png_image_begin_read_from_stdio(&png, file))
        ok = decode(image, &png, fault);
    else
        ok = fault_set(fault, "not a PNG: %s", png.message);
    png_image_free(&png);
    fclose(file);
    return ok || fault_prefix(fault, path);
}
