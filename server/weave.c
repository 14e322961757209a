#include "server/weave.h"

#include <stdlib.h>

#define TIES_OF_NODE 3 // at most, of either kind

static void add(Tie* ties, int* count, const Hairstyle* style, const int strand[2],
                const int node[2], bool is_rope)
{
    Vec3 a = style->rest[strand[0] * style->nodes + node[0]];
    Vec3 b = style->rest[strand[1] * style->nodes + node[1]];
    ties[(*count)++] = (Tie){.strand = {strand[0], strand[1]},
                             .node = {node[0], node[1]},
                             .length_m = vec3_length(vec3_sub(b, a)),
                             .is_rope = is_rope};
}

static void weave_cloth(Tie* ties, int* count, const Hairstyle* style, const Hold* hold)
{
    for (int row = hold->first_guide; row + 1 < hold->first_guide + hold->guide_count; ++row)
        for (int n = 1; n < style->nodes; ++n)
            for (int askew = 0; askew < 3; ++askew)
                add(ties, count, style, (const int[]){row, row + 1},
                    (const int[]){n - (askew == 2), n - (askew == 1)}, false);
}

static void weave_band(Tie* ties, int* count, const Hairstyle* style, const Hold* hold)
{
    int n = hold->guide_count;
    const int strides[] = {1, n / 4, n / 2};
    for (int i = 0; i < n; ++i)
        for (int k = 0; k < 3; ++k) {
            int other = (i + strides[k]) % n;
            if (other == i || (k > 0 && strides[k] <= strides[k - 1])) continue;
            add(ties, count, style, (const int[]){hold->first_guide + i, hold->first_guide + other},
                (const int[]){hold->node, hold->node}, true);
        }
}

Tie* weave_ties(const Hairstyle* style, int* count)
{
    *count = 0;
    size_t most = 0;
    for (int i = 0; i < style->hold_count; ++i)
        most += (size_t)style->holds[i].guide_count * (size_t)style->nodes * TIES_OF_NODE;
    Tie* ties = most > 0 ? malloc(most * sizeof *ties) : NULL;
    if (most > 0 && ties == NULL) *count = -1;
    for (int i = 0; i < style->hold_count && ties != NULL; ++i)
        if (style->holds[i].kind == HOLD_CLOTH)
            weave_cloth(ties, count, style, &style->holds[i]);
        else
            weave_band(ties, count, style, &style->holds[i]);
    return ties;
}
