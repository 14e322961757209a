// Every ribbon point as shadow, light and shade see it: what the update pass left, or, with
// `--update vertex`, the formula anew wherever one is asked for.
#include "point.glsl"
#ifdef POINTS_EVALUATED
#include "point_formula.glsl"
#else
uniform sampler2D drawn_positions; // head space m; half width
uniform sampler2D drawn_normals;   // head space; random
uniform sampler2D drawn_tangents;  // head space; along
uniform sampler2D table_offsets;   // w: fill

Point point_at(ivec2 at)
{
    vec4 p = texelFetch(drawn_positions, at, 0);
    vec4 n = texelFetch(drawn_normals, at, 0);
    vec4 t = texelFetch(drawn_tangents, at, 0);
    return Point(p.xyz, p.w, n.xyz, n.w, t.xyz, t.w, texelFetch(table_offsets, at, 0).w);
}
#endif
