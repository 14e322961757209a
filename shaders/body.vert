layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 albedo_scalp; // linear albedo; how much hair grows here
layout(location = 3) in vec3 root_tangent; // of the hair that grows here
uniform mat4 view_projection;
uniform mat3 head_rotation;

out vec3 v_position, v_normal, v_tangent;
out vec4 v_albedo;

void main()
{
    v_position = head_rotation * position;
    v_normal = head_rotation * normal;
    v_tangent = head_rotation * root_tangent;
    v_albedo = albedo_scalp;
    gl_Position = view_projection * vec4(v_position, 1.0);
}
