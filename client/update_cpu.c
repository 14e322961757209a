// The formula on the CPU, in float, one thread (the thesis's software path), uploaded to the
// targets. The twin of shaders/point_formula.glsl; messages/drawn.c is the one in double.
#include "client/update.h"
#include "messages/quantise.h"

#include <stdlib.h>

typedef struct Node {
    Vec3 position, tangent;
} Node;

struct UpdateCpu {
    int guides, nodes;
    Node *rest, *now;    // [guide][node]; positions from the corner of the box, metres
    Vec3* rest_tangents; // in full, as the GPU has them
    Texel* out[UPDATE_TARGETS];
};

static Node decode(const PointsBlock* block, const uint16_t* position, const int16_t* tangent)
{
    const float* size = block->box_size;
    Vec3 p = {(float)position[0] / 65535.0f, (float)position[1] / 65535.0f,
              (float)position[2] / 65535.0f};
    Vec3 t = {(float)tangent[0] / 32767.0f, (float)tangent[1] / 32767.0f,
              (float)tangent[2] / 32767.0f};
    return (Node){{p.x * size[0], p.y * size[1], p.z * size[2]},
                  vec3_max(t, vec3(-1.0f, -1.0f, -1.0f))};
}

// As upload_create has it for rows that never came.
static void fill_rest(UpdateCpu* cpu, const PointsBlock* block, const Hairstyle* style)
{
    for (int i = 0; i < cpu->guides * cpu->nodes; ++i) {
        uint16_t position[3];
        int16_t tangent[3];
        quantise_position(position, style->rest[i], &style->box);
        quantise_tangent(tangent, cpu->rest_tangents[i]);
        cpu->rest[i] = decode(block, position, tangent);
    }
}

bool update_cpu_create(Update* update, const Gl* gl, const Hairstyle* style, Fault* fault)
{
    (void)gl;
    size_t nodes = (size_t)style->guide_count * (size_t)style->nodes;
    UpdateCpu* cpu = update->cpu = calloc(1, sizeof *cpu);
    if (cpu == NULL) return fault_set(fault, "no memory for %d guides", style->guide_count);
    cpu->guides = style->guide_count;
    cpu->nodes = style->nodes;
    cpu->rest = malloc(nodes * sizeof *cpu->rest);
    cpu->now = malloc(nodes * sizeof *cpu->now);
    cpu->rest_tangents = hairstyle_rest_tangents(style);
    bool made = cpu->rest != NULL && cpu->now != NULL && cpu->rest_tangents != NULL;
    for (int i = 0; i < UPDATE_TARGETS; ++i) {
        cpu->out[i] = malloc(((size_t)update->point_count + 1) * sizeof(Texel));
        made = made && cpu->out[i] != NULL;
    }
    if (!made) return fault_set(fault, "no memory for %d ribbon points", update->point_count);
    fill_rest(cpu, &update->constants, style);
    return true;
}

void update_cpu_free(Update* update)
{
    UpdateCpu* cpu = update->cpu;
    if (cpu == NULL) return;
    free(cpu->rest);
    free(cpu->now);
    free(cpu->rest_tangents);
    for (int i = 0; i < UPDATE_TARGETS; ++i)
        free(cpu->out[i]);
    free(cpu);
}

static Vec3 mix(Vec3 a, Vec3 b, float f)
{
    return vec3_add(vec3_scale(a, 1.0f - f), vec3_scale(b, f));
}

static Node node_of(const UpdateCpu* cpu, const PointsBlock* block, const GuidesView* view, int row,
                    int node, int layer)
{
    int i = row * cpu->nodes + node;
    if (view == NULL || view->row_tick[layer][row] < 0) return cpu->rest[i];
    return decode(block, view->positions[layer] + 3 * i, view->tangents[layer] + 3 * i);
}

static void decode_guides(const UpdateCpu* cpu, const PointsBlock* block,
                          const UpdateGuides* guides)
{
    for (int row = 0; row < cpu->guides; ++row) {
        int layer = block->newest[row >> 5] >> (row & 31) & 1;
        for (int n = 0; n < cpu->nodes; ++n) {
            Node* now = &cpu->now[row * cpu->nodes + n];
            *now = node_of(cpu, block, guides->view, row, n, layer);
            if (guides->blend >= 1.0f) continue;
            Node before = node_of(cpu, block, guides->view, row, n, 1 - layer);
            now->position = mix(before.position, now->position, guides->blend);
            now->tangent = mix(before.tangent, now->tangent, guides->blend);
        }
    }
}

static Vec3 hermite(const Node* a, const Node* b, float f)
{
    Vec3 chord = vec3_sub(b->position, a->position);
    float g = 1.0f - f, length = vec3_length(chord);
    Vec3 at = vec3_mad(a->position, chord, f * f * (3.0f - 2.0f * f));
    at = vec3_mad(at, a->tangent, length * f * g * g);
    return vec3_mad(at, b->tangent, -length * f * f * g);
}

static Vec3 turn(Vec3 v, Vec3 from, Vec3 to)
{
    Vec3 b = vec3_cross(from, to);
    float c = vec3_dot(from, to);
    if (c < (float)DRAWN_OPPOSED) return v;
    Vec3 bv = vec3_cross(b, v);
    return vec3_mad(vec3_add(v, bv), vec3_cross(b, bv), 1.0f / (1.0f + c));
}

static Vec3 push_out(const PointsBlock* block, Vec3 at)
{
    for (int i = 0; i < block->capsules[0]; ++i) {
        const float *c = block->capsule_from[i], *to = block->capsule_to[i];
        Vec3 from = vec3_sub(at, vec3(c[0], c[1], c[2]));
        Vec3 axis = vec3(to[0] - c[0], to[1] - c[1], to[2] - c[2]);
        float square = vec3_dot(axis, axis);
        float u = square > 0.0f ? vec3_dot(from, axis) / square : 0.0f;
        from = vec3_mad(from, axis, -fminf(fmaxf(u, 0.0f), 1.0f));
        float distance = vec3_length(from), lack = c[3] - distance;
        if (lack <= 0.0f || distance < (float)DRAWN_ON_AXIS_M) continue;
        at = vec3_mad(at, from, fminf(lack, distance) / distance);
    }
    return at;
}

static void put(Texel out, Vec3 v, float w)
{
    out[0] = v.x, out[1] = v.y, out[2] = v.z, out[3] = w;
}

static void place_point(const Update* update, int i)
{
    const UpdateCpu* cpu = update->cpu;
    const Ribbons* ribbons = &update->ribbons;
    const float *guides = ribbons->guides[i], *weights = ribbons->weights[i];
    const float *offset = ribbons->offsets[i], *t = ribbons->tangents[i], *n = ribbons->normals[i];
    const float* low = update->constants.box_low;
    int k = (int)guides[3] < cpu->nodes - 2 ? (int)guides[3] : cpu->nodes - 2;
    float f = guides[3] - (float)k;
    Vec3 position = {0, 0, 0}, now = position, rest = position;
    for (int j = 0; j < 3; ++j) {
        int at = (int)guides[j] * cpu->nodes + k;
        const Node *a = &cpu->now[at], *b = a + 1;
        Vec3 rest_a = cpu->rest_tangents[at], rest_b = cpu->rest_tangents[at + 1];
        position = vec3_mad(position, hermite(a, b, f), weights[j]);
        rest = vec3_mad(rest, mix(rest_a, rest_b, f), weights[j]);
        now = vec3_mad(now, mix(k == 0 ? rest_a : a->tangent, b->tangent, f), weights[j]);
    }
    bool turns = fminf(vec3_dot(now, now), vec3_dot(rest, rest)) > (float)DRAWN_MIN_TANGENT_SQ;
    rest = turns ? vec3_scale(rest, 1.0f / vec3_length(rest)) : vec3(0, -1, 0);
    now = turns ? vec3_scale(now, 1.0f / vec3_length(now)) : rest;
    position = vec3_add(position, turn(vec3(offset[0], offset[1], offset[2]), rest, now));
    position = push_out(&update->constants, vec3_add(position, vec3(low[0], low[1], low[2])));
    put(cpu->out[UPDATE_POSITIONS][i], position, weights[3]);
    put(cpu->out[UPDATE_NORMALS][i], turn(vec3(n[0], n[1], n[2]), rest, now), n[3]);
    put(cpu->out[UPDATE_TANGENTS][i], turn(vec3(t[0], t[1], t[2]), rest, now), t[3]);
}

int update_cpu_run(const Update* update, const Gl* gl, const UpdateGuides* guides)
{
    decode_guides(update->cpu, &update->constants, guides);
    for (int i = 0; i < update->point_count; ++i)
        place_point(update, i);
    for (int i = 0; i < UPDATE_TARGETS; ++i)
        update_put_texels(gl, update->targets[i], update->point_count, update->cpu->out[i]);
    return 0;
}
