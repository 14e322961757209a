#include "tests/contact.h"

#include "messages/trig.h"

#include <stdlib.h>
#include <string.h>

#define LEAST_AREA 1e-4f // squared sine below which two segments are as near anywhere

// Segment `node` of a strand, from node - 1 to node.
typedef struct Segment {
    Vec3 middle;
    int strand, node;
    int cell[3];
} Segment;

// Segments by the cube of space that their middle is in: `first` of a bucket is where its segments
// begin in `at`.
struct Contact {
    Segment* segments;
    int count;
    int *first, *at;
    int buckets; // a power of two
    float cell_m;
};

// A point on a segment: u of the inner end and 1 - u of the outer one.
typedef struct Point {
    Vec3 at, velocity;
    float u;
    float inverse_mass;
} Point;

typedef struct Ends {
    Lanes3 *inner, *outer, *inner_was, *outer_was;
    int lane;
    float inner_inverse, outer_inverse; // masses
    Vec3 from, along, from_velocity, along_velocity;
} Ends;

ContactOptions contact_default(void)
{
    return (ContactOptions){
        .friction_per_s = 4.0f, .repulsion_s2 = 400.0f, .along_cosine = 0.8f, .least_m_s = 0.05f};
}

Contact* contact_create(int strands, int nodes)
{
    Contact* contact = calloc(1, sizeof *contact);
    if (contact == NULL) return NULL;
    size_t most = (size_t)strands * (size_t)(nodes - 1);
    contact->buckets = 64;
    while ((size_t)contact->buckets < most)
        contact->buckets *= 2;
    contact->segments = calloc(most, sizeof *contact->segments);
    contact->at = calloc(most, sizeof *contact->at);
    contact->first = calloc((size_t)contact->buckets + 1, sizeof *contact->first);
    if (contact->segments && contact->at && contact->first) return contact;
    contact_destroy(contact);
    return NULL;
}

void contact_destroy(Contact* contact)
{
    if (contact == NULL) return;
    free(contact->segments);
    free(contact->at);
    free(contact->first);
    free(contact);
}

static int bucket_of(const Contact* contact, const int cell[3])
{
    uint32_t hash = (uint32_t)cell[0] * 73856093u ^ (uint32_t)cell[1] * 19349663u ^
                    (uint32_t)cell[2] * 83492791u;
    return (int)(hash & (uint32_t)(contact->buckets - 1));
}

static int cell_of(float x, float cell_m)
{
    float at = x / cell_m;
    int whole = (int)at;
    return (float)whole > at ? whole - 1 : whole;
}

// Segments and how wide a cube must be so that segments that meet are in neighbouring ones.
static void list_segments(Contact* contact, const Cylinders* c)
{
    float reach = 1e-3f;
    contact->count = 0;
    for (int s = 0; s < c->sim->definition.strands; ++s) {
        const Block* block = &c->sim->blocks[s / LANES];
        const Lanes* radius = c->radius + (s / LANES) * block->nodes;
        int lane = s % LANES;
        for (int n = 1; n < c->rows[s]; ++n) {
            Vec3 from = lane_get(&block->position[n - 1], lane);
            Vec3 to = lane_get(&block->position[n], lane);
            float thick = (float)fmaxf((float)radius[n - 1].v[lane], (float)radius[n].v[lane]);
            reach = fmaxf(reach, 0.5f * vec3_length(vec3_sub(to, from)) + thick);
            contact->segments[contact->count++] =
                (Segment){.middle = vec3_lerp(from, to, 0.5f), .strand = s, .node = n};
        }
    }
    contact->cell_m = 2.0f * reach;
}

static void sort_into_cells(Contact* contact)
{
    memset(contact->first, 0, ((size_t)contact->buckets + 1) * sizeof *contact->first);
    for (int i = 0; i < contact->count; ++i) {
        Segment* segment = &contact->segments[i];
        segment->cell[0] = cell_of(segment->middle.x, contact->cell_m);
        segment->cell[1] = cell_of(segment->middle.y, contact->cell_m);
        segment->cell[2] = cell_of(segment->middle.z, contact->cell_m);
        ++contact->first[bucket_of(contact, segment->cell)];
    }
    for (int b = 1; b <= contact->buckets; ++b)
        contact->first[b] += contact->first[b - 1];
    for (int i = contact->count - 1; i >= 0; --i)
        contact->at[--contact->first[bucket_of(contact, contact->segments[i].cell)]] = i;
}

static Ends ends_of(const Cylinders* c, const Segment* segment)
{
    Block* block = &c->sim->blocks[segment->strand / LANES];
    int lane = segment->strand % LANES, n = segment->node;
    float rate = 1.0f / c->sim->substeps[0].dt, mass = c->mass[segment->strand];
    Ends e = {.inner = &block->position[n - 1],
              .outer = &block->position[n],
              .inner_was = &block->previous[n - 1],
              .outer_was = &block->previous[n],
              .lane = lane,
              .inner_inverse = (float)block->inverse_mass[n - 1].v[lane] / mass,
              .outer_inverse = (float)block->inverse_mass[n].v[lane] / mass};
    e.from = lane_get(e.inner, lane);
    e.along = vec3_sub(lane_get(e.outer, lane), e.from);
    e.from_velocity = vec3_scale(vec3_sub(e.from, lane_get(e.inner_was, lane)), rate);
    Vec3 velocity = vec3_sub(lane_get(e.outer, lane), lane_get(e.outer_was, lane));
    e.along_velocity = vec3_sub(vec3_scale(velocity, rate), e.from_velocity);
    return e;
}

static Point point_of(const Ends* e, float part)
{
    float u = 1.0f - part;
    return (Point){vec3_mad(e->from, e->along, part),
                   vec3_mad(e->from_velocity, e->along_velocity, part), u,
                   u * u * e->inner_inverse + part * part * e->outer_inverse};
}

static float clamp(float part)
{
    return part < 0.0f ? 0.0f : part > 1.0f ? 1.0f : part;
}

// The nearest points of two segments (Ericson, Real-Time Collision Detection 5.1.9).
static void nearest(const Ends* a, const Ends* b, Point* on_a, Point* on_b)
{
    Vec3 w = vec3_sub(a->from, b->from);
    float uu = fmaxf(vec3_dot(a->along, a->along), 1e-12f);
    float vv = fmaxf(vec3_dot(b->along, b->along), 1e-12f);
    float uv = vec3_dot(a->along, b->along), uw = vec3_dot(a->along, w), vw = vec3_dot(b->along, w);
    float area = uu * vv - uv * uv;
    float s = area > LEAST_AREA * uu * vv ? clamp((uv * vw - vv * uw) / area) : 0.5f;
    float t = clamp((uv * s + vw) / vv);
    s = clamp((uv * t - uw) / uu);
    *on_a = point_of(a, s);
    *on_b = point_of(b, t);
}

static void shift(Lanes3* previous, int lane, Vec3 by)
{
    lane_set(previous, lane, vec3_sub(lane_get(previous, lane), by));
}

// An impulse, as a change of where the ends were a substep ago.
static void push(const Ends* e, const Point* point, Vec3 impulse, float dt)
{
    shift(e->inner_was, e->lane, vec3_scale(impulse, point->u * e->inner_inverse * dt));
    shift(e->outer_was, e->lane, vec3_scale(impulse, (1.0f - point->u) * e->outer_inverse * dt));
}

static bool meet(const ContactOptions* options, const Cylinders* c, const Segment* one,
                 const Segment* other, float radii, float time_s, float stopped)
{
    Point p, q;
    Ends a = ends_of(c, one), b = ends_of(c, other);
    nearest(&a, &b, &p, &q);
    Vec3 apart = vec3_sub(p.at, q.at), faster = vec3_sub(q.velocity, p.velocity);
    float d = vec3_length(apart), inverse = p.inverse_mass + q.inverse_mass;
    bool is_slow = vec3_dot(faster, faster) < options->least_m_s * options->least_m_s;
    if (d >= radii || !(inverse > 0.0f) || is_slow) return false;
    float lengths = vec3_length(a.along) * vec3_length(b.along);
    float cosine = fabsf(vec3_dot(a.along, b.along)) / fmaxf(lengths, 1e-12f);
    Vec3 impulse = cosine > options->along_cosine
                       ? vec3_scale(faster, stopped / inverse)
                       : vec3_scale(vec3_normalise_or(apart, vec3(0, 1, 0)),
                                    options->repulsion_s2 * (radii - d) * time_s / inverse);
    push(&a, &p, impulse, c->sim->substeps[0].dt);
    push(&b, &q, vec3_scale(impulse, -1.0f), c->sim->substeps[0].dt);
    return true;
}

static float radius_of(const Cylinders* c, const Segment* segment)
{
    const Lanes* radius = c->radius + segment->strand / LANES * c->sim->definition.nodes;
    int lane = segment->strand % LANES;
    return fmaxf((float)radius[segment->node - 1].v[lane], (float)radius[segment->node].v[lane]);
}

static bool is_near(const Contact* contact, const Segment* a, const Segment* b)
{
    Vec3 apart = vec3_sub(a->middle, b->middle);
    return a->strand != b->strand && vec3_dot(apart, apart) < contact->cell_m * contact->cell_m;
}

int contact_push(Contact* contact, const ContactOptions* options, const Cylinders* c, float time_s)
{
    int pairs = 0;
    float stopped = (float)(1.0 - trig_exp(-(double)(options->friction_per_s * time_s)));
    list_segments(contact, c);
    sort_into_cells(contact);
    for (int i = 0; i < contact->count; ++i) {
        const Segment* one = &contact->segments[i];
        for (int k = 0; k < 27; ++k) {
            int cell[3] = {one->cell[0] + k % 3 - 1, one->cell[1] + k / 3 % 3 - 1,
                           one->cell[2] + k / 9 - 1};
            int bucket = bucket_of(contact, cell);
            for (int j = contact->first[bucket]; j < contact->first[bucket + 1]; ++j) {
                const Segment* other = &contact->segments[contact->at[j]];
                // A pair once; and another cell may share the bucket.
                if (contact->at[j] <= i || memcmp(other->cell, cell, sizeof cell) != 0 ||
                    !is_near(contact, one, other))
                    continue;
                pairs += meet(options, c, one, other, radius_of(c, one) + radius_of(c, other),
                              time_s, stopped);
            }
        }
    }
    return pairs;
}
