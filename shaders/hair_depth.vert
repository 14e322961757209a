// Hair as the light sees it, for depth and for layers of optical depth.
#include "ribbon.glsl"
uniform mat4 light_matrix;
uniform vec3 light_direction; // towards the light
uniform float texel_m;        // no ribbon is drawn thinner, and covers less instead; 0: as they are

out vec3 v_place;
out float v_fill, v_depth;

void main()
{
    Ribbon r = ribbon_vertex(gl_VertexID, vec4(light_direction, 0.0), texel_m);
    v_place = fibre_place(r.across, r.along, r.random);
    v_fill = r.fill;
    gl_Position = light_matrix * vec4(r.position, 1.0);
    v_depth = gl_Position.z * 0.5 + 0.5;
}
