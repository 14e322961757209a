#include "client/extent.h"

#include <math.h>

#define PAD_PX 2.0f // ribbons are never drawn thinner than a pixel

Box box_join(Box a, Box b)
{
    return (Box){vec3_min(a.low, b.low), vec3_max(a.high, b.high)};
}

Box box_rotate(Box box, const float r[9])
{
    Vec3 middle = vec3_scale(vec3_add(box.low, box.high), 0.5f);
    Vec3 half = vec3_scale(vec3_sub(box.high, box.low), 0.5f);
    Vec3 m = vec3(r[0] * middle.x + r[1] * middle.y + r[2] * middle.z,
                  r[3] * middle.x + r[4] * middle.y + r[5] * middle.z,
                  r[6] * middle.x + r[7] * middle.y + r[8] * middle.z);
    Vec3 h = vec3(fabsf(r[0]) * half.x + fabsf(r[1]) * half.y + fabsf(r[2]) * half.z,
                  fabsf(r[3]) * half.x + fabsf(r[4]) * half.y + fabsf(r[5]) * half.z,
                  fabsf(r[6]) * half.x + fabsf(r[7]) * half.y + fabsf(r[8]) * half.z);
    return (Box){vec3_sub(m, h), vec3_add(m, h)};
}

static Box around(Vec3 p, float reach)
{
    Vec3 r = {reach, reach, reach};
    return (Box){vec3_sub(p, r), vec3_add(p, r)};
}

Box extent_still(const Hair* hair)
{
    Box box = {vec3(1e9f, 1e9f, 1e9f), vec3(-1e9f, -1e9f, -1e9f)};
    if (hair->body.index_count > 0) box = hair->body.box;
    for (int i = 0; i < hair->ribbons.collider_count; ++i) {
        const Collider* c = &hair->ribbons.colliders[i];
        box = box_join(box, box_join(around(c->from, c->radius), around(c->to, c->radius)));
    }
    return box;
}

float extent_stray(const Ribbons* ribbons)
{
    float most = 0.0f;
    for (int i = 0; i < ribbons->point_count; ++i) {
        const float* o = ribbons->offsets[i];
        most = fmaxf(most, vec3_length(vec3(o[0], o[1], o[2])) + ribbons->weights[i][3]);
    }
    return most;
}

Extent extent_seen(const Mat4* view_projection, Box box, int width, int height)
{
    const float(*m)[4] = view_projection->m;
    float low[2] = {1e9f, 1e9f}, high[2] = {-1e9f, -1e9f}, size[2] = {(float)width, (float)height};
    for (int corner = 0; corner < 8; ++corner) {
        float p[3] = {corner & 1 ? box.high.x : box.low.x, corner & 2 ? box.high.y : box.low.y,
                      corner & 4 ? box.high.z : box.low.z};
        float w = m[0][3] * p[0] + m[1][3] * p[1] + m[2][3] * p[2] + m[3][3];
        if (w < 1e-3f) return (Extent){0, 0, width, height};
        for (int a = 0; a < 2; ++a) {
            float clip = m[0][a] * p[0] + m[1][a] * p[1] + m[2][a] * p[2] + m[3][a];
            float at = (clip / w * 0.5f + 0.5f) * size[a];
            low[a] = fminf(low[a], at);
            high[a] = fmaxf(high[a], at);
        }
    }
    for (int a = 0; a < 2; ++a) {
        low[a] = fminf(fmaxf(floorf(low[a] - PAD_PX), 0.0f), size[a]);
        high[a] = fmaxf(fminf(ceilf(high[a] + PAD_PX), size[a]), low[a]);
    }
    return (Extent){(int)low[0], (int)low[1], (int)(high[0] - low[0]), (int)(high[1] - low[1])};
}
