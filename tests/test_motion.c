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
    const char* names[] = {"none", "nod", "shake", "turn"};
    for (int k = 0; k < 4; ++k)
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
    const char* names[] = {"none", "bus", "nod", "shake", "run", "turn", "teleport"};
    for (int i = 0; i < 7; ++i)
        assert_string_equal(motion_find(names[i])->name, names[i]);
    assert_null(motion_find("bus")->at);
    assert_null(motion_find("flip"));
    assert_null(motion_find(""));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(amplitudes_are_those_of_the_clips),
        cmocka_unit_test(positive_nods_look_down_first),
        cmocka_unit_test(the_neck_stays_where_it_is),
        cmocka_unit_test(nothing_jumps_but_the_teleport),
        cmocka_unit_test(a_teleport_is_a_metre_carried_every_two_seconds),
        cmocka_unit_test(clips_end_in_two_seconds_of_rest),
        cmocka_unit_test(names_are_found_and_others_are_not),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
