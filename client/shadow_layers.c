// Layers of optical depth (opacity shadow maps, Kim and Neumann 2001): a plane holds what all hair
// in front of it adds up to, -ln(1 - coverage) a ribbon. Sums of that are products of
// transmittance, so ribbons may come in any order. Between planes it is interpolated.
#include "client/program.h"
#include "client/shadow_map.h"

#include <stdio.h>

typedef struct LayerFormat {
    GLint internal;
    GLenum type;
    float unit;
} LayerFormat;

// 5.56 is what 8 bits call dark: exp(-5.56) = 1/260.
static LayerFormat format_of(const ShadowOptions* options)
{
    static const LayerFormat formats[] = {[SHADOW_RGBA16F] = {GL_RGBA16F, GL_FLOAT, 1.0f},
                                          [SHADOW_RGBA8] = {GL_RGBA8, GL_UNSIGNED_BYTE, 5.56f},
                                          [SHADOW_RGBA32F] = {GL_RGBA32F, GL_FLOAT, 1.0f}};
    return formats[options->format];
}

float shadow_layers_unit(const ShadowOptions* options)
{
    return format_of(options).unit;
}

// Where plane `k` (0 ..) lies, 0 to 1: the last plane of n is the far
// one, and the near one needs none because nothing is in front of it. Planes 0/n to (n - 1)/n
// (Nalu) leave the last layer without hair: light leaks out of the back.
static double plane_depth(const ShadowTuning* tuning, int k, int n)
{
    double i = k + 1;
    switch (tuning->spacing) {
    case SPACING_RISING:
        return i * (i + 1) / ((double)n * (n + 1));
    case SPACING_EXPONENTIAL: {
        double growth = (double)tuning->growth;
        if (fabs(growth - 1.0) < 1e-6) return i / n;
        return (pow(growth, i) - 1.0) / (pow(growth, n) - 1.0);
    }
    default:
        return i / n;
    }
}

static void create_texture(ShadowLayers* layers, const Gl* gl, const ShadowOptions* options)
{
    LayerFormat format = format_of(options);
    gl->GenTextures(1, &layers->texture);
    gl->BindTexture(GL_TEXTURE_2D_ARRAY, layers->texture);
    gl->TexImage3D(GL_TEXTURE_2D_ARRAY, 0, format.internal, options->size, options->size,
                   layers->targets * layers->passes, 0, GL_RGBA, format.type, NULL);
    gl->TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl->TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

static bool create_framebuffers(ShadowLayers* layers, const Gl* gl, Fault* fault)
{
    gl->GenFramebuffers(layers->passes, layers->framebuffers);
    for (int pass = 0; pass < layers->passes; ++pass) {
        GLenum buffers[8];
        gl->BindFramebuffer(GL_FRAMEBUFFER, layers->framebuffers[pass]);
        for (int t = 0; t < layers->targets; ++t) {
            buffers[t] = GL_COLOR_ATTACHMENT0 + (GLenum)t;
            gl->FramebufferTextureLayer(GL_FRAMEBUFFER, buffers[t], layers->texture, 0,
                                        pass * layers->targets + t);
        }
        gl->DrawBuffers(layers->targets, buffers);
        if (gl->CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
            return fault_set(fault, "the driver refuses %d targets for shadow layers",
                             layers->targets);
    }
    return true;
}

bool shadow_layers_create(Shadow* shadow, const Gl* gl, const char* defines, Fault* fault)
{
    ShadowLayers* layers = &shadow->layers;
    int n = shadow->options.layers, slices = (n + 3) / 4;
    layers->targets = slices < 8 ? slices : 8;
    layers->passes = (slices + layers->targets - 1) / layers->targets;
    bool has_rest = shadow->tuning.reach_m > 0.0f; // shaders/deep_place.glsl
    for (int k = 0; k < SHADOW_MAX_LAYERS; ++k)
        layers->depths[k] = k < n ? (float)plane_depth(&shadow->tuning, k, n - has_rest) : -1.0f;
    if (has_rest) layers->depths[n - 1] = 2.0f;
    char all[128];
    snprintf(all, sizeof all, "#define TARGETS %d\n%s%s", layers->targets, defines ? defines : "",
             hair_defines(shadow->options.evaluated));
    layers->program = program_build(gl, "hair_depth.vert", "hair_layers.frag", all, fault);
    if (layers->program == 0) return false;
    hair_samplers(gl, layers->program);
    create_texture(layers, gl, &shadow->options);
    return create_framebuffers(layers, gl, fault);
}

void shadow_layers_free(ShadowLayers* layers, const Gl* gl)
{
    gl->DeleteProgram(layers->program);
    gl->DeleteTextures(1, &layers->texture);
    gl->DeleteFramebuffers(SHADOW_MAX_PASSES, layers->framebuffers);
}

int shadow_layers_draw(const Shadow* shadow, const Gl* gl, const Hair* hair, Vec3 light,
                       const float rotation[9])
{
    const ShadowLayers* layers = &shadow->layers;
    GLuint program = layers->program;
    int calls = 0;
    gl->Disable(GL_DEPTH_TEST);
    gl->ClearColor(0, 0, 0, 0);
    for (int pass = 0; pass < layers->passes; ++pass) {
        shadow_map_use(&shadow->hair, gl, layers->framebuffers[pass], program, shadow->size, light,
                       rotation);
        gl->Clear(GL_COLOR_BUFFER_BIT);
        gl->Uniform1f(program_uniform(gl, program, "texel_m"), shadow->hair.texel_m);
        gl->Uniform1f(program_uniform(gl, program, "layer_unit"),
                      shadow_layers_unit(&shadow->options));
        gl->Uniform1f(program_uniform(gl, program, "deep_reach"),
                      shadow->tuning.reach_m / shadow->hair.span_m);
        gl->Uniform1fv(program_uniform(gl, program, "layer_depths"), 4 * layers->targets,
                       layers->depths + 4 * layers->targets * pass);
        gl->Enable(GL_BLEND);
        gl->BlendFunc(GL_ONE, GL_ONE);
        gl->Enable(GL_DEPTH_CLAMP); // hair before the near plane shades what is behind it too
        calls += hair_draw(hair, gl, shadow->fibres);
        gl->Disable(GL_DEPTH_CLAMP);
        gl->Disable(GL_BLEND);
    }
    gl->Enable(GL_DEPTH_TEST);
    return calls;
}

bool shadow_opacity_create(Shadow* shadow, const Gl* gl, Fault* fault)
{
    return shadow_layers_create(shadow, gl, NULL, fault);
}
