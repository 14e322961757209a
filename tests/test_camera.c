// Where cameras stand, and where points land in their pictures.
#include "client/camera.h"
#include "client/extent.h"
#include "tests/drawing.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

static CameraOptions at(float yaw_deg, float pitch_deg)
{
    return (CameraOptions){.has_target = true,
                           .has_distance = true,
                           .target = {0.0f, 0.216f, 0.0f},
                           .distance_m = 0.7f,
                           .yaw_deg = yaw_deg,
                           .pitch_deg = pitch_deg,
                           .fov_deg = 45.0f};
}

static Camera orbit(CameraOptions options)
{
    Hairstyle* nobody = hairstyle_create();
    assert_non_null(nobody);
    Camera camera = camera_orbit(&options, nobody, 4.0f / 3.0f);
    hairstyle_destroy(nobody);
    return camera;
}

// Clip coordinates after division; .z the distance in front of the eye, m.
static Vec3d project(const Camera* camera, Vec3 p)
{
    double in[4] = {(double)p.x, (double)p.y, (double)p.z, 1}, eye[4] = {0}, clip[4] = {0};
    for (int r = 0; r < 4; ++r)
        for (int c = 0; c < 4; ++c)
            eye[r] += (double)camera->view.m[c][r] * in[c];
    for (int r = 0; r < 4; ++r)
        for (int c = 0; c < 4; ++c)
            clip[r] += (double)camera->projection.m[c][r] * eye[c];
    return (Vec3d){clip[0] / clip[3], clip[1] / clip[3], -eye[2]};
}

static void assert_near(double a, double b)
{
    if (!(fabs(a - b) <= 1e-4)) fail_msg("%.7f is not %.7f", a, b);
}

static void assert_eye(const Camera* camera, double x, double y, double z)
{
    assert_near((double)camera->eye.x, x);
    assert_near((double)camera->eye.y, y);
    assert_near((double)camera->eye.z, z);
}

static void yaw_0_sees_the_face_and_yaw_90_stands_on_positive_x(void** state)
{
    (void)state;
    Camera front = orbit(at(0, 0)), side = orbit(at(90, 0)), back = orbit(at(180, 0));
    assert_eye(&front, 0, 0.216, 0.7);
    assert_eye(&side, 0.7, 0.216, 0);
    assert_eye(&back, 0, 0.216, -0.7);
    // From the front, the character's left (+X) is on the picture's right and up is up.
    assert_true(project(&front, vec3(0.1f, 0.216f, 0)).x > 0.1);
    assert_true(project(&front, vec3(0, 0.3f, 0)).y > 0.1);
    // From +X the face looks to the picture's left.
    assert_true(project(&side, vec3(0, 0.216f, 0.1f)).x < -0.1);
}

static void positive_pitch_stands_above_and_looks_down(void** state)
{
    (void)state;
    Camera above = orbit(at(0, 30)), below = orbit(at(0, -30));
    assert_eye(&above, 0, 0.216 + 0.35, 0.7 * 0.8660254);
    assert_eye(&below, 0, 0.216 - 0.35, 0.7 * 0.8660254);
    // What is nearer to the camera on the floor lies lower in the picture.
    assert_true(project(&above, vec3(0, 0.216f, 0.1f)).y < 0);
    assert_true(project(&below, vec3(0, 0.216f, 0.1f)).y > 0);
}

static void target_is_in_the_middle_at_the_distance(void** state)
{
    (void)state;
    for (int yaw = -180; yaw <= 360; yaw += 30)
        for (int pitch = -90; pitch <= 90; pitch += 15) {
            Camera camera = orbit(at((float)yaw, (float)pitch));
            Vec3d middle = project(&camera, vec3(0, 0.216f, 0));
            assert_near(middle.x, 0);
            assert_near(middle.y, 0);
            assert_near(middle.z, 0.7);
        }
}

// Straight up and down are limits of the orbit, not jumps.
static void orbit_is_continuous_over_the_poles(void** state)
{
    (void)state;
    for (int yaw = 0; yaw < 360; yaw += 45)
        for (int sign = -1; sign <= 1; sign += 2) {
            Camera near = orbit(at((float)yaw, (float)sign * 88.9f));
            Camera pole = orbit(at((float)yaw, (float)sign * 90.0f));
            for (int i = 0; i < 16; ++i) {
                double a = (double)near.view.m[i / 4][i % 4], b = (double)pole.view.m[i / 4][i % 4];
                if (fabs(a - b) > 0.03)
                    fail_msg("yaw %d pitch %d: the picture jumps", yaw, 90 * sign);
            }
        }
}

// The path-traced reference's three-quarter view: shared/assets/reference/scene.json.
static void three_quarter_view_equals_the_references(void** state)
{
    (void)state;
    static const double view[3][4] = {{0.819152, 0.0, -0.5735764, 0.0},
                                      {-0.0499905, 0.9961947, -0.0713938, 0.0},
                                      {0.5713938, 0.0871557, 0.8160349, -0.7}};
    static const Vec3 points[] = {{0, 0.216f, 0},
                                  {0.07f, 0.11f, 0.09f},
                                  {-0.08f, 0.3f, -0.05f},
                                  {0.02f, 0.32f, 0.01f},
                                  {0.05f, -0.1f, -0.12f}};
    Camera camera = orbit(at(35, 5));
    assert_eye(&camera, 0.3999757, 0.277009, 0.5712244);
    for (size_t i = 0; i < sizeof points / sizeof *points; ++i) {
        double from[4] = {(double)points[i].x, (double)points[i].y - 0.216, (double)points[i].z, 1};
        double eye[3] = {0};
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 4; ++c)
                eye[r] += view[r][c] * from[c];
        Vec3d ours = project(&camera, points[i]);
        assert_near(ours.z, -eye[2]);
        assert_near(ours.x, 1.8106602 * eye[0] / -eye[2]); // projection_gl_row_major
        assert_near(ours.y, 2.4142136 * eye[1] / -eye[2]);
    }
}

static void field_of_view_is_vertical(void** state)
{
    (void)state;
    CameraOptions options = at(0, 0);
    options.fov_deg = 60;
    Camera camera = orbit(options);
    double edge = 0.7 * 0.57735027; // tan 30
    assert_near(project(&camera, vec3(0, (float)(0.216 + edge), 0)).y, 1);
    assert_near(project(&camera, vec3((float)edge, 0.216f, 0)).x, 0.75);
}

static void default_distance_holds_the_style_at_rest(void** state)
{
    (void)state;
    static const char* const names[] = {"long", "bob", "ponytail"};
    static const float aspects[] = {0.5f, 1.0f, 4.0f / 3.0f, 2.4f};
    for (int s = 0; s < 3; ++s) {
        Hairstyle* style = drawing_style(names[s]);
        if (style == NULL) continue;
        double most = 0;
        for (int a = 0; a < 4; ++a)
            for (int yaw = 0; yaw < 360; yaw += 45)
                for (int pitch = -75; pitch <= 75; pitch += 25) {
                    CameraOptions options = camera_default();
                    options.yaw_deg = (float)yaw;
                    options.pitch_deg = (float)pitch;
                    Camera camera = camera_orbit(&options, style, aspects[a]);
                    for (int i = 0; i < style->guide_count * style->nodes; ++i) {
                        Vec3d p = project(&camera, style->rest[i]);
                        assert_true(p.z > 0.02);
                        most = fmax(most, fmax(fabs(p.x), fabs(p.y)));
                    }
                }
        printf("%s: the outermost node lies at %.3f of the picture's half\n", names[s], most);
        assert_true(most <= 1.0);
        assert_true(most >= 0.7); // not lost in the middle either
        hairstyle_destroy(style);
    }
}

static void default_target_is_the_heads_centre(void** state)
{
    (void)state;
    Hairstyle* style = drawing_style("bob");
    style->head_centre = vec3(0.5f, 1.0f, -2.0f);
    CameraOptions options = camera_default();
    Camera camera = camera_orbit(&options, style, 1.0f);
    Vec3d middle = project(&camera, style->head_centre);
    assert_near(middle.x, 0);
    assert_near(middle.y, 0);
    hairstyle_destroy(style);
}

// What is outside an extent is not drawn: it may not miss any point of the box.
static void extents_hold_all_of_a_box_and_little_else(void** state)
{
    (void)state;
    const Box box = {{-0.2f, -0.3f, -0.15f}, {0.25f, 0.35f, 0.2f}};
    const int width = 640, height = 480;
    for (int view = 0; view < 60; ++view) {
        CameraOptions options = at(37.0f * (float)view, 80.0f * sinf((float)view));
        options.distance_m = 0.9f + 0.1f * (float)view;
        Camera camera = orbit(options);
        Mat4 both = matrix_mul(&camera.projection, &camera.view);
        Extent e = extent_seen(&both, box, width, height);
        double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9}, size[2] = {width, height};
        for (int i = 0; i < 1331; ++i) {
            float u[3] = {(float)(i % 11) / 10.0f, (float)(i / 11 % 11) / 10.0f,
                          (float)(i / 121) / 10.0f};
            Vec3 part = {u[0] * (box.high.x - box.low.x), u[1] * (box.high.y - box.low.y),
                         u[2] * (box.high.z - box.low.z)};
            Vec3d seen = project(&camera, vec3_add(box.low, part));
            double at_px[2] = {(seen.x * 0.5 + 0.5) * width, (seen.y * 0.5 + 0.5) * height};
            for (int a = 0; a < 2; ++a) {
                double inside = fmin(fmax(at_px[a], 0.0), size[a]);
                low[a] = fmin(low[a], inside), high[a] = fmax(high[a], inside);
            }
        }
        assert_true(e.x <= low[0] && e.x + e.width >= high[0] && e.x >= 0);
        assert_true(e.y <= low[1] && e.y + e.height >= high[1] && e.y >= 0);
        assert_true(e.width <= high[0] - low[0] + 8 && e.height <= high[1] - low[1] + 8);
    }
    CameraOptions within = at(0.0f, 0.0f);
    within.distance_m = 0.1f; // the eye is in the box
    Camera camera = orbit(within);
    Mat4 both = matrix_mul(&camera.projection, &camera.view);
    Extent all = extent_seen(&both, box, width, height);
    assert_true(all.x == 0 && all.y == 0 && all.width == width && all.height == height);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(yaw_0_sees_the_face_and_yaw_90_stands_on_positive_x),
        cmocka_unit_test(positive_pitch_stands_above_and_looks_down),
        cmocka_unit_test(target_is_in_the_middle_at_the_distance),
        cmocka_unit_test(orbit_is_continuous_over_the_poles),
        cmocka_unit_test(three_quarter_view_equals_the_references),
        cmocka_unit_test(field_of_view_is_vertical),
        cmocka_unit_test(default_distance_holds_the_style_at_rest),
        cmocka_unit_test(default_target_is_the_heads_centre),
        cmocka_unit_test(extents_hold_all_of_a_box_and_little_else),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
