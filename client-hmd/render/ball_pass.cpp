#include "client-hmd/render/ball_pass.h"

#include <array>

namespace handloft::client {
namespace {

constexpr std::string_view ball_glsl = R"glsl(
in vec2 corner;
in vec3 centre_in_eye;
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
uniform float u_reach;
uniform vec3 u_colour;
uniform float u_opacity;
void main() {
  float r2 = dot(corner, corner);
  if (r2 > 1.0) discard;
  vec3 in_eye_normal = vec3(corner, sqrt(1.0 - r2));
  vec3 surface = centre_in_eye + in_eye_normal * u_reach;
  vec4 clip = u_clip_from_eye * vec4(surface, 1.0);
  gl_FragDepth = clip.z / clip.w * 0.5 + 0.5;
  vec3 normal = transpose(mat3(u_eye_from_world)) * in_eye_normal;
  vec3 to_eye = transpose(mat3(u_eye_from_world)) * normalize(-surface);
  emit(studio_light(normal, to_eye, u_colour, 0.8), u_opacity, -surface.z);
}
)glsl";

}  // namespace

Result<BallPass> BallPass::create() {
  const std::array vertex{billboard_vertex_glsl};
  const std::array fragment{emit_glsl, studio_light_glsl, ball_glsl};
  Result<GlProgram> program = GlProgram::build("ball", vertex, fragment);
  if (!program) return program.error();
  BallPass pass;
  pass.program_ = std::move(*program);
  pass.no_vertices_ = GlVertexArray::create();
  return pass;
}

void BallPass::begin(const EyeUniforms& eye, Stage stage) const {
  program_.use();
  set_common_uniforms(program_, eye, stage);
  glBindVertexArray(no_vertices_.id());
}

void BallPass::draw(const Ball& ball) const {
  program_.set("u_reach", ball.radius_m);
  program_.set("u_centre", ball.centre);
  program_.set("u_colour", ball.colour);
  program_.set("u_opacity", ball.opacity);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

}  // namespace handloft::client
