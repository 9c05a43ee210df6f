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
uniform int u_hand_before;       // There is a filmed hand: what is behind it is not seen.
uniform sampler2D u_hand_mask;   // Its coverage, and that times its depth.
uniform int u_behind_front;      // The nearest layer of surfaces is blended apart, exactly.
uniform int u_behind_veil;       // Surfaces were blended before, and fade what is behind them.
uniform sampler2D u_veil;        // Light that comes through them, and from which depth on (veil.h).
uniform vec2 u_depth_terms;      // Of the projection: clip z from eye z.

uniform float u_boost;  // Above 1: a fragment stands for so many (point_cells.h).
uniform float u_above;  // Where the eye of the coverage is over the table.

const float contact_m = 0.015;  // What is nearer to the table than that seems to touch it.
const float as_good_as_opaque = 0.985;

// Of layers: what other layers have or something opaque hides. Before anything is computed that costs.
void skip_what_is_drawn() {
  if (u_stage != 2 && (u_stage != 1 || u_behind_front == 0)) return;
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  if (gl_FragCoord.z <= texelFetch(u_last_depth, pixel, 0).r) discard;
  if (u_stage == 2 && gl_FragCoord.z >= texelFetch(u_opaque_depth, pixel, 0).r) discard;
}

void emit(vec3 colour, float alpha, float eye_depth) {
  skip_what_is_drawn();
  out_weight = vec4(0.0);
  if (u_stage == 0) {
    if (alpha < as_good_as_opaque) discard;
    out_colour = vec4(colour, 1.0);
    return;
  }
  if (u_stage == 3) {
    float height = max(u_above - eye_depth, 0.0);
    out_colour = vec4(alpha, alpha * exp(-height / contact_m), alpha * height, alpha);
    return;
  }
  if (u_stage == 4) {
    if (alpha < 0.5) discard;
    out_colour = vec4(0.0);
    return;
  }
  if (alpha >= as_good_as_opaque) discard;
  if (u_hand_before != 0) {
    vec2 mask = texelFetch(u_hand_mask, ivec2(gl_FragCoord.xy), 0).rg;
    float behind = mask.x > 0.004 ? smoothstep(-0.006, 0.006, eye_depth - mask.y / mask.x) : 0.0;
    alpha *= 1.0 - smoothstep(0.15, 0.85, mask.x) * behind;
  }
  if (u_stage == 1 && u_behind_veil != 0) {
    // By the near side: a fuzzy point that lies on a surface is before it.
    float near_side = u_depth_terms.y / (u_depth_terms.x + gl_FragCoord.z * 2.0 - 1.0);
    vec2 veil = texelFetch(u_veil, ivec2(gl_FragCoord.xy), 0).rg;
    alpha *= mix(1.0, veil.x, smoothstep(0.0, 0.004, near_side - veil.y));
  }
  if (alpha < 1.0 / 512.0) discard;
  if (u_stage == 1) {
    float from = u_weights.x;
    if (u_behind_front != 0) {
      float front = texelFetch(u_last_depth, ivec2(gl_FragCoord.xy), 0).r;
      from += u_depth_terms.y / (u_depth_terms.x + front * 2.0 - 1.0);
    }
    float weight = alpha * clamp(exp(-(eye_depth - from) / u_weights.y), u_weights.z, u_weights.w);
    out_colour = vec4(colour * weight, u_boost > 1.0 ? 1.0 - pow(1.0 - alpha, u_boost) : alpha);
    out_weight = vec4(weight, alpha * alpha, alpha * alpha * eye_depth, 0.0);
    return;
  }
  out_colour = vec4(colour * alpha, alpha);
}
)glsl";

// A photographer's studio for products: grey walls, a pale floor, a long softbox overhead, a tall strip on
// the left and a cooler one behind on the right. All of it is formulas: no picture is loaded. Reflections in
// the lamps' straight edges are what tells a surface's curvature.
const std::string_view studio_light_glsl = R"glsl(
float slab(float x, float half_width, float soft) {
  return smoothstep(-half_width - soft, -half_width + soft, x) - smoothstep(half_width - soft, half_width + soft, x);
}
// What is seen of a flat lamp at distance 1 in the direction `to_lamp`; `blur`: how rough the mirror is.
float softbox(vec3 d, vec3 to_lamp, vec3 across, vec2 half_size, float blur) {
  float facing = dot(d, to_lamp);
  vec2 at = vec2(dot(d, across), dot(d, cross(to_lamp, across))) / max(facing, 0.08);
  float soft = 0.035 + blur;
  return slab(at.x, half_size.x, soft) * slab(at.y, half_size.y, soft) * smoothstep(0.0, 0.25, facing);
}
vec3 room(vec3 d, float blur) {
  vec3 walls = mix(vec3(0.50, 0.51, 0.53), vec3(0.17, 0.18, 0.205), smoothstep(-0.05, 0.85, d.z));
  vec3 ground = mix(vec3(0.46, 0.455, 0.445), vec3(0.15, 0.147, 0.143), smoothstep(0.0, 0.75, -d.z));
  vec3 light = mix(ground, walls, smoothstep(-0.10 - blur, 0.10 + blur, d.z));
  // All around at the height of a lamp on a stand: what stands upright mirrors it.
  light += vec3(0.80, 0.81, 0.83) * slab(d.z - 0.30, 0.085, 0.03 + 0.6 * blur);
  light += vec3(2.30, 2.27, 2.20) * softbox(d, vec3(-0.1094, -0.1203, 0.9867), vec3(0.9940, 0.0, 0.1102), vec2(0.42, 1.35), blur);
  light += vec3(1.45, 1.47, 1.50) * softbox(d, vec3(-0.9113, -0.1519, 0.3828), vec3(-0.1644, 0.9864, 0.0), vec2(0.13, 0.62), blur);
  light += vec3(1.15, 1.25, 1.40) * softbox(d, vec3(0.8018, 0.4811, 0.3546), vec3(0.5145, -0.8575, 0.0), vec2(0.20, 0.62), blur);
  return light;
}
// What falls on a matt surface from all of the room; `sky`: the share of the upper half that is open to it,
// `ground`: that of the light which comes back from the table.
vec3 fill(vec3 n, float sky, float ground) {
  float up = n.z * 0.5 + 0.5;
  vec3 light = mix(vec3(0.30, 0.292, 0.285) * ground, vec3(0.46, 0.475, 0.50) * sky, up);
  float over = max((dot(n, vec3(-0.20, -0.34, 0.919)) + 0.20) / 1.20, 0.0);
  float left = max(dot(n, vec3(-0.9113, -0.1519, 0.3828)), 0.0);
  float behind = max(dot(n, vec3(0.8018, 0.4811, 0.3546)), 0.0);
  light += vec3(0.72, 0.71, 0.69) * over * over * mix(0.35, 1.0, sky);
  light += vec3(0.15, 0.152, 0.155) * left + vec3(0.08, 0.095, 0.12) * behind;
  return light;
}
float fresnel(float facing, float straight) {
  return straight + (1.0 - straight) * pow(1.0 - clamp(facing, 0.0, 1.0), 5.0);
}
// A satin shell under a thin clear coat. `gloss` 0: matt.
vec3 satin(vec3 normal, vec3 to_eye, vec3 base, float gloss, float sky, float ground) {
  vec3 colour = base * fill(normal, sky, ground);
  if (gloss <= 0.0) return colour;
  vec3 mirrored = reflect(-to_eye, normal);
  float facing = dot(normal, to_eye);
  float open = mix(0.4, 1.0, sky);
  // The sheen comes from the pigment, the coat from the clear lacquer over it.
  vec3 sheen = room(mirrored, 0.40) * mix(base, vec3(1.0), 0.25) * (0.055 + 0.14 * fresnel(facing, 0.0));
  vec3 coat = room(mirrored, 0.035) * (0.62 * fresnel(facing, 0.055));
  return colour + gloss * open * (sheen + coat);
}
vec3 studio_light(vec3 normal, vec3 to_eye, vec3 base, float gloss) {
  return satin(normal, to_eye, base, gloss, 1.0, 1.0);
}
)glsl";

}  // namespace handloft::client
