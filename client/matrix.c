#include "client/matrix.h"

#include <cglm/struct.h>

#include <string.h>

static Mat4 from(mat4s matrix)
{
    Mat4 out;
    memcpy(out.m, matrix.raw, sizeof out.m);
    return out;
}

static mat4s to(const Mat4* matrix)
{
    mat4s out;
    memcpy(out.raw, matrix->m, sizeof matrix->m);
    return out;
}

static vec3s three(const float v[3])
{
    return (vec3s){{v[0], v[1], v[2]}};
}

Mat4 matrix_look_at(const float eye[3], const float target[3], const float up[3])
{
    return from(glms_lookat(three(eye), three(target), three(up)));
}

Mat4 matrix_perspective(float fov_rad, float aspect, float near_m, float far_m)
{
    return from(glms_perspective(fov_rad, aspect, near_m, far_m));
}

Mat4 matrix_ortho(float radius_m, float depth_m)
{
    return from(glms_ortho(-radius_m, radius_m, -radius_m, radius_m, 0.0f, depth_m));
}

Mat4 matrix_mul(const Mat4* a, const Mat4* b)
{
    return from(glms_mat4_mul(to(a), to(b)));
}
