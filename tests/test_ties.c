// What holds strands together: cloth on a grid, and a band around hair.
#include "tests/strand.h"

#include <xxhash.h>

#define ROWS     9
#define NODES    8
#define APART_M  0.04f
#define SUBSTEPS 8
#define MAX_TIES 512

typedef struct Sheet {
    Vec3 rest[ROWS * NODES];
    Tie ties[MAX_TIES];
    int tie_count;
    Sim* sim;
} Sheet;

static float rest_distance(const Sheet* sheet, const Tie* tie)
{
    Vec3 a = sheet->rest[tie->strand[0] * NODES + tie->node[0]];
    Vec3 b = sheet->rest[tie->strand[1] * NODES + tie->node[1]];
    return vec3_length(vec3_sub(a, b));
}

static void add_tie(Sheet* sheet, int strand, int node, int other, int other_node, bool is_rope)
{
    assert_true(sheet->tie_count < MAX_TIES);
    Tie* tie = &sheet->ties[sheet->tie_count++];
    *tie = (Tie){.strand = {strand, other}, .node = {node, other_node}, .is_rope = is_rope};
    tie->length_m = rest_distance(sheet, tie);
}

// A curtain of 9 rows of 8 nodes; with `woven` their neighbours hold each other, straight and
// askew.
static void curtain(Sheet* sheet, bool woven)
{
    sheet->tie_count = 0;
    for (int s = 0; s < ROWS; ++s)
        for (int n = 0; n < NODES; ++n)
            sheet->rest[s * NODES + n] = vec3(APART_M * (float)s, -APART_M * (float)n, 0);
    for (int s = 0; woven && s + 1 < ROWS; ++s)
        for (int n = 1; n < NODES; ++n) {
            add_tie(sheet, s, n, s + 1, n, false);
            add_tie(sheet, s, n, s + 1, n - 1, false);
            add_tie(sheet, s, n - 1, s + 1, n, false);
        }
}

static SimDefinition definition_of(const Sheet* sheet)
{
    SimDefinition d = sim_default();
    d.model = MODEL_PLAIN;
    d.strands = ROWS;
    d.nodes = NODES;
    d.rest = sheet->rest;
    d.ties = sheet->ties;
    d.tie_count = sheet->tie_count;
    d.iterations = 4;
    d.substeps = SUBSTEPS;
    return d;
}

static void create(Sheet* sheet, SimDefinition d)
{
    Fault fault = {0};
    sheet->sim = sim_create(&d, &fault);
    if (sheet->sim == NULL) fail_msg("%s", fault.text);
}

// The head turns to and fro by 46 degrees at 2.2 Hz, and then rests.
static void tick(Sheet* sheet, int i)
{
    SimHead heads[SUBSTEPS] = {0};
    for (int s = 0; s < SUBSTEPS; ++s) {
        double t = (i + (s + 1.0) / SUBSTEPS) / 60;
        double angle = t < 2 ? 0.8 * sin(14 * t) * sin(1.5707963 * t) : 0;
        float c = (float)cos(angle), n = (float)sin(angle);
        memcpy(heads[s].rotation, (float[9]){c, 0, n, 0, 1, 0, -n, 0, c}, sizeof identity);
    }
    sim_step(sheet->sim, heads);
}

// How much the longest of all ties is too long, of its length: folds are free.
static double worst(const Sheet* sheet)
{
    Vec3 now[ROWS * NODES], before[ROWS * NODES];
    sim_state(sheet->sim, now, before);
    double most = 0;
    for (int i = 0; i < sheet->tie_count; ++i) {
        const Tie* tie = &sheet->ties[i];
        double length = (double)vec3_length(vec3_sub(now[tie->strand[0] * NODES + tie->node[0]],
                                                     now[tie->strand[1] * NODES + tie->node[1]]));
        double error = length / (double)tie->length_m - 1;
        most = fmax(most, error);
    }
    return most;
}

// ... on the way. Ties that the simulation has not are measured all the same.
static double shaken(Sheet* sheet, SimDefinition d)
{
    create(sheet, d);
    double most = 0;
    for (int i = 0; i < 240; ++i) {
        tick(sheet, i);
        most = fmax(most, worst(sheet));
    }
    sim_destroy(sheet->sim);
    return most;
}

static void cloth_keeps_its_weave(void** state)
{
    (void)state;
    Sheet sheet;
    curtain(&sheet, true);
    SimDefinition d = definition_of(&sheet);
    double woven = shaken(&sheet, d);
    d.tie_count = 0;
    assert_true(woven < 0.08 && shaken(&sheet, d) > 1);
    d.tie_count = sheet.tie_count;
    d.iterations = 16;
    assert_true(shaken(&sheet, d) < 0.6 * woven);
}

// Ropes between all that it holds: they may come together, not part.
static void bind(Sheet* sheet, int node)
{
    sheet->tie_count = 0;
    for (int s = 0; s < ROWS; ++s) {
        float angle = 6.2831853f * (float)s / ROWS;
        for (int n = 0; n < NODES; ++n) {
            float wide = n <= node ? 0.05f - 0.04f * (float)n / (float)node : 0.01f;
            sheet->rest[s * NODES + n] =
                vec3(wide * cosf(angle), -APART_M * (float)n, wide * sinf(angle));
        }
    }
    for (int s = 0; s < ROWS; ++s)
        for (int other = s + 1; other < ROWS; ++other)
            add_tie(sheet, s, node, other, node, true);
}

static void a_band_holds_hair_together(void** state)
{
    (void)state;
    Sheet sheet;
    bind(&sheet, 3);
    SimDefinition d = definition_of(&sheet);
    d.model = MODEL_SPRING;
    d.stiffness_s2 = 200;
    double bound = shaken(&sheet, d);
    d.tie_count = 0;
    double loose = shaken(&sheet, d);
    assert_true(bound < 0.05 && loose > 0.5);
}

// What ties give one end they take from the other: the middle of two that are tied falls as free
// nodes do, and stays where nothing pulls.
static void ties_conserve_momentum(void** state)
{
    (void)state;
    Vec3 rest[4] = {{0, 0, 0}, {0, -0.5f, 0}, {0.1f, 0, 0}, {0.1f, -0.5f, 0}};
    Tie tie = {{0, 1}, {1, 1}, 0.04f, false};
    SimDefinition d = sim_default();
    d.strands = 2;
    d.nodes = 2;
    d.rest = rest;
    d.ties = &tie;
    d.tie_count = 1;
    d.iterations = 1;
    d.stiffness_s2 = 0;
    d.damping_per_s = 0;
    Fault fault = {0};
    Sim* sim = sim_create(&d, &fault);
    assert_non_null(sim);
    SimHead heads[SUBSTEPS] = {0};
    for (int s = 0; s < SUBSTEPS; ++s)
        memcpy(heads[s].rotation, identity, sizeof identity);
    Vec3 now[4], before[4];
    for (int i = 0; i < 30; ++i)
        sim_step(sim, heads);
    sim_state(sim, now, before);
    assert_near(now[1].x + now[3].x, 0.1, 4e-6); // the middle
    assert_true(now[3].x - now[1].x < 0.06f);
    sim_destroy(sim);
}

static uint64_t hash_after_a_second(Sheet* sheet, SimDefinition d)
{
    create(sheet, d);
    for (int i = 0; i < 60; ++i)
        tick(sheet, i);
    XXH64_state_t* hash = XXH64_createState();
    XXH64_reset(hash, 0);
    sim_hash(sheet->sim, hash);
    uint64_t sum = XXH64_digest(hash);
    XXH64_freeState(hash);
    sim_destroy(sheet->sim);
    return sum;
}

static void a_slack_rope_changes_no_bit(void** state)
{
    (void)state;
    Sheet sheet;
    curtain(&sheet, false);
    SimDefinition d = definition_of(&sheet);
    uint64_t loose = hash_after_a_second(&sheet, d);
    for (int s = 1; s < ROWS; ++s)
        add_tie(&sheet, s - 1, NODES - 1, s, NODES - 1, true);
    for (int i = 0; i < sheet.tie_count; ++i)
        sheet.ties[i].length_m = 1;
    d.tie_count = sheet.tie_count;
    assert_int_equal(hash_after_a_second(&sheet, d), loose);
    sheet.ties[0].is_rope = false;
    assert_int_not_equal(hash_after_a_second(&sheet, d), loose);
}

static void tied_strands_give_the_same_bits_everywhere(void** state)
{
    (void)state;
    Sheet sheet;
    curtain(&sheet, true);
    SimDefinition d = definition_of(&sheet);
    d.threads = 2;
    uint64_t widest = hash_after_a_second(&sheet, d);
    d.threads = 1;
    d.kernel = "scalar";
    assert_int_equal(hash_after_a_second(&sheet, d), widest);
}

static void a_tie_to_nowhere_is_refused(void** state)
{
    (void)state;
    Sheet sheet;
    curtain(&sheet, false);
    Tie bad[] = {{{0, ROWS}, {1, 1}, 0.1f, false}, {{0, 1}, {1, -1}, 0.1f, false},
                 {{0, 1}, {1, NODES}, 0.1f, true}, {{-1, 1}, {1, 1}, 0.1f, false},
                 {{0, 1}, {1, 1}, -0.1f, false},   {{0, 1}, {1, 1}, NAN, false},
                 {{2, 2}, {1, 1}, 0.1f, false}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        Fault fault = {0};
        SimDefinition d = definition_of(&sheet);
        d.ties = &bad[i];
        d.tie_count = 1;
        assert_null(sim_create(&d, &fault));
        assert_non_null(strstr(fault.text, "tie 0"));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cloth_keeps_its_weave),
        cmocka_unit_test(a_band_holds_hair_together),
        cmocka_unit_test(ties_conserve_momentum),
        cmocka_unit_test(a_slack_rope_changes_no_bit),
        cmocka_unit_test(tied_strands_give_the_same_bits_everywhere),
        cmocka_unit_test(a_tie_to_nowhere_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
