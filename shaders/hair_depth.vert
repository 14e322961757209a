// Hair as the light sees it, for the shadow map.
#include "ribbon.glsl"
uniform mat4 light_matrix;
uniform vec3 light_direction; // towards the light

out vec3 v_place;
out float v_fill;

void main()
{
    Ribbon r = ribbon_vertex(gl_VertexID, vec4(light_direction, 0.0), 0.0);
    v_place = fibre_place(r.across, r.along, r.random);
    v_fill = r.fill;
    gl_Position = light_matrix * vec4(r.position, 1.0);
}
