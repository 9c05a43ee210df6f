#include "client-hmd/render/targets.h"

#include <fmt/format.h>

namespace handloft::client {
namespace {

GlTexture make_texture(GLint internal_format, GLenum format, GLenum type, GLint filter, int width,
                       int height) {
  GlTexture texture = GlTexture::create();
  glBindTexture(GL_TEXTURE_2D, texture.id());
  glTexImage2D(GL_TEXTURE_2D, 0, internal_format, width, height, 0, format, type, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return texture;
}

GlFramebuffer make_target(std::initializer_list<GLuint> colours, GLuint depth) {
  GlFramebuffer target = GlFramebuffer::create();
  glBindFramebuffer(GL_FRAMEBUFFER, target.id());
  std::array<GLenum, 4> buffers{};
  GLsizei count = 0;
  for (const GLuint colour : colours) {
    const auto attachment = static_cast<GLenum>(GL_COLOR_ATTACHMENT0 + count);
    glFramebufferTexture2D(GL_FRAMEBUFFER, attachment, GL_TEXTURE_2D, colour, 0);
    buffers[static_cast<std::size_t>(count++)] = attachment;
  }
  if (depth != 0) glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth, 0);
  glDrawBuffers(count, buffers.data());
  return target;
}

Status check_size(int width_px, int height_px) {
  GLint largest = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
  if (width_px <= largest && height_px <= largest) return {};
  return make_error(
      ErrorCode::resource_exhausted,
      fmt::format("a picture of {}x{} px is larger than this card's {} px", width_px, height_px, largest));
}

Status check_complete(int width_px, int height_px) {
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return {};
  return make_error(ErrorCode::resource_exhausted,
                    fmt::format("the graphics card refuses a picture of {}x{} px", width_px, height_px));
}

}  // namespace

Status Targets::resize(int width_px, int height_px) {
  if (width_px == width_px_ && height_px == height_px_) return {};
  if (const Status fits = check_size(width_px, height_px); !fits) return fits;
  *this = Targets();
  picture_ = make_texture(GL_RGBA16F, GL_RGBA, GL_FLOAT, GL_LINEAR, width_px, height_px);
  depth_ = make_texture(GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT, GL_NEAREST, width_px, height_px);
  sum_ = make_texture(GL_RGBA16F, GL_RGBA, GL_FLOAT, GL_NEAREST, width_px, height_px);
  weight_ = make_texture(GL_RGBA16F, GL_RGBA, GL_FLOAT, GL_NEAREST, width_px, height_px);
  picture_target_ = make_target({picture_.id()}, depth_.id());
  if (const Status complete = check_complete(width_px, height_px); !complete) return complete;
  weighted_target_ = make_target({sum_.id(), weight_.id()}, depth_.id());
  if (const Status complete = check_complete(width_px, height_px); !complete) return complete;
  width_px_ = width_px;
  height_px_ = height_px;
  return {};
}

void Targets::begin_peeling() {
  if (!layer_colour_) {
    layer_colour_ = make_texture(GL_RGBA16F, GL_RGBA, GL_FLOAT, GL_NEAREST, width_px_, height_px_);
    for (std::size_t i = 0; i < 2; ++i) {
      layer_depths_[i] = make_texture(GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT, GL_NEAREST,
                                      width_px_, height_px_);
      layer_targets_[i] = make_target({layer_colour_.id()}, layer_depths_[i].id());
    }
    peeled_target_ = make_target({sum_.id()}, 0);
  }
  // The "last layer" of the first one lies before everything.
  glBindFramebuffer(GL_FRAMEBUFFER, layer_targets_[1].id());
  constexpr float nearest = 0.0F;
  glDepthMask(GL_TRUE);
  glClearBufferfv(GL_DEPTH, 0, &nearest);
  bind_peeled_sum();
  constexpr std::array<float, 4> all_shines_through{0.0F, 0.0F, 0.0F, 1.0F};
  glClearBufferfv(GL_COLOR, 0, all_shines_through.data());
}

Status OutputTarget::resize(int width_px, int height_px) {
  if (width_px == width_px_ && height_px == height_px_) return {};
  if (const Status fits = check_size(width_px, height_px); !fits) return fits;
  colour_ = make_texture(GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, GL_LINEAR, width_px, height_px);
  target_ = make_target({colour_.id()}, 0);
  if (const Status complete = check_complete(width_px, height_px); !complete) return complete;
  width_px_ = width_px;
  height_px_ = height_px;
  return {};
}

void OutputTarget::clear() const {
  glBindFramebuffer(GL_FRAMEBUFFER, target_.id());
  constexpr std::array<float, 4> nothing{0.0F, 0.0F, 0.0F, 0.0F};
  glClearBufferfv(GL_COLOR, 0, nothing.data());
}

Image OutputTarget::read() const {
  Image image{width_px_, height_px_, {}};
  const std::size_t row = 4 * static_cast<std::size_t>(width_px_);
  std::vector<std::uint8_t> upside_down(row * static_cast<std::size_t>(height_px_));
  glBindFramebuffer(GL_FRAMEBUFFER, target_.id());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_px_, height_px_, GL_RGBA, GL_UNSIGNED_BYTE, upside_down.data());
  image.rgba.reserve(upside_down.size());
  for (std::size_t y = static_cast<std::size_t>(height_px_); y-- > 0;) {
    const auto begin = upside_down.begin() + static_cast<std::ptrdiff_t>(y * row);
    image.rgba.insert(image.rgba.end(), begin, begin + static_cast<std::ptrdiff_t>(row));
  }
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
  return image;
}

}  // namespace handloft::client
