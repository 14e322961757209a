// Golden pictures: what is drawn looks as it did when somebody approved it (scripts/approve), and
// what would look wrong is told from it. To the bit where the renderer is the one that drew them,
// else within the bounds of golden_is_within.
//
//     test_golden --draw DIR    writes every scene as DIR/NAME.png, and DIR/hashes.txt
#include "tests/drawing.h"
#include "tests/golden.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <inttypes.h>

#define FOLDER SOURCE_DIR "/tests/golden"

// Mesa 22.3's OSMesaDestroyContext forgets its default framebuffer (see test_gl.c).
const char* __lsan_default_suppressions(void);
const char* __lsan_default_suppressions(void)
{
    return "leak:libOSMesa.so";
}

static Gl* context;
static Golden golden;               // large
static const GoldenScene* is_drawn; // what `golden` holds as it is; NULL: nothing, or not closed
static bool is_open;
static char approved_renderer[256];

static int open_context(void** state)
{
    (void)state;
    context = drawing_open("egl");
    if (context == NULL) context = drawing_open("osmesa");
    return 0;
}

static void close_scene(void)
{
    if (is_open) golden_close(&golden);
    is_open = false;
    is_drawn = NULL;
}

static int close_context(void** state)
{
    (void)state;
    close_scene();
    if (context != NULL) golden_free(&golden);
    if (context != NULL) gl_close(context);
    return 0;
}

// Of hashes.txt; 0 where the scene is not in it. Reads the renderer as well.
static uint64_t approved_hash(const char* name)
{
    char line[256], of[64];
    uint64_t hash, found = 0;
    FILE* file = fopen(FOLDER "/hashes.txt", "r");
    if (file == NULL) fail_msg("no %s/hashes.txt: run scripts/approve", FOLDER);
    if (fgets(approved_renderer, sizeof approved_renderer, file) == NULL) approved_renderer[0] = 0;
    approved_renderer[strcspn(approved_renderer, "\n")] = '\0';
    while (fgets(line, sizeof line, file) != NULL)
        if (sscanf(line, "%" SCNx64 " %63s", &hash, of) == 2 && strcmp(of, name) == 0) found = hash;
    fclose(file);
    return found;
}

static Image approved_picture(const char* name)
{
    char path[256];
    Image image;
    Fault fault = {""};
    snprintf(path, sizeof path, "%s/%s.png", FOLDER, name);
    if (!image_read_png(&image, path, &fault)) fail_msg("%s", fault.text);
    return image;
}

static bool is_approved_renderer(void)
{
    char mine[256];
    golden_renderer(context, mine, sizeof mine);
    return strcmp(mine, approved_renderer) == 0;
}

// The scene in `golden`, drawn as it is; skips where this machine cannot. One that was drawn last
// is taken as it stands: drivers compile for a second before they draw.
static void draw_scene(const GoldenScene* scene)
{
    Fault fault = {""};
    if (context == NULL) skip();
    if (is_drawn == scene) return;
    close_scene();
    golden_parse(&golden, scene);
    is_open = true;
    if (golden_open(&golden, context, &fault) && golden_draw(&golden, &fault)) {
        is_drawn = scene;
        return;
    }
    bool lacks_samples =
        golden.can_draw && golden.drawing.shade.samples != golden.options.shade.samples;
    close_scene();
    if (!lacks_samples) fail_msg("%s", fault.text);
    printf("SKIPPED: %s\n", fault.text);
    skip();
}

static Comparison compare_with_approved(const GoldenScene* scene)
{
    Comparison comparison;
    Fault fault = {""};
    Image approved = approved_picture(scene->name);
    if (!compare_images(&comparison, &approved, &golden.image, 67.02f, NULL, &fault))
        fail_msg("%s: %s", scene->name, fault.text);
    image_free(&approved);
    return comparison;
}

static void a_scene_looks_as_approved(void** state)
{
    const GoldenScene* scene = *state;
    uint64_t approved = approved_hash(scene->name);
    Image file = approved_picture(scene->name);
    if (golden_hash(&file) != approved)
        fail_msg("%s.png is not the picture of hashes.txt: run scripts/approve", scene->name);
    image_free(&file);
    draw_scene(scene);
    Comparison is = compare_with_approved(scene);
    uint64_t hash = golden_hash(&golden.image);
    bool exact = is_approved_renderer();
    if (!exact) printf("another renderer than approved: FLIP %.5f\n", is.flip);
    if (exact ? hash != approved : !golden_is_within(&is))
        fail_msg("%s: FLIP %.5f, RMSE %.5f, p99 %.4f, codes %.0f; scripts/approve --dry-run shows "
                 "where",
                 scene->name, is.flip, is.rmse, is.p99, is.codes);
}

// --- what must be told from the approved picture, by the tolerance alone

static void expect_rejected(const GoldenScene* scene)
{
    Fault fault = {""};
    is_drawn = NULL; // as it is
    golden.drawing.moved = true;
    if (!golden_draw(&golden, &fault)) fail_msg("%s", fault.text);
    Comparison is = compare_with_approved(scene);
    if (golden_is_within(&is))
        fail_msg("%s passes: FLIP %.5f, RMSE %.5f, p99 %.4f", scene->name, is.flip, is.rmse,
                 is.p99);
}

static void a_light_moved_by_two_degrees_is_rejected(void** state)
{
    (void)state;
    const GoldenScene* scene = golden_scene("bob");
    draw_scene(scene);
    const ShadeOptions* shade = &golden.options.shade;
    Vec3 *key = &golden.drawing.shade.lights.key, before = *key;
    static const float moves[][2] = {{2, 0}, {-2, 0}, {0, 2}, {0, -2}};
    for (int i = 0; i < 4; ++i) {
        *key = camera_direction(shade->light_yaw_deg + moves[i][0],
                                shade->light_pitch_deg + moves[i][1]);
        expect_rejected(scene);
    }
    *key = before;
}

static void a_frame_one_tick_old_is_rejected(void** state)
{
    (void)state;
    const GoldenScene* scene = golden_scene("bob-shake");
    draw_scene(scene);
    GuideTextures* guides = &golden.drawing.hair.guides;
    int older = 1 - (golden.view.tick & 1);
    for (int word = 0; word < HAIRSTYLE_MAX_GUIDES / 32; ++word)
        guides->newest[word] ^= ~0u; // the head is where it should be, its hair is not
    expect_rejected(scene);
    golden.view.pose = golden.view.layer[older].pose; // and all of it
    expect_rejected(scene);
}

// Tangents of all ribbon points, from root to tip: the other way round.
static void flipped_tangents_are_rejected(void** state)
{
    (void)state;
    const GoldenScene* scene = golden_scene("long-shake");
    draw_scene(scene);
    const Hair* hair = &golden.drawing.hair;
    int texels = hair->update.rows * UPDATE_WIDTH;
    Texel* table = test_calloc((size_t)texels, sizeof *table);
    for (int i = 0; i < 4 * hair->update.point_count; ++i) {
        float value = hair->ribbons.tangents[i / 4][i % 4];
        table[i / 4][i % 4] = i % 4 < 3 ? -value : value;
    }
    context->BindTexture(GL_TEXTURE_2D, hair->update.tables[TABLE_TANGENTS]);
    context->TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, UPDATE_WIDTH, hair->update.rows, GL_RGBA,
                           GL_FLOAT, table);
    test_free(table);
    expect_rejected(scene);
}

// Clip-space depth of head-space point `p` where it is in the middle of the picture, else a far
// one.
static float depth_in_middle(const Mat4* clip, const float r[9], const float* p)
{
    float w[3], c[4];
    for (int k = 0; k < 3; ++k)
        w[k] = r[3 * k] * p[0] + r[3 * k + 1] * p[1] + r[3 * k + 2] * p[2];
    for (int k = 0; k < 4; ++k)
        c[k] = clip->m[0][k] * w[0] + clip->m[1][k] * w[1] + clip->m[2][k] * w[2] + clip->m[3][k];
    return fabsf(c[0]) < 0.5f * c[3] && fabsf(c[1]) < 0.5f * c[3] ? c[3] : 1e9f;
}

// The ribbon that shows most in the middle of the picture: the sum of its points' widths, each less
// the deeper it lies behind the foremost of all. The foremost alone may be a tip that flies.
static int foremost_ribbon(void)
{
    const Hair* hair = &golden.drawing.hair;
    const Ribbons* ribbons = &hair->ribbons;
    const ShadeOptions* shade = &golden.options.shade;
    Camera camera = camera_orbit(&golden.options.camera, hair->style,
                                 (float)shade->width / (float)shade->height);
    Mat4 clip = matrix_mul(&camera.projection, &camera.view);
    Texel* at = test_malloc((size_t)(hair->update.rows * UPDATE_WIDTH) * sizeof *at);
    context->BindTexture(GL_TEXTURE_2D, hair->update.targets[UPDATE_POSITIONS]);
    context->GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, at);
    float rotation[9], nearest = 1e9f, shows = 0.0f, most = -1.0f;
    quat_matrix(rotation, golden.view.pose.orientation);
    for (int i = 0; i < ribbons->point_count; ++i)
        nearest = fminf(nearest, depth_in_middle(&clip, rotation, at[i]));
    int best = 0, ribbon = 0;
    for (int i = 0; i < ribbons->index_count; ++i) {
        uint32_t vertex = ribbons->indices[i];
        if (vertex == RIBBONS_RESTART) {
            if (shows > most) most = shows, best = ribbon;
            shows = 0.0f;
            ++ribbon;
            continue;
        }
        const float* p = at[vertex / 2];
        shows += p[3] * expf((nearest - depth_in_middle(&clip, rotation, p)) / 0.004f);
    }
    test_free(at);
    return best;
}

static void a_missing_wisp_is_rejected(void** state)
{
    (void)state;
    const GoldenScene* scene = golden_scene("bob-ends");
    draw_scene(scene);
    const Hair* hair = &golden.drawing.hair;
    uint32_t* indices = hair->ribbons.indices;
    int missing = foremost_ribbon(), ribbon = 0;
    for (int i = 0; i < hair->ribbons.index_count; ++i) {
        if (indices[i] == RIBBONS_RESTART)
            ++ribbon;
        else if (ribbon == missing)
            indices[i] = RIBBONS_RESTART;
    }
    context->BindVertexArray(hair->vao);
    context->BufferData(GL_ELEMENT_ARRAY_BUFFER,
                        (GLsizeiptr)((size_t)hair->ribbons.index_count * sizeof *indices), indices,
                        GL_STATIC_DRAW);
    expect_rejected(scene);
}

// --- for scripts/approve

static bool write_scene(const char* folder, const GoldenScene* scene, FILE* hashes, Fault* fault)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s.png", folder, scene->name);
    golden_parse(&golden, scene);
    bool written = golden_open(&golden, context, fault) && golden_draw(&golden, fault) &&
                   image_write_png(&golden.image, path, false, fault);
    if (written) fprintf(hashes, "%016" PRIx64 " %s\n", golden_hash(&golden.image), scene->name);
    golden_close(&golden);
    return written || fault_prefix(fault, scene->name);
}

static int write_all(const char* folder)
{
    char path[4096], renderer[256];
    Fault fault = {""};
    snprintf(path, sizeof path, "%s/hashes.txt", folder);
    FILE* hashes = fopen(path, "w");
    open_context(NULL);
    bool written = hashes != NULL && context != NULL;
    if (!written) fault_set(&fault, "cannot write %s, or there is no GL", path);
    if (written) golden_renderer(context, renderer, sizeof renderer);
    if (written) fprintf(hashes, "%s\n", renderer);
    for (const GoldenScene* scene = golden_scenes; written && scene->name != NULL; ++scene)
        written = write_scene(folder, scene, hashes, &fault);
    if (hashes != NULL && fclose(hashes) != 0 && written)
        written = fault_set(&fault, "cannot write %s", path);
    close_context(NULL);
    if (!written) fprintf(stderr, "test_golden: %s\n", fault.text);
    return written ? 0 : 1;
}

int main(int argc, char** argv)
{
    if (argc == 3 && strcmp(argv[1], "--draw") == 0) return write_all(argv[2]);
    // Each right after the scene that it breaks.
    static const struct {
        const char* scene;
        struct CMUnitTest test;
    } breaks[] = {{"bob", cmocka_unit_test(a_light_moved_by_two_degrees_is_rejected)},
                  {"bob-shake", cmocka_unit_test(a_frame_one_tick_old_is_rejected)},
                  {"long-shake", cmocka_unit_test(flipped_tangents_are_rejected)},
                  {"bob-ends", cmocka_unit_test(a_missing_wisp_is_rejected)}};
    struct CMUnitTest tests[GOLDEN_MOST + 4];
    void* scenes[GOLDEN_MOST];
    size_t count = 0;
    for (int i = 0; i < GOLDEN_MOST && golden_scenes[i].name != NULL; ++i) {
        scenes[i] = (void*)(uintptr_t)&golden_scenes[i]; // cmocka's states are not const
        tests[count++] = (struct CMUnitTest){golden_scenes[i].name, a_scene_looks_as_approved, NULL,
                                             NULL, scenes[i]};
        for (size_t b = 0; b < 4; ++b)
            if (strcmp(breaks[b].scene, golden_scenes[i].name) == 0)
                tests[count++] = breaks[b].test;
    }
    return _cmocka_run_group_tests("golden", tests, count, open_context, close_context);
}
