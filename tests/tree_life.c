// Life of a tree: made from a definition, reset, read.
#include "server/project.h"
#include "tests/wisps.h"

#include <stdlib.h>
#include <string.h>

#define LONG_AGO (-1000000000)
#define LEAST_M  5e-4f // radius of a wisp whose members lie on each other

typedef struct Place {
    Vec3 at;
    int strand;
} Place;

TreeOptions tree_default(void)
{
    return (TreeOptions){.split_m2_s2 = 0.25f,
                         .merge_m_s = 0.05f,
                         .loose = 1.5f,
                         .settle_per_s = 4.0f,
                         .most_merged = 1 << 30,
                         .contact = contact_default()};
}

static int by_x(const void* a, const void* b)
{
    const Place *p = a, *q = b;
    return p->at.x != q->at.x ? (p->at.x > q->at.x) - (p->at.x < q->at.x) : p->strand - q->strand;
}

static int by_y(const void* a, const void* b)
{
    const Place *p = a, *q = b;
    return p->at.y != q->at.y ? (p->at.y > q->at.y) - (p->at.y < q->at.y) : p->strand - q->strand;
}

static int by_z(const void* a, const void* b)
{
    const Place *p = a, *q = b;
    return p->at.z != q->at.z ? (p->at.z > q->at.z) - (p->at.z < q->at.z) : p->strand - q->strand;
}

// Halves along the widest axis until what is left is a block: neighbours come to lie together.
static void sort_places(Place* places, int count)
{
    if (count <= LANES) return;
    Vec3 low = places[0].at, high = places[0].at;
    for (int i = 1; i < count; ++i) {
        low = vec3_min(low, places[i].at);
        high = vec3_max(high, places[i].at);
    }
    Vec3 wide = vec3_sub(high, low);
    bool is_x = wide.x >= wide.y && wide.x >= wide.z;
    qsort(places, (size_t)count, sizeof *places, is_x ? by_x : wide.y >= wide.z ? by_y : by_z);
    int half = (count / LANES + 1) / 2 * LANES;
    sort_places(places, half);
    sort_places(places + half, count - half);
}

static bool choose_order(Tree* tree, const SimDefinition* d)
{
    Place* places = calloc((size_t)d->strands, sizeof *places);
    if (places == NULL) return false;
    for (int s = 0; s < d->strands; ++s)
        places[s] = (Place){d->rest[s * d->nodes + d->nodes / 2], s};
    sort_places(places, d->strands);
    for (int s = 0; s < d->strands; ++s)
        tree->order[s] = places[s].strand;
    free(places);
    return true;
}

// What the two simulations are made from.
typedef struct Rests {
    Vec3 *members, *centres;
    uint8_t *member_weight, *centre_weight;
} Rests;

static uint8_t weight_of(const SimDefinition* d, int strand, int n)
{
    return d->weight == NULL ? (n == 0 ? 0 : 255) : d->weight[strand * d->nodes + n];
}

static int members_of(const SimDefinition* d, int wisp)
{
    int left = d->strands - wisp * LANES;
    return left < LANES ? left : LANES;
}

// A node whose members are not skinned alike never merges: one super-node cannot be both.
static void fill_wisp(Tree* tree, const SimDefinition* d, const Rests* rests, int w)
{
    int count = members_of(d, w), nodes = tree->nodes;
    tree->mass[w] = (float)count;
    tree->most[w] = tree->options.most_merged < nodes ? tree->options.most_merged : nodes;
    for (int n = nodes - 1; n >= 0; --n) {
        Vec3d sum = {0, 0, 0};
        for (int i = 0; i < count; ++i) {
            int strand = tree->order[w * LANES + i], at = (w * LANES + i) * nodes + n;
            rests->members[at] = d->rest[strand * nodes + n];
            rests->member_weight[at] = weight_of(d, strand, n);
            sum = vec3d_add(sum, vec3d_from(rests->members[at]));
            if (rests->member_weight[at] != rests->member_weight[w * LANES * nodes + n])
                tree->most[w] = n < tree->most[w] ? n : tree->most[w];
        }
        rests->centres[w * nodes + n] = vec3_from(vec3d_scale(sum, 1.0 / count));
        rests->centre_weight[w * nodes + n] = rests->member_weight[w * LANES * nodes + n];
    }
    if (tree->most[w] < 1 || (tree->whole && tree->most[w] < nodes)) tree->most[w] = 1;
}

static void fill_offsets(Tree* tree, int w)
{
    const Block* block = &tree->members->blocks[w];
    const Block* centres = &tree->centres->blocks[w / LANES];
    const float none[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    for (int n = 0; n < tree->nodes; ++n) {
        Lanes3* offset = &tree->offset[w * tree->nodes + n];
        unplace_lanes(offset, lane_get(&centres->rest[n], w % LANES), none, &block->rest[n]);
        real radius = real_sqrt(farthest2(offset));
        *number_of(tree, tree->rest_radius, w, n) = radius > LEAST_M ? radius : LEAST_M;
    }
}

static bool make_sims(Tree* tree, const SimDefinition* d, const Rests* rests, Fault* fault)
{
    SimDefinition members = *d, centres = *d;
    members.rest = rests->members;
    members.weight = rests->member_weight;
    tree->members = sim_create(&members, fault);
    centres.strands = tree->wisps;
    centres.rest = rests->centres;
    centres.weight = rests->centre_weight;
    tree->centres = tree->members == NULL ? NULL : sim_create(&centres, fault);
    return tree->centres != NULL;
}

static bool fill(Tree* tree, const SimDefinition* d, Fault* fault)
{
    size_t nodes = (size_t)tree->nodes, members = (size_t)d->strands * nodes,
           centres = (size_t)tree->wisps * nodes;
    Rests rests = {calloc(members, sizeof(Vec3)), calloc(centres, sizeof(Vec3)), calloc(members, 1),
                   calloc(centres, 1)};
    bool done = rests.members && rests.centres && rests.member_weight && rests.centre_weight &&
                choose_order(tree, d);
    if (!done) fault_set(fault, "tree: no memory for %d strands", d->strands);
    for (int w = 0; done && w < tree->wisps; ++w)
        fill_wisp(tree, d, &rests, w);
    done = done && make_sims(tree, d, &rests, fault);
    for (int w = 0; done && w < tree->wisps; ++w)
        fill_offsets(tree, w);
    free(rests.members);
    free(rests.centres);
    free(rests.member_weight);
    free(rests.centre_weight);
    return done;
}

static bool allocate_held(Held* held, size_t nodes)
{
    size_t bytes = nodes * (2 * sizeof(Lanes3) + 4 * sizeof(Lanes));
    held->memory = aligned_alloc(64, bytes);
    if (held->memory == NULL) return false;
    memset(held->memory, 0, bytes);
    held->rest = held->memory;
    held->offset = held->rest + nodes;
    held->keep = (Lanes*)(held->offset + nodes);
    held->inverse_mass = held->keep + nodes;
    held->inner_part = held->inverse_mass + nodes;
    held->outer_part = held->inner_part + nodes;
    return true;
}

static bool allocate(Tree* tree, const SimDefinition* d)
{
    size_t wisps = (size_t)tree->wisps, nodes = (size_t)tree->nodes;
    size_t blocks = (wisps + LANES - 1) / LANES * nodes;
    tree->order = calloc((size_t)d->strands, sizeof *tree->order);
    tree->first = calloc(wisps, sizeof *tree->first);
    tree->most = calloc(wisps, sizeof *tree->most);
    tree->mass = calloc(wisps, sizeof *tree->mass);
    tree->offset = calloc(wisps * nodes, sizeof *tree->offset);
    tree->strayed = calloc(wisps * nodes, sizeof *tree->strayed);
    tree->merged_at = calloc(wisps * nodes, sizeof *tree->merged_at);
    tree->rest_radius = calloc(blocks, sizeof *tree->rest_radius);
    tree->radius = calloc(blocks, sizeof *tree->radius);
    tree->velocity = calloc(blocks, sizeof *tree->velocity);
    tree->heat = calloc(blocks, sizeof *tree->heat);
    tree->trace = calloc(blocks * (size_t)d->substeps, sizeof *tree->trace);
    tree->held = calloc((size_t)(d->threads * KERNEL_GANG), sizeof *tree->held);
    tree->contact = contact_create(tree->wisps, tree->nodes);
    bool done = tree->order && tree->first && tree->most && tree->mass && tree->offset &&
                tree->strayed && tree->merged_at && tree->rest_radius && tree->radius &&
                tree->velocity && tree->heat && tree->trace && tree->held && tree->contact;
    for (int i = 0; done && i < d->threads * KERNEL_GANG; ++i)
        done = allocate_held(&tree->held[i], nodes);
    return done;
}

static bool check(const SimDefinition* d, Fault* fault)
{
    if (d->strands < 1 || d->strands > 65536 || d->nodes < 2 || d->nodes > 256 || d->rest == NULL ||
        d->threads < 1 || d->threads > 256 || d->substeps < 1 || d->substeps > 1024)
        return fault_set(fault, "tree: no strands to make wisps of");
    return d->tie_count == 0 || fault_set(fault, "tree: strands that are tied make no wisps");
}

Tree* tree_create(const SimDefinition* d, const TreeOptions* options, Fault* fault)
{
    if (!check(d, fault)) return NULL;
    Tree* tree = calloc(1, sizeof *tree);
    if (tree == NULL) {
        fault_set(fault, "tree: no memory");
        return NULL;
    }
    tree->options = *options;
    tree->nodes = d->nodes;
    tree->threads = d->threads;
    tree->wisps = (d->strands + LANES - 1) / LANES;
    tree->from_root = d->model != MODEL_SPRING && d->model != MODEL_PLAIN;
    tree->whole = d->model == MODEL_FOREST || d->model == MODEL_FOREST_Z;
    bool done = allocate(tree, d) || fault_set(fault, "tree: no memory for %d strands", d->strands);
    if (!done || !fill(tree, d, fault)) {
        tree_destroy(tree);
        return NULL;
    }
    tree_reset(tree, (const float[9]){1, 0, 0, 0, 1, 0, 0, 0, 1});
    return tree;
}

void tree_destroy(Tree* tree)
{
    if (tree == NULL) return;
    sim_destroy(tree->members);
    sim_destroy(tree->centres);
    contact_destroy(tree->contact);
    for (int i = 0; tree->held != NULL && i < tree->threads * KERNEL_GANG; ++i)
        free(tree->held[i].memory);
    void* arrays[] = {tree->order,  tree->first,    tree->most,      tree->mass,
                      tree->offset, tree->strayed,  tree->merged_at, tree->rest_radius,
                      tree->radius, tree->velocity, tree->heat,      tree->trace,
                      tree->held};
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; ++i)
        free(arrays[i]);
    free(tree);
}

void tree_reset(Tree* tree, const float rotation[9])
{
    size_t blocks = (size_t)(tree->centres->block_count * tree->nodes);
    sim_reset(tree->members, rotation);
    sim_reset(tree->centres, rotation);
    memcpy(tree->rotation, rotation, sizeof tree->rotation);
    memcpy(tree->before, rotation, sizeof tree->before);
    memcpy(tree->first, tree->most, (size_t)tree->wisps * sizeof *tree->first);
    memcpy(tree->radius, tree->rest_radius, blocks * sizeof *tree->radius);
    memset(tree->velocity, 0, blocks * sizeof *tree->velocity);
    for (int i = 0; i < tree->wisps * tree->nodes; ++i)
        tree->merged_at[i] = LONG_AGO;
}

// --- reading

// The nodes of a wisp's members in head space; a skinned node is where it is at rest, to the bit.
static void read_node(const Tree* tree, int wisp, int n, const float rotation[9], Lanes3* to)
{
    const Block* block = &tree->members->blocks[wisp];
    if (!is_merged(tree, wisp, n)) {
        unplace_lanes(to, vec3(0, 0, 0), rotation, &block->position[n]);
    } else {
        Lanes3 offset;
        offset_of(tree, wisp, n, &offset);
        shift_lanes(to, rotate_back(rotation, centre_at(tree, wisp, n)), &offset);
    }
    for (int l = 0; l < LANES; ++l)
        if (block->keep[n].v[l] == 0) lane_set(to, l, lane_get(&block->rest[n], l));
}

static void read_wisp(const Tree* tree, int wisp, const float rotation[9], Vec3* positions)
{
    int count = tree->members->blocks[wisp].strands;
    for (int n = 0; n < tree->nodes; ++n) {
        Lanes3 places;
        read_node(tree, wisp, n, rotation, &places);
        for (int l = 0; l < count; ++l)
            positions[tree->order[wisp * LANES + l] * tree->nodes + n] = lane_get(&places, l);
    }
}

static void project_member(const Tree* tree, int wisp, int lane, Vec3* strand)
{
    const Block* block = &tree->members->blocks[wisp];
    bool skinned[256];
    float lengths[256];
    for (int n = 0; n < tree->nodes; ++n) {
        skinned[n] = block->keep[n].v[lane] == 0;
        lengths[n] = (float)block->length[n].v[lane];
    }
    const Sim* sim = tree->members; // whose colliders are the head's
    Obstacles obstacles = {sim->colliders, sim->definition.collider_count,
                           sim->definition.pearl_radius_m, &block->clearance->v[lane]};
    project_lengths(strand, tree->nodes, lengths, skinned, &obstacles);
}

void tree_positions(const Tree* tree, const float rotation[9], bool project, Vec3* positions)
{
    for (int w = 0; w < tree->wisps; ++w) {
        read_wisp(tree, w, rotation, positions);
        for (int l = 0; project && l < tree->members->blocks[w].strands; ++l)
            project_member(tree, w, l, positions + tree->order[w * LANES + l] * tree->nodes);
    }
}

static void state_of_node(const Tree* tree, int wisp, int n, Lanes3* now, Lanes3* before)
{
    const Block* block = &tree->members->blocks[wisp];
    *now = block->position[n];
    *before = block->previous[n];
    if (!is_merged(tree, wisp, n)) return;
    Lanes3 offset;
    offset_of(tree, wisp, n, &offset);
    place_lanes(now, centre_at(tree, wisp, n), tree->rotation, &offset);
    place_lanes(before, centre_was_at(tree, wisp, n), tree->before, &offset);
}

void tree_state(const Tree* tree, Vec3* positions, Vec3* previous)
{
    for (int i = 0; i < tree->wisps * tree->nodes; ++i) {
        int wisp = i / tree->nodes, n = i % tree->nodes;
        Lanes3 now, before;
        state_of_node(tree, wisp, n, &now, &before);
        for (int l = 0; l < tree->members->blocks[wisp].strands; ++l) {
            int at = tree->order[wisp * LANES + l] * tree->nodes + n;
            positions[at] = lane_get(&now, l);
            previous[at] = lane_get(&before, l);
        }
    }
}

int tree_wisps(const Tree* tree)
{
    return tree->wisps;
}

int tree_wisp_of(const Tree* tree, int strand)
{
    int at = 0;
    while (tree->order[at] != strand)
        ++at;
    return at / LANES;
}

int tree_first(const Tree* tree, int wisp)
{
    return tree->first[wisp];
}

double tree_split_share(const Tree* tree)
{
    double split_nodes = 0, nodes = 0;
    for (int w = 0; w < tree->wisps; ++w) {
        split_nodes += (double)tree->mass[w] * (tree->nodes - tree->first[w]);
        nodes += (double)tree->mass[w] * (tree->nodes - 1);
    }
    return split_nodes / nodes;
}
