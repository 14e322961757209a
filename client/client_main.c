// hair-client: from the command line to pictures. The only client file that knows the daemon, for
// --embedded, and that prints or exits.
#include "client/drain.h"
#include "client/options.h"
#include "client/output.h"
#include "client/playback.h"
#include "client/stats.h"
#include "server/daemon.h"

#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// Set by SIGINT and SIGTERM; a handler may touch nothing else.
static volatile sig_atomic_t stop_asked;

static void ask_stop(int signal_number)
{
    (void)signal_number;
    stop_asked = 1;
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
    int64_t last_new_us, last_line_us;
    int64_t waiting_since_us; // rows have come and are not drawn yet; 0: all are
    int64_t drawn;
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

static bool enough(const Client* client)
{
    return stop_asked || (client->options.frames > 0 && client->drawn >= client->options.frames);
}

// Rows of a tick come in several messages, paced over the tick: drawn when the last is there, or
// when so much time has passed that it was lost. Drawing at each message would show rows of two
// ticks.
#define INCOMPLETE_US 50000

// Takes what is new and draws it when it is time to; `*has_style` says whether it could be drawn.
static bool follow(Client* client, int64_t now_us, bool* has_style, Fault* fault)
{
    if (receive_take(client->receive, &client->view)) {
        client->last_new_us = now_us;
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

static bool run_bus(Client* client, Fault* fault)
{
    client->drain = drain_start(client->options.url, client->receive, client->notice, fault);
    if (client->drain == NULL) return false;
    if (!client->options.quiet) {
        printf("ready: slot %d, %s\n", client->options.slot, client->gl->renderer);
        fflush(stdout);
    }
    client->last_new_us = base_monotonic_us();
    while (!enough(client)) {
        int64_t now = base_monotonic_us(), drawn = client->drawn;
        bool has_style;
        if (!follow(client, now, &has_style, fault)) return false;
        if (client->drawn == drawn) base_sleep_until_us(now + 1000);
        progress(client, has_style ? "drawing" : "waiting for the style");
        if (!drain_running(client->drain)) return fault_set(fault, "the bus is gone");
        double waited_s = (double)(now - client->last_new_us) * 1e-6;
        if (client->options.timeout_s > 0 && waited_s > client->options.timeout_s)
            return fault_set(fault,
                             "nothing new for slot %d in %g s: no hair-server on %s, or none of "
                             "its characters has that slot",
                             client->options.slot, client->options.timeout_s,
                             client->options.url ? client->options.url : "this bus");
    }
    bool has_style;
    bool is_full = client->options.frames > 0 && client->drawn >= client->options.frames;
    return is_full || follow(client, base_monotonic_us(), &has_style, fault);
}

static bool run_log(Client* client, Fault* fault)
{
    Options* options = &client->options;
    if (!playback_feed_styles(client->playback, client->receive, fault)) return false;
    int32_t first =
        options->has_ticks ? options->first_tick : playback_first_tick(client->playback);
    int32_t last = options->has_ticks ? options->last_tick : playback_last_tick(client->playback);
    Fault cut = {""};
    for (int64_t tick = first; tick <= last && !enough(client); tick += options->tick_step) {
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
    return client->drawn > 0 || stop_asked || fault_set(fault, "%s", cut.text);
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
    int64_t last = options->has_ticks    ? options->last_tick
                   : options->frames > 0 ? options->frames - 1
                                         : 59;
    for (int64_t tick = 0; tick <= last && !enough(client); ++tick) {
        daemon_tick(client->daemon);
        daemon_publish_slice(client->daemon, 0, 1);
        bool wanted =
            !options->has_ticks ||
            (tick >= options->first_tick && (tick - options->first_tick) % options->tick_step == 0);
        if (wanted && !exact_picture(client, (int32_t)tick, fault)) return false;
        progress(client, "drawing");
    }
    return true;
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

int main(int argc, char** argv)
{
    static Client client; // large, and its address is given to threads
    client.options = options_parse(argc, argv);
    client.notice = (Notice){say, &client};
    struct sigaction action = {.sa_handler = ask_stop, .sa_flags = SA_RESETHAND}; // again: at once
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);

    Fault fault = {""}, second = {""};
    bool done = open_all(&client, &fault) && run(&client, &fault);
    end_progress(&client);
    if (client.can_draw && !report(&client, done ? &fault : &second)) done = false;
    if (!output_close(client.output, done ? &fault : &second)) done = false;
    close_all(&client);
    if (fault.text[0] != '\0') fprintf(stderr, "hair-client: %s\n", fault.text);
    if (second.text[0] != '\0' && strcmp(second.text, fault.text) != 0)
        fprintf(stderr, "hair-client: %s\n", second.text);
    return done ? 0 : 1;
}
