// EGL without window or surface: hardware drivers where there are any, else Mesa's llvmpipe.
#include "client/gl.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>

#define MAX_DEVICES  16
#define MAX_DISPLAYS (MAX_DEVICES + 2)

#define EGL_CORE_FUNCTIONS(X)                                                                      \
    X(PFNEGLGETPROCADDRESSPROC, GetProcAddress)                                                    \
    X(PFNEGLGETERRORPROC, GetError)                                                                \
    X(PFNEGLQUERYSTRINGPROC, QueryString)                                                          \
    X(PFNEGLGETDISPLAYPROC, GetDisplay)                                                            \
    X(PFNEGLINITIALIZEPROC, Initialize)                                                            \
    X(PFNEGLBINDAPIPROC, BindAPI)                                                                  \
    X(PFNEGLCHOOSECONFIGPROC, ChooseConfig)                                                        \
    X(PFNEGLCREATECONTEXTPROC, CreateContext)                                                      \
    X(PFNEGLDESTROYCONTEXTPROC, DestroyContext)                                                    \
    X(PFNEGLMAKECURRENTPROC, MakeCurrent)                                                          \
    X(PFNEGLGETCURRENTCONTEXTPROC, GetCurrentContext)
#define EGL_EXTENSION_FUNCTIONS(X)                                                                 \
    X(PFNEGLGETPLATFORMDISPLAYEXTPROC, GetPlatformDisplayEXT)                                      \
    X(PFNEGLQUERYDEVICESEXTPROC, QueryDevicesEXT)                                                  \
    X(PFNEGLQUERYDEVICESTRINGEXTPROC, QueryDeviceStringEXT)

typedef struct Egl {
#define EGL_MEMBER(type, name) type name;
    EGL_CORE_FUNCTIONS(EGL_MEMBER)
    EGL_EXTENSION_FUNCTIONS(EGL_MEMBER) // NULL where the library has none
#undef EGL_MEMBER
    EGLDisplay display;
    EGLContext context;
} Egl;

// A place to draw that the library offers, best first.
typedef struct Displays {
    EGLDisplay at[MAX_DISPLAYS];
    int count;
} Displays;

static const char* egl_error(const Egl* egl)
{
    switch (egl->GetError()) {
    case EGL_NOT_INITIALIZED:
        return "EGL_NOT_INITIALIZED";
    case EGL_BAD_ACCESS:
        return "EGL_BAD_ACCESS";
    case EGL_BAD_ALLOC:
        return "EGL_BAD_ALLOC";
    case EGL_BAD_ATTRIBUTE:
        return "EGL_BAD_ATTRIBUTE";
    case EGL_BAD_CONFIG:
        return "EGL_BAD_CONFIG";
    case EGL_BAD_CONTEXT:
        return "EGL_BAD_CONTEXT";
    case EGL_BAD_DISPLAY:
        return "EGL_BAD_DISPLAY";
    case EGL_BAD_MATCH:
        return "EGL_BAD_MATCH";
    case EGL_BAD_PARAMETER:
        return "EGL_BAD_PARAMETER";
    default:
        return "an EGL error";
    }
}

static bool has_word(const char* words, const char* word)
{
    const size_t length = strlen(word);
    for (const char* at = words; at && (at = strstr(at, word)); at += length)
        if ((at == words || at[-1] == ' ') && (at[length] == ' ' || at[length] == '\0'))
            return true;
    return false;
}

static bool load_functions(Egl* egl, const char* const* libraries, Fault* fault)
{
    // Never closed: drivers leave thread-local destructors and worker threads behind.
    void* library = gl_open_library(libraries, fault);
    if (!library) return false;
#define EGL_LOAD(type, name)                                                                       \
    *(void**)&egl->name = dlsym(library, "egl" #name);                                             \
    if (!egl->name) return fault_set(fault, "the library has no egl" #name);
    EGL_CORE_FUNCTIONS(EGL_LOAD)
#undef EGL_LOAD
#define EGL_LOAD(type, name) egl->name = (type)egl->GetProcAddress("egl" #name);
    EGL_EXTENSION_FUNCTIONS(EGL_LOAD)
#undef EGL_LOAD
    return true;
}

static void add_display(Displays* displays, EGLDisplay display)
{
    if (display != EGL_NO_DISPLAY && displays->count < MAX_DISPLAYS)
        displays->at[displays->count++] = display;
}

static bool is_software(const Egl* egl, EGLDeviceEXT device)
{
    return egl->QueryDeviceStringEXT &&
           has_word(egl->QueryDeviceStringEXT(device, EGL_EXTENSIONS), "EGL_MESA_device_software");
}

static void add_devices(const Egl* egl, Displays* displays, bool software)
{
    EGLDeviceEXT devices[MAX_DEVICES];
    EGLint count = 0;
    if (!egl->QueryDevicesEXT || !egl->QueryDevicesEXT(MAX_DEVICES, devices, &count)) return;
    for (EGLint i = 0; i < count; i++)
        if (is_software(egl, devices[i]) == software)
            add_display(displays,
                        egl->GetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], NULL));
}

// Devices first: only they name each GPU of a machine, and NVIDIA's driver has no other way without
// a window system. The default display comes last: it may need X.
static Displays list_displays(const Egl* egl)
{
    Displays displays = {.count = 0};
    const char* extensions = egl->QueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (egl->GetPlatformDisplayEXT && has_word(extensions, "EGL_EXT_platform_device")) {
        add_devices(egl, &displays, false);
        add_devices(egl, &displays, true);
    }
    if (egl->GetPlatformDisplayEXT && has_word(extensions, "EGL_MESA_platform_surfaceless"))
        add_display(&displays, egl->GetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA,
                                                          (void*)EGL_DEFAULT_DISPLAY, NULL));
    add_display(&displays, egl->GetDisplay(EGL_DEFAULT_DISPLAY));
    return displays;
}

static bool choose_config(const Egl* egl, EGLConfig* config, Fault* fault)
{
    const char* extensions = egl->QueryString(egl->display, EGL_EXTENSIONS);
    if (!has_word(extensions, "EGL_KHR_surfaceless_context"))
        return fault_set(fault, "the driver has no EGL_KHR_surfaceless_context");
    *config = (EGLConfig)0; // EGL_NO_CONFIG_KHR
    if (has_word(extensions, "EGL_KHR_no_config_context")) return true;
    const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0, EGL_NONE};
    EGLint count = 0;
    if (!egl->ChooseConfig(egl->display, wanted, config, 1, &count) || count < 1)
        return fault_set(fault, "no EGL configuration for OpenGL");
    return true;
}

// No EGL_CONTEXT_OPENGL_DEBUG, not even EGL_FALSE: softpipe refuses the attribute as such.
static bool create_context(Egl* egl, Fault* fault)
{
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                 3,
                                 EGL_CONTEXT_MINOR_VERSION,
                                 3,
                                 EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                 EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                 EGL_NONE};
    EGLConfig config;
    if (!egl->Initialize(egl->display, NULL, NULL))
        return fault_set(fault, "eglInitialize: %s", egl_error(egl));
    if (!choose_config(egl, &config, fault)) return false;
    if (!egl->BindAPI(EGL_OPENGL_API)) return fault_set(fault, "the driver has OpenGL ES only");
    egl->context = egl->CreateContext(egl->display, config, EGL_NO_CONTEXT, attributes);
    if (egl->context == EGL_NO_CONTEXT)
        return fault_set(fault, "no OpenGL 3.3 core context: %s", egl_error(egl));
    return true;
}

static void release(void* context)
{
    Egl* egl = context;
    egl->MakeCurrent(egl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

static bool make_current(void* context)
{
    Egl* egl = context;
    return egl->BindAPI(EGL_OPENGL_API) &&
           egl->MakeCurrent(egl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, egl->context);
}

// The display stays initialised: eglTerminate unloads the driver, whose allocations
// LeakSanitizer could then no longer name, and the next context would load it again.
static void destroy_context(Egl* egl)
{
    if (egl->GetCurrentContext() == egl->context) release(egl);
    egl->DestroyContext(egl->display, egl->context);
    egl->context = EGL_NO_CONTEXT;
}

static void close_egl(void* context)
{
    destroy_context(context);
    free(context);
}

static bool try_display(Egl* egl, EGLDisplay display, Gl* gl, Fault* fault)
{
    egl->display = display;
    if (!create_context(egl, fault)) return false;
    release(egl);
    if (!make_current(egl))
        fault_set(fault, "eglMakeCurrent: %s", egl_error(egl));
    else if (gl_load(gl, egl->GetProcAddress, fault))
        return true;
    destroy_context(egl);
    return false;
}

static bool try_displays(Egl* egl, Gl* gl, Fault* fault)
{
    const Displays displays = list_displays(egl);
    if (displays.count == 0) return fault_set(fault, "the library offers no display");
    Fault reason = {""};
    for (int i = 0; i < displays.count; i++) {
        // The first refusal is the one to tell: it is that of the best device.
        if (try_display(egl, displays.at[i], gl, i == 0 ? fault : &reason)) return true;
    }
    return false;
}

bool gl_egl_open(Gl* gl, const char* const* libraries, Fault* fault)
{
    Egl* egl = calloc(1, sizeof *egl);
    if (!egl) return fault_set(fault, "out of memory for an EGL context");
    if (!load_functions(egl, libraries, fault) || !try_displays(egl, gl, fault)) {
        free(egl);
        return false;
    }
    gl->backend = "egl";
    gl->context = egl;
    gl->make_current = make_current;
    gl->release = release;
    gl->close = close_egl;
    return true;
}
