// Where on a picture which strand angle is seen: highlights of hair are judged by it, because a
// fibre's lobes follow the angle and not the place.
#pragma once

#include "client/camera.h"
#include "messages/hairstyle.h"

// theta_h = (theta_i + theta_r) / 2 in radians at every pixel's nearest strand at rest (Marschner
// 2003, section 3: theta is the inclination from the fibre's normal plane), NAN where there is
// none. `towards_light` is unit. Top row first, `width` x `height`; free it. NULL without memory.
float* strand_angles(const Hairstyle* style, const Camera* camera, Vec3 towards_light, int width,
                     int height);
