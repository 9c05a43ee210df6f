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
constexpr float lying_normal_z =
    0.7F;  ///< A plane whose normal leans up more than this lies rather than stands.

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

}  // namespace

Result<MarkPass> MarkPass::create() {
  MarkPass pass;
  struct Recipe {
    GlProgram* program;
    std::string_view name, vertex;
    std::vector<std::string_view> fragment;
  };
  const std::array recipes{Recipe{&pass.ring_, "ring", billboard_vertex_glsl, {ring_glsl}},
                           Recipe{&pass.plane_, "plane", plane_vertex_glsl, {emit_glsl, plane_glsl}}};
  for (const Recipe& recipe : recipes) {
    const std::array vertex{recipe.vertex};
    Result<GlProgram> program = GlProgram::build(recipe.name, vertex, recipe.fragment);
    if (!program) return program.error();
    *recipe.program = std::move(*program);
  }
  pass.no_vertices_ = GlVertexArray::create();
  Result<BallPass> balls = BallPass::create();
  if (!balls) return balls.error();
  pass.balls_ = std::move(*balls);
  Result<RibbonPass> ribbons = RibbonPass::create();
  if (!ribbons) return ribbons.error();
  pass.ribbons_ = std::move(*ribbons);
  return pass;
}

void MarkPass::draw_balls(const Frame& frame, const EyeUniforms& eye, Stage stage) {
  balls_.begin(eye, stage);
  for (const FingerMark& finger : frame.fingers) {
    if ((finger.opacity >= 1.0F) != (stage == Stage::opaque)) continue;
    balls_.draw({finger.position, fingertip_radius_m, finger.colour, finger.opacity});
  }
}

void MarkPass::draw_fingertips(const Frame& frame, const EyeUniforms& eye) {
  draw_balls(frame, eye, Stage::opaque);
}

void MarkPass::draw_curves(const Frame& frame, const EyeUniforms& eye) {
  if (frame.scene == nullptr) return;
  Ribbons lines;
  for (const auto& [id, entity] : frame.scene->entities) {
    if (entity->curves == nullptr) continue;
    const bool is_trimmed = frame.edges == SurfaceEdges::trimmed && entity->shows_surface();
    for (const SceneCurve& curve : *entity->curves) {
      if (is_trimmed && curve.kind == CurveKind::boundary) continue;  // The edge itself shows it.
      lines.add(curve.points, curve.closed, ribbon_style(curve.kind, curve.colour_rgba));
    }
  }
  ribbons_.draw(lines, eye, 1.0F);
}

void MarkPass::draw_transparent(const Frame& frame, const EyeUniforms& eye, Stage stage) {
  draw_balls(frame, eye, stage);
  if (!frame.symmetry) return;
  const glm::vec3 normal = frame.symmetry->normal;
  // A rectangle about where the plane passes nearest to the table's centre: its edges along the plane's trace
  // on the table and, within the plane, upwards. One that stands begins at the table; one that lies is
  // centred.
  const glm::vec3 base = glm::dot(frame.symmetry->origin, normal) * normal;
  glm::vec3 along = glm::cross(glm::vec3(0.0F, 0.0F, 1.0F), normal);
  along = glm::length(along) > 1e-3F ? glm::normalize(along) : glm::vec3(1.0F, 0.0F, 0.0F);
  glm::vec3 up = glm::normalize(glm::cross(normal, along));
  if (up.z < 0.0F) up = -up;
  const float below = std::abs(normal.z) < lying_normal_z ? 0.0F : 0.5F * plane_half_extent_m;
  plane_.use();
  set_common_uniforms(plane_, eye, stage);
  plane_.set("u_origin", base - below * up);
  plane_.set("u_along", along * plane_half_extent_m);
  plane_.set("u_up", up * plane_half_extent_m);
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
