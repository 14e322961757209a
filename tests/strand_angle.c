#include "tests/strand_angle.h"

#include "messages/drawn.h"

#include <math.h>
#include <stdlib.h>

#define STEP_PIXELS 0.5f

typedef struct Canvas {
    const Camera* camera;
    Mat4 matrix;
    Vec3 towards_light;
    int width, height;
    float *depth, *angle;
} Canvas;

// Pixels from the left and from the top, and the depth in clip space; false behind the camera.
static bool project(const Canvas* canvas, Vec3 p, float out[3])
{
    float clip[4];
    for (int row = 0; row < 4; ++row)
        clip[row] = canvas->matrix.m[0][row] * p.x + canvas->matrix.m[1][row] * p.y +
                    canvas->matrix.m[2][row] * p.z + canvas->matrix.m[3][row];
    if (clip[3] <= 0.0f) return false;
    out[0] = (clip[0] / clip[3] * 0.5f + 0.5f) * (float)canvas->width;
    out[1] = (0.5f - clip[1] / clip[3] * 0.5f) * (float)canvas->height;
    out[2] = clip[2] / clip[3];
    return true;
}

static float inclination(Vec3 tangent, Vec3 towards)
{
    return asinf(fmaxf(-1.0f, fminf(1.0f, vec3_dot(tangent, towards))));
}

static void put(const Canvas* canvas, const float at[3], float angle)
{
    int x = (int)floorf(at[0]), y = (int)floorf(at[1]);
    if (x < 0 || y < 0 || x >= canvas->width || y >= canvas->height) return;
    int i = y * canvas->width + x;
    if (at[2] >= canvas->depth[i]) return;
    canvas->depth[i] = at[2];
    canvas->angle[i] = angle;
}

static void draw_link(const Canvas* canvas, Vec3 from, Vec3 to)
{
    float a[3], b[3];
    if (!project(canvas, from, a) || !project(canvas, to, b)) return;
    Vec3 tangent = vec3_normalise_or(vec3_sub(to, from), vec3(0, -1, 0));
    Vec3 middle = vec3_scale(vec3_add(from, to), 0.5f);
    Vec3 view = vec3_normalise_or(vec3_sub(canvas->camera->eye, middle), vec3(0, 0, 1));
    float angle = 0.5f * (inclination(tangent, view) + inclination(tangent, canvas->towards_light));
    float reach = fmaxf(fabsf(b[0] - a[0]), fabsf(b[1] - a[1]));
    int steps = 1 + (int)fminf(reach / STEP_PIXELS, 4096.0f);
    for (int i = 0; i < steps; ++i) {
        float t = ((float)i + 0.5f) / (float)steps;
        const float at[3] = {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]),
                             a[2] + t * (b[2] - a[2])};
        put(canvas, at, angle);
    }
}

static void draw_set(const Canvas* canvas, const Hairstyle* style, const StrandSet* set,
                     const Vec3* tangents)
{
    for (int s = 0; s < set->strand_count; ++s) {
        Vec3 before = {0, 0, 0};
        for (int k = 0; k < set->points; ++k) {
            DrawnPoint point;
            drawn_from_bound(&point, style, set, s, k);
            Vec3 at = vec3_from(
                drawn_position(&point, style->nodes, style->rest, tangents, tangents, NULL));
            if (k > 0) draw_link(canvas, before, at);
            before = at;
        }
    }
}

float* strand_angles(const Hairstyle* style, const Camera* camera, Vec3 towards_light, int width,
                     int height)
{
    size_t pixels = (size_t)width * (size_t)height;
    Vec3* tangents = hairstyle_rest_tangents(style);
    Canvas canvas = {.camera = camera,
                     .matrix = matrix_mul(&camera->projection, &camera->view),
                     .towards_light = towards_light,
                     .width = width,
                     .height = height,
                     .depth = malloc(pixels * sizeof(float)),
                     .angle = malloc(pixels * sizeof(float))};
    if (tangents == NULL || canvas.depth == NULL || canvas.angle == NULL) {
        free(canvas.angle);
        canvas.angle = NULL;
    } else {
        for (size_t i = 0; i < pixels; ++i)
            canvas.depth[i] = INFINITY, canvas.angle[i] = NAN;
        for (int i = 0; i < style->set_count; ++i)
            if (style->sets[i].kind == STRANDS_EXPLICIT)
                draw_set(&canvas, style, &style->sets[i], tangents);
    }
    free(canvas.depth);
    free(tangents);
    return canvas.angle;
}
