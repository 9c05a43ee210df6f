#include "client-hmd/render/ribbon_pass.h"

#include <array>
#include <cmath>
#include <cstddef>

#include "client-hmd/render/surface_pass.h"

namespace handloft::client {
namespace {

constexpr std::string_view vertex_glsl = R"glsl(
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_next;
layout(location = 2) in float a_side;
layout(location = 3) in float a_along;
layout(location = 4) in vec3 a_style;  // width, dash, edge
layout(location = 5) in vec3 a_colour;
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
uniform vec2 u_viewport;
out vec3 colour;
out float across;
out float along;
flat out vec2 style;
out float eye_depth;
void main() {
  vec4 here = u_eye_from_world * vec4(a_position, 1.0);
  // 1.5 mm nearer along the line of sight: a stroke along a surface lies on it, not half in it.
  here.xyz *= 1.0 - min(0.0015 / max(length(here.xyz), 1e-4), 0.5);
  vec4 ahead = u_eye_from_world * vec4(a_next, 1.0);
  vec4 clip = u_clip_from_eye * here;
  vec4 clip_ahead = u_clip_from_eye * ahead;
  vec2 way = (clip_ahead.xy / max(clip_ahead.w, 1e-4) - clip.xy / max(clip.w, 1e-4)) * u_viewport;
  vec2 normal = length(way) > 1e-6 ? normalize(vec2(-way.y, way.x)) : vec2(0.0, 1.0);
  float width_px = max(a_style.x * u_viewport.y / 720.0, 1.5);
  across = a_side;
  along = a_along;
  clip.xy += normal * a_side * width_px / u_viewport * clip.w;
  colour = a_colour;
  style = a_style.yz;
  eye_depth = -here.z;
  gl_Position = clip;
}
)glsl";

constexpr std::string_view fragment_glsl = R"glsl(
in vec3 colour;
in float across;
in float along;
flat in vec2 style;  // dash, edge
in float eye_depth;
uniform float u_opacity;
void main() {
  if (style.x > 0.0 && fract(along / style.x) > 0.6) discard;
  float pixel = fwidth(across);
  float in_edge = style.y > 0.0 ? smoothstep(1.0 - style.y - 0.5 * pixel, 1.0 - style.y + 0.5 * pixel, abs(across)) : 0.0;
  vec3 ink = mix(colour, vec3(0.95), in_edge);
  if (u_opacity < 1.0) {
    out_weight = vec4(0.0);
    out_colour = vec4(ink, u_opacity);
    return;
  }
  emit(ink, 1.0, eye_depth);
}
)glsl";

/// Dashes of 6 mm and gaps of 4 mm: several of both on the smallest face that is worth trimming.
constexpr float boundary_dash_m = 0.010F;

float linear(std::uint32_t rgba, unsigned shift) {
  return std::pow(static_cast<float>(rgba >> shift & 0xFFU) / 255.0F, 2.2F);
}

}  // namespace

RibbonStyle ribbon_style(CurveKind kind, std::uint32_t colour_rgba) {
  RibbonStyle style;
  switch (kind) {
    case CurveKind::curve:
      style = {{0.02F, 0.035F, 0.07F}, 2.5F, 0.0F, 0.0F};
      break;
    case CurveKind::profile:
      style = {{0.80F, 0.12F, 0.015F}, 6.5F, 0.0F, 0.32F};
      break;
    case CurveKind::boundary:
      style = {{0.005F, 0.20F, 0.24F}, 3.0F, boundary_dash_m, 0.0F};
      break;
  }
  if (colour_rgba != 0) {
    style.colour = {linear(colour_rgba, 24), linear(colour_rgba, 16), linear(colour_rgba, 8)};
  }
  return style;
}

void Ribbons::add(std::span<const Vec3f> points, bool closed, const RibbonStyle& style) {
  const std::size_t count = points.size();
  if (count < 2) return;
  const std::size_t segments = closed ? count : count - 1;
  float along = 0.0F;
  for (std::size_t i = 0; i < segments; ++i) {
    const Vec3f& a = points[i];
    const Vec3f& b = points[(i + 1) % count];
    const float there = along + std::hypot(b.x - a.x, b.y - a.y, b.z - a.z);
    const auto vertex = [&style](const Vec3f& at, const Vec3f& next, float side, float distance) {
      return Vertex{at, next, side, distance, style.width, style.dash_m, style.edge, style.colour};
    };
    // Both ends look the same way, so that what is left stays left.
    const Vec3f beyond{2 * b.x - a.x, 2 * b.y - a.y, 2 * b.z - a.z};
    const Vertex a_left = vertex(a, b, 1.0F, along), a_right = vertex(a, b, -1.0F, along);
    const Vertex b_left = vertex(b, beyond, 1.0F, there), b_right = vertex(b, beyond, -1.0F, there);
    vertices_.insert(vertices_.end(), {a_left, a_right, b_left, b_left, a_right, b_right});
    along = there;
  }
}

void Ribbons::add_segment(const glm::vec3& from, const glm::vec3& to, const RibbonStyle& style) {
  const std::array<Vec3f, 2> points{Vec3f{from.x, from.y, from.z}, Vec3f{to.x, to.y, to.z}};
  add(points, false, style);
}

Result<RibbonPass> RibbonPass::create() {
  RibbonPass pass;
  const std::array vertex{vertex_glsl};
  const std::array fragment{emit_glsl, fragment_glsl};
  Result<GlProgram> program = GlProgram::build("ribbon", vertex, fragment);
  if (!program) return program.error();
  pass.program_ = std::move(*program);
  pass.array_ = GlVertexArray::create();
  pass.buffer_ = GlBuffer::create();
  glBindVertexArray(pass.array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, pass.buffer_.id());
  const auto attribute = [](GLuint index, GLint count, std::size_t at) {
    glEnableVertexAttribArray(index);
    glVertexAttribPointer(index, count, GL_FLOAT, GL_FALSE, sizeof(Ribbons::Vertex),
                          reinterpret_cast<const void*>(at));
  };
  attribute(0, 3, offsetof(Ribbons::Vertex, position));
  attribute(1, 3, offsetof(Ribbons::Vertex, next));
  attribute(2, 1, offsetof(Ribbons::Vertex, side));
  attribute(3, 1, offsetof(Ribbons::Vertex, along_m));
  attribute(4, 3, offsetof(Ribbons::Vertex, width));
  attribute(5, 3, offsetof(Ribbons::Vertex, colour));
  glBindVertexArray(0);
  return pass;
}

void RibbonPass::draw(const Ribbons& ribbons, const EyeUniforms& eye, float opacity) const {
  if (ribbons.empty()) return;
  glBindVertexArray(array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, buffer_.id());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(ribbons.vertices_.size() * sizeof(Ribbons::Vertex)),
               ribbons.vertices_.data(), GL_STREAM_DRAW);
  program_.use();
  set_common_uniforms(program_, eye, Stage::opaque);
  program_.set("u_viewport", eye.viewport_px);
  program_.set("u_opacity", opacity);
  glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(ribbons.vertices_.size()));
  glBindVertexArray(0);
}

}  // namespace handloft::client
