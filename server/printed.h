// What the models as printed (cascade-thesis, forest-z) hold of a strand at rest.
#pragma once

#include "server/strands.h"

// One strand into one lane of `block`, whose constants for the other models are filled.
void printed_fill(Block* block, const SimDefinition* definition, int strand, int lane);
