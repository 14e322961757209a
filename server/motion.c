// Motions use notes/simulation.md section 3: amplitudes, rates and envelopes; a loop is the clip
// and then 2 s of rest, so that settling can be watched.
#include "server/motion.h"

#include "messages/control.h"
#include "messages/trig.h"

#include <string.h>

#define LOOP_S     4.0
#define PIVOT_Y_M  0.066 // the neck: 0.15 m below the middle of the head
#define RUN_M_S    3.5
#define STRIDES_HZ 1.4
#define TELEPORT_S 2.0
#define TELEPORT_M 1.0
#define TURN_S     0.1
#define LONG_S     6.0 // loop of the clips that rest twice
#define WALK_M_S   1.5
#define WALK_S     1.0
#define JUMP_S     3.0 // when it leaves the ground
#define JUMP_M_S   3.0
#define FALL_M_S2  9.81
#define FLIP_S     0.5
#define FLIP_BACK  3.5
#define GUST_M_S   8.0

static MotionState state(Vec3d position, Quat orientation)
{
    // A rotation about the pivot P is one about the origin and a move by P - R P.
    Vec3d pivot = {0.0, PIVOT_Y_M, 0.0};
    Vec3d move = vec3d_sub(pivot, quat_rotate(orientation, pivot));
    return (MotionState){.pose = {vec3d_add(position, move), orientation}, .verb = POSE_FOLLOW};
}

static Quat about(double x, double y, double z, double angle)
{
    double s = trig_sin(0.5 * angle);
    return (Quat){x * s, y * s, z * s, trig_cos(0.5 * angle)};
}

static double fraction(double t)
{
    return t - floor(t);
}

// Eases in and out of a clip of 2 s.
static double envelope(double t)
{
    return trig_smooth(t / 0.25) * trig_smooth((2.0 - t) / 0.25);
}

static double swing(double t, double amplitude, double hz)
{
    double clip = LOOP_S * fraction(t / LOOP_S);
    return amplitude * envelope(clip) * trig_sin(2.0 * TRIG_PI * hz * clip);
}

static MotionState at_rest(double t)
{
    (void)t;
    return state((Vec3d){0, 0, 0}, quat_identity());
}

static MotionState nod(double t)
{
    return state((Vec3d){0, 0, 0}, about(1, 0, 0, swing(t, 0.52, 1.2)));
}

static MotionState shake(double t)
{
    return state((Vec3d){0, 0, 0}, about(0, 1, 0, swing(t, 0.80, 1.5)));
}

// Forward for ever: a loop would have to brake or jump. The kinks of |sin| are the feet.
static MotionState run(double t)
{
    double stride = trig_sin(2.0 * TRIG_PI * fraction(STRIDES_HZ * t));
    return state((Vec3d){0.0, 0.05 * fabs(stride), RUN_M_S * t}, about(0, 0, 1, 0.08 * stride));
}

// Half a turn in 0.1 s: beyond any human, for stress. Every loop turns on by another half.
static MotionState turn(double t)
{
    double loop = floor(t / LOOP_S), halves = loop - 4.0 * floor(loop / 4.0);
    return state((Vec3d){0, 0, 0},
                 about(0, 1, 0, TRIG_PI * (halves + trig_smooth((t - LOOP_S * loop) / TURN_S))));
}

static MotionState teleport(double t)
{
    double jumps = t > 0.0 ? floor(t / TELEPORT_S) : 0.0;
    bool away = jumps - 2.0 * floor(0.5 * jumps) > 0.5;
    MotionState at = state((Vec3d){away ? TELEPORT_M : 0.0, 0.0, 0.0}, quat_identity());
    at.segment = (int)jumps;
    at.verb = POSE_CARRY;
    return at;
}

// A walk that stops dead, and a jump that lands dead: steps of velocity, 2 s of rest after each.
static MotionState jump_stop(double t)
{
    double loop = floor(t / LONG_S), clip = t - LONG_S * loop;
    double walked = clip < WALK_S ? clip : WALK_S, air = clip > JUMP_S ? clip - JUMP_S : 0.0;
    double height = JUMP_M_S * air - 0.5 * FALL_M_S2 * air * air;
    return state((Vec3d){0.0, height > 0.0 ? height : 0.0, WALK_M_S * (WALK_S * loop + walked)},
                 quat_identity());
}

// Head over, 3 s upside down, and on over to upright.
static MotionState flip(double t)
{
    double clip = LONG_S * fraction(t / LONG_S);
    double halves = trig_smooth(clip / FLIP_S) + trig_smooth((clip - FLIP_BACK) / FLIP_S);
    return state((Vec3d){0, 0, 0}, about(1, 0, 0, TRIG_PI * (halves < 2.0 ? halves : 0.0)));
}

// Rises in 0.2 s, flutters, and is gone after 1.5.
static MotionState gust(double t)
{
    double clip = LOOP_S * fraction(t / LOOP_S);
    double strength = trig_smooth(clip / 0.2) * (1.0 - trig_smooth((clip - 1.0) / 0.5));
    double flutter = 1.0 + 0.25 * trig_sin(2.0 * TRIG_PI * 3.1 * clip) +
                     0.15 * trig_sin(2.0 * TRIG_PI * 7.3 * clip);
    MotionState at = at_rest(t);
    at.wind.x = GUST_M_S * strength * flutter;
    return at;
}

const Motion motions[] = {
    {"none", "the head rests", at_rest},
    {"bus", "poses come from " CHANNEL_POSE " messages", NULL},
    {"nod", "30 degrees at 1.2 Hz for 2 s, then 2 s of rest", nod},
    {"shake", "46 degrees at 1.5 Hz for 2 s, then 2 s of rest", shake},
    {"jump-stop", "1.5 m/s for 1 s and a dead stop; then a jump of 46 cm", jump_stop},
    {"run", "3.5 m/s for ever, with the bounce of the steps", run},
    {"flip", "head over in 0.5 s, 3 s upside down, and on over", flip},
    {"turn", "half a turn in 0.1 s every 4 s: stress", turn},
    {"teleport", "a jump of 1 m every 2 s, hair carried along", teleport},
    {"gust", "the head rests; 8 m/s of wind along +X for 1.5 s, then 2.5 s of rest", gust},
    {NULL, NULL, NULL},
};

const Motion* motion_find(const char* name)
{
    for (const Motion* motion = motions; motion->name != NULL; ++motion)
        if (strcmp(motion->name, name) == 0) return motion;
    return NULL;
}
