#include "client/draw.h"

#include "client/extent.h"
#include "client/fibres.h"
#include "messages/quantise.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

const char* const draw_pass_names[PASSES] = {"upload", "update", "shadow",
                                             "light",  "shade",  "read"};

static bool create_shadows(Drawing* drawing, const ShadowOptions* options, Fault* fault)
{
    const Gl* gl = drawing->gl;
    ShadowOptions smaller = shadow_smaller(options);
    if (!shadow_create(&drawing->shadow, gl, options, drawing->fibres, fault)) return false;
    for (int i = 0; options->all_lights && i < 2; ++i)
        if (!shadow_create(&drawing->others[i], gl, &smaller, drawing->fibres, fault)) return false;
    return true;
}

bool draw_create(Drawing* drawing, const Gl* gl, const ShadeOptions* options,
                 const CameraOptions* camera, Fault* fault)
{
    memset(drawing, 0, sizeof *drawing);
    drawing->gl = gl;
    drawing->options = *options;
    drawing->camera = *camera;
    drawing->times = calloc(1, sizeof *drawing->times);
    drawing->fibres = fibres_create(gl, fault);
    ShadowOptions shadow = options->shadow;
    shadow.evaluated = update_paths[options->update].evaluated;
    if (drawing->times != NULL && drawing->fibres != 0 && create_shadows(drawing, &shadow, fault) &&
        light_create(&drawing->light, gl, &options->shading, &drawing->shadow, fault) &&
        shade_create(&drawing->shade, gl, options, &drawing->shadow, fault))
        return true;
    draw_free(drawing);
    return false;
}

void draw_free(Drawing* drawing)
{
    const Gl* gl = drawing->gl;
    hair_free(&drawing->hair, gl);
    shade_free(&drawing->shade, gl);
    light_free(&drawing->light, gl);
    shadow_free(&drawing->shadow, gl);
    for (int i = 0; i < 2; ++i)
        shadow_free(&drawing->others[i], gl);
    gl->DeleteTextures(1, &drawing->fibres);
    free(drawing->times);
    memset(drawing, 0, sizeof *drawing);
}

bool draw_set_style(Drawing* drawing, const Hairstyle* style, uint64_t hash, int version,
                    Fault* fault)
{
    if (drawing->has_style && hash == drawing->style_hash && version == drawing->style_version)
        return true;
    Hair hair;
    Lod lod = drawing->options.lod;
    if (!hair_create(&hair, drawing->gl, style, lod, drawing->options.update, fault))
        return false; // keep the old one
    if (!light_fit(&drawing->light, drawing->gl, &hair.update, fault)) {
        hair_free(&hair, drawing->gl);
        return false;
    }
    if (drawing->options.has_colour) shading_colour(drawing->options.colour, &hair.material);
    hair_free(&drawing->hair, drawing->gl);
    drawing->hair = hair;
    drawing->still = extent_still(&hair);
    drawing->stray_m = extent_stray(&hair.ribbons);
    drawing->style_hash = hash;
    drawing->style_version = version;
    drawing->has_style = drawing->moved = true;
    return true;
}

void draw_set_camera(Drawing* drawing, const CameraOptions* camera)
{
    drawing->camera = *camera;
    drawing->looked = true;
}

void draw_set_light(Drawing* drawing, float yaw_deg, float pitch_deg)
{
    shade_set_light(&drawing->shade, yaw_deg, pitch_deg);
    drawing->lit = true;
}

// What the hair fills, head-relative world axes and along a light: the guides of the newest rows,
// widened by what strands stray from them.
static void find_bounds(const Drawing* drawing, const GuidesView* view, Vec3 light, Frame* frame)
{
    const Hairstyle* style = drawing->hair.style;
    const float *r = frame->rotation, margin_m = 0.03f;
    Vec3 margin = {margin_m, margin_m, margin_m};
    Box box = {vec3(1e9f, 1e9f, 1e9f), vec3(-1e9f, -1e9f, -1e9f)};
    float low = 1e9f, high = -1e9f;
    for (int row = 0; row < style->guide_count; ++row) {
        int layer = view->row_tick[1][row] > view->row_tick[0][row];
        for (int n = 0; n < style->nodes; ++n) {
            int i = row * style->nodes + n;
            Vec3 p = style->rest[i];
            if (view->row_tick[layer][row] >= 0)
                p = dequantise_position(view->positions[layer] + 3 * i, &style->box);
            p = vec3(r[0] * p.x + r[1] * p.y + r[2] * p.z, r[3] * p.x + r[4] * p.y + r[5] * p.z,
                     r[6] * p.x + r[7] * p.y + r[8] * p.z);
            box.low = vec3_min(box.low, p);
            box.high = vec3_max(box.high, p);
            low = fminf(low, vec3_dot(p, light));
            high = fmaxf(high, vec3_dot(p, light));
        }
    }
    frame->bounds = (Box){vec3_sub(box.low, margin), vec3_add(box.high, margin)};
    frame->drawn = frame->bounds;
    Vec3 stray = {drawing->stray_m, drawing->stray_m, drawing->stray_m};
    if (style->guide_count > 0)
        frame->drawn =
            (Box){vec3_sub(frame->bounds.low, stray), vec3_add(frame->bounds.high, stray)};
    if (drawing->still.low.x <= drawing->still.high.x)
        frame->drawn = box_join(frame->drawn, box_rotate(drawing->still, r));
    frame->lit_low_m = low - margin_m;
    frame->lit_high_m = high + margin_m;
}

typedef struct PassClock {
    int64_t us, processor_us;
} PassClock;

static PassClock read_clocks(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (PassClock){base_monotonic_us(), (int64_t)t.tv_sec * 1000000 + t.tv_nsec / 1000};
}

static PassClock begin_pass(const Drawing* drawing)
{
    return drawing->timed ? read_clocks() : (PassClock){0, 0};
}

static void end_pass(Drawing* drawing, int pass, PassClock began)
{
    if (!drawing->timed) return;
    drawing->gl->Finish();
    DrawTimes* times = drawing->times;
    PassClock now = read_clocks();
    int64_t at = times->count[pass]++ % DRAW_TIMES;
    times->ms[pass][at] = (float)(now.us - began.us) * 1e-3f;
    times->processor_ms[pass][at] = (float)(now.processor_us - began.processor_us) * 1e-3f;
}

// Puts hair in the order that its transparency wants, if any.
static void sort_hair(Drawing* drawing, const GuidesView* view)
{
    OrderBy by;
    bool far_first;
    if (!shade_sorts(&drawing->shade, &by, &far_first)) return;
    Hair* hair = &drawing->hair;
    const Frame* frame = &drawing->frame;
    const float* r = frame->rotation;
    Vec3 e = frame->camera.eye; // world axes: back to the head's
    Vec3 eye = vec3(r[0] * e.x + r[3] * e.y + r[6] * e.z, r[1] * e.x + r[4] * e.y + r[7] * e.z,
                    r[2] * e.x + r[5] * e.y + r[8] * e.z);
    order_sort(&hair->order, drawing->gl, &hair->ribbons, hair->style, view, eye, by, far_first);
}

// What the picture to come is taken of; where the head turned, it moved.
static void begin_frame(Drawing* drawing, const GuidesView* view)
{
    Frame* frame = &drawing->frame;
    float aspect = (float)drawing->options.width / (float)drawing->options.height, rotation[9];
    frame->camera = camera_orbit(&drawing->camera, drawing->hair.style, aspect);
    frame->pixel_m =
        shade_pixel_angle(&drawing->shade, &frame->camera) * vec3_length(frame->camera.eye);
    if (shadow_resize(&drawing->shadow, frame)) drawing->lit = true;
    for (int i = 0; drawing->options.shadow.all_lights && i < 2; ++i)
        if (shadow_resize(&drawing->others[i], frame)) drawing->lit = true;
    quat_matrix(rotation, view->pose.orientation);
    for (int i = 0; i < 9; ++i) {
        if (frame->rotation[i] != rotation[i]) drawing->moved = true;
        frame->rotation[i] = rotation[i];
    }
}

static void run_shadow(Drawing* drawing, const GuidesView* view)
{
    PassClock began = begin_pass(drawing);
    const Gl* gl = drawing->gl;
    const Lights* lights = &drawing->shade.lights;
    const Vec3 others[2] = {lights->fill, lights->rim};
    Frame frame = drawing->frame; // the picture's own keeps the key light's bounds
    for (int i = 0; drawing->options.shadow.all_lights && i < 2; ++i) {
        find_bounds(drawing, view, others[i], &frame);
        drawing->draw_calls +=
            shadow_run(&drawing->others[i], gl, &drawing->hair, others[i], &frame);
    }
    find_bounds(drawing, view, lights->key, &drawing->frame);
    drawing->draw_calls +=
        shadow_run(&drawing->shadow, gl, &drawing->hair, lights->key, &drawing->frame);
    end_pass(drawing, PASS_SHADOW, began);
}

static void run_shade(Drawing* drawing, const GuidesView* view)
{
    const Gl* gl = drawing->gl;
    const Frame* frame = &drawing->frame;
    PassClock began = begin_pass(drawing);
    const Shadow* shadows[] = {&drawing->shadow, &drawing->others[0], &drawing->others[1]};
    drawing->draw_calls +=
        light_run(&drawing->light, gl, &drawing->hair, shadows, &drawing->shade.lights, frame,
                  drawing->options.view == VIEW_TRANSMITTANCE);
    end_pass(drawing, PASS_LIGHT, began);

    began = begin_pass(drawing);
    sort_hair(drawing, view);
    drawing->draw_calls +=
        shade_run(&drawing->shade, gl, &drawing->hair, &drawing->shadow, &drawing->light, frame);
    end_pass(drawing, PASS_SHADE, began);
}

bool draw_picture(Drawing* drawing, const GuidesView* view, Image* image)
{
    if (!drawing->has_style) return false;
    const Gl* gl = drawing->gl;
    Hair* hair = &drawing->hair;
    ++drawing->frames;

    PassClock began = begin_pass(drawing);
    int64_t bytes = hair->guides.bytes;
    if (upload_rows(&hair->guides, gl, view)) drawing->moved = true;
    drawing->uploaded_bytes += hair->guides.bytes - bytes;
    if (!drawing->moved && !drawing->lit && !drawing->looked) return true;
    end_pass(drawing, PASS_UPLOAD, began);

    begin_frame(drawing, view);
    if (drawing->moved) {
        began = begin_pass(drawing);
        drawing->draw_calls += update_run(&hair->update, gl, &hair->guides, view, 1.0f);
        end_pass(drawing, PASS_UPDATE, began);
    }
    if (drawing->moved || drawing->lit) run_shadow(drawing, view);
    run_shade(drawing, view);

    began = begin_pass(drawing);
    shade_read(&drawing->shade, gl, image);
    end_pass(drawing, PASS_READ, began);
    drawing->moved = drawing->lit = drawing->looked = false;
    return true;
}

double draw_hair_pixels(const Image* image)
{
    int64_t sum = 0;
    for (int64_t i = 0; i < (int64_t)image->width * image->height; ++i)
        sum += image->rgba[4 * i + 3];
    return (double)sum / 255.0;
}
