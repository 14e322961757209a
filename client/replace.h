// A file that appears whole or not at all: written beside its place, then renamed over it.
//
// Without this a full disk, a crash or Ctrl-C half-way would cost the good file that was there.
#pragma once

#include "messages/base.h"

#include <stdio.h>

typedef struct Replace {
    char path[4096];      // what will be replaced, links resolved
    char part[4096 + 32]; // where to write meanwhile
} Replace;

// Chooses the place and creates the file to write. Devices and pipes (/dev/full, /dev/stdout) are
// written in place: renaming over them would destroy the device. NULL with a fault; else close the
// stream before replace_commit or replace_abandon.
FILE* replace_open(Replace* replace, const char* path, Fault* fault);

// Closes `file` after checking that all of it was written, and renames. False with a fault, and
// then nothing is left behind.
bool replace_close(Replace* replace, FILE* file, Fault* fault);

// For a file whose stream is closed already (written by another program).
bool replace_commit(const Replace* replace, Fault* fault);

// Removes what was written.
void replace_abandon(const Replace* replace);

// For a signal handler that is about to end the process: removes what every Replace has written so
// far.
void replace_unlink_parts(void);
