// The wisps that grow from a style are the same bits everywhere: one hash a style, as literals.
// scripts/check-determinism compiles this with gcc and clang at several -O levels.
#include "client/ribbons.h"
#include "server/groom.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <xxhash.h>

typedef struct Case {
    Hairstyle* (*make)(Fault* fault);
    Lod lod;
    uint64_t hash;
} Case;

// A change of how wisps grow changes these, and is to be one that was meant.
static const Case cases[] = {
    {groom_bob, LOD_FULL, 0x8a0611d62fb5e5b9ull},
    {groom_long, LOD_FULL, 0x9c096b4e5547c60full},
    {groom_ponytail, LOD_FULL, 0x602f7aab7d7bf587ull},
    {groom_curly, LOD_FULL, 0x1be8ab88c4965107ull},
    {groom_short, LOD_FULL, 0x446974fbc2de5948ull},
    {groom_curly, LOD_FAR, 0xbc94fb5f208a0621ull},
};
#define CASES ((int)(sizeof cases / sizeof cases[0]))

static uint64_t hash_of(const Ribbons* ribbons)
{
    XXH64_state_t* state = XXH64_createState();
    XXH64_reset(state, 0);
    Texel* const tables[] = {ribbons->guides, ribbons->weights, ribbons->offsets, ribbons->tangents,
                             ribbons->normals};
    for (int i = 0; i < 5; ++i)
        XXH64_update(state, tables[i], (size_t)ribbons->point_count * sizeof(Texel));
    XXH64_update(state, ribbons->indices, (size_t)ribbons->index_count * sizeof(uint32_t));
    uint64_t hash = XXH64_digest(state);
    XXH64_freeState(state);
    return hash;
}

static void wisps_are_the_same_bits_everywhere(void** state)
{
    (void)state;
    int wrong = 0;
    for (int c = 0; c < CASES; ++c) {
        Fault fault = {""};
        Ribbons ribbons;
        Hairstyle* style = cases[c].make(&fault);
        if (style == NULL || !ribbons_build_lod(&ribbons, style, cases[c].lod, &fault))
            fail_msg("%s", fault.text);
        uint64_t hash = hash_of(&ribbons);
        wrong += hash != cases[c].hash;
        if (hash != cases[c].hash)
            print_error("%s, %s: 0x%016llxull\n", style->name, lod_names[cases[c].lod],
                        (unsigned long long)hash);
        ribbons_free(&ribbons);
        hairstyle_destroy(style);
    }
    assert_int_equal(wrong, 0);
}

// Another seed is other wisps: the hash sees what it should.
static void another_seed_grows_other_wisps(void** state)
{
    (void)state;
    Fault fault = {""};
    uint64_t hash[2];
    for (uint32_t seed = 0; seed < 2; ++seed) {
        Ribbons ribbons;
        Hairstyle* style = groom_short(&fault);
        assert_non_null(style);
        style->seed += seed;
        assert_true(ribbons_build(&ribbons, style, &fault));
        hash[seed] = hash_of(&ribbons);
        ribbons_free(&ribbons);
        hairstyle_destroy(style);
    }
    assert_true(hash[0] != hash[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(wisps_are_the_same_bits_everywhere),
        cmocka_unit_test(another_seed_grows_other_wisps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
