// Update pass: position, normal and tangent of every ribbon point, a fragment each.
#include "point_formula.glsl"
layout(location = 0) out vec4 out_position; // head space m; half width m
layout(location = 1) out vec4 out_normal;   // head space; random
layout(location = 2) out vec4 out_tangent;  // head space; along

void main()
{
    Point p = point_at(ivec2(gl_FragCoord.xy));
    out_position = vec4(p.position, p.half_width);
    out_normal = vec4(p.normal, p.random);
    out_tangent = vec4(p.tangent, p.along);
}
