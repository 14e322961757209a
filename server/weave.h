// From what holds a style's guides together to the ties of the solver.
#pragma once

#include "messages/hairstyle.h"
#include "server/sim.h"

// The ties of all holds of `style`; free them. `count` is how many; NULL and 0 where there are
// none, NULL and -1 where memory ends.
//
// Cloth: every node to its neighbour in the next row and to the neighbours above and below that, so
// that it resists shear; a link of a row is its strand's own. A band: ropes from each guide to the
// next, the one a quarter and the one half round, because all pairs of 64 guides would be 2016.
Tie* weave_ties(const Hairstyle* style, int* count);
