// A vertex of a ribbon: one edge of one point, widened across what looks at it.
#include "points.glsl"
uniform mat3 head_rotation;

struct Ribbon {
    vec3 position; // world axes, relative to the head's position
    vec3 tangent;
    ivec2 texel;
    float along, random, fill;
    float across; // metres from the centre line, before any widening
};

// Ribbons face the viewer. Those of few and wide wisps lie on the head instead, or their ends would
// stand off the crown; `half_width` tells them.
vec3 facing(vec3 towards, vec3 normal, float half_width)
{
    float lies = smoothstep(0.003, 0.010, half_width) * 0.7;
    vec3 out_of_head = normal * (dot(normal, towards) < 0.0 ? -length(towards) : length(towards));
    return lies > 0.0 ? mix(towards, out_of_head, lies) : towards;
}

// `eye` is where the viewer stands (eye.w = 1) or the direction it looks from (eye.w = 0).
// A ribbon is never thinner than `pixel` per metre of distance; its fill then falls instead.
Ribbon ribbon_vertex(int vertex, vec4 eye, float pixel)
{
    int i = vertex >> 1;
    int width = textureSize(table_offsets, 0).x;
    ivec2 at = ivec2(i % width, i / width);
    Point p = point_at(at);
    Ribbon r;
    r.position = head_rotation * p.position;
    r.tangent = head_rotation * p.tangent;
    r.texel = at;
    r.along = p.along;
    r.random = p.random;
    float edge = float(vertex & 1) * 2.0 - 1.0;
    r.across = edge * p.half_width;
    vec3 towards = eye.xyz - eye.w * r.position;
    float least = 0.5 * pixel * (eye.w > 0.0 ? length(towards) : 1.0);
    float half_width = max(p.half_width, least);
    r.fill = p.fill * p.half_width / half_width;
    vec3 side = cross(r.tangent, facing(towards, head_rotation * p.normal, p.half_width));
    float length2 = dot(side, side);
    r.position += side * (length2 > 1e-20 ? inversesqrt(length2) : 0.0) * edge * half_width;
    return r;
}

// Which part of the fibre pattern a ribbon shows; x across, y along, z layer. The texture holds 16
// strands side by side; one every 0.8 mm is what a picture of a whole head can resolve.
vec3 fibre_place(float across_m, float along, float random)
{
    float across = across_m / (16.0 * 0.0008) + fract(random * 61.0);
    return vec3(across, along * 0.5 + fract(random * 17.0), floor(random * 4.0));
}
