#include "client-hmd/render/shaders.h"

namespace handloft::client {

const std::string_view fullscreen_vertex_glsl = R"glsl(
out vec2 uv;
void main() {
  uv = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
  gl_Position = vec4(uv * 2.0 - 1.0, 0.0, 1.0);
}
)glsl";

const std::string_view billboard_vertex_glsl = R"glsl(
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
uniform vec3 u_centre;
uniform float u_reach;
out vec2 corner;
out vec3 centre_in_eye;
void main() {
  corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  centre_in_eye = (u_eye_from_world * vec4(u_centre, 1.0)).xyz;
  gl_Position = u_clip_from_eye * vec4(centre_in_eye + vec3(corner * u_reach, 0.0), 1.0);
}
)glsl";

const std::string_view emit_glsl = R"glsl(
layout(location = 0) out vec4 out_colour;
layout(location = 1) out vec4 out_weight;
uniform int u_stage;
uniform vec4 u_weights;  // reference, falloff, smallest, largest (transparency.h)
uniform sampler2D u_opaque_depth;
uniform sampler2D u_last_depth;

const float as_good_as_opaque = 0.985;

void emit(vec3 colour, float alpha, float eye_depth) {
  out_weight = vec4(0.0);
  if (u_stage == 0) {
    if (alpha < as_good_as_opaque) discard;
    out_colour = vec4(colour, 1.0);
    return;
  }
  if (u_stage == 3) {
    out_colour = vec4(alpha);
    return;
  }
  if (u_stage == 4) {
    if (alpha < 0.5) discard;
    out_colour = vec4(0.0);
    return;
  }
  if (alpha >= as_good_as_opaque || alpha < 1.0 / 512.0) discard;
  if (u_stage == 1) {
    float weight = alpha * clamp(exp(-(eye_depth - u_weights.x) / u_weights.y), u_weights.z, u_weights.w);
    out_colour = vec4(colour * weight, alpha);
    out_weight = vec4(weight);
    return;
  }
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  if (gl_FragCoord.z >= texelFetch(u_opaque_depth, pixel, 0).r) discard;
  if (gl_FragCoord.z <= texelFetch(u_last_depth, pixel, 0).r) discard;
  out_colour = vec4(colour * alpha, alpha);
}
)glsl";

// Lamps as in a car designer's studio: a bright sky, a warm floor, one key light, and a ceiling of long soft
// strips whose reflections flow over the surface and break where its curvature does.
const std::string_view studio_light_glsl = R"glsl(
float soft_strip(float x, float half_width, float softness) {
  return 1.0 - smoothstep(half_width - softness, half_width + softness, abs(x));
}
vec3 studio_light(vec3 normal, vec3 to_eye, vec3 base, float gloss) {
  vec3 key = normalize(vec3(-0.45, -0.50, 0.74));
  vec3 fill = normalize(vec3(0.75, -0.35, 0.35));
  float up = normal.z * 0.5 + 0.5;
  vec3 ambient = mix(vec3(0.26, 0.245, 0.235), vec3(0.50, 0.53, 0.57), up);
  float wrapped = max((dot(normal, key) + 0.25) / 1.25, 0.0);
  float side = max(dot(normal, fill), 0.0);
  vec3 colour = base * (ambient + vec3(0.80, 0.78, 0.74) * wrapped * wrapped + vec3(0.10, 0.12, 0.16) * side);
  vec3 mirrored = reflect(-to_eye, normal);
  float above = smoothstep(0.02, 0.30, mirrored.z);
  vec2 ceiling = mirrored.xy / max(mirrored.z, 0.05);
  float strips = soft_strip(ceiling.x + 0.15, 0.26, 0.12) + 0.7 * soft_strip(ceiling.x - 0.95, 0.16, 0.10) +
                 0.7 * soft_strip(ceiling.x + 1.25, 0.16, 0.10);
  strips *= soft_strip(ceiling.y, 2.2, 0.8) * above;
  float grazing = pow(1.0 - clamp(dot(normal, to_eye), 0.0, 1.0), 5.0);
  float fresnel = 0.05 + 0.55 * grazing;
  vec3 half_way = normalize(key + to_eye);
  float glint = pow(max(dot(normal, half_way), 0.0), 90.0);
  colour += gloss * (vec3(1.0, 0.99, 0.97) * strips * (0.10 + 0.8 * fresnel) + vec3(0.45) * glint +
                     vec3(0.75, 0.80, 0.86) * fresnel * 0.45 * (mirrored.z * 0.5 + 0.5));
  return colour;
}
)glsl";

}  // namespace handloft::client
