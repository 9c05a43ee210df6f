#include "client-hmd/render/mark_pass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace handloft::client {
namespace {

constexpr float fingertip_radius_m = 0.0045F;  ///< About the size of a coloured cap.
constexpr float ring_radius_m = 0.015F;        ///< Just wider than the most uncertain point (A2: 12.7 mm).
constexpr float plane_half_extent_m = 0.11F;
constexpr float ribbon_width_px = 2.5F;

constexpr std::string_view billboard_vertex_glsl = R"glsl(
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

constexpr std::string_view ball_glsl = R"glsl(
in vec2 corner;
in vec3 centre_in_eye;
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
uniform float u_reach;
uniform vec3 u_colour;
uniform float u_opacity;
void main() {
  float r2 = dot(corner, corner);
  if (r2 > 1.0) discard;
  vec3 in_eye_normal = vec3(corner, sqrt(1.0 - r2));
  vec3 surface = centre_in_eye + in_eye_normal * u_reach;
  vec4 clip = u_clip_from_eye * vec4(surface, 1.0);
  gl_FragDepth = clip.z / clip.w * 0.5 + 0.5;
  vec3 normal = transpose(mat3(u_eye_from_world)) * in_eye_normal;
  vec3 to_eye = transpose(mat3(u_eye_from_world)) * normalize(-surface);
  emit(studio_light(normal, to_eye, u_colour, 0.8), u_opacity, -surface.z);
}
)glsl";

constexpr std::string_view ring_glsl = R"glsl(
in vec2 corner;
layout(location = 0) out vec4 out_colour;
uniform float u_pressure;
uniform float u_pressing;
uniform float u_pixel;  // one pixel in units of the billboard's half side
void main() {
  float r = length(corner) * 1.1;
  float soft = 1.1 * u_pixel;
  float turn = atan(corner.x, corner.y) / 6.2831853;  // 0 at the top, clockwise
  turn = turn < 0.0 ? turn + 1.0 : turn;
  float track = 1.0 - smoothstep(0.035, 0.035 + soft, abs(r - 0.93));
  float arc = 1.0 - smoothstep(0.075, 0.075 + soft, abs(r - 0.93));
  float filled = u_pressure >= 0.999 ? 1.0 : 1.0 - smoothstep(u_pressure, u_pressure + 0.012, turn);
  filled *= step(0.004, u_pressure);
  vec3 ink = mix(vec3(0.02, 0.05, 0.10), vec3(0.80, 0.17, 0.03), u_pressing);
  float alpha = max(0.45 * track, arc * filled);
  float dot_alpha = (1.0 - smoothstep(0.07, 0.07 + soft, r)) * 0.8;
  vec3 colour = mix(vec3(0.02, 0.04, 0.08), ink, max(arc * filled, dot_alpha));
  alpha = max(alpha, dot_alpha);
  out_colour = vec4(colour, alpha);
}
)glsl";

constexpr std::string_view plane_vertex_glsl = R"glsl(
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
uniform vec3 u_origin;
uniform vec3 u_along;
uniform vec3 u_up;
out vec2 corner;
out float eye_depth;
void main() {
  corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  vec4 in_eye = u_eye_from_world * vec4(u_origin + corner.x * u_along + (corner.y * 0.5 + 0.5) * u_up, 1.0);
  eye_depth = -in_eye.z;
  gl_Position = u_clip_from_eye * in_eye;
}
)glsl";

constexpr std::string_view plane_glsl = R"glsl(
in vec2 corner;
in float eye_depth;
void main() {
  vec2 edge = abs(corner);
  vec2 pixel = fwidth(corner);
  vec2 line = smoothstep(1.0 - 2.2 * pixel, 1.0 - 1.0 * pixel, edge);
  float rim = max(line.x, line.y);
  emit(mix(vec3(0.10, 0.45, 0.42), vec3(0.02, 0.26, 0.25), rim), mix(0.07, 0.75, rim), eye_depth);
}
)glsl";

constexpr std::string_view ribbon_vertex_glsl = R"glsl(
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_next;
layout(location = 2) in float a_side;
layout(location = 3) in vec4 a_colour;
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
uniform vec2 u_viewport;
uniform float u_width_px;
out vec4 colour;
out float across;
out float eye_depth;
void main() {
  vec4 here = u_eye_from_world * vec4(a_position, 1.0);
  vec4 ahead = u_eye_from_world * vec4(a_next, 1.0);
  vec4 clip = u_clip_from_eye * here;
  vec4 clip_ahead = u_clip_from_eye * ahead;
  vec2 way = (clip_ahead.xy / max(clip_ahead.w, 1e-4) - clip.xy / max(clip.w, 1e-4)) * u_viewport;
  vec2 normal = length(way) > 1e-6 ? normalize(vec2(-way.y, way.x)) : vec2(0.0, 1.0);
  across = a_side;
  clip.xy += normal * a_side * (u_width_px + 1.0) / u_viewport * clip.w;
  colour = a_colour;
  eye_depth = -here.z;
  gl_Position = clip;
}
)glsl";

constexpr std::string_view ribbon_glsl = R"glsl(
in vec4 colour;
in float across;
in float eye_depth;
void main() { emit(pow(colour.rgb, vec3(2.2)), 1.0, eye_depth); }
)glsl";

struct RibbonVertex {
  Vec3f position, next;
  float side;
  std::array<float, 4> colour;
};

void append_ribbon(const SceneCurve& curve, std::vector<RibbonVertex>& out) {
  const std::size_t count = curve.points.size();
  if (count < 2) return;
  const auto channel = [&curve](unsigned shift) {
    return static_cast<float>((curve.colour_rgba >> shift) & 0xFFU) / 255.0F;
  };
  const std::array<float, 4> colour{channel(24), channel(16), channel(8), channel(0)};
  const std::size_t segments = curve.closed ? count : count - 1;
  for (std::size_t i = 0; i < segments; ++i) {
    const Vec3f& a = curve.points[i];
    const Vec3f& b = curve.points[(i + 1) % count];
    // The far end looks back, so that its side is mirrored.
    const RibbonVertex a_left{a, b, 1.0F, colour}, a_right{a, b, -1.0F, colour};
    const RibbonVertex b_left{b, a, -1.0F, colour}, b_right{b, a, 1.0F, colour};
    out.insert(out.end(), {a_left, a_right, b_left, b_left, a_right, b_right});
  }
}

}  // namespace

Result<MarkPass> MarkPass::create() {
  MarkPass pass;
  struct Recipe {
    GlProgram* program;
    std::string_view name, vertex;
    std::vector<std::string_view> fragment;
  };
  const std::array recipes{
      Recipe{&pass.ball_, "ball", billboard_vertex_glsl, {emit_glsl, studio_light_glsl, ball_glsl}},
      Recipe{&pass.ring_, "ring", billboard_vertex_glsl, {ring_glsl}},
      Recipe{&pass.plane_, "plane", plane_vertex_glsl, {emit_glsl, plane_glsl}},
      Recipe{&pass.ribbon_, "ribbon", ribbon_vertex_glsl, {emit_glsl, ribbon_glsl}}};
  for (const Recipe& recipe : recipes) {
    const std::array vertex{recipe.vertex};
    Result<GlProgram> program = GlProgram::build(recipe.name, vertex, recipe.fragment);
    if (!program) return program.error();
    *recipe.program = std::move(*program);
  }
  pass.no_vertices_ = GlVertexArray::create();
  pass.ribbon_array_ = GlVertexArray::create();
  pass.ribbon_buffer_ = GlBuffer::create();
  return pass;
}

void MarkPass::draw_balls(const Frame& frame, const EyeUniforms& eye, Stage stage) {
  ball_.use();
  set_common_uniforms(ball_, eye, stage);
  ball_.set("u_reach", fingertip_radius_m);
  glBindVertexArray(no_vertices_.id());
  for (const FingerMark& finger : frame.fingers) {
    if ((finger.opacity >= 1.0F) != (stage == Stage::opaque)) continue;
    ball_.set("u_centre", finger.position);
    ball_.set("u_colour", finger.colour);
    ball_.set("u_opacity", finger.opacity);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  }
}

void MarkPass::draw_opaque(const Frame& frame, const EyeUniforms& eye) {
  draw_balls(frame, eye, Stage::opaque);
  if (frame.scene == nullptr) return;
  std::vector<RibbonVertex> vertices;
  for (const auto& [id, entity] : frame.scene->entities) {
    if (entity->curves == nullptr) continue;
    for (const SceneCurve& curve : *entity->curves) append_ribbon(curve, vertices);
  }
  if (vertices.empty()) return;
  glBindVertexArray(ribbon_array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, ribbon_buffer_.id());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(RibbonVertex)),
               vertices.data(), GL_STREAM_DRAW);
  const auto attribute = [](GLuint index, GLint count, std::size_t at) {
    glEnableVertexAttribArray(index);
    glVertexAttribPointer(index, count, GL_FLOAT, GL_FALSE, sizeof(RibbonVertex),
                          reinterpret_cast<const void*>(at));
  };
  attribute(0, 3, offsetof(RibbonVertex, position));
  attribute(1, 3, offsetof(RibbonVertex, next));
  attribute(2, 1, offsetof(RibbonVertex, side));
  attribute(3, 4, offsetof(RibbonVertex, colour));
  ribbon_.use();
  set_common_uniforms(ribbon_, eye, Stage::opaque);
  ribbon_.set("u_viewport", eye.viewport_px);
  ribbon_.set("u_width_px", ribbon_width_px);
  glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(vertices.size()));
  glBindVertexArray(0);
}

void MarkPass::draw_transparent(const Frame& frame, const EyeUniforms& eye, Stage stage) {
  draw_balls(frame, eye, stage);
  if (!frame.symmetry) return;
  const glm::vec3 normal = frame.symmetry->normal;
  // A standing rectangle: along the plane's trace on the table, and upwards within the plane.
  glm::vec3 along = glm::cross(glm::vec3(0.0F, 0.0F, 1.0F), normal);
  along = glm::length(along) > 1e-3F ? glm::normalize(along) : glm::vec3(1.0F, 0.0F, 0.0F);
  const glm::vec3 up = glm::normalize(glm::cross(normal, along));
  plane_.use();
  set_common_uniforms(plane_, eye, stage);
  plane_.set("u_origin", frame.symmetry->origin);
  plane_.set("u_along", along * plane_half_extent_m);
  plane_.set("u_up", (up.z < 0.0F ? -up : up) * plane_half_extent_m);
  glBindVertexArray(no_vertices_.id());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

void MarkPass::draw_cursor(const Frame& frame, const EyeUniforms& eye) {
  if (!frame.pressure) return;
  const PressureMark& mark = *frame.pressure;
  const glm::vec4 in_eye = eye.eye_from_world * glm::vec4(mark.centre, 1.0F);
  if (in_eye.z > -0.01F) return;
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  ring_.use();
  ring_.set("u_eye_from_world", eye.eye_from_world);
  ring_.set("u_clip_from_eye", eye.clip_from_eye);
  ring_.set("u_centre", mark.centre);
  ring_.set("u_reach", ring_radius_m * 1.1F);
  ring_.set("u_pressure", std::clamp(mark.pressure, 0.0F, 1.0F));
  ring_.set("u_pressing", mark.pressing ? 1.0F : 0.0F);
  ring_.set("u_pixel", -in_eye.z / eye.focal_px / ring_radius_m);
  glBindVertexArray(no_vertices_.id());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glDisable(GL_BLEND);
}

}  // namespace handloft::client
