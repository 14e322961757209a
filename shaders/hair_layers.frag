// A ribbon's optical depth, added to every plane behind it.
//
// The share that hair fills stands for its fibres: texels are wider than a fibre apart.
#include "deep_place.glsl"
in float v_fill, v_depth; // depth: 0 near .. 1 far
uniform float layer_depths[4 * TARGETS];
uniform float layer_unit; // optical depth that is stored as 1
const float MOST_FILL = 0.999; // the rest would be infinite

layout(location = 0) out vec4 out_layers[TARGETS];

void main()
{
    float optical = -log(1.0 - min(v_fill, MOST_FILL)) / layer_unit;
    float depth = layer_place(v_depth, ivec2(gl_FragCoord.xy));
    for (int t = 0; t < TARGETS; ++t) {
        vec4 planes = vec4(layer_depths[4 * t], layer_depths[4 * t + 1], layer_depths[4 * t + 2],
                           layer_depths[4 * t + 3]);
        out_layers[t] = optical * step(vec4(depth), planes);
    }
}
