// Guides of two ticks, at nodes and between them.
#include "points_block.glsl"
uniform sampler2DArray guide_positions; // UNORM16 in the box; layer = tick & 1
uniform sampler2DArray guide_tangents;  // SNORM16

int layer_of(int row)
{
    return int((newest[row >> 7][(row >> 5) & 3] >> uint(row & 31)) & 1u);
}

struct Node {
    vec3 position, tangent;
};

Node node_at(int node, int row)
{
    int layer = layer_of(row);
    ivec3 now = ivec3(node, row, layer), before = ivec3(node, row, 1 - layer);
    Node n;
    n.position = texelFetch(guide_positions, now, 0).xyz;
    n.tangent = texelFetch(guide_tangents, now, 0).xyz;
    if (box_low.w < 1.0) {
        n.position = mix(texelFetch(guide_positions, before, 0).xyz, n.position, box_low.w);
        n.tangent = mix(texelFetch(guide_tangents, before, 0).xyz, n.tangent, box_low.w);
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

// A guide at `k + f` nodes. Roots are fixed to the head: what hangs on them must not turn with the
// first link, so node 0 counts with `rest`, its tangent at rest.
#ifdef LINEAR_FETCH
// What the thesis does: the texture unit interpolates, along straight lines between nodes.
Node between(int k, float f, int row, vec3 rest)
{
    vec2 size = vec2(textureSize(guide_positions, 0).xy);
    vec2 at = vec2(float(k) + f + 0.5, float(row) + 0.5) / size;
    float now = float(layer_of(row));
    Node n;
    n.position = texture(guide_positions, vec3(at, now)).xyz;
    n.tangent = texture(guide_tangents, vec3(at, now)).xyz;
    if (box_low.w < 1.0) {
        n.position = mix(texture(guide_positions, vec3(at, 1.0 - now)).xyz, n.position, box_low.w);
        n.tangent = mix(texture(guide_tangents, vec3(at, 1.0 - now)).xyz, n.tangent, box_low.w);
    }
    n.position *= box_size.xyz;
    if (k == 0) n.tangent = rest * (1.0 - f) + node_at(1, row).tangent * f;
    return n;
}
#else
Node between(int k, float f, int row, vec3 rest)
{
    Node a = node_at(k, row), b = node_at(k + 1, row);
    a.position *= box_size.xyz, b.position *= box_size.xyz; // chords are in metres, not in boxes
    // Not mix: a + (b - a) f blurs small sums.
    return Node(hermite(a, b, f), (k == 0 ? rest : a.tangent) * (1.0 - f) + b.tangent * f);
}
#endif
