#include "client-hmd/render/gesture_pass.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "client-hmd/render/cursor_lines.h"
#include "client-hmd/render/surface_pass.h"

namespace handloft::client {
namespace {

/// Opacity, as a share, of what is behind something.
constexpr float name_over_box_m = 0.02F;  ///< Of who holds a shape.
constexpr float label_px = 15.0F, reference_height_px = 720.0F, smallest_label_m = 0.008F;  ///< As of ghosts.
constexpr float nearest_label_m = 0.02F;
constexpr float hidden_share = 0.30F;
/// Our own hand's disk; others' are in their colours.
const glm::vec3 disk_face{0.93F, 0.32F, 0.06F}, disk_ink{0.50F, 0.05F, 0.005F};
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
/// About what others work on: a frame further out, dashed, so that it is no bracket of ours.
constexpr float frame_gap_m = 0.008F, frame_width = 3.0F, frame_dash_m = 0.006F;
constexpr float smallest_ghost_opacity = 0.02F;
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
uniform vec3 u_face;
uniform vec3 u_ink;
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
  vec3 gauge_colour = mix(vec3(0.04, 0.06, 0.10), vec3(0.02, 0.13, 0.42), filled);
  float alpha = 0.30 * inside;
  vec3 colour = u_face;
  colour = mix(colour, u_ink, max(rim, 0.6 * rings * inside));
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
  RibbonStyle style = arrow_style;
  if (disk.tint) style.colour = 0.5F * *disk.tint;
  const float length = std::clamp(disk.radius_m, shortest_arrow_m, longest_arrow_m);
  const glm::vec3 tip = disk.centre + length * disk.normal;
  // The head lies flat before the eye; seen from straight behind, any direction will do.
  glm::vec3 side = glm::cross(disk.normal, eye - tip);
  side = glm::length(side) > 1e-6F ? glm::normalize(side) : axes_of(disk.normal).along;
  const glm::vec3 base = tip - arrow_head_share * length * disk.normal;
  const glm::vec3 reach = arrow_head_width_share * length * side;
  out.add_segment(disk.centre, tip, style);
  const std::array head{Vec3f{(base + reach).x, (base + reach).y, (base + reach).z},
                        Vec3f{tip.x, tip.y, tip.z},
                        Vec3f{(base - reach).x, (base - reach).y, (base - reach).z}};
  out.add(head, false, style);
}

void add_brackets(const Box& box, float gap_m, const RibbonStyle& style, Ribbons& out) {
  const glm::vec3 low = box.low - gap_m, high = box.high + gap_m;
  const glm::vec3 reach = glm::min(bracket_share * (high - low), glm::vec3(longest_bracket_m));
  for (unsigned corner = 0; corner < 8; ++corner) {
    const glm::bvec3 upper((corner & 1U) != 0, (corner & 2U) != 0, (corner & 4U) != 0);
    const glm::vec3 from = glm::mix(low, high, upper);
    for (int axis = 0; axis < 3; ++axis) {
      glm::vec3 to = from;
      to[axis] += upper[axis] ? -reach[axis] : reach[axis];
      out.add_segment(from, to, style);
    }
  }
}

/// The twelve edges of a box.
void add_box(const Box& box, const RibbonStyle& style, Ribbons& out) {
  const glm::vec3 low = box.low - frame_gap_m, high = box.high + frame_gap_m;
  for (int axis = 0; axis < 3; ++axis) {
    for (unsigned corner = 0; corner < 4; ++corner) {
      glm::vec3 from = low;
      const int one = (axis + 1) % 3, other = (axis + 2) % 3;
      if ((corner & 1U) != 0) from[one] = high[one];
      if ((corner & 2U) != 0) from[other] = high[other];
      glm::vec3 to = from;
      to[axis] = high[axis];
      out.add_segment(from, to, style);
    }
  }
}

void add_air_curve(const SceneCurve& curve, const std::optional<glm::vec3>& tint, ColourScheme scheme,
                   Ribbons& out) {
  RibbonStyle style = ribbon_style(curve.kind, curve.colour_rgba);
  RibbonStyle closing = closing_style;
  if (scheme != ColourScheme::normal && curve.colour_rgba == 0) {
    const SceneColours& colours = scene_colours(scheme);
    const std::uint32_t chosen = curve.kind == CurveKind::profile    ? colours.profile
                                 : curve.kind == CurveKind::boundary ? colours.boundary
                                                                     : colours.curve;
    style.colour = closing.colour = linear_rgb(chosen);
  }
  if (tint) style.colour = closing.colour = *tint;
  out.add(curve.points, curve.closed, style);
  if (curve.kind == CurveKind::boundary && !curve.closed && curve.points.size() > 2) {
    out.add_segment(vec(curve.points.back()), vec(curve.points.front()), closing);
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
  provisional_.clear();
  std::erase_if(boxes_, [&scene](const auto& item) {
    const auto found = scene.entities.find(item.first);
    return found == scene.entities.end() || found->second != item.second.entity;
  });
  for (const auto& [id, entity] : scene.entities) {
    if (entity->target) targets_.push_back(entity);
    if (entity->provisional) provisional_.push_back(entity);
  }
}

const std::optional<Box>& GesturePass::box_of(const std::shared_ptr<const Entity>& entity) {
  KnownBox& known = boxes_[entity->id];
  if (known.entity != entity) known = {entity, shown_box(*entity)};
  return known.box;
}

void GesturePass::add_frames(const Frame& frame, Ribbons& out) {
  for (const auto& entity : targets_) {
    if (const std::optional<Box>& box = box_of(entity)) add_brackets(*box, bracket_gap_m, bracket_style, out);
  }
  if (frame.scene == nullptr) return;
  for (const HolderMark& holder : frame.holders) {
    const auto held = frame.scene->entities.find(holder.entity);
    if (held == frame.scene->entities.end()) continue;
    if (const std::optional<Box>& box = box_of(held->second)) {
      add_box(*box, {holder.colour, frame_width, 0.0F, 0.0F}, out);
    }
  }
  const auto is_held = [&frame](const std::string& entity) {
    return std::any_of(frame.holders.begin(), frame.holders.end(),
                       [&entity](const HolderMark& holder) { return holder.entity == entity; });
  };
  for (const GhostHint& ghost : frame.ghosts) {
    if (ghost.opacity < smallest_ghost_opacity) continue;
    const auto works_on = frame.scene->entities.find(ghost.entity);
    if (!is_held(ghost.entity) && works_on != frame.scene->entities.end()) {
      if (const std::optional<Box>& box = box_of(works_on->second)) {
        add_box(*box, {ghost.colour, frame_width, frame_dash_m, 0.0F}, out);
      }
    }
    for (const auto& entity : provisional_) {
      if (entity->provisional_by != ghost.client_id || entity->id == ghost.entity) continue;
      if (const std::optional<Box>& box = box_of(entity)) {
        add_box(*box, {ghost.colour, frame_width, frame_dash_m, 0.0F}, out);
      }
    }
  }
}

std::vector<SpaceLabel> GesturePass::holder_labels(const Frame& frame, const EyeUniforms& eye) {
  std::vector<SpaceLabel> labels;
  std::vector<float> depths;
  if (frame.scene == nullptr) return labels;
  for (const HolderMark& holder : frame.holders) {
    const auto held = frame.scene->entities.find(holder.entity);
    if (held == frame.scene->entities.end() || holder.name.empty()) continue;
    const std::optional<Box>& box = box_of(held->second);
    if (!box) continue;
    SpaceLabel label;
    label.position = {0.5F * (box->low.x + box->high.x), 0.5F * (box->low.y + box->high.y),
                      box->high.z + name_over_box_m};
    const float depth = -(eye.eye_from_world * glm::vec4(label.position, 1.0F)).z;
    if (!(depth > nearest_label_m)) continue;
    label.text = holder.name;
    label.height_m =
        std::max(label_px * eye.viewport_px.y / reference_height_px * depth / eye.focal_px, smallest_label_m);
    label.centred = true;
    label.edge = holder.colour;
    const auto behind = std::find_if(depths.begin(), depths.end(), [depth](float d) { return d < depth; });
    labels.insert(labels.begin() + (behind - depths.begin()), std::move(label));
    depths.insert(behind, depth);
  }
  return labels;
}

void GesturePass::draw_disks(std::span<const DiskHint> disks, const EyeUniforms& eye, float opacity) const {
  disk_.use();
  disk_.set("u_eye_from_world", eye.eye_from_world);
  disk_.set("u_clip_from_eye", eye.clip_from_eye);
  disk_.set("u_reach", disk_reach);
  disk_.set("u_opacity", opacity);
  glBindVertexArray(no_vertices_.id());
  for (const DiskHint& disk : disks) {
    disk_.set("u_face", disk.tint.value_or(disk_face));
    disk_.set("u_ink", disk.tint ? 0.5F * *disk.tint : disk_ink);
    const float radius = std::max(disk.radius_m, smallest_disk_m);
    const Axes axes = axes_of(disk.normal);
    disk_.set("u_centre", disk.centre);
    disk_.set("u_along", axes.along * radius);
    disk_.set("u_across", axes.across * radius);
    disk_.set("u_range", std::clamp(disk.range, 0.0F, 1.0F));
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  }
}

void GesturePass::draw(const Frame& frame, const EyeUniforms& eye) {
  Ribbons lines;
  std::vector<DiskHint> disks = frame.disks;
  add_frames(frame, lines);
  for (const auto& curve : frame.air_curves) add_air_curve(*curve, std::nullopt, frame.colours, lines);
  for (const GhostHint& ghost : frame.ghosts) {
    if (ghost.opacity < smallest_ghost_opacity) continue;
    if (ghost.curve != nullptr) add_air_curve(*ghost.curve, ghost.colour, frame.colours, lines);
    if (ghost.disk) {
      disks.push_back(*ghost.disk);
      disks.back().tint = ghost.colour;
    }
  }
  for (const DiskHint& disk : disks) add_arrow(disk, eye.position, lines);
  if (frame.cursor) add_cursor(*frame.cursor, eye.position, lines);
  if (lines.empty()) return;
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_FALSE);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  for (const auto& [depth, opacity] :
       {std::pair{GLenum{GL_GREATER}, hidden_share}, {GLenum{GL_LEQUAL}, 1.0F}}) {
    glDepthFunc(depth);
    draw_disks(disks, eye, opacity);
    ribbons_.draw(lines, eye, opacity);
  }
  glDepthFunc(GL_LESS);
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
}

}  // namespace handloft::client
