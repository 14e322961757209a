// LCM event logs: our own bounded reader (liblcm's crashes on damaged files) and a writer that
// notices a full disk. Format: sync 0xEDA1DA01, event number, time, two lengths, channel, data.
#pragma once

#include "messages/base.h"

#define LOG_MAX_CHANNEL_BYTES 63
#define LOG_MAX_DATA_BYTES    (1 << 20)

typedef struct LogEvent {
    int64_t number;
    int64_t utime; // when it was recorded, us
    char channel[LOG_MAX_CHANNEL_BYTES + 1];
    const uint8_t* data; // valid until the next call on the reader
    size_t size;
    int64_t offset; // of the event in the file
} LogEvent;

typedef struct LogReader LogReader;

LogReader* log_open(const char* path, Fault* fault);
void log_close(LogReader* reader);

// The next sound event. Damage (wrong sync, absurd lengths, a truncated tail) is skipped to the
// next sync word and counted. False at the end of the file.
bool log_next(LogReader* reader, LogEvent* event);
void log_rewind(LogReader* reader);
// Goes to an event whose offset was seen before.
void log_seek(LogReader* reader, int64_t offset);
int64_t log_damaged_bytes(const LogReader* reader);

typedef struct LogWriter LogWriter;

// Creates `path`; refuses to write over a file that exists unless `overwrite`, and one that another
// program records into. What is there is lost with the first bytes that are written, not before; a
// file that was made here and never written is taken away again.
LogWriter* log_create(const char* path, bool overwrite, Fault* fault);
// Events are buffered for at most 0.1 s (as calls go) or 64 KiB. False with a fault on the first
// failed write (disk full): the file then ends with the last complete event, and later calls are
// silent no-ops that return true, so that nobody reports the same disk twice. False too, without
// consequences, for an event beyond the caps above.
bool log_write(LogWriter* writer, int64_t utime, const char* channel, const uint8_t* bytes,
               size_t size, Fault* fault);
// Writes what is buffered, closes and frees; false with a fault when any write failed.
bool log_finish(LogWriter* writer, Fault* fault);
