// Who stands in the daemon's slots.
#pragma once

#include "server/daemon_state.h"

// In place of who was there; whoever cannot be made leaves the slot empty.
bool daemon_characters_add(Daemon* daemon, int number, int style, const Motion* motion,
                           Vec3d position, Fault* fault);
void daemon_characters_remove(Daemon* daemon, int number);

// All of them through the tick that `steps` numbers, over the threads.
void daemon_characters_step(Daemon* daemon);
