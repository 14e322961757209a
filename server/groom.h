// Built-in styles: guides grown over the mannequin. Deterministic: no libm but sqrt, fabs, floor.
#pragma once

#include "messages/hairstyle.h"

// A finished style (guides, scalp triangles, one grown set per section, colliders, box), or NULL
// with a fault. Names: load_builtin_styles.
Hairstyle* groom_long(Fault* fault);
Hairstyle* groom_bob(Fault* fault);
// Combed to a band behind the crown that holds its guides together, and hanging free from there.
Hairstyle* groom_ponytail(Fault* fault);
// Locks that wind round their guides, to the shoulders.
Hairstyle* groom_curly(Fault* fault);
// A few centimetres, shorter at the nape.
Hairstyle* groom_short(Fault* fault);
