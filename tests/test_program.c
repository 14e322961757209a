// Shaders put together from files, and faults that say where.
#include "client/program.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <string.h>

static const ShaderSource sources[] = {
    {"ok.vert", "void main() { gl_Position = vec4(0.0, 0.0, 0.0, 1.0); }\n"},
    {"ok.frag", "out vec4 colour;\nvoid main() { colour = vec4(1.0); }\n"},
    {"half.glsl", "float half_of(float x) { return 0.5 * x; }\n"},
    {"quarter.glsl", "#include \"half.glsl\"\n"
                     "float quarter_of(float x) { return half_of(half_of(x)); }\n"},
    {"nested.frag", "#include \"half.glsl\"\n"
                    "  #  include \"quarter.glsl\"\n"
                    "out vec4 colour;\n"
                    "uniform float height;\n"
                    "void main() { colour = vec4(quarter_of(height) + half_of(height)); }"},
    {"loop.glsl", "#include \"loop.glsl\"\nfloat one() { return 1.0; }\n"},
    {"loop.frag", "#include \"loop.glsl\"\nout vec4 c;\nvoid main() { c = vec4(one()); }\n"},
    {"bad.frag", "out vec4 colour;\n\nvoid main() { colour = vec4(absent); }\n"},
    {"after.frag", "#include \"half.glsl\"\n#include \"quarter.glsl\"\nout vec4 colour;\n"
                   "void main() { colour = vec4(absent); }\n"},
    {"broken.glsl", "// one\n// two\nfloat f() { return nowhere; }\n"},
    {"broken.frag", "out vec4 c;\n#include \"broken.glsl\"\nvoid main() { c = vec4(f()); }\n"},
    {"chosen.frag", "out vec4 c;\n#include PART\nvoid main() { c = vec4(half_of(1.0)); }\n"},
    {"lost.frag", "// one\n#include \"missing.glsl\"\nvoid main() {}\n"},
    {"defined.frag", "out vec4 colour;\nvoid main() { colour = vec4(SHADE, LINES); }\n"},
    {"mask.frag", "out vec4 c;\nvoid main() { gl_SampleMask[0] = 1; c = vec4(1.0); }\n"},
    {"unlinked.frag", "out vec4 c;\nvoid absent();\nvoid main() { absent(); c = vec4(1.0); }\n"},
    {"sampled.frag", "uniform sampler2D used;\nuniform Block { vec4 tint; };\nout vec4 c;\n"
                     "void main() { c = tint * texelFetch(used, ivec2(0), 0); }\n"},
    {0, 0},
};

static int open_context(void** state)
{
    Fault fault;
    Gl* gl = gl_open("auto", NULL, &fault);
    if (!gl) print_error("%s\n", fault.text);
    *state = gl;
    return gl ? 0 : -1;
}

static int close_context(void** state)
{
    gl_close(*state);
    return 0;
}

static void expect_program(const Gl* gl, const char* fragment, const char* defines)
{
    Fault fault = {""};
    const GLuint program = program_build_from(gl, sources, "ok.vert", fragment, defines, &fault);
    if (!program) print_error("%s\n", fault.text);
    assert_int_not_equal(program, 0);
    assert_true(gl_check(gl, fragment, &fault));
    gl->DeleteProgram(program);
}

static void expect_fault(const Gl* gl, const char* fragment, const char* begins, const char* has)
{
    Fault fault = {""};
    const GLuint program = program_build_from(gl, sources, "ok.vert", fragment, NULL, &fault);
    assert_int_equal(program, 0);
    if (strncmp(fault.text, begins, strlen(begins)) != 0 || !strstr(fault.text, has))
        print_error("fault: %s\n", fault.text);
    assert_memory_equal(fault.text, begins, strlen(begins));
    assert_non_null(strstr(fault.text, has));
    assert_null(strchr(fault.text, '\n'));
}

static void includes_nest_and_are_taken_once(void** state)
{
    expect_program(*state, "nested.frag", NULL);
    expect_program(*state, "loop.frag", NULL);
}

static void every_file_is_glsl_330_with_sample_mask(void** state)
{
    const Gl* gl = *state;
    if (!gl->sample_mask) {
        print_message("no GL_ARB_sample_shading here\n");
        skip();
    }
    expect_program(gl, "mask.frag", NULL);
}

static void defines_reach_the_text(void** state)
{
    expect_program(*state, "defined.frag", "#define SHADE vec3(0.5)\n#define LINES 2.0");
    expect_fault(*state, "defined.frag", "defined.frag:2: ", "SHADE");
}

static void a_define_may_choose_what_is_included(void** state)
{
    expect_program(*state, "chosen.frag",
                   "#define PARTS none\n#define PART half\n#define LINES 2.0\n");
    expect_fault(*state, "chosen.frag", "chosen.frag:2: ", "\"PART\"");
}

static void errors_name_file_and_line(void** state)
{
    expect_fault(*state, "bad.frag", "bad.frag:3: ", "absent");
    expect_fault(*state, "after.frag", "after.frag:4: ", "absent");
}

static void errors_in_an_included_file_name_that_file(void** state)
{
    expect_fault(*state, "broken.frag", "broken.glsl:3: ", "nowhere");
}

static void missing_files_are_named(void** state)
{
    Fault fault = {""};
    expect_fault(*state, "lost.frag", "lost.frag:2: ", "\"missing.glsl\"");
    assert_int_equal(program_build_from(*state, sources, "no.vert", "ok.frag", NULL, &fault), 0);
    assert_non_null(strstr(fault.text, "\"no.vert\""));
}

static void link_errors_name_both_files(void** state)
{
    expect_fault(*state, "unlinked.frag", "ok.vert + unlinked.frag: ", "absent");
}

static void samplers_and_blocks_are_tied_where_they_exist(void** state)
{
    const Gl* gl = *state;
    Fault fault = {""};
    const GLuint program = program_build_from(gl, sources, "ok.vert", "sampled.frag", NULL, &fault);
    assert_int_not_equal(program, 0);
    program_sampler(gl, program, "used", 3);
    program_sampler(gl, program, "dropped", 4);
    program_block(gl, program, "Block", 2);
    program_block(gl, program, "Dropped", 2);
    assert_true(gl_check(gl, "samplers", &fault));
    GLint binding = -1;
    gl->GetActiveUniformBlockiv(program, gl->GetUniformBlockIndex(program, "Block"),
                                GL_UNIFORM_BLOCK_BINDING, &binding);
    assert_int_equal(binding, 2);
    assert_true(program_uniform(gl, program, "used") >= 0);
    assert_int_equal(program_uniform(gl, program, "dropped"), -1);
    gl->UseProgram(0);
    gl->DeleteProgram(program);
}

static void null_context_builds_and_still_finds_missing_files(void** state)
{
    (void)state;
    Fault fault = {""};
    Gl* gl = gl_open("null", NULL, &fault);
    expect_program(gl, "nested.frag", NULL);
    expect_fault(gl, "lost.frag", "lost.frag:2: ", "\"missing.glsl\"");
    gl_close(gl);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(includes_nest_and_are_taken_once),
        cmocka_unit_test(every_file_is_glsl_330_with_sample_mask),
        cmocka_unit_test(defines_reach_the_text),
        cmocka_unit_test(a_define_may_choose_what_is_included),
        cmocka_unit_test(errors_name_file_and_line),
        cmocka_unit_test(errors_in_an_included_file_name_that_file),
        cmocka_unit_test(missing_files_are_named),
        cmocka_unit_test(link_errors_name_both_files),
        cmocka_unit_test(samplers_and_blocks_are_tied_where_they_exist),
        cmocka_unit_test(null_context_builds_and_still_finds_missing_files),
    };
    return cmocka_run_group_tests(tests, open_context, close_context);
}
