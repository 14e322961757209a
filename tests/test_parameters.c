// Every parameter of the dynamics, negative, no number or beyond a bound: on the command line, in a
// scene, in tuning_t. Each is refused with one line that says the value and the bounds; what is
// only unstable can be forced, and then the line says what will happen.
#include "messages/bytes.h"
#include "tests/daemon.h"
#include "tests/process.h"

#define OFFLINE "--fast", "--ticks", "30", "--hash"

// The option, a value that it must not have, and the bounds that are said.
static const char* const out_of_range[][3] = {
    {"--rate", "0", "from 1 to 1000"},
    {"--rate", "nan", "from 1 to 1000"},
    {"--rate", "1001", "from 1 to 1000"},
    {"--substeps", "-1", "from 1 to 64"},
    {"--substeps", "65", "from 1 to 64"},
    {"--iterations", "-1", "from 0 to 64"},
    {"--iterations", "65", "from 0 to 64"},
    {"--iterations", "nan", "from 0 to 64"},
    {"--stiffness", "-1", "from 0 to 1e+06"},
    {"--stiffness", "nan", "from 0 to 1e+06"},
    {"--stiffness", "1e7", "from 0 to 1e+06"},
    {"--damping", "-0.1", "from 0 to 10000"},
    {"--damping", "nan", "from 0 to 10000"},
    {"--damping", "inf", "from 0 to 10000"},
    {"--drag", "-0.1", "from 0 to 10000"},
    {"--drag", "nan", "from 0 to 10000"},
    {"--drag", "10001", "from 0 to 10000"},
    {"--joint-damping", "-1", "from 0 to 1e+06"},
    {"--joint-damping", "nan", "from 0 to 1e+06"},
    {"--joint-damping", "1e7", "from 0 to 1e+06"},
    {"--down-share", "-0.1", "from 0 to 1"},
    {"--upside-down", "-0.1", "from 0 to 1"},
    {"--upside-down", "nan", "from 0 to 1"},
    {"--upside-down", "1.1", "from 0 to 1"},
    {"--down-share", "nan", "from 0 to 1"},
    {"--down-share", "1.1", "from 0 to 1"},
    {"--threads", "0", "from 1 to 256"},
    {"--threads", "257", "from 1 to 256"},
    {"--characters", "-1", "from 0 to 1024"},
    {"--characters", "1025", "from 0 to 1024"},
    {"--guides", "0", "from 1 to"},
    {"--nodes", "1", "from"},
    {"--unit", "-1", "from 1e-06 to 1000"},
    {"--unit", "nan", "from 1e-06 to 1000"},
    {"--mtu", "0", "from 576 to 65000"},
    {"--ticks", "0", "from 1 to"},
    {"--epoch", "-1", "from 1 to"},
    {"--gravity", "9.81", "on or off"},
    {"--project", "yes", "on or off"},
    {"--model", "beam", "spring, cascade, forest, plain"},
    {"--kernel", "mmx", "scalar"},
};

static void run_and_expect(int status, const char* value, const char* bounds,
                           const char* const* argv)
{
    static Process server;
    process_run(&server, argv);
    bool has_said = strstr(server.text[1], value) != NULL && strstr(server.text[1], bounds) != NULL;
    if (server.status != status || !has_said ||
        process_lines(server.text[1]) != (status == 2 ? 2 : 1)) // argp points to --help
        process_fail(&server, "not the one line, or another status");
}

static void options_out_of_range_are_refused_with_value_and_bounds(void** state)
{
    (void)state;
    for (size_t i = 0; i < sizeof out_of_range / sizeof *out_of_range; ++i) {
        const char* const* o = out_of_range[i];
        char said[80];
        snprintf(said, sizeof said, "%s %s: ", o[0], o[1]);
        run_and_expect(2, said, o[2], ARGS(SERVER, o[0], o[1]));
    }
}

// A key of a scene or of its simulation, a value that it must not have, and the bounds.
static const char* const out_of_range_in_scenes[][3] = {
    {"rate_hz", "0", "from 1 to 1000"},
    {"rate_hz", "1001", "from 1 to 1000"},
    {"substeps", "-1", "from 1 to 64"},
    {"substeps", "65", "from 1 to 64"},
    {"iterations", "-1", "from 0 to 64"},
    {"iterations", "1.5", "a whole number from 0 to 64"},
    {"stiffness_s2", "-1", "from 0 to 1e+06"},
    {"stiffness_s2", "10000000", "from 0 to 1e+06"},
    {"damping_per_s", "-0.5", "from 0 to 10000"},
    {"damping_per_s", "10001", "from 0 to 10000"},
    {"drag_per_s", "-0.5", "from 0 to 10000"},
    {"drag_per_s", "10001", "from 0 to 10000"},
    {"joint_damping_per_s", "-1", "from 0 to 1e+06"},
    {"joint_damping_per_s", "10000000", "from 0 to 1e+06"},
    {"down_share", "-0.5", "from 0 to 1"},
    {"upside_down_share", "1.5", "from 0 to 1"},
    {"down_share", "1.5", "from 0 to 1"},
    {"gravity_m_s2", "-1001", "from -1000 to 1000"},
    {"gravity_m_s2", "1001", "from -1000 to 1000"},
    {"pearl_radius_m", "-0.5", "from 0 to 1"},
    {"pearl_radius_m", "2", "from 0 to 1"},
    {"fall_off_per_m", "-1", "from 0 to 1e+06"},
    {"fall_off_per_m", "10000000", "from 0 to 1e+06"},
    {"fall_off_power", "-1", "from 0 to 3"},
    {"fall_off_power", "4", "from 0 to 3"},
    {"fall_off_power", "\"two\"", "from 0 to 3"},
};

static void a_scene_with_nan_is_no_json(void** state)
{
    (void)state;
    char path[64];
    DaemonOptions options = daemon_default();
    Fault fault = {0};
    assert_false(try_scene("{\n\"rate_hz\": NaN}", &options, path, &fault));
    unlink(path);
    assert_non_null(strstr(fault.text, ":2:"));
    assert_non_null(strstr(fault.text, "NaN"));
}

static void values_of_scenes_out_of_range_are_refused_with_value_and_bounds(void** state)
{
    (void)state;
    for (size_t i = 0; i < sizeof out_of_range_in_scenes / sizeof *out_of_range_in_scenes; ++i) {
        const char* const* o = out_of_range_in_scenes[i];
        char text[120], said[80], path[64];
        DaemonOptions options = daemon_default();
        Fault fault = {0};
        bool is_outside = i < 6;
        snprintf(text, sizeof text, "{%s\"%s\": %s%s}", is_outside ? "" : "\"simulation\": {", o[0],
                 o[1], is_outside ? "" : "}");
        snprintf(said, sizeof said, "\"%s\" is %s; it must be", o[0], o[1]);
        assert_false(try_scene(text, &options, path, &fault));
        unlink(path);
        if (strstr(fault.text, said) == NULL || strstr(fault.text, o[2]) == NULL)
            fail_msg("\"%s\" lacks \"%s\" or \"%s\"", fault.text, said, o[2]);
    }
}

// Where the field stands in the bytes of tuning_t, big-endian.
static const struct {
    const char* field;
    int at;
    float low, high;
} tuned_fields[] = {
    {"stiffness_s2", 21, 0, 1e6f},     {"damping_per_s", 25, 0, 1e4f},
    {"gravity_m_s2", 29, -1e3f, 1e3f}, {"drag_per_s", 33, 0, 1e4f},
    {"iterations", 37, 0, 64},         {"pearl_radius_m", 41, 0, 1},
};

static void expect_untaken(size_t field, float value)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    TuningMessage message = {.slot_count = 1, .set = TUNING_EVERY};
    char said[80];
    DaemonOptions options = options_for(&heard, "none");
    Daemon* daemon = create(&options, &heard);
    size_t size = tuning_encode(bytes, sizeof bytes, &message);
    bool is_whole = strcmp(tuned_fields[field].field, "iterations") == 0;
    if (is_whole)
        bytes_put_be32(bytes + tuned_fields[field].at, (uint32_t)(int32_t)value);
    else
        bytes_put_be_float(bytes + tuned_fields[field].at, value);
    daemon_receive(daemon, CHANNEL_TUNING, bytes, size);
    snprintf(said, sizeof said, "tuning: %s is %g: %g to %g", tuned_fields[field].field,
             (double)value, (double)tuned_fields[field].low, (double)tuned_fields[field].high);
    assert_int_equal(heard.notices, 1);
    assert_int_equal(daemon_status(daemon).rejected, 1);
    if (strstr(heard.notice, said) == NULL) fail_msg("\"%s\" lacks \"%s\"", heard.notice, said);
    daemon_destroy(daemon);
}

static void tuning_out_of_range_is_refused_with_value_and_bounds(void** state)
{
    (void)state;
    for (size_t i = 0; i < sizeof tuned_fields / sizeof *tuned_fields; ++i) {
        expect_untaken(i, tuned_fields[i].low - 1.0f);
        expect_untaken(i, tuned_fields[i].high + 1.0f);
        if (strcmp(tuned_fields[i].field, "iterations") != 0) expect_untaken(i, NAN);
    }
}

// What is stable depends on model, rate, substeps, damping and drag: 226144 1/s^2 is
// 2 (exp(-1 / 240) + exp(-8 / 240)) 240^2.
static const char* const unstable[][5] = {
    {"spring", "--stiffness", "230000", "stiffness_s2 is 230000;", "is stable to 226144:"},
    {"cascade", "--stiffness", "14200", "stiffness_s2 is 14200;", "is stable to 14134:"},
    {"cascade", "--rate", "1", "stiffness_s2 is 12000;", "is stable to 1.828:"},
    {"forest", "--stiffness", "56600", "stiffness_s2 is 56600;", "is stable to 56536:"},
    {"cascade-thesis", "--stiffness", "28300", "stiffness_s2 is 28300;", "is stable to 28268:"},
    {"forest-z", "--stiffness", "14500", "stiffness_s2 is 14500;", "is stable to 14400:"},
    {"forest-z", "--joint-damping", "121", "joint_damping_per_s is 121;", "is stable to 120:"},
};

static void options_beyond_stability_are_refused_or_forced(void** state)
{
    (void)state;
    static Process server;
    for (size_t i = 0; i < sizeof unstable / sizeof *unstable; ++i) {
        const char* const* u = unstable[i];
        run_and_expect(1, u[3], u[4], ARGS(SERVER, "--model", u[0], u[1], u[2], OFFLINE));
        process_run(&server, ARGS(SERVER, "--model", u[0], u[1], u[2], "--force", OFFLINE));
        process_expect(&server, 0);
        if (strstr(server.text[1], u[3]) == NULL || strstr(server.text[1], u[4]) == NULL ||
            strstr(server.text[1], "forced: strands will shake") == NULL)
            process_fail(&server, "forced without a word of what will happen");
    }
}

static void scenes_beyond_stability_are_refused_or_forced(void** state)
{
    (void)state;
    for (int force = 0; force < 2; ++force) {
        char path[64];
        Fault fault = {0};
        DaemonOptions options = options_for(&heard, "none");
        options.sim.force = force;
        assert_true(
            try_scene("{\"simulation\": {\"stiffness_s2\": 900000}}", &options, path, &fault));
        unlink(path);
        Daemon* daemon = daemon_create(&options, &fault);
        assert_int_equal(daemon != NULL, force);
        const char* said = force ? heard.notice : fault.text;
        assert_non_null(strstr(said, "stiffness_s2 is 900000; spring at 60 Hz and 4 substeps is "
                                     "stable to 226144: "));
        assert_non_null(strstr(said, force ? "forced: strands will shake" : "or --force it"));
        daemon_destroy(daemon);
    }
}

static void tuning_beyond_stability_is_refused_or_forced(void** state)
{
    (void)state;
    for (int force = 0; force < 2; ++force) {
        DaemonOptions options = options_for(&heard, "none");
        options.sim.force = force;
        Daemon* daemon = create(&options, &heard);
        for (int n = 0; n < 2; ++n) {
            send_tuning(daemon, (TuningMessage){.slot_count = 1024,
                                                .set = TUNING_STIFFNESS,
                                                .stiffness_s2 = 900000});
            tick(daemon, &heard);
        }
        assert_int_equal(heard.notices, 1);
        assert_int_equal(daemon_status(daemon).rejected, force ? 0 : 2);
        assert_non_null(strstr(heard.notice,
                               "stiffness_s2 is 900000; spring at 60 Hz and 4 substeps "
                               "is stable to 226144: "));
        assert_non_null(strstr(heard.notice, force ? "forced: strands will shake" : "--force it"));
        daemon_destroy(daemon);
    }
}

int main(void)
{
    process_setup();
    const struct CMUnitTest tests[] = {
        PROCESS_TEST(options_out_of_range_are_refused_with_value_and_bounds),
        cmocka_unit_test(a_scene_with_nan_is_no_json),
        cmocka_unit_test(values_of_scenes_out_of_range_are_refused_with_value_and_bounds),
        cmocka_unit_test(tuning_out_of_range_is_refused_with_value_and_bounds),
        PROCESS_TEST(options_beyond_stability_are_refused_or_forced),
        cmocka_unit_test(scenes_beyond_stability_are_refused_or_forced),
        cmocka_unit_test(tuning_beyond_stability_is_refused_or_forced),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
