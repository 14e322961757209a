// How far apart points and lines are: for what is measured once, at rest.
#pragma once

#include "messages/vec.h"

typedef struct Span {
    Vec3 from, to;
} Span;

static inline float span_clamp(float part)
{
    return part < 0.0f ? 0.0f : part < 1.0f ? part : 1.0f;
}

// The point of the span nearest to `point`; `from` where the span has no length.
static inline Vec3 span_nearest(Span span, Vec3 point)
{
    Vec3 along = vec3_sub(span.to, span.from);
    float square = vec3_dot(along, along);
    if (!(square > 0.0f)) return span.from;
    float part = vec3_dot(vec3_sub(point, span.from), along) / square;
    return vec3_add(span.from, vec3_scale(along, span_clamp(part)));
}

static inline float span_to_point(Span span, Vec3 point)
{
    return vec3_length(vec3_sub(point, span_nearest(span, point)));
}

// Distance of two spans. Where they are nearest inside both, by the normal equations; else at an
// end of one of them.
static inline float span_to_span(Span a, Span b)
{
    float ends = fminf(fminf(span_to_point(a, b.from), span_to_point(a, b.to)),
                       fminf(span_to_point(b, a.from), span_to_point(b, a.to)));
    Vec3 u = vec3_sub(a.to, a.from), v = vec3_sub(b.to, b.from), w = vec3_sub(a.from, b.from);
    float uu = vec3_dot(u, u), uv = vec3_dot(u, v), vv = vec3_dot(v, v);
    float area = uu * vv - uv * uv;
    if (!(area > 1e-6f * uu * vv)) return ends; // parallel, or a point
    float s = (uv * vec3_dot(v, w) - vv * vec3_dot(u, w)) / area;
    float t = (uu * vec3_dot(v, w) - uv * vec3_dot(u, w)) / area;
    if (s < 0.0f || s > 1.0f || t < 0.0f || t > 1.0f) return ends;
    Vec3 apart = vec3_add(w, vec3_sub(vec3_scale(u, s), vec3_scale(v, t)));
    return fminf(ends, vec3_length(apart));
}
