#include "client-hmd/render/ribbon_pass.h"

#include <array>
#include <cmath>
#include <cstddef>

#include "client-hmd/render/surface_pass.h"

namespace handloft::client {
namespace {

constexpr std::string_view vertex_glsl = R"glsl(
layout(location = 0) in vec3 a_before;
layout(location = 1) in vec3 a_position;
layout(location = 2) in vec3 a_after;
layout(location = 3) in vec3 a_place;  // side, cap, along
layout(location = 4) in vec3 a_style;  // width, dash, edge
layout(location = 5) in vec3 a_colour;
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
uniform vec2 u_viewport;
out vec3 colour;
noperspective out vec2 at_px;   // across the line, and beyond its end
noperspective out float along;
flat out vec3 style;            // half the width in pixels, dash, edge

const float nearest_m = 0.005;
vec2 screen(vec3 in_eye) {
  vec4 clip = u_clip_from_eye * vec4(in_eye.xy, min(in_eye.z, -nearest_m), 1.0);
  return clip.xy / clip.w * 0.5 * u_viewport;
}
vec2 way(vec2 from, vec2 to, vec2 otherwise) {
  vec2 step = to - from;
  return length(step) > 1e-4 ? normalize(step) : otherwise;
}
void main() {
  vec3 here = (u_eye_from_world * vec4(a_position, 1.0)).xyz;
  // 1.5 mm nearer along the line of sight: a stroke along a surface lies on it, not half in it.
  here *= 1.0 - min(0.0015 / max(length(here), 1e-4), 0.5);
  vec2 middle = screen(here);
  vec2 before = screen((u_eye_from_world * vec4(a_before, 1.0)).xyz);
  vec2 after = screen((u_eye_from_world * vec4(a_after, 1.0)).xyz);
  vec2 out_way = way(middle, after, vec2(0.0));
  vec2 in_way = way(before, middle, out_way);
  if (out_way == vec2(0.0)) out_way = in_way;
  if (out_way == vec2(0.0)) out_way = in_way = vec2(1.0, 0.0);
  vec2 left = vec2(-in_way.y, in_way.x);
  vec2 both = left + vec2(-out_way.y, out_way.x);
  vec2 mitre = length(both) > 1e-3 ? normalize(both) : left;
  float half_px = 0.5 * max(a_style.x * u_viewport.y / 720.0, 1.5);
  float reach = half_px + 1.0;  // One more for the soft edge.
  float longer = 1.0 / max(dot(mitre, left), 0.45);
  vec2 offset = mitre * a_place.x * reach * longer + (a_place.y < 0.0 ? in_way : out_way) * a_place.y * reach;
  vec4 clip = u_clip_from_eye * vec4(here, 1.0);
  clip.xy += offset / (0.5 * u_viewport) * clip.w;
  colour = a_colour;
  at_px = vec2(a_place.x, abs(a_place.y)) * reach;
  along = a_place.z;
  style = vec3(half_px, a_style.yz);
  gl_Position = clip;
}
)glsl";

constexpr std::string_view fragment_glsl = R"glsl(
in vec3 colour;
noperspective in vec2 at_px;
noperspective in float along;
flat in vec3 style;
layout(location = 0) out vec4 out_colour;
uniform float u_opacity;
void main() {
  float off = length(at_px);
  float cover = 1.0 - smoothstep(style.x - 0.5, style.x + 0.5, off);
  if (style.y > 0.0) {
    // Dashes take 0.6 of their length; their ends are as soft as the sides.
    float share = abs(fract(along / style.y) - 0.3) - 0.3;
    float pixel = max(fwidth(along) / style.y, 1e-5);
    if (share < 0.5) cover *= 1.0 - smoothstep(-0.5 * pixel, 0.5 * pixel, share);
  }
  if (cover < 0.02) discard;
  float rim = style.x * (1.0 - style.z);
  float in_edge = style.z > 0.0 ? smoothstep(rim - 0.5, rim + 0.5, off) : 0.0;
  out_colour = vec4(mix(colour, vec3(0.95), in_edge), u_opacity * cover);
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
      style = {{0.80F, 0.12F, 0.015F}, 8.0F, 0.0F, 0.32F};
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
  const auto at = [&](std::size_t i) -> const Vec3f& { return points[i % count]; };
  const auto vertex = [&](std::size_t i, float side, float cap, float along) {
    const bool first = !closed && i == 0, last = !closed && i + 1 == count;
    return Vertex{first ? at(i) : at(i + count - 1),
                  at(i),
                  last ? at(i) : at(i + 1),
                  side,
                  cap,
                  along,
                  style.width,
                  style.dash_m,
                  style.edge,
                  style.colour};
  };
  const auto quad = [this](const Vertex& a_left, const Vertex& a_right, const Vertex& b_left,
                           const Vertex& b_right) {
    vertices_.insert(vertices_.end(), {a_left, a_right, b_left, b_left, a_right, b_right});
  };
  const auto cap = [&](std::size_t i, float way, float along) {
    quad(vertex(i, 1.0F, 0.0F, along), vertex(i, -1.0F, 0.0F, along), vertex(i, 1.0F, way, along),
         vertex(i, -1.0F, way, along));
  };
  float along = 0.0F;
  if (!closed) cap(0, -1.0F, along);
  for (std::size_t i = 0; i < segments; ++i) {
    const Vec3f& a = at(i);
    const Vec3f& b = at(i + 1);
    const float there = along + std::hypot(b.x - a.x, b.y - a.y, b.z - a.z);
    quad(vertex(i, 1.0F, 0.0F, along), vertex(i, -1.0F, 0.0F, along), vertex(i + 1, 1.0F, 0.0F, there),
         vertex(i + 1, -1.0F, 0.0F, there));
    along = there;
  }
  if (!closed) cap(count - 1, 1.0F, along);
}

void Ribbons::add_segment(const glm::vec3& from, const glm::vec3& to, const RibbonStyle& style) {
  const std::array<Vec3f, 2> points{Vec3f{from.x, from.y, from.z}, Vec3f{to.x, to.y, to.z}};
  add(points, false, style);
}

Result<RibbonPass> RibbonPass::create() {
  RibbonPass pass;
  const std::array vertex{vertex_glsl};
  const std::array fragment{fragment_glsl};
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
  attribute(0, 3, offsetof(Ribbons::Vertex, before));
  attribute(1, 3, offsetof(Ribbons::Vertex, position));
  attribute(2, 3, offsetof(Ribbons::Vertex, after));
  attribute(3, 3, offsetof(Ribbons::Vertex, side));
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
  const GLboolean was_blending = glIsEnabled(GL_BLEND);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(ribbons.vertices_.size()));
  if (was_blending == GL_FALSE) glDisable(GL_BLEND);
  glBindVertexArray(0);
}

}  // namespace handloft::client
