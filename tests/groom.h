// Eight strands on a head, four that hang and four that arch, for the studies. They are what
// straight hair of one Gamma = rho A g L^3 / (E I) becomes under its weight, so a rod of that Gamma
// that is straight by nature is at rest in them, and has no curl that could snap to another rest.
#pragma once

#include "messages/base.h"
#include "messages/vec.h"

#define GROOM_STRANDS  8
#define GROOM_LINKS    84 // of the finest polygon; models and rods take every so manyth node
#define GROOM_LENGTH_M 0.28
#define GROOM_GRAVITY  9.81

typedef struct Groom {
    double gamma;
    Vec3d node[GROOM_STRANDS][GROOM_LINKS + 1]; // head space, m
    Vec3d way[GROOM_STRANDS];                   // of the clamp
} Groom;

bool groom_make(Groom* groom, double gamma, Fault* fault);

// `links` links of strand `strand`; a divisor of GROOM_LINKS.
void groom_nodes(const Groom* groom, int strand, int links, Vec3d* nodes);

// ... without gravity.
void groom_natural(const Groom* groom, int strand, int links, Vec3d* nodes);

// E I over density, m^4/s^2, of a rod with `gamma`.
double groom_bending(double gamma);
