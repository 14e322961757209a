// Where the picture is taken from. The camera orbits a point of the head and goes where the head
// goes, but does not turn with it: a nod stays visible. All matrices are relative to the head's
// position, so a head 100 km away is drawn as exactly as one at the origin.
#pragma once

#include "client/matrix.h"
#include "messages/hairstyle.h"

typedef struct CameraOptions {
    bool has_target, has_distance;
    Vec3 target;      // head space, m; default the style's head centre
    float distance_m; // default: far enough to hold the style at rest
    float yaw_deg;    // 0 sees the face, 90 stands on +X
    float pitch_deg;  // positive looks down
    float fov_deg;    // vertical
} CameraOptions;

typedef struct Camera {
    Mat4 view, projection;
    Vec3 eye; // relative to the head's position
} Camera;

// What all passes of one picture share. Axes are the world's, places relative to the head's.
typedef struct Frame {
    Camera camera;
    float pixel_m;               // what a pixel spans at the head
    float rotation[9];           // of the head, row-major
    Box bounds;                  // what hair fills now
    Box drawn;                   // what holds all that is drawn, at least
    float lit_low_m, lit_high_m; // ... and from where to where along a light
} Frame;

CameraOptions camera_default(void);
Camera camera_orbit(const CameraOptions* options, const Hairstyle* style, float aspect);

// Unit vector at `yaw_deg` (0: +Z, 90: +X) and `pitch_deg` above the horizon.
Vec3 camera_direction(float yaw_deg, float pitch_deg);
