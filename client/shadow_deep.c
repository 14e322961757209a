// Deep opacity map (Yuksel and Keyser 2008): layers that begin at the first hair of each texel, so
// that a few follow the shape of the hair where planes cut it.
#include "client/program.h"
#include "client/shadow_map.h"

bool shadow_deep_create(Shadow* shadow, const Gl* gl, Fault* fault)
{
    // Every strand counts here, also where it covers little: no alpha test.
    shadow->hair_program = program_build(gl, "hair_depth.vert", "body_depth.frag",
                                         hair_defines(shadow->options.evaluated), fault);
    if (shadow->hair_program == 0) return false;
    hair_samplers(gl, shadow->hair_program);
    if (!shadow_map_create(&shadow->hair, gl, shadow->options.size, fault) ||
        !shadow_layers_create(shadow, gl, "#define DEEP\n", fault))
        return false;
    program_sampler(gl, shadow->layers.program, "hair_depth", UNIT_HAIR_DEPTH);
    return true;
}

int shadow_deep_draw(const Shadow* shadow, const Gl* gl, const Hair* hair, Vec3 light,
                     const float rotation[9])
{
    // As wide as in the layers: a texel of these without a first depth would shade nothing.
    int calls = shadow_map_draw_hair(shadow, gl, hair, light, rotation, shadow->hair.texel_m);
    gl->ActiveTexture(GL_TEXTURE0 + UNIT_HAIR_DEPTH);
    gl->BindTexture(GL_TEXTURE_2D, shadow->hair.texture);
    gl->ActiveTexture(GL_TEXTURE0);
    return calls + shadow_layers_draw(shadow, gl, hair, light, rotation);
}
