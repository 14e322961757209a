#include "messages/base.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

bool fault_set(Fault* fault, const char* format, ...)
{
    if (fault == NULL) return false;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(fault->text, sizeof fault->text, format, arguments);
    va_end(arguments);
    return false;
}

bool fault_prefix(Fault* fault, const char* prefix)
{
    if (fault == NULL) return false;
    char text[sizeof fault->text];
    memcpy(text, fault->text, sizeof text);
    snprintf(fault->text, sizeof fault->text, "%.150s: %.240s", prefix, text);
    return false;
}

void notice_say(const Notice* notice, const char* format, ...)
{
    if (notice == NULL || notice->say == NULL) return;
    char text[sizeof((Fault*)0)->text];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    notice->say(notice->context, text);
}

bool base_stdout_written(Fault* fault)
{
    errno = 0;
    if (fflush(stdout) == 0 && !ferror(stdout)) return true;
    // The reason of a write that failed long ago is no longer known.
    return fault_set(fault, "cannot write to standard output: %s",
                     errno != 0 ? strerror(errno) : "a write failed");
}

static int64_t clock_us(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

int64_t base_monotonic_us(void)
{
    return clock_us(CLOCK_MONOTONIC);
}

int64_t base_wall_us(void)
{
    return clock_us(CLOCK_REALTIME);
}

void base_sleep_until_us(int64_t when_us)
{
    if (when_us <= 0) return;
    struct timespec when = {.tv_sec = when_us / 1000000, .tv_nsec = (when_us % 1000000) * 1000};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, NULL);
}
