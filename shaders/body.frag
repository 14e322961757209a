// Skin and clothes: Lambert, softened at the terminator where it is skin. The scalp is shaded as hair
// at its vertices (body.vert).
#include "lights.glsl"
#include "shading.glsl"
#include "transmittance.glsl"

in vec3 v_position, v_normal, v_scalp;
in vec4 v_albedo;
in float v_lit;
uniform vec3 eye;
uniform int coverage_only, transmittance_only;
uniform int fine_mesh; // no shadow falls between the vertices of a triangle

layout(location = 0) out vec4 out_radiance;

vec3 lambert(vec3 normal, vec3 light, vec3 albedo)
{
    // Light that enters red leaves a little past the terminator.
    vec3 wrap = 0.12 * albedo / max(albedo.r, 0.05);
    return albedo * INV_PI * clamp((dot(normal, light) + wrap) / (1.0 + wrap), 0.0, 1.0);
}

// Where all vertices are in full light or in none, so is what lies between them; and most scalp is hidden. Elsewhere shadows have edges that are finer than triangles.
float key_lit(vec3 normal)
{
    bool even = fine_mesh != 0 && (v_lit < 0.01 || v_lit > 0.99 || v_albedo.a > 0.5);
    float lit = skin_lit(v_position, normal, !even);
    return even ? v_lit : lit;
}

void main()
{
    if (coverage_only != 0) {
        out_radiance = vec4(0.0);
        return;
    }
    vec3 normal = normalize(v_normal), view = normalize(eye - v_position);
    float lit = key_lit(normal);
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
    out_radiance = vec4(mix(skin, v_scalp, v_albedo.a), 0.0);
}
