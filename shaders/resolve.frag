// Linear radiance to sRGB, 8 bits; alpha stays hair coverage, linear.
uniform sampler2D radiance;
uniform int coverage_only, transmittance_only;
out vec4 out_colour;

void main()
{
    vec4 c = texelFetch(radiance, ivec2(gl_FragCoord.xy), 0);
    vec3 linear = clamp(c.rgb, 0.0, 1.0);
    vec3 srgb = mix(12.92 * linear, 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055,
                    step(0.0031308, linear));
    if (transmittance_only != 0) srgb = linear; // a code is a share of light
    out_colour = coverage_only != 0 ? vec4(c.aaa, c.a) : vec4(srgb, c.a);
}
