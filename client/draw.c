#include "client/draw.h"

#include "client/fibres.h"
#include "messages/quantise.h"

#include <stdlib.h>
#include <string.h>

const char* const draw_pass_names[PASSES] = {"upload", "update", "shadow",
                                             "light",  "shade",  "read"};

bool draw_create(Drawing* drawing, const Gl* gl, const ShadeOptions* options,
                 const CameraOptions* camera, Fault* fault)
{
    memset(drawing, 0, sizeof *drawing);
    drawing->gl = gl;
    drawing->options = *options;
    drawing->camera = *camera;
    drawing->times = calloc(1, sizeof *drawing->times);
    drawing->fibres = fibres_create(gl, fault);
    if (drawing->times != NULL && drawing->fibres != 0 &&
        shadow_create(&drawing->shadow, gl, drawing->fibres, fault) &&
        light_create(&drawing->light, gl, fault) &&
        shade_create(&drawing->shade, gl, options, fault))
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
    if (!hair_create(&hair, drawing->gl, style, lod, fault)) return false; // keep the old one
    if (!light_fit(&drawing->light, drawing->gl, &hair.update, fault)) {
        hair_free(&hair, drawing->gl);
        return false;
    }
    hair_free(&drawing->hair, drawing->gl);
    drawing->hair = hair;
    drawing->style_hash = hash;
    drawing->style_version = version;
    drawing->has_style = drawing->fresh = true;
    return true;
}

// What the hair fills, head-relative world axes: the guides of the newest rows, widened by what
// strands stray from them.
static Box hair_bounds(const Drawing* drawing, const GuidesView* view, const float r[9])
{
    const Hairstyle* style = drawing->hair.style;
    Box box = {vec3(1e9f, 1e9f, 1e9f), vec3(-1e9f, -1e9f, -1e9f)};
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
        }
    }
    Vec3 margin = {0.03f, 0.03f, 0.03f};
    return (Box){vec3_sub(box.low, margin), vec3_add(box.high, margin)};
}

static int64_t begin_pass(const Drawing* drawing)
{
    return drawing->timed ? base_monotonic_us() : 0;
}

static void end_pass(Drawing* drawing, int pass, int64_t began_us)
{
    if (!drawing->timed) return;
    drawing->gl->Finish();
    DrawTimes* times = drawing->times;
    times->ms[pass][times->count[pass]++ % DRAW_TIMES] =
        (float)(base_monotonic_us() - began_us) * 1e-3f;
}

bool draw_picture(Drawing* drawing, const GuidesView* view, Image* image)
{
    if (!drawing->has_style) return false;
    const Gl* gl = drawing->gl;
    Hair* hair = &drawing->hair;
    float aspect = (float)drawing->options.width / (float)drawing->options.height;
    ++drawing->frames;

    int64_t began = begin_pass(drawing);
    int64_t bytes = hair->guides.bytes;
    bool moved = upload_rows(&hair->guides, gl, view);
    drawing->uploaded_bytes += hair->guides.bytes - bytes;
    if (!moved && !drawing->fresh) return true;
    end_pass(drawing, PASS_UPLOAD, began);

    began = begin_pass(drawing);
    update_run(&hair->update, gl, &hair->guides, 1.0f);
    end_pass(drawing, PASS_UPDATE, began);

    began = begin_pass(drawing);
    Frame frame = {.camera = camera_orbit(&drawing->camera, hair->style, aspect)};
    quat_matrix(frame.rotation, view->pose.orientation);
    frame.bounds = hair_bounds(drawing, view, frame.rotation);
    drawing->draw_calls +=
        shadow_run(&drawing->shadow, gl, hair, drawing->shade.lights.key, &frame);
    end_pass(drawing, PASS_SHADOW, began);

    began = begin_pass(drawing);
    light_run(&drawing->light, gl, hair, &drawing->shadow, &drawing->shade.lights, &frame);
    end_pass(drawing, PASS_LIGHT, began);

    began = begin_pass(drawing);
    drawing->draw_calls +=
        2 + shade_run(&drawing->shade, gl, hair, &drawing->shadow, &drawing->light, &frame);
    end_pass(drawing, PASS_SHADE, began);

    began = begin_pass(drawing);
    shade_read(&drawing->shade, gl, image);
    end_pass(drawing, PASS_READ, began);
    drawing->fresh = false;
    return true;
}

double draw_hair_pixels(const Image* image)
{
    int64_t sum = 0;
    for (int64_t i = 0; i < (int64_t)image->width * image->height; ++i)
        sum += image->rgba[4 * i + 3];
    return (double)sum / 255.0;
}
