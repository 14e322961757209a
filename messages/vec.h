// Three-vectors, quaternions and poses, by value. SI units; right-handed, Y up, the face to +Z.
//
// Own rather than cglm: the step and both growers must give the same bits under every compiler and
// flag here, and cglm uses fused multiply-add when the machine has it. Cameras use cglm.
#pragma once

#include <math.h>
#include <stdbool.h>

#define POSE_FARTHEST_M 1e9 // a head beyond is a broken sender's

typedef struct Vec3 {
    float x, y, z;
} Vec3;

typedef struct Vec3d {
    double x, y, z;
} Vec3d;

// Unit quaternion, x y z the vector part; rotates head space into world space.
typedef struct Quat {
    double x, y, z, w;
} Quat;

// Where a head is: world = position + orientation * head. Double, so that 100 km costs nothing.
typedef struct Pose {
    Vec3d position;
    Quat orientation;
} Pose;

// An axis-aligned box, head space, metres.
typedef struct Box {
    Vec3 low, high;
} Box;

typedef struct Sphere {
    Vec3 centre;
    float radius;
} Sphere;

// What hair collides with: the sphere of `radius` swept along a line, its axis. A sphere where both
// ends are the same.
typedef struct Collider {
    Vec3 from, to; // of the axis, head space while the body is straight, m
    float radius;  // m
    int body;      // ColliderBody
} Collider;

// What a collider moves with.
typedef enum ColliderBody { BODY_HEAD, BODY_TORSO, BODY_COUNT } ColliderBody;

static inline Collider collider_sphere(Sphere sphere)
{
    return (Collider){sphere.centre, sphere.centre, sphere.radius, BODY_HEAD};
}

static inline Vec3 vec3(float x, float y, float z)
{
    return (Vec3){x, y, z};
}

static inline Vec3 vec3_add(Vec3 a, Vec3 b)
{
    return (Vec3){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline Vec3 vec3_sub(Vec3 a, Vec3 b)
{
    return (Vec3){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline Vec3 vec3_scale(Vec3 a, float s)
{
    return (Vec3){a.x * s, a.y * s, a.z * s};
}

// a + b * s
static inline Vec3 vec3_mad(Vec3 a, Vec3 b, float s)
{
    return (Vec3){a.x + b.x * s, a.y + b.y * s, a.z + b.z * s};
}

static inline Vec3 vec3_lerp(Vec3 a, Vec3 b, float t)
{
    return vec3_mad(a, vec3_sub(b, a), t);
}

static inline float vec3_dot(Vec3 a, Vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline Vec3 vec3_cross(Vec3 a, Vec3 b)
{
    return (Vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline float vec3_length(Vec3 a)
{
    return sqrtf(vec3_dot(a, a));
}

// `a` scaled to length one, or `fallback` where `a` is too short to have a direction.
static inline Vec3 vec3_normalise_or(Vec3 a, Vec3 fallback)
{
    float length = vec3_length(a);
    return length > 1e-12f ? vec3_scale(a, 1.0f / length) : fallback;
}

// The least of each axis.
static inline Vec3 vec3_min(Vec3 a, Vec3 b)
{
    return (Vec3){fminf(a.x, b.x), fminf(a.y, b.y), fminf(a.z, b.z)};
}

// The largest of each axis.
static inline Vec3 vec3_max(Vec3 a, Vec3 b)
{
    return (Vec3){fmaxf(a.x, b.x), fmaxf(a.y, b.y), fmaxf(a.z, b.z)};
}

static inline bool vec3_finite(Vec3 a)
{
    return isfinite(a.x) && isfinite(a.y) && isfinite(a.z);
}

static inline Vec3d vec3d_add(Vec3d a, Vec3d b)
{
    return (Vec3d){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline Vec3d vec3d_sub(Vec3d a, Vec3d b)
{
    return (Vec3d){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline Vec3d vec3d_scale(Vec3d a, double s)
{
    return (Vec3d){a.x * s, a.y * s, a.z * s};
}

// a + b * s
static inline Vec3d vec3d_mad(Vec3d a, Vec3d b, double s)
{
    return vec3d_add(a, vec3d_scale(b, s));
}

static inline double vec3d_dot(Vec3d a, Vec3d b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline Vec3d vec3d_cross(Vec3d a, Vec3d b)
{
    return (Vec3d){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline Vec3d vec3d_from(Vec3 a)
{
    return (Vec3d){(double)a.x, (double)a.y, (double)a.z};
}

static inline Vec3 vec3_from(Vec3d a)
{
    return (Vec3){(float)a.x, (float)a.y, (float)a.z};
}

static inline Quat quat_identity(void)
{
    return (Quat){0, 0, 0, 1};
}

static inline Pose pose_identity(void)
{
    return (Pose){{0, 0, 0}, {0, 0, 0, 1}};
}

// Whether `position` may be a head's; not where a part is NaN.
static inline bool pose_is_near(Vec3d position)
{
    return fabs(position.x) < POSE_FARTHEST_M && fabs(position.y) < POSE_FARTHEST_M &&
           fabs(position.z) < POSE_FARTHEST_M;
}

// a after b: rotates by b first.
static inline Quat quat_mul(Quat a, Quat b)
{
    return (Quat){a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                  a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                  a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
                  a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

static inline Quat quat_conjugate(Quat q)
{
    return (Quat){-q.x, -q.y, -q.z, q.w};
}

static inline double quat_length(Quat q)
{
    return sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
}

// Unit length, or the identity where `q` has none.
static inline Quat quat_normalise(Quat q)
{
    double length = quat_length(q);
    if (!(length > 1e-12)) return quat_identity();
    double s = 1.0 / length;
    return (Quat){q.x * s, q.y * s, q.z * s, q.w * s};
}

static inline Vec3d quat_rotate(Quat q, Vec3d v)
{
    Vec3d u = {q.x, q.y, q.z};
    Vec3d t = vec3d_scale(vec3d_cross(u, v), 2.0);
    return vec3d_add(vec3d_add(v, vec3d_scale(t, q.w)), vec3d_cross(u, t));
}

// The rotation as a matrix, row-major: world = m * head.
static inline void quat_matrix(float m[9], Quat q)
{
    Vec3d x = quat_rotate(q, (Vec3d){1, 0, 0}), y = quat_rotate(q, (Vec3d){0, 1, 0});
    Vec3d z = quat_rotate(q, (Vec3d){0, 0, 1});
    m[0] = (float)x.x, m[1] = (float)y.x, m[2] = (float)z.x;
    m[3] = (float)x.y, m[4] = (float)y.y, m[5] = (float)z.y;
    m[6] = (float)x.z, m[7] = (float)y.z, m[8] = (float)z.z;
}
