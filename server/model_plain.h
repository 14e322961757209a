// The plain chain (Nguyen and Donnelly 2005, 23.2: Nalu): Verlet and lengths, no shape to return
// to. What it hangs in is gravity alone, so that is never compensated.
#pragma once

#include "server/integrate.h"

INLINE Real3 plain_fall(const Block* block, const Substep* substep, int n, int l)
{
    (void)block, (void)n, (void)l;
    return (Real3){0, -(real)substep->gravity_m_s2, 0};
}

static void plain_move(Block* block, const Substep* substep)
{
    integrate_verlet(block, substep, plain_fall);
}
