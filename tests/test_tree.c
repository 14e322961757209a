// The Adaptive Wisp Tree: what splitting and merging must not change, when they happen, and what
// cylinders that meet do to each other.
#include "server/models.h"
#include "server/motion.h"
#include "server/strands.h"
#include "tests/strand.h"
#include "tests/tree.h"

#define SUBSTEPS 4
#define NODES    8
#define STRANDS  100 // three wisps and a part of one
#define ALL      (STRANDS * NODES)

typedef struct Tuft {
    Vec3 rest[ALL];
    uint8_t weight[ALL];
    Collider head;
    SimDefinition definition;
} Tuft;

typedef struct Snapshot {
    Vec3 now[ALL], before[ALL];
} Snapshot;

// Strands beside a sphere, 2 mm apart, some a little longer than others.
static void grow(Tuft* tuft, ModelKind model)
{
    *tuft = (Tuft){.head = collider_sphere((Sphere){{0, -0.1f, -0.1f}, 0.08f})};
    for (int i = 0; i < ALL; ++i) {
        int s = i / NODES, n = i % NODES;
        float length = 0.25f + 0.002f * (float)(s % 7);
        tuft->rest[i] = vec3(0.002f * (float)(s * 37 % 10), -length * (float)n / (NODES - 1),
                             0.002f * (float)(s * 37 % STRANDS / 10));
        tuft->weight[i] = n == 0 ? 0 : n == 1 ? 200 : 255;
    }
    SimDefinition d = sim_default();
    d.model = model;
    d.strands = STRANDS;
    d.nodes = NODES;
    d.rest = tuft->rest;
    d.weight = tuft->weight;
    d.colliders = &tuft->head;
    d.collider_count = 1;
    d.damping_per_s = 15;
    tuft->definition = d;
}

static void heads_at(SimHead heads[SUBSTEPS], const char* clip, int tick)
{
    memset(heads, 0, SUBSTEPS * sizeof *heads);
    for (int s = 0; s < SUBSTEPS; ++s) {
        MotionState state = motion_find(clip)->at((tick * SUBSTEPS + s + 1) / (60.0 * SUBSTEPS));
        quat_matrix(heads[s].rotation, state.pose.orientation);
        heads[s].wind = vec3_from(state.wind);
    }
}

static Tree* tree_of(const Tuft* tuft, TreeOptions options)
{
    Fault fault = {""};
    Tree* tree = tree_create(&tuft->definition, &options, &fault);
    if (tree == NULL) fail_msg("%s", fault.text);
    return tree;
}

static Sim* sim_of(const Tuft* tuft)
{
    Fault fault = {""};
    Sim* sim = sim_create(&tuft->definition, &fault);
    if (sim == NULL) fail_msg("%s", fault.text);
    return sim;
}

static void step(Tree* tree, const char* clip, int tick)
{
    SimHead heads[SUBSTEPS];
    heads_at(heads, clip, tick);
    tree_step(tree, heads);
}

static Snapshot snapshot(const Tree* tree)
{
    Snapshot all;
    tree_state(tree, all.now, all.before);
    return all;
}

static void assert_same_bits(const Tree* tree, const Sim* sim)
{
    static Snapshot a, b;
    a = snapshot(tree);
    sim_state(sim, b.now, b.before);
    assert_memory_equal(&a, &b, sizeof a);
    tree_positions(tree, identity, true, a.now);
    sim_positions(sim, identity, true, b.now);
    assert_memory_equal(a.now, b.now, sizeof a.now);
}

static void fully_split_is_the_simulation_bit_for_bit(void** state)
{
    (void)state;
    for (int model = 0; model < MODEL_COUNT; ++model) {
        Tuft tuft;
        SimHead heads[SUBSTEPS];
        TreeOptions options = tree_default();
        options.most_merged = 1;
        grow(&tuft, (ModelKind)model);
        Tree* tree = tree_of(&tuft, options);
        Sim* sim = sim_of(&tuft);
        for (int i = 0; i < 60; ++i) {
            heads_at(heads, i < 30 ? "shake" : "gust", i);
            tree_step(tree, heads);
            sim_step(sim, heads);
        }
        assert_true(tree_split_share(tree) == 1);
        assert_same_bits(tree, sim);
        sim_destroy(sim);
        tree_destroy(tree);
    }
}

static void put_state(Sim* sim, const Tree* tree)
{
    static Snapshot all;
    all = snapshot(tree);
    for (int i = 0; i < sim->block_count * LANES * NODES; ++i) {
        int place = i / NODES, n = i % NODES, strand = place < STRANDS ? place : STRANDS - 1;
        Block* block = &sim->blocks[place / LANES];
        lane_set(&block->position[n], place % LANES, all.now[strand * NODES + n]);
        lane_set(&block->previous[n], place % LANES, all.before[strand * NODES + n]);
    }
}

// Below zero everything splits at the end of every tick, whatever was merged by hand before it.
static void split_again_it_goes_on_as_the_simulation_would(void** state)
{
    (void)state;
    for (int model = 0; model < MODEL_COUNT; ++model) {
        if (models[model].has_angles) continue; // which the state read does not show
        Tuft tuft;
        SimHead heads[SUBSTEPS];
        TreeOptions options = tree_default();
        options.split_m2_s2 = -1;
        grow(&tuft, (ModelKind)model);
        Tree* tree = tree_of(&tuft, options);
        Sim* sim = sim_of(&tuft);
        for (int i = 0; i < 3 * NODES; ++i) {
            for (int w = 0; w < tree_wisps(tree); ++w)
                tree_move_first(tree, w, 1 + (i + w / 2) % NODES);
            heads_at(heads, "shake", i);
            tree_step(tree, heads);
        }
        assert_true(tree_split_share(tree) == 1);
        put_state(sim, tree);
        // Colliders move from where they were to where they are.
        memcpy(sim->bodies[BODY_HEAD].rotation, heads[SUBSTEPS - 1].rotation, sizeof identity);
        memcpy(sim->bodies[BODY_TORSO].rotation, heads[SUBSTEPS - 1].rotation, sizeof identity);
        for (int i = 3 * NODES; i < 60; ++i) {
            heads_at(heads, "shake", i);
            tree_step(tree, heads);
            sim_step(sim, heads);
        }
        assert_same_bits(tree, sim);
        sim_destroy(sim);
        tree_destroy(tree);
    }
}

// Sums over the members of each wisp's nodes: mass times place, and mass times velocity.
static void assert_same_sums(const Tree* tree, const Snapshot* a, const Snapshot* b)
{
    for (int w = 0; w < tree_wisps(tree); ++w)
        for (int n = 1; n < NODES; ++n) {
            Vec3d place = {0, 0, 0}, moved = {0, 0, 0};
            int members = 0;
            for (int s = 0; s < STRANDS; ++s) {
                int i = s * NODES + n;
                if (tree_wisp_of(tree, s) != w) continue;
                Vec3d at_a = vec3d_from(a->now[i]), at_b = vec3d_from(b->now[i]);
                Vec3d step_a = vec3d_sub(at_a, vec3d_from(a->before[i]));
                Vec3d step_b = vec3d_sub(at_b, vec3d_from(b->before[i]));
                place = vec3d_add(place, vec3d_sub(at_a, at_b));
                moved = vec3d_add(moved, vec3d_sub(step_a, step_b));
                ++members;
            }
            assert_true(members == LANES || members == STRANDS % LANES);
            // Of a mean, in metres: a float resolves 3e-8 there.
            assert_near(sqrt(vec3d_dot(place, place)) / members, 0, 1e-7);
            assert_near(sqrt(vec3d_dot(moved, moved)) / members, 0, 1e-7);
        }
}

static double farthest(const Snapshot* a, const Snapshot* b)
{
    double most = 0;
    for (int i = 0; i < ALL; ++i)
        most = fmax(most, (double)vec3_length(vec3_sub(a->now[i], b->now[i])));
    return most;
}

static void move_all(Tree* tree, int first)
{
    for (int w = 0; w < tree_wisps(tree); ++w)
        tree_move_first(tree, w, first);
}

// In the middle of a shake, and once more while what the first merge left is settling.
static void splits_and_merges_conserve_momentum_and_move_nobody(void** state)
{
    (void)state;
    static Snapshot before, after;
    for (int model = 0; model < MODEL_COUNT; ++model) {
        Tuft tuft;
        TreeOptions options = tree_default();
        options.split_m2_s2 = 1e9f;
        options.merge_m_s = 0;
        grow(&tuft, (ModelKind)model);
        Tree* tree = tree_of(&tuft, options);
        move_all(tree, 1);
        for (int i = 0; i < 40; ++i) {
            step(tree, "shake", i);
            if (i < 20 || i % 3 != 0) continue;
            static const int firsts[] = {4, 8, 3, 1, 5, 2, 1};
            before = snapshot(tree);
            move_all(tree, firsts[i / 3 % 7]);
            after = snapshot(tree);
            assert_same_sums(tree, &before, &after);
            assert_near(farthest(&before, &after), 0, 2e-7);
        }
        tree_destroy(tree);
    }
}

static void nodding_hair_splits_from_the_tip_and_merges_in_the_calm(void** state)
{
    (void)state;
    Tuft tuft;
    bool some_in_part = false;
    double most = 0;
    TreeOptions options = tree_default();
    options.split_m2_s2 = 0.05f; // the tuft is thin
    grow(&tuft, MODEL_SPRING);
    Tree* tree = tree_of(&tuft, options);
    for (int i = 0; i < 30; ++i)
        step(tree, "none", i);
    assert_true(tree_split_share(tree) == 0);
    for (int i = 0; i < 236; ++i) {
        int was[ALL];
        for (int w = 0; w < tree_wisps(tree); ++w)
            was[w] = tree_first(tree, w);
        step(tree, "nod", i);
        most = fmax(most, tree_split_share(tree));
        for (int w = 0; w < tree_wisps(tree); ++w)
            some_in_part |= tree_first(tree, w) > 1 && tree_first(tree, w) < was[w];
    }
    assert_true(most > 0.3);
    assert_true(some_in_part);
    assert_true(tree_split_share(tree) == 0);
    tree_destroy(tree);
}

// 32 strands in a row: the radius is half its width, 31 mm. So stiff that the hair goes with the
// head, which gains 10 m/s^2: times the radius 0.31.
static double share_at(float bound, float stiffness)
{
    Vec3 rest[LANES * NODES];
    SimHead heads[SUBSTEPS] = {0};
    for (int i = 0; i < LANES * NODES; ++i)
        rest[i] = vec3(0, -0.03f * (float)(i % NODES), 0.002f * (float)(i / NODES));
    Tuft tuft = {.definition = sim_default()};
    tuft.definition.strands = LANES;
    tuft.definition.nodes = NODES;
    tuft.definition.rest = rest;
    tuft.definition.stiffness_s2 = stiffness;
    tuft.definition.damping_per_s = stiffness > 0 ? 200 : 0;
    tuft.definition.fall_off_power = 0;
    tuft.definition.iterations = 0;
    TreeOptions options = tree_default();
    options.split_m2_s2 = bound;
    Tree* tree = tree_of(&tuft, options);
    double most = 0;
    for (int i = 0; i < 60; ++i) {
        double gain = 10 * fmin(1, i / 30.0), dt = 1.0 / (60 * SUBSTEPS);
        for (int s = 0; s < SUBSTEPS; ++s) {
            memcpy(heads[s].rotation, identity, sizeof identity);
            heads[s].second_difference.x = (float)(gain * dt * dt);
        }
        tree_step(tree, heads);
        most = fmax(most, tree_split_share(tree));
    }
    tree_destroy(tree);
    return most;
}

static void a_node_splits_where_acceleration_times_radius_is_over_the_bound(void** state)
{
    (void)state;
    assert_true(share_at(0.28f, 20000) == 1);
    assert_true(share_at(0.34f, 20000) == 0);
    // Hair that nothing holds stays where it is in the world: it is the head that leaves.
    assert_true(share_at(0.28f, 0) == 0);
}

// How many nodes of the first wisp are merged, a second after all was split by hand.
static int merged_after(TreeOptions options, const char* clip)
{
    Tuft tuft;
    grow(&tuft, MODEL_SPRING);
    options.split_m2_s2 = 1e9f;
    Tree* tree = tree_of(&tuft, options);
    move_all(tree, 1);
    for (int i = 0; i < 60; ++i)
        step(tree, clip, i);
    int first = tree_first(tree, 0);
    tree_destroy(tree);
    return first;
}

static void only_members_that_stay_together_merge(void** state)
{
    (void)state;
    TreeOptions usual = tree_default(), still = usual, narrow = usual;
    still.merge_m_s = 0;
    narrow.loose = 0.9f; // less than they have at rest
    assert_int_equal(merged_after(usual, "none"), NODES);
    assert_int_equal(merged_after(narrow, "none"), 1);
    assert_int_equal(merged_after(still, "nod"), 1);
    assert_int_equal(merged_after(usual, "nod"), NODES);
}

// Members leave a merge as they lay; each must come home to its own rest, not to the wisp's.
static void merged_hair_comes_to_rest_strand_by_strand(void** state)
{
    (void)state;
    Tuft tuft;
    grow(&tuft, MODEL_SPRING);
    TreeOptions options = tree_default();
    options.split_m2_s2 = 1e9f;
    static Snapshot now, before;
    Tree* tree = tree_of(&tuft, options);
    for (int i = 0; i < 240; ++i) {
        step(tree, "nod", i);
        if (i == 20) move_all(tree, 1);
        if (i == 40) move_all(tree, NODES);
        if (i < 200) continue;
        now = snapshot(tree);
        if (i > 200) assert_near(farthest(&now, &before), 0, 5e-5); // they come slowly
        before = now;
    }
    Vec3 at[ALL];
    tree_positions(tree, identity, true, at);
    for (int i = 0; i < ALL; ++i)
        assert_near(vec3_length(vec3_sub(at[i], tuft.rest[i])), 0, 1e-4);
    tree_destroy(tree);
}

static void the_tree_stays_near_the_simulation(void** state)
{
    (void)state;
    for (int model = 0; model <= MODEL_PLAIN; ++model) {
        Tuft tuft;
        SimHead heads[SUBSTEPS];
        static Snapshot a, b;
        double square = 0;
        TreeOptions options = tree_default();
        options.split_m2_s2 = 0.02f;
        grow(&tuft, (ModelKind)model);
        Tree* tree = tree_of(&tuft, options);
        Sim* sim = sim_of(&tuft);
        for (int i = 0; i < 240; ++i) {
            heads_at(heads, "nod", i);
            tree_step(tree, heads);
            sim_step(sim, heads);
            a = snapshot(tree);
            sim_state(sim, b.now, b.before);
            for (int k = 0; k < ALL; ++k) {
                double apart = (double)vec3_length(vec3_sub(a.now[k], b.now[k]));
                square += apart * apart / (ALL * 240);
            }
        }
        assert_near(sqrt(square) / 0.25, 0, 0.012);
        sim_destroy(sim);
        tree_destroy(tree);
    }
}

// Link n of every strand, as long as it should be.
static double worst_link(const Tuft* tuft, const Snapshot* all, int n)
{
    double worst = 0;
    for (int i = n; i < ALL; i += NODES) {
        float length = vec3_length(vec3_sub(tuft->rest[i], tuft->rest[i - 1]));
        float now = vec3_length(vec3_sub(all->now[i], all->now[i - 1]));
        worst = fmax(worst, fabs((double)(now / length - 1)));
    }
    return worst;
}

// The merged part moves within the tick, and they with it.
static void free_ends_hang_on_the_merged_part(void** state)
{
    (void)state;
    for (int model = MODEL_SPRING; model <= MODEL_PLAIN; ++model) {
        Tuft tuft;
        static Snapshot all;
        double worst = 0;
        TreeOptions options = tree_default();
        options.split_m2_s2 = 1e9f;
        options.most_merged = NODES / 2;
        grow(&tuft, (ModelKind)model);
        tuft.definition.iterations = 16;
        Tree* tree = tree_of(&tuft, options);
        for (int i = 0; i < 60; ++i) {
            step(tree, "nod", i);
            all = snapshot(tree);
            worst = fmax(worst, worst_link(&tuft, &all, NODES / 2));
        }
        assert_near(worst, 0, 0.02);
        tree_destroy(tree);
    }
}

static void threads_do_not_change_a_bit(void** state)
{
    (void)state;
    Tuft tuft;
    static Snapshot one, two;
    TreeOptions options = tree_default();
    options.split_m2_s2 = 1e9f;
    options.most_merged = NODES / 2; // all wisps are split in part
    grow(&tuft, MODEL_CASCADE);
    for (int threads = 1; threads <= 2; ++threads) {
        tuft.definition.threads = threads;
        Tree* tree = tree_of(&tuft, options);
        for (int i = 0; i < 90; ++i)
            step(tree, "nod", i);
        *(threads == 1 ? &one : &two) = snapshot(tree);
        tree_destroy(tree);
    }
    assert_memory_equal(&one, &two, sizeof one);
}

static void members_that_are_skinned_differently_do_not_merge(void** state)
{
    (void)state;
    Tuft tuft;
    grow(&tuft, MODEL_SPRING);
    tuft.weight[50 * NODES + 3] = 100;
    Tree* tree = tree_of(&tuft, tree_default());
    for (int i = 0; i < 30; ++i)
        step(tree, "none", i);
    for (int w = 0; w < tree_wisps(tree); ++w)
        assert_int_equal(tree_first(tree, w), w == tree_wisp_of(tree, 50) ? 3 : NODES);
    tree_destroy(tree);
}

static void tied_strands_are_refused(void** state)
{
    (void)state;
    Tuft tuft;
    Fault fault = {""};
    Tie tie = {.strand = {0, 1}, .node = {2, 2}, .length_m = 0.01f};
    TreeOptions options = tree_default();
    grow(&tuft, MODEL_SPRING);
    tuft.definition.ties = &tie;
    tuft.definition.tie_count = 1;
    assert_null(tree_create(&tuft.definition, &options, &fault));
    assert_non_null(strstr(fault.text, "tied"));
}

// --- contact

// Two strands of two links, whose outer links alone are near each other; of different mass.
typedef struct Pair {
    Sim* sim;
    Vec3d velocity[6]; // of nodes, before
    Lanes radius[3];
    int rows[2];
    float mass[2];
} Pair;

static void cross(Pair* pair, const Vec3 rest[6], Vec3 of_first, Vec3 of_second)
{
    SimDefinition d = sim_default();
    Fault fault = {""};
    *pair = (Pair){.rows = {3, 3}, .mass = {32, 4}};
    d.strands = 2;
    d.nodes = 3;
    d.rest = rest;
    pair->sim = sim_create(&d, &fault);
    if (pair->sim == NULL) fail_msg("%s", fault.text);
    for (int i = 0; i < 6; ++i) {
        Block* block = pair->sim->blocks;
        Vec3 move = vec3_scale(i < 3 ? of_first : of_second, 1.0f / 240);
        pair->radius[i % 3].v[i / 3] = 0.004f;
        if (i % 3 == 0) continue;
        lane_set(&block->previous[i % 3], i / 3, vec3_sub(rest[i], move));
    }
}

static Vec3d velocity_of(const Pair* pair, int strand, int n)
{
    Vec3 now[6], before[6];
    sim_state(pair->sim, now, before);
    return vec3d_scale(vec3d_from(vec3_sub(now[strand * 3 + n], before[strand * 3 + n])), 240);
}

// Of a point on the outer link, 0 at its inner end.
static Vec3d velocity_on(const Pair* pair, int strand, double part)
{
    return vec3d_add(vec3d_scale(velocity_of(pair, strand, 1), 1 - part),
                     vec3d_scale(velocity_of(pair, strand, 2), part));
}

static void touch(Pair* pair, int meetings)
{
    ContactOptions options = contact_default();
    Cylinders cylinders = {pair->sim, pair->rows, pair->radius, pair->mass};
    Contact* contact = contact_create(2, 3);
    Vec3d momentum = {0, 0, 0};
    for (int i = 0; i < 6; ++i)
        pair->velocity[i] = velocity_of(pair, i / 3, i % 3);
    assert_int_equal(contact_push(contact, &options, &cylinders, 0.05f), meetings);
    for (int i = 0; i < 6; ++i) {
        Vec3d gain = vec3d_sub(velocity_of(pair, i / 3, i % 3), pair->velocity[i]);
        momentum = vec3d_mad(momentum, gain, (double)pair->mass[i / 3]);
    }
    assert_near(sqrt(vec3d_dot(momentum, momentum)), 0, 4e-4); // of 32 x 0.5 m/s and more
    contact_destroy(contact);
}

static void cylinders_along_each_other_lose_relative_velocity_and_keep_momentum(void** state)
{
    (void)state;
    static const Vec3 rest[6] = {{0, 0, 0},         {0.1f, 0, 0},       {0.2f, 0, 0},
                                 {0.4f, 0.002f, 0}, {0.26f, 0.002f, 0}, {0.14f, 0.002f, 0}};
    Pair pair;
    cross(&pair, rest, vec3(0.5f, 0, 0), vec3(-0.3f, 0, 0.4f));
    touch(&pair, 1);
    // Of parallel links the middle of one, and what is beside it.
    Vec3d relative = vec3d_sub(velocity_on(&pair, 0, 0.5), velocity_on(&pair, 1, 0.11 / 0.12));
    double left = exp(-4 * 0.05);
    assert_near(relative.x, 0.8 * left, 1e-4);
    assert_near(relative.z, -0.4 * left, 1e-4);
    sim_destroy(pair.sim);
}

static void cylinders_across_each_other_are_pushed_apart(void** state)
{
    (void)state;
    static const Vec3 rest[6] = {{0, 0, 0},
                                 {0.1f, 0, 0},
                                 {0.2f, 0, 0},
                                 {0.15f, 0.002f, -0.2f},
                                 {0.15f, 0.002f, -0.05f},
                                 {0.15f, 0.002f, 0.05f}};
    Pair pair;
    cross(&pair, rest, vec3(0.5f, 0, 0), vec3(0, -0.3f, 0));
    touch(&pair, 1);
    Vec3d relative = vec3d_sub(velocity_on(&pair, 1, 0.5), velocity_on(&pair, 0, 0.5));
    assert_near(relative.y, -0.3 + 400 * (0.008 - 0.002) * 0.05, 1e-4);
    assert_near(relative.x, -0.5, 1e-4);
    sim_destroy(pair.sim);
    cross(&pair, rest, vec3(0.01f, 0, 0), vec3(0, -0.01f, 0)); // as good as at rest
    touch(&pair, 0);
    sim_destroy(pair.sim);
}

static void contact_in_a_tree_stays_finite(void** state)
{
    (void)state;
    Tuft tuft;
    grow(&tuft, MODEL_SPRING);
    TreeOptions options = tree_default();
    options.has_contact = true;
    Tree* tree = tree_of(&tuft, options);
    for (int i = 0; i < 120; ++i)
        step(tree, "shake", i);
    static Snapshot all;
    all = snapshot(tree);
    for (int i = 0; i < ALL; ++i)
        assert_true(vec3_length(all.now[i]) < 1);
    tree_destroy(tree);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fully_split_is_the_simulation_bit_for_bit),
        cmocka_unit_test(split_again_it_goes_on_as_the_simulation_would),
        cmocka_unit_test(splits_and_merges_conserve_momentum_and_move_nobody),
        cmocka_unit_test(nodding_hair_splits_from_the_tip_and_merges_in_the_calm),
        cmocka_unit_test(a_node_splits_where_acceleration_times_radius_is_over_the_bound),
        cmocka_unit_test(only_members_that_stay_together_merge),
        cmocka_unit_test(merged_hair_comes_to_rest_strand_by_strand),
        cmocka_unit_test(the_tree_stays_near_the_simulation),
        cmocka_unit_test(free_ends_hang_on_the_merged_part),
        cmocka_unit_test(threads_do_not_change_a_bit),
        cmocka_unit_test(members_that_are_skinned_differently_do_not_merge),
        cmocka_unit_test(tied_strands_are_refused),
        cmocka_unit_test(cylinders_along_each_other_lose_relative_velocity_and_keep_momentum),
        cmocka_unit_test(cylinders_across_each_other_are_pushed_apart),
        cmocka_unit_test(contact_in_a_tree_stays_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
