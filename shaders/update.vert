// The same as update.frag, a vertex each, for transform feedback.
#include "point_formula.glsl"
out vec4 out_position, out_normal, out_tangent;

void main()
{
    int width = textureSize(table_guides, 0).x;
    Point p = point_at(ivec2(gl_VertexID % width, gl_VertexID / width));
    out_position = vec4(p.position, p.half_width);
    out_normal = vec4(p.normal, p.random);
    out_tangent = vec4(p.tangent, p.along);
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
