// Where the models fail: the failure maps of notes/simulation.md 4.6, measured with the daemon's
// own model code on a strand without a head, each held against the boundary that was derived for
// it.
#include "server/models.h"
#include "tests/maps.h"
#include "tests/studies.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct Map {
    const char* name;
    const char* axes;
    void (*measure)(Points* points);
} Map;

static const Map maps[] = {
    {"A", "x: k dt^2/m times the model's stiffest mode; y: c, what a step leaves of a velocity",
     map_verlet},
    {"B", "x: k dt^2/m; y: the downward springs' share r; 7 links, c = 0.97, 8 sweeps, 60 Hz",
     map_cascades},
    {"C", "x: k dt^2/J; y: v dt/J of the joints (forest-z), 1 - c (forest)", map_forests},
    {"D", "x: rest angle of the joint, degrees; y: azimuth of the push, degrees; value: response",
     map_azimuth},
    {"E", "x: sweeps; y: dt, s; value: stretch of the longest link of a chain that hangs",
     map_iterations},
    {"F", "x: rate of a head that spins, rad/s; y: dt, s; value: stretch of the longest link",
     map_spin},
    {"G", "x: as in A; y: nodes, c = 0.97; panel stretch: x: nodes; y: sweeps, value: stretch",
     map_nodes},
    {"H", "x: tilt of the head, degrees; value: farthest node from its rest place, lengths",
     map_tilt},
    {"I", "x: bend of a joint, degrees; y: its azimuth, degrees; value: twist, degrees, or length",
     map_frames},
    {"J", "x: Gamma; y: where the root points, degrees from down; value: largest bend, degrees",
     map_fold},
    {"K",
     "x: length of a link; y: radius of a pearl; value: depth of a link; in radii of the sphere",
     map_colliders},
};
#define MAPS (sizeof maps / sizeof maps[0])

static void print_map(const Map* map, const Points* points)
{
    printf("# map %s: %s\n", map->name, map->axes);
    for (int i = 0; i < points->count; ++i) {
        const Point* p = &points->all[i];
        printf("%s,%s,%.4g,%.4g,%s,%.3g\n", map->name, p->panel, p->x, p->y, p->class, p->value);
    }
}

static void print_verdicts(const Map* map, const Points* points)
{
    for (int i = 0; i < points->verdict_count; ++i) {
        const Verdict* v = &points->verdicts[i];
        printf("# %s %s, %s: ", map->name, v->panel, v->what);
        if (v->is_relative)
            printf("%+.2f %% on average, %+.2f %% at worst", 100.0 * v->mean, 100.0 * v->worst);
        else
            printf("%+.2g on average, %+.2g at worst", v->mean, v->worst);
        printf(" off what was derived (%d)\n", v->count);
    }
}

bool study_stability(Fault* fault)
{
    Points points[MAPS] = {{0}};
    bool has_failed = false;
    printf("# hair-bench stability: where the models fail, by the rules of tests/trial.h\n");
    study_machine();
    printf(
        "# class edge: x is where it was found to change, value where it was derived; law: a value "
        "derived; others: what was found at (x, y)\n");
    printf("map,panel,x,y,class,value\n");
    for (size_t i = 0; i < MAPS; ++i) {
        maps[i].measure(&points[i]);
        has_failed |= points[i].has_failed;
        if (!has_failed) print_map(&maps[i], &points[i]);
    }
    printf("# measured against derived\n");
    for (size_t i = 0; i < MAPS; ++i) {
        print_verdicts(&maps[i], &points[i]);
        free(points[i].all);
    }
    return !has_failed || fault_set(fault, "stability: a trial was refused, or no memory");
}
