// Head motions: the amplitudes of notes/simulation.md section 3, continuity, rest.
#include "messages/control.h"
#include "server/motion.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static double angle(Quat q)
{
    return 2.0 * atan2(sqrt(q.x * q.x + q.y * q.y + q.z * q.z), fabs(q.w));
}

static double largest_angle(const char* name)
{
    double largest = 0.0;
    for (int i = 0; i < 4000; ++i)
        largest = fmax(largest, angle(motion_find(name)->at(i * 1e-3).pose.orientation));
    return largest;
}

static void amplitudes_are_those_of_the_clips(void** state)
{
    (void)state;
    assert_float_equal(largest_angle("nod"), 0.52, 0.01);
    assert_float_equal(largest_angle("shake"), 0.80, 0.01);
    assert_float_equal(largest_angle("run"), 0.08, 1e-4);
    assert_true(largest_angle("none") == 0.0);
    assert_float_equal(motion_find("run")->at(10.0).pose.position.z, 35.0, 1e-6);
    assert_float_equal(largest_angle("flip"), 3.14159265, 1e-6);
    assert_true(largest_angle("gust") == 0.0);
}

static void a_jump_stop_walks_stops_dead_jumps_and_lands_dead(void** state)
{
    (void)state;
    MotionFunction at = motion_find("jump-stop")->at;
    double highest = 0.0;
    assert_float_equal(at(0.5).pose.position.z, 0.75, 1e-9);
    for (double t = 1.0; t < 6.0; t += 0.01) {
        assert_float_equal(at(t).pose.position.z, 1.5, 1e-9);
        highest = fmax(highest, at(t).pose.position.y);
        if (t < 3.0 || t > 3.62) assert_true(at(t).pose.position.y == 0.0);
    }
    assert_float_equal(highest, 0.4587, 1e-3);
    assert_float_equal(at(7.0).pose.position.z, 3.0, 1e-9); // a loop goes on where it stopped
}

static void a_flip_holds_upside_down_and_goes_on_over(void** state)
{
    (void)state;
    MotionFunction at = motion_find("flip")->at;
    for (double t = 0.5; t < 3.5; t += 0.01)
        assert_true(quat_rotate(at(t).pose.orientation, (Vec3d){0, 1, 0}).y < -0.999999);
    for (double t = 4.0; t < 6.0; t += 0.01)
        assert_true(angle(at(t).pose.orientation) == 0.0);
    // Over by the face both times.
    assert_true(quat_rotate(at(0.2).pose.orientation, (Vec3d){0, 0, 1}).y < -0.1);
    assert_true(quat_rotate(at(3.7).pose.orientation, (Vec3d){0, 0, 1}).y > 0.1);
}

static void only_the_gust_blows_and_then_rests(void** state)
{
    (void)state;
    for (const Motion* motion = motions; motion->name != NULL; ++motion) {
        double most = 0.0;
        for (int i = 0; motion->at != NULL && i < 8000; ++i) {
            Vec3d wind = motion->at(i * 1e-3).wind;
            assert_true(wind.y == 0.0 && wind.z == 0.0 && wind.x >= 0.0);
            if (i % 4000 >= 1500) assert_true(wind.x == 0.0);
            most = fmax(most, wind.x);
        }
        bool blows = strcmp(motion->name, "gust") == 0;
        assert_true(blows ? most > 8.0 && most < 8.0 * 1.4 : most == 0.0);
    }
}

static void positive_nods_look_down_first(void** state)
{
    (void)state;
    Vec3d face = quat_rotate(motion_find("nod")->at(0.2).pose.orientation, (Vec3d){0, 0, 1});
    assert_true(face.y < -0.1);
}

static void the_neck_stays_where_it_is(void** state)
{
    (void)state;
    const Vec3d neck = {0, 0.066, 0};
    const char* names[] = {"none", "nod", "shake", "turn", "flip", "gust"};
    for (int k = 0; k < 6; ++k)
        for (int i = 0; i < 400; ++i) {
            Pose pose = motion_find(names[k])->at(i * 0.01).pose;
            Vec3d at = vec3d_add(pose.position, quat_rotate(pose.orientation, neck));
            assert_true(vec3d_dot(vec3d_sub(at, neck), vec3d_sub(at, neck)) < 1e-24);
        }
}

static void nothing_jumps_but_the_teleport(void** state)
{
    (void)state;
    for (const Motion* motion = motions; motion->name != NULL; ++motion) {
        if (motion->at == NULL) continue;
        MotionState before = motion->at(-1e-3);
        for (int i = 0; i < 17000; ++i) {
            MotionState now = motion->at(i * 1e-3);
            Vec3d move = vec3d_sub(now.pose.position, before.pose.position);
            double turn =
                angle(quat_mul(now.pose.orientation, quat_conjugate(before.pose.orientation)));
            bool jumped = vec3d_dot(move, move) > 0.02 * 0.02 || turn > 0.07;
            assert_int_equal(jumped, now.segment > before.segment);
            before = now;
        }
    }
}

static void a_teleport_is_a_metre_carried_every_two_seconds(void** state)
{
    (void)state;
    MotionFunction at = motion_find("teleport")->at;
    assert_int_equal(at(1.999).segment, 0);
    assert_int_equal(at(2.0).segment, 1);
    assert_int_equal(at(5.0).segment, 2);
    assert_int_equal(at(2.0).verb, POSE_CARRY);
    assert_true(at(2.0).pose.position.x - at(1.9).pose.position.x == 1.0);
    assert_true(at(4.0).pose.position.x == 0.0);
}

static void clips_end_in_two_seconds_of_rest(void** state)
{
    (void)state;
    const char* names[] = {"nod", "shake"};
    for (int k = 0; k < 2; ++k)
        for (double t = 2.0; t < 4.0; t += 0.01)
            assert_true(angle(motion_find(names[k])->at(t).pose.orientation) == 0.0);
}

static void names_are_found_and_others_are_not(void** state)
{
    (void)state;
    const char* names[] = {"none", "bus",  "nod",  "shake",    "jump-stop",
                           "run",  "flip", "turn", "teleport", "gust"};
    for (int i = 0; i < 10; ++i)
        assert_string_equal(motion_find(names[i])->name, names[i]);
    assert_null(motion_find("bus")->at);
    assert_null(motion_find("hop"));
    assert_null(motion_find(""));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(amplitudes_are_those_of_the_clips),
        cmocka_unit_test(a_jump_stop_walks_stops_dead_jumps_and_lands_dead),
        cmocka_unit_test(a_flip_holds_upside_down_and_goes_on_over),
        cmocka_unit_test(only_the_gust_blows_and_then_rests),
        cmocka_unit_test(positive_nods_look_down_first),
        cmocka_unit_test(the_neck_stays_where_it_is),
        cmocka_unit_test(nothing_jumps_but_the_teleport),
        cmocka_unit_test(a_teleport_is_a_metre_carried_every_two_seconds),
        cmocka_unit_test(clips_end_in_two_seconds_of_rest),
        cmocka_unit_test(names_are_found_and_others_are_not),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
