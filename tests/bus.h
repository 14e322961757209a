// The bus as bytes: a socket that hears every datagram of the group, and sends any. No liblcm, so
// that what is counted is what was on the wire.
#pragma once

#include "tests/process.h"

#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#define BUS_GROUP        "239.255.76.67"
#define BUS_PORT         7667
#define BUS_HEADER_BYTES 8 // "LC02" and a sequence number
#define BUS_SKIP         77

typedef struct Bus {
    int socket;
    struct sockaddr_in group;
    uint32_t sequence;
    uint8_t bytes[65536];
    // Of the datagram that bus_hear returned; `channel` is NULL where it is no short LCM message.
    size_t size;
    const char* channel;
    const uint8_t* data;
    size_t data_size;
} Bus;

// Ends the program as skipped where it would disturb a real network, or be disturbed.
static inline void bus_require_private(void)
{
    struct if_nameindex* all = if_nameindex();
    int count = 0, probe = socket(AF_INET, SOCK_DGRAM, 0);
    while (all != NULL && all[count].if_index != 0)
        ++count;
    struct ifreq request = {.ifr_name = "lo"};
    bool is_private = count >= 1 && strcmp(all[0].if_name, "lo") == 0 &&
                      ioctl(probe, SIOCGIFMTU, &request) == 0 && request.ifr_mtu == 1500;
    // A fresh namespace may hold the kernel's tunnel stubs beside lo, but nothing that is up.
    for (int i = 1; is_private && i < count; ++i) {
        struct ifreq other = {0};
        snprintf(other.ifr_name, sizeof other.ifr_name, "%s", all[i].if_name);
        is_private = ioctl(probe, SIOCGIFFLAGS, &other) == 0 && (other.ifr_flags & IFF_UP) == 0;
    }
    if_freenameindex(all);
    close(probe);
    if (is_private) return;
    fprintf(stderr, "SKIPPED: not a private network; run it as scripts/lan --private PROGRAM\n");
    exit(BUS_SKIP);
}

static inline void bus_open(Bus* bus)
{
    *bus = (Bus){.socket = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)};
    assert_true(bus->socket >= 0);
    bus->group = (struct sockaddr_in){.sin_family = AF_INET, .sin_port = htons(BUS_PORT)};
    inet_pton(AF_INET, BUS_GROUP, &bus->group.sin_addr);
    int on = 1, room = 1 << 22;
    unsigned char ttl = 0;
    setsockopt(bus->socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    setsockopt(bus->socket, SOL_SOCKET, SO_REUSEPORT, &on, sizeof on);
    setsockopt(bus->socket, SOL_SOCKET, SO_RCVBUF, &room, sizeof room);
    setsockopt(bus->socket, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
    assert_int_equal(bind(bus->socket, (struct sockaddr*)&bus->group, sizeof bus->group), 0);
    struct ip_mreq membership = {.imr_multiaddr = bus->group.sin_addr};
    assert_int_equal(
        setsockopt(bus->socket, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership), 0);
}

static inline void bus_close(Bus* bus)
{
    close(bus->socket);
}

static inline void bus_split(Bus* bus)
{
    bus->channel = NULL;
    if (bus->size < BUS_HEADER_BYTES + 1 || memcmp(bus->bytes, "LC02", 4) != 0) return;
    const uint8_t* name = bus->bytes + BUS_HEADER_BYTES;
    const uint8_t* end = memchr(name, 0, bus->size - BUS_HEADER_BYTES);
    if (end == NULL) return;
    bus->channel = (const char*)name;
    bus->data = end + 1;
    bus->data_size = bus->size - (size_t)(bus->data - bus->bytes);
}

// The next datagram, or false after `seconds`.
static inline bool bus_hear(Bus* bus, double seconds)
{
    struct pollfd waiting = {bus->socket, POLLIN, 0};
    if (poll(&waiting, 1, (int)(seconds * 1e3)) <= 0) return false;
    ssize_t size = recv(bus->socket, bus->bytes, sizeof bus->bytes, 0);
    assert_true(size >= 0);
    bus->size = (size_t)size;
    bus_split(bus);
    return true;
}

static inline void bus_send_raw(Bus* bus, const void* bytes, size_t size)
{
    ssize_t sent =
        sendto(bus->socket, bytes, size, 0, (struct sockaddr*)&bus->group, sizeof bus->group);
    assert_int_equal(sent, size);
}

// A short LCM message, whatever its data.
static inline void bus_send(Bus* bus, const char* channel, const uint8_t* data, size_t size)
{
    uint8_t bytes[65000] = "LC02";
    size_t name = strlen(channel) + 1;
    assert_true(BUS_HEADER_BYTES + name + size <= sizeof bytes);
    uint32_t sequence = htonl(bus->sequence++);
    memcpy(bytes + 4, &sequence, sizeof sequence);
    memcpy(bytes + BUS_HEADER_BYTES, channel, name);
    if (size > 0) memcpy(bytes + BUS_HEADER_BYTES + name, data, size);
    bus_send_raw(bus, bytes, BUS_HEADER_BYTES + name + size);
}
