in vec2 v_uv;
uniform vec3 background_low, background_high; // linear
uniform int coverage_only;
out vec4 out_radiance;

void main()
{
    vec2 d = v_uv - vec2(0.5, 0.58);
    vec3 colour = mix(background_high, background_low, smoothstep(0.0, 0.75, length(d)));
    out_radiance = vec4(coverage_only != 0 ? vec3(0.0) : colour, 0.0);
}
