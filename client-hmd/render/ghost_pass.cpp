#include "client-hmd/render/ghost_pass.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace handloft::client {
namespace {

constexpr int depth_unit = 5;
constexpr float visible = 0.02F;  ///< Fainter ghosts are not drawn.
constexpr float label_px = 15.0F, reference_height_px = 720.0F;
constexpr float smallest_label_m = 0.008F;
constexpr float nearest_m = 0.02F;
constexpr float name_over_head_m = 0.075F, words_beside_hand_m = 0.05F, words_over_hand_m = 0.035F;
// A visor: a bar bent about the face.
constexpr int visor_pieces = 6;
constexpr float visor_reach_rad = 1.05F, visor_circle_m = 0.085F, visor_behind_m = 0.075F;
constexpr float visor_radius_m = 0.024F, visor_edge_radius_m = 0.014F;
constexpr float band_radius_m = 0.006F;
constexpr int band_pieces = 8;
constexpr float shoulder_aside_m = 0.18F, shoulder_below_m = 0.28F;

constexpr std::string_view vertex_glsl = R"glsl(
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in float a_opacity;
layout(location = 3) in vec3 a_colour;
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
out vec3 world;
out vec3 normal;
out float opacity;
out vec3 colour;
out float eye_depth;
void main() {
  vec4 in_eye = u_eye_from_world * vec4(a_position, 1.0);
  world = a_position;
  normal = a_normal;
  opacity = a_opacity;
  colour = a_colour;
  eye_depth = -in_eye.z;
  gl_Position = u_clip_from_eye * in_eye;
}
)glsl";

// As if of smoked glass: the more the skin turns away, the more of it the sight passes.
constexpr std::string_view fragment_glsl = R"glsl(
in vec3 world;
in vec3 normal;
in float opacity;
in vec3 colour;
in float eye_depth;
uniform vec3 u_eye_position;
uniform sampler2D u_ghost_depth;
uniform int u_depth_only;
void main() {
  if (u_depth_only != 0) {
    out_weight = vec4(0.0);
    out_colour = vec4(0.0);
    return;
  }
  if (gl_FragCoord.z > texelFetch(u_ghost_depth, ivec2(gl_FragCoord.xy), 0).r) discard;
  vec3 to_eye = normalize(u_eye_position - world);
  vec3 n = normalize(normal);
  float facing = clamp(abs(dot(n, to_eye)), 0.0, 1.0);
  float rim = pow(1.0 - facing, 1.6);
  vec3 lit = studio_light(n, to_eye, colour, 0.25);
  vec3 shade = mix(mix(lit, colour, 0.35), colour * 0.55, 0.75 * rim);
  emit(shade, opacity * mix(0.34, 0.90, rim), eye_depth);
}
)glsl";

Vec3f packed(const glm::vec3& v) {
  return {v.x, v.y, v.z};
}

void append(const Skin& skin, const glm::vec3& colour, float opacity, std::vector<GhostVertex>& vertices,
            std::vector<std::uint32_t>& indices) {
  const auto first = static_cast<std::uint32_t>(vertices.size());
  for (const SkinVertex& vertex : skin.vertices) {
    vertices.push_back(
        {packed(vertex.position), packed(vertex.normal), opacity * vertex.certainty, packed(colour)});
  }
  for (const std::uint32_t index : skin.indices) indices.push_back(first + index);
}

glm::vec3 in_world(const RigidPose& head, const glm::dvec3& in_head) {
  return glm::vec3(head.position + head.orientation * in_head);
}

float depth_of(const glm::vec3& place, const EyeUniforms& eye) {
  return -(eye.eye_from_world * glm::vec4(place, 1.0F)).z;
}

}  // namespace

glm::vec3 shoulder_of(const RigidPose& head) {
  // Heads nod, shoulders do not: only the turn about the vertical counts.
  const glm::dvec3 right = head.orientation * glm::dvec3(1.0, 0.0, 0.0);
  const glm::vec3 aside(static_cast<float>(right.x), static_cast<float>(right.y), 0.0F);
  const float length = glm::length(aside);
  constexpr float level = 1e-3F;
  return glm::vec3(head.position) + (length > level ? shoulder_aside_m / length * aside : glm::vec3(0.0F)) -
         glm::vec3(0.0F, 0.0F, shoulder_below_m);
}

std::vector<Bone> visor_bones(const RigidPose& head) {
  std::vector<Bone> bones;
  const auto on_circle = [&head](float angle, double lift) {
    const double a = static_cast<double>(angle);
    constexpr double circle = static_cast<double>(visor_circle_m),
                     behind = static_cast<double>(visor_behind_m);
    return in_world(head, {circle * std::sin(a), lift, behind - circle * std::cos(a)});
  };
  const auto radius_at = [](float angle) {
    const float out = std::abs(angle) / visor_reach_rad;
    return visor_radius_m + out * out * (visor_edge_radius_m - visor_radius_m);
  };
  for (int i = 0; i < visor_pieces; ++i) {
    const float step = 2.0F * visor_reach_rad / visor_pieces;
    const float a = -visor_reach_rad + step * static_cast<float>(i), b = a + step;
    bones.push_back({on_circle(a, 0.0), on_circle(b, 0.0), radius_at(a), radius_at(b), 1.0F, 1.0F});
  }
  constexpr float whole_turn = 6.2831853F;
  const float rest = whole_turn - 2.0F * visor_reach_rad;
  for (int i = 0; i < band_pieces; ++i) {
    const float a = visor_reach_rad + rest * static_cast<float>(i) / band_pieces;
    const float b = a + rest / band_pieces;
    bones.push_back({on_circle(a, 0.01), on_circle(b, 0.01), band_radius_m, band_radius_m, 0.75F, 0.75F});
  }
  return bones;
}

std::vector<SpaceLabel> ghost_labels(const std::vector<GhostHint>& ghosts, const EyeUniforms& eye) {
  std::vector<SpaceLabel> labels;
  const glm::vec3 right(eye.eye_from_world[0][0], eye.eye_from_world[1][0], eye.eye_from_world[2][0]);
  const auto add = [&](const std::string& text, const glm::vec3& place, const GhostHint& ghost,
                       bool centred) {
    const float depth = depth_of(place, eye);
    if (text.empty() || depth < nearest_m) return;
    SpaceLabel label;
    label.text = text;
    label.height_m =
        std::max(label_px * eye.viewport_px.y / reference_height_px * depth / eye.focal_px, smallest_label_m);
    label.position = place;
    label.centred = centred;
    label.opacity = ghost.opacity;
    label.edge = ghost.colour;
    labels.push_back(std::move(label));
  };
  for (const GhostHint& ghost : ghosts) {
    if (ghost.opacity < visible) continue;
    const HandShape hand = estimate_hand(ghost.tips, ghost.posture);
    const bool has_hand = !hand.bones.empty();
    const std::string doing = ghost.head            ? ghost.doing
                              : ghost.doing.empty() ? ghost.name
                                                    : ghost.name + ": " + ghost.doing;
    if (ghost.head) {
      add(ghost.name, glm::vec3(ghost.head->position) + glm::vec3(0.0F, 0.0F, name_over_head_m), ghost, true);
    }
    if (has_hand) {
      add(doing, hand.palm + words_beside_hand_m * right + glm::vec3(0.0F, 0.0F, words_over_hand_m), ghost,
          false);
    }
  }
  std::stable_sort(labels.begin(), labels.end(), [&eye](const SpaceLabel& a, const SpaceLabel& b) {
    return depth_of(a.position, eye) > depth_of(b.position, eye);
  });
  return labels;
}

Result<GhostPass> GhostPass::create() {
  const std::array vertex{vertex_glsl};
  const std::array fragment{emit_glsl, studio_light_glsl, fragment_glsl};
  Result<GlProgram> program = GlProgram::build("ghosts", vertex, fragment);
  if (!program) return program.error();
  GhostPass pass;
  pass.program_ = std::move(*program);
  pass.array_ = GlVertexArray::create();
  pass.vertices_ = GlBuffer::create();
  pass.indices_ = GlBuffer::create();
  glBindVertexArray(pass.array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, pass.vertices_.id());
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, pass.indices_.id());
  const auto attribute = [](GLuint index, GLint count, std::size_t at) {
    glEnableVertexAttribArray(index);
    glVertexAttribPointer(index, count, GL_FLOAT, GL_FALSE, sizeof(GhostVertex),
                          reinterpret_cast<const void*>(at));
  };
  attribute(0, 3, offsetof(GhostVertex, position));
  attribute(1, 3, offsetof(GhostVertex, normal));
  attribute(2, 1, offsetof(GhostVertex, opacity));
  attribute(3, 3, offsetof(GhostVertex, colour));
  glBindVertexArray(0);
  return pass;
}

void GhostPass::upload(const std::vector<GhostVertex>& vertices, const std::vector<std::uint32_t>& indices) {
  count_ = static_cast<GLsizei>(indices.size());
  if (count_ == 0) return;
  glBindVertexArray(array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, vertices_.id());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(GhostVertex)),
               vertices.data(), GL_STREAM_DRAW);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint32_t)),
               indices.data(), GL_STREAM_DRAW);
  glBindVertexArray(0);
}

Status GhostPass::prepare(const Frame& frame, const EyeUniforms& eye, int width_px, int height_px) {
  std::vector<GhostVertex> vertices;
  std::vector<std::uint32_t> indices;
  for (const GhostHint& ghost : frame.ghosts) {
    if (ghost.opacity < visible) continue;
    std::optional<glm::vec3> shoulder;
    if (ghost.head) shoulder = shoulder_of(*ghost.head);
    const HandShape hand = estimate_hand(ghost.tips, ghost.posture, shoulder);
    append(make_skin(hand.bones), ghost.colour, ghost.opacity, vertices, indices);
    if (ghost.head)
      append(make_skin(visor_bones(*ghost.head)), ghost.colour, ghost.opacity, vertices, indices);
  }
  upload(vertices, indices);
  if (count_ == 0) return {};
  if (width_px != width_px_ || height_px != height_px_) {
    depth_ = GlTexture::create();
    glBindTexture(GL_TEXTURE_2D, depth_.id());
    glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, width_px, height_px, 0, GL_DEPTH_COMPONENT,
                 GL_FLOAT, nullptr);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    target_ = GlFramebuffer::create();
    glBindFramebuffer(GL_FRAMEBUFFER, target_.id());
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth_.id(), 0);
    glDrawBuffer(GL_NONE);
    glReadBuffer(GL_NONE);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
      width_px_ = height_px_ = 0;
      return make_error(ErrorCode::resource_exhausted,
                        fmt::format("the graphics card refuses depths of {}x{} px", width_px, height_px));
    }
    width_px_ = width_px;
    height_px_ = height_px;
  }
  glBindFramebuffer(GL_FRAMEBUFFER, target_.id());
  glViewport(0, 0, width_px, height_px);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
  glClear(GL_DEPTH_BUFFER_BIT);
  program_.use();
  set_common_uniforms(program_, eye, Stage::opaque);
  program_.set("u_depth_only", 1);
  glBindVertexArray(array_.id());
  glDrawElements(GL_TRIANGLES, count_, GL_UNSIGNED_INT, nullptr);
  glBindVertexArray(0);
  return {};
}

void GhostPass::draw(const EyeUniforms& eye, Stage stage) const {
  if (count_ == 0) return;
  program_.use();
  set_common_uniforms(program_, eye, stage);
  program_.set("u_depth_only", 0);
  program_.set("u_ghost_depth", depth_unit);
  bind_texture(depth_unit, GL_TEXTURE_2D, depth_.id());
  glBindVertexArray(array_.id());
  glDrawElements(GL_TRIANGLES, count_, GL_UNSIGNED_INT, nullptr);
  glBindVertexArray(0);
}

}  // namespace handloft::client
