// What the shadings share: what they take and what they return.
struct Strand {
    vec3 tangent, normal; // root to tip; away from the head
    vec3 colour;
    float along; // 0 root to 1 tip
    float among; // 1: other fibres send it light that they let through; 0: it stands alone
};

// Radiance in two parts: what has the hair's colour, and the first highlight, which has the
// light's.
struct Lobes {
    vec3 body, shine;
};

Lobes scaled(Lobes lobes, float by)
{
    return Lobes(lobes.body * by, lobes.shine * by);
}

Lobes added(Lobes a, Lobes b)
{
    return Lobes(a.body + b.body, a.shine + b.shine);
}

// 1 on the side of the head that faces the light, 0 behind, soft between: what hair and head that
// cast no shadow in this light would have kept from a strand.
float faces(vec3 normal, vec3 light)
{
    return clamp((dot(normal, light) + 0.35) / 1.35, 0.0, 1.0);
}
