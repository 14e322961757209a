#include "client/output.h"

#include "client/video.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

struct Output {
    char path[1024];
    bool to_directory;
    Video* video;
    Image last; // of one PNG: written at the end
    bool has_last;
    int64_t count;
};

static const char* base_of(const char* path)
{
    const char* slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

// Whether the file's name is something and `ending`, in small letters or large.
static bool ends_with(const char* path, const char* ending)
{
    const char* name = base_of(path);
    size_t n = strlen(name), m = strlen(ending);
    return n > m && strcasecmp(name + n - m, ending) == 0;
}

// A name with a dot was meant as a file, unless it is there as a directory or ends with a slash.
static bool means_file(const char* path)
{
    struct stat info;
    bool is_directory = stat(path, &info) == 0 && S_ISDIR(info.st_mode);
    return !is_directory && (strcmp(path, "-") == 0 || strchr(base_of(path), '.') != NULL);
}

// The directory that a new file of this name would be made in.
static void parent_of(char* out, size_t capacity, const char* path)
{
    snprintf(out, capacity, "%s", path);
    char* slash = strrchr(out, '/');
    if (slash == NULL)
        snprintf(out, capacity, ".");
    else if (slash == out)
        out[1] = '\0';
    else
        *slash = '\0';
}

// Makes a file there and takes it away again: access() says yes to root for file systems that take
// none.
static bool check_folder(const char* folder, const char* path, Fault* fault)
{
    char trial[1100];
    snprintf(trial, sizeof trial, "%s/.hair-client.XXXXXX", folder);
    int file = mkostemp(trial, O_CLOEXEC);
    if (file < 0)
        return fault_set(fault, "--out %.200s: cannot write in %.200s: %s", path, folder,
                         strerror(errno));
    close(file);
    unlink(trial);
    return true;
}

static bool check_file(const char* path, Fault* fault)
{
    struct stat info;
    char parent[1024];
    parent_of(parent, sizeof parent, path);
    bool exists = stat(path, &info) == 0;
    if (exists && S_ISDIR(info.st_mode))
        return fault_set(fault, "--out %.300s: is a directory; name a file in it", path);
    bool is_device = exists && !S_ISREG(info.st_mode); // written in place
    return is_device || check_folder(parent, path, fault);
}

static bool open_directory(Output* output, Fault* fault)
{
    struct stat info;
    size_t n = strlen(output->path);
    while (n > 1 && output->path[n - 1] == '/')
        output->path[--n] = '\0';
    if (mkdir(output->path, 0777) != 0 && errno != EEXIST)
        return fault_set(fault, "--out %.300s: %s", output->path, strerror(errno));
    if (stat(output->path, &info) != 0 || !S_ISDIR(info.st_mode))
        return fault_set(fault, "--out %.300s: exists and is not a directory", output->path);
    output->to_directory = true;
    return check_folder(output->path, output->path, fault);
}

static bool open_target(Output* output, int width, int height, double rate_hz, Fault* fault)
{
    if (ends_with(output->path, ".mp4")) {
        if (!check_file(output->path, fault)) return false;
        output->video = video_open(output->path, width, height, rate_hz, fault);
        return output->video != NULL;
    }
    if (ends_with(output->path, ".png"))
        return check_file(output->path, fault) && image_create(&output->last, width, height, fault);
    if (means_file(output->path))
        return fault_set(fault,
                         "--out %.300s: choose a .png, an .mp4, or a directory; one with a dot in "
                         "its name ends with /",
                         output->path);
    return open_directory(output, fault);
}

Output* output_open(const char* path, int width, int height, double rate_hz, Fault* fault)
{
    Output* output = calloc(1, sizeof *output);
    if (output == NULL) {
        fault_set(fault, "no memory");
        return NULL;
    }
    if (path == NULL) return output;
    if (strlen(path) >= sizeof output->path)
        fault_set(fault, "--out: the path is longer than %zu characters", sizeof output->path - 1);
    else {
        strcpy(output->path, path);
        if (open_target(output, width, height, rate_hz, fault)) return output;
    }
    free(output);
    return NULL;
}

static void number_path(char path[1100], const Output* output, int64_t number)
{
    snprintf(path, 1100, "%s/%05lld.png", output->path, (long long)number);
}

bool output_picture(Output* output, const Image* image, Fault* fault)
{
    int64_t number = output->count++;
    if (output->video != NULL) return video_frame(output->video, image, fault);
    if (output->to_directory) {
        char path[1100];
        number_path(path, output, number);
        return image_write_png(image, path, false, fault);
    }
    if (output->last.rgba != NULL) {
        memcpy(output->last.rgba, image->rgba, (size_t)image->width * (size_t)image->height * 4);
        output->has_last = true;
    }
    return true;
}

void output_tell_older(const Output* output, const Notice* notice)
{
    char path[1100];
    if (output == NULL || !output->to_directory || output->count == 0) return;
    number_path(path, output, output->count);
    if (access(path, F_OK) == 0)
        notice_say(notice,
                   "%.300s and those after it are of an earlier run, which drew more than %lld "
                   "pictures: remove them, or name another directory",
                   path, (long long)output->count);
}

void output_abandon(Output* output)
{
    if (output == NULL) return;
    if (output->video != NULL) video_abandon(output->video);
    image_free(&output->last);
    free(output);
}

bool output_close(Output* output, Fault* fault)
{
    if (output == NULL) return true;
    bool closed = true;
    if (output->video != NULL) closed = video_close(output->video, fault);
    if (output->has_last) closed = image_write_png(&output->last, output->path, false, fault);
    image_free(&output->last);
    free(output);
    return closed;
}

int64_t output_count(const Output* output)
{
    return output->count;
}
