// The built-in styles whose guides are held together: what they look like at rest, and that what
// holds them does so while the head shakes.
#include "messages/mannequin.h"
#include "server/character.h"
#include "server/load.h"
#include "server/weave.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#define BAND_NODE 4
#define TICKS     240

static Hairstyle* style_of(const char* name)
{
    Fault fault = {0};
    LoadOptions load = {.styles = {name}, .style_count = 1};
    Hairstyle* style = load_style(&load, NULL, &fault);
    if (style == NULL) fail_msg("%s", fault.text);
    return style;
}

static Vec3 node(const Hairstyle* style, const Vec3* nodes, int guide, int n)
{
    return nodes[guide * style->nodes + n];
}

// Of the guides' nodes `n`: the furthest from their middle, m.
static float spread(const Hairstyle* style, const Vec3* nodes, int n)
{
    Vec3 middle = {0, 0, 0};
    for (int g = 0; g < style->guide_count; ++g)
        middle = vec3_add(middle, node(style, nodes, g, n));
    middle = vec3_scale(middle, 1.0f / (float)style->guide_count);
    float most = 0.0f;
    for (int g = 0; g < style->guide_count; ++g)
        most = fmaxf(most, vec3_length(vec3_sub(node(style, nodes, g, n), middle)));
    return most;
}

static void a_ponytail_goes_through_its_band_outside_the_head(void** state)
{
    (void)state;
    Hairstyle* style = style_of("ponytail");
    assert_int_equal(style->hold_count, 1);
    assert_int_equal(style->holds[0].node, BAND_NODE);
    assert_true(spread(style, style->rest, BAND_NODE) < 0.016f);
    assert_true(spread(style, style->rest, 0) > 0.08f);
    assert_true(spread(style, style->rest, style->nodes - 1) < 0.08f);
    for (int g = 0; g < style->guide_count; ++g) {
        assert_true(fabsf(mannequin_distance(node(style, style->rest, g, 0))) < 0.0002f);
        for (int n = 1; n < style->nodes; ++n)
            for (int q = 1; q <= 4; ++q) {
                Vec3 at = vec3_lerp(node(style, style->rest, g, n - 1),
                                    node(style, style->rest, g, n), 0.25f * (float)q);
                assert_true(mannequin_distance(at) > 0.0f);
            }
    }
    hairstyle_destroy(style);
}

// The widest that the guides are at the band, on the way.
static float widest(const Hairstyle* style, const char* motion)
{
    Fault fault = {0};
    SimDefinition sim = sim_default();
    Character* c = character_create(&sim, style, motion_find(motion), (Vec3d){0, 0, 0}, 0, &fault);
    if (c == NULL) fail_msg("%s", fault.text);
    Vec3* nodes = malloc((size_t)(style->guide_count * style->nodes) * sizeof *nodes);
    float most = 0.0f;
    for (int i = 0; i < TICKS; ++i) {
        character_step(c, i, true);
        float rotation[9];
        quat_matrix(rotation, c->head.orientation);
        sim_positions(c->sim, rotation, false, nodes);
        most = fmaxf(most, spread(style, nodes, BAND_NODE));
    }
    free(nodes);
    character_destroy(c);
    return most;
}

static void the_band_holds_while_the_head_shakes(void** state)
{
    (void)state;
    Hairstyle* style = style_of("ponytail");
    float at_rest = spread(style, style->rest, BAND_NODE), held = widest(style, "shake");
    style->hold_count = 0;
    float loose = widest(style, "shake");
    assert_true(held < 1.35f * at_rest && loose > 3.0f * at_rest);
    hairstyle_destroy(style);
}

// The longest distance between neighbouring rows of the fin, of that at rest.
static float torn(const Hairstyle* style)
{
    Fault fault = {0};
    SimDefinition sim = sim_default();
    Character* c = character_create(&sim, style, motion_find("shake"), (Vec3d){0, 0, 0}, 0, &fault);
    if (c == NULL) fail_msg("%s", fault.text);
    Vec3 nodes[64 * 8];
    float most = 0.0f;
    for (int i = 0; i < TICKS; ++i) {
        character_step(c, i, true);
        float rotation[9];
        quat_matrix(rotation, c->head.orientation);
        sim_positions(c->sim, rotation, false, nodes);
        for (int g = 1; g < style->guide_count; ++g)
            for (int n = 1; n < style->nodes; ++n) {
                float now =
                    vec3_length(vec3_sub(node(style, nodes, g, n), node(style, nodes, g - 1, n)));
                float then = vec3_length(
                    vec3_sub(node(style, style->rest, g, n), node(style, style->rest, g - 1, n)));
                most = fmaxf(most, now / then);
            }
    }
    character_destroy(c);
    return most;
}

static void a_crest_is_one_sheet(void** state)
{
    (void)state;
    Hairstyle* style = style_of("crest");
    int count;
    Tie* ties = weave_ties(style, &count);
    assert_int_equal(count, 3 * (style->guide_count - 1) * (style->nodes - 1));
    free(ties);
    float woven = torn(style);
    style->hold_count = 0;
    float loose = torn(style);
    assert_true(woven < 1.15f && loose > 1.3f);
    hairstyle_destroy(style);
}

static void ropes_of_a_band_join_every_guide_once(void** state)
{
    (void)state;
    for (int guides = 2; guides <= 64; ++guides) {
        Hairstyle* style = hairstyle_create();
        Fault fault = {0};
        assert_true(hairstyle_set_guides(style, guides, 8, &fault));
        style->holds[style->hold_count++] = (Hold){HOLD_BAND, 0, guides, 3};
        int count, ends[64] = {0};
        Tie* ties = weave_ties(style, &count);
        for (int i = 0; i < count; ++i) {
            assert_true(ties[i].is_rope && ties[i].node[0] == 3 && ties[i].node[1] == 3);
            assert_int_not_equal(ties[i].strand[0], ties[i].strand[1]);
            ++ends[ties[i].strand[0]];
            ++ends[ties[i].strand[1]];
        }
        for (int g = 0; g < guides; ++g)
            assert_true(ends[g] >= 2 && ends[g] <= 6);
        free(ties);
        hairstyle_destroy(style);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_ponytail_goes_through_its_band_outside_the_head),
        cmocka_unit_test(the_band_holds_while_the_head_shakes),
        cmocka_unit_test(a_crest_is_one_sheet),
        cmocka_unit_test(ropes_of_a_band_join_every_guide_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
