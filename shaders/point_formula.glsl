// Where a ribbon point is (thesis 5.5): from the guides of two ticks its position, normal and
// tangent. Only texelFetch and mix: hardware filters weigh with 8 bits on some GPUs, which is 0.2 mm
// here. The twins of this file are messages/drawn.c in double and client/update_cpu.c in float.
#include "capsules.glsl"
#include "guides.glsl"
#include "point.glsl"
#include "turn.glsl"
uniform sampler2D rest_tangents;        // of the guides at rest; x node, y guide
uniform sampler2D table_guides;         // guide a, b, c, height in nodes
uniform sampler2D table_weights;        // of a, b, c; half width m
uniform sampler2D table_offsets;        // rest offset xyz; fill
uniform sampler2D table_tangents;       // drawn tangent at rest xyz; along
uniform sampler2D table_normals;        // drawn normal at rest xyz; random

Point point_at(ivec2 at)
{
    vec4 guides = texelFetch(table_guides, at, 0);
    vec4 weights = texelFetch(table_weights, at, 0);
    vec4 offset = texelFetch(table_offsets, at, 0);
    vec4 rest_tangent = texelFetch(table_tangents, at, 0);
    vec4 rest_normal = texelFetch(table_normals, at, 0);

    int last = textureSize(rest_tangents, 0).x - 1;
    int k = min(int(guides.w), last - 1);
    float f = guides.w - float(k), g = 1.0 - f;
    vec3 position = vec3(0), now = vec3(0), rest = vec3(0);
    for (int j = 0; j < 3; ++j) {
        int row = int(guides[j]);
        vec3 rest_a = texelFetch(rest_tangents, ivec2(k, row), 0).xyz;
        vec3 rest_b = texelFetch(rest_tangents, ivec2(k + 1, row), 0).xyz;
        Node here = between(k, f, row, rest_a);
        position += weights[j] * here.position;
        rest += weights[j] * (rest_a * g + rest_b * f);
        now += weights[j] * here.tangent;
    }
    bool turns = min(dot(now, now), dot(rest, rest)) > 1e-12;
    rest = turns ? normalize(rest) : vec3(0, -1, 0);
    now = turns ? normalize(now) : rest;
    vec3 moved = push_out(box_low.xyz + position + turn(offset.xyz, rest, now));
    return Point(moved, weights.w, turn(rest_normal.xyz, rest, now), rest_normal.w,
                 turn(rest_tangent.xyz, rest, now), rest_tangent.w, offset.w);
}
