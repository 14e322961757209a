#include "client/lod.h"

#include "messages/trig.h"

// Fewer ribbons are wider, and more of them is hair: widening alone would push the outline out by
// half a ribbon. The powers of what is left out keep a picture's coverage (test_lod measures it).
typedef struct Level {
    int triangles, points;
    double wide, full;
} Level;

static const Level levels[LODS] = {
    {0, HAIRSTYLE_MAX_POINTS, 0.0, 0.0},
    {7800, 10, 0.66, 0.25},
    {2000, 7, 0.635, 0.31},
    {1250, 6, 0.62, 0.33},
};

const char* const lod_names[LODS + 1] = {"full", "close", "medium", "far", NULL};

LodShare lod_share(const Hairstyle* style, const StrandSet* set, Lod lod)
{
    LodShare share = {set->strand_count, set->points, 1.0f, 1.0f};
    const Level* level = &levels[lod];
    int64_t all = 0;
    for (int i = 0; i < style->set_count; ++i)
        all += style->sets[i].strand_count;
    if (lod == LOD_FULL || all == 0) return share;
    if (share.points > level->points) share.points = level->points;
    int64_t ribbons = level->triangles / (2 * (share.points - 1));
    int64_t strands = ribbons * set->strand_count / all;
    if (strands < 1) strands = 1;
    if (strands >= set->strand_count) return share;
    share.strands = (int)strands;
    double fewer = (double)set->strand_count / (double)strands;
    share.widen = (float)trig_pow(fewer, level->wide);
    share.fuller = (float)trig_pow(fewer, level->full);
    return share;
}
