#include "client/transparency.h"

#include <stdio.h>

const TransparencyVariant transparency_variants[TRANSPARENCIES] = {
    [TRANSPARENCY_AUTO] = {"auto", 1, false, false},
    [TRANSPARENCY_TEST] = {"test", 1, false, false},
    [TRANSPARENCY_COVERAGE] = {"coverage", 1, true, false},
    [TRANSPARENCY_HASH] = {"hash", 2, false, false},
    [TRANSPARENCY_BLEND] = {"blend", 1, false, true},
};

Transparency transparency_choose(Transparency asked, int samples)
{
    if (asked == TRANSPARENCY_AUTO) asked = TRANSPARENCY_HASH;
    return samples < transparency_variants[asked].least_samples ? TRANSPARENCY_TEST : asked;
}

void transparency_defines(char text[TRANSPARENCY_DEFINES], Transparency transparency, int samples,
                          TransparencyStep step)
{
    snprintf(text, TRANSPARENCY_DEFINES,
             "#define TRANSPARENCY %d\n#define SAMPLES %d\n#define DEPTH_STEP %d\n"
             "#define AFTER_DEPTH %d\n",
             (int)transparency, samples, step == STEP_DEPTH, step == STEP_AFTER_DEPTH);
}

void transparency_begin(const Gl* gl, Transparency transparency, int samples, TransparencyStep step)
{
    const TransparencyVariant* variant = &transparency_variants[transparency];
    bool colour = step != STEP_DEPTH;
    gl->ColorMask(colour, colour, colour, colour);
    gl->Enable(GL_DEPTH_TEST);
    if (variant->blends && colour) {
        // Straight colour, and the share of what is behind that is hidden in alpha.
        gl->Enable(GL_BLEND);
        gl->BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
        gl->DepthMask(GL_FALSE);
        gl->DepthFunc(GL_LEQUAL); // what wrote depth before is blended, too
        return;
    }
    if (step == STEP_AFTER_DEPTH) {
        gl->DepthMask(GL_FALSE);
        gl->DepthFunc(GL_EQUAL);
        return;
    }
    if (!variant->to_coverage || samples < 2) return;
    gl->Enable(GL_SAMPLE_ALPHA_TO_COVERAGE);
    gl->Enable(GL_SAMPLE_ALPHA_TO_ONE); // a sample that is kept is hair altogether
}

void transparency_end(const Gl* gl)
{
    gl->Disable(GL_BLEND);
    gl->Disable(GL_SAMPLE_ALPHA_TO_COVERAGE);
    gl->Disable(GL_SAMPLE_ALPHA_TO_ONE);
    gl->ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    gl->DepthMask(GL_TRUE);
    gl->DepthFunc(GL_LESS);
}
