#include "client/video.h"

#include "client/replace.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

struct Video {
    Replace replace;
    pid_t pid; // 0 once waited for
    int status;
    int frames; // our end of ffmpeg's standard input; -1 once closed
    int words;  // ffmpeg's standard error: a file in memory, which never fills up as a pipe would
    int width, height;
    int64_t count;
    bool failed;
};

// The ffmpegs that run, for a signal handler; 0: none.
static volatile pid_t running[4];

static void note_running(pid_t before, pid_t now)
{
    for (size_t i = 0; i < sizeof running / sizeof *running; ++i)
        if (running[i] == before) {
            running[i] = now;
            return;
        }
}

// Waited for as well: one that is about to make its file would make it after it was removed.
void video_kill_all(void)
{
    for (size_t i = 0; i < sizeof running / sizeof *running; ++i)
        if (running[i] != 0) {
            kill(running[i], SIGKILL);
            waitpid(running[i], NULL, 0);
        }
}

// Crop, not pad: a black line shows, a missing row of background does not. BT.709 is named in full,
// since players guess by size otherwise. rgb0: alpha is no business of a video.
static pid_t spawn_ffmpeg(const Video* video, double rate_hz, int input,
                          posix_spawn_file_actions_t* actions, posix_spawnattr_t* attributes,
                          int* error)
{
    char size[32], rate[32], output[sizeof video->replace.part + 8];
    snprintf(size, sizeof size, "%dx%d", video->width, video->height);
    snprintf(rate, sizeof rate, "%.6f", rate_hz);
    // "file:" keeps names with a colon or a leading dash from being read as something else.
    snprintf(output, sizeof output, "file:%s", video->replace.part);
    // clang-format off
    const char* const arguments[] = {
        "ffmpeg", "-nostdin", "-hide_banner", "-loglevel", "error", "-y",
        "-f", "rawvideo", "-pixel_format", "rgb0", "-video_size", size, "-framerate", rate,
        "-i", "pipe:0", "-an",
        "-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2:0:0,"
               "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p",
        "-c:v", "libx264", "-preset", "veryfast", "-crf", "18",
        "-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709",
        "-fflags", "+bitexact", "-flags:v", "+bitexact", "-movflags", "+faststart",
        "-f", "mp4", output, NULL};
    // clang-format on
    posix_spawn_file_actions_adddup2(actions, input, STDIN_FILENO);
    posix_spawn_file_actions_addopen(actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(actions, video->words, STDERR_FILENO);
    pid_t pid = 0;
    *error = posix_spawnp(&pid, "ffmpeg", actions, attributes, (char* const*)arguments, environ);
    return *error ? 0 : pid;
}

// A process group of its own: Ctrl-C in a terminal is for us, and ffmpeg must live to finish the
// file. If we die it sees the end of its input.
static void set_attributes(posix_spawnattr_t* attributes)
{
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setpgroup(attributes, 0);
    posix_spawnattr_setsigmask(attributes, &none);
    posix_spawnattr_setflags(attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
}

static bool start(Video* video, double rate_hz, int input, Fault* fault)
{
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    int error;
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
    set_attributes(&attributes);
    video->pid = spawn_ffmpeg(video, rate_hz, input, &actions, &attributes, &error);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    if (video->pid) note_running(0, video->pid);
    if (video->pid) return true;
    if (error == ENOENT)
        return fault_set(fault, "ffmpeg is not installed (apt-get install ffmpeg)");
    return fault_set(fault, "cannot run ffmpeg: %s", strerror(error));
}

// A socket pair instead of a pipe: send() takes MSG_NOSIGNAL, so a dead ffmpeg is an error code and
// the process's SIGPIPE is left alone.
static bool connect_and_start(Video* video, double rate_hz, Fault* fault)
{
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        return fault_set(fault, "cannot talk to ffmpeg: %s", strerror(errno));
    video->frames = ends[0];
    const bool ok = start(video, rate_hz, ends[1], fault);
    close(ends[1]);
    return ok;
}

static void free_video(Video* video)
{
    if (video->frames >= 0) close(video->frames);
    if (video->words >= 0) close(video->words);
    free(video);
}

static bool create_files(Video* video, const char* path, Fault* fault)
{
    video->words = memfd_create("ffmpeg", MFD_CLOEXEC);
    if (video->words < 0) return fault_set(fault, "cannot run ffmpeg: %s", strerror(errno));
    // Created here for our own words about read-only directories, and so that no link is followed.
    FILE* file = replace_open(&video->replace, path, fault);
    if (!file) return false;
    fclose(file);
    return true;
}

Video* video_open(const char* path, int width, int height, double rate_hz, Fault* fault)
{
    if (width < 2 || height < 2 || width > IMAGE_MAX_SIDE || height > IMAGE_MAX_SIDE ||
        !(rate_hz >= 0.001 && rate_hz <= 1000)) {
        fault_set(fault, "%s: a video of %dx%d at %g Hz: edges must be 2 to %d, rate 0.001 to 1000",
                  path, width, height, rate_hz, IMAGE_MAX_SIDE);
        return NULL;
    }
    Video* video = calloc(1, sizeof *video);
    if (!video) {
        fault_set(fault, "out of memory for a video");
        return NULL;
    }
    *video = (Video){.frames = -1, .words = -1, .width = width, .height = height};
    if (!create_files(video, path, fault)) {
        free_video(video);
        return NULL;
    }
    if (!connect_and_start(video, rate_hz, fault)) {
        replace_abandon(&video->replace);
        free_video(video);
        return NULL;
    }
    return video;
}

static void end_ffmpeg(Video* video)
{
    if (video->frames >= 0) close(video->frames);
    video->frames = -1;
    while (video->pid && waitpid(video->pid, &video->status, 0) < 0 && errno == EINTR)
        ;
    if (video->pid) note_running(video->pid, 0);
    video->pid = 0;
}

// The last line that ffmpeg said, in `line`.
static void last_words(const Video* video, char* line, size_t size)
{
    char text[1024];
    const off_t end = lseek(video->words, 0, SEEK_END);
    const off_t from = end > (off_t)sizeof text - 1 ? end - ((off_t)sizeof text - 1) : 0;
    const ssize_t got = pread(video->words, text, sizeof text - 1, from);
    size_t length = got > 0 ? (size_t)got : 0;
    while (length > 0 && (text[length - 1] == '\n' || text[length - 1] == '\r'))
        length--;
    text[length] = '\0';
    const char* newline = strrchr(text, '\n');
    snprintf(line, size, "%.*s", (int)size - 1, newline ? newline + 1 : text);
}

static bool ffmpeg_fault(const Video* video, Fault* fault)
{
    char line[160];
    last_words(video, line, sizeof line);
    if (*line) return fault_set(fault, "%.180s: ffmpeg: %s", video->replace.path, line);
    if (WIFSIGNALED(video->status))
        return fault_set(fault, "%.180s: ffmpeg was stopped by signal %d", video->replace.path,
                         WTERMSIG(video->status));
    return fault_set(fault, "%.180s: ffmpeg stopped before the end", video->replace.path);
}

static bool send_all(int socket, const uint8_t* bytes, size_t count)
{
    while (count > 0) {
        const ssize_t sent = send(socket, bytes, count, MSG_NOSIGNAL);
        if (sent < 0 && errno != EINTR) return false;
        if (sent > 0) {
            bytes += sent;
            count -= (size_t)sent;
        }
    }
    return true;
}

bool video_frame(Video* video, const Image* image, Fault* fault)
{
    if (image->width != video->width || image->height != video->height)
        return fault_set(fault, "%s: a frame of %dx%d in a video of %dx%d", video->replace.path,
                         image->width, image->height, video->width, video->height);
    if (!video->failed &&
        send_all(video->frames, image->rgba, (size_t)image->width * (size_t)image->height * 4)) {
        video->count++;
        return true;
    }
    video->failed = true;
    end_ffmpeg(video);
    return ffmpeg_fault(video, fault);
}

static bool finish(Video* video, Fault* fault)
{
    end_ffmpeg(video);
    if (video->failed || video->status != 0) return ffmpeg_fault(video, fault);
    if (video->count == 0)
        return fault_set(fault, "%s: not one frame was drawn, no video is written",
                         video->replace.path);
    return true;
}

void video_abandon(Video* video)
{
    if (video->pid) kill(video->pid, SIGKILL); // nothing of it is wanted
    end_ffmpeg(video);
    replace_abandon(&video->replace);
    free_video(video);
}

bool video_close(Video* video, Fault* fault)
{
    const bool finished = finish(video, fault);
    if (!finished) replace_abandon(&video->replace);
    const bool ok = finished && replace_commit(&video->replace, fault);
    free_video(video);
    return ok;
}
