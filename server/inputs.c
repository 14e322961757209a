#include "server/inputs.h"

static Input* newest_pose(Inputs* inputs, uint16_t slot)
{
    for (int i = inputs->count - 1; i >= 0; --i)
        if (inputs->queue[i].kind == INPUT_POSE && inputs->queue[i].pose.slot == slot)
            return &inputs->queue[i];
    return NULL;
}

bool inputs_push(Inputs* inputs, const Input* input)
{
    if (inputs->count < INPUTS_MAX) {
        inputs->queue[inputs->count++] = *input;
        return true;
    }
    Input* place = input->kind == INPUT_POSE ? newest_pose(inputs, input->pose.slot) : NULL;
    if (place == NULL) return false;
    *place = *input;
    return true;
}
