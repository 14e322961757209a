// What files from elsewhere may and may not do to us.
#include "messages/random.h"
#include "server/fit.h"
#include "server/import.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define ASSETS SOURCE_DIR "/../shared/assets/"

static bool has_assets(void)
{
    if (access(ASSETS "ponytail_back.tfx", R_OK) == 0) return true;
    print_message("no %s: skipped\n", ASSETS);
    return false;
}

static char file_path[64];

static const char* write_file(const void* bytes, size_t size)
{
    FILE* file = fopen(file_path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
    return file_path;
}

// Tiny grooms -------------------------------------------------------------------------------------

typedef struct Tiny {
    uint8_t bytes[1024];
    size_t size;
    int header, floats;
} Tiny;

static void put_u32(Tiny* tiny, size_t at, uint32_t value)
{
    memcpy(tiny->bytes + at, &value, 4);
}

static void put_f32(Tiny* tiny, size_t at, float value)
{
    memcpy(tiny->bytes + at, &value, 4);
}

static size_t vertex_at(const Tiny* tiny, int strand, int vertex)
{
    return (size_t)(tiny->header + (strand * 4 + vertex) * tiny->floats * 4);
}

// Three strands of four vertices, hanging down from y = 10.
static Tiny make_tiny(int version)
{
    Tiny tiny = {.header = version == 3 ? 296 : 160, .floats = version == 3 ? 3 : 4};
    put_f32(&tiny, 0, (float)version);
    put_u32(&tiny, 4, 3);
    put_u32(&tiny, 8, 4);
    put_u32(&tiny, version == 3 ? 144 : 12, (uint32_t)tiny.header);
    for (int s = 0; s < 3; ++s)
        for (int v = 0; v < 4; ++v) {
            put_f32(&tiny, vertex_at(&tiny, s, v), (float)s);
            put_f32(&tiny, vertex_at(&tiny, s, v) + 4, 10.0f - (float)v);
            put_f32(&tiny, vertex_at(&tiny, s, v) + 8, 0.5f);
            if (version == 4) put_f32(&tiny, vertex_at(&tiny, s, v) + 12, v > 1 ? 1.0f : 0.0f);
        }
    tiny.size = vertex_at(&tiny, 3, 0);
    return tiny;
}

static bool read_tiny(const Tiny* tiny, ImportedStrands* imported, Fault* fault)
{
    return import_tfx(imported, write_file(tiny->bytes, tiny->size), fault);
}

static void assert_refused(const Tiny* tiny, const char* word)
{
    ImportedStrands imported;
    Fault fault = {""};
    assert_false(read_tiny(tiny, &imported, &fault));
    assert_non_null(strstr(fault.text, file_path));
    if (strstr(fault.text, word) == NULL) fail_msg("\"%s\" lacks \"%s\"", fault.text, word);
    assert_null(imported.positions);
}

static void tfx_reads_both_versions(void** state)
{
    (void)state;
    for (int version = 3; version <= 4; ++version) {
        Tiny tiny = make_tiny(version);
        ImportedStrands imported;
        Fault fault;
        assert_true(read_tiny(&tiny, &imported, &fault));
        assert_int_equal(imported.strands, 3);
        assert_int_equal(imported.points, 4);
        assert_true(imported.version == (float)version);
        assert_true(imported.mean_length == 3.0 && imported.total_length == 9.0);
        assert_true(imported.sum[0] == 12.0 && imported.sum[1] == 102.0 && imported.sum[2] == 6.0);
        assert_false(imported.both_ends);
        assert_true(imported.positions[3 * 11] == 2.0f && imported.positions[3 * 11 + 1] == 7.0f);
        import_free(&imported);
    }
}

static void tfx_both_ends_comes_from_flag_or_from_w(void** state)
{
    (void)state;
    ImportedStrands imported;
    Tiny tiny = make_tiny(3);
    put_u32(&tiny, 16, 1);
    assert_true(read_tiny(&tiny, &imported, NULL));
    assert_true(imported.both_ends);
    import_free(&imported);
    tiny = make_tiny(4);
    for (int s = 0; s < 3; ++s) {
        assert_true(read_tiny(&tiny, &imported, NULL));
        assert_false(imported.both_ends); // not before the last strand's tip is fixed too
        import_free(&imported);
        put_f32(&tiny, vertex_at(&tiny, s, 3) + 12, 0.0f);
    }
    assert_true(read_tiny(&tiny, &imported, NULL));
    assert_true(imported.both_ends);
    import_free(&imported);
}

static void tfx_refuses_every_truncation(void** state)
{
    (void)state;
    for (int version = 3; version <= 4; ++version) {
        Tiny tiny = make_tiny(version);
        for (size_t size = tiny.size; size-- > 0;) {
            Tiny cut = tiny;
            cut.size = size;
            assert_refused(&cut, "");
        }
        tiny.size -= 1;
        assert_refused(&tiny, "truncated");
    }
}

static void tfx_refuses_lying_counts(void** state)
{
    (void)state;
    static const uint32_t lies[] = {0, 4, 65537, 0x40000000u, 0x55555556u, 0xffffffffu};
    for (int version = 3; version <= 4; ++version)
        for (size_t i = 0; i < sizeof lies / sizeof *lies; ++i) {
            Tiny tiny = make_tiny(version);
            put_u32(&tiny, 4, lies[i]);
            assert_refused(&tiny, "count");
            tiny = make_tiny(version);
            put_u32(&tiny, 8, lies[i] == 4 ? 5 : lies[i]);
            assert_refused(&tiny, "");
        }
    Tiny one_vertex = make_tiny(3);
    put_u32(&one_vertex, 8, 1);
    assert_refused(&one_vertex, "vertices per strand is 1");
}

static void tfx_refuses_offsets_outside(void** state)
{
    (void)state;
    static const uint32_t offsets[] = {0, 4, 1u << 31, 0xffffffffu, 0xffffff70u};
    for (int version = 3; version <= 4; ++version) {
        size_t at = version == 3 ? 144 : 12;
        for (size_t i = 0; i < sizeof offsets / sizeof *offsets; ++i) {
            Tiny tiny = make_tiny(version);
            put_u32(&tiny, at, offsets[i]);
            assert_refused(&tiny, "offset of positions");
        }
        Tiny tiny = make_tiny(version);
        put_u32(&tiny, at, (uint32_t)tiny.header + 4);
        assert_refused(&tiny, "counts");
    }
}

static void tfx_names_strand_and_vertex_that_are_no_numbers(void** state)
{
    (void)state;
    static const float bad[] = {NAN, INFINITY, -INFINITY, 1e30f};
    for (int version = 3; version <= 4; ++version)
        for (size_t i = 0; i < 4; ++i) {
            Tiny tiny = make_tiny(version);
            put_f32(&tiny, vertex_at(&tiny, 2, 1) + 4, bad[i]);
            assert_refused(&tiny, "y of strand 2, vertex 1");
        }
}

static void tfx_refuses_other_versions(void** state)
{
    (void)state;
    static const float versions[] = {0.0f, 2.0f, 3.5f, 4.1f, -3.0f, NAN, INFINITY};
    for (size_t i = 0; i < sizeof versions / sizeof *versions; ++i) {
        Tiny tiny = make_tiny(3);
        put_f32(&tiny, 0, versions[i]);
        assert_refused(&tiny, "version");
    }
    Tiny text = {.size = 40};
    memcpy(text.bytes, "version 2.0\nscale 1.0\nrotation 0 0 0\n", 38);
    assert_refused(&text, "text");
    ImportedStrands imported;
    Fault fault;
    assert_false(import_tfx(&imported, P_tmpdir, &fault));
    assert_non_null(strstr(fault.text, "regular"));
    assert_false(import_tfx(&imported, "/nowhere/a.tfx", &fault));
    assert_non_null(strstr(fault.text, "/nowhere/a.tfx"));
}

static void tfx_survives_random_bytes(void** state)
{
    (void)state;
    for (uint32_t n = 0; n < 2000; ++n) {
        Tiny tiny = make_tiny(n & 1 ? 3 : 4);
        for (uint32_t k = 0; k < 3; ++k) {
            uint32_t where = random_hash2(n, 2 * k);
            size_t span = k == 0 ? 20 : tiny.size;
            tiny.bytes[where % span] = (uint8_t)random_hash2(n, 2 * k + 1);
        }
        ImportedStrands imported;
        if (read_tiny(&tiny, &imported, NULL)) import_free(&imported);
    }
}

static void tfx_counts_strands_without_length(void** state)
{
    (void)state;
    Tiny tiny = make_tiny(4);
    for (int v = 0; v < 4; ++v) { // 7.5 micrometres, as one strand of AMD's mohawk
        put_f32(&tiny, vertex_at(&tiny, 1, v) + 4, 0.0f);
        put_f32(&tiny, vertex_at(&tiny, 1, v) + 8, 2.5e-6f * (float)v);
    }
    ImportedStrands imported;
    assert_true(read_tiny(&tiny, &imported, NULL));
    assert_int_equal(imported.strands, 3); // kept, with a count
    assert_int_equal(imported.degenerate, 1);
    assert_true(fabs(imported.min_length - 7.5e-6) < 1e-9);
    import_free(&imported);
}

// Check values of FORMAT.md, section 6 ------------------------------------------------------------

typedef struct Published {
    const char* name;
    int strands;
    double low[3], high[3], mean, shortest, longest, total, sum[3];
    double first_root[3], last_tip[3];
} Published;

static const Published published[] = {
    {"ponytail_back",
     517,
     {-22.5895, 62.4313, 17.4842},
     {20.6943, 103.9212, 44.5471},
     14.993660,
     4.91498,
     31.3073,
     7751.722370,
     {-7772.912314, 670002.397247, 295893.830891},
     {4.55617952, 67.1363297, 30.7322388},
     {8.50854206, 79.7528152, 36.3378944}},
    {"ponytail_front_top",
     876,
     {-24.0048, 63.1913, -32.3984},
     {21.2178, 123.6297, 44.6577},
     15.325390,
     3.39997,
     39.3936,
     13425.041898,
     {14903.420186, 1613011.940704, -36414.947096},
     {1.23569059, 108.254196, 29.6094055},
     {-23.2450161, 105.450836, -5.69131565}},
    {"ponytail_side",
     3066,
     {-32.4303, 16.8788, -36.2804},
     {32.9412, 123.7095, 46.6079},
     25.034971,
     5.95961,
     59.4294,
     76757.219814,
     {-85029.698631, 4643285.529608, 439923.685175},
     {1.02043843, 119.565033, 2.11546326},
     {-25.3127747, 89.4561157, 10.606369}},
    {"ponytail_tail",
     255,
     {-4.4927, -3.1180, 45.2350},
     {12.3202, 83.0189, 77.9955},
     71.104331,
     42.5297,
     92.4223,
     18131.604345,
     {7161.417272, 209927.745460, 248543.461815},
     {-0.114542484, 76.9379578, 45.417263},
     {4.1074543, 0.975334167, 69.5985031}},
    {"ponytail_tail_v31",
     474,
     {-4.4927, -3.1180, 45.2183},
     {12.3202, 83.2470, 77.9955},
     65.642200,
     28.2734,
     92.4223,
     31114.402636,
     {12699.304871, 411174.831482, 454321.494709},
     {-0.114542484, 76.9379578, 45.417263},
     {4.90257215, 3.2921524, 76.5058899}},
};

static void assert_near(double value, double wanted, double relative)
{
    if (!(fabs(value - wanted) <= relative * fabs(wanted)))
        fail_msg("%.12g is not %.12g within %g", value, wanted, relative);
}

static void tfx_agrees_with_published_check_values(void** state)
{
    (void)state;
    if (!has_assets()) skip();
    for (size_t i = 0; i < sizeof published / sizeof *published; ++i) {
        const Published* p = &published[i];
        char path[200];
        snprintf(path, sizeof path, ASSETS "%s.tfx", p->name);
        ImportedStrands imported;
        Fault fault;
        assert_true(import_tfx(&imported, path, &fault));
        assert_string_equal(imported.name, p->name);
        assert_int_equal(imported.strands, p->strands);
        assert_int_equal(imported.points, 16);
        for (int axis = 0; axis < 3; ++axis) {
            assert_near(imported.sum[axis], p->sum[axis], 1e-6);
            assert_true(fabs(imported.low[axis] - p->low[axis]) < 1e-4);
            assert_true(fabs(imported.high[axis] - p->high[axis]) < 1e-4);
            assert_near((double)imported.positions[axis], p->first_root[axis], 1e-6);
            size_t last = (size_t)p->strands * 48 - 3 + (size_t)axis;
            assert_near((double)imported.positions[last], p->last_tip[axis], 1e-6);
        }
        assert_near(imported.mean_length, p->mean, 1e-6);
        assert_near(imported.total_length, p->total, 1e-6);
        assert_near(imported.min_length, p->shortest, 1e-5);
        assert_near(imported.max_length, p->longest, 1e-5);
        assert_int_equal(imported.degenerate, 0);
        import_free(&imported);
    }
}

// Meshes ------------------------------------------------------------------------------------------

static bool read_text(HeadMesh* mesh, const char* text, Fault* fault)
{
    return import_obj(mesh, write_file(text, strlen(text)), 0.01f, false, fault);
}

#define SQUARE "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\n"

static void obj_reads_every_form_of_a_corner(void** state)
{
    (void)state;
    static const char* const texts[] = {
        SQUARE "f 1 2 3 4\n",
        SQUARE "f 1//1 2//1 3//1 4//1\r\n",
        SQUARE "f 1/1/1 2/1/1 3/1/1 4/1/1 # square",
        SQUARE "f -4//-1 -3//-1 -2//-1 -1//-1",
        SQUARE "  f\t1/1 2/1 3/1 4/1",
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; ++i) {
        HeadMesh mesh;
        Fault fault = {""};
        if (!read_text(&mesh, texts[i], &fault)) fail_msg("%zu: %s", i, fault.text);
        assert_int_equal(mesh.vertex_count, 4);
        assert_int_equal(mesh.index_count, 6);
        static const uint32_t fan[] = {0, 1, 2, 0, 2, 3};
        assert_memory_equal(mesh.indices, fan, sizeof fan);
        assert_true(fabsf(mesh.positions[2].x - 0.01f) < 1e-9f);
        for (int v = 0; v < 4; ++v) // read or made
            assert_true(mesh.normals[v].z == 1.0f);
        assert_int_equal(mesh.part_count, 1);
        assert_true(mesh.parts[0].is_skin); // the only part
        head_mesh_free(&mesh);
    }
}

static void obj_keeps_differing_normals_apart(void** state)
{
    (void)state;
    HeadMesh mesh;
    assert_true(read_text(
        &mesh, SQUARE "vn 0 1 0\nf 1//1 2//1 3//1\nf 1//2 2//2 4//2\nf 1//1 3//1 4//1\n", NULL));
    assert_int_equal(mesh.vertex_count, 7); // 1 2 3 4 with the first normal, 1 2 4 with the second
    assert_int_equal(mesh.index_count, 9);
    head_mesh_free(&mesh);
}

static void obj_colours_parts_by_name(void** state)
{
    (void)state;
    HeadMesh mesh;
    assert_true(read_text(&mesh,
                          SQUARE "o Mesh_head\ng subset0\nf 1 2 3\no HeadBand\nf 1 2 4\no Jacket\n"
                                 "f 1 3 4\no eye_left\nf 2 3 4\no thing\nf 4 3 2\no Mesh_Head2\n"
                                 "f 3 2 1\n",
                          NULL));
    assert_int_equal(mesh.part_count, 5);
    int skins = 0;
    uint32_t next = 0;
    for (int i = 0; i < mesh.part_count; ++i) {
        const HeadPart* part = &mesh.parts[i];
        assert_int_equal(part->first_index, next);
        next += part->index_count;
        if (part->is_skin) assert_int_equal(part->index_count, 6); // both heads in one part
        skins += part->is_skin;
    }
    assert_int_equal(skins, 1);
    assert_int_equal(next, mesh.index_count);
    head_mesh_free(&mesh);
}

static void obj_faults_name_the_line(void** state)
{
    (void)state;
    static const struct {
        const char *text, *word;
    } bad[] = {
        {SQUARE "f 1 2 5\n", "line 7"},
        {SQUARE "f 0 1 2\n", "line 7"},
        {SQUARE "f -5 1 2\n", "line 7"},
        {SQUARE "f 1//2 2//1 3//1\n", "line 7"},
        {SQUARE "f 1 2\n", "fewer than three"},
        {SQUARE "f 1//\n2 3 4\n", "line 7"},
        {SQUARE "f 1 2 x\n", "line 7"},
        {SQUARE "f 99999999999999999999 1 2\n", "line 7"},
        {"v 0 0\nv 0 0 0\n", "line 1"},
        {"v 0 0 0\nv 0 nan 0\n", "line 2"},
        {"v 0 0 0\nv 0 1e39 0\n", "line 2"},
        {"v 0 0 1e6\n", "90 m"},
        {"vn 0 0\n", "line 1"},
        {"", "no faces"},
        {"hello", "no faces"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        HeadMesh mesh;
        Fault fault = {""};
        assert_false(read_text(&mesh, bad[i].text, &fault));
        if (strstr(fault.text, bad[i].word) == NULL) fail_msg("%zu: %s", i, fault.text);
        assert_null(mesh.positions);
        assert_int_equal(mesh.index_count, 0);
    }
}

static void obj_survives_random_bytes(void** state)
{
    (void)state;
    const char text[] = SQUARE "o head\nf 1//1 2//1 3//1\ng a\nf -1//-1 -2//-1 -3//-1 1//1\n";
    for (uint32_t n = 0; n < 150; ++n) {
        char copy[sizeof text];
        memcpy(copy, text, sizeof text);
        for (uint32_t k = 0; k < 4; ++k)
            copy[random_hash2(n, 2 * k) % (sizeof text - 1)] =
                "0123456789-/ .\nvfngo#e\\"[random_hash2(n, 2 * k + 1) % 23];
        HeadMesh mesh;
        if (read_text(&mesh, copy, NULL)) head_mesh_free(&mesh);
    }
}

static double outward_share(const HeadMesh* mesh)
{
    int outward = 0;
    for (int t = 0; t < mesh->index_count; t += 3) {
        const uint32_t* v = mesh->indices + t;
        Vec3 a = mesh->positions[v[0]];
        Vec3 face =
            vec3_cross(vec3_sub(mesh->positions[v[1]], a), vec3_sub(mesh->positions[v[2]], a));
        outward += vec3_dot(face, mesh->normals[v[0]]) > 0.0f;
    }
    return 3.0 * outward / mesh->index_count;
}

static void obj_faces_look_outward_mirrored_or_not(void** state)
{
    (void)state;
    if (!has_assets()) skip();
    for (int mirrored = 0; mirrored < 2; ++mirrored) {
        HeadMesh mesh;
        Fault fault;
        assert_true(import_obj(&mesh, ASSETS "ponytail_head.obj", 0.0027f, mirrored, &fault));
        assert_int_equal(mesh.index_count / 3, 17894);
        assert_int_equal(mesh.vertex_count, 11744);
        assert_int_equal(mesh.part_count, 6);
        assert_true(outward_share(&mesh) > 0.999);
        head_mesh_free(&mesh);
    }
}

// Spheres -----------------------------------------------------------------------------------------

// A box of 0.2 x 0.2 x 0.1 m, counter-clockwise outside; its last `open` triangles left out.
static void make_box(HeadMesh* mesh, Vec3 positions[8], uint32_t indices[36], int open)
{
    static const uint32_t faces[36] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                       2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    for (int i = 0; i < 8; ++i)
        positions[i] = vec3(i & 1 ? 0.1f : -0.1f, i & 2 ? 0.1f : -0.1f, i & 4 ? 0.05f : -0.05f);
    memcpy(indices, faces, sizeof faces);
    int count = 36 - 3 * open;
    *mesh = (HeadMesh){.vertex_count = 8,
                       .index_count = count,
                       .part_count = 1,
                       .positions = positions,
                       .indices = indices,
                       .parts = {{.index_count = (uint32_t)count, .is_skin = true}}};
}

static void spheres_stay_inside_and_fill_most(void** state)
{
    (void)state;
    for (int open = 0; open <= 2; open += 2) { // closed, and with one side missing
        HeadMesh mesh;
        Vec3 positions[8];
        uint32_t indices[36];
        make_box(&mesh, positions, indices, open);
        Sphere spheres[FIT_SPHERES];
        float covered = 0.0f;
        int count = fit_spheres(spheres, FIT_SPHERES, &mesh, &covered);
        assert_int_equal(count, FIT_SPHERES);
        assert_true(covered > 0.6f && covered < 1.0f);
        assert_true(fabsf(spheres[0].radius - 0.05f) < 0.003f);
        for (int i = 0; i < count; ++i) {
            Vec3 c = spheres[i].centre;
            float r = spheres[i].radius - (open ? 0.006f : 1e-4f);
            assert_true(fabsf(c.x) + r <= 0.1f && fabsf(c.y) + r <= 0.1f);
            assert_true(fabsf(c.z) + r <= 0.05f);
        }
    }
}

static void spheres_of_a_flat_mesh_are_none(void** state)
{
    (void)state;
    HeadMesh mesh;
    Vec3 positions[8];
    uint32_t indices[36];
    make_box(&mesh, positions, indices, 0);
    mesh.index_count = 6; // one side alone
    mesh.parts[0].index_count = 6;
    Sphere spheres[4];
    assert_int_equal(fit_spheres(spheres, 4, &mesh, NULL), 0);
    for (int i = 0; i < 8; ++i)
        positions[i] = vec3(1, 1, 1); // a point
    assert_int_equal(fit_spheres(spheres, 4, &mesh, NULL), 0);
}

static int make_path(void** state)
{
    (void)state;
    strcpy(file_path, P_tmpdir "/strandcast-import-XXXXXX");
    int file = mkstemp(file_path);
    return file < 0 ? -1 : close(file);
}

static int remove_path(void** state)
{
    (void)state;
    return remove(file_path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tfx_reads_both_versions),
        cmocka_unit_test(tfx_both_ends_comes_from_flag_or_from_w),
        cmocka_unit_test(tfx_refuses_every_truncation),
        cmocka_unit_test(tfx_refuses_lying_counts),
        cmocka_unit_test(tfx_refuses_offsets_outside),
        cmocka_unit_test(tfx_names_strand_and_vertex_that_are_no_numbers),
        cmocka_unit_test(tfx_refuses_other_versions),
        cmocka_unit_test(tfx_survives_random_bytes),
        cmocka_unit_test(tfx_counts_strands_without_length),
        cmocka_unit_test(tfx_agrees_with_published_check_values),
        cmocka_unit_test(obj_reads_every_form_of_a_corner),
        cmocka_unit_test(obj_keeps_differing_normals_apart),
        cmocka_unit_test(obj_colours_parts_by_name),
        cmocka_unit_test(obj_faults_name_the_line),
        cmocka_unit_test(obj_survives_random_bytes),
        cmocka_unit_test(obj_faces_look_outward_mirrored_or_not),
        cmocka_unit_test(spheres_stay_inside_and_fill_most),
        cmocka_unit_test(spheres_of_a_flat_mesh_are_none),
    };
    return cmocka_run_group_tests(tests, make_path, remove_path);
}
