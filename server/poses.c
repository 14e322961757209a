#include "server/poses.h"

#include "messages/trig.h"

#include <math.h>
#include <string.h>

#define WINDOW_S          2.0
#define FIRST_INTERVAL_S  0.05 // 20 Hz until measured: starting late is smoother than starving
#define LEAST_INTERVAL_S  0.004
#define MOST_INTERVAL_S   0.2
#define MOST_LATENESS_S   0.1
#define RETARGET          0.15  // of the filter's width: less is not worth a change of latency
#define CLOCK_SLEW        0.005 // the sender's clock is followed at this many seconds a second
#define CLOCK_JUMP_S      0.25  // further than this it is another clock
#define RESTART_S         1.0
#define LEAST_STEP_S      1e-4 // between samples
#define MOST_EXTRAPOLATED 4.0  // intervals, when a carry is compared with where the head would be
#define JUMP_M            0.5  // poses.h
#define JUMP_RAD          1.5707963
#define JUMP_M_S          10.0
#define JUMP_RAD_S        20.0

static double glide_at(const PoseGlide* glide, double t)
{
    if (!(glide->duration_s > 0.0)) return glide->to;
    double u = (t - glide->start_s) / glide->duration_s;
    return glide->from + (glide->to - glide->from) * trig_smooth(u);
}

// The reader's clock never runs more than a quarter slow or fast while the lag changes.
static void glide_to(PoseGlide* glide, double to, double now_s)
{
    double from = glide_at(glide, now_s);
    *glide = (PoseGlide){from, to, now_s, fmax(1.0, 7.5 * fabs(to - from))};
}

void poses_init(PoseRing* ring, Pose start, double tick_s)
{
    *ring = (PoseRing){.count = 1, .tick_s = tick_s, .interval_s = FIRST_INTERVAL_S};
    ring->ring[0] = (PoseSample){-1e9, start};
    ring->width_s.to = FIRST_INTERVAL_S;
    ring->lag_s.to = 2.0 * FIRST_INTERVAL_S + tick_s;
    ring->pending_turn = quat_identity();
}

static double quat_dot(Quat a, Quat b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
}

static Quat quat_toward(Quat a, Quat b, double s)
{
    return (Quat){a.x + (b.x - a.x) * s, a.y + (b.y - a.y) * s, a.z + (b.z - a.z) * s,
                  a.w + (b.w - a.w) * s};
}

static PoseSample* newest(PoseRing* ring)
{
    return &ring->ring[ring->count - 1];
}

static void append(PoseRing* ring, double time_s, Pose pose)
{
    // The same rotation has two quaternions; the one near the last keeps the average short.
    Quat last = newest(ring)->pose.orientation;
    if (quat_dot(last, pose.orientation) < 0.0)
        pose.orientation = (Quat){-pose.orientation.x, -pose.orientation.y, -pose.orientation.z,
                                  -pose.orientation.w};
    if (ring->count == POSES_RING) {
        memmove(ring->ring, ring->ring + 1, (POSES_RING - 1) * sizeof ring->ring[0]);
        --ring->count;
    }
    ring->ring[ring->count++] = (PoseSample){time_s, pose};
}

// Where two poses lead, `steps` of their distance beyond the second.
static Pose lead_on(const Pose* before, const Pose* last, double steps)
{
    steps = fmin(fmax(steps, 0.0), MOST_EXTRAPOLATED);
    Vec3d move = vec3d_sub(last->position, before->position);
    Quat q = quat_toward(before->orientation, last->orientation, 1.0 + steps);
    return (Pose){vec3d_add(last->position, vec3d_scale(move, steps)), quat_normalise(q)};
}

// Where the head would be at `time_s`, had it not been carried off.
static Pose expected(const PoseRing* ring, double time_s)
{
    const PoseSample* last = &ring->ring[ring->count - 1];
    if (ring->count < 2) return last->pose;
    const PoseSample* before = last - 1;
    double steps = (time_s - last->time_s) / (last->time_s - before->time_s);
    return lead_on(&before->pose, &last->pose, steps);
}

static bool is_far(const Pose* a, const Pose* b, double metres, double radians)
{
    Vec3d way = vec3d_sub(a->position, b->position);
    double cosine = fabs(quat_dot(a->orientation, b->orientation)); // of half the angle
    return vec3d_dot(way, way) > metres * metres ||
           (radians < TRIG_PI && cosine < trig_cos(0.5 * radians));
}

// A head at a steady 30 m/s is where its last two poses lead; one that stops dead is at the last.
static bool is_jump(const PoseRing* ring, const PoseMessage* message, double now_s)
{
    if (ring->sent_count < 2 || message->segment != ring->segment) return false;
    double apart = (double)(message->utime - ring->last_utime) * 1e-6;
    if (!(apart > 0.0)) apart = now_s - ring->last_heard_s; // a sender that began anew
    double beyond = fmax(apart - ring->interval_s, 0.0);
    double metres = JUMP_M + JUMP_M_S * beyond, radians = JUMP_RAD + JUMP_RAD_S * beyond;
    Pose led = lead_on(&ring->sent[0], &ring->sent[1], apart / ring->sent_apart_s);
    return is_far(&message->pose, &ring->sent[1], metres, radians) &&
           is_far(&message->pose, &led, metres, radians);
}

static void remember_sent(PoseRing* ring, const PoseMessage* message)
{
    bool begins = !ring->any || message->segment != ring->segment;
    ring->sent[0] = ring->sent[1];
    ring->sent[1] = message->pose;
    if (quat_dot(ring->sent[0].orientation, ring->sent[1].orientation) < 0.0) {
        Quat q = message->pose.orientation;
        ring->sent[1].orientation = (Quat){-q.x, -q.y, -q.z, -q.w};
    }
    ring->sent_count = begins ? 1 : 2;
    ring->sent_apart_s = fmax((double)(message->utime - ring->last_utime) * 1e-6, LEAST_STEP_S);
}

// Moves the whole path rigidly, so that it leads to `to` instead of where it would have led.
static void carry(PoseRing* ring, Pose to, double time_s)
{
    Pose from = expected(ring, time_s);
    Quat turn = quat_mul(to.orientation, quat_conjugate(from.orientation));
    // A carry without a turn must not touch a bit of the rotation.
    bool turned = fabs(quat_dot(to.orientation, from.orientation)) < 1.0 - 1e-12;
    if (!turned) turn = quat_identity();
    for (int i = 0; i < ring->count; ++i) {
        Pose* pose = &ring->ring[i].pose;
        Vec3d offset = vec3d_sub(pose->position, from.position);
        pose->position = vec3d_add(to.position, turned ? quat_rotate(turn, offset) : offset);
        if (turned) pose->orientation = quat_normalise(quat_mul(turn, pose->orientation));
    }
    // Two carries in one tick are one.
    ring->pending_turn = ring->pending ? quat_mul(turn, ring->pending_turn) : turn;
    ring->pending_is_turned = turned || (ring->pending && ring->pending_is_turned);
}

// Takes the path to `pose` by carry or reset, for the caller to do the same to the hair.
static void take_to(PoseRing* ring, Pose pose, uint8_t verb, double time_s)
{
    if (ring->pending && ring->pending_verb == POSE_RESET) verb = POSE_RESET;
    if (verb == POSE_CARRY) carry(ring, pose, time_s);
    if (verb == POSE_RESET) {
        ring->count = 1;
        ring->ring[0] = (PoseSample){-1e9, pose};
    }
    ring->pending = true;
    ring->pending_verb = verb;
}

static void enter_segment(PoseRing* ring, const PoseMessage* message, double time_s)
{
    ring->segment = message->segment;
    // Nothing is known of where a first pose comes from: the hair is taken there.
    uint8_t verb = message->verb;
    if (!ring->any && verb == POSE_FOLLOW) verb = POSE_CARRY;
    if (verb == POSE_FREEZE) verb = POSE_CARRY;
    if (verb != POSE_FOLLOW) take_to(ring, message->pose, verb, time_s);
}

static void start_clock(PoseRing* ring, double lateness_s, double now_s)
{
    ring->offset_s = lateness_s;
    ring->window_start_s = now_s;
    ring->least_s[0] = ring->least_s[1] = lateness_s;
    ring->most_s[0] = ring->most_s[1] = lateness_s;
}

// The least lateness is the best guess of the way between the clocks; lateness above it is the
// network's and ours (inputs wait for a tick).
static void follow_clock(PoseRing* ring, int64_t utime, double now_s)
{
    double lateness = now_s - (double)utime * 1e-6;
    if (!ring->any || fabs(lateness - ring->offset_s) > CLOCK_JUMP_S) {
        start_clock(ring, lateness, now_s);
        return;
    }
    if (now_s - ring->window_start_s > WINDOW_S) {
        ring->window_start_s = now_s;
        ring->least_s[1] = ring->least_s[0];
        ring->most_s[1] = ring->most_s[0];
        ring->least_s[0] = ring->most_s[0] = lateness;
    }
    ring->least_s[0] = fmin(ring->least_s[0], lateness);
    ring->most_s[0] = fmax(ring->most_s[0], lateness);
    double step = fmin(ring->least_s[0], ring->least_s[1]) - ring->offset_s;
    double most = CLOCK_SLEW * fmin(fmax(now_s - ring->last_heard_s, 0.0), 1.0);
    ring->offset_s += fmin(fmax(step, -most), most);
}

// A pause is not a slower source: three odd intervals in a row are.
static void follow_interval(PoseRing* ring, double interval_s)
{
    interval_s = fmin(fmax(interval_s, LEAST_INTERVAL_S), MOST_INTERVAL_S);
    bool odd = interval_s > 2.0 * ring->interval_s || interval_s < 0.5 * ring->interval_s;
    ring->odd_intervals = odd ? ring->odd_intervals + 1 : 0;
    if (!odd) ring->interval_s += (interval_s - ring->interval_s) / 8.0;
    if (ring->odd_intervals >= 3) ring->interval_s = interval_s;
}

// Width and lag stand still while the source is steady: were they to follow every estimate, the
// path would shake at the source's rate.
static void follow_source(PoseRing* ring, double now_s)
{
    double late = fmax(ring->most_s[0], ring->most_s[1]) - ring->offset_s;
    late = fmin(fmax(late, 0.0), MOST_LATENESS_S);
    double width = ring->interval_s, lag = 2.0 * width + late + ring->tick_s;
    double slack = RETARGET * ring->width_s.to;
    if (fabs(width - ring->width_s.to) <= slack && lag <= ring->lag_s.to + 0.25 * slack &&
        lag >= ring->lag_s.to - 2.0 * slack - 0.5 * ring->tick_s)
        return;
    glide_to(&ring->width_s, width, now_s);
    glide_to(&ring->lag_s, lag + 0.25 * slack, now_s);
}

// How far along the polyline the reader has looked.
static double read_head(const PoseRing* ring, double now_s)
{
    return now_s - glide_at(&ring->lag_s, now_s) + glide_at(&ring->width_s, now_s);
}

static bool is_stale(const PoseRing* ring, const PoseMessage* message, double now_s)
{
    if (!ring->any) return false;
    bool restarted = message->utime < ring->last_utime - (int64_t)(RESTART_S * 1e6) ||
                     now_s - ring->last_heard_s > RESTART_S;
    if (message->segment < ring->segment) return !restarted;
    return message->utime <= ring->last_utime && !restarted;
}

bool poses_push(PoseRing* ring, const PoseMessage* message, double now_s)
{
    if (is_stale(ring, message, now_s)) return false;
    bool jumps = is_jump(ring, message, now_s);
    remember_sent(ring, message);
    follow_clock(ring, message->utime, now_s);
    if (ring->any) follow_interval(ring, (double)(message->utime - ring->last_utime) * 1e-6);
    follow_source(ring, now_s);
    double head = read_head(ring, now_s);
    double time = fmax((double)message->utime * 1e-6 + ring->offset_s, head + LEAST_STEP_S);
    if (!ring->any || message->segment != ring->segment) enter_segment(ring, message, time);
    if (jumps) take_to(ring, message->pose, POSE_CARRY, time);
    if (head > newest(ring)->time_s + LEAST_STEP_S) append(ring, head, newest(ring)->pose);
    append(ring, fmax(time, newest(ring)->time_s + LEAST_STEP_S), message->pose);
    ring->frozen = message->verb == POSE_FREEZE;
    ring->any = true;
    ring->last_utime = message->utime;
    ring->last_heard_s = now_s;
    return jumps;
}

// A ramp max(0, x), averaged twice over `w`: 0 before -w, x after w, cubic pieces between.
static double smooth_ramp(double x, double w)
{
    if (x <= -w) return 0.0;
    if (x >= w) return x;
    double reach = w - fabs(x);
    return fmax(x, 0.0) + reach * reach * reach / (6.0 * w * w);
}

// How much of the move from sample `a` to sample `b` is done at `time`: 0 to 1, exactly at the
// ends, so that a head that came to rest is at rest to the bit.
static double part_done(const PoseSample* a, const PoseSample* b, double time, double width)
{
    if (time >= b->time_s + width) return 1.0;
    if (time <= a->time_s - width) return 0.0;
    return (smooth_ramp(time - a->time_s, width) - smooth_ramp(time - b->time_s, width)) /
           (b->time_s - a->time_s);
}

// The polyline as ramps: every sample adds one with the change of slope there. Everything is
// relative to the oldest sample, so that 100 km away costs nothing.
Pose poses_at(const PoseRing* ring, double t)
{
    double width = glide_at(&ring->width_s, t);
    double time = t - glide_at(&ring->lag_s, t);
    Pose pose = ring->ring[0].pose;
    for (int i = 0; i + 1 < ring->count; ++i) {
        const PoseSample *a = &ring->ring[i], *b = a + 1;
        double part = part_done(a, b, time, width);
        Vec3d move = vec3d_sub(b->pose.position, a->pose.position);
        Quat p = a->pose.orientation, q = b->pose.orientation;
        pose.position = vec3d_add(pose.position, vec3d_scale(move, part));
        pose.orientation.x += (q.x - p.x) * part;
        pose.orientation.y += (q.y - p.y) * part;
        pose.orientation.z += (q.z - p.z) * part;
        pose.orientation.w += (q.w - p.w) * part;
    }
    pose.orientation = quat_normalise(pose.orientation);
    return pose;
}
