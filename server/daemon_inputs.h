// What comes from the bus. daemon_receive, in daemon.h, takes a message at any time.
#pragma once

#include "server/daemon_state.h"

// At a tick boundary: does what the waiting messages ask, and publishes each as applied.
void daemon_inputs_consume(Daemon* daemon);
