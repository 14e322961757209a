#include "client/drain.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

// How long one wait for messages lasts: bounds the delay of a request and of stopping.
#define WAIT_MS 20

struct Drain {
    Link* link;
    Receive* receive;
    Notice notice;
    pthread_t thread;
    atomic_bool stop, running;
};

static void handle(void* context, const char* channel, const uint8_t* bytes, size_t size)
{
    Drain* drain = context;
    receive_message(drain->receive, channel, bytes, size, base_monotonic_us());
}

static void send_request(Drain* drain)
{
    uint8_t bytes[CONTROL_MAX_BYTES];
    size_t size = receive_request(drain->receive, base_monotonic_us(), bytes, sizeof bytes);
    // A request that cannot be sent is asked again when it next falls due.
    if (size > 0) link_publish(drain->link, CHANNEL_REQUEST, bytes, size);
}

static void* run(void* context)
{
    Drain* drain = context;
    while (!atomic_load(&drain->stop)) {
        if (link_handle(drain->link, WAIT_MS) < 0) {
            notice_say(&drain->notice, "the bus is lost: nothing more will arrive; start again");
            break;
        }
        send_request(drain);
    }
    atomic_store(&drain->running, false);
    return NULL;
}

// One subscription a slot, not the regular expression over all: LCM copies and queues whatever
// matches, and a daemon may publish a thousand slots of which one is drawn.
static bool subscribe(Drain* drain, Fault* fault)
{
    const int* slots = NULL;
    int slot_count = receive_slots(drain->receive, &slots);
    for (int i = 0; i < slot_count; ++i) {
        char channel[CHANNEL_BYTES];
        channel_guides(channel, slots[i]);
        if (!link_subscribe(drain->link, channel, handle, drain, fault)) return false;
    }
    return link_subscribe(drain->link, CHANNEL_STYLE, handle, drain, fault);
}

Drain* drain_start(const char* url, Receive* receive, Notice notice, Fault* fault)
{
    Drain* drain = calloc(1, sizeof *drain);
    if (drain == NULL) {
        fault_set(fault, "no memory for the drain thread");
        return NULL;
    }
    drain->receive = receive;
    drain->notice = notice;
    drain->link = link_open(url, fault);
    bool ready = drain->link != NULL && subscribe(drain, fault);
    atomic_store(&drain->running, true);
    if (ready && pthread_create(&drain->thread, NULL, run, drain) != 0)
        ready = fault_set(fault, "the drain thread could not be started: too many processes?");
    if (ready) return drain;
    if (drain->link != NULL) link_close(drain->link);
    free(drain);
    return NULL;
}

void drain_stop(Drain* drain)
{
    if (drain == NULL) return;
    atomic_store(&drain->stop, true);
    pthread_join(drain->thread, NULL);
    link_close(drain->link);
    free(drain);
}

bool drain_running(const Drain* drain)
{
    return atomic_load(&drain->running);
}

Link* drain_link(Drain* drain)
{
    return drain->link;
}
