// What a game server does to have hair on a character's head: plain LCM and the generated types,
// nothing of ours. Adds a character, moves its head on a smooth path at 30 Hz, teleports it
// half-way.
#include <lcm/lcm.h>

#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "hair_character_t.h"
#include "hair_pose_t.h"

// pose_t.verb: how the hair enters a segment. There are also reset (2) and freeze (3).
enum { VERB_FOLLOW = 0, VERB_CARRY = 1, CHARACTER_ADD = 1 };

static int64_t now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t); // only differences of `utime` are used
    return t.tv_sec * 1000000LL + t.tv_nsec / 1000;
}

// 0.3 m from side to side every 2 s, looking where it goes; 2 m further on once it has teleported.
static hair_pose_t head_at(int slot, double seconds, int teleported)
{
    double swing = sin(3.14159265 * seconds), half_yaw = 0.25 * cos(3.14159265 * seconds);
    hair_pose_t pose = {.utime = now_us(), .slot = (int16_t)slot};
    pose.position[0] = 0.15 * swing + 2.0 * teleported;
    pose.position[1] = 1.6;
    pose.orientation[1] = sin(half_yaw); // x y z w
    pose.orientation[3] = cos(half_yaw);
    // A jump without a new segment would drag the hair along. The verb is repeated in every message
    // of the segment, so that a lost one changes nothing.
    pose.segment = teleported;
    pose.verb = teleported ? VERB_CARRY : VERB_FOLLOW;
    return pose;
}

static long whole(const char* option, const char* text, long most)
{
    char* end;
    long number = strtol(text, &end, 10); // out of range: the largest or least, which is too
    if (end != text && *end == '\0' && number >= 0 && number <= most) return number;
    fprintf(stderr, "pose-publisher: %s %s: want a whole number from 0 to %ld\n", option, text,
            most);
    exit(2);
}

static void set_style(hair_character_t* character, const char* name)
{
    if (strlen(name) < sizeof character->style) { // with its NUL
        strcpy((char*)character->style, name);
        return;
    }
    fprintf(stderr, "pose-publisher: --style %s: want at most 31 bytes\n", name);
    exit(2);
}

static void read_options(int argc, char** argv, hair_character_t* character, long* seconds)
{
    static const char use[] = "use: pose-publisher [--slot N] [--style NAME] [--seconds S]\n";
    static const struct option options[] = {{"slot", 1, 0, 's'},
                                            {"style", 1, 0, 'y'},
                                            {"seconds", 1, 0, 't'},
                                            {"help", 0, 0, 'h'},
                                            {0}};
    for (int key; (key = getopt_long(argc, argv, "", options, NULL)) != -1;) {
        if (key == 's') character->slot = (int16_t)whole("--slot", optarg, 1023);
        if (key == 't') *seconds = whole("--seconds", optarg, 86400);
        if (key == 'y') set_style(character, optarg);
        if (key == 'h') exit(fputs(use, stdout) < 0 || fflush(stdout) != 0);
        if (key == '?') exit(2); // getopt has said why
    }
    if (optind == argc) return;
    fprintf(stderr, "pose-publisher: \"%s\" is not an option\n", argv[optind]);
    exit(2);
}

static void publish(lcm_t* lcm, const char* channel, const uint8_t* bytes, int size)
{
    if (size > 0 && lcm_publish(lcm, channel, bytes, (unsigned)size) == 0) return;
    fprintf(stderr, "pose-publisher: the bus does not take %s; is the network up?\n", channel);
    exit(1);
}

int main(int argc, char** argv)
{
    hair_character_t character = {.verb = CHARACTER_ADD};
    long seconds = 10;
    read_options(argc, argv, &character, &seconds);
    lcm_t* lcm = lcm_create(NULL); // $LCM_DEFAULT_URL, else this host
    if (lcm == NULL) return 1;     // liblcm has said why

    uint8_t bytes[256];
    for (int i = 0; i < 30 * seconds; ++i) {
        // Each second, for a daemon that starts after us; one that has it already does nothing.
        if (i % 30 == 0) {
            character.utime = now_us();
            publish(lcm, "HAIR_CHARACTER", bytes,
                    hair_character_t_encode(bytes, 0, sizeof bytes, &character));
        }
        hair_pose_t pose = head_at(character.slot, i / 30.0, i >= 15 * seconds);
        publish(lcm, "HAIR_POSE", bytes, hair_pose_t_encode(bytes, 0, sizeof bytes, &pose));
        nanosleep(&(struct timespec){.tv_nsec = 1000000000 / 30}, NULL);
    }
    lcm_destroy(lcm);
    return 0;
}
