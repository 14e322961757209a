#include "server/bind.h"

#include "messages/drawn.h"
#include "messages/quantise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// A strand's shape as points at equal fractions of its length. Strands are compared at matched
// fractions, root with root and tip with tip; comparing nearest points along the curves lost, since
// a short strand then resembles any long one that passes it.
#define SHAPE_POINTS 5

// What a ribbon looks like until somebody tunes it: a wisp of a few hairs, wider at the tip.
#define ROOT_WIDTH_M 0.002f
#define TIP_WIDTH_M  0.004f
#define FIBRES       5.0f

typedef struct Shape {
    Vec3 at[SHAPE_POINTS];
} Shape;

// What is worked on while a section is bound; arrays of one entry per strand of the section.
typedef struct Work {
    Shape* shapes;
    float* nearest; // distance to the nearest guide chosen so far
    int* chosen;    // strand of guide g of the section
} Work;

void bind_resample(Vec3* out, int nodes, const Vec3* points, int count)
{
    double total = 0.0;
    for (int i = 1; i < count; ++i)
        total += (double)vec3_length(vec3_sub(points[i], points[i - 1]));
    out[0] = points[0];
    double before = 0.0;
    int i = 1;
    for (int node = 1; node < nodes - 1; ++node) {
        double target = total * node / (nodes - 1);
        double length = (double)vec3_length(vec3_sub(points[i], points[i - 1]));
        for (; before + length < target && i < count - 1; ++i) {
            before += length;
            length = (double)vec3_length(vec3_sub(points[i + 1], points[i]));
        }
        double t = length > 0.0 ? (target - before) / length : 0.0;
        out[node] = vec3_lerp(points[i - 1], points[i], (float)fmin(fmax(t, 0.0), 1.0));
    }
    out[nodes - 1] = points[count - 1];
}

static float distance(const Shape* a, const Shape* b)
{
    float sum = 0.0f;
    for (int i = 0; i < SHAPE_POINTS; ++i)
        sum += vec3_length(vec3_sub(a->at[i], b->at[i]));
    return sum * (1.0f / SHAPE_POINTS);
}

// Sharing guides out ----------------------------------------------------------------------------

static int smaller(int a, int b)
{
    return a < b ? a : b;
}

// Largest remainder (Hamilton's method) over what the minima leave; a section never gets more
// guides than it has strands, and what that frees goes where the most strands hang on a guide.
static void share_rest(int* shares, const BindSection* sections, int count, int rest)
{
    int64_t strands = 0;
    double remainder[HAIRSTYLE_MAX_SETS];
    for (int i = 0; i < count; ++i)
        strands += sections[i].strands;
    int left = rest;
    for (int i = 0; i < count; ++i) {
        double part = (double)rest * sections[i].strands / (double)strands;
        int given = smaller((int)part, sections[i].strands - shares[i]);
        remainder[i] = part - floor(part);
        shares[i] += given;
        left -= given;
    }
    for (; left > 0; --left) {
        int best = -1;
        double best_value = -1.0;
        for (int i = 0; i < count; ++i) {
            if (shares[i] >= sections[i].strands) continue;
            double crowd = (double)sections[i].strands / shares[i];
            double value = remainder[i] > 0.0 ? 1e9 + remainder[i] : crowd;
            if (value > best_value) best = i;
            if (value > best_value) best_value = value;
        }
        ++shares[best];
        remainder[best] = 0.0;
    }
}

bool bind_share_guides(int* shares, const BindSection* sections, int section_count, int guides,
                       Fault* fault)
{
    if (section_count < 1 || section_count > HAIRSTYLE_MAX_SETS)
        return fault_set(fault, "%d sections: a style takes 1 to %d", section_count,
                         HAIRSTYLE_MAX_SETS);
    int64_t strands = 0, least = 0;
    for (int i = 0; i < section_count; ++i) {
        if (sections[i].strands < 1)
            return fault_set(fault, "section %.40s has no strands; leave it out", sections[i].name);
        shares[i] = smaller(BIND_MIN_GUIDES, sections[i].strands);
        strands += sections[i].strands;
        least += shares[i];
    }
    int64_t most = strands < HAIRSTYLE_MAX_GUIDES ? strands : HAIRSTYLE_MAX_GUIDES;
    if (guides < least || guides > most)
        return fault_set(
            fault, "%d guides for %d sections of %lld strands in all: give %lld to %lld", guides,
            section_count, (long long)strands, (long long)least, (long long)most);
    share_rest(shares, sections, section_count, guides - (int)least);
    return true;
}

// Choosing guides -------------------------------------------------------------------------------

static void find_shapes(Work* work, const BindSection* section)
{
    for (int s = 0; s < section->strands; ++s)
        bind_resample(work->shapes[s].at, SHAPE_POINTS,
                      section->points + (size_t)s * (size_t)section->points_per_strand,
                      section->points_per_strand);
}

static int nearest_to_mean(const Work* work, int strands)
{
    Shape mean = {0};
    for (int s = 0; s < strands; ++s)
        for (int i = 0; i < SHAPE_POINTS; ++i)
            mean.at[i] = vec3_mad(mean.at[i], work->shapes[s].at[i], 1.0f / (float)strands);
    int best = 0;
    for (int s = 1; s < strands; ++s)
        if (distance(&work->shapes[s], &mean) < distance(&work->shapes[best], &mean)) best = s;
    return best;
}

// Farthest-point choice (Gonzalez 1985): the largest distance from a strand to its nearest guide is
// at most twice the best possible. K-means spreads by density instead, and starves the hairline.
static void choose_guides(Work* work, const BindSection* section, int guides)
{
    for (int s = 0; s < section->strands; ++s)
        work->nearest[s] = INFINITY;
    int next = nearest_to_mean(work, section->strands);
    for (int g = 0; g < guides; ++g) {
        work->chosen[g] = next;
        int farthest = -1;
        for (int s = 0; s < section->strands; ++s) {
            float d = distance(&work->shapes[s], &work->shapes[work->chosen[g]]);
            if (d < work->nearest[s]) work->nearest[s] = d;
            if (s == work->chosen[g]) work->nearest[s] = -1.0f; // never again, even among twins
            if (farthest < 0 || work->nearest[s] > work->nearest[farthest]) farthest = s;
        }
        next = farthest;
    }
}

static void write_guides(Hairstyle* style, const Work* work, const BindSection* section,
                         const StrandSet* set)
{
    for (int g = 0; g < set->guide_count; ++g) {
        size_t row = (size_t)(set->first_guide + g) * (size_t)style->nodes;
        size_t strand = (size_t)work->chosen[g];
        bind_resample(style->rest + row, style->nodes,
                      section->points + strand * (size_t)section->points_per_strand,
                      section->points_per_strand);
        if (!section->both_ends) continue;
        style->weight[row + (size_t)style->nodes - 1] = 0;
        style->weight[row + (size_t)style->nodes - 2] = 0;
    }
}

// Binding ---------------------------------------------------------------------------------------

// The three nearest of the section's guides, nearest first. A section of one or two guides repeats
// its first one at an infinite distance, which becomes weight 0.
static void find_nearest(int guide[3], float gap[3], const Work* work, int strand, int guides)
{
    for (int i = 0; i < 3; ++i) {
        guide[i] = 0;
        gap[i] = INFINITY;
    }
    for (int g = 0; g < guides; ++g) {
        float d = distance(&work->shapes[strand], &work->shapes[work->chosen[g]]);
        int i = 3;
        for (; i > 0 && d < gap[i - 1]; --i) {
            if (i == 3) continue;
            gap[i] = gap[i - 1];
            guide[i] = guide[i - 1];
        }
        if (i == 3) continue;
        gap[i] = d;
        guide[i] = g;
    }
}

// Inverse square distance (Shepard 1968), rounded so that the sum is exact: the first, which is the
// largest, takes the rounding.
static void find_weights(uint16_t weight[3], const float gap[3])
{
    const double least = 1e-6; // a micrometre: a guide carries itself
    double w[3], sum = 0.0;
    for (int i = 0; i < 3; ++i) {
        double d = fmax((double)gap[i], least);
        w[i] = 1.0 / (d * d);
        sum += w[i];
    }
    weight[1] = (uint16_t)(65535.0 * w[1] / sum + 0.5);
    weight[2] = (uint16_t)(65535.0 * w[2] / sum + 0.5);
    weight[0] = (uint16_t)(65535 - weight[1] - weight[2]);
}

static double polyline_length(const Vec3* points, int count)
{
    double length = 0.0;
    for (int i = 1; i < count; ++i)
        length += (double)vec3_length(vec3_sub(points[i], points[i - 1]));
    return length;
}

static uint16_t find_tip_height(const Hairstyle* style, const BoundStrand* bound, double length)
{
    double carried = 0.0;
    for (int i = 0; i < 3; ++i)
        carried +=
            bound->weight[i] / 65535.0 * (double)hairstyle_guide_length(style, bound->guide[i]);
    double height = carried > 0.0 ? length / carried : 1.0;
    return (uint16_t)(65535.0 * fmin(height, 1.0) + 0.5);
}

static void bind_set(Hairstyle* style, const Work* work, const BindSection* section,
                     const StrandSet* set)
{
    for (int s = 0; s < section->strands; ++s) {
        const Vec3* points = section->points + (size_t)s * (size_t)section->points_per_strand;
        BoundStrand* bound = &style->strands[set->first_strand + s];
        int guide[3];
        float gap[3];
        find_nearest(guide, gap, work, s, set->guide_count);
        find_weights(bound->weight, gap);
        for (int i = 0; i < 3; ++i)
            bound->guide[i] = (uint16_t)(set->first_guide + guide[i]);
        bound->tip_height =
            find_tip_height(style, bound, polyline_length(points, section->points_per_strand));
    }
}

// Offsets ---------------------------------------------------------------------------------------

typedef struct Offsets {
    Vec3* at; // as style->offsets, before quantisation
    Vec3* tangents;
} Offsets;

// At rest the turn is the identity, so the offset is simply what the guides miss by.
static void find_offsets(Offsets* offsets, const Hairstyle* style, const StrandSet* set,
                         const BindSection* section)
{
    for (int s = 0; s < set->strand_count; ++s)
        for (int p = 0; p < set->points; ++p) {
            size_t index = (size_t)s * (size_t)set->points + (size_t)p;
            DrawnPoint point;
            drawn_from_bound(&point, style, set, s, p); // offsets are still zero
            Vec3d carried = drawn_position(&point, style->nodes, style->rest, offsets->tangents,
                                           offsets->tangents, NULL);
            Vec3d miss = vec3d_sub(vec3d_from(section->points[index]), carried);
            offsets->at[(size_t)set->first_offset + index] = vec3_from(miss);
        }
}

static int16_t quantum(float value, float scale)
{
    return (int16_t)lround((double)value / (double)scale);
}

static void quantise_offsets(Hairstyle* style, const Vec3* offsets)
{
    float largest = 0.0f;
    for (int i = 0; i < style->offset_count; ++i)
        largest = fmaxf(
            largest, fmaxf(fabsf(offsets[i].x), fmaxf(fabsf(offsets[i].y), fabsf(offsets[i].z))));
    // Rounded up a little so that the largest stays within 32767; a nanometre where all are zero.
    float scale = fmaxf(largest * (1.000001f / 32767.0f), 1e-9f);
    style->offset_scale_m = scale;
    for (int i = 0; i < style->offset_count; ++i)
        style->offsets[i] =
            (StrandOffset){quantum(offsets[i].x, scale), quantum(offsets[i].y, scale),
                           quantum(offsets[i].z, scale)};
}

static bool write_offsets(Hairstyle* style, const BindSection* sections, Fault* fault)
{
    Offsets offsets = {calloc((size_t)style->offset_count, sizeof(Vec3)),
                       calloc((size_t)style->guide_count * (size_t)style->nodes, sizeof(Vec3))};
    bool sound = offsets.at != NULL && offsets.tangents != NULL;
    if (sound) {
        for (int g = 0; g < style->guide_count; ++g)
            quantise_strand_tangents(offsets.tangents + g * style->nodes,
                                     style->rest + g * style->nodes, style->nodes);
        for (int i = 0; i < style->set_count; ++i)
            find_offsets(&offsets, style, &style->sets[i], &sections[i]);
        quantise_offsets(style, offsets.at);
    } else {
        fault_set(fault, "no memory for %d rest offsets", style->offset_count);
    }
    free(offsets.at);
    free(offsets.tangents);
    return sound;
}

// All of it -------------------------------------------------------------------------------------

static bool check_section(const BindSection* section, int64_t* strands, int64_t* points,
                          Fault* fault)
{
    if (section->points_per_strand < 2 || section->points_per_strand > HAIRSTYLE_MAX_POINTS)
        return fault_set(fault, "section %.40s: %d points a strand: 2 to %d", section->name,
                         section->points_per_strand, HAIRSTYLE_MAX_POINTS);
    *strands += section->strands;
    *points += (int64_t)section->strands * section->points_per_strand;
    if (*strands > HAIRSTYLE_MAX_STRANDS)
        return fault_set(fault, "more than %d strands in all; thin the groom",
                         HAIRSTYLE_MAX_STRANDS);
    for (int64_t i = 0; i < (int64_t)section->strands * section->points_per_strand; ++i)
        if (!vec3_finite(section->points[i]))
            return fault_set(fault, "section %.40s: vertex %lld is not finite", section->name,
                             (long long)i);
    return true;
}

static void lay_out_sets(Hairstyle* style, const BindSection* sections, int count,
                         const int* shares)
{
    StrandSet next = {.kind = STRANDS_EXPLICIT,
                      .root_width_m = ROOT_WIDTH_M,
                      .tip_width_m = TIP_WIDTH_M,
                      .fibres = FIBRES};
    for (int i = 0; i < count; ++i) {
        StrandSet* set = &style->sets[i];
        *set = next;
        strncpy(set->name, sections[i].name, HAIRSTYLE_NAME_BYTES - 1);
        set->guide_count = shares[i];
        set->strand_count = sections[i].strands;
        set->points = sections[i].points_per_strand;
        next.first_guide += set->guide_count;
        next.first_strand += set->strand_count;
        next.first_offset += set->strand_count * set->points;
    }
    style->set_count = count;
}

static bool allocate_strands(Hairstyle* style, int64_t strands, int64_t points, Fault* fault)
{
    free(style->strands);
    free(style->offsets);
    style->strands = calloc((size_t)strands, sizeof *style->strands);
    style->offsets = calloc((size_t)points, sizeof *style->offsets);
    if (style->strands == NULL || style->offsets == NULL)
        return fault_set(fault, "no memory for %lld strands", (long long)strands);
    style->strand_count = (int)strands;
    style->offset_count = (int)points;
    style->offset_scale_m = 0.0f;
    return true;
}

static bool allocate_work(Work* work, const BindSection* sections, int count, Fault* fault)
{
    int most = 1;
    for (int i = 0; i < count; ++i)
        most = sections[i].strands > most ? sections[i].strands : most;
    *work = (Work){.shapes = calloc((size_t)most, sizeof(Shape)),
                   .nearest = calloc((size_t)most, sizeof(float)),
                   .chosen = calloc((size_t)most, sizeof(int))};
    if (work->shapes == NULL || work->nearest == NULL || work->chosen == NULL)
        return fault_set(fault, "no memory to bind %d strands", most);
    return true;
}

static void free_work(Work* work)
{
    free(work->shapes);
    free(work->nearest);
    free(work->chosen);
}

bool bind_sections(Hairstyle* style, const BindSection* sections, int section_count, int guides,
                   int nodes, Fault* fault)
{
    int shares[HAIRSTYLE_MAX_SETS];
    int64_t strands = 0, points = 0;
    if (!bind_share_guides(shares, sections, section_count, guides, fault)) return false;
    for (int i = 0; i < section_count; ++i)
        if (!check_section(&sections[i], &strands, &points, fault)) return false;
    if (!hairstyle_set_guides(style, guides, nodes, fault) ||
        !allocate_strands(style, strands, points, fault))
        return false;
    lay_out_sets(style, sections, section_count, shares);
    Work work = {0};
    bool sound = allocate_work(&work, sections, section_count, fault);
    for (int i = 0; sound && i < section_count; ++i) {
        find_shapes(&work, &sections[i]);
        choose_guides(&work, &sections[i], shares[i]);
        write_guides(style, &work, &sections[i], &style->sets[i]);
        bind_set(style, &work, &sections[i], &style->sets[i]);
    }
    free_work(&work);
    if (!sound || !write_offsets(style, sections, fault)) return false;
    hairstyle_fit_box(style);
    return true;
}
