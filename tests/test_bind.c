// What binding an imported groom to guides promises; and the drawn point it is written against.
#include "messages/drawn.h"
#include "messages/quantise.h"
#include "messages/random.h"
#include "messages/trig.h"
#include "server/bind.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <stdlib.h>
#include <string.h>

#define POINTS  16
#define STRANDS 300
#define NODES   8

// Wavy strands over a half ball of 0.1 m, `spread` apart from each other, of uneven segments.
static void grow(Vec3* points, int strands, uint32_t seed)
{
    for (int s = 0; s < strands; ++s) {
        uint32_t draw = (uint32_t)s * 8;
        Vec3 out = vec3_normalise_or(vec3(random_signed(seed, draw), random_unit(seed, draw + 1),
                                          random_signed(seed, draw + 2)),
                                     vec3(0, 1, 0));
        float length = 0.05f + 0.15f * random_unit(seed, draw + 3);
        float wave = 0.01f * random_unit(seed, draw + 4);
        for (int p = 0; p < POINTS; ++p) {
            float t = (float)p / (POINTS - 1);
            t = t * (0.7f + 0.3f * t);
            Vec3 at = vec3_scale(out, 0.1f + 0.3f * length * t);
            at.y -= length * t * t;
            at.x += wave * (float)trig_sin(9.0 * (double)t);
            points[s * POINTS + p] = at;
        }
    }
}

// Two sections of one style.
typedef struct Bound {
    Hairstyle* style;
    Vec3 points[2][STRANDS * POINTS];
    BindSection sections[2];
} Bound;

static Bound* bind_two(int strands_a, int strands_b, int guides)
{
    Bound* bound = calloc(1, sizeof *bound);
    bound->style = hairstyle_create();
    grow(bound->points[0], strands_a, 1);
    grow(bound->points[1], strands_b, 2);
    bound->sections[0] = (BindSection){"top", bound->points[0], strands_a, POINTS, false};
    bound->sections[1] = (BindSection){"band", bound->points[1], strands_b, POINTS, true};
    Fault fault = {""};
    if (!bind_sections(bound->style, bound->sections, 2, guides, NODES, &fault))
        fail_msg("%s", fault.text);
    memcpy(bound->style->name, "test", 5);
    if (!hairstyle_validate(bound->style, &fault)) fail_msg("%s", fault.text);
    return bound;
}

static void bound_free(Bound* bound)
{
    hairstyle_destroy(bound->style);
    free(bound);
}

static double vec3d_length(Vec3d v)
{
    return sqrt(vec3d_dot(v, v));
}

// Largest distance of a drawn point from the imported one, with guides and tangents as textures
// decode them.
static double rest_error(const Bound* bound)
{
    const Hairstyle* style = bound->style;
    int count = style->guide_count * NODES;
    Vec3* planes = calloc((size_t)count * 3, sizeof *planes);
    Vec3 *positions = planes, *tangents = planes + count, *rest_tangents = planes + 2 * count;
    for (int g = 0; g < style->guide_count; ++g)
        quantise_strand_tangents(rest_tangents + g * NODES, style->rest + g * NODES, NODES);
    for (int i = 0; i < count; ++i) {
        uint16_t position[3];
        int16_t tangent[3];
        quantise_position(position, style->rest[i], &style->box);
        quantise_tangent(tangent, rest_tangents[i]);
        positions[i] = dequantise_position(position, &style->box);
        tangents[i] = dequantise_tangent(tangent);
    }
    double worst = 0.0;
    for (int i = 0; i < style->set_count; ++i)
        for (int s = 0; s < style->sets[i].strand_count; ++s)
            for (int p = 0; p < POINTS; ++p) {
                DrawnPoint point;
                drawn_from_bound(&point, style, &style->sets[i], s, p);
                Vec3d at = drawn_position(&point, NODES, positions, tangents, rest_tangents, NULL);
                Vec3d wanted = vec3d_from(bound->points[i][s * POINTS + p]);
                worst = fmax(worst, vec3d_length(vec3d_sub(at, wanted)));
            }
    free(planes);
    return worst;
}

static void rest_pose_is_exact_to_a_tenth_of_a_millimetre(void** state)
{
    (void)state;
    Bound* bound = bind_two(STRANDS, 120, 40);
    double worst = rest_error(bound);
    print_message("rest error %.4f mm\n", 1000.0 * worst);
    assert_true(worst < 0.00005);
    bound_free(bound);
}

static void strands_hang_on_guides_of_their_own_section(void** state)
{
    (void)state;
    Bound* bound = bind_two(STRANDS, 120, 40);
    const Hairstyle* style = bound->style;
    for (int i = 0; i < 2; ++i) {
        const StrandSet* set = &style->sets[i];
        for (int s = set->first_strand; s < set->first_strand + set->strand_count; ++s) {
            const BoundStrand* strand = &style->strands[s];
            int sum = 0;
            for (int k = 0; k < 3; ++k) {
                assert_in_range(strand->guide[k], set->first_guide,
                                set->first_guide + set->guide_count - 1);
                sum += strand->weight[k];
            }
            assert_int_equal(sum, 65535);
            assert_true(strand->weight[0] >= strand->weight[1]);
            assert_true(strand->weight[1] >= strand->weight[2]);
            assert_true(strand->guide[0] != strand->guide[1]);
            assert_true(strand->guide[1] != strand->guide[2]);
        }
    }
    assert_string_equal(style->sets[1].name, "band");
    bound_free(bound);
}

static void nearest_guides_carry(void** state)
{
    (void)state;
    Bound* bound = bind_two(STRANDS, 120, 40);
    const Hairstyle* style = bound->style;
    const StrandSet* set = &style->sets[0];
    for (int s = 0; s < set->strand_count; ++s) {
        Vec3 shape[NODES];
        bind_resample(shape, NODES, bound->points[0] + s * POINTS, POINTS);
        float gaps[40];
        for (int g = 0; g < set->guide_count; ++g) {
            gaps[g] = 0.0f;
            for (int n = 0; n < NODES; ++n)
                gaps[g] += vec3_length(vec3_sub(shape[n], style->rest[g * NODES + n])) / NODES;
        }
        int nearer = 0; // the binder compares at other fractions, so nearly nearest is near enough
        for (int g = 0; g < set->guide_count; ++g)
            nearer += gaps[g] < 0.9f * gaps[style->strands[s].guide[0]];
        assert_int_equal(nearer, 0);
    }
    bound_free(bound);
}

static void guides_carry_themselves(void** state)
{
    (void)state;
    Bound* bound = bind_two(STRANDS, 120, 40);
    const Hairstyle* style = bound->style;
    bool carries[40] = {false};
    for (int s = 0; s < style->strand_count; ++s)
        if (style->strands[s].weight[0] > 65000) {
            carries[style->strands[s].guide[0]] = true;
            assert_true(style->strands[s].tip_height > 65000); // its own length is the guide's
        }
    for (int g = 0; g < style->guide_count; ++g)
        assert_true(carries[g]);
    bound_free(bound);
}

static double least_gap(const Hairstyle* style, const StrandSet* set)
{
    double least = HUGE_VAL;
    for (int a = set->first_guide; a < set->first_guide + set->guide_count; ++a)
        for (int b = set->first_guide; b < a; ++b) {
            double sum = 0.0;
            for (int n = 0; n < NODES; ++n)
                sum += (double)vec3_length(
                    vec3_sub(style->rest[a * NODES + n], style->rest[b * NODES + n]));
            least = fmin(least, sum / NODES);
        }
    return least;
}

static void guides_are_spread_evenly(void** state)
{
    (void)state;
    Bound* bound = bind_two(STRANDS, 120, 40);
    // 40 of 300 strands taken blindly come within a few millimetres of each other.
    for (int i = 0; i < 2; ++i)
        assert_true(least_gap(bound->style, &bound->style->sets[i]) > 0.025);
    bound_free(bound);
}

static void guides_are_shared_by_strand_count(void** state)
{
    (void)state;
    BindSection sections[3] = {
        {"a", NULL, 1000, 2, false}, {"b", NULL, 500, 2, false}, {"c", NULL, 5, 2, false}};
    int shares[3];
    assert_true(bind_share_guides(shares, sections, 3, 64, NULL));
    assert_int_equal(shares[2], 5); // no more than it has strands
    assert_int_equal(shares[0] + shares[1], 59);
    assert_int_equal(shares[0], 37); // 8 + 2/3 of what the minima leave
    for (int guides = 21; guides < 200; ++guides) {
        assert_true(bind_share_guides(shares, sections, 3, guides, NULL));
        assert_int_equal(shares[0] + shares[1] + shares[2], guides);
        assert_true(shares[0] >= 8 && shares[1] >= 8 && shares[2] == 5);
    }
    sections[2].strands = 9;
    assert_true(bind_share_guides(shares, sections, 3, 1000, NULL));
    assert_true(shares[2] <= 9 && shares[0] + shares[1] + shares[2] == 1000);
    sections[1].strands = sections[0].strands = 10;
    assert_true(bind_share_guides(shares, sections, 3, 29, NULL));
    assert_true(shares[0] == 10 && shares[1] == 10 && shares[2] == 9);
    sections[2].strands = 5;
    Fault fault;
    assert_false(bind_share_guides(shares, sections, 3, 20, &fault));
    assert_non_null(strstr(fault.text, "20 guides"));
    assert_false(bind_share_guides(shares, sections, 3, 1025, &fault));
    sections[0].strands = 0;
    assert_false(bind_share_guides(shares, sections, 3, 64, &fault));
}

static void both_ends_pins_the_last_two_nodes(void** state)
{
    (void)state;
    Bound* bound = bind_two(60, 60, 20);
    for (int g = 0; g < 20; ++g)
        for (int n = 0; n < NODES; ++n) {
            bool pinned = n == 0 || (n >= NODES - 2 && g >= bound->style->sets[1].first_guide);
            assert_int_equal(bound->style->weight[g * NODES + n], pinned ? 0 : 255);
        }
    bound_free(bound);
}

static void odd_sections_bind_without_nan(void** state)
{
    (void)state;
    Bound* bound = calloc(1, sizeof *bound);
    bound->style = hairstyle_create();
    grow(bound->points[0], 12, 1);
    for (int p = 0; p < POINTS; ++p) {
        bound->points[0][p] = vec3(0.1f, 0.1f, 5e-7f * (float)p);            // 7.5 micrometres
        bound->points[0][POINTS + p] = vec3(0.1f, 0.1f, 0.0f);               // no length
        bound->points[0][2 * POINTS + p] = bound->points[0][3 * POINTS + p]; // a twin
    }
    grow(bound->points[1], 1, 2); // a single strand, which is its only guide
    bound->sections[0] = (BindSection){"odd", bound->points[0], 12, POINTS, true};
    bound->sections[1] = (BindSection){"one", bound->points[1], 1, POINTS, false};
    Fault fault = {""};
    // Every strand is a guide, twins and stubs too.
    if (!bind_sections(bound->style, bound->sections, 2, 13, NODES, &fault))
        fail_msg("%s", fault.text);
    assert_true(hairstyle_validate(bound->style, &fault));
    assert_int_equal(bound->style->strands[12].guide[0], 12);
    for (int s = 4; s < 12; ++s) // no guide was chosen twice in place of one of these
        assert_true(bound->style->strands[s].weight[0] > 65000);
    assert_true(rest_error(bound) < 0.00005);
    bound->points[0][5].y = NAN;
    assert_false(bind_sections(bound->style, bound->sections, 2, 13, NODES, &fault));
    assert_non_null(strstr(fault.text, "odd"));
    bound_free(bound);
}

static void resampling_keeps_ends_and_spaces_evenly(void** state)
{
    (void)state;
    const Vec3 bent[] = {{0, 0, 0}, {3, 0, 0}, {3, 0, 0}, {3, 1, 0}};
    Vec3 out[9];
    bind_resample(out, 9, bent, 4);
    for (int i = 0; i < 9; ++i) {
        float s = 0.5f * (float)i;
        Vec3 wanted = s <= 3.0f ? vec3(s, 0, 0) : vec3(3, s - 3.0f, 0);
        assert_true(vec3_length(vec3_sub(out[i], wanted)) < 1e-6f);
    }
}

// The drawn point ---------------------------------------------------------------------------------

// One straight guide of four nodes along `along`, and a point half-way down with an offset.
typedef struct Straight {
    Vec3 positions[4], tangents[4];
    DrawnPoint point;
} Straight;

static Straight straight(Vec3 along, Vec3 offset)
{
    Straight s = {.point = {.weight = {1.0f, 0.0f, 0.0f}, .height = 1.5f, .offset = offset}};
    for (int n = 0; n < 4; ++n) {
        s.positions[n] = vec3_scale(along, (float)n);
        s.tangents[n] = along;
    }
    return s;
}

static void assert_drawn(Vec3 rest_along, Vec3 along, Vec3 offset, Vec3d wanted)
{
    Straight rest = straight(rest_along, offset), now = straight(along, offset);
    Vec3d tangent;
    Vec3d at = drawn_position(&now.point, 4, now.positions, now.tangents, rest.tangents, &tangent);
    assert_true(vec3d_length(vec3d_sub(at, wanted)) < 1e-6);
    assert_true(vec3d_length(vec3d_sub(tangent, vec3d_from(along))) < 1e-6);
}

static void offsets_turn_with_their_guides(void** state)
{
    (void)state;
    Vec3 down = {0, -1, 0}, right = {1, 0, 0};
    // down -> right is a quarter turn about +Z: x becomes y, y becomes -x, z stays.
    assert_drawn(down, right, vec3(0.1f, 0, 0), (Vec3d){1.5, 0.1, 0});
    assert_drawn(down, right, vec3(0, 0.1f, 0), (Vec3d){1.4, 0, 0});
    assert_drawn(down, right, vec3(0, 0, 0.1f), (Vec3d){1.5, 0, 0.1});
    assert_drawn(down, down, vec3(0.1f, 0.2f, 0.3f), (Vec3d){0.1, -1.3, 0.3});
    // Opposed: no least turn, left as it is.
    assert_drawn(down, vec3(0, 1, 0), vec3(0.1f, 0.2f, 0.3f), (Vec3d){0.1, 1.7, 0.3});
}

static void turning_keeps_the_length_of_offsets(void** state)
{
    (void)state;
    for (uint32_t n = 0; n < 500; ++n) {
        Vec3 v[3];
        for (uint32_t k = 0; k < 3; ++k)
            v[k] = vec3_normalise_or(vec3(random_signed(n, 3 * k), random_signed(n, 3 * k + 1),
                                          random_signed(n, 3 * k + 2)),
                                     vec3(1, 0, 0));
        if (vec3_dot(v[0], v[1]) < -0.99f) continue;
        Straight rest = straight(v[0], v[2]), now = straight(v[1], v[2]);
        Vec3d at = drawn_position(&now.point, 4, now.positions, now.tangents, rest.tangents, NULL);
        Vec3d turned = vec3d_sub(at, vec3d_scale(vec3d_from(v[1]), 1.5));
        assert_true(fabs(vec3d_length(turned) - 1.0) < 1e-5);
        // Its angle to the tangent is kept too.
        double before = (double)vec3_dot(v[0], v[2]);
        assert_true(fabs(vec3d_dot(turned, vec3d_from(v[1])) - before) < 1e-5);
    }
}

static void points_without_a_tangent_stay_finite(void** state)
{
    (void)state;
    Straight s = straight(vec3(0, -1, 0), vec3(0.1f, 0, 0));
    Vec3 none[4] = {{0, 0, 0}};
    Vec3d tangent;
    Vec3d at = drawn_position(&s.point, 4, s.positions, none, s.tangents, &tangent);
    assert_true(at.x > 0.09 && at.x < 0.11 && tangent.y == -1.0);
    s.point.height = 3.0f; // the very tip
    at = drawn_position(&s.point, 4, s.positions, s.tangents, none, &tangent);
    assert_true(fabs(at.y + 3.0) < 1e-9 && isfinite(at.x));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rest_pose_is_exact_to_a_tenth_of_a_millimetre),
        cmocka_unit_test(strands_hang_on_guides_of_their_own_section),
        cmocka_unit_test(nearest_guides_carry),
        cmocka_unit_test(guides_carry_themselves),
        cmocka_unit_test(guides_are_spread_evenly),
        cmocka_unit_test(guides_are_shared_by_strand_count),
        cmocka_unit_test(both_ends_pins_the_last_two_nodes),
        cmocka_unit_test(odd_sections_bind_without_nan),
        cmocka_unit_test(resampling_keeps_ends_and_spaces_evenly),
        cmocka_unit_test(offsets_turn_with_their_guides),
        cmocka_unit_test(turning_keeps_the_length_of_offsets),
        cmocka_unit_test(points_without_a_tangent_stay_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
