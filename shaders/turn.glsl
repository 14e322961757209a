// `v` turned by the least rotation that takes unit `from` to unit `to`.
vec3 turn(vec3 v, vec3 from, vec3 to)
{
    vec3 b = cross(from, to);
    float c = dot(from, to);
    return c < -0.9999 ? v : v + cross(b, v) + cross(b, cross(b, v)) / (1.0 + c);
}
