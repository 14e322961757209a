// Key (shadowed), fill and rim (not: more than one shadowed light is left out on purpose), and a soft
// sky. Irradiances follow the three-light set-up of a photographer: 3 : 0.6 : 2.
uniform vec3 key_direction, fill_direction, rim_direction; // towards the light, unit
const float KEY = 3.0, FILL = 0.6, RIM = 2.0, SKY = 0.25;
const float INV_PI = 0.31830988618;
