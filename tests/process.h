// The real programs under test: started with pipes, waited for by what they say, killed at the end
// whatever happens. For tests that run under `scripts/lan --private`.
#pragma once

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define SERVER BIN_DIR "/hair-server"
#define CLIENT BIN_DIR "/hair-client"
#define LOG    BIN_DIR "/hair-log"

#if defined(__SANITIZE_ADDRESS__)
#define PROCESS_SANITIZED true // times and sizes of memory are printed, not promised
#else
#define PROCESS_SANITIZED false
#endif

#define PROCESS_MOST     16
#define PROCESS_PATIENCE 60.0  // s; for what takes one on an idle machine
#define PROCESS_ALARM_S  150   // below CTest's TIMEOUT, which would leave the programs running
#define PROCESS_TEXT     65536 // bytes kept of what a program says

extern char** environ;

typedef struct Process {
    pid_t pid;    // and process group; 0: none
    int pipes[2]; // read only while it is waited for: one that says more than 64 KiB then blocks
    char text[2][PROCESS_TEXT]; // standard output, standard error
    size_t size[2];
    bool ended;
    int status; // of exit, or 128 + signal
} Process;

// The groups to kill when a test fails or hangs; a signal handler reads it, hence no heap.
static volatile pid_t process_groups[PROCESS_MOST];

#define ARGS(...) ((const char* const[]){__VA_ARGS__, NULL})

static inline double process_now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static inline void process_pause(double seconds)
{
    struct timespec pause = {(time_t)seconds, (long)((seconds - (double)(time_t)seconds) * 1e9)};
    nanosleep(&pause, NULL);
}

static inline void process_kill_all(void)
{
    for (int i = 0; i < PROCESS_MOST; ++i)
        if (process_groups[i] != 0) kill(-process_groups[i], SIGKILL);
}

// After each test, so that what a failed one left does not spoil the next.
static inline int process_teardown(void** state)
{
    (void)state;
    for (int i = 0; i < PROCESS_MOST; ++i) {
        pid_t pid = process_groups[i];
        if (pid == 0) continue;
        kill(-pid, SIGKILL);
        waitpid(pid, NULL, 0);
        process_groups[i] = 0;
    }
    return 0;
}

#define PROCESS_TEST(function) cmocka_unit_test_teardown(function, process_teardown)

static inline void process_out_of_time(int signal_number)
{
    (void)signal_number;
    static const char text[] = "the test program is out of time; its programs are killed\n";
    if (write(STDERR_FILENO, text, sizeof text - 1) < 0) {
    } // nothing to be done about it
    process_kill_all();
    _exit(1);
}

// Once, before the tests.
static inline void process_setup(void)
{
    setenv("LSAN_OPTIONS", "suppressions=" SOURCE_DIR "/scripts/lsan.supp:print_suppressions=0", 0);
    setenv("EGL_LOG_LEVEL", "fatal", 0);
    setenv("OMP_WAIT_POLICY", "passive", 0);
    unsetenv("LCM_DEFAULT_URL");
    signal(SIGALRM, process_out_of_time);
    signal(SIGPIPE, SIG_IGN);
    atexit(process_kill_all);
    alarm(PROCESS_ALARM_S);
}

// `in`: the program's working directory, or NULL.
static inline void process_start_in(Process* process, const char* in, const char* const* argv)
{
    int out[2], err[2], slot = 0;
    *process = (Process){.pipes = {-1, -1}};
    while (slot < PROCESS_MOST && process_groups[slot] != 0)
        ++slot;
    assert_in_range(slot, 0, PROCESS_MOST - 1);
    assert_int_equal(pipe2(out, O_CLOEXEC), 0);
    assert_int_equal(pipe2(err, O_CLOEXEC), 0);
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, err[1], STDERR_FILENO);
    if (in != NULL) posix_spawn_file_actions_addchdir_np(&actions, in);
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes, 0);
    int error =
        posix_spawnp(&process->pid, argv[0], &actions, &attributes, (char* const*)argv, environ);
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    close(out[1]);
    close(err[1]);
    process->pipes[0] = out[0];
    process->pipes[1] = err[0];
    if (error != 0) fail_msg("%s: %s", argv[0], strerror(error));
    process_groups[slot] = process->pid;
}

static inline void process_start(Process* process, const char* const* argv)
{
    process_start_in(process, NULL, argv);
}

static inline void process_read(Process* process, int which)
{
    char chunk[4096];
    ssize_t n = read(process->pipes[which], chunk, sizeof chunk);
    if (n <= 0) {
        close(process->pipes[which]);
        process->pipes[which] = -1;
        return;
    }
    size_t room = PROCESS_TEXT - 1 - process->size[which];
    size_t take = (size_t)n < room ? (size_t)n : room; // the rest is read and dropped
    memcpy(process->text[which] + process->size[which], chunk, take);
    process->size[which] += take;
    process->text[which][process->size[which]] = '\0';
}

static inline void process_reap(Process* process)
{
    int status;
    if (process->ended || waitpid(process->pid, &status, WNOHANG) != process->pid) return;
    process->ended = true;
    process->status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    for (int i = 0; i < PROCESS_MOST; ++i)
        if (process_groups[i] == process->pid) process_groups[i] = 0;
}

// Takes what the program says for up to `seconds`; returns at once when something was said.
static inline void process_pump(Process* process, double seconds)
{
    struct pollfd waiting[2] = {{process->pipes[0], POLLIN, 0}, {process->pipes[1], POLLIN, 0}};
    bool open = process->pipes[0] >= 0 || process->pipes[1] >= 0;
    // Pipes closed: it is about to end, or gave them to a child of its own.
    if (poll(waiting, 2, (int)((open ? seconds : 0.005) * 1e3)) > 0)
        for (int i = 0; i < 2; ++i)
            if (waiting[i].revents != 0) process_read(process, i);
    if (process->pipes[0] < 0 && process->pipes[1] < 0) process_reap(process);
}

static inline void process_fail(Process* process, const char* what)
{
    fprintf(stderr, "--- standard output:\n%s--- standard error:\n%s---\n", process->text[0],
            process->text[1]);
    fail_msg("%s", what);
}

// Until standard output (0) or error (1) holds `text`.
static inline void process_wait_text(Process* process, int which, const char* text)
{
    double until = process_now_s() + PROCESS_PATIENCE;
    while (strstr(process->text[which], text) == NULL) {
        if (process->ended) process_fail(process, "ended before it said what was awaited");
        process_pump(process, 0.1);
        if (process_now_s() > until) process_fail(process, "never said what was awaited");
    }
}

static inline void process_wait_ready(Process* process)
{
    process_wait_text(process, 0, "ready");
}

// Until it ends; its exit status.
static inline int process_wait(Process* process)
{
    double until = process_now_s() + PROCESS_PATIENCE;
    while (!process->ended) {
        process_pump(process, 0.1);
        if (process_now_s() > until) {
            kill(-process->pid, SIGKILL);
            process_fail(process, "does not end");
        }
    }
    return process->status;
}

static inline void process_expect(Process* process, int status)
{
    if (process_wait(process) == status) return;
    fprintf(stderr, "exit status %d, not %d\n", process->status, status);
    process_fail(process, "another exit status than expected");
}

// Asks it to end, as a user would.
static inline void process_stop(Process* process)
{
    kill(-process->pid, SIGTERM);
    process_expect(process, 0);
}

// As the kernel would for lack of memory.
static inline void process_kill(Process* process)
{
    kill(-process->pid, SIGKILL);
    process_wait(process);
    assert_int_equal(process->status, 128 + SIGKILL);
}

static inline void process_run_in(Process* process, const char* in, const char* const* argv)
{
    process_start_in(process, in, argv);
    process_wait(process);
}

static inline void process_run(Process* process, const char* const* argv)
{
    process_run_in(process, NULL, argv);
}

// Runs it to the end, which must be a good one.
static inline void process_do(Process* process, const char* const* argv)
{
    process_start(process, argv);
    process_expect(process, 0);
}

static inline int process_lines(const char* text)
{
    int lines = 0;
    for (; *text != '\0'; ++text)
        lines += *text == '\n';
    return lines;
}

// Lines of standard error but for the server's "too slow here": whether it comes is the machine's
// doing, not the program's.
static inline int process_complaints(const Process* process)
{
    int slow = 0;
    for (const char* at = process->text[1]; (at = strstr(at, "too slow here")) != NULL; ++at)
        ++slow;
    return process_lines(process->text[1]) - slow;
}

// The number after `label` on standard output.
static inline int64_t process_number(const Process* process, const char* label)
{
    const char* at = strstr(process->text[0], label);
    assert_non_null(at);
    return strtoll(at + strlen(label), NULL, 10);
}

// KiB of memory that a program holds; its own process, not a wrapper's.
static inline long process_rss_kib(const Process* process)
{
    char path[64], line[256];
    long kib = -1;
    snprintf(path, sizeof path, "/proc/%d/status", (int)process->pid);
    FILE* file = fopen(path, "r");
    assert_non_null(file);
    while (fgets(line, sizeof line, file) != NULL)
        if (sscanf(line, "VmRSS: %ld", &kib) == 1) break;
    fclose(file);
    assert_true(kib > 0);
    return kib;
}

// Files -----------------------------------------------------------------------------------------

// A directory of the test's own, and names in it.
typedef struct Folder {
    char path[64];
    char names[8][128]; // of folder_name, in turn
    int next;
} Folder;

static inline void folder_make(Folder* folder)
{
    *folder = (Folder){.path = P_tmpdir "/strandcast-XXXXXX"};
    assert_non_null(mkdtemp(folder->path));
}

// Good for the next seven calls.
static inline const char* folder_name(Folder* folder, const char* name)
{
    char* text = folder->names[folder->next++ % 8];
    assert_true(strlen(folder->path) + 1 + strlen(name) < sizeof folder->names[0]);
    strcpy(text, folder->path);
    strcat(strcat(text, "/"), name);
    return text;
}

static inline void folder_remove(Folder* folder)
{
    Process process;
    process_do(&process, ARGS("rm", "-r", "--", folder->path));
}

static inline bool file_exists(const char* path)
{
    return access(path, F_OK) == 0;
}

static inline void file_wait(const char* path)
{
    double until = process_now_s() + PROCESS_PATIENCE;
    while (!file_exists(path)) {
        if (process_now_s() > until) fail_msg("%s never came", path);
        process_pause(0.01);
    }
}

// The whole file; free it.
static inline uint8_t* file_read(const char* path, size_t* size)
{
    FILE* file = fopen(path, "rb");
    if (file == NULL) fail_msg("%s: %s", path, strerror(errno));
    struct stat info;
    assert_int_equal(fstat(fileno(file), &info), 0);
    *size = (size_t)info.st_size;
    uint8_t* bytes = malloc(*size + 1);
    assert_non_null(bytes);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    bytes[*size] = 0;
    fclose(file);
    return bytes;
}

static inline void file_write(const char* path, const void* bytes, size_t size)
{
    FILE* file = fopen(path, "wb");
    if (file == NULL) fail_msg("%s: %s", path, strerror(errno));
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static inline bool files_equal(const char* a, const char* b)
{
    size_t a_size, b_size;
    uint8_t *a_bytes = file_read(a, &a_size), *b_bytes = file_read(b, &b_size);
    bool equal = a_size == b_size && memcmp(a_bytes, b_bytes, a_size) == 0;
    free(a_bytes);
    free(b_bytes);
    return equal;
}

static inline void expect_png(const char* path)
{
    static const uint8_t signature[8] = {137, 'P', 'N', 'G', 13, 10, 26, 10};
    size_t size;
    uint8_t* bytes = file_read(path, &size);
    assert_true(size > 100);
    assert_memory_equal(bytes, signature, sizeof signature);
    free(bytes);
}

// Pictures in a directory tell how far a client is, without asking it.
static inline int pictures_in(const char* folder)
{
    char path[160];
    int count = 0;
    while (snprintf(path, sizeof path, "%s/%05d.png", folder, count), file_exists(path))
        ++count;
    return count;
}

static inline void wait_pictures(const char* folder, int count)
{
    char path[160];
    snprintf(path, sizeof path, "%s/%05d.png", folder, count - 1);
    file_wait(path);
}

// Stats -----------------------------------------------------------------------------------------

static inline json_t* stats_load(const char* path)
{
    json_error_t error;
    json_t* root = json_load_file(path, 0, &error);
    if (root == NULL) fail_msg("%s:%d: %s", path, error.line, error.text);
    return root;
}

// A number of the client's --stats; `key` may be "datagrams.lost".
static inline double stats_number(const json_t* root, const char* key)
{
    char outer[64];
    const char* dot = strchr(key, '.');
    const json_t* value = NULL;
    if (dot == NULL) {
        value = json_object_get(root, key);
    } else {
        snprintf(outer, sizeof outer, "%.*s", (int)(dot - key), key);
        value = json_object_get(json_object_get(root, outer), dot + 1);
    }
    if (!json_is_number(value)) fail_msg("--stats has no number %s", key);
    return json_number_value(value);
}

static inline int64_t stats_integer(const json_t* root, const char* key)
{
    const json_t* value = json_object_get(root, key);
    if (!json_is_integer(value)) fail_msg("--stats has no whole number %s", key);
    return (int64_t)json_integer_value(value);
}

static inline const char* stats_text(const json_t* root, const char* key)
{
    const char* text = json_string_value(json_object_get(root, key));
    if (text == NULL) fail_msg("--stats has no text %s", key);
    return text;
}
