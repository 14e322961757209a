#include "tests/clip.h"

#include <math.h>
#include <string.h>

#define RUN_STRIDES_HZ 1.4
#define RUN_STOP_S     (5.0 / RUN_STRIDES_HZ) // a foot is on the ground, the head upright

const Clip clips[] = {
    {"nod", 2.0, 3.5, 0, 1.0 / 1.2},
    {"shake", 2.0, 3.5, 0, 1.0 / 1.5},
    {"jump-stop", 3.6116, 5.0, 0, 1.0},
    {"run", RUN_STOP_S, 5.0, 3.5, 0.5 / RUN_STRIDES_HZ},
    {"flip", 4.0, 5.0, 0, 1.0},
    {"turn", 0.1, 1.5, 0, 1.0},
    {"teleport", 2.0, 3.0, 0, 1.0},
    {"gust", 1.5, 3.0, 0, 1.0},
    {NULL, 0, 0, 0, 0},
};

MotionState clip_at(const Clip* clip, double t)
{
    MotionFunction at = motion_find(clip->name)->at;
    if (clip->speed_m_s == 0.0 || t < clip->stop_s) return at(t);
    MotionState state = at(clip->stop_s);
    state.pose.position.z += clip->speed_m_s * (t - clip->stop_s);
    return state;
}

int clip_ticks(const Clip* clip)
{
    return (int)lround(clip->seconds * CLIP_RATE_HZ);
}

ClipReader clip_begin(const Clip* clip, int substeps)
{
    MotionState state = clip_at(clip, 0.0);
    return (ClipReader){.clip = clip,
                        .substeps = substeps,
                        .position = state.pose.position,
                        .move = {0, 0, clip->speed_m_s / (CLIP_RATE_HZ * substeps)},
                        .segment = state.segment};
}

void clip_next(ClipReader* reader, SimHead* heads)
{
    for (int s = 0; s < reader->substeps; ++s) {
        double t = (double)++reader->done / (CLIP_RATE_HZ * reader->substeps);
        MotionState state = clip_at(reader->clip, t);
        Vec3d move = vec3d_sub(state.pose.position, reader->position), change = {0, 0, 0};
        if (state.segment == reader->segment) {
            change = vec3d_sub(move, reader->move);
            reader->move = move;
        } // else carried: the jump is no motion
        reader->position = state.pose.position;
        reader->segment = state.segment;
        quat_matrix(heads[s].rotation, state.pose.orientation);
        heads[s].second_difference = vec3_from(change);
        heads[s].move = vec3_from(reader->move);
        heads[s].wind = vec3_from(state.wind);
    }
}
