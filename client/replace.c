#include "client/replace.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

// Parts that are being written, for a signal handler: no heap, and a name stands before its flag.
static struct {
    volatile sig_atomic_t used;
    char part[sizeof((Replace*)0)->part];
} pending[4];

static void remember(const Replace* replace)
{
    for (size_t i = 0; i < sizeof pending / sizeof *pending; ++i) {
        if (pending[i].used) continue;
        strcpy(pending[i].part, replace->part);
        atomic_signal_fence(memory_order_release);
        pending[i].used = 1;
        return;
    }
}

static void forget(const Replace* replace)
{
    for (size_t i = 0; i < sizeof pending / sizeof *pending; ++i)
        if (pending[i].used && strcmp(pending[i].part, replace->part) == 0) pending[i].used = 0;
}

void replace_unlink_parts(void)
{
    for (size_t i = 0; i < sizeof pending / sizeof *pending; ++i)
        if (pending[i].used) unlink(pending[i].part);
}

static bool in_place(const Replace* replace)
{
    return strcmp(replace->path, replace->part) == 0;
}

static bool copy_path(char* out, size_t size, const char* path, Fault* fault)
{
    if ((size_t)snprintf(out, size, "%s", path) >= size)
        return fault_set(fault, "the path is too long: %.60s...", path);
    return true;
}

// The file behind links, so that a link stays one.
static bool resolve(Replace* replace, const char* path, Fault* fault)
{
    char* real = realpath(path, NULL);
    const bool ok = copy_path(replace->path, sizeof replace->path, real ? real : path, fault);
    free(real);
    return ok;
}

static bool choose_part(Replace* replace, const char* path, Fault* fault)
{
    struct stat info;
    if (*path == '\0') return fault_set(fault, "the name of the file to write is empty");
    if (stat(path, &info) == 0 && !S_ISREG(info.st_mode)) {
        if (S_ISDIR(info.st_mode)) return fault_set(fault, "%s: is a directory, name a file", path);
        // Not resolved: /dev/stdout leads to names that are no path ("pipe:[1234]").
        return copy_path(replace->path, sizeof replace->path, path, fault) &&
               copy_path(replace->part, sizeof replace->part, path, fault);
    }
    if (!resolve(replace, path, fault)) return false;
    snprintf(replace->part, sizeof replace->part, "%s.part%ld", replace->path, (long)getpid());
    return true;
}

// O_EXCL: in a shared directory the name may be somebody's link. A file of that name can only be
// left over from a process with our number, hence the second try.
static int create_part(const Replace* replace)
{
    if (in_place(replace)) return open(replace->part, O_WRONLY | O_CLOEXEC);
    const int flags = O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC;
    remember(replace); // before there is a file to forget
    const int file = open(replace->part, flags, 0666);
    if (file >= 0 || errno != EEXIST) return file;
    unlink(replace->part);
    return open(replace->part, flags, 0666);
}

FILE* replace_open(Replace* replace, const char* path, Fault* fault)
{
    if (!choose_part(replace, path, fault)) return NULL;
    const int descriptor = create_part(replace);
    FILE* file = descriptor >= 0 ? fdopen(descriptor, "wb") : NULL;
    if (file) return file;
    fault_set(fault, "cannot write %s: %s", path, strerror(errno));
    if (descriptor >= 0) {
        close(descriptor);
        replace_abandon(replace);
    }
    forget(replace);
    return NULL;
}

bool replace_close(Replace* replace, FILE* file, Fault* fault)
{
    errno = 0;
    bool ok = fflush(file) == 0 && !ferror(file);
    ok = fclose(file) == 0 && ok;
    if (ok) return replace_commit(replace, fault);
    // The reason of an fwrite that failed long ago is no longer known.
    fault_set(fault, "cannot write %s: %s", replace->path,
              errno ? strerror(errno) : "a write failed");
    replace_abandon(replace);
    return false;
}

bool replace_commit(const Replace* replace, Fault* fault)
{
    if (in_place(replace)) return true;
    if (rename(replace->part, replace->path) == 0) {
        forget(replace);
        return true;
    }
    fault_set(fault, "cannot write %s: %s", replace->path, strerror(errno));
    replace_abandon(replace);
    return false;
}

void replace_abandon(const Replace* replace)
{
    if (in_place(replace)) return;
    unlink(replace->part);
    forget(replace);
}
