// One state from one input: over runs and threads, for every model and motion, and another from
// another input. Compilers and -O levels are compared by scripts/check-determinism.
#include "server/models.h"
#include "server/motion.h"
#include "tests/hashes.h"
#include "tests/process.h"

#include <inttypes.h>

#define HASH_LENGTH 16

typedef struct Hash {
    char text[HASH_LENGTH + 1];
} Hash;

static Hash state_hash(const char* motion, const char* option, const char* value)
{
    static Process server;
    process_do(&server, ARGS(SERVER, "--fast", "--ticks", "300", "--hash", "--motion", motion,
                             option, value));
    const char* at = strstr(server.text[0], "\nhash ");
    Hash hash;
    if (at == NULL || sscanf(at, "\nhash %16[0-9a-f]", hash.text) != 1 ||
        strlen(hash.text) != HASH_LENGTH)
        process_fail(&server, "no hash");
    return hash;
}

static void two_runs_end_in_the_same_state(void** state)
{
    (void)state;
    Hash first = state_hash("shake", "--threads", "1"),
         again = state_hash("shake", "--threads", "1");
    assert_string_equal(first.text, again.text);
}

static void the_number_of_threads_does_not_change_the_state(void** state)
{
    (void)state;
    Hash one = state_hash("shake", "--threads", "1"), two = state_hash("shake", "--threads", "2");
    Hash three = state_hash("shake", "--threads", "3");
    assert_string_equal(one.text, two.text);
    assert_string_equal(one.text, three.text);
}

static void other_motions_stiffnesses_and_styles_end_in_other_states(void** state)
{
    (void)state;
    Hash hashes[] = {
        state_hash("shake", "--threads", "1"),     state_hash("nod", "--threads", "1"),
        state_hash("shake", "--stiffness", "401"), state_hash("shake", "--style", "bob"),
        state_hash("shake", "--iterations", "2"),  state_hash("shake", "--damping", "8.5"),
    };
    int count = sizeof hashes / sizeof hashes[0];
    for (int i = 0; i < count; ++i)
        for (int j = 0; j < i; ++j)
            assert_string_not_equal(hashes[i].text, hashes[j].text);
}

static void expect_pair(const char* model, const char* motion, const uint64_t* hash)
{
    static Process server;
    char ticks[16], wanted[32];
    snprintf(ticks, sizeof ticks, "%d", HASHED_TICKS);
    process_do(&server, ARGS(SERVER, "--fast", "--ticks", ticks, "--hash", "--model", model,
                             "--motion", motion));
    snprintf(wanted, sizeof wanted, "\nhash %016" PRIx64 "\n", hash != NULL ? *hash : 0);
    if (hash != NULL && strstr(server.text[0], wanted) == NULL)
        process_fail(&server, "not the recorded hash");
    if (server.text[1][0] != '\0') process_fail(&server, "complains");
}

// And, in a clip, ends in the state that test_clip_hashes recorded.
static void every_model_runs_with_every_motion(void** state)
{
    (void)state;
    for (int model = 0; model < MODEL_COUNT; ++model)
        for (const Motion* motion = motions; motion->name != NULL; ++motion) {
            const uint64_t* hash = NULL;
            for (int c = 0; c < HASHED_CLIPS; ++c)
                if (strcmp(hashed_clips[c], motion->name) == 0) hash = &recorded[model].of_clip[c];
            expect_pair(models[model].name, motion->name, hash);
        }
}

int main(void)
{
    process_setup();
    const struct CMUnitTest tests[] = {
        PROCESS_TEST(two_runs_end_in_the_same_state),
        PROCESS_TEST(the_number_of_threads_does_not_change_the_state),
        PROCESS_TEST(other_motions_stiffnesses_and_styles_end_in_other_states),
        PROCESS_TEST(every_model_runs_with_every_motion),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
