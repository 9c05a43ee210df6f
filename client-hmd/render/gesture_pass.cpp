#include "client-hmd/render/gesture_pass.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace handloft::client {
namespace {

/// Opacity, as a share, of what is behind something.
constexpr float hidden_share = 0.30F;
/// A disk of no radius still shows where it is.
constexpr float smallest_disk_m = 0.002F;
/// Room for the ring of the range outside the disk, in radii.
constexpr float disk_reach = 1.45F;
/// The normal's arrow: as long as the disk's radius, within these.
constexpr float shortest_arrow_m = 0.02F, longest_arrow_m = 0.05F;
constexpr float arrow_head_share = 0.28F, arrow_head_width_share = 0.16F;
constexpr RibbonStyle arrow_style{{0.50F, 0.05F, 0.005F}, 5.0F, 0.0F, 0.25F};
/// Brackets: an eighth of the box's edges, a little outside.
constexpr float bracket_share = 0.16F, bracket_gap_m = 0.004F, longest_bracket_m = 0.02F;
constexpr RibbonStyle bracket_style{{0.75F, 0.15F, 0.005F}, 5.5F, 0.0F, 0.25F};
/// From the boundary's last point back to its first: where it would be closed (A24).
constexpr RibbonStyle closing_style{{0.005F, 0.20F, 0.24F}, 2.0F, 0.004F, 0.0F};
/// Where the contour of a surface is (A26); what is fainter is no part of its box.
constexpr float shown_opacity = 0.5F;

constexpr std::string_view disk_vertex_glsl = R"glsl(
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
uniform vec3 u_centre;
uniform vec3 u_along;   // of the disk's plane, as long as its radius
uniform vec3 u_across;
uniform float u_reach;
out vec2 at;
void main() {
  at = (vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0) * u_reach;
  gl_Position = u_clip_from_eye * u_eye_from_world * vec4(u_centre + at.x * u_along + at.y * u_across, 1.0);
}
)glsl";

// A ruled face (rings at thirds), a firm rim, and outside it a gauge: as much of the ring is bold as the
// range is of its largest.
constexpr std::string_view disk_fragment_glsl = R"glsl(
in vec2 at;
layout(location = 0) out vec4 out_colour;
uniform float u_range;
uniform float u_opacity;
float band(float r, float middle, float half_width, float pixel) {
  return 1.0 - smoothstep(half_width - pixel, half_width + pixel, abs(r - middle));
}
void main() {
  float r = length(at);
  float pixel = max(fwidth(r), 1e-5);
  float inside = 1.0 - smoothstep(1.0 - pixel, 1.0 + pixel, r);
  float rim = band(r, 1.0, max(0.035, 1.2 * pixel), 0.6 * pixel);
  float rings = max(band(r, 1.0 / 3.0, 0.012, pixel), band(r, 2.0 / 3.0, 0.012, pixel));
  float turn = atan(at.x, at.y) / 6.2831853;
  turn = turn < 0.0 ? turn + 1.0 : turn;
  float filled = u_range >= 0.999 ? 1.0 : 1.0 - step(u_range, turn);
  filled *= step(0.004, u_range);
  float gauge = band(r, 1.25, mix(max(0.02, 0.8 * pixel), max(0.085, 2.0 * pixel), filled), 0.6 * pixel);
  vec3 face_colour = vec3(0.93, 0.32, 0.06);
  vec3 ink = vec3(0.50, 0.05, 0.005);
  vec3 gauge_colour = mix(vec3(0.04, 0.06, 0.10), vec3(0.02, 0.13, 0.42), filled);
  float alpha = 0.30 * inside;
  vec3 colour = face_colour;
  colour = mix(colour, ink, max(rim, 0.6 * rings * inside));
  alpha = max(alpha, max(0.95 * rim, 0.5 * rings * inside));
  float gauge_alpha = gauge * mix(0.55, 0.95, filled);
  colour = mix(colour, gauge_colour, gauge_alpha * (1.0 - rim));
  alpha = max(alpha, gauge_alpha);
  out_colour = vec4(colour, alpha * u_opacity);
}
)glsl";

glm::vec3 vec(const Vec3f& v) {
  return {v.x, v.y, v.z};
}

struct Axes {
  glm::vec3 along, across;
};

Axes axes_of(const glm::vec3& normal) {
  const glm::vec3 helper =
      std::abs(normal.z) < 0.9F ? glm::vec3(0.0F, 0.0F, 1.0F) : glm::vec3(0.0F, 1.0F, 0.0F);
  const glm::vec3 along = glm::normalize(glm::cross(helper, normal));
  return {along, glm::cross(normal, along)};
}

void add_arrow(const DiskHint& disk, const glm::vec3& eye, Ribbons& out) {
  const float length = std::clamp(disk.radius_m, shortest_arrow_m, longest_arrow_m);
  const glm::vec3 tip = disk.centre + length * disk.normal;
  // The head lies flat before the eye; seen from straight behind, any direction will do.
  glm::vec3 side = glm::cross(disk.normal, eye - tip);
  side = glm::length(side) > 1e-6F ? glm::normalize(side) : axes_of(disk.normal).along;
  const glm::vec3 base = tip - arrow_head_share * length * disk.normal;
  const glm::vec3 reach = arrow_head_width_share * length * side;
  out.add_segment(disk.centre, tip, arrow_style);
  out.add_segment(tip, base + reach, arrow_style);
  out.add_segment(tip, base - reach, arrow_style);
}

void add_brackets(const Box& box, Ribbons& out) {
  const glm::vec3 low = box.low - bracket_gap_m, high = box.high + bracket_gap_m;
  const glm::vec3 reach = glm::min(bracket_share * (high - low), glm::vec3(longest_bracket_m));
  for (unsigned corner = 0; corner < 8; ++corner) {
    const glm::bvec3 upper((corner & 1U) != 0, (corner & 2U) != 0, (corner & 4U) != 0);
    const glm::vec3 from = glm::mix(low, high, upper);
    for (int axis = 0; axis < 3; ++axis) {
      glm::vec3 to = from;
      to[axis] += upper[axis] ? -reach[axis] : reach[axis];
      out.add_segment(from, to, bracket_style);
    }
  }
}

void add_air_curve(const SceneCurve& curve, Ribbons& out) {
  out.add(curve.points, curve.closed, ribbon_style(curve.kind, curve.colour_rgba));
  if (curve.kind == CurveKind::boundary && !curve.closed && curve.points.size() > 2) {
    out.add_segment(vec(curve.points.back()), vec(curve.points.front()), closing_style);
  }
}

}  // namespace

std::optional<Box> shown_box(const Entity& entity) {
  constexpr float far = std::numeric_limits<float>::infinity();
  Box box{glm::vec3(far), glm::vec3(-far)};
  const auto take = [&box](const Vec3f& p) {
    box.low = glm::min(box.low, vec(p));
    box.high = glm::max(box.high, vec(p));
  };
  if (entity.shows_points()) {
    for (const FuzzyPoint& point : entity.points->points) take(point.position);
  }
  if (entity.shows_surface()) {
    for (const SurfaceVertex& vertex : entity.surface->vertices) {
      if (vertex.opacity >= shown_opacity) take(vertex.position);
    }
  }
  if (!(box.low.x <= box.high.x)) return std::nullopt;
  return box;
}

Result<GesturePass> GesturePass::create() {
  GesturePass pass;
  const std::array vertex{disk_vertex_glsl};
  const std::array fragment{disk_fragment_glsl};
  Result<GlProgram> program = GlProgram::build("disk", vertex, fragment);
  if (!program) return program.error();
  pass.disk_ = std::move(*program);
  Result<RibbonPass> ribbons = RibbonPass::create();
  if (!ribbons) return ribbons.error();
  pass.ribbons_ = std::move(*ribbons);
  pass.no_vertices_ = GlVertexArray::create();
  return pass;
}

void GesturePass::update(const Scene& scene) {
  targets_.clear();
  for (const auto& [id, entity] : scene.entities) {
    if (!entity->target) continue;
    if (const std::optional<Box> box = shown_box(*entity)) targets_.push_back(*box);
  }
}

void GesturePass::draw_disks(const Frame& frame, const EyeUniforms& eye, float opacity) const {
  disk_.use();
  disk_.set("u_eye_from_world", eye.eye_from_world);
  disk_.set("u_clip_from_eye", eye.clip_from_eye);
  disk_.set("u_reach", disk_reach);
  disk_.set("u_opacity", opacity);
  glBindVertexArray(no_vertices_.id());
  for (const DiskHint& disk : frame.disks) {
    const float radius = std::max(disk.radius_m, smallest_disk_m);
    const Axes axes = axes_of(disk.normal);
    disk_.set("u_centre", disk.centre);
    disk_.set("u_along", axes.along * radius);
    disk_.set("u_across", axes.across * radius);
    disk_.set("u_range", std::clamp(disk.range, 0.0F, 1.0F));
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  }
}

void GesturePass::draw(const Frame& frame, const EyeUniforms& eye) const {
  Ribbons lines;
  for (const Box& box : targets_) add_brackets(box, lines);
  for (const auto& curve : frame.air_curves) add_air_curve(*curve, lines);
  for (const DiskHint& disk : frame.disks) add_arrow(disk, eye.position, lines);
  if (lines.empty()) return;
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_FALSE);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  for (const auto& [depth, opacity] :
       {std::pair{GLenum{GL_GREATER}, hidden_share}, {GLenum{GL_LEQUAL}, 1.0F}}) {
    glDepthFunc(depth);
    draw_disks(frame, eye, opacity);
    ribbons_.draw(lines, eye, opacity);
  }
  glDepthFunc(GL_LESS);
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
}

}  // namespace handloft::client
