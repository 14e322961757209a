// Where a depth lies among the planes of its texel. Planes of opacity maps are where they are. Those
// of a deep opacity map begin at the first hair: 0 there, 1 where `deep_reach` ends, and 2 at the far
// plane, so that what is behind the reach still adds up.
#ifdef DEEP
uniform sampler2D hair_depth;
uniform float deep_reach; // share of near to far; 0: all that is behind the first hair

float layer_place(float z, ivec2 texel)
{
    float first = texelFetch(hair_depth, texel, 0).r, rest = max(1.0 - first, 1e-6);
    float reach = deep_reach > 0.0 ? min(deep_reach, rest) : rest, below = z - first;
    if (below <= reach) return below / reach;
    return 1.0 + (below - reach) / max(rest - reach, 1e-6);
}
#else
float layer_place(float z, ivec2 texel)
{
    return z;
}
#endif
