// Where pictures go: one PNG, a directory of PNGs, a film, or nowhere.
#pragma once

#include "client/image.h"

typedef struct Output Output;

// `path` decides by its ending: .png the last picture, .mp4 a film of `rate_hz`, a name without a
// dot (or with / at its end) a directory (made if missing) of 00000.png, 00001.png ... NULL keeps
// nothing. Fails now, not after an hour of drawing, where it cannot be written. NULL with a fault.
Output* output_open(const char* path, int width, int height, double rate_hz, Fault* fault);
// Takes a picture. False with a fault where it could not be kept.
bool output_picture(Output* output, const Image* image, Fault* fault);
// Finishes and frees (also after a fault; NULL is fine); false where the end could not be written.
bool output_close(Output* output, Fault* fault);
// Frees without writing what is written at the end: a film, or one PNG. What was there stays.
void output_abandon(Output* output);
// Says so where a directory holds pictures of an earlier, longer run behind this one's.
void output_tell_older(const Output* output, const Notice* notice);
int64_t output_count(const Output* output);
