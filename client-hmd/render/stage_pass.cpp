#include "client-hmd/render/stage_pass.h"

#include <array>
#include <glm/gtc/matrix_transform.hpp>

namespace handloft::client {
namespace {

constexpr int shadow_side_px = 256;
constexpr float shadow_half_extent_m =
    0.36F;                              ///< Half the side of the square of the table that can be in shadow.
constexpr float shadow_blur_px = 5.0F;  ///< Standard deviation: 14 mm, the softness of a large lamp.
constexpr float table_radius_m = 1.1F;  ///< Where the table has faded into the backdrop.

constexpr std::string_view backdrop_glsl = R"glsl(
in vec2 uv;
layout(location = 0) out vec4 out_colour;
uniform mat3 u_world_from_ray;
uniform vec2 u_tangent;  // of half the field of view
uniform vec2 u_centre;   // of the principal point, in clip space
void main() {
  vec3 ray = normalize(u_world_from_ray * vec3((uv * 2.0 - 1.0 - u_centre) * u_tangent, -1.0));
  float up = ray.z;
  vec3 floor_colour = vec3(0.60, 0.605, 0.615);
  vec3 horizon = vec3(0.70, 0.71, 0.725);
  vec3 zenith = vec3(0.40, 0.43, 0.47);
  vec3 colour = mix(horizon, zenith, smoothstep(0.0, 0.8, up));
  colour = mix(colour, floor_colour, smoothstep(0.0, 0.35, -up));
  vec2 from_middle = uv - vec2(0.5, 0.55);
  colour *= 1.0 - 0.38 * dot(from_middle, from_middle);
  out_colour = vec4(colour, 1.0);
}
)glsl";

constexpr std::string_view film_glsl = R"glsl(
in vec2 uv;
layout(location = 0) out vec4 out_colour;
uniform sampler2D u_film;
uniform vec4 u_pinhole;       // fx fy cx cy of the output, pixels
uniform vec2 u_output_px;
uniform vec4 u_camera;        // fx fy cx cy of the camera
uniform vec2 u_camera_px;
uniform vec4 u_distortion;    // k1 k2 p1 p2
uniform float u_k3;
void main() {
  vec2 pixel = vec2(uv.x, 1.0 - uv.y) * u_output_px - 0.5;
  vec2 p = (pixel - u_pinhole.zw) / u_pinhole.xy;
  float r2 = dot(p, p);
  float radial = 1.0 + r2 * (u_distortion.x + r2 * (u_distortion.y + r2 * u_k3));
  vec2 bent = p * radial + vec2(2.0 * u_distortion.z * p.x * p.y + u_distortion.w * (r2 + 2.0 * p.x * p.x),
                                u_distortion.z * (r2 + 2.0 * p.y * p.y) + 2.0 * u_distortion.w * p.x * p.y);
  vec2 source = (bent * u_camera.xy + u_camera.zw + 0.5) / u_camera_px;
  vec2 outside = max(abs(source - 0.5) - 0.5, 0.0) * u_camera_px;
  vec3 colour = texture(u_film, source).rgb;
  out_colour = vec4(mix(colour, vec3(0.02), clamp(max(outside.x, outside.y), 0.0, 1.0)), 1.0);
}
)glsl";

constexpr std::string_view table_vertex_glsl = R"glsl(
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
uniform float u_half_extent;
out vec2 at;
out vec3 to_table;
uniform vec3 u_eye_position;
void main() {
  at = (vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0) * u_half_extent;
  to_table = vec3(at, 0.0) - u_eye_position;
  gl_Position = u_clip_from_eye * u_eye_from_world * vec4(at, 0.0, 1.0);
}
)glsl";

// Grid lines one pixel wide at every distance (Ben Golus, "The best darn grid shader (yet)", without its
// phone-wire part): a line narrower than a pixel is drawn a pixel wide and as much paler.
constexpr std::string_view table_fragment_glsl = R"glsl(
in vec2 at;
in vec3 to_table;
layout(location = 0) out vec4 out_colour;
uniform sampler2D u_shadow;
uniform float u_shadow_half_extent;
uniform float u_half_extent;
uniform int u_film_behind;
float grid(vec2 p, float spacing, float width) {
  vec2 cell = p / spacing;
  vec2 pixel = max(fwidth(cell), 1e-6);
  vec2 half_width = max(vec2(0.5 * width / spacing), 0.5 * pixel);
  vec2 paler = clamp(vec2(width / spacing) / (2.0 * half_width), 0.0, 1.0);
  vec2 distance_to_line = abs(fract(cell - 0.5) - 0.5);
  vec2 line = (1.0 - smoothstep(half_width - 0.5 * pixel, half_width + 0.5 * pixel, distance_to_line)) * paler;
  line *= 1.0 - smoothstep(0.25, 0.6, pixel);
  return max(line.x, line.y);
}
void main() {
  vec2 in_shadow = at / u_shadow_half_extent * 0.5 + 0.5;
  vec2 border = abs(in_shadow - 0.5);
  float shadow = texture(u_shadow, in_shadow).r * (1.0 - smoothstep(0.42, 0.5, max(border.x, border.y)));
  shadow = 1.0 - exp(-1.3 * shadow);
  if (u_film_behind == 1) {
    out_colour = vec4(vec3(0.0), 0.35 * shadow);
    return;
  }
  float away = length(at) / u_half_extent;
  float there = 1.0 - smoothstep(0.45, 1.0, away);
  float slant = abs(normalize(to_table).z);
  there *= smoothstep(0.02, 0.25, slant);
  vec3 wood = vec3(0.735, 0.73, 0.72) * (1.0 - 0.16 * smoothstep(0.0, 0.6, away));
  vec3 colour = wood;
  colour = mix(colour, vec3(0.42, 0.44, 0.47), 0.16 * grid(at, 0.01, 0.0005) * (1.0 - smoothstep(0.15, 0.4, away)));
  colour = mix(colour, vec3(0.33, 0.36, 0.40), 0.42 * grid(at, 0.05, 0.0007));
  vec2 axis_pixel = fwidth(at);
  float x_axis = 1.0 - smoothstep(0.5, 1.5, abs(at.y) / axis_pixel.y);
  float y_axis = 1.0 - smoothstep(0.5, 1.5, abs(at.x) / axis_pixel.x);
  float near_centre = 1.0 - smoothstep(0.10, 0.16, length(at));
  colour = mix(colour, vec3(0.62, 0.20, 0.15), 0.55 * x_axis * near_centre);
  colour = mix(colour, vec3(0.18, 0.42, 0.22), 0.55 * y_axis * near_centre);
  colour *= 1.0 - 0.62 * shadow;
  out_colour = vec4(colour, there);
}
)glsl";

constexpr std::string_view blur_glsl = R"glsl(
in vec2 uv;
layout(location = 0) out vec4 out_colour;
uniform sampler2D u_source;
uniform vec2 u_step;
uniform float u_sigma;
void main() {
  float sum = 0.0;
  float weights = 0.0;
  for (int i = -12; i <= 12; ++i) {
    float weight = exp(-0.5 * float(i * i) / (u_sigma * u_sigma));
    sum += weight * texture(u_source, uv + float(i) * u_step).r;
    weights += weight;
  }
  out_colour = vec4(sum / weights);
}
)glsl";

GlTexture shadow_texture() {
  GlTexture texture = GlTexture::create();
  glBindTexture(GL_TEXTURE_2D, texture.id());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R16F, shadow_side_px, shadow_side_px, 0, GL_RED, GL_FLOAT, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return texture;
}

GlFramebuffer target_of(const GlTexture& texture) {
  GlFramebuffer target = GlFramebuffer::create();
  glBindFramebuffer(GL_FRAMEBUFFER, target.id());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture.id(), 0);
  return target;
}

}  // namespace

Result<StagePass> StagePass::create() {
  StagePass pass;
  const std::array fullscreen{fullscreen_vertex_glsl};
  const std::array table_vertex{table_vertex_glsl};
  struct Recipe {
    GlProgram* program;
    std::string_view name;
    std::span<const std::string_view> vertex;
    std::string_view fragment;
  };
  const std::array recipes{Recipe{&pass.backdrop_, "backdrop", fullscreen, backdrop_glsl},
                           Recipe{&pass.film_, "film", fullscreen, film_glsl},
                           Recipe{&pass.table_, "table", table_vertex, table_fragment_glsl},
                           Recipe{&pass.blur_, "blur", fullscreen, blur_glsl}};
  for (const Recipe& recipe : recipes) {
    const std::array fragment{recipe.fragment};
    Result<GlProgram> program = GlProgram::build(recipe.name, recipe.vertex, fragment);
    if (!program) return program.error();
    *recipe.program = std::move(*program);
  }
  pass.no_vertices_ = GlVertexArray::create();
  pass.film_texture_ = GlTexture::create();
  pass.shadow_texture_ = shadow_texture();
  pass.blur_texture_ = shadow_texture();
  pass.shadow_target_ = target_of(pass.shadow_texture_);
  pass.blur_target_ = target_of(pass.blur_texture_);
  return pass;
}

void StagePass::update_shadow(const Scene& scene, const SurfacePass& surfaces, const PointPass& points) {
  EyeUniforms above;
  // Looking down: eye x = world x, eye y = world y, eye z = world z - 5 m.
  above.eye_from_world = glm::translate(glm::mat4(1.0F), glm::vec3(0.0F, 0.0F, -5.0F));
  above.clip_from_eye = glm::ortho(-shadow_half_extent_m, shadow_half_extent_m, -shadow_half_extent_m,
                                   shadow_half_extent_m, 0.1F, 5.0F);
  above.position = glm::vec3(0.0F, 0.0F, 5.0F);
  above.viewport_px = glm::vec2(shadow_side_px);
  // Depth 5 m at this focal length makes a pixel what it is in this orthographic picture.
  above.focal_px = 5.0F * shadow_side_px / (2.0F * shadow_half_extent_m);
  glBindFramebuffer(GL_FRAMEBUFFER, shadow_target_.id());
  glViewport(0, 0, shadow_side_px, shadow_side_px);
  glClearColor(0.0F, 0.0F, 0.0F, 0.0F);
  glClear(GL_COLOR_BUFFER_BIT);
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendEquation(GL_MAX);
  surfaces.draw(scene, above, Stage::coverage);
  points.draw(scene, above, Stage::coverage);
  glBlendEquation(GL_FUNC_ADD);
  glDisable(GL_BLEND);

  blur_.use();
  blur_.set("u_source", 0);
  blur_.set("u_sigma", shadow_blur_px);
  glBindVertexArray(no_vertices_.id());
  constexpr float step = 1.0F / shadow_side_px;
  const std::array<std::pair<const GlTexture*, const GlFramebuffer*>, 2> rounds{
      {{&shadow_texture_, &blur_target_}, {&blur_texture_, &shadow_target_}}};
  for (std::size_t i = 0; i < rounds.size(); ++i) {
    blur_.set("u_step", i == 0 ? glm::vec2(step, 0.0F) : glm::vec2(0.0F, step));
    bind_texture(0, GL_TEXTURE_2D, rounds[i].first->id());
    glBindFramebuffer(GL_FRAMEBUFFER, rounds[i].second->id());
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
}

void StagePass::draw_background(const Frame& frame) {
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glBindVertexArray(no_vertices_.id());
  const Pinhole& out = frame.eye.pinhole;
  const glm::vec2 size(out.width_px, out.height_px);
  if (!frame.film) {
    backdrop_.use();
    const glm::mat3 rotation(glm::mat3_cast(frame.eye.world_from_eye.orientation));
    backdrop_.set("u_world_from_ray", rotation);
    backdrop_.set("u_tangent", glm::vec2(0.5 * out.width_px / out.fx_px, 0.5 * out.height_px / out.fy_px));
    backdrop_.set("u_centre", glm::vec2(2.0 * (out.cx_px + 0.5) / out.width_px - 1.0,
                                        1.0 - 2.0 * (out.cy_px + 0.5) / out.height_px));
    glDrawArrays(GL_TRIANGLES, 0, 3);
    return;
  }
  const FilmedPicture& film = *frame.film;
  bind_texture(0, GL_TEXTURE_2D, film_texture_.id());
  if (film.serial != film_serial_) {
    film_serial_ = film.serial;
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_SRGB8_ALPHA8, film.image->width_px, film.image->height_px, 0, GL_RGBA,
                 GL_UNSIGNED_BYTE, film.image->rgba.data());
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  }
  const Pinhole& camera = film.camera;
  film_.use();
  film_.set("u_film", 0);
  film_.set("u_output_px", size);
  film_.set("u_pinhole", glm::vec4(out.fx_px, out.fy_px, out.cx_px, out.cy_px));
  film_.set("u_camera", glm::vec4(camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px));
  film_.set("u_camera_px", glm::vec2(camera.width_px, camera.height_px));
  film_.set("u_distortion", glm::vec4(camera.distortion[0], camera.distortion[1], camera.distortion[2],
                                      camera.distortion[3]));
  film_.set("u_k3", static_cast<float>(camera.distortion[4]));
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

void StagePass::draw_table(const Frame& frame, const EyeUniforms& eye) const {
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  table_.use();
  table_.set("u_eye_from_world", eye.eye_from_world);
  table_.set("u_clip_from_eye", eye.clip_from_eye);
  table_.set("u_eye_position", eye.position);
  table_.set("u_half_extent", table_radius_m);
  table_.set("u_shadow_half_extent", shadow_half_extent_m);
  table_.set("u_film_behind", frame.film ? 1 : 0);
  table_.set("u_shadow", 0);
  bind_texture(0, GL_TEXTURE_2D, shadow_texture_.id());
  glBindVertexArray(no_vertices_.id());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glDisable(GL_BLEND);
}

}  // namespace handloft::client
