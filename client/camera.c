#include "client/camera.h"

#define RADIANS (3.14159265358979f / 180.0f)

CameraOptions camera_default(void)
{
    return (CameraOptions){.pitch_deg = 5.0f, .yaw_deg = 30.0f, .fov_deg = 45.0f};
}

Vec3 camera_direction(float yaw_deg, float pitch_deg)
{
    float yaw = yaw_deg * RADIANS, pitch = pitch_deg * RADIANS;
    return vec3(sinf(yaw) * cosf(pitch), sinf(pitch), cosf(yaw) * cosf(pitch));
}

// How far from `target` the eye must stand for every rest node to be in the picture with a margin,
// from any side: the sphere round them has to fit the narrower angle. One distance for all sides,
// so that an orbit does not breathe.
static float fit_distance(const Hairstyle* style, Vec3 target, float fov_deg, float aspect)
{
    float reach = 0.16f; // of a head without hair
    for (int i = 0; i < style->guide_count * style->nodes; ++i)
        reach = fmaxf(reach, vec3_length(vec3_sub(style->rest[i], target)));
    float slope = tanf(fov_deg * RADIANS * 0.5f) * fminf(aspect, 1.0f);
    return 1.03f * reach * sqrtf(1.0f + 1.0f / (slope * slope)) + 0.02f;
}

Camera camera_orbit(const CameraOptions* options, const Hairstyle* style, float aspect)
{
    Vec3 target = options->has_target ? options->target : style->head_centre;
    float distance = options->has_distance ? options->distance_m
                                           : fit_distance(style, target, options->fov_deg, aspect);
    Camera camera;
    camera.eye = vec3_mad(target, camera_direction(options->yaw_deg, options->pitch_deg), distance);
    // Straight above or below, "up" is what it tends to on the way there: pictures do not jump.
    bool steep = fabsf(options->pitch_deg) > 89.0f;
    Vec3 ahead = camera_direction(options->yaw_deg, 0.0f);
    float back = options->pitch_deg > 0.0f ? -1.0f : 1.0f;
    const float up[3] = {steep ? back * ahead.x : 0, steep ? 0 : 1, steep ? back * ahead.z : 0};
    const float from[3] = {camera.eye.x, camera.eye.y, camera.eye.z};
    const float to[3] = {target.x, target.y, target.z};
    camera.view = matrix_look_at(from, to, up);
    float near_m = fmaxf(0.02f, distance * 0.05f);
    camera.projection =
        matrix_perspective(options->fov_deg * RADIANS, aspect, near_m, distance * 4.0f + 4.0f);
    return camera;
}
