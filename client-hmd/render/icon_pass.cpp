#include "client-hmd/render/icon_pass.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace handloft::client {
namespace {

constexpr float ball_radius_m = 0.0045F;   ///< About as a fingertip's cap: what is to be grasped between two.
constexpr float least_ball_px = 5.0F;      ///< Of a picture 720 high.
constexpr float passive_share = 0.8F;      ///< Passive ones are smaller ...
constexpr float passive_paleness = 0.35F;  ///< ... and paler than those that follow a hand.
constexpr float handle_share = 0.7F;       ///< Of curves and regions, whose lines are the icon.
constexpr float held_growth = 1.3F, held_paleness = 0.35F;
constexpr float arrow_m = 0.05F;  ///< Its tip is what a hand drags (the model's icon_arrow_m).
constexpr float least_arrow_radii = 5.0F, arrow_width_radii = 0.95F;
constexpr float label_radii = 1.5F;                              ///< Beside the ball ...
constexpr float label_lift_m = 0.035F, label_lift_share = 0.2F;  ///< ... and before the surface about it.
constexpr float label_px = 15.0F;                                ///< Of a picture 720 high.
constexpr float leaning_share = 0.3F;  ///< Of its length to the right: the word is left of such an arrow.
constexpr float line_px = 5.0F, held_line_px = 8.0F, light_edge = 0.3F;
constexpr float halo_reach_radii = 2.6F;
constexpr float target_halo = 0.95F, held_halo = 0.6F;
constexpr float nearest_m = 0.01F;
constexpr float reference_height_px = 720.0F;

// A shaft and a head, turned about the axis: no vertices but their numbers.
constexpr int arrow_sides = 20, arrow_rings = 4;
constexpr std::string_view arrow_vertex_glsl = R"glsl(
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
uniform vec3 u_base;
uniform vec3 u_axis;    // to the tip
uniform vec3 u_along;   // unit, across the axis
uniform vec3 u_across;
uniform float u_width;  // of the head, its radius
out vec3 world;
out vec3 normal;
out float eye_depth;
const float sides = 20.0;
// Height and radius of each ring's two edges, and the slope of its normal along the axis.
const vec2 lower[4] = vec2[4](vec2(0.0, 0.0), vec2(0.0, 0.36), vec2(0.66, 0.36), vec2(0.66, 1.0));
const vec2 upper[4] = vec2[4](vec2(0.0, 0.36), vec2(0.66, 0.36), vec2(0.66, 1.0), vec2(1.0, 0.0));
const vec2 facing[4] = vec2[4](vec2(-1.0, 0.0), vec2(0.0, 1.0), vec2(-1.0, 0.0), vec2(0.35, 0.94));
void main() {
  int corner = gl_VertexID % 6;
  int side = (gl_VertexID / 6) % 20;
  int ring = gl_VertexID / 120;
  bool right = corner == 1 || corner == 3 || corner == 4;
  bool top = corner == 2 || corner == 4 || corner == 5;
  // The tip belongs to both edges of a side.
  float turn = 6.2831853 * (float(side) + (ring == 3 && top ? 0.5 : right ? 1.0 : 0.0)) / sides;
  vec3 outwards = cos(turn) * u_along + sin(turn) * u_across;
  vec2 at = top ? upper[ring] : lower[ring];
  world = u_base + at.x * u_axis + at.y * u_width * outwards;
  normal = normalize(facing[ring].x * normalize(u_axis) + facing[ring].y * outwards);
  vec4 in_eye = u_eye_from_world * vec4(world, 1.0);
  eye_depth = -in_eye.z;
  gl_Position = u_clip_from_eye * in_eye;
}
)glsl";

constexpr std::string_view arrow_glsl = R"glsl(
in vec3 world;
in vec3 normal;
in float eye_depth;
uniform vec3 u_eye_position;
uniform vec3 u_colour;
void main() {
  vec3 to_eye = normalize(u_eye_position - world);
  emit(studio_light(normalize(normal), to_eye, u_colour, 0.5), 1.0, eye_depth);
}
)glsl";

constexpr std::string_view halo_glsl = R"glsl(
in vec2 corner;
layout(location = 0) out vec4 out_colour;
uniform float u_opacity;
uniform float u_pixel;  // in units of the square's half side
void main() {
  float r = length(corner);
  float ring = 1.0 - smoothstep(0.07, 0.07 + 1.5 * u_pixel, abs(r - 0.78));
  float glow = 0.35 * (1.0 - smoothstep(0.35, 1.0, r)) * smoothstep(0.36, 0.42, r);  // The ball keeps its colour.
  float alpha = max(ring, glow);
  if (alpha < 0.004) discard;
  out_colour = vec4(mix(vec3(0.95, 0.62, 0.20), vec3(0.75, 0.15, 0.005), ring), alpha * u_opacity);
}
)glsl";

float linear(std::uint32_t rgba, unsigned shift) {
  return std::pow(static_cast<float>(rgba >> shift & 0xFFU) / 255.0F, 2.2F);
}

glm::vec3 vec(const Vec3f& v) {
  return {v.x, v.y, v.z};
}

float depth_of(const glm::vec3& place, const EyeUniforms& eye) {
  return -(eye.eye_from_world * glm::vec4(place, 1.0F)).z;
}

/// What so many pixels of a picture 720 high are at a place.
float metres(float pixels, const glm::vec3& place, const EyeUniforms& eye) {
  return pixels * eye.viewport_px.y / reference_height_px * std::max(depth_of(place, eye), nearest_m) /
         eye.focal_px;
}

template <typename Visit>
void for_each_icon(const Scene& scene, const Visit& visit) {
  for (const auto& [id, entity] : scene.entities) {
    if (entity->icons == nullptr) continue;
    for (const SceneIcon& icon : *entity->icons) visit(icon);
  }
}

}  // namespace

IconLook look_of(const SceneIcon& icon, const EyeUniforms& eye) {
  IconLook look;
  look.ball.centre = vec(icon.place);
  look.ball.radius_m = std::max(ball_radius_m, metres(least_ball_px, look.ball.centre, eye));
  look.ball.colour = {linear(icon.colour_rgba, 24), linear(icon.colour_rgba, 16),
                      linear(icon.colour_rgba, 8)};
  const glm::vec3 white(1.0F);
  look.line = {look.ball.colour, line_px, 0.0F, 0.0F};
  if (icon.shape != IconShape::point) look.ball.radius_m *= handle_share;
  if (icon.state == IconState::passive) {
    look.ball.radius_m *= passive_share;
    look.ball.colour = glm::mix(look.ball.colour, white, passive_paleness);
    look.line.colour = look.ball.colour;
  }
  if (icon.held) {
    look.ball.radius_m *= held_growth;
    look.ball.colour = glm::mix(look.ball.colour, white, held_paleness);
  }
  if (icon.held || icon.target) {
    look.line.width = held_line_px;
    look.line.edge = light_edge;
  }
  look.halo = icon.target ? target_halo : icon.held ? held_halo : 0.0F;
  if (icon.direction) {
    look.arrow = std::max(arrow_m, least_arrow_radii * look.ball.radius_m) * vec(*icon.direction);
    look.arrow_width_m = arrow_width_radii * look.ball.radius_m;
    // A normal is an arrow alone; where it stands is told by a small foot.
    if (icon.property == IconProperty::normal) look.ball.radius_m *= 0.55F;
  }
  return look;
}

std::vector<SpaceLabel> icon_labels(const Scene& scene, const EyeUniforms& eye) {
  std::vector<SpaceLabel> labels;
  const glm::vec3 right(eye.eye_from_world[0][0], eye.eye_from_world[1][0], eye.eye_from_world[2][0]);
  for_each_icon(scene, [&](const SceneIcon& icon) {
    const float depth = depth_of(vec(icon.place), eye);
    if (icon.label.empty() || depth < nearest_m) return;
    const IconLook look = look_of(icon, eye);
    SpaceLabel label;
    label.text = icon.label;
    label.to_left = glm::dot(look.arrow, right) > leaning_share * glm::length(look.arrow);
    label.position =
        look.ball.centre + (label.to_left ? -1.0F : 1.0F) * label_radii * look.ball.radius_m * right;
    label.position +=
        std::min(label_lift_m, label_lift_share * depth) * glm::normalize(eye.position - label.position);
    label.height_m = metres(label_px, label.position, eye);
    labels.push_back(std::move(label));
  });
  return labels;
}

Result<IconPass> IconPass::create() {
  IconPass pass;
  Result<BallPass> balls = BallPass::create();
  if (!balls) return balls.error();
  pass.balls_ = std::move(*balls);
  Result<RibbonPass> ribbons = RibbonPass::create();
  if (!ribbons) return ribbons.error();
  pass.ribbons_ = std::move(*ribbons);
  const std::array arrow_vertex{arrow_vertex_glsl};
  const std::array arrow_fragment{emit_glsl, studio_light_glsl, arrow_glsl};
  Result<GlProgram> arrow = GlProgram::build("arrow", arrow_vertex, arrow_fragment);
  if (!arrow) return arrow.error();
  pass.arrow_ = std::move(*arrow);
  const std::array halo_vertex{billboard_vertex_glsl};
  const std::array halo_fragment{halo_glsl};
  Result<GlProgram> halo = GlProgram::build("halo", halo_vertex, halo_fragment);
  if (!halo) return halo.error();
  pass.halo_ = std::move(*halo);
  pass.no_vertices_ = GlVertexArray::create();
  return pass;
}

void IconPass::draw(const Scene& scene, const EyeUniforms& eye) const {
  Ribbons lines;
  balls_.begin(eye, Stage::opaque);
  for_each_icon(scene, [&](const SceneIcon& icon) {
    const IconLook look = look_of(icon, eye);
    balls_.draw(look.ball);
    lines.add(icon.outline, false, look.line);
  });
  arrow_.use();
  set_common_uniforms(arrow_, eye, Stage::opaque);
  glBindVertexArray(no_vertices_.id());
  for_each_icon(scene, [&](const SceneIcon& icon) {
    if (!icon.direction) return;
    const IconLook look = look_of(icon, eye);
    const glm::vec3 axis = glm::normalize(look.arrow);
    const glm::vec3 helper =
        std::abs(axis.z) < 0.9F ? glm::vec3(0.0F, 0.0F, 1.0F) : glm::vec3(0.0F, 1.0F, 0.0F);
    const glm::vec3 along = glm::normalize(glm::cross(helper, axis));
    arrow_.set("u_base", look.ball.centre);
    arrow_.set("u_axis", look.arrow);
    arrow_.set("u_along", along);
    arrow_.set("u_across", glm::cross(axis, along));
    arrow_.set("u_width", look.arrow_width_m);
    arrow_.set("u_colour", look.ball.colour);
    glDrawArrays(GL_TRIANGLES, 0, 6 * arrow_sides * arrow_rings);
  });
  ribbons_.draw(lines, eye, 1.0F);
}

void IconPass::draw_halos(const Scene& scene, const EyeUniforms& eye) const {
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  halo_.use();
  halo_.set("u_eye_from_world", eye.eye_from_world);
  halo_.set("u_clip_from_eye", eye.clip_from_eye);
  glBindVertexArray(no_vertices_.id());
  for_each_icon(scene, [&](const SceneIcon& icon) {
    const float depth = depth_of(vec(icon.place), eye);
    if (!(icon.target || icon.held) || depth < nearest_m) return;
    const IconLook look = look_of(icon, eye);
    const float reach = halo_reach_radii * look.ball.radius_m;
    halo_.set("u_centre", look.ball.centre);
    halo_.set("u_reach", reach);
    halo_.set("u_opacity", look.halo);
    halo_.set("u_pixel", depth / eye.focal_px / reach);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  });
  glDisable(GL_BLEND);
}

}  // namespace handloft::client
