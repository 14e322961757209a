// Skin and clothes: Lambert, softened at the terminator where it is skin. The scalp is shaded as hair
// with the tangents of the hair that grows there, so that gaps between wisps show roots, not skin.
#include "lights.glsl"
#include "shading.glsl"
#include "transmittance.glsl"

in vec3 v_position, v_normal, v_tangent;
in vec4 v_albedo;
uniform vec3 eye;
uniform vec3 root_colour;
uniform int coverage_only, transmittance_only;

layout(location = 0) out vec4 out_radiance;

vec3 lambert(vec3 normal, vec3 light, vec3 albedo)
{
    // Light that enters red leaves a little past the terminator.
    vec3 wrap = 0.12 * albedo / max(albedo.r, 0.05);
    return albedo * INV_PI * clamp((dot(normal, light) + wrap) / (1.0 + wrap), 0.0, 1.0);
}

void main()
{
    if (coverage_only != 0) {
        out_radiance = vec4(0.0);
        return;
    }
    vec3 normal = normalize(v_normal), view = normalize(eye - v_position);
    float lit = skin_lit(v_position, normal);
    if (transmittance_only != 0) {
        out_radiance = vec4(vec3(lit), 0.0);
        return;
    }
    vec3 skin = KEY * lit * lambert(normal, key_direction, v_albedo.rgb) +
                FILL * lambert(normal, fill_direction, v_albedo.rgb) +
                RIM * lambert(normal, rim_direction, v_albedo.rgb) +
                SKY * (0.7 + 0.3 * normal.y) * v_albedo.rgb;
    vec3 half_way = normalize(view + key_direction);
    skin += 0.02 * KEY * lit * pow(max(dot(normal, half_way), 0.0), 24.0);
    Strand strand = Strand(normalize(v_tangent + vec3(1e-6)), normal, root_colour, 0.0, 1.0);
    vec3 scalp = KEY * lit * strand_shade(strand, key_direction, view).body +
                 0.35 * RIM * strand_shade(strand, rim_direction, view).body +
                 0.35 * SKY * root_colour;
    out_radiance = vec4(mix(skin, scalp, v_albedo.a), 0.0);
}
