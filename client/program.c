#include "client/program.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_SOURCES 128
#define FILE_LINES  100000 // line numbers of one file in what the compiler sees
#define LOG_BYTES   2048

// GLSL text under construction for one shader.
typedef struct Builder {
    const ShaderSource* sources;
    const char* defines; // may be NULL
    bool included[MAX_SOURCES];
    char* text;
    size_t length, capacity;
    bool short_of_memory;
} Builder;

// By its name, or by its name without `.glsl`: GLSL knows no strings that a define could hold.
static int find_source(const ShaderSource* sources, const char* name, size_t length)
{
    for (int i = 0; i < MAX_SOURCES && sources[i].name; i++)
        if (strncmp(sources[i].name, name, length) == 0 &&
            (sources[i].name[length] == '\0' || strcmp(sources[i].name + length, ".glsl") == 0))
            return i;
    return -1;
}

static bool reserve(Builder* builder, size_t extra)
{
    const size_t needed = builder->length + extra + 1;
    if (needed <= builder->capacity) return true;
    char* text = realloc(builder->text, needed * 2);
    if (!text) {
        builder->short_of_memory = true;
        return false;
    }
    builder->text = text;
    builder->capacity = needed * 2;
    return true;
}

static void append(Builder* builder, const char* text, size_t length)
{
    if (!reserve(builder, length)) return;
    memcpy(builder->text + builder->length, text, length);
    builder->length += length;
    builder->text[builder->length] = '\0';
}

// GLSL knows no file names, only numbers, and Mesa 22.3 forgets those for all but syntax errors (it
// says 0). Line numbers it keeps: each file gets its own range, and describe_log turns them back.
static void append_line(Builder* builder, int line, int source)
{
    char text[32];
    append(builder, text,
           (size_t)snprintf(text, sizeof text, "#line %d\n", (source + 1) * FILE_LINES + line));
}

static const char* skip_blanks(const char* at)
{
    while (*at == ' ' || *at == '\t')
        at++;
    return at;
}

// What `#define NAME value` in `defines` makes of a name, or the name itself where there is no such
// line.
static const char* defined_value(const char* defines, const char* name, size_t* length)
{
    const size_t name_length = strcspn(name, " \t\n");
    *length = name_length;
    for (const char* at = defines; at && *at; at += strcspn(at, "\n"), at += *at == '\n') {
        if (strncmp(at, "#define ", 8) != 0 || strncmp(at + 8, name, name_length) != 0) continue;
        if (at[8 + name_length] != ' ') continue;
        const char* value = skip_blanks(at + 8 + name_length);
        *length = strcspn(value, " \t\n");
        return value;
    }
    return name;
}

// The name between the quotes of an `#include "name"` line, or what NAME of `#include NAME` is
// defined as; NULL where the line is another.
static const char* included_name(const char* defines, const char* line, size_t* length)
{
    const char* at = skip_blanks(line);
    if (*at != '#') return NULL;
    at = skip_blanks(at + 1);
    if (strncmp(at, "include", 7) != 0) return NULL;
    at = skip_blanks(at + 7);
    if (*at != '"') return defined_value(defines, at, length);
    *length = strcspn(at + 1, "\"\n");
    return at[1 + *length] == '"' ? at + 1 : NULL;
}

static bool append_source(Builder* builder, int source, Fault* fault);

static bool append_include(Builder* builder, int source, int line, const char* name, size_t length,
                           Fault* fault)
{
    const int included = find_source(builder->sources, name, length);
    if (included < 0)
        return fault_set(fault, "%s:%d: no shader file \"%.*s\" to include",
                         builder->sources[source].name, line, (int)length, name);
    if (!builder->included[included] && !append_source(builder, included, fault)) return false;
    append_line(builder, line + 1, source);
    return true;
}

// Recursion ends: every file is taken once.
static bool append_source(Builder* builder, int source, Fault* fault)
{
    builder->included[source] = true;
    append_line(builder, 1, source);
    int line = 1;
    for (const char* at = builder->sources[source].text; *at; line++) {
        size_t length = strcspn(at, "\n");
        size_t name_length;
        const char* name = included_name(builder->defines, at, &name_length);
        if (name) {
            if (!append_include(builder, source, line, name, name_length, fault)) return false;
        } else {
            append(builder, at, length);
            append(builder, "\n", 1);
        }
        at += length;
        at += *at == '\n';
    }
    return true;
}

static void append_prologue(Builder* builder, const char* defines)
{
    // `enable`, not `require`: without multisampling no shader writes gl_SampleMask.
    const char* prologue = "#version 330 core\n#extension GL_ARB_sample_shading : enable\n";
    append(builder, prologue, strlen(prologue));
    if (!defines || !*defines) return;
    append(builder, defines, strlen(defines));
    append(builder, "\n", 1);
}

// Where the words begin after "0:LINE(COLUMN): " (Mesa) or "0(LINE) : " (NVIDIA); 0 where it is
// neither.
static int parse_place(const char* log, int* line)
{
    int string, column, end = 0;
    if (sscanf(log, "%d:%d(%d): %n", &string, line, &column, &end) == 3 && end > 0) return end;
    if (sscanf(log, "%d(%d) : %n", &string, line, &end) == 2 && end > 0) return end;
    if (sscanf(log, "%d:%d: %n", &string, line, &end) == 2 && end > 0) return end;
    return 0;
}

static const char* file_of_line(const ShaderSource* sources, int line)
{
    const int source = line / FILE_LINES - 1;
    for (int i = 0; i < MAX_SOURCES && sources[i].name; i++)
        if (i == source) return sources[i].name;
    return NULL;
}

// The first line that speaks of an error, warnings before it left out.
static const char* first_error(const char* log)
{
    for (const char* at = log; *at; at += strcspn(at, "\n"), at += *at == '\n') {
        const char* end = at + strcspn(at, "\n");
        const char* word = strstr(at, "error");
        if (word && word < end) return at;
    }
    return log;
}

static bool describe_log(const ShaderSource* sources, const char* name, const char* log,
                         Fault* fault)
{
    const char* at = first_error(log);
    int line = 0;
    const int skip = parse_place(at, &line);
    const char* file = skip > 0 ? file_of_line(sources, line) : NULL;
    const char* words = file ? at + skip : at;
    const int length = (int)strcspn(words, "\n");
    if (file) return fault_set(fault, "%s:%d: %.*s", file, line % FILE_LINES, length, words);
    return fault_set(fault, "%s: %.*s", name, length, words);
}

static bool compile(const Gl* gl, GLuint shader, const Builder* builder, const char* name,
                    Fault* fault)
{
    const GLchar* text = builder->text;
    gl->ShaderSource(shader, 1, &text, NULL);
    gl->CompileShader(shader);
    GLint compiled = 0;
    gl->GetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    if (compiled) return true;
    char log[LOG_BYTES] = "";
    gl->GetShaderInfoLog(shader, sizeof log, NULL, log);
    return describe_log(builder->sources, name, log, fault);
}

static bool build_text(Builder* builder, const char* name, const char* defines, Fault* fault)
{
    const int source = find_source(builder->sources, name, strlen(name));
    if (source < 0) return fault_set(fault, "no shader file \"%s\"", name);
    append_prologue(builder, defines);
    if (!append_source(builder, source, fault)) return false;
    if (builder->short_of_memory) return fault_set(fault, "%s: out of memory", name);
    return true;
}

static GLuint build_shader(const Gl* gl, GLenum type, const ShaderSource* sources, const char* name,
                           const char* defines, Fault* fault)
{
    Builder builder = {.sources = sources, .defines = defines};
    GLuint shader = 0;
    if (build_text(&builder, name, defines, fault)) {
        shader = gl->CreateShader(type);
        if (!compile(gl, shader, &builder, name, fault)) {
            gl->DeleteShader(shader);
            shader = 0;
        }
    }
    free(builder.text);
    return shader;
}

static bool link_program(const Gl* gl, GLuint program, Fault* fault)
{
    gl->LinkProgram(program);
    GLint linked = 0;
    gl->GetProgramiv(program, GL_LINK_STATUS, &linked);
    if (linked) return true;
    char log[LOG_BYTES] = "";
    gl->GetProgramInfoLog(program, sizeof log, NULL, log);
    const char* words = first_error(log);
    return fault_set(fault, "%.*s", (int)strcspn(words, "\n"), words);
}

// `fragment` may be 0.
static GLuint create_program(const Gl* gl, GLuint vertex, GLuint fragment,
                             const char* const* captured, int captured_count, Fault* fault)
{
    GLuint program = gl->CreateProgram();
    gl->AttachShader(program, vertex);
    if (fragment) gl->AttachShader(program, fragment);
    if (captured_count > 0)
        gl->TransformFeedbackVaryings(program, captured_count, captured, GL_SEPARATE_ATTRIBS);
    const bool linked = link_program(gl, program, fault);
    gl->DetachShader(program, vertex);
    if (fragment) gl->DetachShader(program, fragment);
    if (linked) return program;
    gl->DeleteProgram(program);
    return 0;
}

GLuint program_build_from(const Gl* gl, const ShaderSource* sources, const char* vertex_name,
                          const char* fragment_name, const char* defines, Fault* fault)
{
    GLuint program = 0;
    const GLuint vertex = build_shader(gl, GL_VERTEX_SHADER, sources, vertex_name, defines, fault);
    if (!vertex) return 0;
    const GLuint fragment =
        build_shader(gl, GL_FRAGMENT_SHADER, sources, fragment_name, defines, fault);
    if (fragment) {
        program = create_program(gl, vertex, fragment, NULL, 0, fault);
        if (!program) {
            char names[128];
            snprintf(names, sizeof names, "%s + %s", vertex_name, fragment_name);
            fault_prefix(fault, names);
        }
        gl->DeleteShader(fragment);
    }
    gl->DeleteShader(vertex);
    return program;
}

GLuint program_build(const Gl* gl, const char* vertex_name, const char* fragment_name,
                     const char* defines, Fault* fault)
{
    return program_build_from(gl, shader_sources, vertex_name, fragment_name, defines, fault);
}

GLuint program_build_feedback(const Gl* gl, const char* vertex_name, const char* const* captured,
                              int captured_count, const char* defines, Fault* fault)
{
    const GLuint vertex =
        build_shader(gl, GL_VERTEX_SHADER, shader_sources, vertex_name, defines, fault);
    if (!vertex) return 0;
    const GLuint program = create_program(gl, vertex, 0, captured, captured_count, fault);
    if (!program) fault_prefix(fault, vertex_name);
    gl->DeleteShader(vertex);
    return program;
}

GLint program_uniform(const Gl* gl, GLuint program, const char* name)
{
    return gl->GetUniformLocation(program, name);
}

void program_uniform3(const Gl* gl, GLuint program, const char* name, Vec3 v)
{
    gl->Uniform3f(gl->GetUniformLocation(program, name), v.x, v.y, v.z);
}

void program_sampler(const Gl* gl, GLuint program, const char* name, int unit)
{
    gl->UseProgram(program);
    gl->Uniform1i(gl->GetUniformLocation(program, name), unit);
}

void program_block(const Gl* gl, GLuint program, const char* name, GLuint binding)
{
    const GLuint block = gl->GetUniformBlockIndex(program, name);
    if (block != GL_INVALID_INDEX) gl->UniformBlockBinding(program, block, binding);
}
