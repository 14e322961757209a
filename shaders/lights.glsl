// Key (shadowed), fill and rim (on hair only with EACH_LIGHT), and a soft sky.
uniform vec3 key_direction, fill_direction, rim_direction; // towards the light, unit
uniform vec4 light_strength; // irradiance of the three, across their direction; radiance of the sky
#define KEY  light_strength.x
#define FILL light_strength.y
#define RIM  light_strength.z
#define SKY  light_strength.w
const float INV_PI = 0.31830988618;
