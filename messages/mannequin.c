#include "messages/mannequin.h"

#include "messages/trig.h"

#include <stdlib.h>
#include <string.h>

// How the head is shaped. Primitives are joined root to tip of this file's table of contents,
// mannequin_distance: skull, face, jaw, features, ears, bust. The right half is a mirror of the
// left (x >= 0), which halves the work and cannot drift. Every number is in metres of head space;
// the proportions are the classical thirds, the hairline a little low: hairline 0.285, brow 0.230,
// nose base 0.168, chin 0.107.
//
// Sums of blobs make potatoes; what makes a face is where flesh is NOT: temples, eye sockets, under
// the cheekbones, under the lower lip, under the jaw. Those are the cuts.

#define MIRROR_SOFTNESS_M 0.0015f // rounds |x|, so that the surface has no crease at x = 0

static float clamp_unit(float u)
{
    return u < 0.0f ? 0.0f : u > 1.0f ? 1.0f : u;
}

// Quadratic polynomial smooth minimum (Quilez): C1, differs from min only within k.
static float join(float a, float b, float k)
{
    float h = k - fabsf(a - b);
    if (h <= 0.0f) return a < b ? a : b;
    return (a < b ? a : b) - h * h / (4.0f * k);
}

// `a` with `b` cut away, the edge rounded over k.
static float cut(float a, float b, float k)
{
    return -join(-a, b, k);
}

// First-order distance to an ellipsoid (Quilez): exact on the surface, a bound near it. The exact
// distance needs a root search and lost: nothing here looks further than a few centimetres.
static float ellipsoid(Vec3 p, Vec3 centre, Vec3 radii)
{
    Vec3 q = vec3_sub(p, centre);
    Vec3 a = {q.x / radii.x, q.y / radii.y, q.z / radii.z};
    Vec3 b = {a.x / radii.x, a.y / radii.y, a.z / radii.z};
    float k0 = vec3_length(a), k1 = vec3_length(b);
    if (k1 < 1e-6f) return -(radii.x < radii.z ? radii.x : radii.z);
    return k0 * (k0 - 1.0f) / k1;
}

// A capsule whose radius runs from r0 at `a` to r1 at `b`.
static float cone(Vec3 p, Vec3 a, Vec3 b, float r0, float r1)
{
    Vec3 pa = vec3_sub(p, a), ba = vec3_sub(b, a);
    float h = clamp_unit(vec3_dot(pa, ba) / vec3_dot(ba, ba));
    return vec3_length(vec3_mad(pa, ba, -h)) - (r0 + (r1 - r0) * h);
}

// Capsule bent into a parabola: from `a` at u = 0 to `b` at |u| = 1 with quadratic run, so that
// paired features (lips, lids) meet at the middle without a kink.
static float bow(Vec3 p, Vec3 mid, Vec3 end, float r0, float r1)
{
    float u = (p.x - mid.x) / (end.x - mid.x);
    float s = u * u > 1.0f ? 1.0f : u * u;
    float over = u * u > 1.0f ? fabsf(p.x - mid.x) - fabsf(end.x - mid.x) : 0.0f;
    float y = p.y - (mid.y + (end.y - mid.y) * s), z = p.z - (mid.z + (end.z - mid.z) * s);
    return sqrtf(over * over + y * y + z * z) - (r0 + (r1 - r0) * s);
}

// Depth 0..1 of a line drawn on the face: a parabola through the origin that rises by `rise` at
// x = +-half_width and fades out there. Cut by height alone, so that it follows whatever lies under
// it.
static float crease(float x, float y, float half_width, float rise, float width, float z)
{
    float u = x / half_width, v = (y - rise * u * u) / width;
    if (u * u >= 1.0f || v * v >= 1.0f || z < 0.03f) return 0.0f;
    return (1.0f - u * u * u * u) * (1.0f - v * v) * (1.0f - v * v);
}

static float skull(Vec3 p)
{
    float d = ellipsoid(p, vec3(0, 0.2480f, -0.0150f), vec3(0.0755f, 0.0770f, 0.0850f));
    d = join(d, ellipsoid(p, vec3(0, 0.2430f, 0.0220f), vec3(0.0640f, 0.0680f, 0.0660f)), 0.030f);
    d = join(d, ellipsoid(p, vec3(0, 0.2050f, -0.0350f), vec3(0.0600f, 0.0560f, 0.0560f)), 0.030f);
    return d;
}

static float face(Vec3 p, float d)
{
    d = join(d, ellipsoid(p, vec3(0, 0.1830f, 0.0320f), vec3(0.0570f, 0.0700f, 0.0560f)), 0.024f);
    d = join(
        d,
        cone(p, vec3(0.0450f, 0.1900f, 0.0520f), vec3(0.0600f, 0.1980f, 0.0050f), 0.0120f, 0.0090f),
        0.026f);
    d = join(d, ellipsoid(p, vec3(0.0330f, 0.1640f, 0.0480f), vec3(0.0230f, 0.0330f, 0.0320f)),
             0.026f);
    d = join(
        d,
        cone(p, vec3(0.0010f, 0.2330f, 0.0815f), vec3(0.0430f, 0.2370f, 0.0630f), 0.0090f, 0.0080f),
        0.024f);
    return d;
}

static float jaw(Vec3 p, float d)
{
    d = join(
        d,
        cone(p, vec3(0.0435f, 0.1560f, 0.0080f), vec3(0.0130f, 0.1215f, 0.0740f), 0.0130f, 0.0120f),
        0.026f);
    d = join(d,
             cone(p, vec3(0.0580f, 0.1960f, -0.0020f), vec3(0.0445f, 0.1520f, 0.0080f), 0.0100f,
                  0.0110f),
             0.020f);
    d = join(d, ellipsoid(p, vec3(0, 0.1200f, 0.0790f), vec3(0.0190f, 0.0130f, 0.0160f)), 0.016f);
    d = join(d, ellipsoid(p, vec3(0, 0.1500f, 0.0700f), vec3(0.0330f, 0.0270f, 0.0290f)), 0.014f);
    return d;
}

static float eyes(Vec3 p, float d)
{
    d = cut(d, ellipsoid(p, vec3(0.0335f, 0.2140f, 0.0980f), vec3(0.0215f, 0.0145f, 0.0230f)),
            0.018f);
    d = join(d, ellipsoid(p, vec3(0.0325f, 0.2110f, 0.0640f), vec3(0.0185f, 0.0145f, 0.0155f)),
             0.006f);
    // The closed lids' line and the fold above it.
    d += crease(p.x - 0.0325f, p.y - 0.2045f, 0.0175f, 0.0040f, 0.0034f, p.z) * 0.0017f;
    d += crease(p.x - 0.0330f, p.y - 0.2205f, 0.0195f, -0.0070f, 0.0040f, p.z) * 0.0008f;
    return d;
}

static float nose(Vec3 p, float d)
{
    d = join(d, cone(p, vec3(0, 0.2200f, 0.0840f), vec3(0, 0.1830f, 0.1060f), 0.0065f, 0.0080f),
             0.013f);
    d = join(d, ellipsoid(p, vec3(0, 0.1785f, 0.1070f), vec3(0.0095f, 0.0085f, 0.0100f)), 0.008f);
    d = join(d, ellipsoid(p, vec3(0.0108f, 0.1745f, 0.0980f), vec3(0.0054f, 0.0060f, 0.0085f)),
             0.006f);
    d = cut(d, ellipsoid(p, vec3(0.0062f, 0.1680f, 0.1030f), vec3(0.0028f, 0.0030f, 0.0045f)),
            0.004f);
    return d;
}

static float lips(Vec3 p, float d)
{
    d = join(d,
             bow(p, vec3(0, 0.1522f, 0.0990f), vec3(0.0250f, 0.1480f, 0.0840f), 0.0054f, 0.0010f),
             0.006f);
    d = join(d,
             bow(p, vec3(0, 0.1412f, 0.0965f), vec3(0.0230f, 0.1470f, 0.0835f), 0.0066f, 0.0010f),
             0.006f);
    d += crease(p.x, p.y - 0.1466f, 0.0245f, 0.0009f, 0.0024f, p.z) * 0.0021f;
    return d;
}

// The ear in its own plane: u back, v up, w out of the head. Turned out by about 25 degrees and
// tilted back by about 12 (sine and cosine baked).
static float ear(Vec3 p)
{
    Vec3 q = vec3_sub(p, vec3(0.0755f, 0.2000f, -0.0140f));
    float y = q.y * 0.978f - q.z * 0.208f, z = q.z * 0.978f + q.y * 0.208f;
    float u = -z * 0.906f + q.x * 0.423f, w = q.x * 0.906f + z * 0.423f;
    float reach = fabsf(q.x) + fabsf(q.y) + fabsf(q.z) - 0.1f;
    if (reach > 0.0f) return 0.02f + 0.5f * reach; // far outside: a bound will do
    float ru = 0.0150f + 0.12f * (y > 0.03f ? 0.03f : y < -0.03f ? -0.03f : y), rv = 0.0270f;
    float k0 = sqrtf(u * u / (ru * ru) + y * y / (rv * rv));
    float k1 = sqrtf(u * u / (ru * ru * ru * ru) + y * y / (rv * rv * rv * rv));
    float rim = k1 < 1e-4f ? -ru : k0 * (k0 - 1.0f) / k1;
    float flat = fabsf(w + 0.0015f) - 0.0042f; // thicker towards the head
    float disc = rim > flat ? rim : flat;
    float helix = sqrtf(rim * rim + w * w) - 0.0034f;
    float d = join(disc, helix, 0.004f);
    d = join(d,
             ellipsoid(vec3(u, y, w), vec3(-0.0010f, -0.0215f, 0), vec3(0.0085f, 0.0100f, 0.0042f)),
             0.006f);
    d = join(d,
             ellipsoid(vec3(u, y, w), vec3(-0.0120f, -0.0040f, 0), vec3(0.0050f, 0.0070f, 0.0050f)),
             0.004f);
    return cut(d,
               ellipsoid(vec3(u, y, w), vec3(-0.0020f, -0.0020f, 0.0072f),
                         vec3(0.0080f, 0.0120f, 0.0060f)),
               0.004f);
}

static float bust(Vec3 p, float d)
{
    d = join(d, cone(p, vec3(0, 0.1600f, -0.0250f), vec3(0, -0.0200f, -0.0350f), 0.0450f, 0.0520f),
             0.022f);
    d = join(d,
             cone(p, vec3(0.0480f, 0.1650f, -0.0260f), vec3(0.0130f, 0.0150f, 0.0210f), 0.0080f,
                  0.0080f),
             0.022f);
    float t = ellipsoid(p, vec3(0, -0.0900f, -0.0350f), vec3(0.1480f, 0.1250f, 0.0860f));
    t = join(t,
             cone(p, vec3(0.0150f, 0.0480f, -0.0520f), vec3(0.1300f, -0.0300f, -0.0450f), 0.0260f,
                  0.0260f),
             0.045f);
    t = join(t, ellipsoid(p, vec3(0.1380f, -0.0720f, -0.0380f), vec3(0.0450f, 0.0640f, 0.0500f)),
             0.045f);
    t = join(t,
             cone(p, vec3(0.0150f, 0.0020f, 0.0200f), vec3(0.1200f, -0.0040f, -0.0180f), 0.0070f,
                  0.0060f),
             0.030f);
    d = join(d, t, 0.040f);
    return cut(d, p.y + 0.1200f, 0.024f);
}

static Vec3 mirror(Vec3 p)
{
    return vec3(sqrtf(p.x * p.x + MIRROR_SOFTNESS_M * MIRROR_SOFTNESS_M) - 0.5f * MIRROR_SOFTNESS_M,
                p.y, p.z);
}

float mannequin_distance(Vec3 point)
{
    Vec3 p = mirror(point);
    float d = skull(p);
    d = face(p, d);
    d = jaw(p, d);
    d = eyes(p, d);
    d = nose(p, d);
    d = lips(p, d);
    d = bust(p, d);
    d = join(d, ear(p), 0.006f);
    return d;
}

// Gradient, not normalised: where the field is only a bound its length says by how much.
static Vec3 gradient(Vec3 point)
{
    const float h = 0.0004f;
    // Four taps on a tetrahedron: two fewer than central differences, same order.
    const Vec3 taps[4] = {{1, -1, -1}, {-1, -1, 1}, {-1, 1, -1}, {1, 1, 1}};
    Vec3 sum = {0, 0, 0};
    for (int i = 0; i < 4; ++i)
        sum = vec3_mad(sum, taps[i], mannequin_distance(vec3_mad(point, taps[i], h)));
    return vec3_scale(sum, 1.0f / (4.0f * h));
}

Vec3 mannequin_normal(Vec3 point)
{
    return vec3_normalise_or(gradient(point), vec3(0, 1, 0));
}

// Newton steps along the gradient, each at most `reach_m`, until on the surface.
static Vec3 settle(Vec3 point, int steps, float reach_m)
{
    for (int i = 0; i < steps; ++i) {
        float d = mannequin_distance(point);
        if (fabsf(d) < 2e-6f) break;
        Vec3 g = gradient(point);
        float square = vec3_dot(g, g);
        float step = d / (square > 0.25f ? square : 0.25f);
        step = step > reach_m ? reach_m : step < -reach_m ? -reach_m : step;
        point = vec3_mad(point, g, -step);
    }
    return point;
}

Vec3 mannequin_project(Vec3 point, float lift_m)
{
    point = settle(point, 16, 0.05f);
    return lift_m == 0.0f ? point : vec3_mad(point, mannequin_normal(point), lift_m);
}

// The hairline's height over the diamond angle t = 1 - z / (|x| + |z|): 0 front, 1 side, 2 back (a
// direction without an arctangent). Forehead, temple recess, sideburn, over the ear, round behind
// it, nape.
typedef struct HairlineKnot {
    float t, y_m;
} HairlineKnot;

static const HairlineKnot HAIRLINE[] = {
    {0.00f, 0.2850f}, {0.20f, 0.2845f}, {0.38f, 0.2750f}, {0.52f, 0.2560f}, {0.64f, 0.2300f},
    {0.76f, 0.2120f}, {0.86f, 0.2130f}, {1.02f, 0.2320f}, {1.18f, 0.2300f}, {1.34f, 0.1950f},
    {1.54f, 0.1560f}, {1.75f, 0.1420f}, {2.00f, 0.1400f},
};
#define HAIRLINE_KNOTS  ((int)(sizeof HAIRLINE / sizeof HAIRLINE[0]))
#define HAIRLINE_EDGE_M 0.008f

static float hairline_slope(int k)
{
    int a = k > 0 ? k - 1 : 0, b = k < HAIRLINE_KNOTS - 1 ? k + 1 : k;
    if (k == 0 || k == HAIRLINE_KNOTS - 1) return 0.0f; // mirrored at front and back: level there
    return (HAIRLINE[b].y_m - HAIRLINE[a].y_m) / (HAIRLINE[b].t - HAIRLINE[a].t);
}

// Cubic Hermite through the knots; `slope` receives dy/dt.
static float hairline(float t, float* slope)
{
    int k = 0;
    while (k < HAIRLINE_KNOTS - 2 && t > HAIRLINE[k + 1].t)
        ++k;
    float w = HAIRLINE[k + 1].t - HAIRLINE[k].t, u = clamp_unit((t - HAIRLINE[k].t) / w);
    float y0 = HAIRLINE[k].y_m, y1 = HAIRLINE[k + 1].y_m;
    float m0 = hairline_slope(k) * w, m1 = hairline_slope(k + 1) * w;
    float c = 3.0f * (y1 - y0) - 2.0f * m0 - m1, d = 2.0f * (y0 - y1) + m0 + m1;
    *slope = (m0 + u * (2.0f * c + u * 3.0f * d)) / w;
    return y0 + u * (m0 + u * (c + u * d));
}

float mannequin_scalp(Vec3 surface)
{
    float x = fabsf(surface.x), z = surface.z, span = x + fabsf(z), slope;
    if (span < 0.03f && surface.y > 0.3f) return 1.0f; // the crown, where the angle means nothing

    float above = surface.y - hairline(1.0f - z / span, &slope);
    // dt per metre along the skin is about 1 / span: a steep line is nearer than its height says.
    float steep = slope / span;
    float inside = above / sqrtf(1.0f + steep * steep);
    float off_ear = ear(mirror(surface)) - 0.001f;
    float edge = inside < off_ear ? inside : off_ear;
    return (float)trig_smooth((double)(edge / HAIRLINE_EDGE_M));
}

// Fitted by hill climbing on the largest gap between scalp and union, no sphere more than 1.5 mm
// out of the skin: scalp within 2.5 mm. Skull, occiput and face first, then neck, shoulders last.
static const Sphere COLLIDERS[] = {
    {{0.0f, 0.2471f, 0.0056f}, 0.0779f},       {{0.0f, 0.2487f, -0.0228f}, 0.0760f},
    {{0.0f, 0.2236f, -0.0273f}, 0.0734f},      {{0.0f, 0.1766f, 0.0092f}, 0.0678f},
    {{0.0f, 0.1767f, -0.0260f}, 0.0546f},      {{0.0f, 0.1063f, -0.0273f}, 0.0493f},
    {{0.0f, 0.0421f, -0.0345f}, 0.0575f},      {{0.0310f, -0.0099f, -0.0376f}, 0.0623f},
    {{-0.0310f, -0.0099f, -0.0376f}, 0.0623f}, {{0.1063f, -0.0316f, -0.0392f}, 0.0520f},
    {{-0.1063f, -0.0316f, -0.0392f}, 0.0520f},
};

#define FIRST_OF_TORSO 7 // of COLLIDERS; those before turn with the head

int mannequin_colliders(Collider* colliders, int capacity)
{
    int count = (int)(sizeof COLLIDERS / sizeof COLLIDERS[0]);
    count = count < capacity ? count : capacity;
    if (count <= 0) return 0;
    for (int i = 0; i < count; ++i) {
        colliders[i] = collider_sphere(COLLIDERS[i]);
        colliders[i].body = i < FIRST_OF_TORSO ? BODY_HEAD : BODY_TORSO;
    }
    return count;
}

// ---- Mesh: naive surface nets (Gibson 1998) on a rectilinear grid, fine where the face is.
// Marching cubes lost: half its triangles are slivers, and slivers shade badly under interpolated
// normals.

#define AXIS_CAPACITY 256
#define BLOCK         8       // nodes per side of the coarse pass
#define COARSEST_M    0.0135f // the bust; wider, and its lower edge is ragged

typedef struct Axis {
    int count;
    float at[AXIS_CAPACITY];
} Axis;

typedef struct Grid {
    Axis x, y, z;
    float* distance;  // per node
    uint32_t* vertex; // per cell: index + 1, or 0
} Grid;

// Spacing `fine` for lo <= s <= hi, growing by a fifth of the distance outside, up to `coarse`.
static float spacing(float s, float lo, float hi, float fine, float coarse)
{
    float out = s < lo ? lo - s : s > hi ? s - hi : 0.0f;
    float h = fine + 0.2f * out;
    return h < coarse ? h : coarse;
}

static float least(float a, float b)
{
    return a < b ? a : b;
}

static float spacing_x(float s)
{
    return spacing(fabsf(s), 0.0f, 0.086f, 0.0033f, 0.0135f);
}

static float spacing_y(float s)
{
    float face_m = spacing(s, 0.110f, 0.235f, 0.0040f, 0.0130f);
    float mouth_m = spacing(s, 0.138f, 0.156f, 0.0020f, 0.0130f);
    return least(face_m, least(mouth_m, spacing(s, 0.198f, 0.224f, 0.0016f, 0.0130f)));
}

static float spacing_z(float s)
{
    float ears_m = spacing(s, -0.040f, 0.008f, 0.0042f, 0.0130f);
    return least(ears_m, spacing(s, 0.060f, 0.130f, 0.0032f, 0.0130f));
}

static void axis_fill(Axis* axis, float from, float to, float (*step)(float), float times)
{
    axis->count = 0;
    for (float s = from; axis->count < AXIS_CAPACITY; s += least(times * step(s), COARSEST_M)) {
        axis->at[axis->count++] = s;
        if (s > to) break;
    }
}

// Symmetric about x = 0, so that the mesh is as symmetric as the field.
static void axis_mirror(Axis* axis)
{
    int half = axis->count;
    Axis right = *axis;
    axis->count = 2 * half;
    for (int i = 0; i < half; ++i) {
        axis->at[half + i] = right.at[i];
        axis->at[half - 1 - i] = -right.at[i];
    }
}

static size_t node(const Grid* grid, int x, int y, int z)
{
    return ((size_t)z * (size_t)grid->y.count + (size_t)y) * (size_t)grid->x.count + (size_t)x;
}

static Vec3 place(const Grid* grid, int x, int y, int z)
{
    return vec3(grid->x.at[x], grid->y.at[y], grid->z.at[z]);
}

static int block_end(int from, int count)
{
    return from + BLOCK < count ? from + BLOCK : count;
}

// Distances of one block of nodes. A block whose middle is further from the surface than twice its
// half diagonal holds none of it (twice, because the field is only a bound) and takes the middle's.
static void measure_block(Grid* grid, int x0, int y0, int z0)
{
    int x1 = block_end(x0, grid->x.count), y1 = block_end(y0, grid->y.count);
    int z1 = block_end(z0, grid->z.count);
    Vec3 low = place(grid, x0, y0, z0), high = place(grid, x1 - 1, y1 - 1, z1 - 1);
    float middle = mannequin_distance(vec3_lerp(low, high, 0.5f));
    bool far = fabsf(middle) > vec3_length(vec3_sub(high, low));
    for (int z = z0; z < z1; ++z)
        for (int y = y0; y < y1; ++y)
            for (int x = x0; x < x1; ++x)
                grid->distance[node(grid, x, y, z)] =
                    far ? middle : mannequin_distance(place(grid, x, y, z));
}

static void measure(Grid* grid)
{
    for (int z = 0; z < grid->z.count; z += BLOCK)
        for (int y = 0; y < grid->y.count; y += BLOCK)
            for (int x = 0; x < grid->x.count; x += BLOCK)
                measure_block(grid, x, y, z);
}

// The mean of where the surface crosses the cell's twelve edges; false where it crosses none.
static bool cell_vertex(const Grid* grid, int x, int y, int z, Vec3* vertex)
{
    static const uint8_t EDGES[12][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3},
                                         {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
    Vec3 corner[8], sum = {0, 0, 0};
    float d[8];
    for (int c = 0; c < 8; ++c) {
        int cx = x + (c & 1), cy = y + (c >> 1 & 1), cz = z + (c >> 2);
        corner[c] = place(grid, cx, cy, cz);
        d[c] = grid->distance[node(grid, cx, cy, cz)];
    }
    int crossings = 0;
    for (int e = 0; e < 12; ++e) {
        int a = EDGES[e][0], b = EDGES[e][1];
        if ((d[a] < 0.0f) == (d[b] < 0.0f)) continue;
        sum = vec3_add(sum, vec3_lerp(corner[a], corner[b], d[a] / (d[a] - d[b])));
        ++crossings;
    }
    if (crossings == 0) return false;
    *vertex = vec3_scale(sum, 1.0f / (float)crossings);
    return true;
}

// Gives every crossed cell its vertex; returns how many. With NULL arrays it only counts.
static int lay_vertices(Grid* grid, Vec3* positions)
{
    int count = 0;
    for (int z = 0; z + 1 < grid->z.count; ++z)
        for (int y = 0; y + 1 < grid->y.count; ++y)
            for (int x = 0; x + 1 < grid->x.count; ++x) {
                Vec3 vertex;
                if (!cell_vertex(grid, x, y, z, &vertex)) continue;
                if (positions) positions[count] = vertex;
                grid->vertex[node(grid, x, y, z)] = (uint32_t)++count;
            }
    return count;
}

// Two triangles over cells a b c d (counter-clockwise), split along the shorter diagonal.
static int lay_quad(const Vec3* positions, const uint32_t quad[4], bool flip, uint32_t* out)
{
    if (!out) return 6;
    uint32_t a = quad[0] - 1, b = quad[flip ? 3 : 1] - 1, c = quad[2] - 1,
             d = quad[flip ? 1 : 3] - 1;
    Vec3 ac = vec3_sub(positions[c], positions[a]), bd = vec3_sub(positions[d], positions[b]);
    bool split_ac = vec3_dot(ac, ac) <= vec3_dot(bd, bd);
    const uint32_t along_ac[6] = {a, b, c, a, c, d}, along_bd[6] = {a, b, d, b, c, d};
    memcpy(out, split_ac ? along_ac : along_bd, 6 * sizeof *out);
    return 6;
}

// One quad for every grid edge the surface crosses, over the four cells around that edge. `out` may
// be NULL to count. Nodes on the grid's border are outside the surface by construction.
static int lay_triangles(const Grid* grid, const Vec3* positions, uint32_t* out)
{
    const int steps[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    int count = 0;
    for (int z = 1; z + 1 < grid->z.count; ++z)
        for (int y = 1; y + 1 < grid->y.count; ++y)
            for (int x = 1; x + 1 < grid->x.count; ++x)
                for (int axis = 0; axis < 3; ++axis) {
                    const int *s = steps[axis], *u = steps[(axis + 1) % 3],
                              *v = steps[(axis + 2) % 3];
                    bool inside = grid->distance[node(grid, x, y, z)] < 0.0f;
                    bool next = grid->distance[node(grid, x + s[0], y + s[1], z + s[2])] < 0.0f;
                    if (inside == next) continue;
                    const uint32_t quad[4] = {
                        grid->vertex[node(grid, x - u[0] - v[0], y - u[1] - v[1], z - u[2] - v[2])],
                        grid->vertex[node(grid, x - v[0], y - v[1], z - v[2])],
                        grid->vertex[node(grid, x, y, z)],
                        grid->vertex[node(grid, x - u[0], y - u[1], z - u[2])],
                    };
                    count += lay_quad(positions, quad, next, out ? out + count : NULL);
                }
    return count;
}

static void grid_lay_out(Grid* grid, float times)
{
    // Half a cell off zero, so that no node lies on the mirror plane.
    axis_fill(&grid->x, 0.5f * times * spacing_x(0.0f), 0.215f, spacing_x, times);
    axis_mirror(&grid->x);
    axis_fill(&grid->y, -0.140f, 0.336f, spacing_y, times);
    axis_fill(&grid->z, -0.150f, 0.135f, spacing_z, times);
}

static bool grid_open(Grid* grid, float times)
{
    grid_lay_out(grid, times);
    size_t nodes = node(grid, 0, 0, grid->z.count);
    grid->distance = malloc(nodes * sizeof *grid->distance);
    grid->vertex = calloc(nodes, sizeof *grid->vertex);
    return grid->distance && grid->vertex;
}

static bool mesh_reserve(HeadMesh* mesh, int vertices, int indices)
{
    mesh->positions = malloc((size_t)vertices * sizeof *mesh->positions);
    mesh->normals = malloc((size_t)vertices * sizeof *mesh->normals);
    mesh->indices = malloc((size_t)indices * sizeof *mesh->indices);
    mesh->vertex_count = vertices;
    mesh->index_count = indices;
    return mesh->positions && mesh->normals && mesh->indices;
}

static bool mesh_fill(Grid* grid, HeadMesh* mesh)
{
    measure(grid);
    int vertices = lay_vertices(grid, NULL), indices = lay_triangles(grid, NULL, NULL);
    if (!mesh_reserve(mesh, vertices, indices)) return false;
    lay_vertices(grid, mesh->positions);
    for (int i = 0; i < vertices; ++i) {
        mesh->positions[i] = settle(mesh->positions[i], 10, 0.003f);
        mesh->normals[i] = mannequin_normal(mesh->positions[i]);
    }
    lay_triangles(grid, mesh->positions, mesh->indices);
    return true;
}

bool mannequin_mesh(HeadMesh* mesh, float spacing, Vec3 skin_colour, Fault* fault)
{
    memset(mesh, 0, sizeof *mesh);
    Grid* grid = calloc(1, sizeof *grid);
    bool made = grid && grid_open(grid, spacing) && mesh_fill(grid, mesh);
    if (grid) {
        free(grid->distance);
        free(grid->vertex);
    }
    free(grid);
    if (!made) {
        head_mesh_free(mesh);
        return fault_set(fault, "mannequin: out of memory for the head mesh; free some memory");
    }
    mesh->part_count = 1;
    mesh->parts[0] = (HeadPart){0, (uint32_t)mesh->index_count, skin_colour, true};
    return true;
}
