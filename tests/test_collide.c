// What colliders promise: spheres and capsules against points, pearls and links, on the head or on
// a torso that stays where it is.
#include "server/span.h"
#include "tests/strand.h"

#include <xxhash.h>

#define LINKS     7
#define NODES     (LINKS + 1)
#define SUBSTEPS  4
#define PEARL_M   0.006f
#define TOO_DEEP  0.0005 // m
#define MAX_TICKS 120

static void capsule(Collider* c, Vec3 from, Vec3 to, float radius)
{
    *c = (Collider){from, to, radius, BODY_HEAD};
}

// A soft strand that hangs down from `root`; the daemon's defaults but for the stiffness.
static SimDefinition soft(Strand* strand, Vec3 root, const Collider* colliders, int count)
{
    straight(strand, LINKS, vec3(0, -1, 0));
    for (int n = 0; n <= LINKS; ++n)
        strand->rest[n] = vec3_add(strand->rest[n], root);
    SimDefinition d = sim_default();
    d.strands = 1;
    d.nodes = NODES;
    d.stiffness_s2 = 20.0f;
    d.colliders = colliders;
    d.collider_count = count;
    return d;
}

// One tick under a head that speeds up by `push` a substep squared, upright.
static void tick(Strand* strand, Vec3 push)
{
    SimHead heads[SUBSTEPS] = {0};
    for (int s = 0; s < SUBSTEPS; ++s) {
        memcpy(heads[s].rotation, identity, sizeof identity);
        heads[s].second_difference = push;
    }
    sim_step(strand->sim, heads);
}

// How far the nodes, and how far the links, are inside the collider at most, m.
typedef struct Depth {
    double node, link;
} Depth;

static Depth depth_of(const Strand* strand, Collider c, float thickness)
{
    Vec3 p[NODES], before[NODES];
    sim_state(strand->sim, p, before);
    Span axis = {c.from, c.to};
    Depth depth = {-1, -1};
    for (int n = 1; n < NODES; ++n) {
        double radius = (double)(c.radius + thickness);
        depth.node = fmax(depth.node, radius - (double)span_to_point(axis, p[n]));
        depth.link = fmax(depth.link, radius - (double)span_to_span(axis, (Span){p[n - 1], p[n]}));
    }
    return depth;
}

// The deepest while the head is pulled away under the strand, which is so thrown at the collider.
static Depth thrown_at(CollideMode mode, Collider c, Vec3 push)
{
    Strand strand;
    SimDefinition d = soft(&strand, vec3(0, 0, 0), &c, 1);
    d.collide = mode;
    d.pearl_radius_m = PEARL_M;
    start(&strand, d);
    Depth deepest = {-1, -1};
    for (int i = 0; i < MAX_TICKS; ++i) {
        tick(&strand, i < 30 ? push : vec3(0, 0, 0));
        Depth now = depth_of(&strand, c, mode == COLLIDE_POINT ? 0.0f : PEARL_M);
        deepest.node = fmax(deepest.node, now.node);
        deepest.link = fmax(deepest.link, now.link);
    }
    sim_destroy(strand.sim);
    return deepest;
}

// Length correction comes before collision, so nodes are outside at the end of a step.
static void nodes_stay_outside_a_capsule(void** state)
{
    (void)state;
    Collider c, far;
    capsule(&c, vec3(-0.1f, -0.2f, -0.06f), vec3(0.1f, -0.15f, -0.06f), 0.04f);
    capsule(&far, vec3(-0.1f, -9.0f, -0.06f), vec3(0.1f, -9.0f, -0.06f), 0.04f);
    Vec3 push = vec3(0, 0, 4e-4f);
    for (int mode = 0; mode < COLLIDE_COUNT; ++mode) {
        double deepest = thrown_at((CollideMode)mode, c, push).node;
        // It was there, and not inside. Where links collide they are stopped before the nodes are.
        assert_true(deepest > -0.004 && deepest < TOO_DEEP);
    }
    // Where nothing is in the way, the strand goes through that place.
    Strand strand;
    start(&strand, soft(&strand, vec3(0, 0, 0), &far, 1));
    double through = -1;
    for (int i = 0; i < MAX_TICKS; ++i) {
        tick(&strand, i < 30 ? push : vec3(0, 0, 0));
        through = fmax(through, depth_of(&strand, c, 0).node);
    }
    assert_true(through > 0.02);
    sim_destroy(strand.sim);
}

// A rod as thin as a pencil across the strand, between two nodes: pearls pass it on both sides.
static void a_link_does_not_cut_through_what_lies_between_its_nodes(void** state)
{
    (void)state;
    Collider c;
    capsule(&c, vec3(-0.1f, -0.18f, -0.03f), vec3(0.1f, -0.18f, -0.03f), 0.004f);
    Vec3 push = vec3(0, 0, 4e-4f);
    assert_true(thrown_at(COLLIDE_PEARL, c, push).link > 5 * TOO_DEEP);
    assert_true(thrown_at(COLLIDE_SEGMENT, c, push).link < TOO_DEEP);
    // Askew: the nearest points are nowhere near the middles.
    capsule(&c, vec3(-0.07f, -0.29f, -0.03f), vec3(0.01f, -0.17f, -0.03f), 0.004f);
    assert_true(thrown_at(COLLIDE_PEARL, c, push).link > 5 * TOO_DEEP);
    assert_true(thrown_at(COLLIDE_SEGMENT, c, push).link < TOO_DEEP);
    Collider ball = collider_sphere((Sphere){{0, -0.18f, -0.03f}, 0.008f});
    assert_true(thrown_at(COLLIDE_PEARL, ball, push).link > 5 * TOO_DEEP);
    assert_true(thrown_at(COLLIDE_SEGMENT, ball, push).link < TOO_DEEP);
}

static void a_strand_that_rests_inside_a_capsule_stays(void** state)
{
    (void)state;
    Collider c;
    capsule(&c, vec3(0, 0.1f, 0), vec3(0.02f, -0.2f, 0.01f), 0.03f);
    for (int mode = 0; mode < COLLIDE_COUNT; ++mode) {
        Strand strand;
        SimDefinition d = soft(&strand, vec3(0, 0, 0), &c, 1);
        d.collide = (CollideMode)mode;
        start(&strand, d);
        for (int i = 0; i < MAX_TICKS; ++i)
            tick(&strand, vec3(0, 0, 0));
        for (int n = 0; n < NODES; ++n)
            assert_true(vec3_length(vec3_sub(node(&strand, n), strand.rest[n])) < 1e-6f);
        sim_destroy(strand.sim);
    }
}

// The head turns by half a turn within half a second, the torso does not.
static void turn_head(Strand* strand, int i, bool has_torso)
{
    SimHead heads[SUBSTEPS] = {0};
    for (int s = 0; s < SUBSTEPS; ++s) {
        double part = fmin(1.0, (i + (s + 1.0) / SUBSTEPS) / 30);
        double angle = 3.141592653589793 * part;
        float c = (float)cos(angle), n = (float)sin(angle);
        memcpy(heads[s].rotation, (float[9]){c, 0, n, 0, 1, 0, -n, 0, c}, sizeof identity);
        heads[s].has_torso = has_torso;
        memcpy(heads[s].torso_rotation, identity, sizeof identity);
    }
    sim_step(strand->sim, heads);
}

static void a_shoulder_stays_while_the_head_turns(void** state)
{
    (void)state;
    // Under the strand once the head has turned, on the other side before.
    Collider shoulder;
    capsule(&shoulder, vec3(-0.12f, -0.25f, 0.02f), vec3(-0.06f, -0.22f, 0.02f), 0.04f);
    shoulder.body = BODY_TORSO;
    for (int has_torso = 0; has_torso <= 1; ++has_torso) {
        Strand strand;
        SimDefinition d = soft(&strand, vec3(0.09f, 0, 0), &shoulder, 1);
        d.stiffness_s2 = 2000.0f;
        start(&strand, d);
        double deepest = -1;
        for (int i = 0; i < MAX_TICKS; ++i) {
            turn_head(&strand, i, has_torso);
            if (i > 40) deepest = fmax(deepest, depth_of(&strand, shoulder, PEARL_M).node);
        }
        // Turned along with the head it is no longer there.
        assert_true(has_torso ? deepest > -1e-3 && deepest < TOO_DEEP : deepest > 0.02);
        sim_destroy(strand.sim);
    }
}

// The same the other way round: a capsule of the head turns with it, and takes the strand along.
static void a_capsule_turns_with_the_head(void** state)
{
    (void)state;
    Collider comb;
    capsule(&comb, vec3(0.02f, -0.2f, 0.02f), vec3(0.16f, -0.2f, 0.02f), 0.006f);
    Strand strand;
    start(&strand, soft(&strand, vec3(0.09f, 0, 0), &comb, 1));
    for (int i = 0; i < MAX_TICKS; ++i) {
        turn_head(&strand, i, false);
        double angle = 3.141592653589793 * fmin(1.0, (i + 1.0) / 30);
        float c = (float)cos(angle), n = (float)sin(angle);
        Collider now = comb;
        now.from =
            vec3(c * comb.from.x + n * comb.from.z, comb.from.y, c * comb.from.z - n * comb.from.x);
        now.to = vec3(c * comb.to.x + n * comb.to.z, comb.to.y, c * comb.to.z - n * comb.to.x);
        assert_true(depth_of(&strand, now, PEARL_M).node < TOO_DEEP);
        if (i == 1) assert_true(depth_of(&strand, now, PEARL_M).node > -1e-4); // it is touched
    }
    sim_destroy(strand.sim);
}

// A torso that moves below a head at rest takes hair along as far as it reaches, and no further.
static void a_torso_that_moves_pushes(void** state)
{
    (void)state;
    Collider shoulder;
    capsule(&shoulder, vec3(0.1f, -0.3f, -0.1f), vec3(0.1f, -0.3f, 0.1f), 0.05f);
    shoulder.body = BODY_TORSO;
    Strand strand;
    start(&strand, soft(&strand, vec3(0, 0, 0), &shoulder, 1));
    for (int i = 0; i < MAX_TICKS; ++i) {
        SimHead heads[SUBSTEPS] = {0};
        Vec3 offset = vec3(-0.1f * (float)fmin(1.0, (i + 1) / 60.0), 0, 0);
        for (int s = 0; s < SUBSTEPS; ++s) {
            memcpy(heads[s].rotation, identity, sizeof identity);
            memcpy(heads[s].torso_rotation, identity, sizeof identity);
            heads[s].has_torso = true;
            heads[s].torso_offset = offset;
        }
        sim_step(strand.sim, heads);
        Collider now = shoulder;
        now.from = vec3_add(now.from, offset);
        now.to = vec3_add(now.to, offset);
        assert_true(depth_of(&strand, now, PEARL_M).node < TOO_DEEP);
    }
    assert_true(node(&strand, LINKS).x < -0.04f);
    sim_destroy(strand.sim);
}

static uint64_t hash_of(const char* kernel, CollideMode mode)
{
    Collider colliders[2];
    capsule(&colliders[0], vec3(-0.1f, -0.18f, -0.03f), vec3(0.1f, -0.19f, -0.03f), 0.004f);
    colliders[1] = collider_sphere((Sphere){{0.02f, -0.25f, -0.05f}, 0.01f});
    colliders[1].body = BODY_TORSO;
    Strand strand;
    SimDefinition d = soft(&strand, vec3(0, 0, 0), colliders, 2);
    d.collide = mode;
    d.kernel = kernel;
    start(&strand, d);
    for (int i = 0; i < MAX_TICKS; ++i) {
        tick(&strand, i < 30 ? vec3(0, 0, 4e-4f) : vec3(0, 0, 0));
        if (i > 40) turn_head(&strand, i - 40, true);
    }
    XXH64_state_t* hash = XXH64_createState();
    XXH64_reset(hash, 0);
    sim_hash(strand.sim, hash);
    uint64_t sum = XXH64_digest(hash);
    XXH64_freeState(hash);
    sim_destroy(strand.sim);
    return sum;
}

static void every_kernel_collides_to_the_same_bits(void** state)
{
    (void)state;
    for (int mode = 0; mode < COLLIDE_COUNT; ++mode)
        assert_int_equal(hash_of("scalar", (CollideMode)mode), hash_of(NULL, (CollideMode)mode));
    assert_int_not_equal(hash_of(NULL, COLLIDE_PEARL), hash_of(NULL, COLLIDE_SEGMENT));
}

static void distances_of_spans_are_exact(void** state)
{
    (void)state;
    Span a = {{0, 0, 0}, {2, 0, 0}};
    assert_near(span_to_point(a, vec3(-3, 4, 0)), 5, 1e-6);
    assert_near(span_to_point(a, vec3(1, 0, 2)), 2, 1e-6);
    assert_near(span_to_point((Span){{1, 1, 1}, {1, 1, 1}}, vec3(1, 1, 3)), 2, 1e-6);
    assert_near(span_to_span(a, (Span){{1, 1, -1}, {1, 1, 1}}), 1, 1e-6);     // crossing
    assert_near(span_to_span(a, (Span){{0, 3, 0}, {2, 3, 0}}), 3, 1e-6);      // parallel
    assert_near(span_to_span(a, (Span){{5, 4, 0}, {5, 9, 0}}), 5, 1e-6);      // end to end
    assert_near(span_to_span(a, (Span){{1, 0.5f, 0}, {1, 2, 0}}), 0.5, 1e-6); // end to middle
}

static void a_collider_that_is_none_is_refused(void** state)
{
    (void)state;
    Strand strand;
    Collider bad[] = {{{NAN, 0, 0}, {0, 0, 0}, 1, BODY_HEAD},
                      {{0, 0, 0}, {0, INFINITY, 0}, 1, BODY_HEAD},
                      {{0, 0, 0}, {0, 0, 0}, -1, BODY_HEAD},
                      {{0, 0, 0}, {0, 0, 0}, 1, BODY_COUNT},
                      {{0, 0, 0}, {0, 0, 0}, 1, -1}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        Fault fault = {0};
        SimDefinition d = soft(&strand, vec3(0, 0, 0), &bad[i], 1);
        d.rest = strand.rest;
        assert_null(sim_create(&d, &fault));
        assert_non_null(strstr(fault.text, "collider 0"));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nodes_stay_outside_a_capsule),
        cmocka_unit_test(a_link_does_not_cut_through_what_lies_between_its_nodes),
        cmocka_unit_test(a_strand_that_rests_inside_a_capsule_stays),
        cmocka_unit_test(a_shoulder_stays_while_the_head_turns),
        cmocka_unit_test(a_capsule_turns_with_the_head),
        cmocka_unit_test(a_torso_that_moves_pushes),
        cmocka_unit_test(every_kernel_collides_to_the_same_bits),
        cmocka_unit_test(distances_of_spans_are_exact),
        cmocka_unit_test(a_collider_that_is_none_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
