#include "client-hmd/render/present_pass.h"

#include <array>
#include <cstddef>

#include "client-hmd/render/shaders.h"

namespace handloft::client {
namespace {

constexpr std::string_view show_glsl = R"glsl(
layout(location = 0) out vec4 out_colour;
uniform sampler2D u_picture;
uniform mat3 u_drawn_from_view;
uniform vec2 u_drawn_px;
uniform int u_samples;
vec3 encode(vec3 linear) {
  vec3 c = clamp(linear, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(vec3(0.0031308), c));
}
// Leaves values below 0.75 as they are and rolls off what is brighter, so that highlights keep their shape.
vec3 shoulder(vec3 c) {
  vec3 above = max(c - 0.75, 0.0);
  return min(c, 0.75) + 0.25 * (1.0 - exp(-above / 0.25));
}
vec3 drawn_at(vec2 view) {
  vec3 drawn = u_drawn_from_view * vec3(view, 1.0);
  vec2 source = (drawn.xy / drawn.z + 0.5) / u_drawn_px;
  source.y = 1.0 - source.y;
  vec3 sum = vec3(0.0);
  vec2 step_uv = 1.0 / (u_drawn_px * float(u_samples));
  for (int y = 0; y < u_samples; ++y) {
    for (int x = 0; x < u_samples; ++x) {
      vec2 offset = (vec2(x, y) - 0.5 * float(u_samples - 1)) * step_uv;
      sum += shoulder(texture(u_picture, source + offset).rgb);
    }
  }
  return encode(sum / float(u_samples * u_samples));
}
)glsl";

constexpr std::string_view flat_glsl = R"glsl(
in vec2 uv;
uniform vec2 u_shown_px;
void main() { out_colour = vec4(drawn_at(vec2(uv.x, 1.0 - uv.y) * u_shown_px - 0.5), 1.0); }
)glsl";

constexpr std::string_view lens_vertex_glsl = R"glsl(
layout(location = 0) in vec2 a_position;
layout(location = 1) in vec2 a_red;
layout(location = 2) in vec2 a_green;
layout(location = 3) in vec2 a_blue;
out vec2 red;
out vec2 green;
out vec2 blue;
void main() {
  red = a_red;
  green = a_green;
  blue = a_blue;
  gl_Position = vec4(a_position.x * 2.0 - 1.0, 1.0 - a_position.y * 2.0, 0.0, 1.0);
}
)glsl";

// Tangents come interpolated; each channel looks at a place of its own.
constexpr std::string_view lens_glsl = R"glsl(
in vec2 red;
in vec2 green;
in vec2 blue;
uniform sampler2D u_overlay;
uniform vec4 u_shown;     // fx fy cx cy
uniform vec2 u_shown_px;
uniform int u_has_overlay;
float channel_at(vec2 tangent, int channel) {
  vec2 at = (tangent * u_shown.xy + u_shown.zw + 0.5) / u_shown_px;
  if (any(lessThan(at, vec2(0.0))) || any(greaterThan(at, vec2(1.0)))) return 0.0;
  float value = drawn_at(tangent)[channel];
  if (u_has_overlay == 0) return value;
  vec4 over = texture(u_overlay, vec2(at.x, 1.0 - at.y));
  return over[channel] + (1.0 - over.a) * value;
}
void main() {
  out_colour = vec4(channel_at(red, 0), channel_at(green, 1), channel_at(blue, 2), 1.0);
}
)glsl";

glm::dmat3 pixel_from_tangent(const Pinhole& pinhole) {
  return {glm::dvec3(pinhole.fx_px, 0.0, 0.0), glm::dvec3(0.0, pinhole.fy_px, 0.0),
          glm::dvec3(pinhole.cx_px, pinhole.cy_px, 1.0)};
}

}  // namespace

Presentation whole_picture(const Frame& frame) {
  Presentation how;
  how.shown = widened(frame.eye.pinhole, -frame.margin_px);
  how.area = {0, 0, how.shown.width_px, how.shown.height_px};
  how.canvas_height_px = how.shown.height_px;
  how.drawn_from_shown = turned_to(frame, glm::dquat(1.0, 0.0, 0.0, 0.0));
  return how;
}

glm::dmat3 turned_to(const Frame& frame, const glm::dquat& turn) {
  const glm::dquat& drawn = frame.eye.world_from_eye.orientation;
  const glm::dmat3 warp = rotation_warp(widened(frame.eye.pinhole, -frame.margin_px), drawn, turn * drawn);
  glm::dmat3 into_margin(1.0);
  into_margin[2] = glm::dvec3(frame.margin_px, frame.margin_px, 1.0);
  return into_margin * warp;
}

Result<PresentPass> PresentPass::create() {
  PresentPass pass;
  const std::array vertex{fullscreen_vertex_glsl};
  const std::array flat{show_glsl, flat_glsl};
  Result<GlProgram> program = GlProgram::build("present", vertex, flat);
  if (!program) return program.error();
  pass.program_ = std::move(*program);
  const std::array lens_vertex{lens_vertex_glsl};
  const std::array lens{show_glsl, lens_glsl};
  program = GlProgram::build("present_lens", lens_vertex, lens);
  if (!program) return program.error();
  pass.lens_program_ = std::move(*program);
  pass.no_vertices_ = GlVertexArray::create();
  pass.lens_array_ = GlVertexArray::create();
  pass.lens_vertices_ = GlBuffer::create();
  pass.lens_indices_ = GlBuffer::create();
  return pass;
}

void PresentPass::upload(const std::shared_ptr<const LensMesh>& lens) {
  // Two eyes take turns; a mesh is tens of kilobytes.
  if (lens == uploaded_) return;
  uploaded_ = lens;
  glBindVertexArray(lens_array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, lens_vertices_.id());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(lens->vertices.size() * sizeof(LensVertex)),
               lens->vertices.data(), GL_STREAM_DRAW);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, lens_indices_.id());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(lens->indices.size() * sizeof(std::uint32_t)),
               lens->indices.data(), GL_STREAM_DRAW);
  GLuint location = 0;
  for (const std::size_t offset : {offsetof(LensVertex, position), offsetof(LensVertex, red),
                                   offsetof(LensVertex, green), offsetof(LensVertex, blue)}) {
    glEnableVertexAttribArray(location);
    glVertexAttribPointer(location++, 2, GL_FLOAT, GL_FALSE, sizeof(LensVertex),
                          reinterpret_cast<const void*>(offset));
  }
}

void PresentPass::draw(const FinishedPicture& picture, const Presentation& how) {
  const PixelArea& area = how.area;
  glViewport(area.x_px, how.canvas_height_px - area.y_px - area.height_px, area.width_px, area.height_px);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  bind_texture(0, GL_TEXTURE_2D, picture.colour);
  const GlProgram& program = how.lens == nullptr ? program_ : lens_program_;
  program.use();
  program.set("u_picture", 0);
  program.set("u_drawn_px", picture.size_px);
  program.set("u_samples", picture.samples);
  program.set("u_shown_px", glm::vec2(how.shown.width_px, how.shown.height_px));
  if (how.lens == nullptr) {
    program.set("u_drawn_from_view", glm::mat3(how.drawn_from_shown));
    glBindVertexArray(no_vertices_.id());
    glDrawArrays(GL_TRIANGLES, 0, 3);
    return;
  }
  program.set("u_drawn_from_view", glm::mat3(how.drawn_from_shown * pixel_from_tangent(how.shown)));
  program.set("u_shown", glm::vec4(how.shown.fx_px, how.shown.fy_px, how.shown.cx_px, how.shown.cy_px));
  program.set("u_has_overlay", picture.overlay == 0 ? 0 : 1);
  program.set("u_overlay", 1);
  bind_texture(1, GL_TEXTURE_2D, picture.overlay);
  upload(how.lens);
  glBindVertexArray(lens_array_.id());
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(how.lens->indices.size()), GL_UNSIGNED_INT, nullptr);
}

}  // namespace handloft::client
