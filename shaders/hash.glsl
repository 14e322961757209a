// PCG hash; the same bits on every driver.
uint hash(uint n)
{
    uint s = n * 747796405u + 2891336453u;
    uint w = ((s >> ((s >> 28u) + 4u)) ^ s) * 277803737u;
    return (w >> 22u) ^ w;
}
