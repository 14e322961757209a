// A context that draws nothing and needs no library: all code that draws runs, for tests of
// everything around the pictures and for clients that only receive. What is read back stays as it
// was.
#include "client/gl.h"

#include <stdlib.h>
#include <string.h>

#pragma GCC diagnostic ignored "-Wunused-parameter"

#define NULL_VOID(type, name, parameters)                                                          \
    static type APIENTRY null_##name parameters {}
#define NULL_VALUE(type, name, parameters)                                                         \
    static type APIENTRY null_##name parameters                                                    \
    {                                                                                              \
        return (type)0;                                                                            \
    }
GL_VOID_FUNCTIONS(NULL_VOID)
GL_VALUE_FUNCTIONS(NULL_VALUE)

// The one counter of the process: OpenGL's functions have no context to keep it in, and names need
// only be distinct.
static GLuint next_name(void)
{
    static _Atomic GLuint last;
    return ++last;
}

static void APIENTRY gen_names(GLsizei n, GLuint* names)
{
    for (GLsizei i = 0; i < n; i++)
        names[i] = next_name();
}

static GLuint APIENTRY create_shader(GLenum type)
{
    return next_name();
}

static GLuint APIENTRY create_program(void)
{
    return next_name();
}

static GLenum APIENTRY framebuffer_complete(GLenum target)
{
    return GL_FRAMEBUFFER_COMPLETE;
}

// Shaders, programs: compiled, linked, valid, and nothing to say.
static void APIENTRY get_object(GLuint object, GLenum what, GLint* value)
{
    *value =
        what == GL_COMPILE_STATUS || what == GL_LINK_STATUS || what == GL_VALIDATE_STATUS ? 1 : 0;
}

static void APIENTRY get_log(GLuint object, GLsizei size, GLsizei* length, GLchar* log)
{
    if (length) *length = 0;
    if (size > 0) log[0] = '\0';
}

static GLint limit(GLenum what)
{
    switch (what) {
    case GL_MAJOR_VERSION:
    case GL_MINOR_VERSION:
        return 3;
    case GL_NUM_EXTENSIONS:
        return 1;
    case GL_MAX_SAMPLES:
    case GL_MAX_COLOR_TEXTURE_SAMPLES:
    case GL_MAX_DEPTH_TEXTURE_SAMPLES:
        return 4;
    case GL_MAX_TEXTURE_SIZE:
    case GL_MAX_RENDERBUFFER_SIZE:
        return 16384;
    case GL_MAX_3D_TEXTURE_SIZE:
    case GL_MAX_ARRAY_TEXTURE_LAYERS:
        return 2048;
    case GL_MAX_TEXTURE_BUFFER_SIZE:
    case GL_MAX_UNIFORM_BLOCK_SIZE:
        return 65536;
    case GL_MAX_TEXTURE_IMAGE_UNITS:
    case GL_MAX_VERTEX_TEXTURE_IMAGE_UNITS:
    case GL_MAX_COMBINED_TEXTURE_IMAGE_UNITS:
        return 32;
    case GL_MAX_DRAW_BUFFERS:
    case GL_MAX_COLOR_ATTACHMENTS:
        return 8;
    case GL_MAX_VERTEX_ATTRIBS:
        return 16;
    case GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT:
        return 256;
    default:
        return 0;
    }
}

// As many values as the query has: GL_VIEWPORT and the like have four.
static int value_count(GLenum what)
{
    switch (what) {
    case GL_VIEWPORT:
    case GL_SCISSOR_BOX:
    case GL_COLOR_WRITEMASK:
        return 4;
    case GL_MAX_VIEWPORT_DIMS:
        return 2;
    default:
        return 1;
    }
}

static void APIENTRY get_integer(GLenum what, GLint* value)
{
    for (int i = 0; i < value_count(what); i++)
        value[i] = limit(what);
}

#define GET_ZERO(name, parameters)                                                                 \
    static void APIENTRY name parameters                                                           \
    {                                                                                              \
        *value = 0;                                                                                \
    }
GET_ZERO(get_integer64, (GLenum what, GLint64* value))
GET_ZERO(get_float, (GLenum what, GLfloat* value))
GET_ZERO(get_boolean, (GLenum what, GLboolean* value))
GET_ZERO(get_indexed, (GLenum what, GLuint index, GLint* value))
GET_ZERO(get_level, (GLenum target, GLint level, GLenum what, GLint* value))
GET_ZERO(get_block, (GLuint program, GLuint block, GLenum what, GLint* value))
GET_ZERO(get_target, (GLenum target, GLenum what, GLint* value))

static const GLubyte* APIENTRY get_string(GLenum what)
{
    switch (what) {
    case GL_VENDOR:
        return (const GLubyte*)"strandcast";
    case GL_RENDERER:
        return (const GLubyte*)"null";
    case GL_VERSION:
        return (const GLubyte*)"3.3 null";
    case GL_SHADING_LANGUAGE_VERSION:
        return (const GLubyte*)"3.30";
    default:
        return NULL;
    }
}

static const GLubyte* APIENTRY get_extension(GLenum what, GLuint index)
{
    return index == 0 ? (const GLubyte*)"GL_ARB_sample_shading" : NULL;
}

static GLsync APIENTRY fence(GLenum condition, GLbitfield flags)
{
    return (GLsync)(uintptr_t)1;
}

static GLenum APIENTRY fence_passed(GLsync sync, GLbitfield flags, GLuint64 timeout_ns)
{
    return GL_ALREADY_SIGNALED;
}

#define GET_QUERY(name, type)                                                                      \
    static void APIENTRY name(GLuint query, GLenum what, type* value)                              \
    {                                                                                              \
        *value = what == GL_QUERY_RESULT_AVAILABLE ? 1 : 0;                                        \
    }
GET_QUERY(get_query_i, GLint)
GET_QUERY(get_query_ui, GLuint)
GET_QUERY(get_query_i64, GLint64)
GET_QUERY(get_query_ui64, GLuint64)

// Memory that may be written and is forgotten: one mapping at a time.
static _Thread_local void* mapping;

static void* APIENTRY map_range(GLenum target, GLintptr offset, GLsizeiptr bytes, GLbitfield access)
{
    free(mapping);
    mapping = bytes > 0 ? calloc(1, (size_t)bytes) : NULL;
    return mapping;
}

static GLboolean APIENTRY unmap(GLenum target)
{
    free(mapping);
    mapping = NULL;
    return GL_TRUE;
}

static void fill_names(Gl* gl)
{
    gl->GenTextures = gl->GenSamplers = gl->GenFramebuffers = gl->GenRenderbuffers = gen_names;
    gl->GenBuffers = gl->GenVertexArrays = gl->GenQueries = gen_names;
    gl->CreateShader = create_shader;
    gl->CreateProgram = create_program;
}

static void fill_answers(Gl* gl)
{
    gl->CheckFramebufferStatus = framebuffer_complete;
    gl->GetShaderiv = gl->GetProgramiv = get_object;
    gl->GetShaderInfoLog = gl->GetProgramInfoLog = get_log;
    gl->GetIntegerv = get_integer;
    gl->GetInteger64v = get_integer64;
    gl->GetFloatv = get_float;
    gl->GetBooleanv = get_boolean;
    gl->GetIntegeri_v = get_indexed;
    gl->GetTexLevelParameteriv = get_level;
    gl->GetActiveUniformBlockiv = get_block;
    gl->GetQueryiv = get_target;
    gl->GetString = get_string;
    gl->GetStringi = get_extension;
    gl->FenceSync = fence;
    gl->ClientWaitSync = fence_passed;
    gl->GetQueryObjectiv = get_query_i;
    gl->GetQueryObjectuiv = get_query_ui;
    gl->GetQueryObjecti64v = get_query_i64;
    gl->GetQueryObjectui64v = get_query_ui64;
    gl->MapBufferRange = map_range;
    gl->UnmapBuffer = unmap;
}

static bool make_current(void* context)
{
    return true;
}

static void nothing(void* context) {}

bool gl_null_open(Gl* gl, Fault* fault)
{
#define NULL_FILL(type, name, parameters) gl->name = null_##name;
    GL_FUNCTIONS(NULL_FILL)
#undef NULL_FILL
    fill_names(gl);
    fill_answers(gl);
    gl->backend = "null";
    gl->make_current = make_current;
    gl->release = nothing;
    gl->close = nothing;
    return true;
}
