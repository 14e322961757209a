// M of d'Eon et al. 2011: as much light leaves along the hair as comes, whatever the tilt.

// ln I0(x), to 1e-5.
float log_bessel(float x)
{
    if (x > 10.0) {
        float y = 0.125 / x;
        return x - 0.5 * log(6.28318530718 * x) +
               log(1.0 + y * (1.0 + y * (4.5 + y * (37.5 + y * 459.375))));
    }
    float sum = 1.0, term = 1.0;
    for (int i = 1; i < 24; ++i) {
        term *= 0.25 * x * x / float(i * i);
        sum += term;
    }
    return log(sum);
}

float deon(float sin_i, float cos_i, float sin_r, float cos_r, float tilt, float spread, float norm)
{
    float v = 4.0 * spread * spread;
    float c = cos(2.0 * tilt), s = sin(2.0 * tilt);
    float sin_o = sin_r * c - cos_r * s, cos_o = abs(cos_r * c + sin_r * s);
    return exp(log_bessel(cos_i * cos_o / v) - sin_i * sin_o / v - norm);
}
