#include "tests/flip.h"

#include "messages/vec.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

// Exponents and the bend of the curve that the paper takes from its user study.
#define COLOUR_EXPONENT  0.7f
#define FEATURE_EXPONENT 0.5f
#define BEND_AT          0.4f  // of the largest difference
#define BEND_TO          0.95f // becomes so much
#define FEATURE_DEGREES  0.082 // width of the thinnest line that is a feature

#define MAX_RADIUS 96 // at 700 pixels a degree
#define MAX_TAPS   (2 * MAX_RADIUS + 1)

// X, Y and Z of linear red, green and blue with Rec. 709 primaries and the white D65, which is the
// sum of each row.
static const Vec3 to_xyz[3] = {{0.41238656f, 0.35759149f, 0.18045049f},
                               {0.21263682f, 0.71518298f, 0.07218020f},
                               {0.01933062f, 0.11919716f, 0.95037259f}};
static const Vec3 white = {0.95042854f, 1.0f, 1.08890037f};

typedef struct Kernel {
    int radius;
    bool is_derivative; // taps sum to 0
    float taps[MAX_TAPS];
} Kernel;

// A picture on its way: planes of width * height.
typedef struct Planes {
    int width, height;
    float* spare[2];    // for convolutions
    float* opponent[3]; // Y, Cx, Cz
    float* seen[3];     // L, a, b after the eye's filter; a and b scaled by Hunt's effect
    float* edges;       // strength of edges and of points
    float* points;
} Planes;

static Vec3 xyz_of(Vec3 rgb)
{
    return vec3(vec3_dot(to_xyz[0], rgb), vec3_dot(to_xyz[1], rgb), vec3_dot(to_xyz[2], rgb));
}

static float lightness(float t)
{
    const float d = 6.0f / 29.0f;
    return t > d * d * d ? cbrtf(t) : t / (3.0f * d * d) + 4.0f / 29.0f;
}

// L*a*b* of linear RGB; dark colours look less colourful (Hunt).
static Vec3 hunt_lab(Vec3 rgb)
{
    Vec3 xyz = xyz_of(rgb);
    float x = lightness(xyz.x / white.x), y = lightness(xyz.y), z = lightness(xyz.z / white.z);
    float l = 116.0f * y - 16.0f;
    return vec3(l, 0.01f * l * 500.0f * (x - y), 0.01f * l * 200.0f * (y - z));
}

// HyAB, which holds for large differences too, bent by the first exponent.
static float difference(Vec3 a, Vec3 b)
{
    return powf(fabsf(a.x - b.x) + hypotf(a.y - b.y, a.z - b.z), COLOUR_EXPONENT);
}

float flip_largest_difference(void)
{
    return difference(hunt_lab(vec3(0, 1, 0)), hunt_lab(vec3(0, 0, 1)));
}

// --- convolutions; beyond an edge its pixels go on

static int within(int i, int count)
{
    return i < 0 ? 0 : i >= count ? count - 1 : i;
}

// Adds one tap to a row; over pixels, so that it becomes vectors. Where there is a `level`, what
// differs from it alone: the derivative of a plane without features is then 0 and not what rounding
// leaves, of which the square root below would make something.
static void add(float* to, float tap, const float* from, const float* level, int count)
{
    if (level == NULL)
        for (int x = 0; x < count; ++x)
            to[x] += tap * from[x];
    else
        for (int x = 0; x < count; ++x)
            to[x] += tap * (from[x] - level[x]);
}

static void convolve_rows(const Planes* p, float* out, const float* in, const Kernel* kernel,
                          float* padded)
{
    int r = kernel->radius, w = p->width;
    for (int y = 0; y < p->height; ++y) {
        const float* row = in + (size_t)y * (size_t)w;
        float* to = out + (size_t)y * (size_t)w;
        for (int x = -r; x < w + r; ++x)
            padded[x + r] = row[within(x, w)];
        memset(to, 0, (size_t)w * sizeof *to);
        for (int k = 0; k <= 2 * r; ++k)
            add(to, kernel->taps[k], padded + k, kernel->is_derivative ? row : NULL, w);
    }
}

// Adds `weight` times the filtered plane to `out`.
static void convolve_columns(const Planes* p, float* out, const float* in, const Kernel* kernel,
                             float weight)
{
    int r = kernel->radius, w = p->width;
    for (int y = 0; y < p->height; ++y) {
        const float* level = kernel->is_derivative ? in + (size_t)y * (size_t)w : NULL;
        for (int k = 0; k <= 2 * r; ++k)
            add(out + (size_t)y * (size_t)w, weight * kernel->taps[k],
                in + (size_t)within(y + k - r, p->height) * (size_t)w, level, w);
    }
}

static size_t plane_bytes(const Planes* p)
{
    return (size_t)p->width * (size_t)p->height * sizeof(float);
}

// --- what the eye no longer tells apart

// The bell of a contrast sensitivity whose spectrum is a exp(-b f^2); sum 1, and `weight` its sum
// before.
static Kernel bell(double a, double b, int radius, float ppd, double* weight)
{
    Kernel kernel = {.radius = radius};
    double sum = 0;
    for (int i = -radius; i <= radius; ++i)
        sum += exp(-PI * PI * i * i / ((double)ppd * (double)ppd * b));
    for (int i = -radius; i <= radius; ++i)
        kernel.taps[i + radius] =
            (float)(exp(-PI * PI * i * i / ((double)ppd * (double)ppd * b)) / sum);
    *weight = a * sqrt(PI / b) * sum * sum; // in two dimensions
    return kernel;
}

typedef struct Sensitivity {
    double a[2], b[2];
} Sensitivity;

// Of achromatic, red-green and blue-yellow contrast; b in square degrees.
static const Sensitivity sensitivities[3] = {
    {{1.0, 0.0}, {0.0047, 1e-5}}, {{1.0, 0.0}, {0.0053, 1e-5}}, {{34.1, 13.5}, {0.04, 0.025}}};

// Three deviations of the widest bell, so that all three have one size.
static int filter_radius(float ppd)
{
    return (int)ceil(3.0 * sqrt(0.04 / (2.0 * PI * PI)) * (double)ppd);
}

static void filter_channel(const Planes* p, int channel, float ppd, float* padded)
{
    const Sensitivity* s = &sensitivities[channel];
    double weights[2] = {0, 0};
    Kernel kernels[2];
    for (int i = 0; i < 2; ++i)
        kernels[i] = bell(s->a[i], s->b[i], filter_radius(ppd), ppd, &weights[i]);
    memset(p->seen[channel], 0, plane_bytes(p));
    for (int i = 0; i < 2; ++i) {
        if (weights[i] <= 0.0) continue;
        convolve_rows(p, p->spare[0], p->opponent[channel], &kernels[i], padded);
        convolve_columns(p, p->seen[channel], p->spare[0], &kernels[i],
                         (float)(weights[i] / (weights[0] + weights[1])));
    }
}

static float unit(float x)
{
    return fminf(fmaxf(x, 0.0f), 1.0f);
}

// From filtered Y, Cx, Cz to what of it is a colour of the screen, as Hunt's L, a, b.
static void to_lab(const Planes* p)
{
    // The inverse of to_xyz, by its columns.
    const Vec3 *r = to_xyz, first = vec3_cross(r[1], r[2]);
    const float det = vec3_dot(r[0], first);
    const Vec3 of_x = vec3_scale(first, 1.0f / det);
    const Vec3 of_y = vec3_scale(vec3_cross(r[2], r[0]), 1.0f / det);
    const Vec3 of_z = vec3_scale(vec3_cross(r[0], r[1]), 1.0f / det);
    for (size_t i = 0; i < (size_t)p->width * (size_t)p->height; ++i) {
        float y = (p->seen[0][i] + 16.0f) / 116.0f;
        Vec3 rgb = vec3_scale(of_x, (p->seen[1][i] / 500.0f + y) * white.x);
        rgb = vec3_mad(rgb, of_y, y);
        rgb = vec3_mad(rgb, of_z, (y - p->seen[2][i] / 200.0f) * white.z);
        Vec3 lab = hunt_lab(vec3(unit(rgb.x), unit(rgb.y), unit(rgb.z)));
        p->seen[0][i] = lab.x;
        p->seen[1][i] = lab.y;
        p->seen[2][i] = lab.z;
    }
}

// --- edges and points

typedef struct Detectors {
    Kernel smooth, edge, point; // a bell, and its first and second derivative
} Detectors;

// What is positive sums to 1, what is negative to -1.
static void balance(Kernel* kernel)
{
    double above = 0, below = 0;
    for (int i = 0; i <= 2 * kernel->radius; ++i)
        *(kernel->taps[i] > 0 ? &above : &below) += (double)kernel->taps[i];
    for (int i = 0; i <= 2 * kernel->radius; ++i)
        kernel->taps[i] /= (float)(kernel->taps[i] > 0 ? above : -below);
}

static Detectors make_detectors(float ppd)
{
    double deviation = 0.5 * FEATURE_DEGREES * (double)ppd, sum = 0;
    int radius = (int)ceil(3.0 * deviation);
    Detectors d = {{.radius = radius},
                   {.radius = radius, .is_derivative = true},
                   {.radius = radius, .is_derivative = true}};
    for (int i = -radius; i <= radius; ++i) {
        double x = i / deviation, height = exp(-0.5 * x * x);
        sum += height;
        d.smooth.taps[i + radius] = (float)height;
        d.edge.taps[i + radius] = (float)(-x * height);
        d.point.taps[i + radius] = (float)((x * x - 1.0) * height);
    }
    for (int i = 0; i <= 2 * radius; ++i)
        d.smooth.taps[i] /= (float)sum;
    balance(&d.edge);
    balance(&d.point);
    return d;
}

// `out`: length of the two derivatives of lightness, across and down.
static void detect(const Planes* p, float* out, const Kernel* derivative, const Kernel* smooth,
                   float* padded)
{
    size_t count = (size_t)p->width * (size_t)p->height;
    float* down = p->spare[1];
    memset(out, 0, plane_bytes(p));
    memset(down, 0, plane_bytes(p));
    convolve_rows(p, p->spare[0], p->opponent[0], derivative, padded);
    convolve_columns(p, out, p->spare[0], smooth, 1.0f / 116.0f);
    convolve_rows(p, p->spare[0], p->opponent[0], smooth, padded);
    convolve_columns(p, down, p->spare[0], derivative, 1.0f / 116.0f);
    for (size_t i = 0; i < count; ++i)
        out[i] = sqrtf(out[i] * out[i] + down[i] * down[i]);
}

// --- the whole

static void to_opponent(const Planes* p, const Image* image)
{
    float linear[256];
    for (int i = 0; i < 256; ++i) {
        float c = (float)i / 255.0f;
        linear[i] = c <= 0.04045f ? c / 12.92f : powf((c + 0.055f) / 1.055f, 2.4f);
    }
    for (size_t i = 0; i < (size_t)p->width * (size_t)p->height; ++i) {
        const uint8_t* c = image->rgba + 4 * i;
        Vec3 xyz = xyz_of(vec3(linear[c[0]], linear[c[1]], linear[c[2]]));
        p->opponent[0][i] = 116.0f * xyz.y - 16.0f;
        p->opponent[1][i] = 500.0f * (xyz.x / white.x - xyz.y);
        p->opponent[2][i] = 200.0f * (xyz.y - xyz.z / white.z);
    }
}

static void look_at(const Planes* p, const Image* image, float ppd, float* padded)
{
    const Detectors detectors = make_detectors(ppd);
    to_opponent(p, image);
    for (int channel = 0; channel < 3; ++channel)
        filter_channel(p, channel, ppd, padded);
    to_lab(p);
    detect(p, p->edges, &detectors.edge, &detectors.smooth, padded);
    detect(p, p->points, &detectors.point, &detectors.smooth, padded);
}

static float bend(float colour, float largest)
{
    float knee = BEND_AT * largest;
    if (colour < knee) return colour * BEND_TO / knee;
    return BEND_TO + (colour - knee) / (largest - knee) * (1.0f - BEND_TO);
}

static void combine(float* map, const Planes* a, const Planes* b)
{
    const float largest = flip_largest_difference();
    for (size_t i = 0; i < (size_t)a->width * (size_t)a->height; ++i) {
        float colour = difference(vec3(a->seen[0][i], a->seen[1][i], a->seen[2][i]),
                                  vec3(b->seen[0][i], b->seen[1][i], b->seen[2][i]));
        float feature = fmaxf(fabsf(a->edges[i] - b->edges[i]), fabsf(a->points[i] - b->points[i]));
        feature = powf(feature * 0.70710678f, FEATURE_EXPONENT);
        map[i] = unit(powf(bend(colour, largest), 1.0f - feature));
    }
}

#define SHARED_PLANES 5 // spare and opponent, in one picture's turn and then in the other's
#define OWN_PLANES    5

static Planes lay_out(float* memory, const Image* image, int picture)
{
    size_t count = (size_t)image->width * (size_t)image->height;
    Planes p = {.width = image->width, .height = image->height};
    float* own = memory + count * (size_t)(SHARED_PLANES + OWN_PLANES * picture);
    for (int i = 0; i < 2; ++i)
        p.spare[i] = memory + count * (size_t)i;
    for (int i = 0; i < 3; ++i) {
        p.opponent[i] = memory + count * (size_t)(2 + i);
        p.seen[i] = own + count * (size_t)i;
    }
    p.edges = own + count * 3;
    p.points = own + count * 4;
    return p;
}

bool flip_map(float* map, const Image* a, const Image* b, float ppd, Fault* fault)
{
    int64_t count = (int64_t)a->width * a->height;
    if (a->width != b->width || a->height != b->height)
        return fault_set(fault, "pictures of %dx%d and %dx%d cannot be compared", a->width,
                         a->height, b->width, b->height);
    if (count > FLIP_MAX_PIXELS)
        return fault_set(fault, "%dx%d pixels are too many to compare: at most %lld", a->width,
                         a->height, (long long)FLIP_MAX_PIXELS);
    if (!(ppd >= 1.0f && ppd <= 700.0f))
        return fault_set(fault, "%g pixels per degree: want 1 to 700", (double)ppd);
    size_t planes = (size_t)count * (SHARED_PLANES + 2 * OWN_PLANES);
    float* memory = malloc((planes + (size_t)a->width + MAX_TAPS) * sizeof *memory);
    if (memory == NULL)
        return fault_set(fault, "no memory to compare %dx%d pixels", a->width, a->height);
    float* padded = memory + planes;
    Planes of_a = lay_out(memory, a, 0), of_b = lay_out(memory, b, 1);
    look_at(&of_a, a, ppd, padded);
    look_at(&of_b, b, ppd, padded);
    combine(map, &of_a, &of_b);
    free(memory);
    return true;
}
