// What every file stands on: one-line faults, notices, clocks, and whether what was printed came
// through. Nothing else belongs here.
//
// Three degrees of doubt: assert() for our own bugs (bytes from outside never reach one), a Fault
// for what the world did wrong, a Notice for what the user should know while work goes on.
// Libraries return faults and raise notices; only the files with a main print or exit.
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define STRANDCAST_VERSION "0.1.0"

// Why something could not be done, as one line that names the file, field or value and the fix.
// Owned by the caller; empty text means no fault.
typedef struct Fault {
    char text[400];
} Fault;

// Writes the fault and returns false, so that a check reads `return fault_set(fault, "...")`.
// `fault` may be NULL when the caller does not want the reason.
bool fault_set(Fault* fault, const char* format, ...) __attribute__((format(printf, 2, 3)));

// Puts "prefix: " before a fault's text (a file name, for example); returns false.
bool fault_prefix(Fault* fault, const char* prefix);

// How a library tells its user something that is not an error. May be called from any thread that
// called into the library; `text` lives only during the call. A zero Notice is silent.
typedef struct Notice {
    void (*say)(void* context, const char* text);
    void* context;
} Notice;

void notice_say(const Notice* notice, const char* format, ...)
    __attribute__((format(printf, 2, 3)));

// At a program's end: false with a fault where standard output did not take all of what was printed
// (a full disk, a closed pipe). What it cannot say would otherwise be lost with status 0.
bool base_stdout_written(Fault* fault);

// Monotonic clock in microseconds: for pacing and timeouts only, never for physics.
int64_t base_monotonic_us(void);

// Wall clock in microseconds since 1970: for epochs and `utime` when paced.
int64_t base_wall_us(void);

// Sleeps until the monotonic clock reads `when_us`; returns early on a signal.
void base_sleep_until_us(int64_t when_us);
