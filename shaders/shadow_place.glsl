// Where a place lies in what was drawn from the light.
uniform mat4 hair_light_matrix, body_light_matrix; // to clip space, orthographic
uniform float hair_light_span, body_light_span;    // metres from near to far
uniform int shadow_size; // texels across that were drawn; the texture may be larger
uniform float hair_bias;                           // m

// Texel coordinates 0..1 and depth, 0 near .. 1 far.
vec3 light_place(mat4 matrix, vec3 position)
{
    return (matrix * vec4(position, 1.0)).xyz * 0.5 + 0.5;
}

bool is_in_map(ivec2 texel, ivec2 size)
{
    return all(greaterThanEqual(texel, ivec2(0))) && all(lessThan(texel, size));
}
