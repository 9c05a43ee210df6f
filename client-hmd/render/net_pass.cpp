#include "client-hmd/render/net_pass.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "client-hmd/render/colours.h"

namespace handloft::client {
namespace {

constexpr float line_px_of_720 = 1.3F, point_radius_px_of_720 = 3.0F;
/// Opacity, as a share, of what is behind something.
constexpr float hidden_share = 0.22F;
constexpr float line_opacity = 0.75F;

// One strip of four a segment.
constexpr std::string_view line_vertex_glsl = R"glsl(
layout(location = 0) in vec3 a_from;
layout(location = 1) in vec3 a_to;
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
uniform vec2 u_viewport;
uniform float u_width;
out float across;
void main() {
  mat4 clip_from_world = u_clip_from_eye * u_eye_from_world;
  vec4 from = clip_from_world * vec4(a_from, 1.0);
  vec4 to = clip_from_world * vec4(a_to, 1.0);
  across = float(gl_VertexID & 1) * 2.0 - 1.0;
  if (min(from.w, to.w) < 1e-4) {  // Behind the eye.
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return;
  }
  vec2 way = (to.xy / to.w - from.xy / from.w) * u_viewport;
  vec2 normal = length(way) > 1e-4 ? normalize(vec2(-way.y, way.x)) : vec2(0.0, 1.0);
  vec4 clip = (gl_VertexID >> 1) == 0 ? from : to;
  // A pixel more on either side for the soft edge.
  clip.xy += normal * across * (u_width + 2.0) / u_viewport * clip.w;
  gl_Position = clip;
}
)glsl";

constexpr std::string_view line_fragment_glsl = R"glsl(
in float across;
layout(location = 0) out vec4 out_colour;
uniform vec3 u_colour;
uniform float u_width;
uniform float u_opacity;
void main() {
  float pixels = abs(across) * 0.5 * (u_width + 2.0);
  float edge = 1.0 - smoothstep(0.5 * u_width - 0.5, 0.5 * u_width + 0.5, pixels);
  out_colour = vec4(u_colour, u_opacity * edge);
}
)glsl";

constexpr std::string_view point_vertex_glsl = R"glsl(
layout(location = 0) in vec3 a_centre;
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
uniform vec2 u_viewport;
uniform float u_radius;
out vec2 corner;
void main() {
  vec4 clip = u_clip_from_eye * u_eye_from_world * vec4(a_centre, 1.0);
  corner = (vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0) * (u_radius + 1.0);
  clip.xy += corner * 2.0 / u_viewport * clip.w;
  gl_Position = clip;
}
)glsl";

constexpr std::string_view point_fragment_glsl = R"glsl(
in vec2 corner;
layout(location = 0) out vec4 out_colour;
uniform vec3 u_colour;
uniform vec3 u_rim;
uniform float u_radius;
uniform float u_opacity;
void main() {
  float r = length(corner);
  float inside = 1.0 - smoothstep(u_radius - 0.5, u_radius + 0.5, r);
  float core = 1.0 - smoothstep(0.62 * u_radius - 0.5, 0.62 * u_radius + 0.5, r);
  out_colour = vec4(mix(u_rim, u_colour, core), u_opacity * inside);
}
)glsl";

}  // namespace

Result<NetPass> NetPass::create() {
  NetPass pass;
  const std::array line_vertex{line_vertex_glsl};
  const std::array line_fragment{line_fragment_glsl};
  Result<GlProgram> lines = GlProgram::build("control net", line_vertex, line_fragment);
  if (!lines) return lines.error();
  pass.lines_ = std::move(*lines);
  const std::array point_vertex{point_vertex_glsl};
  const std::array point_fragment{point_fragment_glsl};
  Result<GlProgram> points = GlProgram::build("control points", point_vertex, point_fragment);
  if (!points) return points.error();
  pass.points_ = std::move(*points);
  return pass;
}

void NetPass::upload(Resident& resident, const std::shared_ptr<const ControlNet>& net) {
  if (!resident.line_array) {
    resident.line_array = GlVertexArray::create();
    resident.point_array = GlVertexArray::create();
    resident.segments = GlBuffer::create();
    resident.points = GlBuffer::create();
  }
  resident.net = net;
  std::vector<Vec3f> segments;
  const auto at = [&net](std::uint32_t row, std::uint32_t column) {
    return net->points[std::size_t{row} * net->columns + column];
  };
  for (std::uint32_t row = 0; row < net->rows; ++row) {
    for (std::uint32_t column = 0; column < net->columns; ++column) {
      if (row + 1 < net->rows) segments.insert(segments.end(), {at(row, column), at(row + 1, column)});
      if (column + 1 < net->columns) segments.insert(segments.end(), {at(row, column), at(row, column + 1)});
    }
  }
  const auto fill = [](const GlVertexArray& array, const GlBuffer& buffer, const std::vector<Vec3f>& values,
                       GLuint attributes) {
    glBindVertexArray(array.id());
    glBindBuffer(GL_ARRAY_BUFFER, buffer.id());
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(values.size() * sizeof(Vec3f)), values.data(),
                 GL_DYNAMIC_DRAW);
    for (GLuint i = 0; i < attributes; ++i) {
      glEnableVertexAttribArray(i);
      glVertexAttribPointer(i, 3, GL_FLOAT, GL_FALSE, static_cast<GLsizei>(attributes * sizeof(Vec3f)),
                            reinterpret_cast<const void*>(i * sizeof(Vec3f)));
      glVertexAttribDivisor(i, 1);
    }
  };
  fill(resident.line_array, resident.segments, segments, 2);
  fill(resident.point_array, resident.points, net->points, 1);
  glBindVertexArray(0);
  resident.segment_count = static_cast<GLsizei>(segments.size() / 2);
  resident.point_count = static_cast<GLsizei>(net->points.size());
}

void NetPass::draw(const Frame& frame, const EyeUniforms& eye) {
  std::erase_if(residents_, [&frame](const auto& item) { return frame.control_nets.count(item.first) == 0; });
  if (!frame.overlays.control_nets || frame.scene == nullptr) return;
  const SceneColours& colours = scene_colours(frame.colours);
  const float scale = std::max(1.0F, eye.viewport_px.y / 720.0F);
  const auto begin = [&eye](const GlProgram& program) {
    program.use();
    program.set("u_eye_from_world", eye.eye_from_world);
    program.set("u_clip_from_eye", eye.clip_from_eye);
    program.set("u_viewport", eye.viewport_px);
  };
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_FALSE);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  for (const auto& [depth, share] :
       {std::pair{GLenum{GL_GREATER}, hidden_share}, {GLenum{GL_LEQUAL}, 1.0F}}) {
    glDepthFunc(depth);
    for (const auto& [id, net] : frame.control_nets) {
      const auto shown = frame.scene->entities.find(id);
      if (shown == frame.scene->entities.end() || !shown->second->shows_surface()) continue;
      Resident& resident = residents_[id];
      if (resident.net != net) upload(resident, net);
      begin(lines_);
      lines_.set("u_width", line_px_of_720 * scale);
      lines_.set("u_colour", linear_rgb(colours.control_net));
      lines_.set("u_opacity", share * line_opacity);
      glBindVertexArray(resident.line_array.id());
      glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, resident.segment_count);
      begin(points_);
      points_.set("u_radius", point_radius_px_of_720 * scale);
      points_.set("u_colour", linear_rgb(colours.control_point));
      points_.set("u_rim", linear_rgb(colours.control_net));
      points_.set("u_opacity", share);
      glBindVertexArray(resident.point_array.id());
      glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, resident.point_count);
    }
  }
  glBindVertexArray(0);
  glDepthFunc(GL_LESS);
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
}

}  // namespace handloft::client
