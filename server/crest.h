// A built-in style that is not hair: a fin along the middle of the head, as the mermaids of Nalu
// wear them (Nguyen and Donnelly 2005, 23.2.3). Cloth is the same particles: every row of the fin
// is a guide, its links are kept as any guide's are, and ties hold neighbours together.
#pragma once

#include "messages/hairstyle.h"

// As groom_long() and its like.
Hairstyle* crest_style(Fault* fault);
