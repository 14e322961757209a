// The bus: the only file that includes lcm.h.
#pragma once

#include "messages/base.h"

typedef struct Link Link;

// Called for each message of a subscription, in the thread that calls link_handle. The bytes live
// only during the call, at any alignment.
typedef void (*LinkHandler)(void* context, const char* channel, const uint8_t* bytes, size_t size);

// Opens `url` (NULL or "": $LCM_DEFAULT_URL, else udpm://239.255.76.67:7667?ttl=0). The fault names
// the group, the missing route and the command that adds it, or what is wrong with the URL. LCM's
// own chatter on stderr is held back and folded into the fault. NULL on a fault.
Link* link_open(const char* url, Fault* fault);
void link_close(Link* link);

// `pattern` is a regular expression over whole channel names. Queues are unbounded: drain them.
bool link_subscribe(Link* link, const char* pattern, LinkHandler handler, void* context,
                    Fault* fault);

// False where the message could not be sent. Thread safe.
bool link_publish(Link* link, const char* channel, const uint8_t* bytes, size_t size);

// Handles messages for at most `timeout_ms` (0: only what is queued), at most one wait. Returns the
// number handled, or -1 when the link is dead.
int link_handle(Link* link, int timeout_ms);

// Ready to read when link_handle has work; for poll().
int link_fileno(Link* link);
