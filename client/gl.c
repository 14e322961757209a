#include "client/gl.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct Entry {
    const char* name;
    size_t offset;
} Entry;

#define ENTRY(type, name, parameters) {"gl" #name, offsetof(Gl, name)},
static const Entry required[] = {GL_FUNCTIONS(ENTRY)};
static const Entry optional[] = {GL_OPTIONAL_FUNCTIONS(ENTRY)};

static const char* const egl_libraries[] = {"libEGL.so.1", NULL};
static const char* const osmesa_libraries[] = {"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so",
                                               NULL};
static const GlLibraries default_libraries = {egl_libraries, osmesa_libraries};

// memcpy, since ISO C has no conversion from one pointer to all these function types.
static bool load_entry(Gl* gl, const Entry* entry, GlLookup lookup)
{
    const GlFunction function = lookup(entry->name);
    memcpy((char*)gl + entry->offset, &function, sizeof function);
    return function != NULL;
}

bool gl_load(Gl* gl, GlLookup lookup, Fault* fault)
{
    for (size_t i = 0; i < sizeof required / sizeof *required; i++)
        if (!load_entry(gl, &required[i], lookup))
            return fault_set(fault, "the driver has no %s (OpenGL 3.3 is needed)",
                             required[i].name);
    for (size_t i = 0; i < sizeof optional / sizeof *optional; i++)
        load_entry(gl, &optional[i], lookup);
    return true;
}

// Names are tried in order and not only the first: distributions differ in the number. The fault
// is that of the first, which is Debian's.
void* gl_open_library(const char* const* names, Fault* fault)
{
    for (const char* const* name = names; *name; name++) {
        // RTLD_LOCAL: no gl symbol of this library may shadow another's.
        void* library = dlopen(*name, RTLD_NOW | RTLD_LOCAL);
        if (library) return library;
        const char* why = dlerror();
        if (name == names) fault_set(fault, "%s", why ? why : *name);
    }
    return NULL;
}

static bool has_extension(const Gl* gl, const char* name)
{
    GLint count = 0;
    gl->GetIntegerv(GL_NUM_EXTENSIONS, &count);
    for (GLint i = 0; i < count; i++) {
        const char* extension = (const char*)gl->GetStringi(GL_EXTENSIONS, (GLuint)i);
        if (extension && strcmp(extension, name) == 0) return true;
    }
    return false;
}

static int get_int(const Gl* gl, GLenum what)
{
    GLint value = 0;
    gl->GetIntegerv(what, &value);
    return value;
}

static int min_int(int a, int b)
{
    return a < b ? a : b;
}

// GL_MAX_SAMPLES speaks of renderbuffers only; textures may have fewer.
static int common_samples(const Gl* gl)
{
    const int samples =
        min_int(get_int(gl, GL_MAX_SAMPLES), min_int(get_int(gl, GL_MAX_COLOR_TEXTURE_SAMPLES),
                                                     get_int(gl, GL_MAX_DEPTH_TEXTURE_SAMPLES)));
    return samples > 1 ? samples : 1;
}

static void copy_string(const Gl* gl, GLenum what, char* out, size_t size)
{
    const char* text = (const char*)gl->GetString(what);
    snprintf(out, size, "%s", text ? text : "?");
}

static void describe(Gl* gl)
{
    copy_string(gl, GL_RENDERER, gl->renderer, sizeof gl->renderer);
    copy_string(gl, GL_VERSION, gl->version, sizeof gl->version);
    gl->software = strstr(gl->renderer, "llvmpipe") || strstr(gl->renderer, "softpipe") ||
                   strcmp(gl->backend, "null") == 0;
    gl->sample_mask = has_extension(gl, "GL_ARB_sample_shading");
    gl->max_samples = common_samples(gl);
    gl->max_texture_size = get_int(gl, GL_MAX_TEXTURE_SIZE);
}

typedef struct Backend {
    const char* title;
    bool (*open)(Gl* gl, const char* const* libraries, Fault* fault);
    const char* const* libraries;
} Backend;

static bool open_either(Gl* gl, const Backend* first, const Backend* second, const Notice* notice,
                        Fault* fault)
{
    Fault why_first = {""}, why_second = {""};
    if (first->open(gl, first->libraries, &why_first)) return true;
    if (!second->open(gl, second->libraries, &why_second))
        return fault_set(
            fault,
            "no OpenGL: apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri (EGL), or "
            "libosmesa6 (OSMesa); %s: %.110s; %s: %.110s",
            first->title, why_first.text, second->title, why_second.text);
    notice_say(notice, "%s is not available: %s; using %s", first->title, why_first.text,
               second->title);
    return true;
}

static bool open_named(Gl* gl, const GlLibraries* libraries, const char* which,
                       const Notice* notice, Fault* fault)
{
    const Backend egl = {"EGL", gl_egl_open, libraries->egl};
    const Backend osmesa = {"OSMesa", gl_osmesa_open, libraries->osmesa};
    if (strcmp(which, "auto") == 0 || strcmp(which, "egl") == 0)
        return open_either(gl, &egl, &osmesa, notice, fault);
    if (strcmp(which, "osmesa") == 0) return open_either(gl, &osmesa, &egl, notice, fault);
    if (strcmp(which, "null") == 0) return gl_null_open(gl, fault);
    return fault_set(fault, "unknown backend \"%s\": use auto, egl, osmesa or null", which);
}

Gl* gl_open_with(const GlLibraries* libraries, const char* which, const Notice* notice,
                 Fault* fault)
{
    Gl* gl = calloc(1, sizeof *gl);
    if (!gl) {
        fault_set(fault, "out of memory for an OpenGL context");
        return NULL;
    }
    if (!open_named(gl, libraries, which, notice, fault)) {
        free(gl);
        return NULL;
    }
    describe(gl);
    return gl;
}

Gl* gl_open(const char* which, const Notice* notice, Fault* fault)
{
    return gl_open_with(&default_libraries, which, notice, fault);
}

void gl_close(Gl* gl)
{
    if (!gl) return;
    gl->close(gl->context);
    free(gl);
}

// Always through "no context": EGL and OSMesa share Mesa's dispatch table but not the knowledge of
// who is current, so a switch back to what EGL believes to be current would be a silent no-op and
// its calls would draw into the other library's context.
bool gl_make_current(Gl* gl)
{
    gl->release(gl->context);
    return gl->make_current(gl->context);
}

void gl_release(Gl* gl)
{
    gl->release(gl->context);
}

static const char* error_name(GLenum error)
{
    switch (error) {
    case GL_INVALID_ENUM:
        return "GL_INVALID_ENUM";
    case GL_INVALID_VALUE:
        return "GL_INVALID_VALUE";
    case GL_INVALID_OPERATION:
        return "GL_INVALID_OPERATION";
    case GL_INVALID_FRAMEBUFFER_OPERATION:
        return "GL_INVALID_FRAMEBUFFER_OPERATION";
    case GL_OUT_OF_MEMORY:
        return "GL_OUT_OF_MEMORY";
    default:
        return "unknown error";
    }
}

bool gl_check(const Gl* gl, const char* what, Fault* fault)
{
    const GLenum first = gl->GetError();
    if (first == GL_NO_ERROR) return true;
    // A lost context reports errors for ever: so many flags exist and no more.
    for (int i = 0; i < 16 && gl->GetError() != GL_NO_ERROR; i++)
        ;
    return fault_set(fault, "OpenGL: %s: %s (0x%04x)", what, error_name(first), first);
}

static void APIENTRY debug_message(GLenum source, GLenum type, GLuint id, GLenum severity,
                                   GLsizei length, const GLchar* message, const void* user)
{
    (void)source, (void)id, (void)length;
    if (severity != GL_DEBUG_SEVERITY_NOTIFICATION && type != GL_DEBUG_TYPE_MARKER)
        notice_say(user, "OpenGL: %s", message);
}

void gl_debug(const Gl* gl, const Notice* notice)
{
    if (!gl->DebugMessageCallback || !has_extension(gl, "GL_KHR_debug")) return;
    gl->DebugMessageCallback(debug_message, notice);
    gl->Enable(GL_DEBUG_OUTPUT);
    gl->Enable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
}
