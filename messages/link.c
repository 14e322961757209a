#include "messages/link.h"

#include <lcm/lcm.h>

#include <arpa/inet.h>
#include <ctype.h>
#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <regex.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define DEFAULT_GROUP        "239.255.76.67"
#define DEFAULT_PORT         7667
#define DEFAULT_URL          "udpm://239.255.76.67:7667?ttl=0"
#define RECEIVE_BUFFER_BYTES 2097152 // a hundred characters' tick; the kernel caps it silently
#define MAX_PUBLISH_BYTES    65400   // above 65,499 with the name, liblcm fragments
#define MAX_RECEIVED_BYTES   65499
#define MAX_HANDLED_PER_CALL 65536 // so that a flood cannot keep the caller for ever

typedef struct Subscription Subscription;

struct Subscription {
    LinkHandler handler;
    void* context;
    Subscription* next;
};

struct Link {
    lcm_t* lcm;
    char url[160];
    Subscription* subscriptions;
};

// Holding back stderr ---------------------------------------------------------------------------

// liblcm and glib write to file descriptor 2 and offer no hook. The descriptor belongs to the whole
// process: two threads that open links at once would restore each other's, hence this one lock.
static pthread_mutex_t holding_stderr = PTHREAD_MUTEX_INITIALIZER;

typedef struct HeldStderr {
    int saved, file;
} HeldStderr;

static HeldStderr hold_stderr(void)
{
    pthread_mutex_lock(&holding_stderr);
    fflush(stderr);
    HeldStderr held = {.saved = dup(STDERR_FILENO), .file = memfd_create("stderr", MFD_CLOEXEC)};
    if (held.saved >= 0 && held.file >= 0) dup2(held.file, STDERR_FILENO);
    return held;
}

// Restores stderr; `line` becomes the first line that was held back, or "".
static void release_stderr(HeldStderr held, char* line, size_t capacity)
{
    fflush(stderr);
    line[0] = '\0';
    if (held.saved >= 0 && held.file >= 0) {
        dup2(held.saved, STDERR_FILENO);
        ssize_t size = pread(held.file, line, capacity - 1, 0);
        line[size > 0 ? size : 0] = '\0';
    }
    if (held.saved >= 0) close(held.saved);
    if (held.file >= 0) close(held.file);
    pthread_mutex_unlock(&holding_stderr);
    char* start = line + strspn(line, " \r\n\t");
    start[strcspn(start, "\r\n")] = '\0';
    memmove(line, start, strlen(start) + 1);
}

// The address -----------------------------------------------------------------------------------

typedef struct Group {
    char address[INET_ADDRSTRLEN];
    long port, ttl, receive_buffer;
} Group;

#define ACCEPTED "accepted are udpm://GROUP:PORT?ttl=N (such as " DEFAULT_URL ") and memq://"

static bool read_number(const char* text, long low, long high, long* number)
{
    char* end;
    errno = 0;
    *number = strtol(text, &end, 10);
    return isdigit((unsigned char)text[0]) && *end == '\0' && errno == 0 && *number >= low &&
           *number <= high;
}

static bool read_options(Group* group, char* options, const char* url, Fault* fault)
{
    char* rest = options;
    for (char* option; (option = strsep(&rest, "&")) != NULL;) {
        if (option[0] == '\0') continue;
        char* value = strchr(option, '=');
        if (value != NULL) *value++ = '\0';
        if (value != NULL && strcmp(option, "ttl") == 0) {
            if (!read_number(value, 0, 255, &group->ttl))
                return fault_set(fault,
                                 "%.120s: ttl \"%.40s\": a number from 0 (this machine) to "
                                 "255",
                                 url, value);
        } else if (value != NULL && strcmp(option, "recv_buf_size") == 0) {
            if (!read_number(value, 1, 1 << 30, &group->receive_buffer))
                return fault_set(fault, "%.120s: recv_buf_size \"%.40s\": a number of bytes", url,
                                 value);
        } else {
            return fault_set(fault,
                             "%.120s: option \"%.40s\": only ttl=N and recv_buf_size=BYTES "
                             "are known",
                             url, option);
        }
    }
    return true;
}

static bool read_address(Group* group, char* text, const char* url, Fault* fault)
{
    if (text[0] == '\0') return true;
    char* port = strchr(text, ':');
    if (port != NULL) *port++ = '\0';
    struct in_addr address;
    if (inet_pton(AF_INET, text, &address) != 1 || (ntohl(address.s_addr) >> 28) != 14)
        return fault_set(fault,
                         "%.120s: \"%.40s\" is no multicast group (224.0.0.0 to "
                         "239.255.255.255); " ACCEPTED,
                         url, text);
    if (port != NULL && !read_number(port, 1, 65535, &group->port))
        return fault_set(fault, "%.120s: port \"%.40s\": a number from 1 to 65535", url, port);
    return inet_ntop(AF_INET, &address, group->address, sizeof group->address) != NULL;
}

// Read by us, not by liblcm: it takes unknown options and unicast addresses with a shrug, and then
// nothing arrives.
static bool read_group(Group* group, const char* url, Fault* fault)
{
    char text[160];
    *group = (Group){DEFAULT_GROUP, DEFAULT_PORT, 0, RECEIVE_BUFFER_BYTES};
    if (snprintf(text, sizeof text, "%s", url + strlen("udpm://")) >= (int)sizeof text)
        return fault_set(fault, "%.120s...: longer than any URL needs to be; " ACCEPTED, url);
    char* options = strchr(text, '?');
    if (options != NULL) *options++ = '\0';
    return (options == NULL || read_options(group, options, url, fault)) &&
           read_address(group, text, url, fault);
}

static bool has_scheme(const char* url, const char* scheme)
{
    return strncmp(url, scheme, strlen(scheme)) == 0;
}

static const char* choose_url(const char* url)
{
    if (url != NULL && url[0] != '\0') return url;
    const char* preset = getenv("LCM_DEFAULT_URL");
    return preset != NULL && preset[0] != '\0' ? preset : DEFAULT_URL;
}

// Opening ---------------------------------------------------------------------------------------

static lcm_t* create(const char* full_url, char* chatter, size_t capacity)
{
    HeldStderr held = hold_stderr();
    lcm_t* lcm = lcm_create(full_url);
    release_stderr(held, chatter, capacity);
    return lcm;
}

static Link* wrap(lcm_t* lcm, const char* url, Fault* fault)
{
    Link* link = calloc(1, sizeof *link);
    if (link == NULL) {
        lcm_destroy(lcm);
        fault_set(fault, "%.120s: no memory", url);
        return NULL;
    }
    link->lcm = lcm;
    snprintf(link->url, sizeof link->url, "%s", url);
    return link;
}

static Link* open_group(const char* url, Fault* fault)
{
    Group group;
    char full_url[160], chatter[100];
    if (!read_group(&group, url, fault)) return NULL;
    snprintf(full_url, sizeof full_url, "udpm://%s:%ld?ttl=%ld&recv_buf_size=%ld", group.address,
             group.port, group.ttl, group.receive_buffer);
    lcm_t* lcm = create(full_url, chatter, sizeof chatter);
    if (lcm == NULL) {
        fault_set(fault,
                  "group %s port %ld: no route for multicast (%s); as root: ip link set lo up; ip "
                  "route add 224.0.0.0/4 dev lo; or run the command under scripts/lan",
                  group.address, group.port, chatter[0] != '\0' ? chatter : "LCM gave no reason");
        return NULL;
    }
    return wrap(lcm, full_url, fault);
}

Link* link_open(const char* wanted, Fault* fault)
{
    const char* url = choose_url(wanted);
    if (has_scheme(url, "udpm://")) return open_group(url, fault);
    if (has_scheme(url, "memq://")) {
        char chatter[100];
        lcm_t* lcm = create("memq://", chatter, sizeof chatter);
        if (lcm != NULL) return wrap(lcm, "memq://", fault);
        fault_set(fault, "%.120s: LCM refuses it (%s)", url, chatter);
    } else if (has_scheme(url, "file://")) {
        fault_set(fault, "%.120s: a log is no bus; read it with hair-client --log FILE or hair-log",
                  url);
    } else {
        fault_set(fault, "%.120s: an unknown kind of URL; " ACCEPTED, url);
    }
    return NULL;
}

void link_close(Link* link)
{
    if (link == NULL) return;
    lcm_destroy(link->lcm);
    while (link->subscriptions != NULL) {
        Subscription* next = link->subscriptions->next;
        free(link->subscriptions);
        link->subscriptions = next;
    }
    free(link);
}

// Traffic ---------------------------------------------------------------------------------------

// liblcm can hand over an absurd size after reassembling broken fragments; ours never fragment.
static void pass_on(const lcm_recv_buf_t* received, const char* channel, void* context)
{
    const Subscription* subscription = context;
    if (received->data_size == 0 || received->data_size > MAX_RECEIVED_BYTES) return;
    subscription->handler(subscription->context, channel, received->data, received->data_size);
}

static lcm_subscription_t* subscribe_quietly(Link* link, const char* pattern,
                                             Subscription* subscription, char* chatter,
                                             size_t capacity)
{
    // The first subscription of a process runs liblcm's self test, which may complain too.
    HeldStderr held = hold_stderr();
    lcm_subscription_t* made = lcm_subscribe(link->lcm, pattern, pass_on, subscription);
    if (made != NULL) lcm_subscription_set_queue_capacity(made, 0);
    release_stderr(held, chatter, capacity);
    return made;
}

// Asked before liblcm is, which leaks its copy of a pattern that it refuses.
static bool is_pattern(const char* text)
{
    regex_t pattern;
    if (regcomp(&pattern, text, REG_EXTENDED | REG_NOSUB) != 0) return false;
    regfree(&pattern);
    return true;
}

bool link_subscribe(Link* link, const char* pattern, LinkHandler handler, void* context,
                    Fault* fault)
{
    if (!is_pattern(pattern))
        return fault_set(fault, "channel pattern \"%.60s\": not a regular expression", pattern);
    Subscription* subscription = calloc(1, sizeof *subscription);
    if (subscription == NULL) return fault_set(fault, "%s: no memory", link->url);
    subscription->handler = handler;
    subscription->context = context;
    char chatter[100];
    if (subscribe_quietly(link, pattern, subscription, chatter, sizeof chatter) == NULL) {
        free(subscription);
        return fault_set(fault,
                         "%.100s: cannot subscribe to %.40s (%s); does a firewall block multicast, "
                         "or is the route missing: ip route add 224.0.0.0/4 dev lo?",
                         link->url, pattern, chatter[0] != '\0' ? chatter : "LCM gave no reason");
    }
    subscription->next = link->subscriptions;
    link->subscriptions = subscription;
    return true;
}

bool link_publish(Link* link, const char* channel, const uint8_t* bytes, size_t size)
{
    if (size == 0 || size > MAX_PUBLISH_BYTES) return false;
    return lcm_publish(link->lcm, channel, bytes, (unsigned)size) == 0;
}

int link_fileno(Link* link)
{
    return lcm_get_fileno(link->lcm);
}

// poll() rather than lcm_handle_timeout(): that uses select(), which cannot see descriptors above
// 1023 and reports a signal as a dead link.
static bool has_message(int fd, int timeout_ms)
{
    struct pollfd waiting = {.fd = fd, .events = POLLIN};
    return poll(&waiting, 1, timeout_ms) > 0;
}

int link_handle(Link* link, int timeout_ms)
{
    int fd = link_fileno(link), handled = 0;
    if (fd < 0) return -1;
    while (handled < MAX_HANDLED_PER_CALL && has_message(fd, handled == 0 ? timeout_ms : 0)) {
        if (lcm_handle(link->lcm) < 0) return -1;
        ++handled;
    }
    return handled;
}
