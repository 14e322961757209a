// What the formula of points knows besides textures: PointsBlock of client/update.h.
layout(std140) uniform PointsBlock
{
    vec4 box_low;    // of the guides' box; w 1: each row's newest tick, 0: the one before
    vec4 box_size;
    ivec4 capsules;  // x: how many
    uvec4 newest[8]; // bit r & 31 of number r >> 5: which layer holds row r's newest tick
    vec4 capsule_from[32], capsule_to[32]; // head space m; radius in w of the first
};
