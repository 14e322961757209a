// hair-client: from the command line to pictures. The only client file that knows the daemon, for
// --embedded, and that prints or exits.
#include "client/drain.h"
#include "client/options.h"
#include "client/output.h"
#include "client/playback.h"
#include "client/replace.h"
#include "client/stats.h"
#include "client/video.h"
#include "server/daemon.h"

#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// Set by SIGINT, SIGTERM and SIGHUP; what else the handler does must be safe in one.
static volatile sig_atomic_t stop_asked;

// The second time ends the process at once, without what was half written. But not for SIGHUP: a
// closed terminal sends it twice, by the kernel and by the shell.
static void ask_stop(int signal_number)
{
    if (stop_asked && signal_number != SIGHUP) {
        video_kill_all();
        replace_unlink_parts();
        signal(signal_number, SIG_DFL);
        raise(signal_number); // comes when this handler returns
    }
    stop_asked = 1;
}

static void catch_signals(void)
{
    struct sigaction action = {.sa_handler = ask_stop}, before;
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGHUP, NULL, &before);
    if (before.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, NULL); // nohup ignores it
    signal(SIGXFSZ, SIG_IGN); // writing fails with EFBIG instead, and that is said
}

typedef struct Client {
    Options options;
    Notice notice;
    Gl* gl;
    Receive* receive;
    GuidesView view;
    Drawing drawing;
    bool can_draw;
    Image image;
    Output* output;
    // One of these feeds `receive`.
    Drain* drain;
    Playback* playback;
    Daemon* daemon;
    int64_t last_line_us;
    int64_t progress_us;      // when a picture or a part of its style came last
    int64_t heard_us;         // when rows came last
    uint64_t awaited_hash;    // a style that is not here yet, and how much of it was
    int most_progress;        // (receive_style_progress)
    int64_t waiting_since_us; // rows have come and are not drawn yet; 0: all are
    int64_t drawn;
    bool is_stopped; // before the end that was asked for
} Client;

static void say(void* context, const char* text)
{
    const Client* client = context;
    if (!client->options.quiet) fprintf(stderr, "hair-client: %s\n", text);
}

static void progress(Client* client, const char* what)
{
    int64_t now = base_monotonic_us();
    if (client->options.quiet || !isatty(STDERR_FILENO)) return;
    if (now - client->last_line_us < 200000) return;
    client->last_line_us = now;
    ReceiveCounters counters = receive_counters(client->receive);
    fprintf(stderr,
            "\r%s: tick %d, %" PRId64 " pictures, %" PRId64 " lost, %" PRId64 " rejected   ", what,
            (int)client->view.tick, client->drawn, counters.lost, counters.rejected);
}

static void end_progress(const Client* client)
{
    if (client->last_line_us != 0) fputc('\n', stderr);
}

// Draws what `view` holds and hands the picture on.
static bool picture(Client* client, const Hairstyle* style, int version, Fault* fault)
{
    if (!draw_set_style(&client->drawing, style, client->view.style_hash, version, fault))
        return false;
    draw_picture(&client->drawing, &client->view, &client->image);
    ++client->drawn;
    return output_picture(client->output, &client->image, fault);
}

static bool has_frames(const Client* client)
{
    return client->options.frames > 0 && client->drawn >= client->options.frames;
}

static bool enough(const Client* client)
{
    return stop_asked || has_frames(client);
}

// Rows of a tick come in several messages, paced over the tick: drawn when the last is there, or
// when so much time has passed that it was lost. Drawing at each message would show rows of two
// ticks.
#define INCOMPLETE_US 50000

// Takes what is new and draws it when it is time to; `*has_style` says whether it could be drawn.
static bool follow(Client* client, int64_t now_us, bool* has_style, Fault* fault)
{
    if (receive_take(client->receive, &client->view)) {
        client->heard_us = now_us;
        if (client->waiting_since_us == 0) client->waiting_since_us = now_us;
    }
    int version;
    bool complete;
    const Hairstyle* style =
        receive_style(client->receive, client->view.style_hash, &version, &complete);
    *has_style = style != NULL && complete;
    if (!*has_style || client->waiting_since_us == 0) return true;
    // What was taken is in the stats, so it is drawn before the end as well.
    bool is_due =
        client->view.complete || stop_asked || now_us - client->waiting_since_us > INCOMPLETE_US;
    if (!is_due) return true;
    client->waiting_since_us = 0;
    return picture(client, style, version, fault);
}

// The rows of one exact tick are in `receive`: take them and draw.
static bool exact_picture(Client* client, int32_t tick, Fault* fault)
{
    receive_take(client->receive, &client->view);
    int version;
    bool complete;
    const Hairstyle* style =
        receive_style(client->receive, client->view.style_hash, &version, &complete);
    if (style == NULL || !complete)
        return fault_set(fault, "tick %d: its style %016" PRIx64 " is missing", (int)tick,
                         client->view.style_hash);
    return picture(client, style, version, fault);
}

// A stop before the end that was asked for: what was drawn is kept, but it is not what was wanted.
static bool fault_stopped(Client* client, int64_t wanted, Fault* fault)
{
    client->is_stopped = true;
    return fault_set(fault, "stopped after %" PRId64 " of %" PRId64 " pictures", client->drawn,
                     wanted);
}

// Of a style that is awaited: one more part than ever.
static bool style_comes(Client* client)
{
    int held, parts;
    uint64_t hash = client->view.style_hash;
    if (hash != client->awaited_hash) client->most_progress = 0;
    client->awaited_hash = hash;
    int progress = receive_style_progress(client->receive, hash, &held, &parts);
    if (progress <= client->most_progress) return false;
    client->most_progress = progress;
    return true;
}

static bool check_timeout(Client* client, int64_t now_us, Fault* fault)
{
    const Options* options = &client->options;
    int64_t timeout_us = (int64_t)(options->timeout_s * 1e6);
    if (timeout_us == 0 || now_us - client->progress_us <= timeout_us) return true;
    if (client->heard_us == 0 || now_us - client->heard_us > timeout_us)
        return fault_set(fault,
                         "nothing new for slot %d in %g s: no hair-server on %s, or none of its "
                         "characters has that slot",
                         options->slot, options->timeout_s,
                         options->url ? options->url : "this bus");
    int held, parts;
    receive_style_progress(client->receive, client->view.style_hash, &held, &parts);
    char part_text[40] = "no part";
    if (parts > 0) snprintf(part_text, sizeof part_text, "%d of %d parts", held, parts);
    return fault_set(fault,
                     "guides of slot %d come, but their style does not (held %s, nothing new in "
                     "%g s): does its hair-server hear requests, and is the network sound?",
                     options->slot, part_text, options->timeout_s);
}

static bool run_bus(Client* client, Fault* fault)
{
    client->drain = drain_start(client->options.url, client->receive, client->notice, fault);
    if (client->drain == NULL) return false;
    if (!client->options.quiet) {
        printf("ready: slot %d, %s\n", client->options.slot, client->gl->renderer);
        fflush(stdout);
    }
    client->progress_us = base_monotonic_us();
    while (!enough(client)) {
        int64_t now = base_monotonic_us(), drawn = client->drawn;
        bool has_style;
        if (!follow(client, now, &has_style, fault)) return false;
        // Guides alone are no progress: without their style nothing of them can be drawn.
        if (client->drawn > drawn || (!has_style && style_comes(client))) client->progress_us = now;
        if (client->drawn == drawn) base_sleep_until_us(now + 1000);
        progress(client, has_style ? "drawing" : "waiting for the style");
        if (!drain_running(client->drain)) return fault_set(fault, "the bus is gone");
        if (!check_timeout(client, now, fault)) return false;
    }
    int64_t frames = client->options.frames;
    bool has_style;
    if (frames > 0 && client->drawn >= frames) return true;
    if (!follow(client, base_monotonic_us(), &has_style, fault)) return false;
    return frames == 0 || client->drawn >= frames || fault_stopped(client, frames, fault);
}

// How many ticks of `first` to `last` are to be drawn.
static int64_t wanted_ticks(const Options* options, int64_t first, int64_t last)
{
    int64_t ticks = last < first ? 0 : (last - first) / options->tick_step + 1;
    return options->frames > 0 && options->frames < ticks ? options->frames : ticks;
}

// Before anything is drawn: a range that passes the log's end would be found out at its end.
static bool check_range(const Client* client, Fault* fault)
{
    const Options* options = &client->options;
    int64_t wanted = wanted_ticks(options, options->first_tick, options->last_tick);
    int64_t last = options->first_tick + (wanted - 1) * options->tick_step;
    int32_t held_first = playback_first_tick(client->playback);
    int32_t held_last = playback_last_tick(client->playback);
    if (options->first_tick >= held_first && last <= held_last) return true;
    return fault_set(fault, "tick %" PRId64 " is not in %s (it holds %d..%d)",
                     options->first_tick < held_first ? options->first_tick : last, options->log,
                     (int)held_first, (int)held_last);
}

static bool run_log(Client* client, Fault* fault)
{
    Options* options = &client->options;
    if (options->has_ticks && !check_range(client, fault)) return false;
    if (!playback_feed_styles(client->playback, client->receive, fault)) return false;
    int32_t first =
        options->has_ticks ? options->first_tick : playback_first_tick(client->playback);
    int32_t last = options->has_ticks ? options->last_tick : playback_last_tick(client->playback);
    Fault cut = {""};
    int64_t tick = first;
    for (; tick <= last && !enough(client); tick += options->tick_step) {
        // A logger seldom starts or stops between two ticks: one that it cut is left out.
        bool may_be_cut = !options->has_ticks && (tick == first || tick == last);
        if (!playback_feed_tick(client->playback, (int32_t)tick, client->receive,
                                may_be_cut ? &cut : fault)) {
            if (!may_be_cut) return false;
            notice_say(&client->notice, "%s; left out", cut.text);
            continue;
        }
        if (!exact_picture(client, (int32_t)tick, fault)) return false;
        progress(client, "drawing");
    }
    if (tick <= last && !has_frames(client))
        return fault_stopped(client, wanted_ticks(options, first, last), fault);
    return client->drawn > 0 || fault_set(fault, "%s", cut.text);
}

static void take_message(void* context, int64_t utime, const char* channel, const uint8_t* bytes,
                         size_t size)
{
    Client* client = context;
    receive_message(client->receive, channel, bytes, size, utime);
}

static bool run_embedded(Client* client, Fault* fault)
{
    Options* options = &client->options;
    daemon_add_sink(client->daemon, (DaemonSink){take_message, client});
    daemon_publish_styles(client->daemon);
    int64_t first = options->has_ticks ? options->first_tick : 0;
    int64_t last = options->has_ticks    ? options->last_tick
                   : options->frames > 0 ? options->frames - 1
                                         : 59;
    int64_t tick = 0;
    for (; tick <= last && !enough(client); ++tick) {
        daemon_tick(client->daemon);
        daemon_publish_slice(client->daemon, 0, 1);
        bool wanted = tick >= first && (tick - first) % options->tick_step == 0;
        if (wanted && !exact_picture(client, (int32_t)tick, fault)) return false;
        progress(client, "drawing");
    }
    int64_t asked = wanted_ticks(options, first, last);
    return client->drawn >= asked || fault_stopped(client, asked, fault);
}

static bool open_source(Client* client, double* rate_hz, Fault* fault)
{
    Options* options = &client->options;
    *rate_hz = 60.0;
    if (options->log != NULL) {
        client->playback = playback_open(options->log, options->slot, options->epoch, fault);
        if (client->playback == NULL) return false;
        int32_t a = playback_first_tick(client->playback), b = playback_last_tick(client->playback);
        // In double: log times are anybody's.
        double span_us = (double)playback_tick_utime(client->playback, b) -
                         (double)playback_tick_utime(client->playback, a);
        if (b > a && span_us > 0) *rate_hz = 1e6 * (double)(b - a) / span_us;
        // The clock of a paced log wobbles; films want the rate that was meant.
        if (fabs(*rate_hz - rint(*rate_hz)) < 0.01 * *rate_hz) *rate_hz = rint(*rate_hz);
    }
    if (options->embedded) {
        DaemonOptions daemon = daemon_default();
        for (int i = 0; i < options->style_count; ++i)
            daemon.load.styles[daemon.load.style_count++] = options->styles[i];
        daemon.load.head = options->head;
        daemon.load.unit_m = options->unit_m;
        if (options->motion != NULL) daemon.motion = options->motion;
        daemon.characters = options->slot + 1;
        daemon.fast = true;
        daemon.notice = client->notice;
        client->daemon = daemon_create(&daemon, fault);
        if (client->daemon == NULL) return false;
        *rate_hz = daemon_rate_hz(client->daemon);
    }
    *rate_hz /= options->tick_step;
    return true;
}

// What was asked for and is not given.
static void tell_samples(const Client* client)
{
    const ShadeOptions* asked = &client->options.shade;
    int given = client->drawing.shade.samples;
    if (given < asked->samples)
        notice_say(&client->notice, "%s has %d samples a pixel at most; using those",
                   client->gl->renderer, given);
    if (given < 2 && asked->transparency == TRANSPARENCY_HASH)
        notice_say(&client->notice, "--transparency hash needs 2 samples a pixel; using test");
}

static bool open_all(Client* client, Fault* fault)
{
    Options* options = &client->options;
    double rate_hz;
    client->receive = receive_create(&options->slot, 1, client->notice, fault);
    if (client->receive == NULL || !guides_view_init(&client->view, options->slot, fault) ||
        !open_source(client, &rate_hz, fault))
        return false;
    client->gl = gl_open(options->backend, &client->notice, fault);
    if (client->gl == NULL) return false;
    client->can_draw =
        draw_create(&client->drawing, client->gl, &options->shade, &options->camera, fault);
    if (!client->can_draw) return false;
    tell_samples(client);
    client->drawing.timed = options->stats != NULL;
    int width = options->shade.width, height = options->shade.height;
    if (!image_create(&client->image, width, height, fault)) return false;
    client->output = output_open(options->out, width, height, rate_hz, fault);
    return client->output != NULL;
}

static bool run(Client* client, Fault* fault)
{
    if (client->playback != NULL) return run_log(client, fault);
    if (client->daemon != NULL) return run_embedded(client, fault);
    return run_bus(client, fault);
}

static void close_all(Client* client)
{
    drain_stop(client->drain);
    playback_close(client->playback);
    daemon_destroy(client->daemon);
    if (client->can_draw) draw_free(&client->drawing);
    if (client->gl != NULL) gl_close(client->gl);
    image_free(&client->image);
    guides_view_free(&client->view);
    receive_destroy(client->receive);
}

static bool report(Client* client, Fault* fault)
{
    const Options* options = &client->options;
    ReceiveCounters counters = receive_counters(client->receive);
    double hair = draw_hair_pixels(&client->image);
    if (options->verbose)
        fprintf(stderr, "hair-client: %" PRId64 " pictures, %.0f hair pixels\n", client->drawn,
                hair);
    return options->stats == NULL ||
           stats_write(options->stats, &client->drawing, &client->view, &counters, hair, fault);
}

// A run that failed must not cost the good file of an earlier one; one that was stopped keeps what
// it has drawn.
static bool close_output(Client* client, bool done, Fault* fault)
{
    bool is_kept = done || (client->is_stopped && client->drawn > 0);
    output_tell_older(client->output, &client->notice);
    if (is_kept) return output_close(client->output, fault);
    output_abandon(client->output);
    return true;
}

int main(int argc, char** argv)
{
    static Client client; // large, and its address is given to threads
    client.options = options_parse(argc, argv);
    client.notice = (Notice){say, &client};
    catch_signals();

    Fault fault = {""}, second = {""};
    bool done = open_all(&client, &fault) && run(&client, &fault);
    end_progress(&client);
    if (client.can_draw && !report(&client, done ? &fault : &second)) done = false;
    if (!close_output(&client, done, done ? &fault : &second)) done = false;
    close_all(&client);
    if (done && !base_stdout_written(&fault)) done = false;
    if (fault.text[0] != '\0') fprintf(stderr, "hair-client: %s\n", fault.text);
    if (second.text[0] != '\0' && strcmp(second.text, fault.text) != 0)
        fprintf(stderr, "hair-client: %s\n", second.text);
    return done ? 0 : 1;
}
