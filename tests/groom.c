#include "tests/groom.h"

#include "tests/rod.h"

#include <math.h>

#define HEAD_Y_M 0.216
#define HEAD_M   0.09
#define DEGREES  (M_PI / 180.0)

static const struct Place {
    double azimuth, elevation, pitch; // degrees: of the root (0 forward, 90 to +X), of the clamp
} places[GROOM_STRANDS] = {
    {90, 0, -90}, {180, 0, -90}, {270, 0, -90}, {45, 10, -90},
    {90, 40, 30}, {180, 40, 0},  {0, 50, 0},    {315, 30, -30},
};

double groom_bending(double gamma)
{
    return GROOM_GRAVITY * pow(GROOM_LENGTH_M, 3) / gamma;
}

static Vec3d planar(Vec3d away, double h, double y)
{
    return (Vec3d){away.x * h, y, away.z * h};
}

static bool hang(Groom* groom, int strand, Vec3d root, Fault* fault)
{
    Vec3d* nodes = groom->node[strand];
    nodes[0] = root;
    groom_natural(groom, strand, GROOM_LINKS, nodes);
    double bending = groom_bending(groom->gamma);
    Rod* rod = rod_create(&(RodDefinition){.nodes = GROOM_LINKS + 1,
                                           .rest = nodes,
                                           .bending_nm2 = bending,
                                           .twisting_nm2 = bending,
                                           .stretching_n = 1e6,
                                           .density_kg_m = 1.0,
                                           .gravity_m_s2 = GROOM_GRAVITY,
                                           .dt_s = 1e-3},
                          fault);
    if (rod == NULL) return false;
    bool found = rod_settle(rod, pose_identity(), (Vec3d){0, 0, 0});
    rod_positions(rod, nodes);
    rod_destroy(rod);
    return found || fault_set(fault, "strand %d has no equilibrium", strand);
}

bool groom_make(Groom* groom, double gamma, Fault* fault)
{
    groom->gamma = gamma;
    for (int s = 0; s < GROOM_STRANDS; ++s) {
        double azimuth = places[s].azimuth * DEGREES, elevation = places[s].elevation * DEGREES;
        double pitch = places[s].pitch * DEGREES;
        Vec3d away = {sin(azimuth), 0, cos(azimuth)};
        groom->way[s] = planar(away, cos(pitch), sin(pitch));
        Vec3d root = planar(away, HEAD_M * cos(elevation), HEAD_Y_M + HEAD_M * sin(elevation));
        if (!hang(groom, s, root, fault)) return false;
    }
    return true;
}

void groom_nodes(const Groom* groom, int strand, int links, Vec3d* nodes)
{
    for (int n = 0; n <= links; ++n)
        nodes[n] = groom->node[strand][n * (GROOM_LINKS / links)];
}

void groom_natural(const Groom* groom, int strand, int links, Vec3d* nodes)
{
    for (int n = 0; n <= links; ++n)
        nodes[n] =
            vec3d_mad(groom->node[strand][0], groom->way[strand], GROOM_LENGTH_M * n / links);
}
