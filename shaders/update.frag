// Update pass (thesis 5.5): from the guides of two ticks to position, normal and tangent of every
// ribbon point. Only texelFetch and mix: hardware filters weigh with 8 bits on some GPUs, which is
// 0.2 mm here. The double-precision twin of this file is messages/drawn.c.
#include "capsules.glsl"
#include "turn.glsl"
uniform sampler2DArray guide_positions; // UNORM16 in the box; layer = tick & 1
uniform sampler2DArray guide_tangents;  // SNORM16
uniform sampler2D rest_tangents;        // of the guides at rest; x node, y guide
uniform sampler2D table_guides;         // guide a, b, c, height in nodes
uniform sampler2D table_weights;        // of a, b, c; half width m
uniform sampler2D table_offsets;        // rest offset xyz; fill
uniform sampler2D table_tangents;       // drawn tangent at rest xyz; along
uniform sampler2D table_normals;        // drawn normal at rest xyz; random
uniform vec3 box_low, box_size;
uniform float blend;     // 1: the newest tick of each row alone; 0: the one before
uniform uint newest[32]; // bit r & 31 of word r >> 5: which layer holds row r's newest tick

layout(location = 0) out vec4 out_position; // head space m; half width m
layout(location = 1) out vec4 out_normal;   // head space; random
layout(location = 2) out vec4 out_tangent;  // head space; along

struct Node {
    vec3 position, tangent;
};

Node node_at(int node, int row)
{
    int layer = int((newest[row >> 5] >> uint(row & 31)) & 1u);
    ivec3 now = ivec3(node, row, layer), before = ivec3(node, row, 1 - layer);
    Node n;
    n.position = texelFetch(guide_positions, now, 0).xyz;
    n.tangent = texelFetch(guide_tangents, now, 0).xyz;
    if (blend < 1.0) {
        n.position = mix(texelFetch(guide_positions, before, 0).xyz, n.position, blend);
        n.tangent = mix(texelFetch(guide_tangents, before, 0).xyz, n.tangent, blend);
    }
    return n;
}

// The cubic through both nodes along both tangents, each as long as the chord (messages/drawn.h).
vec3 hermite(Node a, Node b, float f)
{
    vec3 chord = b.position - a.position;
    float g = 1.0 - f;
    vec3 bend = a.tangent * (f * g * g) - b.tangent * (f * f * g);
    return a.position + chord * (f * f * (3.0 - 2.0 * f)) + length(chord) * bend;
}

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 guides = texelFetch(table_guides, at, 0);
    vec4 weights = texelFetch(table_weights, at, 0);
    vec4 offset = texelFetch(table_offsets, at, 0);
    vec4 rest_tangent = texelFetch(table_tangents, at, 0);
    vec4 rest_normal = texelFetch(table_normals, at, 0);

    int last = textureSize(rest_tangents, 0).x - 1;
    int k = min(int(guides.w), last - 1);
    float f = guides.w - float(k);
    vec3 position = vec3(0), now = vec3(0), rest = vec3(0);
    for (int j = 0; j < 3; ++j) {
        int row = int(guides[j]);
        Node a = node_at(k, row), b = node_at(k + 1, row);
        a.position *= box_size, b.position *= box_size; // chords are in metres, not in boxes
        position += weights[j] * hermite(a, b, f);
        vec3 rest_a = texelFetch(rest_tangents, ivec2(k, row), 0).xyz;
        vec3 rest_b = texelFetch(rest_tangents, ivec2(k + 1, row), 0).xyz;
        // Not mix: a + (b - a) f blurs small sums.
        float g = 1.0 - f;
        rest += weights[j] * (rest_a * g + rest_b * f);
        // Roots are fixed to the head: what hangs on them must not turn with the first link.
        now += weights[j] * ((k == 0 ? rest_a : a.tangent) * g + b.tangent * f);
    }
    bool turns = min(dot(now, now), dot(rest, rest)) > 1e-12;
    rest = turns ? normalize(rest) : vec3(0, -1, 0);
    now = turns ? normalize(now) : rest;
    out_position = vec4(push_out(box_low + position + turn(offset.xyz, rest, now)), weights.w);
    out_normal = vec4(turn(rest_normal.xyz, rest, now), rest_normal.w);
    out_tangent = vec4(turn(rest_tangent.xyz, rest, now), rest_tangent.w);
}
