#include "server/inputs.h"

static bool is_pose(InputKind kind)
{
    return kind == INPUT_POSE || kind == INPUT_TORSO;
}

static Input* newest_pose(Inputs* inputs, InputKind kind, uint16_t slot)
{
    for (int i = inputs->count - 1; i >= 0; --i)
        if (inputs->queue[i].kind == kind && inputs->queue[i].pose.slot == slot)
            return &inputs->queue[i];
    return NULL;
}

bool inputs_push(Inputs* inputs, const Input* input)
{
    if (inputs->count < INPUTS_MAX) {
        inputs->queue[inputs->count++] = *input;
        return true;
    }
    Input* place = is_pose(input->kind) ? newest_pose(inputs, input->kind, input->pose.slot) : NULL;
    if (place == NULL) return false;
    *place = *input;
    return true;
}
