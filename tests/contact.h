// Hair against hair, between thick strands: generalised cylinders that meet (thesis 4.1; Bertails,
// Kim, Cani and Neumann 2003).
//
// Where the axes of two segments come nearer than the sum of their radii, segments that lie along
// each other are held back by viscous friction,
//     F1 = kf m (V2 - V1)
// and segments that cross push each other apart, along what joins their nearest points,
//     F1 = kr m (r - d) (P1 - P2) / |P1 - P2|
// with m the effective mass of the two points: what one node more or less in a cylinder weighs must
// not matter. Printed is kf (P2 - P1) for the friction, which is a spring that draws cylinders
// together (notes/simulation.md). Forces go to a segment's ends by how near the point is to each,
// equal and opposite: momentum stays, but for what skinned ends take.
#pragma once

#include "server/strands.h"

typedef struct Contact Contact;

typedef struct ContactOptions {
    float friction_per_s; // kf: relative velocity of segments along each other dies by exp(-kf t)
    float repulsion_s2;   // kr
    float along_cosine;   // above it two segments lie along each other, below it they cross
    float least_m_s;      // what moves slower against each other is left alone
} ContactOptions;

// The cylinders of a simulation's strands.
typedef struct Cylinders {
    Sim* sim;
    const int* rows;     // [strand] how many of its nodes, from the root, take part
    const Lanes* radius; // [block][node], m
    const float* mass;   // [strand] of a node, in any unit
} Cylinders;

ContactOptions contact_default(void);

// Room for so many strands; NULL without memory.
Contact* contact_create(int strands, int nodes);
void contact_destroy(Contact* contact);

// The velocities that `time_s` of contact changes. Allocates nothing. Returns how many pairs meet.
int contact_push(Contact* contact, const ContactOptions* options, const Cylinders* cylinders,
                 float time_s);
