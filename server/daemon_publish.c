// The publishing half of daemon.h: guides in slices, status, styles.
#include "server/daemon_state.h"

#include <stdio.h>

static FrameHeader header_of(const Daemon* daemon, const Character* c)
{
    return (FrameHeader){.utime = daemon->utime,
                         .epoch = daemon->publisher.epoch,
                         .style_hash = daemon->styles[c->style].publish.bytes.hash,
                         .tick = daemon_tick_number(daemon),
                         .segment = c->segment,
                         .pose = c->head,
                         .slot = (uint16_t)c->number,
                         .profile = FRAME_PROFILE_FULL};
}

static void remark_unsent(Daemon* daemon, const Character* c)
{
    char text[200];
    Vec3d at = c->head.position;
    if (pose_is_near(at))
        snprintf(text, sizeof text, "character %d is not sent: is the clock before 1970?",
                 c->number);
    else
        snprintf(text, sizeof text,
                 "character %d is not sent: its head at %g %g %g m must be within %g m of the "
                 "origin",
                 c->number, at.x, at.y, at.z, POSE_FARTHEST_M);
    complaints_remark(&daemon->complaints, COMPLAINT_UNSENT, text);
}

void daemon_publish_slice(Daemon* daemon, int slice, int slices)
{
    int64_t total = 0, message = 0;
    for (int i = 0; i < daemon->used; ++i)
        total +=
            publish_block_count(&daemon->publisher, daemon->characters[daemon->order[i]]->hair);
    int64_t first = total * slice / slices, end = total * (slice + 1) / slices;
    for (int i = 0; i < daemon->used; ++i) {
        const Character* c = daemon->characters[daemon->order[i]];
        const Hairstyle* hair = c->hair;
        FrameHeader header = header_of(daemon, c);
        int blocks = publish_block_count(&daemon->publisher, hair);
        for (int b = 0; b < blocks; ++b, ++message)
            if (message >= first && message < end &&
                !publish_block(&daemon->publisher, &header, &c->planes, hair, b))
                remark_unsent(daemon, c);
    }
}

static void publish_status(Daemon* daemon)
{
    DaemonStatus status = daemon_status(daemon);
    StatusMessage message = {.utime = daemon->utime,
                             .epoch = daemon->publisher.epoch,
                             .tick = daemon_tick_number(daemon),
                             .rate_hz = (float)daemon->sim.rate_hz,
                             .step_us = (float)status.step_us,
                             .characters = status.characters,
                             .strands = status.strands,
                             .overruns = status.overruns,
                             .clamped = status.clamped,
                             .rejected = status.rejected,
                             .sent_messages = status.sent_messages,
                             .sent_bytes = status.sent_bytes,
                             .quarantined = status.quarantined,
                             .jumps = status.jumps};
    uint8_t bytes[CONTROL_MAX_BYTES];
    publish_bytes(&daemon->publisher, daemon->utime, CHANNEL_STATUS, bytes,
                  status_encode(bytes, sizeof bytes, &message));
}

void daemon_publish_background(Daemon* daemon, int64_t elapsed_us)
{
    daemon->publisher.bulk_sharers = 0;
    for (int i = 0; i < daemon->style_count; ++i) {
        const PublishStyle* style = &daemon->styles[i].publish;
        daemon->publisher.bulk_sharers +=
            style->due[STYLE_BULK] && style->bytes.size[STYLE_BULK] > 0;
    }
    for (int i = 0; i < daemon->style_count; ++i)
        publish_style_due(&daemon->publisher, &daemon->styles[i].publish, daemon->utime,
                          elapsed_us);
    daemon->since_status_us += elapsed_us;
    if (daemon->since_status_us < 1000000) return;
    daemon->since_status_us = 0;
    publish_status(daemon);
}

void daemon_publish_styles(Daemon* daemon)
{
    for (int i = 0; i < daemon->style_count; ++i)
        publish_style_all(&daemon->publisher, &daemon->styles[i].publish, daemon->utime);
}

void daemon_record_styles(Daemon* daemon, DaemonSink sink)
{
    Publisher* publisher = &daemon->publisher;
    DaemonSink first = publisher->sinks[0];
    int count = publisher->sink_count;
    publisher->sinks[0] = sink;
    publisher->sink_count = 1;
    daemon_publish_styles(daemon);
    publisher->sinks[0] = first;
    publisher->sink_count = count;
    for (int i = 0; i < daemon->style_count; ++i)
        publish_style_restart(&daemon->styles[i].publish);
}
