// A tick of the tree, and what splits and merges at its end. Its life and how it is read:
// tree_life.c.
#include "server/step.h"
#include "tests/wisps.h"

#include <omp.h>
#include <string.h>

// --- a tick

// The first nodes of a partly split wisp are driven; what of it is before `base` is not simulated.
static int base_of(const Tree* tree, int wisp)
{
    return tree->from_root ? 0 : tree->first[wisp] - 1;
}

// What the model holds of a node that is to be driven, and what driving it changes.
static void hold_node(Block* block, int n, bool is_driven, Held* held)
{
    held->rest[n] = block->rest[n];
    held->keep[n] = block->keep[n];
    held->inverse_mass[n] = block->inverse_mass[n];
    held->inner_part[n] = block->inner_part[n];
    held->outer_part[n] = block->outer_part[n];
    memset(&block->inner_part[n], 0, sizeof(Lanes));
    memset(&block->outer_part[n], 0, sizeof(Lanes));
    for (int l = 0; l < LANES && !is_driven; ++l)
        block->outer_part[n].v[l] = block->inverse_mass[n].v[l] > 0 ? 1 : 0;
    if (!is_driven) return;
    memset(&block->keep[n], 0, sizeof(Lanes));
    memset(&block->inverse_mass[n], 0, sizeof(Lanes));
}

static void release_node(Block* block, int n, const Held* held)
{
    block->rest[n] = held->rest[n];
    block->keep[n] = held->keep[n];
    block->inverse_mass[n] = held->inverse_mass[n];
    block->inner_part[n] = held->inner_part[n];
    block->outer_part[n] = held->outer_part[n];
}

// The nodes from `base` on as a strand of its own; the models that may have base > 0 ask for no
// other arrays.
static Block part_of(const Block* block, int base)
{
    Block part = *block;
    part.nodes -= base;
    Lanes3** vectors[] = {&part.position, &part.previous, &part.reference, &part.rest};
    for (size_t i = 0; i < sizeof vectors / sizeof vectors[0]; ++i)
        *vectors[i] += base;
    Lanes** numbers[] = {&part.length,     &part.stiffness,        &part.mass,
                         &part.pivot,      &part.tension,          &part.clearance,
                         &part.keep,       &part.inverse_mass,     &part.inner_part,
                         &part.outer_part, &part.clearance_of_link};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; ++i)
        *numbers[i] += base;
    part.angle += base;
    part.rate += base;
    return part;
}

// A driven node is skinned to a rest place that moves.
static void drive(const Tree* tree, int wisp, int substep, const Held* held)
{
    int blocks = tree->centres->block_count;
    const Lanes3* trace = tree->trace + (substep * blocks + wisp / LANES) * tree->nodes;
    const float* rotation = tree->members->substeps[substep].rotation;
    for (int n = base_of(tree, wisp); n < tree->first[wisp]; ++n)
        shift_lanes(&tree->members->blocks[wisp].rest[n],
                    rotate_back(rotation, lane_get(&trace[n], wisp % LANES)), &held->offset[n]);
}

// Wisps that are split alike, from `wisp` on.
static void step_parts(Tree* tree, int wisp, int count, int thread)
{
    Sim* sim = tree->members;
    Held* held = tree->held + thread * KERNEL_GANG;
    Block parts[KERNEL_GANG];
    int base = base_of(tree, wisp), first = tree->first[wisp];
    for (int i = 0; i < count; ++i) {
        parts[i] = part_of(&sim->blocks[wisp + i], base);
        strands_lend(&parts[i], sim->work + strands_work_bytes(tree->nodes) *
                                                (size_t)(thread * KERNEL_GANG + i));
        int driven = first - base;
        parts[i].skinned = driven > parts[i].skinned - base ? driven : parts[i].skinned - base;
        for (int n = base; n <= first; ++n)
            hold_node(&sim->blocks[wisp + i], n, n < first, &held[i]);
        for (int n = base; n < first; ++n)
            offset_of(tree, wisp + i, n, &held[i].offset[n]);
    }
    for (int s = 0; s < sim->definition.substeps; ++s) {
        for (int i = 0; i < count; ++i)
            drive(tree, wisp + i, s, &held[i]);
        sim->kernel->step(parts, count, &sim->substeps[s], 1);
    }
    for (int i = 0; i < count; ++i) {
        sim->blocks[wisp + i].quarantined = parts[i].quarantined;
        for (int n = base; n <= first; ++n)
            release_node(&sim->blocks[wisp + i], n, &held[i]);
    }
}

// Neighbours that are split alike go side by side, as in a simulation without a tree.
static void step_gang(Tree* tree, int gang, int thread)
{
    const Sim* sim = tree->members;
    int w = gang * KERNEL_GANG, end = w + KERNEL_GANG < tree->wisps ? w + KERNEL_GANG : tree->wisps;
    for (int count; w < end; w += count) {
        int first = tree->first[w];
        for (count = 1; w + count < end && tree->first[w + count] == first;)
            ++count;
        if (first == 1) step_blocks(sim, w, count, thread, sim->substeps, sim->definition.substeps);
        if (first > 1 && first < tree->nodes) step_parts(tree, w, count, thread);
    }
}

static void step_members(Tree* tree)
{
    int gangs = (tree->wisps + KERNEL_GANG - 1) / KERNEL_GANG;
    int threads = tree->members->definition.threads;
    // libgomp allocates a team for a nested region, even of one thread; a plain loop does not.
    if (threads <= 1 || gangs == 1 || omp_in_parallel()) {
        for (int g = 0; g < gangs; ++g)
            step_gang(tree, g, 0);
        return;
    }
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int g = 0; g < gangs; ++g)
        step_gang(tree, g, omp_get_thread_num());
}

static void step_centres(Tree* tree)
{
    Sim* sim = tree->centres;
    size_t nodes = (size_t)tree->nodes;
    bool is_followed = false;
    for (int w = 0; w < tree->wisps; ++w)
        is_followed |= tree->first[w] > 1 && tree->first[w] < tree->nodes;
    if (!is_followed) {
        step_all(sim, sim->substeps, sim->definition.substeps);
        return;
    }
    for (int s = 0; s < sim->definition.substeps; ++s) {
        step_all(sim, &sim->substeps[s], 1);
        for (int b = 0; b < sim->block_count; ++b)
            memcpy(tree->trace + (size_t)(s * sim->block_count + b) * nodes,
                   sim->blocks[b].position, nodes * sizeof(Lanes3));
    }
}

// --- split and merge

static real sum_from(const real* v, real base)
{
    real sum[LANES / 2];
    for (int l = 0; l < LANES / 2; ++l)
        sum[l] = (v[l] - base) + (v[l + LANES / 2] - base);
    for (int l = 0; l < LANES / 4; ++l)
        sum[l] += sum[l + LANES / 4];
    for (int l = 0; l < LANES / 8; ++l)
        sum[l] += sum[l + LANES / 8];
    return (sum[0] + sum[2]) + (sum[1] + sum[3]);
}

// Of the first `count` lanes; those beyond repeat the last. Counted from one of them, so that what
// rounds is small.
static real mean_number(const real* v, int count)
{
    real base = v[0], beyond = (real)(LANES - count) * (v[LANES - 1] - base);
    return base + (sum_from(v, base) - beyond) / (real)count;
}

static Vec3 mean_of(const Lanes3* v, int count)
{
    return vec3((float)mean_number(v->x, count), (float)mean_number(v->y, count),
                (float)mean_number(v->z, count));
}

// A super-node to its members' centre of mass, with their mean velocity.
static void gather(Tree* tree, int wisp, int n)
{
    const Block* block = &tree->members->blocks[wisp];
    Block* centres = &tree->centres->blocks[wisp / LANES];
    lane_set(&centres->position[n], wisp % LANES, mean_of(&block->position[n], block->strands));
    lane_set(&centres->previous[n], wisp % LANES, mean_of(&block->previous[n], block->strands));
}

// forest-z counts in angles too; where members merge, in their mean, and back.
static void gather_angles(Tree* tree, int wisp, int n)
{
    const Block* block = &tree->members->blocks[wisp];
    Block* centres = &tree->centres->blocks[wisp / LANES];
    int lane = wisp % LANES;
    centres->angle[n].theta[lane] = mean_number(block->angle[n].theta, block->strands);
    centres->angle[n].phi[lane] = mean_number(block->angle[n].phi, block->strands);
    centres->rate[n].theta[lane] = mean_number(block->rate[n].theta, block->strands);
    centres->rate[n].phi[lane] = mean_number(block->rate[n].phi, block->strands);
}

static void spread_angles(Tree* tree, int wisp, int n)
{
    const Block* centres = &tree->centres->blocks[wisp / LANES];
    Block* block = &tree->members->blocks[wisp];
    for (int l = 0; l < LANES; ++l) {
        block->angle[n].theta[l] = centres->angle[n].theta[wisp % LANES];
        block->angle[n].phi[l] = centres->angle[n].phi[wisp % LANES];
        block->rate[n].theta[l] = centres->rate[n].theta[wisp % LANES];
        block->rate[n].phi[l] = centres->rate[n].phi[wisp % LANES];
    }
}

// Every member where its offset has it, moving as the super-node does and turning with the head.
static void spread(Tree* tree, int wisp, int n)
{
    Lanes3 offset;
    Block* block = &tree->members->blocks[wisp];
    offset_of(tree, wisp, n, &offset);
    place_lanes(&block->position[n], centre_at(tree, wisp, n), tree->rotation, &offset);
    place_lanes(&block->previous[n], centre_was_at(tree, wisp, n), tree->before, &offset);
    if (tree->whole) spread_angles(tree, wisp, n);
}

static void split(Tree* tree, int wisp, int first)
{
    for (int n = 0; n < tree->first[wisp]; ++n) // the driven ones as well: they have a past
        spread(tree, wisp, n);
    tree->first[wisp] = first;
}

static float velocity_scale(const Tree* tree)
{
    return (float)(tree->members->definition.rate_hz * tree->members->definition.substeps);
}

static void note_velocity(Tree* tree, int wisp, int n)
{
    Vec3 moved = vec3_sub(centre_at(tree, wisp, n), centre_was_at(tree, wisp, n));
    lane_set(&tree->velocity[wisp / LANES * tree->nodes + n], wisp % LANES,
             vec3_scale(moved, velocity_scale(tree)));
}

static void merge_node(Tree* tree, int wisp, int n)
{
    int at = wisp * tree->nodes + n;
    Lanes3 *strayed = &tree->strayed[at], *offset = &tree->offset[at];
    unplace_lanes(strayed, centre_at(tree, wisp, n), tree->rotation,
                  &tree->members->blocks[wisp].position[n]);
    *number_of(tree, tree->radius, wisp, n) = real_sqrt(farthest2(strayed));
    for (int l = 0; l < LANES; ++l) {
        strayed->x[l] -= offset->x[l];
        strayed->y[l] -= offset->y[l];
        strayed->z[l] -= offset->z[l];
    }
    tree->merged_at[at] = tree->tick;
}

static void merge(Tree* tree, int wisp, int first)
{
    for (int n = tree->first[wisp]; n < tree->nodes; ++n) {
        gather(tree, wisp, n);
        if (tree->whole) gather_angles(tree, wisp, n);
        note_velocity(tree, wisp, n);
    }
    for (int n = tree->first[wisp]; n < first; ++n)
        merge_node(tree, wisp, n);
    tree->first[wisp] = first;
}

void tree_move_first(Tree* tree, int wisp, int first)
{
    if (first > tree->most[wisp]) first = tree->most[wisp];
    if (tree->whole && first < tree->nodes) first = 1;
    if (first < tree->first[wisp]) split(tree, wisp, first < 1 ? 1 : first);
    if (first > tree->first[wisp]) merge(tree, wisp, first);
}

static bool is_hot(const Tree* tree, int wisp, int n)
{
    return *number_of(tree, tree->heat, wisp, n) > (real)tree->options.split_m2_s2;
}

// Whether the members of a split node stay together: seen from the head, which they turn with.
static bool is_together(const Tree* tree, int wisp, int n)
{
    const Block* block = &tree->members->blocks[wisp];
    Lanes3 now, then;
    unplace_lanes(&now, centre_at(tree, wisp, n), tree->rotation, &block->position[n]);
    real room = (real)tree->options.loose * *number_of(tree, tree->rest_radius, wisp, n);
    if (farthest2(&now) > room * room) return false;
    unplace_lanes(&then, centre_was_at(tree, wisp, n), tree->before, &block->previous[n]);
    for (int l = 0; l < LANES; ++l) {
        now.x[l] -= then.x[l];
        now.y[l] -= then.y[l];
        now.z[l] -= then.z[l];
    }
    real most = (real)(tree->options.merge_m_s / velocity_scale(tree));
    return farthest2(&now) <= most * most;
}

// Of a wisp that was split to the root only the first node was gathered, so only that can merge;
// a whole one merges all or none.
static void decide(Tree* tree, int wisp)
{
    int was = tree->first[wisp], first = was;
    while (first > 1 && is_hot(tree, wisp, first - 1))
        --first;
    if (first == was)
        while (first < tree->most[wisp] && !is_hot(tree, wisp, first) &&
               is_together(tree, wisp, first)) {
            ++first;
            if (was == 1 && !tree->whole) break;
        }
    if (first != was) tree_move_first(tree, wisp, first);
}

static void gather_split(Tree* tree, int wisp)
{
    int first = tree->first[wisp];
    int last = first == 1 && !tree->whole ? 1 : tree->nodes - 1;
    for (int n = first; n <= last; ++n)
        gather(tree, wisp, n);
}

// The head's own acceleration over the tick, m/s^2.
static Vec3 head_acceleration(const Tree* tree)
{
    const SimDefinition* d = &tree->members->definition;
    Vec3 sum = {0, 0, 0};
    for (int s = 0; s < d->substeps; ++s)
        sum = vec3_add(sum, tree->members->substeps[s].second_difference);
    float dt = tree->members->substeps[0].dt;
    return vec3_scale(sum, 1.0f / (dt * dt * (float)d->substeps));
}

static void measure_node(const Block* centres, int n, Lanes3* velocity, const Lanes* radius,
                         Lanes* heat, real rate, real hz, Vec3 head)
{
    const Lanes3 *p = &centres->position[n], *previous = &centres->previous[n];
    for (int l = 0; l < LANES; ++l) {
        real vx = rate * (p->x[l] - previous->x[l]), vy = rate * (p->y[l] - previous->y[l]),
             vz = rate * (p->z[l] - previous->z[l]);
        real ax = hz * (vx - velocity->x[l]) + (real)head.x,
             ay = hz * (vy - velocity->y[l]) + (real)head.y,
             az = hz * (vz - velocity->z[l]) + (real)head.z;
        heat->v[l] = real_sqrt(ax * ax + ay * ay + az * az) * radius->v[l];
        velocity->x[l] = vx;
        velocity->y[l] = vy;
        velocity->z[l] = vz;
    }
}

static void measure(Tree* tree)
{
    Vec3 head = head_acceleration(tree);
    real rate = (real)velocity_scale(tree), hz = (real)tree->members->definition.rate_hz;
    for (int b = 0; b < tree->centres->block_count; ++b)
        for (int n = 1; n < tree->nodes; ++n) {
            int at = b * tree->nodes + n;
            measure_node(&tree->centres->blocks[b], n, &tree->velocity[at], &tree->radius[at],
                         &tree->heat[at], rate, hz, head);
        }
}

static void keep_rotations(Tree* tree)
{
    int last = tree->members->definition.substeps - 1;
    const Substep* substeps = tree->members->substeps;
    memcpy(tree->before, last > 0 ? substeps[last - 1].rotation : tree->rotation,
           sizeof tree->before);
    memcpy(tree->rotation, substeps[last].rotation, sizeof tree->rotation);
}

static void touch(Tree* tree)
{
    Cylinders cylinders = {tree->centres, tree->first, tree->radius, tree->mass};
    contact_push(tree->contact, &tree->options.contact, &cylinders,
                 (float)(1.0 / tree->centres->definition.rate_hz));
}

void tree_step(Tree* tree, const SimHead* heads)
{
    step_prepare(tree->centres, heads);
    step_prepare(tree->members, heads);
    if (tree->options.has_contact) touch(tree);
    step_centres(tree);
    step_members(tree);
    keep_rotations(tree);
    ++tree->tick;
    if (tree->options.most_merged <= 1) return;
    for (int w = 0; w < tree->wisps; ++w)
        if (tree->first[w] < tree->nodes) gather_split(tree, w);
    measure(tree);
    for (int w = 0; w < tree->wisps; ++w)
        decide(tree, w);
}
