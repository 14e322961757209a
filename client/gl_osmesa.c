// OSMesa: Mesa's llvmpipe without EGL. The headers of libosmesa6-dev are not needed: six
// prototypes. Mesa dropped OSMesa in 25.1 (2025), so it is never more than a choice or a fall-back.
#include "client/gl.h"

#include <dlfcn.h>
#include <stdlib.h>

#define OSMESA_FORMAT_ATTRIBUTE 0x22
#define OSMESA_PROFILE          0x33
#define OSMESA_CORE_PROFILE     0x34
#define OSMESA_MAJOR_VERSION    0x36
#define OSMESA_MINOR_VERSION    0x37

// OSMesa insists on a default framebuffer. Nothing draws into it.
#define BUFFER_SIDE 16

#define OSMESA_FUNCTIONS(X)                                                                        \
    X(void*, CreateContextAttribs, (const int* attributes, void* share))                           \
    X(void, DestroyContext, (void* context))                                                       \
    X(GLboolean, MakeCurrent,                                                                      \
      (void* context, void* buffer, GLenum type, GLsizei width, GLsizei height))                   \
    X(GlFunction, GetProcAddress, (const char* name))

typedef struct OsMesa {
#define OSMESA_MEMBER(type, name, parameters) type(*name) parameters;
    OSMESA_FUNCTIONS(OSMESA_MEMBER)
#undef OSMESA_MEMBER
    void* context;
    uint8_t buffer[BUFFER_SIDE * BUFFER_SIDE * 4];
} OsMesa;

static bool load_functions(OsMesa* osmesa, const char* const* libraries, Fault* fault)
{
    // Never closed, like EGL's.
    void* library = gl_open_library(libraries, fault);
    if (!library) return false;
#define OSMESA_LOAD(type, name, parameters)                                                        \
    *(void**)&osmesa->name = dlsym(library, "OSMesa" #name);                                       \
    if (!osmesa->name) return fault_set(fault, "the library has no OSMesa" #name);
    OSMESA_FUNCTIONS(OSMESA_LOAD)
#undef OSMESA_LOAD
    return true;
}

static bool make_current(void* context)
{
    OsMesa* osmesa = context;
    return osmesa->MakeCurrent(osmesa->context, osmesa->buffer, GL_UNSIGNED_BYTE, BUFFER_SIDE,
                               BUFFER_SIDE) == GL_TRUE;
}

static void release(void* context)
{
    OsMesa* osmesa = context;
    osmesa->MakeCurrent(NULL, NULL, GL_UNSIGNED_BYTE, 0, 0);
}

static void close_osmesa(void* context)
{
    OsMesa* osmesa = context;
    release(osmesa);
    if (osmesa->context) osmesa->DestroyContext(osmesa->context);
    free(osmesa);
}

static bool create_context(OsMesa* osmesa, Fault* fault)
{
    const int attributes[] = {OSMESA_FORMAT_ATTRIBUTE,
                              GL_RGBA,
                              OSMESA_PROFILE,
                              OSMESA_CORE_PROFILE,
                              OSMESA_MAJOR_VERSION,
                              3,
                              OSMESA_MINOR_VERSION,
                              3,
                              0};
    osmesa->context = osmesa->CreateContextAttribs(attributes, NULL);
    if (!osmesa->context) return fault_set(fault, "no OpenGL 3.3 core context");
    release(osmesa);
    if (!make_current(osmesa)) return fault_set(fault, "OSMesaMakeCurrent failed");
    return true;
}

bool gl_osmesa_open(Gl* gl, const char* const* libraries, Fault* fault)
{
    OsMesa* osmesa = calloc(1, sizeof *osmesa);
    if (!osmesa) return fault_set(fault, "out of memory for an OSMesa context");
    if (!load_functions(osmesa, libraries, fault)) {
        free(osmesa);
        return false;
    }
    if (!create_context(osmesa, fault) || !gl_load(gl, osmesa->GetProcAddress, fault)) {
        close_osmesa(osmesa);
        return false;
    }
    gl->backend = "osmesa";
    gl->context = osmesa;
    gl->make_current = make_current;
    gl->release = release;
    gl->close = close_osmesa;
    return true;
}
