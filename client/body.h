// The head (and what is worn) as GL buffers, and how much hair grows where on it.
#pragma once

#include "client/gl.h"
#include "client/ribbons.h"

typedef struct Body {
    GLuint vao, vertices, indices;
    int index_count; // 0: nothing to draw
    Box box;         // of its positions, head space
    // The mannequin's: no back face is ever seen; vertices lie as near as shadows are soft.
    bool is_mannequin;
} Body;

// Builds from the style's head mesh or the mannequin. `ribbons` tell where hair grows: the skin
// near roots is shaded as scalp with their tangents. A style without a head gives an empty body,
// and so does a head mesh with vertices further apart (`spacing` above 1): only the mannequin has
// these.
bool body_build(Body* body, const Gl* gl, const Hairstyle* style, const Ribbons* ribbons,
                float spacing, Fault* fault);
// Returns the draw calls: 1, or 0 for an empty body.
int body_draw(const Body* body, const Gl* gl);
void body_free(Body* body, const Gl* gl);
