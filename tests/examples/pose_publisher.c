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

int main(int argc, char** argv)
{
    static const struct option options[] = {
        {"slot", 1, 0, 's'}, {"style", 1, 0, 'y'}, {"seconds", 1, 0, 't'}, {0}};
    hair_character_t character = {.verb = CHARACTER_ADD};
    double seconds = 10.0;
    for (int key; (key = getopt_long(argc, argv, "", options, NULL)) != -1;) {
        if (key == 's') character.slot = (int16_t)atoi(optarg);
        if (key == 'y') strncpy((char*)character.style, optarg, sizeof character.style - 1);
        if (key == 't') seconds = atof(optarg);
        if (key == '?') return fputs("use: [--slot N] [--style NAME] [--seconds S]\n", stderr), 2;
    }
    lcm_t* lcm = lcm_create(NULL); // $LCM_DEFAULT_URL, else this host
    if (lcm == NULL) return 1;     // liblcm has said why

    uint8_t bytes[256];
    for (int i = 0; i < 30 * seconds; ++i) {
        // Each second, for a daemon that starts after us; one that has it already does nothing.
        if (i % 30 == 0) {
            character.utime = now_us();
            int size = hair_character_t_encode(bytes, 0, sizeof bytes, &character);
            lcm_publish(lcm, "HAIR_CHARACTER", bytes, (unsigned)size);
        }
        hair_pose_t pose = head_at(character.slot, i / 30.0, i >= 15 * seconds);
        int size = hair_pose_t_encode(bytes, 0, sizeof bytes, &pose);
        lcm_publish(lcm, "HAIR_POSE", bytes, (unsigned)size);
        nanosleep(&(struct timespec){.tv_nsec = 1000000000 / 30}, NULL);
    }
    lcm_destroy(lcm);
    return 0;
}
