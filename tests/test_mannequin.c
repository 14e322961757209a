// Promises of messages/mannequin.h.
#include "messages/mannequin.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on
#include <stdlib.h>
#include <xxhash.h>

#define SKIN ((Vec3){0.5f, 0.35f, 0.28f})

static HeadMesh made;

static int make_mesh(void** state)
{
    (void)state;
    Fault fault = {0};
    return mannequin_mesh(&made, 1.0f, SKIN, &fault) ? 0 : -1;
}

static int free_mesh(void** state)
{
    (void)state;
    head_mesh_free(&made);
    return 0;
}

static Vec3 corner(int index)
{
    return made.positions[made.indices[index]];
}

// Where the ray from `from` towards the head's middle plane meets the surface.
static Vec3 march(Vec3 from, Vec3 direction)
{
    for (int i = 0; i < 200; ++i)
        from = vec3_mad(from, direction, 0.7f * mannequin_distance(from));
    return from;
}

static void assert_near(float value, float wanted, float tolerance)
{
    if (fabsf(value - wanted) > tolerance)
        fail_msg("%g is not within %g of %g", (double)value, (double)tolerance, (double)wanted);
}

static void mannequin_has_human_proportions(void** state)
{
    (void)state;
    float crown = march(vec3(0, 0.4f, -0.015f), vec3(0, -1, 0)).y;
    float chin = march(vec3(0, 0.109f, 0.2f), vec3(0, 0, -1)).z;
    float side = march(vec3(0.2f, 0.25f, -0.015f), vec3(-1, 0, 0)).x;
    float back = march(vec3(0, 0.24f, -0.3f), vec3(0, 0, 1)).z;
    float forehead = march(vec3(0, 0.26f, 0.3f), vec3(0, 0, -1)).z;
    float tip = march(vec3(0, 0.178f, 0.3f), vec3(0, 0, -1)).z;
    assert_near(crown, 0.325f, 0.004f);
    assert_near(2.0f * side, 0.155f, 0.008f);
    assert_near(forehead - back, 0.190f, 0.012f);
    assert_true(chin > 0.06f); // there is a chin at y = 0.109 ...
    assert_true(mannequin_distance(vec3(0, 0.100f, 0.080f)) > 0.0f); // ... and air below it
    assert_true(tip > forehead + 0.015f);
    assert_true(mannequin_distance(vec3(0, 0.0f, -0.03f)) < 0.0f);       // neck
    assert_true(mannequin_distance(vec3(0.13f, -0.05f, -0.04f)) < 0.0f); // shoulder
    assert_true(mannequin_distance(vec3(0.0f, -0.13f, -0.03f)) > 0.0f);  // cut off
}

static void mannequin_is_mirror_symmetric(void** state)
{
    (void)state;
    for (int i = 0; i < made.vertex_count; i += 7) {
        Vec3 p = vec3_mad(made.positions[i], made.normals[i], 0.003f);
        float right = mannequin_distance(p), left = mannequin_distance(vec3(-p.x, p.y, p.z));
        assert_true(right == left);
    }
}

static void mannequin_distance_is_a_distance_near_the_surface(void** state)
{
    (void)state;
    int wrong = 0;
    for (int i = 0; i < made.vertex_count; ++i) {
        float d = mannequin_distance(vec3_mad(made.positions[i], made.normals[i], 0.005f));
        // Concave corners (behind the ear, lids) are nearer to another part of the surface.
        wrong += d < 0.002f || d > 0.0068f;
    }
    assert_true(wrong < made.vertex_count / 25);
}

static void mannequin_project_lands_on_the_surface(void** state)
{
    (void)state;
    for (int i = 0; i < made.vertex_count; i += 5) {
        if (mannequin_scalp(made.positions[i]) < 0.5f) continue;
        Vec3 off = vec3_mad(made.positions[i], made.normals[i], i % 2 ? 0.02f : -0.01f);
        Vec3 on = mannequin_project(off, 0.0f), above = mannequin_project(off, 0.008f);
        assert_near(mannequin_distance(on), 0.0f, 0.00002f);
        assert_near(vec3_length(vec3_sub(above, on)), 0.008f, 0.00001f);
        if (on.y > 0.25f)
            assert_near(mannequin_distance(above), 0.008f, 0.0008f); // clear of the ears
    }
}

static void mannequin_mesh_lies_on_the_surface(void** state)
{
    (void)state;
    assert_true(made.vertex_count > 8000 && made.vertex_count < 20000);
    for (int i = 0; i < made.vertex_count; ++i) {
        assert_near(mannequin_distance(made.positions[i]), 0.0f, 0.0003f);
        assert_near(vec3_length(made.normals[i]), 1.0f, 0.0001f);
    }
    assert_int_equal(made.part_count, 1);
    assert_true(made.parts[0].is_skin);
    assert_int_equal(made.parts[0].first_index, 0);
    assert_int_equal(made.parts[0].index_count, made.index_count);
    assert_true(made.parts[0].albedo.x == SKIN.x && made.parts[0].albedo.z == SKIN.z);
}

static int compare_edges(const void* a, const void* b)
{
    uint64_t x = *(const uint64_t*)a, y = *(const uint64_t*)b;
    return x < y ? -1 : x > y;
}

// Closed and oriented: the directed edges are exactly their own reverses.
static void mannequin_mesh_is_closed(void** state)
{
    (void)state;
    int count = made.index_count;
    uint64_t* edges = malloc(2 * (size_t)count * sizeof *edges);
    uint64_t* reversed = edges + count;
    for (int i = 0; i < count; ++i) {
        uint32_t a = made.indices[i], b = made.indices[i % 3 == 2 ? i - 2 : i + 1];
        assert_true(a < (uint32_t)made.vertex_count && a != b);
        edges[i] = (uint64_t)a << 32 | b;
        reversed[i] = (uint64_t)b << 32 | a;
    }
    qsort(edges, (size_t)count, sizeof *edges, compare_edges);
    qsort(reversed, (size_t)count, sizeof *edges, compare_edges);
    assert_memory_equal(edges, reversed, (size_t)count * sizeof *edges);
    free(edges);
}

static void mannequin_mesh_faces_outwards(void** state)
{
    (void)state;
    double volume = 0.0;
    int flipped = 0;
    for (int i = 0; i < made.index_count; i += 3) {
        Vec3 a = corner(i), b = corner(i + 1), c = corner(i + 2);
        Vec3 n = vec3_cross(vec3_sub(b, a), vec3_sub(c, a));
        volume += (double)vec3_dot(a, vec3_cross(b, c)) / 6.0;
        flipped += vec3_dot(n, made.normals[made.indices[i]]) < 0.0f;
    }
    assert_true(volume > 0.006 && volume < 0.015);     // cubic metres: head, neck, shoulders
    assert_true(flipped < made.index_count / 3 / 500); // slivers inside the ears
}

static void mannequin_scalp_ends_at_the_hairline(void** state)
{
    (void)state;
    Vec3 brow = march(vec3(0, 0.28f, 0.3f), vec3(0, 0, -1));
    Vec3 above = march(vec3(0, 0.302f, 0.3f), vec3(0, 0, -1));
    Vec3 nape = march(vec3(0, 0.152f, -0.3f), vec3(0, 0, 1));
    Vec3 neck = march(vec3(0, 0.132f, -0.3f), vec3(0, 0, 1));
    Vec3 cheek = march(vec3(0.3f, 0.19f, 0.03f), vec3(-1, 0, 0));
    Vec3 ear = march(vec3(0.3f, 0.205f, -0.02f), vec3(-1, 0, 0));
    Vec3 over_ear = march(vec3(0.3f, 0.255f, -0.01f), vec3(-1, 0, 0));
    assert_true(mannequin_scalp(brow) == 0.0f && mannequin_scalp(above) == 1.0f);
    assert_true(mannequin_scalp(neck) == 0.0f && mannequin_scalp(nape) > 0.9f);
    assert_true(mannequin_scalp(cheek) == 0.0f && mannequin_scalp(ear) == 0.0f);
    assert_true(mannequin_scalp(over_ear) == 1.0f);
    assert_true(mannequin_scalp(vec3(0, 0.325f, 0)) == 1.0f); // the crown is no exception
}

static void mannequin_colliders_fit_scalp_and_neck(void** state)
{
    (void)state;
    Collider spheres[HAIRSTYLE_MAX_COLLIDERS];
    int count = mannequin_colliders(spheres, HAIRSTYLE_MAX_COLLIDERS);
    assert_true(count >= 6 && count <= 12);
    assert_int_equal(mannequin_colliders(spheres, 3), 3);
    count = mannequin_colliders(spheres, HAIRSTYLE_MAX_COLLIDERS);
    for (int i = 0; i < made.vertex_count; ++i) {
        Vec3 p = made.positions[i];
        float gap = 1.0f;
        for (int s = 0; s < count; ++s) {
            float d = vec3_length(vec3_sub(p, spheres[s].from)) - spheres[s].radius;
            gap = d < gap ? d : gap;
        }
        assert_true(gap > -0.0025f); // no sphere stands out of the skin
        if (mannequin_scalp(p) > 0.5f) assert_true(gap < 0.005f);
    }
}

// The literal holds over compilers, -O levels and machines; it changes only when the head does.
static void mannequin_mesh_is_the_same_bits_everywhere(void** state)
{
    (void)state;
    XXH64_hash_t hash =
        XXH64(made.positions, (size_t)made.vertex_count * sizeof *made.positions, 0) ^
        XXH64(made.normals, (size_t)made.vertex_count * sizeof *made.normals, 1) ^
        XXH64(made.indices, (size_t)made.index_count * sizeof *made.indices, 2);
    assert_int_equal(hash, 0x6684c1feae6203a3ull);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mannequin_has_human_proportions),
        cmocka_unit_test(mannequin_is_mirror_symmetric),
        cmocka_unit_test(mannequin_distance_is_a_distance_near_the_surface),
        cmocka_unit_test(mannequin_project_lands_on_the_surface),
        cmocka_unit_test(mannequin_mesh_lies_on_the_surface),
        cmocka_unit_test(mannequin_mesh_is_closed),
        cmocka_unit_test(mannequin_mesh_faces_outwards),
        cmocka_unit_test(mannequin_scalp_ends_at_the_hairline),
        cmocka_unit_test(mannequin_colliders_fit_scalp_and_neck),
        cmocka_unit_test(mannequin_mesh_is_the_same_bits_everywhere),
    };
    return cmocka_run_group_tests(tests, make_mesh, free_mesh);
}
