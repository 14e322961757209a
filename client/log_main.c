// hair-log: what is in a recording. One subcommand a verb; each is a row of `commands`.
#include "client/assemble.h"
#include "messages/channels.h"
#include "messages/frame.h"
#include "messages/log.h"
#include "messages/style.h"

#include <argp.h>
#include <assert.h>
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

// Rows of one tick, of one block or of several that follow each other.
typedef struct Rows {
    int32_t tick;
    uint16_t slot, first, end;
    uint8_t epoch, style; // indices in Info's tables; style NO_STYLE: too many styles
} Rows;

#define NO_STYLE UINT8_MAX

// One slot in one epoch.
typedef struct SlotInfo {
    bool any;
    int32_t newest;
    size_t rows;      // 1 + index of its last Rows
    int64_t backward; // blocks older than the newest before them
} SlotInfo;

// What its ticks come to.
typedef struct TickInfo {
    int32_t first, last;
    int64_t ticks;      // of which anything was recorded
    int64_t incomplete; // of these, without some rows of their style
} TickInfo;

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
    int rows; // that blocks were seen to hold: its guides, where the style itself is missing
    int64_t strands;
} StyleInfo;

static_assert(MAX_EPOCHS <= UINT8_MAX && MAX_STYLES <= NO_STYLE, "Rows holds their indices");

// Everything that `info` gathers in its one pass. Tables are fixed: logs come from strangers. Only
// `rows` grows: 12 bytes for a block that cost the log 150 or more.
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
    Rows* rows;
    size_t row_count, row_capacity;
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

static StyleInfo* find_style(Info* info, uint64_t hash)
{
    for (int i = 0; i < info->style_count; ++i)
        if (info->styles[i].hash == hash) return &info->styles[i];
    if (info->style_count == MAX_STYLES) return NULL;
    info->styles[info->style_count] = (StyleInfo){.hash = hash};
    return &info->styles[info->style_count++];
}

static bool add_rows(Info* info, SlotInfo* slot, const Rows* rows)
{
    Rows* last = slot->rows > 0 ? &info->rows[slot->rows - 1] : NULL;
    if (last != NULL && last->tick == rows->tick && last->style == rows->style &&
        last->end == rows->first) {
        last->end = rows->end;
        return true;
    }
    if (info->row_count == info->row_capacity) {
        size_t grown = info->row_capacity > 0 ? info->row_capacity * 2 : 4096;
        Rows* larger = realloc(info->rows, grown * sizeof *larger);
        if (larger == NULL) return false;
        info->rows = larger;
        info->row_capacity = grown;
    }
    info->rows[info->row_count++] = *rows;
    slot->rows = info->row_count;
    return true;
}

static void count_order(SlotInfo* slot, int32_t tick)
{
    if (!slot->any) *slot = (SlotInfo){.any = true, .newest = tick};
    if (tick < slot->newest) ++slot->backward;
    if (tick > slot->newest) slot->newest = tick;
}

// False where memory ran out.
static bool count_block(Info* info, const LogEvent* event)
{
    FrameHeader header;
    const uint8_t *positions, *tangents;
    FrameFault fault = frame_decode(&header, &positions, &tangents, event->data, event->size);
    if (fault != FRAME_OK || header.slot >= CHANNEL_MAX_SLOTS) {
        ++info->bad_blocks;
        return true;
    }
    EpochInfo* epoch = find_epoch(info, header.epoch);
    if (epoch == NULL) {
        ++info->other_epochs;
        return true;
    }
    SlotInfo* slot = &epoch->slots[header.slot];
    count_order(slot, header.tick);
    Rows rows = {.tick = header.tick,
                 .slot = header.slot,
                 .first = header.first_strand,
                 .end = (uint16_t)(header.first_strand + header.strand_count),
                 .epoch = (uint8_t)(epoch - info->epochs),
                 .style = NO_STYLE};
    StyleInfo* style = find_style(info, header.style_hash);
    if (style != NULL) rows.style = (uint8_t)(style - info->styles);
    if (style != NULL && rows.end > style->rows) style->rows = rows.end;
    return add_rows(info, slot, &rows);
}

static int compare_rows(const void* a, const void* b)
{
    const Rows *left = a, *right = b;
    if (left->epoch != right->epoch) return left->epoch < right->epoch ? -1 : 1;
    if (left->slot != right->slot) return left->slot < right->slot ? -1 : 1;
    if (left->tick != right->tick) return left->tick < right->tick ? -1 : 1;
    return (left->first > right->first) - (left->first < right->first);
}

// Whether the sorted `rows` of one tick leave none of its style's out.
static bool is_whole(const Info* info, const Rows* rows, size_t count)
{
    if (rows->style == NO_STYLE) return true; // nobody knows
    const StyleInfo* style = &info->styles[rows->style];
    int wanted = style->guides > 0 ? style->guides : style->rows, end = 0;
    for (size_t i = 0; i < count && rows[i].first <= end; ++i)
        if (rows[i].end > end) end = rows[i].end;
    return end >= wanted;
}

// Takes the ticks of the slot whose sorted rows begin at `*at`, and moves it behind them.
static TickInfo take_ticks(const Info* info, size_t* at)
{
    const Rows* begin = &info->rows[*at];
    TickInfo ticks = {.first = begin->tick};
    while (*at < info->row_count) {
        const Rows* rows = &info->rows[*at];
        size_t count = 0;
        if (rows->epoch != begin->epoch || rows->slot != begin->slot) break;
        for (; *at < info->row_count && info->rows[*at].tick == rows->tick; ++*at, ++count)
            if (info->rows[*at].epoch != rows->epoch || info->rows[*at].slot != rows->slot) break;
        ++ticks.ticks;
        ticks.incomplete += !is_whole(info, rows, count);
        ticks.last = rows->tick;
    }
    return ticks;
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
    bool has_room = true;
    while (has_room && log_next(reader, &event)) {
        count_event(info, &event);
        if (strncmp(event.channel, CHANNEL_GUIDES_PREFIX, sizeof CHANNEL_GUIDES_PREFIX - 1) == 0)
            has_room = count_block(info, &event);
        else if (strcmp(event.channel, CHANNEL_STYLE) == 0)
            count_part(info, &event);
    }
    info->damaged = log_damaged_bytes(reader);
    log_close(reader);
    if (!has_room) return fault_set(fault, "%s: no memory", info->path);
    if (info->row_count > 0) qsort(info->rows, info->row_count, sizeof *info->rows, compare_rows);
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
    for (size_t at = 0; at < info->row_count;) {
        const EpochInfo* epoch = &info->epochs[info->rows[at].epoch];
        int number = info->rows[at].slot;
        TickInfo ticks = take_ticks(info, &at);
        int64_t span = (int64_t)ticks.last - ticks.first + 1, missing = span - ticks.ticks;
        printf("  epoch %" PRId64 " slot %d: ticks %d..%d, %" PRId64 " missing", epoch->epoch,
               number, (int)ticks.first, (int)ticks.last, missing);
        if (ticks.incomplete > 0) printf(", %" PRId64 " incomplete", ticks.incomplete);
        int64_t backward = epoch->slots[number].backward;
        if (backward > 0) printf(", %" PRId64 " blocks out of order", backward);
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
    free(info->rows);
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
    int status = arguments.command->run(arguments.files, arguments.file_count);
    Fault fault;
    if (base_stdout_written(&fault)) return status;
    fprintf(stderr, "hair-log: %s\n", fault.text);
    return EXIT_FAILURE;
}
