// Camera matrices, from cglm: the only file that includes it, because cglm takes the name `vec3`.
#pragma once

// Column-major, as glUniformMatrix4fv takes it.
typedef struct Mat4 {
    float m[4][4]; // [column][row]
} Mat4;

Mat4 matrix_look_at(const float eye[3], const float target[3], const float up[3]);
Mat4 matrix_perspective(float fov_rad, float aspect, float near_m, float far_m);
// A block `radius_m` to all sides and `depth_m` deep, looking along -Z from its face.
Mat4 matrix_ortho(float radius_m, float depth_m);
Mat4 matrix_mul(const Mat4* a, const Mat4* b);
