// Hair for the eye: ribbons that face it, with the light that the light pass left at their points.
#include "ribbon.glsl"
uniform sampler2D light_body, light_shine;
uniform mat4 view_projection;
uniform vec3 eye;          // relative to the head's position, world axes
uniform float pixel_angle; // metres a pixel spans at one metre

out vec3 v_body, v_shine, v_place;
flat out float v_random;
invariant gl_Position; // depth first and colour after must agree to the bit
out float v_fill;

void main()
{
    Ribbon r = ribbon_vertex(gl_VertexID, vec4(eye, 1.0), pixel_angle);
    v_body = texelFetch(light_body, r.texel, 0).rgb;
    v_shine = texelFetch(light_shine, r.texel, 0).rgb;
    v_place = fibre_place(r.across, r.along, r.random);
    v_random = r.random;
    v_fill = r.fill;
    gl_Position = view_projection * vec4(r.position, 1.0);
}
