#include "server/daemon_characters.h"

#include <stdio.h>

static void leave(Daemon* daemon, int number)
{
    Character* old = daemon->characters[number];
    if (old == NULL) return;
    daemon->segments[number] = old->segment;
    character_destroy(old);
    daemon->characters[number] = NULL;
}

static void order(Daemon* daemon)
{
    daemon->used = 0;
    for (int i = 0; i < CHANNEL_MAX_SLOTS; ++i)
        if (daemon->characters[i] != NULL) daemon->order[daemon->used++] = i;
}

void daemon_characters_remove(Daemon* daemon, int number)
{
    leave(daemon, number);
    order(daemon);
}

bool daemon_characters_add(Daemon* daemon, int number, int style, const Motion* motion,
                           Vec3d position, Fault* fault)
{
    leave(daemon, number);
    Character* c = character_create(&daemon->sim, daemon->styles[style].hair, motion, position,
                                    daemon->steps, fault);
    daemon->characters[number] = c;
    order(daemon);
    if (c == NULL) return false;
    c->number = number;
    c->style = style;
    c->segment = daemon->segments[number];
    daemon->orphans[number] = 0;
    return true;
}

// One character spreads its blocks over the threads; many characters are spread whole.
static void step_all(Daemon* daemon)
{
    int threads = daemon->sim.threads, used = daemon->used;
    if (used < 2 || threads < 2) {
        for (int i = 0; i < used; ++i)
            character_step(daemon->characters[daemon->order[i]], daemon->steps,
                           daemon->options.project);
        return;
    }
#pragma omp parallel for num_threads(threads) schedule(dynamic)
    for (int i = 0; i < used; ++i)
        character_step(daemon->characters[daemon->order[i]], daemon->steps,
                       daemon->options.project);
}

// Here rather than where it is stepped: characters are stepped side by side.
static void count_quarantined(Daemon* daemon)
{
    char text[160];
    for (int i = 0; i < daemon->used; ++i) {
        Character* c = daemon->characters[daemon->order[i]];
        int64_t count = sim_quarantined(c->sim);
        if (count == c->quarantined) continue;
        daemon->quarantined += count - c->quarantined;
        c->quarantined = count;
        snprintf(text, sizeof text,
                 "strands of character %d were not finite or 1 km from the head and are back at "
                 "rest; lower the stiffness or raise the substeps",
                 c->number);
        complaints_remark(&daemon->complaints, COMPLAINT_QUARANTINE, text);
    }
}

void daemon_characters_step(Daemon* daemon)
{
    step_all(daemon);
    count_quarantined(daemon);
}
