// Contexts from every library, and the pictures they draw.
#include "client/gl.h"
#include "client/program.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SIDE 96

// Mesa 22.3's OSMesaDestroyContext forgets the 160 bytes of the context's default framebuffer; no
// order of calls avoids it. Ours and EGL's stay watched.
const char* __lsan_default_suppressions(void);
const char* __lsan_default_suppressions(void)
{
    return "leak:libOSMesa.so";
}

static const ShaderSource scene_shaders[] = {
    {"scene.vert", "layout(location = 0) in vec3 position;\n"
                   "out float shade;\n"
                   "void main() {\n"
                   "    gl_Position = vec4(position, 1.0);\n"
                   "    shade = 0.5 + 0.37 * position.x;\n"
                   "}\n"},
    {"scene.frag", "in float shade;\n"
                   "out vec4 colour;\n"
                   "uniform vec3 tint;\n"
                   "void main() {\n"
                   "    uint n = uint(gl_FragCoord.x) * 7u + uint(gl_FragCoord.y) * 13u;\n"
                   "    gl_SampleMask[0] = int(n % 16u);\n"
                   "    colour = vec4(tint * shade, 1.0);\n"
                   "}\n"},
    {0, 0},
};

typedef struct Target {
    GLuint framebuffer, colour, depth;
} Target;

static Target create_target(const Gl* gl, int samples)
{
    Target target;
    gl->GenFramebuffers(1, &target.framebuffer);
    gl->GenRenderbuffers(1, &target.colour);
    gl->GenRenderbuffers(1, &target.depth);
    gl->BindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
    gl->BindRenderbuffer(GL_RENDERBUFFER, target.colour);
    gl->RenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_RGBA8, SIDE, SIDE);
    gl->FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                                target.colour);
    gl->BindRenderbuffer(GL_RENDERBUFFER, target.depth);
    gl->RenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_DEPTH_COMPONENT24, SIDE, SIDE);
    gl->FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, target.depth);
    assert_int_equal(gl->CheckFramebufferStatus(GL_FRAMEBUFFER), GL_FRAMEBUFFER_COMPLETE);
    return target;
}

static void delete_target(const Gl* gl, Target* target)
{
    gl->DeleteFramebuffers(1, &target->framebuffer);
    gl->DeleteRenderbuffers(1, &target->colour);
    gl->DeleteRenderbuffers(1, &target->depth);
}

// Two crossing triangles, so that depth, edges and the sample mask all show.
static void draw_triangles(const Gl* gl, const float tint[3])
{
    static const float corners[] = {-0.9f, -0.8f, 0.3f,  0.85f, -0.5f, -0.4f, 0.1f,  0.93f, 0.1f,
                                    -0.7f, 0.71f, -0.2f, 0.9f,  0.3f,  0.5f,  -0.2f, -0.9f, 0.0f};
    Fault fault;
    GLuint array, buffer;
    const GLuint program =
        program_build_from(gl, scene_shaders, "scene.vert", "scene.frag", NULL, &fault);
    assert_int_not_equal(program, 0);
    gl->GenVertexArrays(1, &array);
    gl->BindVertexArray(array);
    gl->GenBuffers(1, &buffer);
    gl->BindBuffer(GL_ARRAY_BUFFER, buffer);
    gl->BufferData(GL_ARRAY_BUFFER, sizeof corners, corners, GL_STATIC_DRAW);
    gl->VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, NULL);
    gl->EnableVertexAttribArray(0);
    gl->UseProgram(program);
    gl->Uniform3fv(program_uniform(gl, program, "tint"), 1, tint);
    gl->DrawArrays(GL_TRIANGLES, 0, 6);
    gl->UseProgram(0);
    gl->DeleteProgram(program);
    gl->DeleteBuffers(1, &buffer);
    gl->DeleteVertexArrays(1, &array);
}

static void draw_scene(const Gl* gl, const float tint[3], uint8_t* pixels)
{
    Fault fault;
    Target many = create_target(gl, 4), one = create_target(gl, 0);
    gl->BindFramebuffer(GL_FRAMEBUFFER, many.framebuffer);
    gl->Viewport(0, 0, SIDE, SIDE);
    gl->ClearColor(0.1f, 0.2f, 0.3f, 1.0f);
    gl->Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    gl->Enable(GL_DEPTH_TEST);
    draw_triangles(gl, tint);
    gl->BindFramebuffer(GL_DRAW_FRAMEBUFFER, one.framebuffer);
    gl->BlitFramebuffer(0, 0, SIDE, SIDE, 0, 0, SIDE, SIDE, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    gl->BindFramebuffer(GL_FRAMEBUFFER, one.framebuffer);
    gl->PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl->ReadPixels(0, 0, SIDE, SIDE, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
    delete_target(gl, &many);
    delete_target(gl, &one);
    assert_true(gl_check(gl, "scene", &fault));
}

static const float warm[3] = {1.0f, 0.6f, 0.2f}, cold[3] = {0.1f, 0.5f, 1.0f};

static int count_colours(const uint8_t* pixels)
{
    static bool seen[256];
    int count = 0;
    memset(seen, 0, sizeof seen);
    for (int i = 0; i < SIDE * SIDE; i++) {
        count += !seen[pixels[i * 4]];
        seen[pixels[i * 4]] = true;
    }
    return count;
}

// What was said, one text after the other.
typedef struct Heard {
    char text[2000];
} Heard;

static void hear(void* context, const char* text)
{
    Heard* heard = context;
    const size_t length = strlen(heard->text);
    snprintf(heard->text + length, sizeof heard->text - length, "%s\n", text);
}

static Gl* must_open(const char* which)
{
    Heard heard = {""};
    const Notice notice = {hear, &heard};
    Fault fault = {""};
    Gl* gl = gl_open(which, &notice, &fault);
    if (!gl) print_error("%s\n", fault.text);
    assert_non_null(gl);
    assert_string_equal(heard.text, "");
    return gl;
}

static void egl_and_osmesa_draw_the_same_bits(void** state)
{
    (void)state;
    static uint8_t egl_pixels[SIDE * SIDE * 4], osmesa_pixels[SIDE * SIDE * 4];
    Gl* egl = must_open("egl");
    assert_string_equal(egl->backend, "egl");
    draw_scene(egl, warm, egl_pixels);
    const bool software = egl->software;
    gl_close(egl);
    Gl* osmesa = must_open("osmesa");
    assert_string_equal(osmesa->backend, "osmesa");
    draw_scene(osmesa, warm, osmesa_pixels);
    gl_close(osmesa);
    // Every one of the five coverages, times a gradient.
    assert_true(count_colours(osmesa_pixels) > 100);
    if (!software) {
        print_message("EGL is not Mesa's llvmpipe here: pictures are not compared bit by bit\n");
        skip();
    }
    assert_memory_equal(egl_pixels, osmesa_pixels, sizeof egl_pixels);
}

static void sample_mask_covers_as_many_samples_as_it_names(void** state)
{
    (void)state;
    static uint8_t pixels[SIDE * SIDE * 4];
    Gl* gl = must_open("osmesa");
    assert_true(gl->sample_mask);
    assert_true(gl->software);
    assert_true(gl->max_samples >= 4);
    draw_scene(gl, (const float[3]){0, 0, 0}, pixels);
    gl_close(gl);
    // Inside both triangles near the middle: background blue 0.3 shows through uncovered samples.
    for (int y = 46; y < 50; y++)
        for (int x = 46; x < 50; x++) {
            const int mask = (x * 7 + y * 13) % 16;
            const int covered = __builtin_popcount((unsigned)mask);
            const int expected = (int)(76.5 * (4 - covered) / 4 + 0.5);
            assert_true(abs(pixels[(y * SIDE + x) * 4 + 2] - expected) <= 1);
        }
}

static void null_runs_the_same_calls_and_draws_nothing(void** state)
{
    (void)state;
    static uint8_t pixels[SIDE * SIDE * 4];
    memset(pixels, 7, sizeof pixels);
    Gl* gl = must_open("null");
    assert_string_equal(gl->backend, "null");
    assert_true(gl->software);
    assert_true(gl->max_samples >= 4 && gl->sample_mask && gl->max_texture_size >= 4096);
    draw_scene(gl, warm, pixels);
    for (size_t i = 0; i < sizeof pixels; i++)
        assert_int_equal(pixels[i], 7);
    gl_close(gl);
}

static void null_names_are_distinct_and_mappings_writable(void** state)
{
    (void)state;
    Gl* gl = must_open("null");
    GLuint names[3];
    gl->GenTextures(2, names);
    names[2] = gl->CreateProgram();
    assert_true(names[0] && names[1] && names[2]);
    assert_true(names[0] != names[1] && names[1] != names[2]);
    void* mapped = gl->MapBufferRange(GL_ARRAY_BUFFER, 0, 1000, GL_MAP_WRITE_BIT);
    assert_non_null(mapped);
    memset(mapped, 1, 1000);
    assert_int_equal(gl->UnmapBuffer(GL_ARRAY_BUFFER), GL_TRUE);
    gl_close(gl);
}

static void table_is_complete(void** state)
{
    (void)state;
    static const char* const backends[] = {"egl", "osmesa", "null"};
    for (int i = 0; i < 3; i++) {
        Gl* gl = must_open(backends[i]);
#define CHECK(type, name, parameters) assert_true(gl->name != NULL);
        GL_FUNCTIONS(CHECK)
#undef CHECK
        assert_true(strlen(gl->renderer) > 0 && strlen(gl->version) > 0);
        gl_close(gl);
    }
}

static void two_contexts_on_one_thread_keep_apart(void** state)
{
    (void)state;
    static uint8_t alone[SIDE * SIDE * 4], among[SIDE * SIDE * 4];
    Gl* osmesa = must_open("osmesa");
    draw_scene(osmesa, cold, alone);
    Gl* egl = must_open("egl");
    // Draws into its own framebuffer 1 and shares nothing with the other's 1.
    for (int i = 0; i < 4; i++) {
        assert_true(gl_make_current(egl));
        assert_string_equal((const char*)egl->GetString(GL_RENDERER), egl->renderer);
        GLuint mine;
        egl->GenTextures(1, &mine);
        egl->BindTexture(GL_TEXTURE_2D, mine);
        egl->TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, 11 + i, 5, 0, GL_RGBA, GL_UNSIGNED_BYTE, NULL);
        assert_true(gl_make_current(osmesa));
        GLint width = -1;
        osmesa->BindTexture(GL_TEXTURE_2D, 0);
        draw_scene(osmesa, cold, among);
        assert_memory_equal(alone, among, sizeof alone);
        assert_true(gl_make_current(egl));
        // Still bound and still that wide: the calls between went elsewhere.
        egl->GetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_WIDTH, &width);
        assert_int_equal(width, 11 + i);
        egl->DeleteTextures(1, &mine);
    }
    gl_close(egl);
    assert_true(gl_make_current(osmesa));
    draw_scene(osmesa, cold, among);
    assert_memory_equal(alone, among, sizeof alone);
    gl_close(osmesa);
}

typedef struct Errand {
    Gl* gl;
    uint8_t pixels[SIDE * SIDE * 4];
    bool current;
} Errand;

static void* run_errand(void* context)
{
    Errand* errand = context;
    errand->current = gl_make_current(errand->gl);
    if (errand->current) draw_scene(errand->gl, warm, errand->pixels);
    gl_release(errand->gl);
    return NULL;
}

static void released_context_moves_to_another_thread(void** state)
{
    (void)state;
    static const char* const backends[] = {"egl", "osmesa", "null"};
    static uint8_t here[SIDE * SIDE * 4];
    static Errand errand;
    for (int i = 0; i < 3; i++) {
        errand.gl = must_open(backends[i]);
        memset(here, 0, sizeof here);
        memset(errand.pixels, 0, sizeof errand.pixels);
        draw_scene(errand.gl, warm, here);
        gl_release(errand.gl);
        pthread_t thread;
        assert_int_equal(pthread_create(&thread, NULL, run_errand, &errand), 0);
        pthread_join(thread, NULL);
        assert_true(errand.current);
        assert_memory_equal(here, errand.pixels, sizeof here);
        assert_true(gl_make_current(errand.gl));
        gl_close(errand.gl);
    }
}

static const char* const none[] = {"libstrandcast-absent.so.1", NULL};
static const char* const not_egl[] = {"libm.so.6", NULL};
static const char* const real_egl[] = {"libstrandcast-absent.so.1", "libEGL.so.1", NULL};
static const char* const real_osmesa[] = {"libOSMesa.so.8", NULL};

static void expect_backend(const GlLibraries* libraries, const char* which, const char* backend,
                           const char* said)
{
    Heard heard = {""};
    const Notice notice = {hear, &heard};
    Fault fault = {""};
    Gl* gl = gl_open_with(libraries, which, &notice, &fault);
    assert_non_null(gl);
    assert_string_equal(gl->backend, backend);
    if (!strstr(heard.text, said) || (!*said && *heard.text)) print_error("said: %s", heard.text);
    assert_non_null(strstr(heard.text, said));
    assert_true(*said || !*heard.text);
    gl_close(gl);
}

static void missing_library_falls_back_and_says_so(void** state)
{
    (void)state;
    const GlLibraries no_egl = {none, real_osmesa}, no_osmesa = {real_egl, none};
    const GlLibraries broken_egl = {not_egl, real_osmesa};
    expect_backend(&no_egl, "auto", "osmesa", "EGL is not available: libstrandcast-absent.so.1");
    expect_backend(&no_egl, "egl", "osmesa", "; using OSMesa");
    expect_backend(&no_egl, "osmesa", "osmesa", "");
    expect_backend(&no_osmesa, "auto", "egl", "");
    expect_backend(&no_osmesa, "osmesa", "egl", "OSMesa is not available: libstrandcast-absent");
    expect_backend(&broken_egl, "auto", "osmesa", "the library has no eglGetProcAddress");
}

static void without_any_library_the_fault_names_the_packages(void** state)
{
    (void)state;
    static const char* const choices[] = {"auto", "egl", "osmesa"};
    const GlLibraries nothing = {none, none};
    for (int i = 0; i < 3; i++) {
        Fault fault = {""};
        assert_null(gl_open_with(&nothing, choices[i], NULL, &fault));
        assert_non_null(strstr(fault.text, "libegl1 libegl-mesa0 libgl1-mesa-dri"));
        assert_non_null(strstr(fault.text, "libosmesa6"));
        assert_non_null(strstr(fault.text, "EGL: libstrandcast-absent.so.1"));
        assert_non_null(strstr(fault.text, "OSMesa: libstrandcast-absent.so.1"));
    }
    Gl* gl = gl_open_with(&nothing, "null", NULL, NULL);
    assert_non_null(gl);
    gl_close(gl);
}

static void unknown_backend_is_a_fault_that_lists_the_known(void** state)
{
    (void)state;
    Fault fault = {""};
    assert_null(gl_open("glx", NULL, &fault));
    assert_non_null(strstr(fault.text, "\"glx\": use auto, egl, osmesa or null"));
}

static void check_names_the_first_error_and_clears_it(void** state)
{
    (void)state;
    Fault fault = {""};
    Gl* gl = must_open("osmesa");
    gl->Enable(0xffff);
    gl->Viewport(0, 0, -1, 1);
    assert_false(gl_check(gl, "the test", &fault));
    assert_string_equal(fault.text, "OpenGL: the test: GL_INVALID_ENUM (0x0500)");
    assert_true(gl_check(gl, "the test", &fault));
    gl_close(gl);
}

static void debug_tells_the_drivers_words(void** state)
{
    (void)state;
    Heard heard = {""};
    const Notice notice = {hear, &heard};
    Gl* gl = must_open("osmesa");
    gl_debug(gl, &notice);
    gl->Enable(0xffff);
    assert_non_null(strstr(heard.text, "GL_INVALID_ENUM"));
    gl_close(gl);
    gl = must_open("null");
    gl_debug(gl, &notice);
    gl_close(gl);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(egl_and_osmesa_draw_the_same_bits),
        cmocka_unit_test(sample_mask_covers_as_many_samples_as_it_names),
        cmocka_unit_test(null_runs_the_same_calls_and_draws_nothing),
        cmocka_unit_test(null_names_are_distinct_and_mappings_writable),
        cmocka_unit_test(table_is_complete),
        cmocka_unit_test(two_contexts_on_one_thread_keep_apart),
        cmocka_unit_test(released_context_moves_to_another_thread),
        cmocka_unit_test(missing_library_falls_back_and_says_so),
        cmocka_unit_test(without_any_library_the_fault_names_the_packages),
        cmocka_unit_test(unknown_backend_is_a_fault_that_lists_the_known),
        cmocka_unit_test(check_names_the_first_error_and_clears_it),
        cmocka_unit_test(debug_tells_the_drivers_words),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
