// The failure maps of hair-bench stability, by the files that measure them.
#pragma once

#include "tests/trial.h"

// maps_steps.c: where a step is too long.
void map_verlet(Points* points);   // A
void map_cascades(Points* points); // B
void map_forests(Points* points);  // C
void map_nodes(Points* points);    // G

// maps_frames.c: where a joint does not answer, and where a frame turns over.
void map_azimuth(Points* points); // D
void map_frames(Points* points);  // I

// maps_statics.c: where a strand comes to rest.
void map_tilt(Points* points); // H
void map_fold(Points* points); // J

// maps_motion.c: where lengths and the head are not kept.
void map_iterations(Points* points); // E
void map_spin(Points* points);       // F
void map_colliders(Points* points);  // K
