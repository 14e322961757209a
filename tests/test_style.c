// Promises of messages/hairstyle.h and messages/style.h.
#include "messages/bytes.h"
#include "messages/random.h"
#include "messages/style.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <stdio.h>
#include <stdlib.h>
#include <zlib.h>

#define CORRUPTIONS 20000u
#define HEAD_EDGE_M 0.3f

static void fill_guides(Hairstyle* s)
{
    for (int g = 0; g < s->guide_count; ++g)
        for (int n = 0; n < s->nodes; ++n)
            s->rest[g * s->nodes + n] =
                vec3(0.01f * (float)g, 0.3f - 0.02f * (float)n, 0.001f * (float)(n * n));
    hairstyle_fit_box(s);
}

static void fill_strands(Hairstyle* s, const StrandSet* set)
{
    s->strand_count = set->strand_count;
    s->offset_count = set->strand_count * set->points;
    s->offset_scale_m = 1e-5f;
    s->strands = calloc((size_t)s->strand_count, sizeof *s->strands);
    s->offsets = calloc((size_t)s->offset_count, sizeof *s->offsets);
    for (int i = 0; i < s->strand_count; ++i) {
        uint16_t a = (uint16_t)(random_hash((uint32_t)i) % 30000);
        uint16_t first = (uint16_t)set->first_guide;
        s->strands[i] =
            (BoundStrand){.guide = {first, (uint16_t)(first + 1), (uint16_t)(first + 2)},
                          .weight = {a, 20000, (uint16_t)(65535 - 20000 - a)},
                          .tip_height = (uint16_t)(60000 + i)};
    }
    for (int i = 0; i < s->offset_count; ++i)
        s->offsets[i] = (StrandOffset){(int16_t)random_hash((uint32_t)i), (int16_t)(i * 7 - 50),
                                       (int16_t)(i % 2 ? -32768 : 32767)};
}

static void fill_head(HeadMesh* mesh)
{
    static const uint32_t faces[12] = {0, 1, 2, 0, 2, 3, 0, 3, 1, 3, 2, 1};
    mesh->vertex_count = 4;
    mesh->index_count = 12;
    mesh->positions = calloc(4, sizeof *mesh->positions);
    mesh->normals = calloc(4, sizeof *mesh->normals);
    mesh->indices = malloc(sizeof faces);
    memcpy(mesh->indices, faces, sizeof faces);
    for (int i = 0; i < 4; ++i) {
        Vec3 p = {i == 1 ? HEAD_EDGE_M : 0, i == 2 ? 0.2f : 0.05f, i == 3 ? -0.1f : 0};
        mesh->positions[i] = p;
        mesh->normals[i] = vec3_normalise_or(vec3_sub(p, vec3(0.07f, 0.06f, -0.03f)), p);
    }
    mesh->part_count = 2;
    mesh->parts[0] = (HeadPart){0, 6, {0.5f, 0.4f, 0.3f}, true};
    mesh->parts[1] = (HeadPart){6, 6, {0.1f, 0.1f, 0.1f}, false};
}

// Something of everything, small enough to try every byte of it.
static Hairstyle* small_style(void)
{
    Hairstyle* s = hairstyle_create();
    assert_true(hairstyle_set_guides(s, 7, 3, NULL));
    fill_guides(s);
    snprintf(s->name, sizeof s->name, "small");
    s->seed = 4711;
    s->triangle_count = 2;
    s->triangles = calloc(2, sizeof *s->triangles);
    s->triangles[0] = (ScalpTriangle){{0, 1, 2}};
    s->triangles[1] = (ScalpTriangle){{1, 2, 3}};
    s->set_count = 2;
    s->sets[0] =
        (StrandSet){"grown", STRANDS_GROWN, 0, 4, 0, 2, 0, 100, 0, 8, 1e-3f, 2e-4f, 6, 3e-3f};
    s->sets[1] = (StrandSet){"tail", STRANDS_EXPLICIT, 4, 3, 0, 0, 0, 5, 0, 6, 1e-4f, 1e-5f, 1, 0};
    fill_strands(s, &s->sets[1]);
    s->collider_count = 1;
    s->colliders[0] = collider_sphere((Sphere){{0, 0.2f, 0}, 0.1f});
    s->colliders[s->collider_count++] = (Collider){{0, 0, 0}, {0.1f, 0.01f, 0}, 0.05f, BODY_TORSO};
    s->hold_count = 2;
    s->holds[0] = (Hold){HOLD_BAND, 0, 4, 1};
    s->holds[1] = (Hold){HOLD_CLOTH, 4, 3, 0};
    s->forms[0] = (WispForm){0.1f, 0.2f, 0.01f, -3.0f, 0.4f, 0.5f, 0.6f};
    s->forms[1] = (WispForm){.taper = 0.7f};
    s->magnet_count = 2;
    s->magnets[0] = (Magnet){{0.1f, 0.2f, 0.3f}, 0.04f, -0.5f};
    s->magnets[1] = (Magnet){{-0.1f, 0.25f, 0}, 0.03f, 1.0f};
    assert_true(hairstyle_add_maps(s, NULL));
    for (int i = 0; i < s->guide_count * MAP_COUNT; ++i)
        s->maps[i] = (uint8_t)(3 * i);
    s->head_kind = HEAD_MESH;
    s->head_centre = vec3(0, 0.216f, 0);
    fill_head(&s->head);
    Fault fault = {0};
    if (!hairstyle_validate(s, &fault)) fail_msg("%s", fault.text);
    return s;
}

static StyleBytes encode(const Hairstyle* style)
{
    StyleBytes bytes;
    Fault fault = {0};
    if (!style_encode(&bytes, style, &fault)) fail_msg("%s", fault.text);
    return bytes;
}

// From its own allocation, so that AddressSanitizer sees a read past the end.
static Hairstyle* decode_fast(const uint8_t* bytes, size_t size, Fault* fault)
{
    uint8_t* copy = malloc(size > 0 ? size : 1);
    memcpy(copy, bytes, size);
    size_t bulk_size;
    uint64_t bulk_hash;
    Hairstyle* style = style_decode_fast(copy, size, &bulk_size, &bulk_hash, fault);
    free(copy);
    return style;
}

static bool decode_bulk(Hairstyle* style, const uint8_t* bytes, size_t size, Fault* fault)
{
    uint8_t* copy = malloc(size > 0 ? size : 1);
    memcpy(copy, bytes, size);
    bool decoded = style_decode_bulk(style, copy, size, fault);
    free(copy);
    return decoded;
}

// Hairstyle -------------------------------------------------------------------------------------

static void hairstyle_box_holds_every_pose_of_its_guides(void** state)
{
    (void)state;
    Hairstyle* s = small_style();
    for (int g = 0; g < s->guide_count; ++g) {
        Vec3 root = s->rest[g * s->nodes];
        float reach = hairstyle_guide_length(s, g) * HAIRSTYLE_SCALE_LENGTH;
        assert_true(root.x - reach >= s->box.low.x && root.x + reach <= s->box.high.x);
        assert_true(root.y - reach >= s->box.low.y && root.y + reach <= s->box.high.y);
        assert_true(root.z - reach >= s->box.low.z && root.z + reach <= s->box.high.z);
    }
    assert_true(s->box.high.x - s->box.low.x < 0.06f + 2.2f * 0.05f); // and not more than that
    hairstyle_destroy(s);
}

static bool break_hold(Hairstyle* s, int what)
{
    const Hold wrong[] = {{3, 0, 4, 1}, {HOLD_BAND, 0, 4, 3},  {HOLD_BAND, 0, 4, -1},
                          {0, 0, 4, 1}, {HOLD_CLOTH, 4, 4, 0}, {HOLD_CLOTH, -1, 3, 0}};
    int count = (int)(sizeof wrong / sizeof wrong[0]);
    if (what < count) s->holds[0] = wrong[what];
    if (what == count) s->hold_count = HAIRSTYLE_MAX_HOLDS + 1;
    if (what == count + 1) s->colliders[1].body = BODY_COUNT;
    return what >= 0 && what <= count + 1;
}

static bool break_form(Hairstyle* s, int what)
{
    const WispForm wrong[] = {
        {.belly = -0.1f},         {.taper = 1.1f},           {.curl_radius_m = NAN},
        {.curl_turns = INFINITY}, {.curl_stiffness = -0.1f}, {.rotation_rad = 7.0f},
        {.clump = 1.5f}};
    const Magnet magnets[] = {
        {{NAN, 0, 0}, 0.1f, 1.0f}, {{0, 0, 0}, -0.1f, 1.0f}, {{0, 0, 0}, 0.1f, 1.1f}};
    int forms = (int)(sizeof wrong / sizeof wrong[0]);
    if (what < 0 || what > forms + 3) return false;
    if (what < forms)
        s->forms[1] = wrong[what];
    else if (what < forms + 3)
        s->magnets[1] = magnets[what - forms];
    else
        s->magnet_count = HAIRSTYLE_MAX_MAGNETS + 1;
    return true;
}

// Each breaks one thing; the audit must see it.
static void break_style(Hairstyle* s, int what)
{
    switch (what) {
    case 0:
        s->rest[4].y = NAN;
        break;
    case 1:
        s->rest[4].x = 1e6f;
        break;
    case 2:
        s->box.high.x = s->box.low.x;
        break;
    case 3:
        s->box.low.z = NAN;
        break;
    case 4:
        memset(s->name, 'x', sizeof s->name);
        break;
    case 5:
        s->name[0] = '\n';
        break;
    case 6:
        s->guide_count = 0;
        break;
    case 7:
        s->nodes = 2;
        break;
    case 8:
        s->triangles[1].guide[2] = 4;
        break; // of the other set
    case 9:
        s->triangles[1].guide[2] = 900;
        break; // of none
    case 10:
        s->sets[0].guide_count = 5;
        break; // overlap
    case 11:
        s->sets[0].guide_count = 3;
        break; // gap
    case 12:
        s->sets[0].kind = 3;
        break;
    case 13:
        s->sets[0].first_triangle = -1;
        break;
    case 14:
        s->sets[0].triangle_count = INT32_MAX;
        break;
    case 15:
        s->sets[1].points = 65;
        break;
    case 16:
        s->sets[1].first_offset = 1;
        break;
    case 17:
        s->sets[1].strand_count = 4;
        break;
    case 18:
        s->sets[1].root_width_m = -1;
        break;
    case 19:
        s->sets[1].fibres = NAN;
        break;
    case 20:
        s->strands[2].guide[1] = 3;
        break;
    case 21:
        s->strands[2].weight[1] += 1;
        break;
    case 22:
        s->offset_count -= 1;
        break;
    case 23:
        s->offset_scale_m = INFINITY;
        break;
    case 24:
        s->colliders[0].radius = NAN;
        break;
    case 25:
        s->collider_count = HAIRSTYLE_MAX_COLLIDERS + 1;
        break;
    case 26:
        s->material.tip_colour.y = 1.5f;
        break;
    case 27:
        s->head_kind = 3;
        break;
    case 28:
        s->head.indices[5] = 4;
        break;
    case 29:
        s->head.positions[2].z = INFINITY;
        break;
    case 30:
        s->head.normals[2].z = NAN;
        break;
    case 31:
        s->head.parts[1].index_count = 9;
        break;
    case 32:
        s->head.parts[1].first_index = 0xfffffffcu;
        break;
    case 33:
        s->head.index_count = 11;
        break;
    case 34:
        s->set_count = 0;
        break;
    case 35:
        s->sets[1].jitter_m = NAN;
        break;
    case 36:
        s->head_centre.x = NAN;
        break;
    case 37: // an overlap and a gap, while the counts still add up
        s->sets[1].first_guide = 3;
        for (int i = 0; i < s->strand_count; ++i)
            s->strands[i].guide[0] = s->strands[i].guide[1] = s->strands[i].guide[2] = 4;
        break;
    default:
        assert_true(break_hold(s, what - 38) || break_form(s, what - 46));
    }
}

static void hairstyle_validate_sees_every_broken_thing(void** state)
{
    (void)state;
    for (int what = 0; what <= 56; ++what) {
        Hairstyle* s = small_style();
        break_style(s, what);
        Fault fault = {0};
        if (hairstyle_validate(s, &fault)) fail_msg("break %d passed", what);
        assert_true(fault.text[0] != '\0');
        StyleBytes bytes;
        assert_false(style_encode(&bytes, s, NULL));
        assert_null(bytes.lane[STYLE_FAST]);
        hairstyle_destroy(s);
    }
}

// Round trip ------------------------------------------------------------------------------------

static void compare_head(const HeadMesh* a, const HeadMesh* b)
{
    assert_int_equal(a->vertex_count, b->vertex_count);
    assert_int_equal(a->index_count, b->index_count);
    assert_int_equal(a->part_count, b->part_count);
    assert_memory_equal(a->indices, b->indices, sizeof *a->indices * (size_t)a->index_count);
    for (int i = 0; i < a->part_count; ++i) {
        assert_int_equal(a->parts[i].first_index, b->parts[i].first_index);
        assert_int_equal(a->parts[i].index_count, b->parts[i].index_count);
        assert_int_equal(a->parts[i].is_skin, b->parts[i].is_skin);
        assert_memory_equal(&a->parts[i].albedo, &b->parts[i].albedo, sizeof(Vec3));
    }
    for (int i = 0; i < a->vertex_count; ++i) {
        assert_true(vec3_length(vec3_sub(a->positions[i], b->positions[i])) < 5e-6f);
        // 0.1 degrees (shared/tables/quant.csv: xyz snorm10)
        assert_true(vec3_length(vec3_sub(a->normals[i], b->normals[i])) < 0.0017f);
    }
}

static void style_round_trip_keeps_everything(void** state)
{
    (void)state;
    Hairstyle* a = small_style();
    StyleBytes bytes = encode(a);
    size_t bulk_size;
    uint64_t bulk_hash;
    Hairstyle* b = style_decode_fast(bytes.lane[0], bytes.size[0], &bulk_size, &bulk_hash, NULL);
    assert_non_null(b);
    assert_int_equal(bulk_size, bytes.size[STYLE_BULK]);
    assert_true(bulk_hash == style_hash(bytes.lane[STYLE_BULK], bytes.size[STYLE_BULK]));
    assert_true(bytes.hash == style_hash(bytes.lane[STYLE_FAST], bytes.size[STYLE_FAST]));
    assert_int_equal(b->strand_count, 0);
    assert_true(style_decode_bulk(b, bytes.lane[1], bytes.size[1], NULL));
    assert_string_equal(a->name, b->name);
    assert_int_equal(a->seed, b->seed);
    assert_int_equal(a->nodes, b->nodes);
    assert_memory_equal(a->rest, b->rest, sizeof(Vec3) * 21);
    assert_memory_equal(a->weight, b->weight, 21);
    assert_memory_equal(a->sets, b->sets, sizeof a->sets[0] * 2);
    assert_memory_equal(a->triangles, b->triangles, sizeof(ScalpTriangle) * 2);
    assert_memory_equal(a->colliders, b->colliders, sizeof(Collider) * 2);
    assert_int_equal(b->hold_count, 2);
    assert_memory_equal(a->holds, b->holds, sizeof(Hold) * 2);
    assert_memory_equal(a->forms, b->forms, sizeof(WispForm) * 2);
    assert_int_equal(b->magnet_count, 2);
    assert_memory_equal(a->magnets, b->magnets, sizeof(Magnet) * 2);
    assert_non_null(b->maps);
    assert_memory_equal(a->maps, b->maps, 7 * MAP_COUNT);
    assert_memory_equal(&a->material, &b->material, sizeof a->material);
    assert_memory_equal(&a->box, &b->box, sizeof a->box);
    assert_memory_equal(&a->head_centre, &b->head_centre, sizeof a->head_centre);
    assert_int_equal(a->head_kind, b->head_kind);
    assert_true(a->offset_scale_m == b->offset_scale_m);
    assert_memory_equal(a->strands, b->strands, sizeof(BoundStrand) * 5);
    assert_memory_equal(a->offsets, b->offsets, sizeof(StrandOffset) * 30);
    compare_head(&a->head, &b->head);
    hairstyle_destroy(a);
    hairstyle_destroy(b);
    style_bytes_free(&bytes);
}

// A style without them is sent without them, and its wisps are as a neutral map would have them.
static void style_without_maps_carries_none(void** state)
{
    (void)state;
    Hairstyle* s = small_style();
    StyleBytes with = encode(s);
    free(s->maps);
    s->maps = NULL;
    StyleBytes without = encode(s);
    assert_int_equal(with.size[STYLE_FAST] - without.size[STYLE_FAST], 7 * MAP_COUNT);
    Hairstyle* b = decode_fast(without.lane[0], without.size[0], NULL);
    assert_non_null(b);
    assert_null(b->maps);
    hairstyle_destroy(b);
    hairstyle_destroy(s);
    style_bytes_free(&with);
    style_bytes_free(&without);
}

static void style_identity_ignores_bytes_behind_names_and_sees_both_lanes(void** state)
{
    (void)state;
    Hairstyle* s = small_style();
    StyleBytes plain = encode(s);
    s->name[20] = 'x';
    s->sets[0].name[31] = 'y';
    StyleBytes dirty = encode(s);
    assert_true(plain.hash == dirty.hash);
    s->offsets[3].y += 1;
    StyleBytes other = encode(s);
    assert_true(plain.hash != other.hash);
    hairstyle_destroy(s);
    style_bytes_free(&plain);
    style_bytes_free(&dirty);
    style_bytes_free(&other);
}

static void style_of_grown_sets_needs_no_bulk_lane(void** state)
{
    (void)state;
    Hairstyle* s = hairstyle_create();
    assert_true(hairstyle_set_guides(s, 64, 8, NULL));
    fill_guides(s);
    s->triangle_count = s->set_count = 1;
    s->triangles = calloc(1, sizeof *s->triangles);
    s->triangles[0] = (ScalpTriangle){{0, 1, 63}};
    s->sets[0] = (StrandSet){"all", STRANDS_GROWN, 0, 64, 0, 1, 0, 10, 0, 8, 1e-3f, 1e-4f, 6, 0};
    StyleBytes bytes = encode(s);
    assert_int_equal(bytes.size[STYLE_BULK], 0);
    assert_true(bytes.size[STYLE_FAST] < 7500);
    Hairstyle* b = decode_fast(bytes.lane[0], bytes.size[0], NULL);
    assert_non_null(b);
    style_bytes_free(&bytes);
    hairstyle_destroy(b);
    hairstyle_destroy(s);
}

static void style_too_large_for_the_fast_lane_says_what_to_cut(void** state)
{
    (void)state;
    Hairstyle* s = small_style();
    assert_true(hairstyle_set_guides(s, 1024, 32, NULL));
    fill_guides(s);
    s->sets[1].guide_count = 1020;
    StyleBytes bytes;
    Fault fault = {0};
    assert_false(style_encode(&bytes, s, &fault));
    assert_non_null(strstr(fault.text, "fewer guides or nodes"));
    hairstyle_destroy(s);
}

static void style_whose_bulk_lane_has_not_come_cannot_be_encoded(void** state)
{
    (void)state;
    Hairstyle* s = small_style();
    StyleBytes bytes = encode(s), again;
    Hairstyle* half = decode_fast(bytes.lane[0], bytes.size[0], NULL);
    assert_non_null(half);
    assert_false(style_encode(&again, half, NULL));
    hairstyle_destroy(half);
    hairstyle_destroy(s);
    style_bytes_free(&bytes);
}

// Hostile bytes ---------------------------------------------------------------------------------

static void style_decode_rejects_every_truncation(void** state)
{
    (void)state;
    Hairstyle* s = small_style();
    StyleBytes bytes = encode(s);
    for (size_t size = 0; size < bytes.size[STYLE_FAST]; ++size)
        assert_null(decode_fast(bytes.lane[STYLE_FAST], size, NULL));
    for (size_t size = 0; size < bytes.size[STYLE_BULK]; ++size)
        assert_false(decode_bulk(s, bytes.lane[STYLE_BULK], size, NULL));
    uint8_t* longer = calloc(1, bytes.size[STYLE_FAST] + 1);
    memcpy(longer, bytes.lane[STYLE_FAST], bytes.size[STYLE_FAST]);
    assert_null(decode_fast(longer, bytes.size[STYLE_FAST] + 1, NULL));
    free(longer);
    hairstyle_destroy(s);
    style_bytes_free(&bytes);
}

static void corrupt(uint8_t* bytes, size_t size, uint32_t n)
{
    static const uint8_t nasty[] = {0x00, 0x01, 0x7f, 0x80, 0xff, 0xc0, 0x40};
    int changes = 1 + (int)(random_hash2(n, 1) % 3);
    for (int i = 0; i < changes; ++i) {
        uint32_t r = random_hash2(n, 2 + (uint32_t)i);
        bytes[(r >> 8) % size] = r & 1 ? nasty[(r >> 1) % sizeof nasty] : (uint8_t)(r >> 1);
    }
}

static void style_decode_fast_survives_corruption(void** state)
{
    (void)state;
    Hairstyle* s = small_style();
    StyleBytes bytes = encode(s);
    size_t size = bytes.size[STYLE_FAST];
    uint8_t* damaged = malloc(size);
    int refused = 0;
    for (uint32_t n = 0; n < CORRUPTIONS; ++n) {
        memcpy(damaged, bytes.lane[STYLE_FAST], size);
        corrupt(damaged, size, n);
        Fault fault = {0};
        Hairstyle* b = decode_fast(damaged, size, &fault);
        assert_true((b == NULL) == (fault.text[0] != '\0'));
        refused += b == NULL;
        // A changed number may still be a style; then it must be a sound one, and its bulk lane
        // either fits it or is refused.
        if (b != NULL) {
            decode_bulk(b, bytes.lane[STYLE_BULK], bytes.size[STYLE_BULK], NULL);
            assert_true(hairstyle_validate(b, NULL));
        }
        hairstyle_destroy(b);
    }
    assert_true(refused > (int)CORRUPTIONS / 10);
    free(damaged);
    hairstyle_destroy(s);
    style_bytes_free(&bytes);
}

static void style_decode_bulk_survives_corruption_and_leaves_the_style_alone(void** state)
{
    (void)state;
    Hairstyle* s = small_style();
    StyleBytes bytes = encode(s);
    Hairstyle* target = decode_fast(bytes.lane[0], bytes.size[0], NULL);
    size_t size = bytes.size[STYLE_BULK];
    uint8_t* damaged = malloc(size);
    for (uint32_t n = 0; n < CORRUPTIONS; ++n) {
        memcpy(damaged, bytes.lane[STYLE_BULK], size);
        corrupt(damaged, size, n);
        if (memcmp(damaged, bytes.lane[STYLE_BULK], size) == 0) continue;
        Fault fault = {0};
        if (decode_bulk(target, damaged, size, &fault)) continue; // dead bits of deflate
        assert_true(fault.text[0] != '\0');
        assert_true(hairstyle_validate(target, NULL));
    }
    free(damaged);
    hairstyle_destroy(target);
    hairstyle_destroy(s);
    style_bytes_free(&bytes);
}

static size_t deflate_raw(uint8_t* lane, const uint8_t* raw, size_t size, uint32_t announced)
{
    uLongf deflated = 8192;
    assert_int_equal(compress2(lane + 4, &deflated, raw, size, 1), Z_OK);
    memcpy(lane, &announced, 4);
    return deflated + 4;
}

// Corruption under the checksum: what somebody sends who knows the format.
static void style_decode_bulk_survives_crafted_contents(void** state)
{
    (void)state;
    Hairstyle* s = small_style();
    StyleBytes bytes = encode(s);
    uint32_t announced;
    memcpy(&announced, bytes.lane[1], 4);
    uLongf size = announced;
    uint8_t *raw = malloc(size), *damaged = malloc(size), lane[8200];
    assert_int_equal(uncompress(raw, &size, bytes.lane[1] + 4, bytes.size[1] - 4), Z_OK);
    int refused = 0;
    for (uint32_t n = 0; n < CORRUPTIONS; ++n) {
        memcpy(damaged, raw, size);
        corrupt(damaged, n % 2 ? size : 180, n); // every other one in the counts
        refused += !decode_bulk(s, lane, deflate_raw(lane, damaged, size, announced), NULL);
        assert_true(hairstyle_validate(s, NULL));
    }
    assert_true(refused > (int)CORRUPTIONS / 4);
    // Too little and too much of sound contents.
    uint8_t longer[4096] = {0};
    assert_true(size + 8 <= sizeof longer);
    memcpy(longer, raw, size);
    assert_false(decode_bulk(s, lane, deflate_raw(lane, raw, size - 8, announced), NULL));
    assert_false(decode_bulk(s, lane, deflate_raw(lane, longer, size + 8, announced + 8), NULL));
    assert_true(decode_bulk(s, lane, deflate_raw(lane, raw, size, announced), NULL));
    free(raw);
    free(damaged);
    hairstyle_destroy(s);
    style_bytes_free(&bytes);
}

static void style_decode_bulk_never_inflates_beyond_what_was_announced(void** state)
{
    (void)state;
    Hairstyle* s = small_style();
    size_t size = 32u * 1024 * 1024;
    uint8_t* zeros = calloc(1, size);
    uint8_t* lane = malloc(1 << 20);
    uLongf deflated = (1 << 20) - 4;
    assert_int_equal(compress2(lane + 4, &deflated, zeros, size, 9), Z_OK);
    const uint32_t claims[] = {0, 44, 1000, 16u << 20, (16u << 20) + 1, 32u << 20, UINT32_MAX};
    for (size_t i = 0; i < sizeof claims / sizeof claims[0]; ++i) {
        memcpy(lane, &claims[i], 4);
        assert_false(style_decode_bulk(s, lane, deflated + 4, NULL));
    }
    free(zeros);
    free(lane);
    hairstyle_destroy(s);
}

// The real groom --------------------------------------------------------------------------------

#define ASSETS SOURCE_DIR "/../shared/assets/"
#define POINTS 16

// Appends a .tfx file's strands: the header's counts, then x y z of every point (FORMAT.md 2).
static int read_strands(const char* path, Vec3* points, int capacity)
{
    FILE* file = fopen(path, "rb");
    if (file == NULL) return 0;
    struct {
        float version;
        uint32_t strands, points, others[33], offset;
    } header;
    assert_int_equal(fread(&header, sizeof header, 1, file), 1);
    assert_int_equal(header.points, POINTS);
    fseek(file, (long)header.offset, SEEK_SET);
    int count = (int)header.strands;
    assert_true(count <= capacity);
    for (int i = 0; i < count * POINTS; ++i) {
        float p[3];
        assert_int_equal(fread(p, sizeof p, 1, file), 1);
        points[i] = vec3(p[0], p[1], p[2]);
    }
    fclose(file);
    return count;
}

static int read_groom(Vec3* points, int capacity)
{
    static const char* const files[] = {"ponytail_back.tfx", "ponytail_front_top.tfx",
                                        "ponytail_side.tfx", "ponytail_tail_v31.tfx"};
    int count = 0;
    for (int i = 0; i < 4; ++i) {
        char path[512];
        snprintf(path, sizeof path, ASSETS "%s", files[i]);
        count += read_strands(path, points + count * POINTS, capacity - count);
    }
    return count;
}

// A binding in the manner of server/bind.c: what is left of a strand beside the nearest of 128
// guides, in units that spend all of 16 bits, which is the hardest case for the coder.
static void bind_groom(Hairstyle* s, const Vec3* points, int count)
{
    s->strands = calloc((size_t)count, sizeof *s->strands);
    s->offsets = calloc((size_t)count * POINTS, sizeof *s->offsets);
    float largest = 0.0f;
    for (int pass = 0; pass < 2; ++pass)
        for (int i = 0; i < count; ++i) {
            int best = 0;
            float least = INFINITY;
            for (int g = 0; g < 128; ++g) {
                int strand = g * count / 128;
                float d = vec3_length(vec3_sub(points[strand * POINTS], points[i * POINTS]));
                if (d < least) {
                    least = d;
                    best = g;
                }
            }
            uint32_t r = random_hash((uint32_t)i);
            uint16_t a = (uint16_t)(r % 30000), b = (uint16_t)((r >> 16) % 30000);
            s->strands[i] = (BoundStrand){{(uint16_t)best, (uint16_t)((best + 1) % 128), 0},
                                          {a, b, (uint16_t)(65535 - a - b)},
                                          (uint16_t)(65535 - r % 3000)};
            for (int k = 0; k < POINTS; ++k) {
                Vec3 d = vec3_sub(points[i * POINTS + k], points[best * count / 128 * POINTS + k]);
                largest = fmaxf(largest, fmaxf(fabsf(d.x), fmaxf(fabsf(d.y), fabsf(d.z))));
                float scale = 32767.0f / largest;
                if (pass == 1)
                    s->offsets[i * POINTS + k] = (StrandOffset){
                        (int16_t)(d.x * scale), (int16_t)(d.y * scale), (int16_t)(d.z * scale)};
            }
        }
    s->strand_count = count;
    s->offset_count = count * POINTS;
    s->offset_scale_m = 1e-6f;
}

// As many vertices and triangles as the real head, in rows, a little rough.
static void make_head(HeadMesh* mesh)
{
    enum { COLUMNS = 128, VERTICES = 11744, TRIANGLES = 17894 };
    mesh->vertex_count = VERTICES;
    mesh->index_count = 3 * TRIANGLES;
    mesh->positions = calloc(VERTICES, sizeof *mesh->positions);
    mesh->normals = calloc(VERTICES, sizeof *mesh->normals);
    mesh->indices = calloc(3 * TRIANGLES, sizeof *mesh->indices);
    for (uint32_t i = 0; i < VERTICES; ++i) {
        float a = (float)(i % COLUMNS) * 0.049f, y = (float)(i / COLUMNS) * 0.003f;
        Vec3 n = vec3(cosf(a), random_signed(9, i) * 0.1f, sinf(a));
        mesh->positions[i] = vec3(n.x * 0.1f, y + random_signed(7, i) * 2e-4f, n.z * 0.1f);
        mesh->normals[i] = n;
    }
    for (uint32_t t = 0; t < TRIANGLES; ++t) {
        uint32_t v = t / 2 % (VERTICES - COLUMNS - 1);
        mesh->indices[3 * t] = v + t % 2;
        mesh->indices[3 * t + 1] = v + COLUMNS + t % 2;
        mesh->indices[3 * t + 2] = v + (t % 2 ? COLUMNS : 1);
    }
}

static void style_of_the_real_groom_is_sent_within_three_seconds(void** state)
{
    (void)state;
    enum { CAPACITY = 6000 };
    Vec3* points = malloc(sizeof *points * CAPACITY * POINTS);
    int count = read_groom(points, CAPACITY);
    if (count == 0) {
        free(points);
        print_message("SKIPPED: no groom under " ASSETS "\n");
        skip();
    }
    assert_int_equal(count, 4933);
    Hairstyle* s = hairstyle_create();
    assert_true(hairstyle_set_guides(s, 128, 8, NULL));
    fill_guides(s);
    s->set_count = 1;
    s->sets[0] =
        (StrandSet){"all", STRANDS_EXPLICIT, 0, 128, 0, 0, 0, count, 0, POINTS, 1e-4f, 1e-5f, 1, 0};
    bind_groom(s, points, count);
    s->head_kind = HEAD_MESH;
    make_head(&s->head);
    StyleBytes bytes = encode(s);
    print_message("the real groom: fast lane %zu bytes, bulk lane %zu bytes\n", bytes.size[0],
                  bytes.size[1]);
    assert_true(bytes.size[STYLE_BULK] < 3 * 256 * 1000);
    assert_true(bytes.size[STYLE_BULK] < 700000);
    Hairstyle* b = decode_fast(bytes.lane[0], bytes.size[0], NULL);
    assert_true(decode_bulk(b, bytes.lane[1], bytes.size[1], NULL));
    assert_memory_equal(b->offsets, s->offsets, sizeof *s->offsets * (size_t)s->offset_count);
    assert_memory_equal(b->strands, s->strands, sizeof *s->strands * (size_t)count);
    hairstyle_destroy(b);
    hairstyle_destroy(s);
    style_bytes_free(&bytes);
    free(points);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hairstyle_box_holds_every_pose_of_its_guides),
        cmocka_unit_test(hairstyle_validate_sees_every_broken_thing),
        cmocka_unit_test(style_round_trip_keeps_everything),
        cmocka_unit_test(style_without_maps_carries_none),
        cmocka_unit_test(style_identity_ignores_bytes_behind_names_and_sees_both_lanes),
        cmocka_unit_test(style_of_grown_sets_needs_no_bulk_lane),
        cmocka_unit_test(style_too_large_for_the_fast_lane_says_what_to_cut),
        cmocka_unit_test(style_whose_bulk_lane_has_not_come_cannot_be_encoded),
        cmocka_unit_test(style_decode_rejects_every_truncation),
        cmocka_unit_test(style_decode_fast_survives_corruption),
        cmocka_unit_test(style_decode_bulk_survives_corruption_and_leaves_the_style_alone),
        cmocka_unit_test(style_decode_bulk_survives_crafted_contents),
        cmocka_unit_test(style_decode_bulk_never_inflates_beyond_what_was_announced),
        cmocka_unit_test(style_of_the_real_groom_is_sent_within_three_seconds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
