// Ribbons on the CPU, for tests and studies of shadows: what of them a ray of light crosses, one by
// one, which is the truth that shadow methods are held against; ribbons of one's own as a Hair that
// the passes draw like any other; and what the shaders say of places.
#pragma once

#include "client/shadow.h"

// Ribbons end to end, as the update pass leaves them; head-relative world axes, m.
typedef struct Strips {
    int ribbon_count, point_count;
    int* first; // point of each ribbon, and one behind the last
    Vec3 *at, *tangent;
    float *half_width_m, *fill;
} Strips;

// Room for `ribbons` ribbons of `points` points each. Ends the program where there is no memory.
Strips strips_make(int ribbons, int points);
// What `hair` draws, read back from the update pass, turned by `rotation`.
Strips strips_read(const Gl* gl, const Hair* hair, const float rotation[9]);
void strips_free(Strips* strips);

// As a Hair without guides; hair_free frees it.
Hair strips_hair(const Strips* strips, const Gl* gl);

// Strips as light from one direction sees them.
typedef struct Lit {
    const Strips* strips;
    Vec3 axes[3];                           // across, across, towards the light
    double *x[2], *y[2], *depth;            // edges of points; depth grows away from the light
    float *low_x, *high_x, *low_y, *high_y; // of ribbons
} Lit;

Lit lit_make(const Strips* strips, Vec3 light);
void lit_free(Lit* lit);
// Product of 1 - fill over all that lies between `place` and the light, but of ribbon `own` (-1:
// none).
double lit_transmittance(const Lit* lit, Vec3 place, int own);

// What the shaders say of places, from what `shadow` has rendered. False with a fault.
typedef struct Probe {
    GLuint program, framebuffer, vao, places, target;
} Probe;
bool probe_create(Probe* probe, const Gl* gl, const Shadow* shadow, Fault* fault);
// hair_transmittance at `count` places; with `head` body_light, where it is not NULL.
void probe_run(const Probe* probe, const Gl* gl, const Shadow* shadow, float extinction_per_m,
               const Vec3* places, int count, float* transmittance, float* head);
// The same in steps, for timing: what is looked up, and the look-ups alone.
void probe_put(const Probe* probe, const Gl* gl, const Vec3* places, int count);
void probe_draw(const Probe* probe, const Gl* gl, const Shadow* shadow, float extinction_per_m,
                int count);
void probe_free(Probe* probe, const Gl* gl);
#define PROBE_WIDTH 512
#define PROBE_MOST  (PROBE_WIDTH * 512) // places at once
