#include "client/shadow.h"

#include "client/extent.h"
#include "client/program.h"
#include "client/shadow_map.h"

#include <stdio.h>
#include <string.h>

// Tunings are what errs least on `long` and `bob` against all strips that light crosses
// (hair-bench shadow, rows `tuning`).
const ShadowMethod shadow_methods[] = {
    {.name = "none", .help = "no shadows", .look_up = "shadow_none"},
    {.name = "depth",
     .help = "depth of the first hair, and what is behind it is all hair",
     .look_up = "shadow_depth",
     .tuning = {.bias_m = 0.002f},
     .create = shadow_depth_create,
     .draw = shadow_depth_draw},
    {.name = "opacity",
     .help = "optical depth in front of planes",
     .look_up = "shadow_layers",
     .least_layers = 4,
     .most_layers = SHADOW_MAX_LAYERS,
     .layers = 16,
     .tuning = {.bias_m = 0.002f},
     .create = shadow_opacity_create,
     .draw = shadow_layers_draw},
    {.name = "layered", // Koster, Haber and Seidel 2004
     .help = "the same, planes the further apart the further from the light",
     .look_up = "shadow_layers",
     .least_layers = 4,
     .most_layers = SHADOW_MAX_LAYERS,
     .layers = 32,
     .tuning = {.bias_m = 0.002f, .spacing = SPACING_EXPONENTIAL, .growth = 1.05f},
     .create = shadow_opacity_create,
     .draw = shadow_layers_draw},
    {.name = "deep",
     .help = "optical depth in front of surfaces that follow the first hair",
     .look_up = "shadow_layers",
     .least_layers = 2,
     .most_layers = 8,
     .layers = 4,
     .tuning = {.spacing = SPACING_RISING, .reach_m = 0.026f},
     .create = shadow_deep_create,
     .draw = shadow_deep_draw},
    {0}};

int shadow_find_method(const char* name)
{
    for (int i = 0; shadow_methods[i].name != NULL; ++i)
        if (strcmp(shadow_methods[i].name, name) == 0) return i;
    return -1;
}

ShadowOptions shadow_default(void)
{
    return (ShadowOptions){.method = shadow_find_method("deep"),
                           .size = 512, // 1.2 mm a texel on long hair
                           .follows = true};
}

ShadowOptions shadow_smaller(const ShadowOptions* key)
{
    ShadowOptions options = *key;
    options.size = key->size / 2 > SHADOW_LEAST_SIZE ? key->size / 2 : SHADOW_LEAST_SIZE;
    return options;
}

static void write_defines(Shadow* shadow)
{
    snprintf(shadow->defines, SHADOW_DEFINES_BYTES, "#define SHADOWS %s\n#define LAYERS %d\n%s%s",
             shadow->method->look_up, shadow->options.layers,
             shadow->method->create == shadow_deep_create ? "#define DEEP\n" : "",
             hair_defines(shadow->options.evaluated));
}

bool shadow_create(Shadow* shadow, const Gl* gl, const ShadowOptions* options, GLuint fibres,
                   Fault* fault)
{
    memset(shadow, 0, sizeof *shadow);
    shadow->options = *options;
    shadow->size = options->size;
    shadow->method = &shadow_methods[options->method];
    shadow->tuning = options->tuning != NULL ? *options->tuning : shadow->method->tuning;
    shadow->fibres = fibres;
    if (options->layers == 0) shadow->options.layers = shadow->method->layers;
    write_defines(shadow);
    shadow->body_program = program_build(gl, "body_depth.vert", "body_depth.frag", NULL, fault);
    return shadow->body_program != 0 &&
           shadow_map_create(&shadow->body, gl, options->size, fault) &&
           (shadow->method->create == NULL || shadow->method->create(shadow, gl, fault));
}

void shadow_free(Shadow* shadow, const Gl* gl)
{
    shadow_map_free(&shadow->hair, gl);
    shadow_map_free(&shadow->body, gl);
    shadow_layers_free(&shadow->layers, gl);
    gl->DeleteProgram(shadow->hair_program);
    gl->DeleteProgram(shadow->body_program);
    memset(shadow, 0, sizeof *shadow);
}

// An orthographic view from the light that holds `box`, from `low_m` to `high_m` along it. Across,
// it holds the sphere round the box, so that texels keep their size while the head turns and
// shadows do not crawl.
static void fit(ShadowMap* map, Vec3 light, Box box, float low_m, float high_m, int size)
{
    Vec3 middle = vec3_scale(vec3_add(box.low, box.high), 0.5f);
    float radius = 0.5f * vec3_length(vec3_sub(box.high, box.low)) + 0.005f;
    Vec3 from = vec3_mad(middle, light, high_m - vec3_dot(middle, light));
    Vec3 ahead = vec3_sub(from, light);
    bool steep = fabsf(light.y) > 0.95f;
    const float up[3] = {0, steep ? 0 : 1, steep ? 1 : 0};
    const float eye[3] = {from.x, from.y, from.z}, to[3] = {ahead.x, ahead.y, ahead.z};
    map->span_m = fmaxf(high_m - low_m, 1e-3f);
    map->texel_m = 2.0f * radius / (float)size;
    Mat4 view = matrix_look_at(eye, to, up), ortho = matrix_ortho(radius, map->span_m);
    map->matrix = matrix_mul(&ortho, &view);
}

static int draw_body(Shadow* shadow, const Gl* gl, const Hair* hair, Vec3 light, const Frame* frame)
{
    const Body* body = &hair->body;
    Box box = body->index_count > 0 ? box_rotate(body->box, frame->rotation) : frame->bounds;
    float middle = 0.5f * vec3_dot(vec3_add(box.low, box.high), light);
    float radius = 0.5f * vec3_length(vec3_sub(box.high, box.low)) + 0.005f;
    fit(&shadow->body, light, box, middle - radius, middle + radius, shadow->size);
    shadow_map_use(&shadow->body, gl, shadow->body.framebuffer, shadow->body_program, shadow->size,
                   light, frame->rotation);
    gl->Enable(GL_DEPTH_TEST);
    gl->DepthMask(GL_TRUE);
    gl->ClearDepth(1.0);
    gl->Clear(GL_DEPTH_BUFFER_BIT);
    return shadow->method->draw == NULL ? 0 : body_draw(hair_body(hair, shadow->body.texel_m), gl);
}

static int size_for(const Shadow* shadow, float pixel_m)
{
    int size = shadow->options.size;
    if (!shadow->options.follows) return size;
    int times = pixel_m > 0.0040f ? 4 : pixel_m > 0.0013f ? 2 : 1;
    return size / times > SHADOW_LEAST_SIZE ? size / times : SHADOW_LEAST_SIZE;
}

bool shadow_resize(Shadow* shadow, const Frame* frame)
{
    int size = size_for(shadow, frame->pixel_m), before = shadow->size;
    shadow->size = size;
    return size != before;
}

int shadow_run(Shadow* shadow, const Gl* gl, const Hair* hair, Vec3 light, const Frame* frame)
{
    int calls = 0;
    fit(&shadow->hair, light, frame->bounds, frame->lit_low_m, frame->lit_high_m, shadow->size);
    if (shadow->method->draw != NULL)
        calls += shadow->method->draw(shadow, gl, hair, light, frame->rotation);
    return calls + draw_body(shadow, gl, hair, light, frame);
}

void shadow_samplers(const Gl* gl, GLuint program)
{
    program_sampler(gl, program, "hair_depth", UNIT_HAIR_DEPTH);
    program_sampler(gl, program, "body_depth", UNIT_BODY_DEPTH);
    program_sampler(gl, program, "hair_layers", UNIT_HAIR_LAYERS);
}

static void bind_texture(const Gl* gl, GLenum unit, GLenum kind, GLuint texture)
{
    gl->ActiveTexture(GL_TEXTURE0 + unit);
    gl->BindTexture(kind, texture);
}

void shadow_bind(const Shadow* shadow, const Gl* gl, GLuint program)
{
    const ShadowOptions* options = &shadow->options;
    const ShadowTuning* tuning = &shadow->tuning;
    bind_texture(gl, UNIT_HAIR_DEPTH, GL_TEXTURE_2D, shadow->hair.texture);
    bind_texture(gl, UNIT_BODY_DEPTH, GL_TEXTURE_2D, shadow->body.texture);
    bind_texture(gl, UNIT_HAIR_LAYERS, GL_TEXTURE_2D_ARRAY, shadow->layers.texture);
    gl->ActiveTexture(GL_TEXTURE0);
    gl->UniformMatrix4fv(program_uniform(gl, program, "hair_light_matrix"), 1, GL_FALSE,
                         &shadow->hair.matrix.m[0][0]);
    gl->UniformMatrix4fv(program_uniform(gl, program, "body_light_matrix"), 1, GL_FALSE,
                         &shadow->body.matrix.m[0][0]);
    gl->Uniform1i(program_uniform(gl, program, "shadow_size"), shadow->size);
    gl->Uniform1f(program_uniform(gl, program, "hair_light_span"), shadow->hair.span_m);
    gl->Uniform1f(program_uniform(gl, program, "body_light_span"), shadow->body.span_m);
    gl->Uniform1f(program_uniform(gl, program, "hair_bias"), tuning->bias_m);
    gl->Uniform1f(program_uniform(gl, program, "layer_unit"), shadow_layers_unit(options));
    gl->Uniform1f(program_uniform(gl, program, "deep_reach"),
                  tuning->reach_m / shadow->hair.span_m);
    if (options->layers > 0)
        gl->Uniform1fv(program_uniform(gl, program, "layer_depths"), options->layers,
                       shadow->layers.depths);
}
