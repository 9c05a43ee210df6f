#include "client-hmd/render/hand_occlusion.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>

namespace handloft::client {
namespace {

/// Half the width of the soft edge, of the picture's height: 4 px of 720.
constexpr float softness_share = 0.0055F;
/// Between "before" and "behind" the hand, metres: about the error of a guessed skin.
constexpr float depth_softness_m = 0.006F;
/// The guessed skin is a little thinner than a glove.
constexpr float glove_m = 0.002F;

constexpr std::string_view draw_vertex_glsl = R"glsl(
layout(location = 0) in vec3 a_position;
layout(location = 1) in float a_certainty;
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
out float certainty;
out float eye_depth;
void main() {
  vec4 in_eye = u_eye_from_world * vec4(a_position, 1.0);
  certainty = a_certainty;
  eye_depth = -in_eye.z;
  gl_Position = u_clip_from_eye * in_eye;
}
)glsl";

constexpr std::string_view draw_glsl = R"glsl(
in float certainty;
in float eye_depth;
layout(location = 0) out vec2 out_mask;
void main() {
  float cover = smoothstep(0.0, 0.6, certainty);
  out_mask = vec2(cover, cover * eye_depth);
}
)glsl";

constexpr std::string_view blur_glsl = R"glsl(
in vec2 uv;
layout(location = 0) out vec2 out_mask;
uniform sampler2D u_source;
uniform vec2 u_step;
void main() {
  vec2 sum = vec2(0.0);
  float weights = 0.0;
  for (int i = -4; i <= 4; ++i) {
    float x = float(i) / 2.0;
    float weight = exp(-0.5 * x * x);
    sum += weight * texture(u_source, uv + float(i) * u_step).rg;
    weights += weight;
  }
  out_mask = sum / weights;
}
)glsl";

constexpr std::string_view cover_glsl = R"glsl(
layout(location = 0) out vec4 out_colour;
uniform sampler2D u_mask;
uniform sampler2D u_film;
uniform sampler2D u_depth;
uniform vec2 u_projection;  // clip_from_eye[2][2], [3][2]
uniform float u_depth_softness;
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec2 mask = texelFetch(u_mask, pixel, 0).rg;
  if (mask.x < 0.004) discard;
  float hand_depth = mask.y / mask.x;
  float in_depth = texelFetch(u_depth, pixel, 0).r * 2.0 - 1.0;
  float drawn_depth = u_projection.y / (u_projection.x + in_depth);
  float behind = smoothstep(-u_depth_softness, u_depth_softness, drawn_depth - hand_depth);
  float outline = smoothstep(0.15, 0.85, mask.x);
  out_colour = vec4(texelFetch(u_film, pixel, 0).rgb, outline * behind);
}
)glsl";

struct MaskVertex {
  Vec3f position;
  float certainty = 1.0F;
};

GlTexture make_texture(GLint internal, GLenum format, int width, int height, GLint filter) {
  GlTexture texture = GlTexture::create();
  glBindTexture(GL_TEXTURE_2D, texture.id());
  glTexImage2D(GL_TEXTURE_2D, 0, internal, width, height, 0, format, GL_FLOAT, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return texture;
}

GlFramebuffer make_target(GLuint colour, GLuint depth) {
  GlFramebuffer target = GlFramebuffer::create();
  glBindFramebuffer(GL_FRAMEBUFFER, target.id());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour, 0);
  if (depth != 0) glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth, 0);
  return target;
}

}  // namespace

Result<HandOcclusionPass> HandOcclusionPass::create() {
  HandOcclusionPass pass;
  struct Recipe {
    GlProgram* program;
    std::string_view name, vertex, fragment;
  };
  for (const Recipe& recipe : {Recipe{&pass.draw_, "hand mask", draw_vertex_glsl, draw_glsl},
                               Recipe{&pass.blur_, "hand outline", fullscreen_vertex_glsl, blur_glsl},
                               Recipe{&pass.cover_, "hand cover", fullscreen_vertex_glsl, cover_glsl}}) {
    const std::array vertex{recipe.vertex};
    const std::array fragment{recipe.fragment};
    Result<GlProgram> program = GlProgram::build(recipe.name, vertex, fragment);
    if (!program) return program.error();
    *recipe.program = std::move(*program);
  }
  pass.no_vertices_ = GlVertexArray::create();
  pass.array_ = GlVertexArray::create();
  pass.vertices_ = GlBuffer::create();
  pass.indices_ = GlBuffer::create();
  glBindVertexArray(pass.array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, pass.vertices_.id());
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, pass.indices_.id());
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(MaskVertex), nullptr);
  glEnableVertexAttribArray(1);
  glVertexAttribPointer(1, 1, GL_FLOAT, GL_FALSE, sizeof(MaskVertex),
                        reinterpret_cast<const void*>(offsetof(MaskVertex, certainty)));
  glBindVertexArray(0);
  return pass;
}

void HandOcclusionPass::fullscreen(const GlProgram& program) const {
  program.use();
  glBindVertexArray(no_vertices_.id());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

Status HandOcclusionPass::resize(const Targets& targets, int width_px, int height_px) {
  if (width_px == width_px_ && height_px == height_px_) {
    // Of two eyes' pictures each has its turn.
    if (targets.picture() != picture_) picture_alone_ = make_target(targets.picture(), 0);
    picture_ = targets.picture();
    return {};
  }
  width_px_ = height_px_ = 0;
  film_ = make_texture(GL_RGBA16F, GL_RGBA, width_px, height_px, GL_NEAREST);
  mask_ = make_texture(GL_RG16F, GL_RG, width_px, height_px, GL_LINEAR);
  other_ = make_texture(GL_RG16F, GL_RG, width_px, height_px, GL_LINEAR);
  depth_ = GlTexture::create();
  glBindTexture(GL_TEXTURE_2D, depth_.id());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT24, width_px, height_px, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
               nullptr);
  film_target_ = make_target(film_.id(), 0);
  other_target_ = make_target(other_.id(), 0);
  // Of its own, without depth: the cover reads the depth that is attached to the picture's usual target.
  picture_alone_ = make_target(targets.picture(), 0);
  mask_target_ = make_target(mask_.id(), depth_.id());
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("the graphics card refuses a mask of {}x{} px", width_px, height_px));
  }
  picture_ = targets.picture();
  width_px_ = width_px;
  height_px_ = height_px;
  return {};
}

Result<bool> HandOcclusionPass::prepare(const Frame& frame, const EyeUniforms& eye, const Targets& targets) {
  if (!frame.film || !frame.filmed_hand || frame.hand_occlusion == HandOcclusion::off) return false;
  std::vector<Bone> bones = estimate_hand(frame.filmed_hand->tips, frame.filmed_hand->posture,
                                          eye.position - glm::vec3(0.0F, 0.0F, 0.25F))
                                .bones;
  if (bones.empty()) return false;
  for (Bone& bone : bones) {
    bone.from_radius_m += glove_m;
    bone.to_radius_m += glove_m;
  }
  const Skin skin = make_skin(bones);
  const auto width = static_cast<int>(eye.viewport_px.x), height = static_cast<int>(eye.viewport_px.y);
  if (const Status sized = resize(targets, width, height); !sized) return sized.error();

  glBindFramebuffer(GL_READ_FRAMEBUFFER, picture_alone_.id());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, film_target_.id());
  glBlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST);

  std::vector<MaskVertex> vertices;
  vertices.reserve(skin.vertices.size());
  for (const SkinVertex& vertex : skin.vertices) {
    const glm::vec3& p = vertex.position;
    vertices.push_back({{p.x, p.y, p.z}, vertex.certainty});
  }
  glBindVertexArray(array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, vertices_.id());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(MaskVertex)),
               vertices.data(), GL_STREAM_DRAW);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(skin.indices.size() * sizeof(std::uint32_t)),
               skin.indices.data(), GL_STREAM_DRAW);
  glBindFramebuffer(GL_FRAMEBUFFER, mask_target_.id());
  glViewport(0, 0, width, height);
  glClearColor(0.0F, 0.0F, 0.0F, 0.0F);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  draw_.use();
  draw_.set("u_eye_from_world", eye.eye_from_world);
  draw_.set("u_clip_from_eye", eye.clip_from_eye);
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(skin.indices.size()), GL_UNSIGNED_INT, nullptr);

  glDisable(GL_DEPTH_TEST);
  blur_.use();
  blur_.set("u_source", 0);
  const float texels = softness_share * eye.viewport_px.y / 2.0F;
  for (const bool across : {true, false}) {
    glBindFramebuffer(GL_FRAMEBUFFER, across ? other_target_.id() : mask_target_.id());
    bind_texture(0, GL_TEXTURE_2D, across ? mask_.id() : other_.id());
    blur_.set("u_step", across ? glm::vec2(texels / eye.viewport_px.x, 0.0F)
                               : glm::vec2(0.0F, texels / eye.viewport_px.y));
    fullscreen(blur_);
  }
  cover_.use();
  cover_.set("u_projection", glm::vec2(eye.clip_from_eye[2][2], eye.clip_from_eye[3][2]));
  targets.bind_picture();
  return true;
}

void HandOcclusionPass::cover(const Targets& targets) const {
  glBindFramebuffer(GL_FRAMEBUFFER, picture_alone_.id());
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  bind_texture(0, GL_TEXTURE_2D, mask_.id());
  bind_texture(1, GL_TEXTURE_2D, film_.id());
  bind_texture(2, GL_TEXTURE_2D, targets.opaque_depth());
  cover_.use();
  cover_.set("u_mask", 0);
  cover_.set("u_film", 1);
  cover_.set("u_depth", 2);
  cover_.set("u_depth_softness", depth_softness_m);
  fullscreen(cover_);
  glDisable(GL_BLEND);
  targets.bind_picture();
}

}  // namespace handloft::client
