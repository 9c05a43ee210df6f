#include "client-hmd/render/stage_pass.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <glm/gtc/matrix_transform.hpp>

namespace handloft::client {
namespace {

constexpr int shadow_side_px = 256;
constexpr float smallest_half_extent_m = 0.12F, largest_half_extent_m = 3.0F;
constexpr float shadow_margin_m = 0.10F;  ///< Beyond the work: its shadow is wider than it.
/// Standard deviations: the lamp's shadow, the seam of contact, and what the whole room takes part in.
constexpr float shadow_blur_m = 0.013F, contact_blur_m = 0.005F, room_blur_m = 0.028F;
constexpr float shadow_eye_m = 20.0F;   ///< Over the table; nothing is taller.
constexpr float table_radius_m = 1.6F;  ///< Where the table has faded into the backdrop.

constexpr std::string_view backdrop_glsl = R"glsl(
in vec2 uv;
layout(location = 0) out vec4 out_colour;
uniform mat3 u_world_from_ray;
uniform vec2 u_tangent;  // of half the field of view
uniform vec2 u_centre;   // of the principal point, in clip space
void main() {
  vec3 ray = normalize(u_world_from_ray * vec3((uv * 2.0 - 1.0 - u_centre) * u_tangent, -1.0));
  float up = ray.z;
  // A paper sweep: no line between floor and wall.
  vec3 colour = mix(vec3(0.455, 0.462, 0.475), vec3(0.135, 0.146, 0.165), smoothstep(-0.08, 0.70, up));
  colour = mix(colour, vec3(0.52, 0.522, 0.525), smoothstep(0.0, 0.55, -up));
  vec2 from_middle = uv - vec2(0.5, 0.50);
  colour *= 1.0 - 0.50 * dot(from_middle, from_middle);
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
uniform mat3 u_camera_from_eye;
void main() {
  vec2 pixel = vec2(uv.x, 1.0 - uv.y) * u_output_px - 0.5;
  vec3 ray = u_camera_from_eye * vec3((pixel - u_pinhole.zw) / u_pinhole.xy, 1.0);
  vec2 p = ray.xy / max(ray.z, 1e-4);
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

// Grid lines of the same width in pixels at every distance; a grid whose lines would run together fades.
constexpr std::string_view table_fragment_glsl = R"glsl(
in vec2 at;
in vec3 to_table;
layout(location = 0) out vec4 out_colour;
uniform sampler2D u_shadow;
uniform vec4 u_shadow_from_world;  // scale, offset
uniform float u_half_extent;
uniform int u_film_behind;
uniform int u_bare;
float grid(vec2 p, float spacing, float line_px) {
  vec2 cell = p / spacing;
  vec2 pixel = max(fwidth(cell), 1e-6);
  vec2 from_line = abs(fract(cell - 0.5) - 0.5) / pixel;
  vec2 line = 1.0 - smoothstep(0.5 * line_px - 0.5, 0.5 * line_px + 0.5, from_line);
  line *= 1.0 - smoothstep(0.06, 0.30, pixel);
  return max(line.x, line.y);
}
void main() {
  vec2 in_shadow = at * u_shadow_from_world.x + u_shadow_from_world.yz;
  vec2 border = abs(in_shadow - 0.5);
  vec4 above = texture(u_shadow, in_shadow) * (1.0 - smoothstep(0.42, 0.5, max(border.x, border.y)));
  float height = above.b / max(above.r, 0.02);
  float lamp = above.r * mix(0.14, 0.56, exp(-height / 0.09));
  float shadow = 1.0 - (1.0 - lamp) * (1.0 - 0.36 * above.a * exp(-height / 0.60)) * (1.0 - 0.65 * above.g);
  if (u_film_behind == 1) {
    out_colour = vec4(vec3(0.0), 0.8 * shadow);
    return;
  }
  float away = length(at) / u_half_extent;
  float there = 1.0 - smoothstep(0.08, 0.95, away);
  float slant = abs(normalize(to_table).z);
  there *= smoothstep(0.02, 0.25, slant);
  vec3 colour = vec3(0.660, 0.658, 0.652) * (1.0 - 0.14 * smoothstep(0.0, 0.4, away));
  if (u_bare == 0) {
    float near_enough = 1.0 - smoothstep(0.10, 0.42, away);
    colour = mix(colour, vec3(0.40, 0.42, 0.45), 0.13 * near_enough * grid(at, 0.01, 1.0));
    colour = mix(colour, vec3(0.32, 0.345, 0.38), 0.34 * near_enough * grid(at, 0.05, 1.3));
    vec2 axis_pixel = fwidth(at);
    float x_axis = 1.0 - smoothstep(0.5, 1.5, abs(at.y) / axis_pixel.y);
    float y_axis = 1.0 - smoothstep(0.5, 1.5, abs(at.x) / axis_pixel.x);
    float near_centre = 1.0 - smoothstep(0.10, 0.16, length(at));
    colour = mix(colour, vec3(0.62, 0.20, 0.15), 0.45 * x_axis * near_centre);
    colour = mix(colour, vec3(0.18, 0.42, 0.22), 0.45 * y_axis * near_centre);
  }
  // Shadows are a little cool: what is left is the sky's light.
  colour *= mix(vec3(1.0), vec3(0.10, 0.115, 0.14), shadow);
  out_colour = vec4(colour, there);
}
)glsl";

constexpr std::string_view blur_glsl = R"glsl(
in vec2 uv;
layout(location = 0) out vec4 out_colour;
uniform sampler2D u_source;
uniform vec2 u_step;
uniform vec4 u_weights[13];  // of each channel, from the middle outwards
void main() {
  vec4 sum = u_weights[0] * texture(u_source, uv);
  for (int i = 1; i <= 12; ++i) {
    vec2 aside = float(i) * u_step;
    sum += u_weights[i] * (texture(u_source, uv + aside) + texture(u_source, uv - aside));
  }
  out_colour = sum;
}
)glsl";
constexpr int blur_reach = 12;

/// Gaussians of `sigma` steps, each with a sum of 1 over both sides.
std::array<glm::vec4, blur_reach + 1> blur_weights(const glm::vec4& sigma) {
  std::array<glm::vec4, blur_reach + 1> weights;
  glm::vec4 sum(0.0F);
  for (int i = 0; i <= blur_reach; ++i) {
    const glm::vec4 weight = glm::exp(-0.5F * static_cast<float>(i * i) / (sigma * sigma));
    weights[static_cast<std::size_t>(i)] = weight;
    sum += i == 0 ? weight : 2.0F * weight;
  }
  for (glm::vec4& weight : weights) weight /= sum;
  return weights;
}

GlTexture shadow_texture() {
  GlTexture texture = GlTexture::create();
  glBindTexture(GL_TEXTURE_2D, texture.id());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA16F, shadow_side_px, shadow_side_px, 0, GL_RGBA, GL_FLOAT, nullptr);
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
  frame_work(scene, surfaces);
  const float half = shadow_half_extent_m_;
  EyeUniforms above;
  // Looking down: eye x = world x, eye y = world y, eye z = world z - height.
  above.eye_from_world = glm::translate(glm::mat4(1.0F), glm::vec3(-shadow_centre_, -shadow_eye_m));
  above.clip_from_eye = glm::ortho(-half, half, -half, half, 0.1F, shadow_eye_m);
  above.position = glm::vec3(shadow_centre_, shadow_eye_m);
  above.above_table_m = shadow_eye_m;
  above.viewport_px = glm::vec2(shadow_side_px);
  // At this focal length the table's pixels are what they are in this orthographic picture.
  above.focal_px = shadow_eye_m * shadow_side_px / (2.0F * half);
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

  // Two pixels a step: the textures' filter takes the one between.
  constexpr float step = 2.0F / shadow_side_px;
  const float steps_per_m = shadow_side_px / (4.0F * half);
  const auto sigma = [steps_per_m](float blur_m) { return std::max(0.7F, blur_m * steps_per_m); };
  blur_.use();
  blur_.set("u_source", 0);
  const auto weights = blur_weights({sigma(shadow_blur_m), sigma(contact_blur_m), sigma(shadow_blur_m),
                                     std::min(sigma(room_blur_m), 7.0F)});
  for (std::size_t i = 0; i < weights.size(); ++i) {
    blur_.set(fmt::format("u_weights[{}]", i).c_str(), weights[i]);
  }
  glBindVertexArray(no_vertices_.id());
  const std::array<std::pair<const GlTexture*, const GlFramebuffer*>, 2> rounds{
      {{&shadow_texture_, &blur_target_}, {&blur_texture_, &shadow_target_}}};
  for (std::size_t i = 0; i < rounds.size(); ++i) {
    blur_.set("u_step", i == 0 ? glm::vec2(step, 0.0F) : glm::vec2(0.0F, step));
    bind_texture(0, GL_TEXTURE_2D, rounds[i].first->id());
    glBindFramebuffer(GL_FRAMEBUFFER, rounds[i].second->id());
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
}

/// The square about all that is seen from above; as it was while that hardly changes, so that shadows of what
/// is dragged do not swim.
void StagePass::frame_work(const Scene& scene, const SurfacePass& surfaces) {
  std::optional<GroundExtent> work = surfaces.extent();
  for (const auto& [id, entity] : scene.entities) {
    if (!entity->shows_points()) continue;
    for (const FuzzyPoint& point : entity->points->points) {
      const glm::vec2 at(point.position.x, point.position.y);
      if (!work) work = GroundExtent{at, at};
      work->low = glm::min(work->low, at);
      work->high = glm::max(work->high, at);
    }
  }
  if (!work) return;
  const glm::vec2 middle = 0.5F * (work->low + work->high);
  const glm::vec2 half = 0.5F * (work->high - work->low);
  const float wanted =
      std::clamp(std::max(half.x, half.y) + shadow_margin_m, smallest_half_extent_m, largest_half_extent_m);
  const glm::vec2 off = glm::abs(middle - shadow_centre_) + half;
  const bool fits = std::max(off.x, off.y) + 0.6F * shadow_margin_m < shadow_half_extent_m_;
  if (fits && shadow_half_extent_m_ < 1.5F * wanted) return;
  shadow_centre_ = middle;
  shadow_half_extent_m_ = wanted;
}

SurroundingsMap StagePass::surroundings() const {
  const float scale = 0.5F / shadow_half_extent_m_;
  return {shadow_texture_.id(), scale, glm::vec2(0.5F) - scale * shadow_centre_};
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
  film_.set("u_camera_from_eye", film.camera_from_eye);
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
  const SurroundingsMap map = surroundings();
  table_.set("u_shadow_from_world", glm::vec4(map.scale_per_m, map.offset, 0.0F));
  table_.set("u_bare", frame.surroundings == Surroundings::bare ? 1 : 0);
  table_.set("u_film_behind", frame.film ? 1 : 0);
  table_.set("u_shadow", 0);
  bind_texture(0, GL_TEXTURE_2D, shadow_texture_.id());
  glBindVertexArray(no_vertices_.id());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glDisable(GL_BLEND);
}

}  // namespace handloft::client
