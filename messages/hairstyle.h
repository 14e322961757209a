// A hairstyle at rest: what the daemon simulates and every client draws.
//
// A style is a list of strand sets over one table of guide strands. Guides are simulated and
// streamed; a set says how drawn strands hang on them:
//   grown     wisps grown by every client over the scalp triangles from `seed`: nothing to send
//   explicit  imported strands, each bound to three guides of its own section (bulk lane)
// Head space throughout: metres, right-handed, Y up, the face to +Z.
#pragma once

#include "messages/base.h"
#include "messages/vec.h"

#include <stdint.h>

#define HAIRSTYLE_NAME_BYTES    32
#define HAIRSTYLE_MAX_GUIDES    1024
#define HAIRSTYLE_MIN_NODES     3
#define HAIRSTYLE_MAX_NODES     32
#define HAIRSTYLE_MAX_SETS      16
#define HAIRSTYLE_MAX_TRIANGLES 2048
#define HAIRSTYLE_MAX_COLLIDERS 32
#define HAIRSTYLE_MAX_HOLDS     16
#define HAIRSTYLE_MAX_MAGNETS   8
#define HAIRSTYLE_MAX_STRANDS   65536
#define HAIRSTYLE_MAX_POINTS    64 // along one drawn strand
#define HAIRSTYLE_MAX_VERTICES  65535
#define HAIRSTYLE_MAX_INDICES   (3 * 131072)
#define HAIRSTYLE_MAX_PARTS     24
#define HAIRSTYLE_SCALE_LENGTH  1.05f // the box holds balls of this many strand lengths

typedef enum StrandSetKind { STRANDS_GROWN = 1, STRANDS_EXPLICIT = 2 } StrandSetKind;

// One section of a style.
typedef struct StrandSet {
    char name[HAIRSTYLE_NAME_BYTES];
    int kind;                           // StrandSetKind
    int first_guide, guide_count;       // rows of the guide table that are this section's
    int first_triangle, triangle_count; // grown: its scalp triangles
    int first_strand, strand_count;     // explicit: rows of `strands`; grown: wisps at full density
    int first_offset;                   // explicit: index of its first entry in `offsets`
    int points;                         // along one drawn strand, root and tip included
    float root_width_m, tip_width_m;    // of the drawn ribbon
    float fibres;                       // how many hairs a ribbon stands for, side by side
    float jitter_m;                     // grown: how far a wisp strays from its guides at the tip
} StrandSet;

// How the wisps of a grown set are shaped along themselves; all zero: of even width, uncurled.
typedef struct WispForm {
    float belly;          // how much wider their middle is, a share of the width there
    float taper;          // the share of their width that tips lose
    float curl_radius_m;  // of the cylinder that they wind round (Koster 2004), at the tip
    float curl_turns;     // how often, root to tip
    float curl_stiffness; // 0..1: how far from the root curls open; 0 at once
    float rotation_rad;   // how far their frames are turned from the patch direction, either way
    float clump;          // 0..1: how closely the tips of a lock meet
} WispForm;

// What the scalp says of the wisps rooted there: a number at each guide, read between them by the
// weights of the root. A factor, 128 is 1; MAP_TEXTURE is a layer of the strand textures instead,
// one above, and 0 leaves the choice to chance.
typedef enum ScalpMap {
    MAP_DENSITY,
    MAP_WIDTH,
    MAP_LENGTH,
    MAP_ROTATION,
    MAP_SEGMENTS,
    MAP_TEXTURE,
    MAP_COUNT
} ScalpMap;

#define MAP_ONE 128 // of a factor

// A point that wisps grow towards (pull > 0) or shy away from, the more the nearer their tips.
typedef struct Magnet {
    Vec3 at;
    float reach_m; // nothing beyond it
    float pull;    // -1..1
} Magnet;

// Three guides whose roots are the corners of a patch of scalp.
typedef struct ScalpTriangle {
    uint16_t guide[3];
} ScalpTriangle;

// An imported strand and the three guides of its own section that carry it. Point k of K sits at
// arc fraction h = tip_height * k / (K - 1) along each guide, blended by the weights, plus the
// point's rest offset. Integers, so that what is sent is exactly what is drawn.
typedef struct BoundStrand {
    uint16_t guide[3];
    uint16_t weight[3];  // of 65535; they sum to 65535
    uint16_t tip_height; // of 65535: how far along its guides the tip sits
} BoundStrand;

// Rest offset of one point, in units of `offset_scale_m`, along head space axes at rest; it is
// turned by the least rotation that takes the guides' blended rest tangent to today's.
typedef struct StrandOffset {
    int16_t x, y, z;
} StrandOffset;

typedef enum HoldKind { HOLD_BAND = 1, HOLD_CLOTH = 2 } HoldKind;

// What holds a run of guides together: a band around one of their nodes, which lets them come
// closer but not apart, or cloth, whose rows they are, each the neighbour of the next.
typedef struct Hold {
    int kind; // HoldKind
    int first_guide, guide_count;
    int node; // band
} Hold;

typedef enum HeadKind { HEAD_NONE = 0, HEAD_MANNEQUIN = 1, HEAD_MESH = 2 } HeadKind;

// A run of triangles of the head mesh with one colour.
typedef struct HeadPart {
    uint32_t first_index, index_count;
    Vec3 albedo;  // linear reflectance
    bool is_skin; // may carry hair: it is shaded as scalp near the roots
} HeadPart;

// A head to draw and to cast shadows; counter-clockwise seen from outside.
typedef struct HeadMesh {
    int vertex_count, index_count, part_count;
    Vec3* positions;
    Vec3* normals;
    uint32_t* indices;
    HeadPart parts[HAIRSTYLE_MAX_PARTS];
} HeadMesh;

// Linear reflectances.
typedef struct HairMaterial {
    Vec3 root_colour, tip_colour;
    Vec3 skin_colour;
} HairMaterial;

typedef struct Hairstyle {
    char name[HAIRSTYLE_NAME_BYTES];
    uint32_t seed;
    int guide_count, nodes;
    Vec3* rest;      // [guide_count][nodes]: row-major, node 0 the root
    uint8_t* weight; // [guide_count][nodes]: 255 physics ... 0 skinned to the head
    int set_count;
    StrandSet sets[HAIRSTYLE_MAX_SETS];
    WispForm forms[HAIRSTYLE_MAX_SETS]; // of the sets
    int triangle_count;
    ScalpTriangle* triangles;
    int collider_count;
    Collider colliders[HAIRSTYLE_MAX_COLLIDERS];
    int hold_count;
    Hold holds[HAIRSTYLE_MAX_HOLDS];
    int magnet_count;
    Magnet magnets[HAIRSTYLE_MAX_MAGNETS];
    uint8_t* maps; // [guide_count][MAP_COUNT]; NULL: all factors 1, textures by chance
    HairMaterial material;
    int head_kind;    // HeadKind
    Vec3 head_centre; // half-way between chin and crown: what cameras orbit
    Box box;          // what guide positions are quantised in
    // Bulk lane; empty in styles that are only grown.
    int strand_count, offset_count;
    float offset_scale_m;
    BoundStrand* strands;
    StrandOffset* offsets; // per set, strand-major
    HeadMesh head;
} Hairstyle;

// An empty style with default material and no arrays; free with hairstyle_destroy (NULL is fine).
Hairstyle* hairstyle_create(void);
void hairstyle_destroy(Hairstyle* style);

// Allocates `rest` and `weight` (all 255 but node 0, which is 0) for the counts given; false with a
// fault when a count is outside its cap or memory ends. Frees what was there.
bool hairstyle_set_guides(Hairstyle* style, int guide_count, int nodes, Fault* fault);

// Allocates `maps`, neutral, for the guides there are; false with a fault without memory.
bool hairstyle_add_maps(Hairstyle* style, Fault* fault);

// Sets `box` to the union over guides of the ball (root, HAIRSTYLE_SCALE_LENGTH x length): guides
// that keep their length cannot leave it (design 4).
void hairstyle_fit_box(Hairstyle* style);

// Polyline length of guide `guide` at rest, metres.
float hairstyle_guide_length(const Hairstyle* style, int guide);

// Unit tangents of all guides at rest, [guide][node] as `rest`; free them. NULL without memory.
Vec3* hairstyle_rest_tangents(const Hairstyle* style);

// Whether `text` may be a style's name: 1 to 31 printable ASCII characters, as messages carry, and
// not only spaces.
bool hairstyle_is_name(const char* text);

// Whole-structure audit: every count within its cap, every index inside its table, every number
// finite, sets covering the guides without overlap. Decoders and importers end with it, so that
// nobody after them checks again.
bool hairstyle_validate(const Hairstyle* style, Fault* fault);

// Releases a head mesh's arrays and zeroes it.
void head_mesh_free(HeadMesh* mesh);
