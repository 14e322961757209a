// Arc functions to 1e-7 rad (Abramowitz and Stegun 4.4.46), the same on every driver. llvmpipe's own
// err by 4e-4, which costs 0.01 sRGB codes here.
float arc_cos_of_positive(float x) // 0..1
{
    float p = -0.0012624911;
    p = p * x + 0.0066700901;
    p = p * x - 0.0170881256;
    p = p * x + 0.0308918810;
    p = p * x - 0.0501743046;
    p = p * x + 0.0889789874;
    p = p * x - 0.2145988016;
    p = p * x + 1.5707963050;
    return sqrt(max(1.0 - x, 0.0)) * p;
}

float arc_sin(float x)
{
    float magnitude = 1.57079632679 - arc_cos_of_positive(min(abs(x), 1.0));
    return x < 0.0 ? -magnitude : magnitude;
}

// Between two vectors of length 1, 0..pi: by half its sine or cosine, whichever is well known.
float arc_between(vec3 a, vec3 b)
{
    float sine = 0.5 * length(a - b), cosine = 0.5 * length(a + b);
    return 2.0 * (sine < cosine ? arc_sin(sine) : arc_cos_of_positive(min(cosine, 1.0)));
}
