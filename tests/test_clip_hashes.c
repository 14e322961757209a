// One state for each model and clip, whatever computes it: the literals of hashes.inc, over kernels
// and numbers of threads; scripts/check-determinism runs this test as gcc and clang make it at
// several levels, and test_hash asks the program for the same.
//
//     build/bin/test_clip_hashes --print > tests/hashes.h
//
// makes the literals anew, where a change of the dynamics is meant; the commit says why.
#include "server/daemon_characters.h"
#include "server/kernel.h"
#include "server/models.h"
#include "server/motion.h"
#include "tests/hashes.h"

#include <inttypes.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <xxhash.h>

#include <cmocka.h>

static const char* const kernels[] = {"avx512", "avx2", "sse2", "scalar"};

// A daemon with a character in every clip, by slot, after HASHED_TICKS.
static Daemon* run_all(ModelKind model, const char* kernel, int threads)
{
    DaemonOptions options = daemon_default();
    Fault fault = {0};
    model_use(&options.sim, model);
    options.characters = 0;
    options.fast = true;
    options.sim.kernel = kernel;
    options.sim.threads = threads;
    Daemon* daemon = daemon_create(&options, &fault);
    bool is_made = daemon != NULL;
    for (int c = 0; is_made && c < HASHED_CLIPS; ++c)
        is_made = daemon_characters_add(daemon, c, 0, motion_find(hashed_clips[c]),
                                        (Vec3d){0, 0, 0}, &fault);
    if (!is_made) fail_msg("%s", fault.text);
    for (int tick = 0; tick < HASHED_TICKS; ++tick)
        daemon_tick(daemon);
    return daemon;
}

// As daemon_state_hash has it where this character is the only one.
static uint64_t hash_of(const Daemon* daemon, int slot)
{
    XXH64_state_t* state = XXH64_createState();
    assert_non_null(state);
    XXH64_reset(state, 0);
    sim_hash(daemon->characters[slot]->sim, state);
    uint64_t hash = XXH64_digest(state);
    XXH64_freeState(state);
    return hash;
}

static void expect_recorded(const char* kernel, int threads)
{
    for (int model = 0; model < MODEL_COUNT; ++model) {
        Daemon* daemon = run_all((ModelKind)model, kernel, threads);
        for (int c = 0; c < HASHED_CLIPS; ++c)
            if (hash_of(daemon, c) != recorded[model].of_clip[c])
                fail_msg("%s %s, kernel %s, %d threads: 0x%016" PRIx64, models[model].name,
                         hashed_clips[c], kernel != NULL ? kernel : "the widest", threads,
                         hash_of(daemon, c));
        daemon_destroy(daemon);
    }
}

static void every_kernel_ends_in_the_recorded_states(void** state)
{
    (void)state;
    for (size_t k = 0; k < sizeof kernels / sizeof kernels[0]; ++k)
        if (kernel_find(kernels[k]) != NULL)
            expect_recorded(kernels[k], 1);
        else
            print_message("SKIPPED: %s does not run here\n", kernels[k]);
}

static void any_number_of_threads_ends_in_the_recorded_states(void** state)
{
    (void)state;
    expect_recorded(NULL, 2);
    expect_recorded(NULL, 4);
}

static void every_model_has_a_hash_in_every_clip(void** state)
{
    (void)state;
    int clips = 0;
    for (const Motion* motion = motions; motion->name != NULL; ++motion) {
        if (motion->at == NULL || strcmp(motion->name, "none") == 0) continue;
        assert_true(clips < HASHED_CLIPS);
        assert_string_equal(hashed_clips[clips++], motion->name);
    }
    assert_int_equal(clips, HASHED_CLIPS);
    for (int model = 0; model < MODEL_COUNT; ++model)
        assert_string_equal(recorded[model].model, models[model].name);
}

static int print_table(void)
{
    printf("static const ModelHashes recorded[MODEL_COUNT] = {\n");
    for (int model = 0; model < MODEL_COUNT; ++model) {
        Daemon* daemon = run_all((ModelKind)model, NULL, 1);
        printf("    {\"%s\",\n     {", models[model].name);
        for (int c = 0; c < HASHED_CLIPS; ++c)
            printf("0x%016" PRIx64 "%s", hash_of(daemon, c),
                   c == HASHED_CLIPS - 1 ? "}},\n"
                   : c % 4 == 3          ? ",\n      "
                                         : ", ");
        daemon_destroy(daemon);
    }
    printf("};\n");
    return 0;
}

int main(int argc, char** argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_model_has_a_hash_in_every_clip),
        cmocka_unit_test(every_kernel_ends_in_the_recorded_states),
        cmocka_unit_test(any_number_of_threads_ends_in_the_recorded_states),
    };
    if (argc > 1 && strcmp(argv[1], "--print") == 0) return print_table();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
