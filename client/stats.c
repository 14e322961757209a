#include "client/stats.h"

#include "client/replace.h"

#include <errno.h>
#include <inttypes.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>

static int ascending(const void* a, const void* b)
{
    float x = *(const float*)a, y = *(const float*)b;
    return (x > y) - (x < y);
}

static json_t* pass_json(const DrawTimes* times, int pass)
{
    float sorted[DRAW_TIMES];
    int n = times->count[pass] < DRAW_TIMES ? (int)times->count[pass] : DRAW_TIMES;
    memcpy(sorted, times->ms[pass], (size_t)n * sizeof *sorted);
    qsort(sorted, (size_t)n, sizeof *sorted, ascending);
    double median = n > 0 ? (double)sorted[n / 2] : 0.0;
    double p95 = n > 0 ? (double)sorted[(n - 1) * 95 / 100] : 0.0;
    return json_pack("{s:f, s:f}", "median_ms", median, "p95_ms", p95);
}

// XXH64 of the tick that is shown; the empty string while rows of it are missing.
static const char* payload_text(char text[20], const GuidesView* view)
{
    text[0] = '\0';
    if (!view->complete) return text;
    int layer = view->tick & 1;
    uint64_t hash = frame_payload_hash(view->positions[layer], view->tangents[layer], view->guides,
                                       view->nodes);
    snprintf(text, 20, "%016" PRIx64, hash);
    return text;
}

static json_t* to_json(const Drawing* drawing, const GuidesView* view,
                       const ReceiveCounters* counters, double hair_pixels)
{
    char payload[20], style[20];
    snprintf(style, sizeof style, "%016" PRIx64, view->style_hash);
    const Gl* gl = drawing->gl;
    json_t* root = json_pack("{s:s, s:s, s:s, s:i, s:I, s:i, s:s, s:s, s:I}", "renderer",
                             gl->renderer, "version", gl->version, "backend", gl->backend, "slot",
                             view->slot, "epoch", (json_int_t)view->epoch, "tick", (int)view->tick,
                             "payload_hash", payload_text(payload, view), "style_hash", style,
                             "frames", (json_int_t)drawing->frames);
    json_object_set_new(root, "bytes",
                        json_pack("{s:I, s:I}", "received", (json_int_t)counters->bytes, "uploaded",
                                  (json_int_t)drawing->uploaded_bytes));
    json_object_set_new(
        root, "datagrams",
        json_pack("{s:I, s:I, s:I, s:I, s:I}", "received", (json_int_t)counters->datagrams, "lost",
                  (json_int_t)counters->lost, "late", (json_int_t)counters->late, "duplicate",
                  (json_int_t)counters->duplicate, "rejected", (json_int_t)counters->rejected));
    json_object_set_new(root, "epoch_changes", json_integer(counters->epoch_changes));
    json_object_set_new(root, "draw_calls", json_integer(drawing->draw_calls));
    json_object_set_new(root, "hair_pixels", json_real(hair_pixels));
    json_t* passes = json_object();
    for (int pass = 0; pass < PASSES; ++pass)
        json_object_set_new(passes, draw_pass_names[pass], pass_json(drawing->times, pass));
    json_object_set_new(root, "passes", passes);
    return root;
}

static bool dump(const json_t* root, FILE* file)
{
    return json_dumpf(root, file, JSON_INDENT(2) | JSON_REAL_PRECISION(9)) == 0 &&
           fputc('\n', file) != EOF && fflush(file) == 0;
}

static bool write_file(const json_t* root, const char* path, Fault* fault)
{
    Replace replace;
    FILE* file = replace_open(&replace, path, fault);
    if (file == NULL) return false;
    if (dump(root, file)) return replace_close(&replace, file, fault);
    int error = errno;
    fclose(file);
    replace_abandon(&replace);
    return fault_set(fault, "cannot write %.300s: %s", path, strerror(error));
}

bool stats_write(const char* path, const Drawing* drawing, const GuidesView* view,
                 const ReceiveCounters* counters, double hair_pixels, Fault* fault)
{
    json_t* root = to_json(drawing, view, counters, hair_pixels);
    bool written;
    if (strcmp(path, "-") == 0)
        written = dump(root, stdout) || fault_set(fault, "cannot write -: %s", strerror(errno));
    else
        written = write_file(root, path, fault);
    json_decref(root);
    return written || fault_prefix(fault, "--stats");
}
