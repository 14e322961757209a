// What hair is kept out of.
#include "points_block.glsl"

// Out of the head's capsules (drawn_push_out of messages/drawn.h).
vec3 push_out(vec3 at)
{
    for (int i = 0; i < capsules.x; ++i) {
        vec3 from = at - capsule_from[i].xyz, axis = capsule_to[i].xyz - capsule_from[i].xyz;
        float square = dot(axis, axis);
        from -= axis * (square > 0.0 ? clamp(dot(from, axis) / square, 0.0, 1.0) : 0.0);
        float distance = length(from), lack = capsule_from[i].w - distance;
        if (lack > 0.0 && distance >= 1e-6) at += from * (min(lack, distance) / distance);
    }
    return at;
}
