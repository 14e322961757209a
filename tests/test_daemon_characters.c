// Who is in a daemon: characters that come and go, styles, scenes, strands put back.
#include "tests/daemon.h"

static void characters_come_and_go(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "none");
    Daemon* daemon = create(&options, &heard);
    send_character(daemon, 2, CHARACTER_ADD, "");
    send_character(daemon, 0, CHARACTER_REMOVE, "");
    tick(daemon, &heard);
    assert_int_equal(heard.rows[0][0], 0);
    assert_int_equal(heard.rows[2][0], 1);
    int segment = heard.frame[2].segment;
    send_character(daemon, 2, CHARACTER_REMOVE, "");
    tick(daemon, &heard);
    assert_int_equal(daemon_status(daemon).characters, 0);
    send_character(daemon, 2, CHARACTER_ADD, "long");
    tick(daemon, &heard);
    assert_true(heard.frame[2].segment > segment);
    daemon_destroy(daemon);
}

// A daemon with two styles, moving hair in slot 1.
static Daemon* create_with_two_styles(void)
{
    char path[64];
    DaemonOptions options = options_for(&heard, "shake");
    assert_true(try_scene("{\"styles\": [{\"name\": \"hers\", \"builtin\": \"long\"},\n"
                          "            {\"name\": \"his\", \"builtin\": \"bob\"}],\n"
                          " \"characters\": [{\"slot\": 1, \"style\": \"hers\"}]}",
                          &options, path, NULL));
    Daemon* daemon = create(&options, &heard);
    unlink(path);
    return daemon;
}

static uint64_t hash_after_adds(const char* style)
{
    Daemon* daemon = create_with_two_styles();
    tick(daemon, &heard);
    int segment = heard.frame[1].segment;
    for (int n = 0; n < 40; ++n) {
        if (style != NULL && n % 10 == 5) send_character(daemon, 1, CHARACTER_ADD, style);
        tick(daemon, &heard);
    }
    assert_int_equal(heard.frame[1].segment, segment);
    assert_int_equal(daemon_status(daemon).rejected, 0);
    uint64_t hash = daemon_state_hash(daemon);
    daemon_destroy(daemon);
    return hash;
}

static void adding_what_is_worn_changes_nothing(void** state)
{
    (void)state;
    uint64_t hash = hash_after_adds(NULL);
    assert_true(hash_after_adds("hers") == hash);
    assert_true(hash_after_adds("") == hash); // the first style by no name
}

static void adding_another_style_changes_it(void** state)
{
    (void)state;
    Daemon* daemon = create_with_two_styles();
    tick(daemon, &heard);
    FrameHeader before = heard.frame[1];
    send_character(daemon, 1, CHARACTER_ADD, "his");
    tick(daemon, &heard);
    assert_true(heard.frame[1].style_hash != before.style_hash);
    assert_true(heard.frame[1].segment > before.segment);
    daemon_destroy(daemon);
}

// A sender's add may be a second later than its poses: LCM keeps nothing for who starts late.
static void poses_may_come_a_second_before_their_character(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "bus");
    options.characters = 0;
    Daemon* daemon = create(&options, &heard);
    for (int n = 0; n < 70; ++n) {
        send_pose_of(daemon, n / 60.0, 0.0, 0.0, 0, POSE_FOLLOW);
        tick(daemon, &heard);
    }
    assert_int_equal(heard.notices, 0);
    assert_int_equal(daemon_status(daemon).rejected, 70);
    send_character(daemon, 0, CHARACTER_ADD, "");
    send_pose_of(daemon, 2.0, 0.0, 0.0, 0, POSE_FOLLOW);
    tick(daemon, &heard);
    assert_int_equal(heard.notices, 0);
    assert_int_equal(daemon_status(daemon).rejected, 70);
    send_character(daemon, 0, CHARACTER_REMOVE, "");
    for (int n = 0; n < 100; ++n) {
        send_pose_of(daemon, 3.0 + n / 60.0, 0.0, 0.0, 0, POSE_FOLLOW);
        tick(daemon, &heard);
    }
    assert_int_equal(heard.notices, 1); // nobody adds it
    assert_non_null(strstr(heard.notice, "without a character"));
    daemon_destroy(daemon);
}

static void a_simulation_that_no_character_could_have_is_refused_without_one(void** state)
{
    (void)state;
    Fault fault = {0};
    DaemonOptions options = options_for(&heard, "none");
    options.characters = 0;
    options.sim.stiffness_s2 = 1e6f;
    assert_null(daemon_create(&options, &fault));
    assert_non_null(strstr(fault.text, "stiffness_s2"));
}

static void an_unknown_style_is_told_the_known_ones(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "none");
    Daemon* daemon = create(&options, &heard);
    for (int i = 0; i < 3; ++i)
        send_character(daemon, 1, CHARACTER_ADD, "mullet");
    tick(daemon, &heard);
    assert_int_equal(heard.notices, 1);
    assert_non_null(strstr(heard.notice, "mullet"));
    assert_non_null(strstr(heard.notice, "long"));
    assert_int_equal(daemon_status(daemon).characters, 1);
    assert_int_equal(daemon_status(daemon).rejected, 3);
    daemon_destroy(daemon);
}

static void lost_strands_are_put_back_told_once_and_counted(void** state)
{
    (void)state;
    DaemonOptions options = options_for(&heard, "shake");
    options.sim.stiffness_s2 = 1e6f;
    options.sim.force = true;
    options.sim.iterations = 0;
    Daemon* daemon = create(&options, &heard);
    for (int n = 0; n < 240; ++n) {
        tick(daemon, &heard);
        daemon_publish_background(daemon, 16667);
    }
    assert_int_equal(heard.notices, 1);
    assert_non_null(strstr(heard.notice, "character 0"));
    assert_in_range(daemon_status(daemon).quarantined, 65, 240 * 64);
    assert_in_range(heard.status.quarantined, 64, daemon_status(daemon).quarantined);
    int64_t before = daemon_status(daemon).quarantined;
    send_character(daemon, 0, CHARACTER_REMOVE, "");
    tick(daemon, &heard);
    assert_int_equal(daemon_status(daemon).quarantined, before);
    assert_int_equal(daemon_status(daemon).rejected, 0);
    daemon_destroy(daemon);
}

static void a_scene_says_styles_characters_and_physics(void** state)
{
    (void)state;
    char path[64];
    DaemonOptions options = options_for(&heard, "none");
    assert_true(try_scene("{\"rate_hz\": 50, \"substeps\": 2,\n"
                          " \"simulation\": {\"stiffness_s2\": 300, \"fall_off_power\": 1,\n"
                          "   \"collide\": \"segment\", \"length\": \"direct\"},\n"
                          " \"styles\": [{\"name\": \"hers\", \"builtin\": \"long\"},\n"
                          "            {\"name\": \"his\", \"builtin\": \"bob\"}],\n"
                          " \"characters\": [{\"slot\": 3, \"style\": \"his\",\n"
                          "   \"motion\": \"nod\", \"position\": [1, 0, -2]}, {\"slot\": 1}]}",
                          &options, path, NULL));
    assert_true(options.sim.rate_hz == 50.0 && options.sim.stiffness_s2 == 300.0f);
    assert_int_equal(options.sim.collide, COLLIDE_SEGMENT);
    assert_int_equal(options.sim.length, LENGTH_DIRECT);
    Daemon* daemon = create(&options, &heard);
    unlink(path);
    tick(daemon, &heard);
    assert_int_equal(daemon_status(daemon).styles, 2);
    assert_int_equal(daemon_status(daemon).characters, 2);
    assert_string_equal(daemon_status(daemon).style, "hers");
    assert_int_equal(heard.rows[3][0], 1);
    assert_true(heard.frame[3].pose.position.x == 1.0);
    assert_true(heard.frame[1].style_hash != heard.frame[3].style_hash);
    daemon_destroy(daemon);
}

static void a_wrong_scene_names_line_and_column(void** state)
{
    (void)state;
    const char* wrong[][2] = {
        {"{\n  \"rate_hz\": 60,,\n}", ":2:"},
        {"{\n  \"rate\": 60\n}", ":2:3: unknown key \"rate\""},
        {"{\"simulation\": {\"stiffness_s2\": 400,\n \"damping\": 3}}", ":2:2: unknown key"},
        {"{\"styles\": [{\"name\": \"a\", \"builtin\": \"long\"},\n {\"name\": \"b\"}]}", ":2:2:"},
        {"{\"styles\": [{\"name\": \"a\",\n  \"builtin\": 3}]}", ":2:3:"},
        {"{\"characters\": [{\"slot\": 0}, {\"slot\": 1},\n    {\"slot\": 5000}]}", ":2:6:"},
        {"{\"characters\": [{\"slot\": 0},\n {\"slot\": 0}]}", ":2:2: this slot"},
        {"{\"characters\": [{\"slot\": 0,\n\"position\": [1, 2, \"x\"]}]}", ":2:20:"},
        {"{\"characters\": [{\"slot\": 0, \"motion\": \"hop\"}]}", ":1:29:"},
        {"{\"characters\": [{\"slot\": 0,\n\"position\": [1, 2, 1e9]}]}", "-1e+08 to 1e+08"},
        {"{\"styles\": [{\"name\": \"\xc3\xa9\", \"builtin\": \"bob\"}]}", ":1:14: \"name\""},
        {"{\"styles\": [{\"name\": \"a\", \"files\": [3]}]}", "\"files\"[0] must be a text"},
        {"{\"styles\": {}}", "\"styles\" must be a list"},
        {"{\"styles\": [\"bob\"]}", "\"styles\"[0] must be an object"},
        {"{\"simulation\": {\"collide\": \"beads\"}}",
         "\"collide\" must be one of point pearl segment"},
        {"{\"simulation\": {\"length\": 3}}", "\"length\" must be one of sweeps direct"},
        {"{\"simulation\": 3}", "\"simulation\" must be an object"},
        {"{\"characters\": 3}", ":1:2:"},
        {"{\"substeps\": 2.5}", ":1:2:"},
        {"[]", ":1:1:"},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
        char path[64];
        Fault fault = {0};
        DaemonOptions options = options_for(&heard, "none");
        assert_false(try_scene(wrong[i][0], &options, path, &fault));
        unlink(path);
        if (strstr(fault.text, wrong[i][1]) == NULL || strstr(fault.text, path) == NULL)
            fail_msg("\"%s\" lacks \"%s\"", fault.text, wrong[i][1]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(characters_come_and_go),
        cmocka_unit_test(adding_what_is_worn_changes_nothing),
        cmocka_unit_test(adding_another_style_changes_it),
        cmocka_unit_test(poses_may_come_a_second_before_their_character),
        cmocka_unit_test(a_simulation_that_no_character_could_have_is_refused_without_one),
        cmocka_unit_test(an_unknown_style_is_told_the_known_ones),
        cmocka_unit_test(lost_strands_are_put_back_told_once_and_counted),
        cmocka_unit_test(a_scene_says_styles_characters_and_physics),
        cmocka_unit_test(a_wrong_scene_names_line_and_column),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
