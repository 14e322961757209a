// A strand without a head, kicked and watched, and grids of such trials: what the failure maps of
// hair-bench stability share.
//
// By the rules of notes/simulation.md 4.6, over ten seconds: it is unstable if a strand was lost
// (the solver puts a lost one back to rest, where it looks calm), if it is still away from rest in
// the last two seconds, or if it then moves more than in the first.
#pragma once

#include "server/sim.h"

#define TRIAL_LINKS    32
#define TRIAL_LENGTH_M 0.28
#define TRIAL_FALL_OFF 16.0f // 1/m, where stiffness falls off at all
#define TRIAL_GRAVITY  9.81
#define TRIAL_SUBSTEPS 64
#define TRIAL_S        10.0
#define TRIAL_WINDOW_S 2.0
#define TRIAL_KICK_M   1e-3
#define TRIAL_AWAY     1e-2 // of its length: it has not come back
#define TRIAL_STRETCH  0.1  // of a link: it is seen
#define TRIAL_STIFF    0.1  // of the response that it should have: it is not seen to answer

typedef struct Trial {
    Sim* sim;
    SimDefinition definition; // its pointers are not the sim's
    Vec3 rest[TRIAL_LINKS + 1];
    int links;
    SimHead heads[TRIAL_SUBSTEPS]; // of the next tick
    Vec3 now[TRIAL_LINKS + 1], before[TRIAL_LINKS + 1];
} Trial;

// Links of 4 cm make up 28 cm where there are 7; no gravity, no stiffness, no damping, no fall-off,
// one substep of 1/60 s, one sweep of length correction whatever the model has by default; bounds
// are passed by force.
SimDefinition trial_bare(ModelKind model, int links);

// The damping that leaves `kept` of a velocity after a step of 1/60 s.
float trial_damping(double kept);

// Lays the strand out along `way`.
void trial_straight(Trial* trial, int links, Vec3 way);

// At rest under a head that rests. False where the solver refuses: none of these may be.
bool trial_start(Trial* trial, SimDefinition definition);
void trial_end(Trial* trial);

// The head turned by `rotation` at the end of every substep, its position's second difference
// `push`.
void trial_head(Trial* trial, const float rotation[9], Vec3 push);

void trial_run(Trial* trial, double seconds);
void trial_read(Trial* trial); // the state into now and before

// Every free node 1 mm aside, at rest.
void trial_kick(Trial* trial);

typedef struct Watch {
    double away;        // farthest from the strand's straight line in the last 2 s, lengths
    double stretch;     // largest of a link in the last 2 s, of its length
    double first, last; // mean square velocity in the first and in the last 2 s
    bool is_lost;
} Watch;

// 10 s; of a straight strand.
Watch trial_watch(Trial* trial);

// "calm", "stretched", "flutter" or "lost".
const char* watch_class(const Watch* watch);
bool is_calm(const char* class); // neither flutters nor is lost

// Rotation by `angle` about z (roll, axis 2) or y (yaw, axis 1), row-major.
void trial_rotation(double angle, int axis, float rotation[9]);

// The angle between two vectors.
double trial_degrees(Vec3 a, Vec3 b);

// The longest link's part beyond its length.
double trial_stretch(const Trial* trial);

// --- Maps --------------------------------------------------------------------------------------

// A row of the CSV. Of class "edge" x is where the map was found to change and `value` where it
// was derived; of class "law" the value is derived.
typedef struct Point {
    const char* panel;
    double x, y;
    const char* class;
    double value;
} Point;

// How far a panel is from what was derived: off as a part of it, or as it is.
typedef struct Verdict {
    const char *panel, *what;
    int count;
    double mean, worst;
    bool is_relative;
} Verdict;

#define POINTS_VERDICTS 16

typedef struct Points {
    Point* all;
    int count, capacity;
    Verdict verdicts[POINTS_VERDICTS];
    int verdict_count;
    bool has_failed; // a trial was refused, or no memory
} Points;

void points_add(Points* points, Point point);

// Counts `got` against `wanted` in the verdict on (panel, what).
void points_judge(Points* points, const char* panel, const char* what, double got, double wanted,
                  bool is_relative);

typedef struct Scale {
    double low, high;
    int count;
    bool is_log;
} Scale;

// The middle of bin i; with is_log the bins are alike in the logarithm.
double axis_at(const Scale* axis, double i);

// A panel of a map: `measure` gives class and value at (x, y). `derived` gives where along x the
// edge that was found at `x` should be, NAN where nothing is derived.
typedef struct Panel {
    const char* name;
    ModelKind model;
    int fall_off;
    bool has_gravity;
    CollideMode collide;
    Scale x, y;
    Point (*measure)(const struct Panel* panel, double x, double y);
    double (*derived)(const struct Panel* panel, double x, double y);
    bool is_first_edge_alone;
    bool is_edge_of_stretch; // edges are where strands begin to stretch, too
    bool is_absolute; // edges are judged by the distance, not by the ratio: they come near zero
} Panel;

// Every bin, on all cores, and the edges between calm and not along x, by bisection.
void panel_measure(const Panel* panel, Points* points);
// The edges alone.
void panel_edges(const Panel* panel, Points* points);
