// The drain thread: takes every message off the bus the moment it comes and hands it to Receive,
// and sends the requests that fall due. LCM queues keep the oldest and LCM's own thread only fills
// them, so somebody must always be reading; nothing here waits for drawing.
#pragma once

#include "client/receive.h"
#include "messages/link.h"

typedef struct Drain Drain;

// Opens `url` (see link_open), subscribes to what `receive` keeps and starts the thread. `receive`
// must outlive it. Notice (from the thread, no lock held): the bus is lost. NULL with a fault.
Drain* drain_start(const char* url, Receive* receive, Notice notice, Fault* fault);

// Ends the thread within 50 ms and closes the link; NULL is fine.
void drain_stop(Drain* drain);

// False once the bus is lost.
bool drain_running(const Drain* drain);

// For publishing poses or views on the same bus (link_publish may be called from any thread).
Link* drain_link(Drain* drain);
