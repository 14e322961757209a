// Frames into an MP4 (H.264) through the ffmpeg program.
//
// A program on a pipe instead of libavcodec: no link-time dependency for what few users need, and
// its crash is not ours.
#pragma once

#include "client/image.h"

typedef struct Video Video;

// Starts ffmpeg. An odd width or height loses its last column or row (H.264 4:2:0 needs even
// sizes). The file gets its name in video_close; until then what was there stays. NULL with a
// fault.
Video* video_open(const char* path, int width, int height, double rate_hz, Fault* fault);

// Appends a frame, which must have the size given to video_open. Waits while ffmpeg is busy.
// After a fault only video_close is of use.
bool video_frame(Video* video, const Image* image, Fault* fault);

// Ends the file, waits for ffmpeg and frees `video` in any case. False with ffmpeg's last words.
bool video_close(Video* video, Fault* fault);

// Frees `video` without a file: what was there stays.
void video_abandon(Video* video);

// For a signal handler that is about to end the process: ends every ffmpeg that runs, so that none
// makes its file again.
void video_kill_all(void);
