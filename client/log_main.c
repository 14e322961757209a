// hair-log: what is in a recording. One subcommand a verb; each is a row of `commands`.
#include "client/assemble.h"
#include "messages/channels.h"
#include "messages/frame.h"
#include "messages/log.h"
#include "messages/style.h"

#include <argp.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define MAX_CHANNELS 2048 // listed; more are counted together
#define MAX_EPOCHS   64
#define MAX_STYLES   64
#define LATEST_US    ((int64_t)1 << 61) // log times are anybody's: differences must not overflow

typedef struct ChannelInfo {
    char name[LOG_MAX_CHANNEL_BYTES + 1];
    int64_t count, bytes, first_us, last_us;
} ChannelInfo;

// Ticks of one slot in one epoch.
typedef struct SlotInfo {
    bool any;
    int32_t first, last;
    int64_t missing;  // ticks between first and last of which nothing was recorded
    int64_t backward; // blocks older than the one before them
} SlotInfo;

typedef struct EpochInfo {
    int64_t epoch;
    SlotInfo* slots; // CHANNEL_MAX_SLOTS
} EpochInfo;

typedef struct StyleInfo {
    uint64_t hash;
    bool parts[STYLE_LANES]; // some part of the lane was seen
    int version;
    bool complete;
    char name[HAIRSTYLE_NAME_BYTES];
    int guides, nodes;
    int64_t strands;
} StyleInfo;

// Everything that `info` gathers in its one pass. Tables are fixed: logs come from strangers.
typedef struct Info {
    const char* path;
    int64_t size, events, damaged, first_us, last_us;
    ChannelInfo channels[MAX_CHANNELS];
    int channel_count, last_channel;
    int64_t other_channels;
    EpochInfo epochs[MAX_EPOCHS];
    int epoch_count;
    int64_t other_epochs, bad_blocks, bad_parts;
    StyleInfo styles[MAX_STYLES];
    int style_count;
    int64_t other_styles;
    Assemble* assemble;
} Info;

// Daemons publish slots in turn: the search begins where the last one ended.
static ChannelInfo* find_channel(Info* info, const char* name)
{
    for (int i = 0; i < info->channel_count; ++i) {
        int at = (info->last_channel + i) % info->channel_count;
        if (strcmp(info->channels[at].name, name) != 0) continue;
        info->last_channel = at;
        return &info->channels[at];
    }
    if (info->channel_count == MAX_CHANNELS) return NULL;
    ChannelInfo* channel = &info->channels[info->channel_count++];
    snprintf(channel->name, sizeof channel->name, "%s", name);
    return channel;
}

static void count_event(Info* info, const LogEvent* event)
{
    if (info->events++ == 0) info->first_us = event->utime;
    info->last_us = event->utime;
    ChannelInfo* channel = find_channel(info, event->channel);
    if (channel == NULL) {
        ++info->other_channels;
        return;
    }
    if (channel->count++ == 0) channel->first_us = event->utime;
    channel->last_us = event->utime;
    channel->bytes += (int64_t)event->size;
}

static EpochInfo* find_epoch(Info* info, int64_t epoch)
{
    for (int i = 0; i < info->epoch_count; ++i)
        if (info->epochs[i].epoch == epoch) return &info->epochs[i];
    if (info->epoch_count == MAX_EPOCHS) return NULL;
    SlotInfo* slots = calloc(CHANNEL_MAX_SLOTS, sizeof *slots);
    if (slots == NULL) return NULL;
    info->epochs[info->epoch_count] = (EpochInfo){epoch, slots};
    return &info->epochs[info->epoch_count++];
}

static void count_block(Info* info, const LogEvent* event)
{
    FrameHeader header;
    const uint8_t *positions, *tangents;
    FrameFault fault = frame_decode(&header, &positions, &tangents, event->data, event->size);
    if (fault != FRAME_OK || header.slot >= CHANNEL_MAX_SLOTS) {
        ++info->bad_blocks;
        return;
    }
    EpochInfo* epoch = find_epoch(info, header.epoch);
    if (epoch == NULL) {
        ++info->other_epochs;
        return;
    }
    SlotInfo* slot = &epoch->slots[header.slot];
    if (!slot->any) *slot = (SlotInfo){.any = true, .first = header.tick, .last = header.tick};
    int64_t step = (int64_t)header.tick - slot->last;
    if (step > 1) slot->missing += step - 1;
    if (step < 0) ++slot->backward;
    if (step > 0) slot->last = header.tick;
}

static StyleInfo* find_style(Info* info, uint64_t hash)
{
    for (int i = 0; i < info->style_count; ++i)
        if (info->styles[i].hash == hash) return &info->styles[i];
    if (info->style_count == MAX_STYLES) return NULL;
    info->styles[info->style_count] = (StyleInfo){.hash = hash};
    return &info->styles[info->style_count++];
}

static void note_finished(Info* info, StyleInfo* known)
{
    const Hairstyle* style =
        assemble_find(info->assemble, known->hash, &known->version, &known->complete, false);
    if (style == NULL) return;
    memcpy(known->name, style->name, sizeof known->name);
    known->guides = style->guide_count;
    known->nodes = style->nodes;
    known->strands = 0;
    for (int i = 0; i < style->set_count; ++i)
        known->strands += style->sets[i].strand_count;
}

static void count_part(Info* info, const LogEvent* event)
{
    StylePart part;
    if (!style_part_decode(&part, event->data, event->size, NULL) || part.lane >= STYLE_LANES) {
        ++info->bad_parts;
        return;
    }
    StyleInfo* known = find_style(info, part.style_hash);
    if (known == NULL) {
        ++info->other_styles;
        return;
    }
    known->parts[part.lane] = true;
    if (known->complete) return;
    AssembleWorn worn = {part.style_hash, 0};
    int64_t now_us = event->utime < 0 ? 0 : event->utime > LATEST_US ? LATEST_US : event->utime;
    AssembleResult result = assemble_part(info->assemble, &part, &worn, 1, now_us, NULL);
    if (result == ASSEMBLE_FINISHED) note_finished(info, known);
    if (result == ASSEMBLE_REJECTED) ++info->bad_parts;
}

static bool gather(Info* info, Fault* fault)
{
    struct stat status;
    LogReader* reader = log_open(info->path, fault);
    if (reader == NULL) return false;
    if (stat(info->path, &status) == 0) info->size = status.st_size;
    LogEvent event;
    while (log_next(reader, &event)) {
        count_event(info, &event);
        if (strncmp(event.channel, CHANNEL_GUIDES_PREFIX, sizeof CHANNEL_GUIDES_PREFIX - 1) == 0)
            count_block(info, &event);
        else if (strcmp(event.channel, CHANNEL_STYLE) == 0)
            count_part(info, &event);
    }
    info->damaged = log_damaged_bytes(reader);
    log_close(reader);
    if (info->events > 0) return true;
    return fault_set(fault, "%s: not an LCM log: it holds no event (0xEDA1DA01 ...)", info->path);
}

// Log times are anybody's, so differences are taken in double.
static double span_s(int64_t first_us, int64_t last_us)
{
    double span = ((double)last_us - (double)first_us) * 1e-6;
    return span > 0 ? span : 0;
}

static void print_channels(const Info* info)
{
    printf("  %-20s %10s %11s %9s\n", "channel", "messages", "mean bytes", "Hz");
    for (int i = 0; i < info->channel_count; ++i) {
        const ChannelInfo* channel = &info->channels[i];
        double span = span_s(channel->first_us, channel->last_us);
        printf("  %-20s %10" PRId64 " %11.0f %9.2f\n", channel->name, channel->count,
               (double)channel->bytes / (double)channel->count,
               span > 0 ? (double)(channel->count - 1) / span : 0.0);
    }
    if (info->other_channels > 0)
        printf("  on more channels     %10" PRId64 "\n", info->other_channels);
}

static void print_epochs(const Info* info)
{
    for (int i = 0; i < info->epoch_count; ++i)
        for (int number = 0; number < CHANNEL_MAX_SLOTS; ++number) {
            const SlotInfo* slot = &info->epochs[i].slots[number];
            if (!slot->any) continue;
            printf("  epoch %" PRId64 " slot %d: ticks %d..%d, %" PRId64 " missing",
                   info->epochs[i].epoch, number, (int)slot->first, (int)slot->last, slot->missing);
            if (slot->backward > 0) printf(", %" PRId64 " blocks out of order", slot->backward);
            putchar('\n');
        }
    if (info->other_epochs > 0)
        printf("  of more epochs: %" PRId64 " blocks\n", info->other_epochs);
}

static void print_lane(const Info* info, const StyleInfo* style, int lane)
{
    int held = 0, parts = 0;
    assemble_progress(info->assemble, style->hash, lane, &held, &parts);
    printf(", %s lane ", lane == STYLE_FAST ? "fast" : "bulk");
    if (lane == STYLE_FAST ? style->version > 0 : style->complete && style->version > 1)
        printf("complete");
    else if (lane == STYLE_BULK && style->complete)
        printf("not needed");
    else if (parts > 0)
        printf("%d of %d parts", held, parts);
    else
        printf(style->parts[lane] ? "damaged" : "missing");
}

static void print_styles(const Info* info)
{
    for (int i = 0; i < info->style_count; ++i) {
        const StyleInfo* style = &info->styles[i];
        printf("  style %016" PRIx64, style->hash);
        if (style->version > 0)
            printf(" %s, %d guides x %d nodes, %" PRId64 " strands", style->name, style->guides,
                   style->nodes, style->strands);
        for (int lane = 0; lane < STYLE_LANES; ++lane)
            print_lane(info, style, lane);
        putchar('\n');
    }
    if (info->other_styles > 0) printf("  of more styles: %" PRId64 " parts\n", info->other_styles);
}

static void print_info(const Info* info)
{
    double span = span_s(info->first_us, info->last_us);
    printf("%s\n  %" PRId64 " bytes, %.2f s, %" PRId64 " events, %" PRId64 " damaged bytes",
           info->path, info->size, span, info->events, info->damaged);
    if (span > 0) printf(", %.0f bytes per hour", (double)info->size * 3600.0 / span);
    putchar('\n');
    if (info->bad_blocks > 0)
        printf("  %" PRId64 " guides messages are damaged\n", info->bad_blocks);
    if (info->bad_parts > 0) printf("  %" PRId64 " style parts are damaged\n", info->bad_parts);
    print_channels(info);
    print_epochs(info);
    print_styles(info);
}

static bool info_file(const char* path, Fault* fault)
{
    Info* info = calloc(1, sizeof *info);
    if (info == NULL) return fault_set(fault, "%s: no memory", path);
    info->path = path;
    info->assemble = assemble_create();
    bool fine =
        info->assemble != NULL ? gather(info, fault) : fault_set(fault, "%s: no memory", path);
    if (fine) print_info(info);
    for (int i = 0; i < info->epoch_count; ++i)
        free(info->epochs[i].slots);
    assemble_destroy(info->assemble);
    free(info);
    return fine;
}

static int run_info(char** files, int file_count)
{
    int status = EXIT_SUCCESS;
    for (int i = 0; i < file_count; ++i) {
        Fault fault = {""};
        if (info_file(files[i], &fault)) continue;
        fprintf(stderr, "hair-log: %s\n", fault.text);
        status = EXIT_FAILURE;
    }
    return status;
}

typedef struct Command {
    const char* name;
    int (*run)(char** files, int file_count);
} Command;

static const Command commands[] = {{"info", run_info}};

typedef struct Arguments {
    const Command* command;
    char** files;
    int file_count;
} Arguments;

static error_t parse_option(int key, char* argument, struct argp_state* state)
{
    Arguments* arguments = state->input;
    switch (key) {
    case ARGP_KEY_ARG:
        if (arguments->command != NULL) return ARGP_ERR_UNKNOWN; // files: handed over all at once
        for (size_t i = 0; i < sizeof commands / sizeof commands[0]; ++i)
            if (strcmp(argument, commands[i].name) == 0) arguments->command = &commands[i];
        if (arguments->command == NULL)
            argp_error(state, "there is no command '%s'; there is: info", argument);
        return 0;
    case ARGP_KEY_ARGS:
        arguments->files = state->argv + state->next;
        arguments->file_count = state->argc - state->next;
        return 0;
    case ARGP_KEY_END:
        if (arguments->command == NULL) argp_error(state, "name a command: info");
        if (arguments->file_count == 0) argp_error(state, "name one or more log files");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

const char* argp_program_version = "hair-log " STRANDCAST_VERSION;

int main(int argc, char** argv)
{
    static const struct argp argp = {
        .parser = parse_option,
        .args_doc = "info FILE...",
        .doc = "Tells what is in recordings of hair (LCM event logs).\v"
               "Commands:\n"
               "  info FILE...   size, channels, epochs and ticks, slots, styles\n\n"
               "Examples:\n"
               "  hair-log info run.lcmlog\n"
               "  hair-log info *.lcmlog\n\n"
               "Exit status: 0 every file was readable, 1 some file was not, 2 wrong usage.",
    };
    argp_err_exit_status = 2;
    Arguments arguments = {0};
    error_t error = argp_parse(&argp, argc, argv, 0, NULL, &arguments);
    if (error != 0) return 2;
    return arguments.command->run(arguments.files, arguments.file_count);
}
