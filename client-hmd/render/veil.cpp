#include "client-hmd/render/veil.h"

#include <fmt/format.h>

#include <array>

#include "client-hmd/render/shaders.h"

namespace handloft::client {
namespace {

constexpr std::string_view fragment_glsl = R"glsl(
layout(location = 0) out vec2 out_veil;
uniform sampler2D u_sum;
uniform sampler2D u_weight;
uniform sampler2D u_front;
uniform sampler2D u_front_depth;
uniform vec2 u_depth_terms;
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec2 sums = texelFetch(u_weight, pixel, 0).gb;
  float front = texelFetch(u_front, pixel, 0).a;
  float depth = u_depth_terms.y / (u_depth_terms.x + texelFetch(u_front_depth, pixel, 0).r * 2.0 - 1.0);
  if (front > 0.0) sums += front * front * vec2(1.0, depth);
  out_veil = vec2(texelFetch(u_sum, pixel, 0).a * (1.0 - front), sums.x > 1e-5 ? sums.y / sums.x : 1e4);
}
)glsl";

}  // namespace

Result<Veil> Veil::create() {
  const std::array vertex{fullscreen_vertex_glsl};
  const std::array fragment{fragment_glsl};
  Result<GlProgram> program = GlProgram::build("veil", vertex, fragment);
  if (!program) return program.error();
  Veil veil;
  veil.program_ = std::move(*program);
  veil.no_vertices_ = GlVertexArray::create();
  return veil;
}

Status Veil::keep(const Layers& layers, const glm::vec2& depth_terms, int width_px, int height_px) {
  if (width_px != width_px_ || height_px != height_px_) {
    width_px_ = height_px_ = 0;
    texture_ = GlTexture::create();
    glBindTexture(GL_TEXTURE_2D, texture_.id());
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RG16F, width_px, height_px, 0, GL_RG, GL_FLOAT, nullptr);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    target_ = GlFramebuffer::create();
    glBindFramebuffer(GL_FRAMEBUFFER, target_.id());
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_.id(), 0);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
      return make_error(ErrorCode::resource_exhausted,
                        fmt::format("the graphics card refuses a veil of {}x{} px", width_px, height_px));
    }
    width_px_ = width_px;
    height_px_ = height_px;
  }
  glBindFramebuffer(GL_FRAMEBUFFER, target_.id());
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  bind_texture(0, GL_TEXTURE_2D, layers.sum);
  bind_texture(1, GL_TEXTURE_2D, layers.weight);
  bind_texture(2, GL_TEXTURE_2D, layers.front);
  bind_texture(3, GL_TEXTURE_2D, layers.front_depth);
  program_.use();
  program_.set("u_sum", 0);
  program_.set("u_weight", 1);
  program_.set("u_front", 2);
  program_.set("u_front_depth", 3);
  program_.set("u_depth_terms", depth_terms);
  glBindVertexArray(no_vertices_.id());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  return {};
}

}  // namespace handloft::client
