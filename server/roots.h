// Where the head has taken every rest node: the first stage of a substep.
#pragma once

#include "server/strands.h"

// reference = rotation * rest.
void roots_place(Block* block, const float rotation[9]);
