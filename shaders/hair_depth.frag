// Alpha test into a depth map: the modified shadow map (thesis 3.3.2) takes hair as opaque where it
// is, and lets depth below the first hair stand for how much hair was crossed.
#include "fibres.glsl"
in vec3 v_place;
in float v_fill;

void main()
{
    if (!fibre_covers(v_place, v_fill)) discard;
}
