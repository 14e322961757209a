#include "messages/quantise.h"

#include <float.h>

#define POSITION_STEPS 65535.0
#define TANGENT_STEPS  32767.0

// Double inside, one rounding to float at the end: the step count is then the only error that
// shows, and the bound above it stays simple.
float quantise_error_bound_m(const Box* box)
{
    Vec3d edge = vec3d_sub(vec3d_from(box->high), vec3d_from(box->low));
    Vec3 far = vec3(fmaxf(fabsf(box->low.x), fabsf(box->high.x)),
                    fmaxf(fabsf(box->low.y), fabsf(box->high.y)),
                    fmaxf(fabsf(box->low.z), fabsf(box->high.z)));
    double steps = 0.5 * sqrt(vec3d_dot(edge, edge)) / POSITION_STEPS;
    return (float)(steps * (1.0 + 1e-6) + (double)vec3_length(far) * 0.5 * (double)FLT_EPSILON);
}

static int quantise_axis(uint16_t* texel, float value, float low, float high)
{
    if (value < low || value > high) {
        *texel = value < low ? 0 : UINT16_MAX;
        return 1;
    }
    double edge = (double)high - (double)low;
    double part = edge > 0.0 ? ((double)value - (double)low) / edge : 0.0;
    *texel = (uint16_t)(part * POSITION_STEPS + 0.5);
    return 0;
}

int quantise_position(uint16_t texel[3], Vec3 position, const Box* box)
{
    if (!vec3_finite(position)) {
        texel[0] = texel[1] = texel[2] = 32768;
        return 3;
    }
    return quantise_axis(&texel[0], position.x, box->low.x, box->high.x) +
           quantise_axis(&texel[1], position.y, box->low.y, box->high.y) +
           quantise_axis(&texel[2], position.z, box->low.z, box->high.z);
}

static float dequantise_axis(uint16_t texel, float low, float high)
{
    double edge = (double)high - (double)low;
    return (float)((double)low + edge * (texel / POSITION_STEPS));
}

Vec3 dequantise_position(const uint16_t texel[3], const Box* box)
{
    return vec3(dequantise_axis(texel[0], box->low.x, box->high.x),
                dequantise_axis(texel[1], box->low.y, box->high.y),
                dequantise_axis(texel[2], box->low.z, box->high.z));
}

static Vec3d unit_or_down(Vec3d v)
{
    double length = sqrt(vec3d_dot(v, v));
    if (!(length > 1e-12) || !isfinite(length)) return (Vec3d){0.0, -1.0, 0.0};
    return vec3d_scale(v, 1.0 / length);
}

static int16_t snorm16(double value)
{
    return (int16_t)(value * TANGENT_STEPS + (value < 0.0 ? -0.5 : 0.5));
}

void quantise_tangent(int16_t texel[3], Vec3 tangent)
{
    Vec3d unit = unit_or_down(vec3d_from(tangent));
    texel[0] = snorm16(unit.x);
    texel[1] = snorm16(unit.y);
    texel[2] = snorm16(unit.z);
}

Vec3 dequantise_tangent(const int16_t texel[3])
{
    // -32768 decodes as -1, as in RGBA16_SNORM (OpenGL 4.2 and later, section 2.3.5).
    Vec3d v = {fmax(texel[0] / TANGENT_STEPS, -1.0), fmax(texel[1] / TANGENT_STEPS, -1.0),
               fmax(texel[2] / TANGENT_STEPS, -1.0)};
    return vec3_from(unit_or_down(v));
}

void quantise_strand_tangents(Vec3* tangents, const Vec3* positions, int nodes)
{
    Vec3 previous = vec3(0.0f, -1.0f, 0.0f);
    for (int i = 0; i < nodes; ++i) {
        Vec3 before = positions[i > 0 ? i - 1 : 0];
        Vec3 after = positions[i < nodes - 1 ? i + 1 : nodes - 1];
        previous = vec3_normalise_or(vec3_sub(after, before), previous);
        tangents[i] = previous;
    }
}
