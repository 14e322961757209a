// Which kernels this build holds, and which of them this processor runs.
#include "server/kernel.h"

#include <stddef.h>
#include <string.h>

extern const Kernel kernel_scalar;
#ifdef KERNELS_X86
extern const Kernel kernel_avx512, kernel_avx2, kernel_sse2;
#endif

// Widest first. Without vectors of its own a processor runs what the compiler makes of the loops.
static const Kernel* const kernels[] = {
#ifdef KERNELS_X86
    &kernel_avx512,
    &kernel_avx2,
    &kernel_sse2,
#endif
    &kernel_scalar,
};
#define KERNELS (sizeof kernels / sizeof kernels[0])

static bool runs_here(const Kernel* kernel)
{
#ifdef KERNELS_X86
    if (kernel == &kernel_avx512) return __builtin_cpu_supports("avx512f") != 0;
    if (kernel == &kernel_avx2) return __builtin_cpu_supports("avx2") != 0;
#endif
    return kernel != NULL;
}

const Kernel* kernel_find(const char* name)
{
    for (size_t i = 0; i < KERNELS; ++i)
        if (runs_here(kernels[i]) && (name == NULL || strcmp(kernels[i]->name, name) == 0))
            return kernels[i];
    return NULL;
}

const char* kernel_names(void)
{
    static const char* const lists[] = {"avx512, avx2, sse2, scalar", "avx2, sse2, scalar",
                                        "sse2, scalar", "scalar"};
    size_t first = 0;
    while (!runs_here(kernels[first]))
        ++first;
    return lists[4 - KERNELS + first];
}
