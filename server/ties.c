#include "server/ties.h"

#include "server/strands.h"

// A node of a strand, where it lies in its block.
typedef struct End {
    Lanes3* position;
    int lane;
    real inverse_mass; // 0 skinned
} End;

static End end_of(const Sim* sim, const Tie* tie, int end)
{
    const Block* block = &sim->blocks[tie->strand[end] / LANES];
    int lane = tie->strand[end] % LANES, node = tie->node[end];
    return (End){&block->position[node], lane, block->inverse_mass[node].v[lane]};
}

static void pull(const End* end, real x, real y, real z)
{
    end->position->x[end->lane] += x;
    end->position->y[end->lane] += y;
    end->position->z[end->lane] += z;
}

static void hold(const Sim* sim, const Tie* tie)
{
    End a = end_of(sim, tie, 0), b = end_of(sim, tie, 1);
    real both = a.inverse_mass + b.inverse_mass;
    real x = b.position->x[b.lane] - a.position->x[a.lane];
    real y = b.position->y[b.lane] - a.position->y[a.lane];
    real z = b.position->z[b.lane] - a.position->z[a.lane];
    real length = real_sqrt(x * x + y * y + z * z), excess = length - (real)tie->length_m;
    if (!(both > 0 && length > LEAST_LENGTH_M)) return;
    if (real_abs(excess) <= RESOLVED_M || (tie->is_rope && excess < 0)) return;
    real part = excess / (length * both), in = a.inverse_mass * part, out = b.inverse_mass * part;
    pull(&a, in * x, in * y, in * z);
    pull(&b, -out * x, -out * y, -out * z);
}

void ties_hold(Sim* sim, int sweeps)
{
    for (int sweep = 0; sweep < sweeps; ++sweep)
        for (int i = 0; i < sim->definition.tie_count; ++i)
            hold(sim, &sim->ties[i]);
}
