// A point of a ribbon's centre line, head space.
struct Point {
    vec3 position; // m
    float half_width;
    vec3 normal;
    float random;
    vec3 tangent;
    float along; // 0 root to 1 tip
    float fill;  // share of the width that fibres fill
};
