// The head. The scalp is shaded as hair with the tangents of the hair that grows there, so that gaps
// between wisps show roots, not skin; like hair, at points.
#include "lights.glsl"
#include "shading.glsl"
#include "transmittance.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 albedo_scalp; // linear albedo; how much hair grows here
layout(location = 3) in vec3 root_tangent; // of the hair that grows here
uniform vec3 eye, root_colour;
uniform mat4 view_projection;
uniform mat3 head_rotation;

out vec3 v_position, v_normal, v_scalp;
out vec4 v_albedo;
out float v_lit;

vec3 scalp()
{
    vec3 view = normalize(eye - v_position);
    vec3 tangent = normalize(head_rotation * root_tangent + vec3(1e-6));
    Strand strand = Strand(tangent, v_normal, root_colour, 0.0, 1.0);
    return KEY * v_lit * strand_shade(strand, key_direction, view).body +
           0.35 * RIM * strand_shade(strand, rim_direction, view).body + 0.35 * SKY * root_colour;
}

void main()
{
    v_position = head_rotation * position;
    v_normal = head_rotation * normal;
    v_albedo = albedo_scalp;
    v_lit = skin_lit(v_position, v_normal, true);
    v_scalp = scalp();
    gl_Position = view_projection * vec4(v_position, 1.0);
}
