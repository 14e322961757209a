// The tables of marschner.glsl, which client/shading.c makes: N over azimuth and cos theta_d.
//
// The table's ends are its outermost texels: with texels' centres, as usual, half a texel at either
// end is lost, and over cos phi instead of phi, R and TRT bend too sharply to be followed.
// MARSCHNER_NALU has it so all the same, with M too in a table of sines (Nguyen and Donnelly 2005;
// the thesis), to be compared.
#include "lights.glsl"
#include "angles.glsl"

// Layers: TT and R (in w) at the root, TRT at the root; both at the tip.
uniform sampler2DArray marschner_around;
uniform sampler2D marschner_along; // R, TT, TRT, cos theta_d: MARSCHNER_NALU only
uniform vec3 marschner_around_scale, marschner_along_scale; // of R, TT, TRT: what 1 stands for

// Where in a table of `size` texels `place` 0..1 lies, in texels.
float table_place(float place, int size)
{
#if MARSCHNER_NALU
    return place * float(size) - 0.5;
#else
    return place * float(size - 1);
#endif
}

// The texel before `at` and how far it is to the next.
ivec2 table_cell(vec2 at, ivec2 size, out vec2 part)
{
    vec2 inside = clamp(at, vec2(0.0), vec2(size - 1));
    ivec2 cell = min(ivec2(inside), size - 2);
    part = inside - vec2(cell);
    return cell;
}

vec4 around(ivec2 cell, vec2 part, int layer)
{
    vec4 a = texelFetch(marschner_around, ivec3(cell, layer), 0);
    vec4 b = texelFetch(marschner_around, ivec3(cell + ivec2(1, 0), layer), 0);
    vec4 c = texelFetch(marschner_around, ivec3(cell + ivec2(0, 1), layer), 0);
    vec4 d = texelFetch(marschner_around, ivec3(cell + ivec2(1, 1), layer), 0);
    return mix(mix(a, b, part.x), mix(c, d, part.x), part.y);
}

vec4 along_table(float sin_i, float sin_r)
{
    ivec2 size = textureSize(marschner_along, 0);
    vec2 part;
    ivec2 cell = table_cell((vec2(sin_i, sin_r) * 0.5 + 0.5) * vec2(size) - 0.5, size, part);
    vec4 a = texelFetch(marschner_along, cell, 0);
    vec4 b = texelFetch(marschner_along, cell + ivec2(1, 0), 0);
    vec4 c = texelFetch(marschner_along, cell + ivec2(0, 1), 0);
    vec4 d = texelFetch(marschner_along, cell + ivec2(1, 1), 0);
    return mix(mix(a, b, part.x), mix(c, d, part.x), part.y);
}

// N of the three lobes; `row` is cos theta_d.
void marschner_azimuth(vec3 across_light, vec3 across_view, float row, float along, out float r,
                       out vec3 tt, out vec3 trt)
{
    ivec2 size = textureSize(marschner_around, 0).xy;
#if MARSCHNER_NALU
    float place = 0.5 + 0.5 * dot(across_light, across_view);
#else
    float place = arc_between(across_light, across_view) * INV_PI;
#endif
    vec2 part;
    ivec2 cell = table_cell(vec2(table_place(place, size.x), table_place(row, size.y)), size, part);
    vec4 through = around(cell, part, 0);
    r = through.w * marschner_around_scale.x;
    tt = mix(through.rgb, around(cell, part, 2).rgb, along) * marschner_around_scale.y;
    trt = mix(around(cell, part, 1).rgb, around(cell, part, 3).rgb, along) *
          marschner_around_scale.z;
}
