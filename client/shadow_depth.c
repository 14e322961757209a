// Modified shadow map (thesis 3.3.2): depth of the first hair; what is behind it is all hair.
#include "client/program.h"
#include "client/shadow_map.h"

bool shadow_depth_create(Shadow* shadow, const Gl* gl, Fault* fault)
{
    shadow->hair_program = program_build(gl, "hair_depth.vert", "hair_depth.frag",
                                         hair_defines(shadow->options.evaluated), fault);
    if (shadow->hair_program == 0) return false;
    hair_samplers(gl, shadow->hair_program);
    return shadow_map_create(&shadow->hair, gl, shadow->options.size, fault);
}

int shadow_depth_draw(const Shadow* shadow, const Gl* gl, const Hair* hair, Vec3 light,
                      const float rotation[9])
{
    return shadow_map_draw_hair(shadow, gl, hair, light, rotation, 0.0f);
}
