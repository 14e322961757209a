// Light pass: radiance of every ribbon point towards the eye (client/light.h says why points).
#include "lights.glsl"
#include "points.glsl"
#include "shading.glsl"
#include "transmittance.glsl"
uniform mat3 head_rotation;
uniform vec3 eye; // relative to the head's position, world axes
uniform vec3 root_colour, tip_colour;
uniform int transmittance_only;
#ifdef EACH_LIGHT
uniform vec3 light_direction; // of the one that this run adds
uniform float irradiance;     // its own
#endif

layout(location = 0) out vec4 out_body;  // scales with the hair's own tone
layout(location = 1) out vec4 out_shine; // first highlight

void main()
{
    Point point = point_at(ivec2(gl_FragCoord.xy));
    vec3 position = head_rotation * point.position, normal = head_rotation * point.normal;
    float along = point.along;
    vec3 view = normalize(eye - position);
    Strand strand = Strand(normalize(head_rotation * point.tangent), normalize(normal),
                           mix(root_colour, tip_colour, along), along, 1.0);
#ifdef EACH_LIGHT
    // Of the sky as much arrives as of the lights on average: they stand all round.
    float lit = hair_lit(position);
    Lobes sum = scaled(strand_shade(strand, light_direction, view), irradiance * lit);
    out_body = vec4(sum.body + SKY / 3.0 * lit * strand.colour, 1.0);
#else
    Lobes sum = scaled(strand_shade(strand, key_direction, view), KEY * hair_lit(position));
    // Deeper hair sees less of what casts no shadow here.
    float open = 0.35 + 0.65 * smoothstep(0.0, 0.6, along);
    // They have no shadows, so what would reach a strand through others would reach all: too much.
    strand.among = 0.0;
    sum = added(sum, scaled(strand_shade(strand, fill_direction, view), FILL * open));
    sum = added(sum, scaled(strand_shade(strand, rim_direction, view), RIM * open));
    out_body = vec4(sum.body + SKY * open * (0.6 + 0.4 * normal.y) * strand.colour, 1.0);
#endif
    out_shine = vec4(sum.shine, 1.0);
    if (transmittance_only != 0) {
        out_body = vec4(vec3(hair_lit(position)), 1.0);
        out_shine = vec4(0.0);
    }
}
