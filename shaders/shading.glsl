// What a strand sends to the eye. client/shading.c defines strand_shade as the function of one of
// these files; each takes irradiance 1 from `light`.
#include "kajiya.glsl"
#include "marschner.glsl"
#include "banks.glsl"
#include "clay.glsl"
