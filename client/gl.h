// An OpenGL 3.3 core context without a window, from whatever library this machine has, as a table
// of function pointers.
//
// A table per context instead of linked symbols: libOSMesa, libOpenGL and NVIDIA's driver export
// the same names, and a binary that links two of them draws into whichever the linker saw first.
// Framebuffer 0 exists on OSMesa only (and not on surfaceless EGL): draw into framebuffer objects.
#pragma once

#include "messages/base.h"

#include <GL/glcorearb.h>

// X(return type, name without gl, parameters): what is called somewhere, of OpenGL 3.3 core; add
// what you use. A driver must have all of them.
// clang-format off
#define GL_VOID_FUNCTIONS(X) \
    X(void, Enable, (GLenum cap)) \
    X(void, Disable, (GLenum cap)) \
    X(void, BlendFunc, (GLenum sfactor, GLenum dfactor)) \
    X(void, Clear, (GLbitfield mask)) \
    X(void, ClearColor, (GLfloat red, GLfloat green, GLfloat blue, GLfloat alpha)) \
    X(void, ClearDepth, (GLdouble depth)) \
    X(void, Viewport, (GLint x, GLint y, GLsizei width, GLsizei height)) \
    X(void, Scissor, (GLint x, GLint y, GLsizei width, GLsizei height)) \
    X(void, DepthMask, (GLboolean flag)) \
    X(void, DepthFunc, (GLenum func)) \
    X(void, ColorMask, (GLboolean red, GLboolean green, GLboolean blue, GLboolean alpha)) \
    X(void, BlendFuncSeparate, (GLenum rgb_source, GLenum rgb_there, GLenum alpha_source, GLenum alpha_there)) \
    X(void, PixelStorei, (GLenum pname, GLint param)) \
    X(void, Finish, (void)) \
    X(void, ReadPixels, (GLint x, GLint y, GLsizei width, GLsizei height, GLenum format, GLenum type, void* pixels)) \
    X(void, GetTexImage, (GLenum target, GLint level, GLenum format, GLenum type, void* pixels)) \
    X(void, GetIntegerv, (GLenum pname, GLint* data)) \
    X(void, GetInteger64v, (GLenum pname, GLint64* data)) \
    X(void, GetFloatv, (GLenum pname, GLfloat* data)) \
    X(void, GetBooleanv, (GLenum pname, GLboolean* data)) \
    X(void, GetIntegeri_v, (GLenum target, GLuint index, GLint* data)) \
    X(void, GenTextures, (GLsizei n, GLuint* textures)) \
    X(void, DeleteTextures, (GLsizei n, const GLuint* textures)) \
    X(void, BindTexture, (GLenum target, GLuint texture)) \
    X(void, ActiveTexture, (GLenum texture)) \
    X(void, TexParameteri, (GLenum target, GLenum pname, GLint param)) \
    X(void, GetTexLevelParameteriv, (GLenum target, GLint level, GLenum pname, GLint* params)) \
    X(void, TexImage2D, (GLenum target, GLint level, GLint internalformat, GLsizei width, GLsizei height, GLint border, GLenum format, GLenum type, const void* pixels)) \
    X(void, TexImage3D, (GLenum target, GLint level, GLint internalformat, GLsizei width, GLsizei height, GLsizei depth, GLint border, GLenum format, GLenum type, const void* pixels)) \
    X(void, TexSubImage2D, (GLenum target, GLint level, GLint xoffset, GLint yoffset, GLsizei width, GLsizei height, GLenum format, GLenum type, const void* pixels)) \
    X(void, TexSubImage3D, (GLenum target, GLint level, GLint xoffset, GLint yoffset, GLint zoffset, GLsizei width, GLsizei height, GLsizei depth, GLenum format, GLenum type, const void* pixels)) \
    X(void, GenSamplers, (GLsizei count, GLuint* samplers)) \
    X(void, GenFramebuffers, (GLsizei n, GLuint* framebuffers)) \
    X(void, DeleteFramebuffers, (GLsizei n, const GLuint* framebuffers)) \
    X(void, BindFramebuffer, (GLenum target, GLuint framebuffer)) \
    X(void, FramebufferTexture2D, (GLenum target, GLenum attachment, GLenum textarget, GLuint texture, GLint level)) \
    X(void, FramebufferTextureLayer, (GLenum target, GLenum attachment, GLuint texture, GLint level, GLint layer)) \
    X(void, FramebufferRenderbuffer, (GLenum target, GLenum attachment, GLenum renderbuffertarget, GLuint renderbuffer)) \
    X(void, BlitFramebuffer, (GLint srcX0, GLint srcY0, GLint srcX1, GLint srcY1, GLint dstX0, GLint dstY0, GLint dstX1, GLint dstY1, GLbitfield mask, GLenum filter)) \
    X(void, DrawBuffers, (GLsizei n, const GLenum* bufs)) \
    X(void, ReadBuffer, (GLenum src)) \
    X(void, GenRenderbuffers, (GLsizei n, GLuint* renderbuffers)) \
    X(void, DeleteRenderbuffers, (GLsizei n, const GLuint* renderbuffers)) \
    X(void, BindRenderbuffer, (GLenum target, GLuint renderbuffer)) \
    X(void, RenderbufferStorageMultisample, (GLenum target, GLsizei samples, GLenum internalformat, GLsizei width, GLsizei height)) \
    X(void, GenBuffers, (GLsizei n, GLuint* buffers)) \
    X(void, DeleteBuffers, (GLsizei n, const GLuint* buffers)) \
    X(void, BindBuffer, (GLenum target, GLuint buffer)) \
    X(void, BufferData, (GLenum target, GLsizeiptr size, const void* data, GLenum usage)) \
    X(void, BufferSubData, (GLenum target, GLintptr offset, GLsizeiptr size, const void* data)) \
    X(void, GetBufferSubData, (GLenum target, GLintptr offset, GLsizeiptr size, void* data)) \
    X(void, BindBufferBase, (GLenum target, GLuint index, GLuint buffer)) \
    X(void, TransformFeedbackVaryings, (GLuint program, GLsizei count, const GLchar* const* varyings, GLenum mode)) \
    X(void, BeginTransformFeedback, (GLenum mode)) \
    X(void, EndTransformFeedback, (void)) \
    X(void, GenVertexArrays, (GLsizei n, GLuint* arrays)) \
    X(void, DeleteVertexArrays, (GLsizei n, const GLuint* arrays)) \
    X(void, BindVertexArray, (GLuint array)) \
    X(void, EnableVertexAttribArray, (GLuint index)) \
    X(void, VertexAttribPointer, (GLuint index, GLint size, GLenum type, GLboolean normalized, GLsizei stride, const void* pointer)) \
    X(void, DrawArrays, (GLenum mode, GLint first, GLsizei count)) \
    X(void, DrawElements, (GLenum mode, GLsizei count, GLenum type, const void* indices)) \
    X(void, PrimitiveRestartIndex, (GLuint index)) \
    X(void, ShaderSource, (GLuint shader, GLsizei count, const GLchar* const* string, const GLint* length)) \
    X(void, CompileShader, (GLuint shader)) \
    X(void, DeleteShader, (GLuint shader)) \
    X(void, AttachShader, (GLuint program, GLuint shader)) \
    X(void, DetachShader, (GLuint program, GLuint shader)) \
    X(void, GetShaderiv, (GLuint shader, GLenum pname, GLint* params)) \
    X(void, GetShaderInfoLog, (GLuint shader, GLsizei bufSize, GLsizei* length, GLchar* infoLog)) \
    X(void, LinkProgram, (GLuint program)) \
    X(void, UseProgram, (GLuint program)) \
    X(void, DeleteProgram, (GLuint program)) \
    X(void, GetProgramiv, (GLuint program, GLenum pname, GLint* params)) \
    X(void, GetProgramInfoLog, (GLuint program, GLsizei bufSize, GLsizei* length, GLchar* infoLog)) \
    X(void, GetActiveUniformBlockiv, (GLuint program, GLuint uniformBlockIndex, GLenum pname, GLint* params)) \
    X(void, UniformBlockBinding, (GLuint program, GLuint uniformBlockIndex, GLuint uniformBlockBinding)) \
    X(void, Uniform1i, (GLint location, GLint v0)) \
    X(void, Uniform1f, (GLint location, GLfloat v0)) \
    X(void, Uniform3f, (GLint location, GLfloat v0, GLfloat v1, GLfloat v2)) \
    X(void, Uniform1fv, (GLint location, GLsizei count, const GLfloat* value)) \
    X(void, Uniform1uiv, (GLint location, GLsizei count, const GLuint* value)) \
    X(void, Uniform3fv, (GLint location, GLsizei count, const GLfloat* value)) \
    X(void, Uniform4fv, (GLint location, GLsizei count, const GLfloat* value)) \
    X(void, UniformMatrix3fv, (GLint location, GLsizei count, GLboolean transpose, const GLfloat* value)) \
    X(void, UniformMatrix4fv, (GLint location, GLsizei count, GLboolean transpose, const GLfloat* value)) \
    X(void, GenQueries, (GLsizei n, GLuint* ids)) \
    X(void, GetQueryiv, (GLenum target, GLenum pname, GLint* params)) \
    X(void, GetQueryObjectiv, (GLuint id, GLenum pname, GLint* params)) \
    X(void, GetQueryObjectuiv, (GLuint id, GLenum pname, GLuint* params)) \
    X(void, GetQueryObjecti64v, (GLuint id, GLenum pname, GLint64* params)) \
    X(void, GetQueryObjectui64v, (GLuint id, GLenum pname, GLuint64* params))

#define GL_VALUE_FUNCTIONS(X) \
    X(GLenum, GetError, (void)) \
    X(const GLubyte*, GetString, (GLenum name)) \
    X(const GLubyte*, GetStringi, (GLenum name, GLuint index)) \
    X(GLenum, CheckFramebufferStatus, (GLenum target)) \
    X(GLuint, CreateShader, (GLenum type)) \
    X(GLuint, CreateProgram, (void)) \
    X(GLint, GetUniformLocation, (GLuint program, const GLchar* name)) \
    X(GLuint, GetUniformBlockIndex, (GLuint program, const GLchar* uniformBlockName)) \
    X(void*, MapBufferRange, (GLenum target, GLintptr offset, GLsizeiptr length, GLbitfield access)) \
    X(GLboolean, UnmapBuffer, (GLenum target)) \
    X(GLsync, FenceSync, (GLenum condition, GLbitfield flags)) \
    X(GLenum, ClientWaitSync, (GLsync sync, GLbitfield flags, GLuint64 timeout))

#define GL_OPTIONAL_FUNCTIONS(X) \
    X(void, DebugMessageCallback, (GLDEBUGPROC callback, const void* userParam))
#define GL_FUNCTIONS(X) GL_VOID_FUNCTIONS(X) GL_VALUE_FUNCTIONS(X)
// clang-format on

typedef struct Gl {
#define GL_MEMBER(type, name, parameters) type(APIENTRYP name) parameters;
    GL_FUNCTIONS(GL_MEMBER)
    GL_OPTIONAL_FUNCTIONS(GL_MEMBER) // newer than 3.3: NULL where the driver has none
#undef GL_MEMBER
    const char* backend; // "egl", "osmesa", "null"
    char renderer[128];
    char version[128];
    // llvmpipe, softpipe, null. Their timer queries return nonsense (measured: 0.4-8 ms for a draw
    // of 53 ms): time with the CPU clock around Finish.
    bool software;
    bool sample_mask;     // gl_SampleMask may be written (GL_ARB_sample_shading)
    int max_samples;      // of colour and depth, textures and renderbuffers; at least 1
    int max_texture_size; // edge of a 2D texture
    // The back end's own; for gl_*.c only.
    void* context;
    bool (*make_current)(void* context);
    void (*release)(void* context);
    void (*close)(void* context);
} Gl;

// Where to look, as lists of library names ended by NULL; the first that opens wins.
typedef struct GlLibraries {
    const char* const* egl;
    const char* const* osmesa;
} GlLibraries;

// Opens a context and makes it current on this thread. `which`: "auto" tries EGL, then OSMesa;
// "egl" and "osmesa" try that one first and then the other; falling back is told by a notice that
// says why. "null" draws nothing, needs no library, and lets all code that draws run. NULL with a
// fault.
Gl* gl_open(const char* which, const Notice* notice, Fault* fault);

// The same with other libraries (the tests play a machine that lacks some).
Gl* gl_open_with(const GlLibraries* libraries, const char* which, const Notice* notice,
                 Fault* fault);

void gl_close(Gl* gl);

// Several contexts may live in one process, also on one thread; each call switches to `gl` for
// real.
bool gl_make_current(Gl* gl);

// Leaves this thread without a context, so that another thread may take `gl`.
void gl_release(Gl* gl);

// False with a fault that names `what` and the first error since the last check. It waits for
// nothing; still keep it out of the steady state.
bool gl_check(const Gl* gl, const char* what, Fault* fault);

// The driver's own warnings and errors as notices, where the driver can (GL_KHR_debug); costs
// speed. `notice` must outlive the context.
void gl_debug(const Gl* gl, const Notice* notice);

// Back ends, for gl.c only: fill table, backend and context, make current; or say why not.
bool gl_egl_open(Gl* gl, const char* const* libraries, Fault* fault);
bool gl_osmesa_open(Gl* gl, const char* const* libraries, Fault* fault);
bool gl_null_open(Gl* gl, Fault* fault);

// Fills the table through a library's lookup function; false names the first function that is
// missing.
typedef void (*GlFunction)(void);
typedef GlFunction (*GlLookup)(const char* name);
bool gl_load(Gl* gl, GlLookup lookup, Fault* fault);

// dlopen of the first of `names` that is there; the fault speaks of the first.
void* gl_open_library(const char* const* names, Fault* fault);
