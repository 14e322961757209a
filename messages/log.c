#include "messages/log.h"

#include "messages/bytes.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#define SYNC               0xeda1da01u
#define HEADER_BYTES       28
#define MAX_EVENT_BYTES    (HEADER_BYTES + LOG_MAX_CHANNEL_BYTES + LOG_MAX_DATA_BYTES)
#define WINDOW_BYTES       (2 * (MAX_EVENT_BYTES + 4))
#define WRITE_BUFFER_BYTES (MAX_EVENT_BYTES + 64 * 1024)
#define FLUSH_BYTES        (64 * 1024)
#define FLUSH_US           100000 // what a crash may cost

// One event: sync, number, utime, channel length, data length (big-endian), channel, data.
enum { AT_SYNC = 0, AT_NUMBER = 4, AT_UTIME = 12, AT_CHANNEL_BYTES = 20, AT_DATA_BYTES = 24 };

// Reading ---------------------------------------------------------------------------------------

// A window over the file that always can hold a whole event: no allocation after opening, whatever
// lengths the file claims.
struct LogReader {
    int file;
    int64_t offset; // in the file, of window[start]
    size_t start, end;
    int64_t audited; // damage before this offset is counted already
    int64_t damaged;
    uint8_t window[WINDOW_BYTES];
};

LogReader* log_open(const char* path, Fault* fault)
{
    struct stat status;
    int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); // a pipe is refused, not waited for
    if (file < 0) {
        fault_set(fault, "%.200s: %s", path, strerror(errno));
        return NULL;
    }
    if (fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
        close(file);
        fault_set(fault, "%.200s: not a file; a log must be one", path);
        return NULL;
    }
    LogReader* reader = malloc(sizeof *reader);
    if (reader == NULL) {
        close(file);
        fault_set(fault, "%.200s: no memory", path);
        return NULL;
    }
    reader->file = file;
    reader->audited = reader->damaged = 0;
    reader->offset = 0;
    reader->start = reader->end = 0;
    return reader;
}

void log_close(LogReader* reader)
{
    if (reader == NULL) return;
    close(reader->file);
    free(reader);
}

// What is in the window is not read again: a player seeks to each event of a tick, and they lie
// side by side.
void log_seek(LogReader* reader, int64_t offset)
{
    if (offset < 0) offset = 0;
    int64_t window = reader->offset - (int64_t)reader->start; // in the file
    bool inside = offset >= window && offset - window <= (int64_t)reader->end;
    reader->start = inside ? (size_t)(offset - window) : 0;
    if (!inside) reader->end = 0;
    reader->offset = offset;
}

void log_rewind(LogReader* reader)
{
    log_seek(reader, 0);
}

int64_t log_damaged_bytes(const LogReader* reader)
{
    return reader->damaged;
}

// Reads on until `count` bytes lie in the window; false where the file ends before that. A read
// error is an end too: what lies behind it cannot be had.
static bool have(LogReader* reader, size_t count)
{
    if (reader->start + count > WINDOW_BYTES) {
        memmove(reader->window, reader->window + reader->start, reader->end - reader->start);
        reader->end -= reader->start;
        reader->start = 0;
    }
    while (reader->end - reader->start < count) {
        ssize_t got = pread(reader->file, reader->window + reader->end, WINDOW_BYTES - reader->end,
                            reader->offset + (int64_t)(reader->end - reader->start));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        reader->end += (size_t)got;
    }
    return true;
}

static void advance(LogReader* reader, size_t count)
{
    reader->start += count;
    reader->offset += (int64_t)count;
}

// A later pass over the same bytes (after log_rewind) does not count them again.
static void skip_damage(LogReader* reader, size_t count)
{
    int64_t from = reader->offset > reader->audited ? reader->offset : reader->audited;
    advance(reader, count);
    if (reader->offset > from) {
        reader->damaged += reader->offset - from;
        reader->audited = reader->offset;
    }
}

static bool is_channel(const uint8_t* text, uint32_t length)
{
    for (uint32_t i = 0; i < length; ++i)
        if (text[i] < ' ' || text[i] > '~') return false;
    return length > 0;
}

// Bytes of the event whose first `available` bytes lie at `at`, or 0 where it cannot be one.
static size_t plausible_event(const uint8_t* at, size_t available)
{
    if (available < HEADER_BYTES || bytes_get_be32(at + AT_SYNC) != SYNC) return 0;
    uint32_t channel = bytes_get_be32(at + AT_CHANNEL_BYTES);
    uint32_t data = bytes_get_be32(at + AT_DATA_BYTES);
    if (channel > LOG_MAX_CHANNEL_BYTES || data > LOG_MAX_DATA_BYTES) return 0;
    if (available < HEADER_BYTES + channel || !is_channel(at + HEADER_BYTES, channel)) return 0;
    return HEADER_BYTES + channel + data;
}

// Whether another event begins inside this one's data. Only asked where no sync follows it, which
// is what a damaged length looks like: believing it would swallow good events.
static bool swallows_events(const uint8_t* at, size_t size)
{
    for (size_t i = HEADER_BYTES; i + HEADER_BYTES <= size; ++i)
        if (at[i] == SYNC >> 24 && plausible_event(at + i, size - i) != 0) return true;
    return false;
}

// Bytes of the sound event at the window's start, or 0.
static size_t sound_event(LogReader* reader)
{
    have(reader, HEADER_BYTES + LOG_MAX_CHANNEL_BYTES); // or what is left of the file
    size_t size = plausible_event(reader->window + reader->start, reader->end - reader->start);
    if (size == 0 || !have(reader, size)) return 0;
    bool goes_on = have(reader, size + 4);
    const uint8_t* at = reader->window + reader->start;
    bool is_followed =
        goes_on ? bytes_get_be32(at + size) == SYNC : reader->end - reader->start == size;
    return is_followed || !swallows_events(at, size) ? size : 0;
}

// To the next byte that may begin a sync word, at least one on; all of it is damage.
static void resync(LogReader* reader)
{
    size_t left = reader->end - reader->start - 1;
    const uint8_t* from = reader->window + reader->start + 1;
    const uint8_t* found = memchr(from, SYNC >> 24, left);
    skip_damage(reader, 1 + (found != NULL ? (size_t)(found - from) : left));
}

bool log_next(LogReader* reader, LogEvent* event)
{
    while (have(reader, 1)) {
        size_t size = sound_event(reader);
        if (size == 0) {
            resync(reader);
            continue;
        }
        const uint8_t* at = reader->window + reader->start;
        uint32_t channel_bytes = bytes_get_be32(at + AT_CHANNEL_BYTES);
        event->number = (int64_t)bytes_get_be64(at + AT_NUMBER);
        event->utime = (int64_t)bytes_get_be64(at + AT_UTIME);
        memcpy(event->channel, at + HEADER_BYTES, channel_bytes);
        event->channel[channel_bytes] = '\0';
        event->data = at + HEADER_BYTES + channel_bytes;
        event->size = bytes_get_be32(at + AT_DATA_BYTES);
        event->offset = reader->offset;
        advance(reader, size);
        return true;
    }
    return false;
}

// Writing ---------------------------------------------------------------------------------------

// Own buffer rather than stdio's: after a failed write we must know where the last complete event
// ends, and stdio does not say how much of its buffer went out.
struct LogWriter {
    int file;
    bool is_regular; // not a device
    bool is_new;     // this writer has made the file
    int64_t number, flushed_bytes, flushed_us;
    bool failed;
    char* path;
    size_t size;
    uint8_t buffer[WRITE_BUFFER_BYTES];
};

// Without O_TRUNC: what is there stays until there is something to put in its place.
static int open_for_writing(const char* path, bool overwrite, bool* is_new)
{
    int flags = O_WRONLY | O_CREAT | O_CLOEXEC | O_NONBLOCK; // a pipe is refused, not waited for
    int file = open(path, flags | O_EXCL, 0666);
    *is_new = file >= 0;
    return file < 0 && errno == EEXIST && overwrite ? open(path, flags, 0666) : file;
}

static bool fault_open(const char* path, int reason, Fault* fault)
{
    if (reason == ENXIO) // a pipe that nobody reads
        return fault_set(fault, "%.200s: not a file; a recording must be one", path);
    const char* fix = reason == EEXIST
                          ? "; choose another name, remove it, or let it be replaced (--overwrite)"
                          : "";
    return fault_set(fault, "%.200s: %s%s", path, strerror(reason), fix);
}

// Two that write one file would cut each other's events. A file system without locks is believed.
static bool check_target(int file, const char* path, bool* is_regular, Fault* fault)
{
    struct stat status;
    if (fstat(file, &status) != 0) return fault_open(path, errno, fault);
    *is_regular = S_ISREG(status.st_mode);
    if (!*is_regular && !S_ISCHR(status.st_mode))
        return fault_set(fault, "%.200s: not a file; a recording must be one", path);
    if (*is_regular && flock(file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
        return fault_set(fault, "%.200s: another program is recording into it; choose another name",
                         path);
    return true;
}

LogWriter* log_create(const char* path, bool overwrite, Fault* fault)
{
    bool is_new, is_regular = false;
    int file = open_for_writing(path, overwrite, &is_new);
    if (file < 0) {
        fault_open(path, errno, fault);
        return NULL;
    }
    if (!check_target(file, path, &is_regular, fault)) {
        close(file);
        return NULL;
    }
    LogWriter* writer = calloc(1, sizeof *writer);
    char* kept = strdup(path);
    if (writer == NULL || kept == NULL) {
        close(file);
        free(writer);
        free(kept);
        fault_set(fault, "%.200s: no memory", path);
        return NULL;
    }
    writer->file = file;
    writer->is_new = is_new;
    writer->is_regular = is_regular;
    writer->flushed_us = base_monotonic_us();
    writer->path = kept;
    return writer;
}

// Bytes of the whole events among the first `written` of the buffer.
static size_t whole_events(const LogWriter* writer, size_t written)
{
    size_t whole = 0;
    while (whole < written) {
        const uint8_t* at = writer->buffer + whole;
        size_t size = HEADER_BYTES + bytes_get_be32(at + AT_CHANNEL_BYTES) +
                      (size_t)bytes_get_be32(at + AT_DATA_BYTES);
        if (whole + size > written) break;
        whole += size;
    }
    return whole;
}

// Nothing after a failure is written: a log with a hole would replay wrongly without a word.
static bool fail(LogWriter* writer, size_t written, int reason, Fault* fault)
{
    writer->failed = true;
    writer->flushed_bytes += (int64_t)whole_events(writer, written);
    writer->size = 0;
    const char* state = ftruncate(writer->file, writer->flushed_bytes) == 0
                            ? "it ends with the last whole event"
                            : "its end may be damaged";
    return fault_set(fault, "%.200s: %s after %lld bytes; %s; recording has stopped", writer->path,
                     strerror(reason), (long long)writer->flushed_bytes, state);
}

static bool flush(LogWriter* writer, Fault* fault)
{
    size_t written = 0;
    // Now the earlier recording goes, and not before.
    bool is_first = writer->flushed_bytes == 0 && writer->size > 0 && writer->is_regular;
    if (is_first && ftruncate(writer->file, 0) != 0) return fail(writer, 0, errno, fault);
    while (written < writer->size) {
        ssize_t put = write(writer->file, writer->buffer + written, writer->size - written);
        if (put < 0 && errno == EINTR) continue;
        if (put <= 0) return fail(writer, written, put < 0 ? errno : ENOSPC, fault);
        written += (size_t)put;
    }
    writer->flushed_bytes += (int64_t)written;
    writer->flushed_us = base_monotonic_us();
    writer->size = 0;
    return true;
}

bool log_write(LogWriter* writer, int64_t utime, const char* channel, const uint8_t* bytes,
               size_t size, Fault* fault)
{
    if (writer->failed) return true;
    size_t channel_bytes = strlen(channel);
    if (channel_bytes < 1 || channel_bytes > LOG_MAX_CHANNEL_BYTES || size > LOG_MAX_DATA_BYTES)
        return fault_set(fault,
                         "%.200s: an event of %zu bytes on \"%.63s\": at most %d on a name "
                         "of 1 to %d bytes",
                         writer->path, size, channel, LOG_MAX_DATA_BYTES, LOG_MAX_CHANNEL_BYTES);
    uint8_t* at = writer->buffer + writer->size;
    bytes_put_be32(at + AT_SYNC, SYNC);
    bytes_put_be64(at + AT_NUMBER, (uint64_t)writer->number++);
    bytes_put_be64(at + AT_UTIME, (uint64_t)utime);
    bytes_put_be32(at + AT_CHANNEL_BYTES, (uint32_t)channel_bytes);
    bytes_put_be32(at + AT_DATA_BYTES, (uint32_t)size);
    memcpy(at + HEADER_BYTES, channel, channel_bytes);
    if (size > 0) memcpy(at + HEADER_BYTES + channel_bytes, bytes, size);
    writer->size += HEADER_BYTES + channel_bytes + size;
    bool is_due =
        writer->size >= FLUSH_BYTES || base_monotonic_us() - writer->flushed_us > FLUSH_US;
    return !is_due || flush(writer, fault);
}

bool log_finish(LogWriter* writer, Fault* fault)
{
    if (writer == NULL) return true;
    bool finished =
        !writer->failed
            ? flush(writer, fault)
            : fault_set(fault, "%.200s: incomplete: an earlier write failed", writer->path);
    // An empty file is no log: it would only stop the next attempt.
    if (writer->is_new && writer->is_regular && writer->flushed_bytes == 0) unlink(writer->path);
    if (close(writer->file) != 0 && finished)
        finished = fault_set(fault, "%.200s: %s", writer->path, strerror(errno));
    free(writer->path);
    free(writer);
    return finished;
}
