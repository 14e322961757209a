// The pose ring of one head: poses arrive at 20-144 Hz with the sender's times, the simulation
// reads a smooth path at its own substeps.
//
// The path is the polyline through the poses, averaged twice over one source interval (two box
// filters). At an even rate that is the uniform cubic B-spline with the poses as control points;
// at any jitter it stays C2 and reproduces linear motion exactly, which a spline with uneven knots
// only does when its control points wait for one more pose. Its zeros lie at the source's rate and
// its multiples, so no comb is left there in tip speed; linear interpolation and Catmull-Rom leave
// one. The price is latency: one interval for the average, one for the polyline to know its next
// corner, and the lateness observed.
//
// A pose that arrives too late finds that the path has already been read past its place as a hold:
// a hold is put into the ring where reading stopped, so the path never changes behind the reader
// and stays C2 through any starvation. A segment is entered by its verb, whichever of its messages
// arrives first.
#pragma once

#include "messages/control.h"

#define POSES_RING 32

typedef struct PoseSample {
    double time_s; // on the daemon's simulation clock
    Pose pose;
} PoseSample;

// A value on its way from one setting to the next, C2 in time.
typedef struct PoseGlide {
    double from, to;
    double start_s, duration_s;
} PoseGlide;

typedef struct PoseRing {
    PoseSample ring[POSES_RING];
    int count;       // samples held, oldest first
    int32_t segment; // of the samples
    bool any;        // a pose was ever heard
    bool frozen;
    int64_t last_utime;  // of the newest message
    double last_heard_s; // when it was consumed
    // The last two poses of the segment as they were sent: a jump is seen in these.
    Pose sent[2];
    int sent_count;
    double sent_apart_s;
    double tick_s; // inputs are consumed this far apart
    // Sender's clock to simulation time: the least lateness of two windows, approached slowly.
    double offset_s;
    double window_start_s;
    double least_s[2], most_s[2]; // arrival - sender's time, of this window and the one before
    double interval_s;            // of the source, smoothed
    int odd_intervals;            // in a row that do not fit
    PoseGlide width_s;            // of each box filter
    PoseGlide lag_s;              // how far behind the path is read
    // A segment change for the caller to act on; it clears `pending`.
    bool pending;
    uint8_t pending_verb; // PoseVerb; carry also for the first pose ever and for freeze
    Quat pending_turn;    // carry: how far the path turned
    bool pending_is_turned;
} PoseRing;

void poses_init(PoseRing* ring, Pose start, double tick_s);

// Takes a message consumed at simulation time `now_s`: the path has been read up to there. Messages
// of a lower segment are ignored unless the sender's clock went back by more than a second or it
// was silent for one (a restarted sender).
//
// True where the head has jumped within its segment, a teleport that the sender did not call one:
// it is then carried. A jump is a pose 0.5 m or 90 degrees away both from the last and from where
// the last two lead, and 10 m/s or 20 rad/s further for what is beyond one source interval, as
// messages may have been lost. At 20 Hz a run makes 0.18 m and a flip 34 degrees of an interval.
bool poses_push(PoseRing* ring, const PoseMessage* message, double now_s);

// The pose at simulation time `t`. Continuous in position, velocity and acceleration within a
// segment.
Pose poses_at(const PoseRing* ring, double t);
