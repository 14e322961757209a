// No shadows of hair; the head's map stays empty.
float hair_transmittance(vec3 position)
{
    return 1.0;
}

float hair_transmittance_wide(vec3 position, int taps)
{
    return 1.0;
}
