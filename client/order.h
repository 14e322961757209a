// In which order hair is drawn: as it grew, or by how far it is from the eye. Blending wants the
// far first, a depth test is fastest with the near first.
#pragma once

#include "client/gl.h"
#include "client/receive.h"
#include "client/ribbons.h"

// What is sorted: whole wisps (thesis 5.6), of which each crosses many others, or their segments.
typedef enum OrderBy { ORDER_WISPS, ORDER_SEGMENTS, ORDER_KINDS } OrderBy;

typedef struct OrderItem {
    uint32_t start, length; // of a strip in Ribbons.indices
} OrderItem;

typedef struct Order {
    int count[ORDER_KINDS];
    OrderItem* items[ORDER_KINDS];
    Vec3* nodes;       // of all guides as they are now
    Vec3* points;      // of all ribbons, about
    uint16_t* keys;    // of each item: 0 is drawn first
    uint32_t* sorted;  // items, and as many for the sort
    uint32_t* indices; // their strips in that order
    int index_count;
    GLuint vao, buffer;
} Order;

bool order_create(Order* order, const Gl* gl, const Ribbons* ribbons, const Hairstyle* style,
                  Fault* fault);
void order_free(Order* order, const Gl* gl);

// Sorts by the distance from `eye` (head space), and hands the strips to the GPU. Where guides of
// `view` are missing, those at rest count. Allocates nothing.
void order_sort(Order* order, const Gl* gl, const Ribbons* ribbons, const Hairstyle* style,
                const GuidesView* view, Vec3 eye, OrderBy by, bool far_first);
