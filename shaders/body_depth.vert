layout(location = 0) in vec3 position;
uniform mat4 light_matrix;
uniform mat3 head_rotation;

void main()
{
    gl_Position = light_matrix * vec4(head_rotation * position, 1.0);
}
