#include "client/order.h"

#include "messages/quantise.h"

#include <stdlib.h>
#include <string.h>

static void find_items(Order* order, const Ribbons* ribbons)
{
    uint32_t start = 0;
    for (uint32_t i = 0; i < (uint32_t)ribbons->index_count; ++i) {
        if (ribbons->indices[i] != RIBBONS_RESTART) continue;
        order->items[ORDER_WISPS][order->count[ORDER_WISPS]++] = (OrderItem){start, i - start};
        for (uint32_t at = start; at + 4 <= i; at += 2)
            order->items[ORDER_SEGMENTS][order->count[ORDER_SEGMENTS]++] = (OrderItem){at, 4};
        start = i + 1;
    }
}

static bool allocate(Order* order, const Ribbons* ribbons, const Hairstyle* style)
{
    size_t ribbon_count = (size_t)ribbons->ribbon_count, points = (size_t)ribbons->point_count;
    size_t most = points + ribbon_count; // items of either kind
    order->items[ORDER_WISPS] = calloc(ribbon_count + 1, sizeof(OrderItem));
    order->items[ORDER_SEGMENTS] = calloc(points + 1, sizeof(OrderItem));
    order->nodes = calloc((size_t)(style->guide_count * style->nodes), sizeof *order->nodes);
    order->points = calloc(points + 1, sizeof *order->points);
    order->keys = calloc(most + 1, sizeof *order->keys);
    order->sorted = calloc(2 * most + 1, sizeof *order->sorted);
    order->indices = calloc(5 * most + 1, sizeof *order->indices);
    return order->items[ORDER_WISPS] && order->items[ORDER_SEGMENTS] && order->nodes &&
           order->points && order->keys && order->sorted && order->indices;
}

bool order_create(Order* order, const Gl* gl, const Ribbons* ribbons, const Hairstyle* style,
                  Fault* fault)
{
    memset(order, 0, sizeof *order);
    gl->GenVertexArrays(1, &order->vao);
    gl->GenBuffers(1, &order->buffer);
    if (!allocate(order, ribbons, style)) {
        order_free(order, gl);
        return fault_set(fault, "no memory to sort %d wisps", ribbons->ribbon_count);
    }
    find_items(order, ribbons);
    gl->BindVertexArray(order->vao);
    gl->BindBuffer(GL_ELEMENT_ARRAY_BUFFER, order->buffer);
    gl->BindVertexArray(0);
    return true;
}

void order_free(Order* order, const Gl* gl)
{
    for (int kind = 0; kind < ORDER_KINDS; ++kind)
        free(order->items[kind]);
    free(order->nodes);
    free(order->points);
    free(order->keys);
    free(order->sorted);
    free(order->indices);
    gl->DeleteVertexArrays(1, &order->vao);
    gl->DeleteBuffers(1, &order->buffer);
    memset(order, 0, sizeof *order);
}

static void place_nodes(const Order* order, const Hairstyle* style, const GuidesView* view)
{
    for (int row = 0; row < style->guide_count; ++row) {
        int layer = view->row_tick[1][row] > view->row_tick[0][row];
        bool is_here = view->row_tick[layer][row] >= 0;
        for (int i = row * style->nodes; i < (row + 1) * style->nodes; ++i)
            order->nodes[i] = is_here
                                  ? dequantise_position(view->positions[layer] + 3 * i, &style->box)
                                  : style->rest[i];
    }
}

// About where a ribbon point is: its guides as straight lines, its offset as at rest. A wisp is as
// wide as what this gets wrong.
static Vec3 place(const Order* order, const Ribbons* ribbons, int nodes, int point)
{
    const float *guide = ribbons->guides[point], *weight = ribbons->weights[point];
    const float* offset = ribbons->offsets[point];
    int k = (int)guide[3] < nodes - 1 ? (int)guide[3] : nodes - 2;
    float f = guide[3] - (float)k;
    Vec3 sum = vec3(offset[0], offset[1], offset[2]);
    for (int j = 0; j < 3; ++j) {
        const Vec3* node = order->nodes + (int)guide[j] * nodes + k;
        sum = vec3_mad(sum, node[0], weight[j] * (1.0f - f));
        sum = vec3_mad(sum, node[1], weight[j] * f);
    }
    return sum;
}

// Distances as 16-bit keys, spread over all that there are.
static void measure(Order* order, const Ribbons* ribbons, Vec3 eye, OrderBy by, bool far_first)
{
    float low = 1e30f, high = 0.0f;
    for (int i = 0; i < ribbons->point_count; ++i) {
        float distance = vec3_length(vec3_sub(order->points[i], eye));
        low = fminf(low, distance);
        high = fmaxf(high, distance);
    }
    float scale = high > low ? 65535.0f / (high - low) : 0.0f;
    for (int i = 0; i < order->count[by]; ++i) {
        const OrderItem* item = &order->items[by][i];
        uint32_t first = ribbons->indices[item->start] / 2, points = item->length / 2;
        Vec3 middle =
            vec3_add(order->points[first + (points - 1) / 2], order->points[first + points / 2]);
        float distance = vec3_length(vec3_mad(eye, middle, -0.5f));
        float key = fminf(fmaxf((distance - low) * scale, 0.0f), 65535.0f);
        order->keys[i] = (uint16_t)(far_first ? 65535.0f - key : key);
    }
}

// Two passes over a byte each; what is equal keeps its order, so that pictures do not flicker.
// Returns what is sorted.
static const uint32_t* radix(const Order* order, int count)
{
    uint32_t *to = order->sorted, *from = order->sorted + count;
    for (int i = 0; i < count; ++i)
        to[i] = (uint32_t)i;
    for (unsigned shift = 0; shift < 16; shift += 8) {
        uint32_t starts[257] = {0}, *swap = from;
        from = to, to = swap;
        for (int i = 0; i < count; ++i)
            ++starts[(order->keys[i] >> shift & 255u) + 1];
        for (int b = 0; b < 256; ++b)
            starts[b + 1] += starts[b];
        for (int i = 0; i < count; ++i)
            to[starts[order->keys[from[i]] >> shift & 255u]++] = from[i];
    }
    return to;
}

static void write_strips(Order* order, const Ribbons* ribbons, const uint32_t* sorted, OrderBy by)
{
    uint32_t* to = order->indices;
    for (int i = 0; i < order->count[by]; ++i) {
        const OrderItem* item = &order->items[by][sorted[i]];
        memcpy(to, ribbons->indices + item->start, item->length * sizeof *to);
        to += item->length;
        *to++ = RIBBONS_RESTART;
    }
    order->index_count = (int)(to - order->indices);
}

void order_sort(Order* order, const Gl* gl, const Ribbons* ribbons, const Hairstyle* style,
                const GuidesView* view, Vec3 eye, OrderBy by, bool far_first)
{
    place_nodes(order, style, view);
    for (int i = 0; i < ribbons->point_count; ++i)
        order->points[i] = place(order, ribbons, style->nodes, i);
    measure(order, ribbons, eye, by, far_first);
    write_strips(order, ribbons, radix(order, order->count[by]), by);
    gl->BindVertexArray(order->vao);
    gl->BufferData(GL_ELEMENT_ARRAY_BUFFER,
                   (GLsizeiptr)((size_t)order->index_count * sizeof *order->indices),
                   order->indices, GL_STREAM_DRAW);
}
