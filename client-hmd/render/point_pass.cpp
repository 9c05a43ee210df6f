#include "client-hmd/render/point_pass.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace handloft::client {
namespace {

// Each style takes three texels: r1..r4 | r5 a1 a2 a3 | a4 a5 radius 0.
constexpr int floats_per_style = 12;

constexpr std::string_view vertex_glsl = R"glsl(
layout(location = 0) in vec3 a_position;
layout(location = 1) in uint a_style;
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
uniform samplerBuffer u_styles;
uniform float u_focal_px;
uniform vec3 u_cell_low;   // Positions are shares of a cell's box.
uniform vec3 u_cell_size;
uniform float u_smallest_px;
uniform vec3 u_laid;
uniform vec3 u_in_the_air;
uniform int u_settled;  // Points that stand in the model; those behind are a gesture in the air.
flat out vec3 ink;
out vec2 corner;
out float eye_depth;
flat out float radius[5];
flat out float alpha[5];
void main() {
  ink = gl_InstanceID < u_settled ? u_laid : u_in_the_air;
  int at = int(a_style) * 3;
  vec4 s0 = texelFetch(u_styles, at);
  vec4 s1 = texelFetch(u_styles, at + 1);
  vec4 s2 = texelFetch(u_styles, at + 2);
  radius = float[5](s0.x, s0.y, s0.z, s0.w, s1.x);
  alpha = float[5](s1.y, s1.z, s1.w, s2.x, s2.y);
  vec4 in_eye = u_eye_from_world * vec4(u_cell_low + a_position * u_cell_size, 1.0);
  eye_depth = -in_eye.z;
  // The most certain points are the smallest: below a pixel they would vanish, so they are drawn a little larger.
  float outer = s2.z;
  float on_screen = outer * u_focal_px / max(eye_depth, 1e-3);
  float grow = max(1.0, u_smallest_px / max(on_screen, 1e-4));
  for (int k = 0; k < 5; ++k) radius[k] *= grow;
  float reach = outer * grow + 1.0 * max(eye_depth, 1e-3) / u_focal_px;
  corner = (vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0) * reach;
  in_eye.xy += corner;
  gl_Position = u_clip_from_eye * in_eye;
  // Depth of the sphere's near side, so that a point that lies on a surface is not cut in half by it.
  vec4 near_side = u_clip_from_eye * (in_eye + vec4(0.0, 0.0, min(outer, 0.5 * eye_depth), 0.0));
  gl_Position.z = near_side.z / near_side.w * gl_Position.w;
}
)glsl";

constexpr std::string_view fragment_glsl = R"glsl(
in vec2 corner;
in float eye_depth;
flat in float radius[5];
flat in float alpha[5];
flat in vec3 ink;
uniform float u_haze;  // What is left of faint shells.
void main() {
  float r = length(corner);
  float soft = 0.75 * max(fwidth(r), 1e-6);
  float transmitted = 1.0;
  for (int k = 0; k < 5; ++k) {
    float inside = 1.0 - smoothstep(radius[k] - soft, radius[k] + soft, r);
    transmitted *= 1.0 - alpha[k] * inside;
  }
  // A hint of roundness: lighter up left, as the studio's key light would have it.
  vec2 slope = corner / max(radius[0], 1e-6);
  float lit = 1.0 + 0.30 * dot(slope, vec2(-0.5, 0.6));
  float covered = min(1.0 - transmitted, 0.98);
  emit(ink * lit, covered * mix(u_haze, 1.0, covered), eye_depth);
}
)glsl";

// Linear RGB: warm for the stroke in the air; what is laid has the ink of its shape.
constexpr glm::vec3 provisional_ink{0.75F, 0.16F, 0.035F};
/// OpenGL takes steps of 2048 bytes between points at least.
constexpr std::size_t widest_stride = 2048 / sizeof(FuzzyPoint);
constexpr float smallest_point_px_of_720 = 1.4F;
/// Over the shape's own surface only the certain cores of points are plain, or they would hide it.
constexpr float haze_over_surface = 0.25F;

const void* offset(std::size_t bytes) {
  return reinterpret_cast<const void*>(bytes);
}

}  // namespace

float shells_opacity(const ShellStyle& style, float r_m) {
  float transmitted = 1.0F;
  for (std::size_t k = 0; k < style.shell_radius_m.size(); ++k) {
    if (r_m < style.shell_radius_m[k]) transmitted *= 1.0F - style.shell_alpha[k];
  }
  return 1.0F - transmitted;
}

Result<PointPass> PointPass::create() {
  const std::array vertex{vertex_glsl};
  const std::array fragment{emit_glsl, fragment_glsl};
  Result<GlProgram> program = GlProgram::build("points", vertex, fragment);
  if (!program) return program.error();
  PointPass pass;
  pass.program_ = std::move(*program);
  return pass;
}

void PointPass::update(const Scene& scene, const SurfacePass& surfaces) {
  std::erase_if(residents_, [&scene, this](const auto& item) {
    const auto found = scene.entities.find(item.first);
    const bool gone = found == scene.entities.end() || found->second->points == nullptr;
    if (gone && sorter_ != nullptr) sorter_->forget(item.first);
    return gone;
  });
  for (const auto& [id, entity] : scene.entities) {
    if (entity->points == nullptr) continue;
    Resident& resident = residents_[id];
    resident.ink = surfaces.colour_of(id).ink;
    if (resident.points == entity->points && resident.settled == entity->settled_points) continue;
    resident.settled = entity->settled_points;
    if (!resident.array) {
      resident.array = GlVertexArray::create();
      resident.instances = GlBuffer::create();
      resident.styles = GlBuffer::create();
      resident.style_texture = GlTexture::create();
    }
    const std::shared_ptr<const PointSet> former = std::exchange(resident.points, entity->points);
    const PointSet& set = *entity->points;
    const bool was_large = std::exchange(resident.large, set.points.size() >= fewest_points_in_cells &&
                                                             set.styles.size() <= max_packed_styles);
    if (resident.large) {
      update_large(id, resident);
    } else {
      resident.first_loose = 0;
      upload_points(resident, was_large ? nullptr : former.get(), set);
      resident.count = static_cast<GLsizei>(set.points.size());
    }
    glBindVertexArray(resident.array.id());
    for (const GLuint attribute : {0U, 1U}) {  // Where they lie is said when they are drawn.
      glEnableVertexAttribArray(attribute);
      glVertexAttribDivisor(attribute, 1);
    }
    glBindVertexArray(0);

    std::vector<float> texels;
    texels.reserve(set.styles.size() * floats_per_style);
    for (const ShellStyle& style : set.styles) {
      texels.insert(texels.end(), style.shell_radius_m.begin(), style.shell_radius_m.end());
      texels.insert(texels.end(), style.shell_alpha.begin(), style.shell_alpha.end());
      texels.push_back(style.radius_m);
      texels.push_back(0.0F);
    }
    glBindBuffer(GL_TEXTURE_BUFFER, resident.styles.id());
    glBufferData(GL_TEXTURE_BUFFER, static_cast<GLsizeiptr>(texels.size() * sizeof(float)), texels.data(),
                 GL_DYNAMIC_DRAW);
    glBindTexture(GL_TEXTURE_BUFFER, resident.style_texture.id());
    glTexBuffer(GL_TEXTURE_BUFFER, GL_RGBA32F, resident.styles.id());
  }
}

namespace {

/// Whether the first `count` points of both are the same.
bool same_beginning(const PointSet& one, const PointSet& other, std::size_t count) {
  return &one == &other ||
         (one.points.size() >= count && other.points.size() >= count &&
          std::memcmp(one.points.data(), other.points.data(), count * sizeof(FuzzyPoint)) == 0);
}

}  // namespace

void PointPass::update_large(const std::string& id, Resident& resident) {
  if (sorter_ == nullptr) sorter_ = std::make_unique<PointSorter>();
  const PointSet& set = *resident.points;
  const std::size_t settled = std::min<std::size_t>(resident.settled, set.points.size());
  const bool holds = resident.sorted != nullptr && resident.sorted->of.count <= settled &&
                     same_beginning(*resident.sorted->of.set, set, resident.sorted->of.count);
  // Cells are made anew when a quarter came since.
  const std::size_t loose = holds ? settled - resident.sorted->of.count : settled;
  if (!holds || loose > std::max(fewest_points_in_cells, settled / 4)) {
    sorter_->want(id, {resident.points, settled});
  }
  upload_loose(resident);
}

void PointPass::upload_loose(Resident& resident) {
  const PointSet& set = *resident.points;
  resident.first_loose =
      resident.sorted == nullptr ? 0 : std::min(resident.sorted->of.count, set.points.size());
  std::size_t count = set.points.size() - resident.first_loose;
  if (resident.sorted == nullptr || count > resident.sorted->of.count) {
    count = std::min(count, fewest_points_in_cells);  // No more than a frame may cost, until there are cells.
  }
  resident.count = static_cast<GLsizei>(count);
  resident.capacity = count;
  glBindBuffer(GL_ARRAY_BUFFER, resident.instances.id());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(count * sizeof(FuzzyPoint)),
               set.points.data() + resident.first_loose, GL_DYNAMIC_DRAW);
}

bool PointPass::follow(const Scene& scene, PointDetail detail) {
  detail_ = detail;
  if (sorter_ == nullptr) return false;
  if (detail == PointDetail::all) sorter_->wait();
  bool any = false;
  for (auto& [id, resident] : residents_) {
    if (!resident.large || scene.entities.count(id) == 0) continue;
    const std::shared_ptr<const SortedPoints> newest = sorter_->newest(id);
    if (newest == nullptr || newest == resident.sorted) continue;
    any = true;
    resident.sorted = newest;
    if (!resident.cell_array) {
      resident.cell_array = GlVertexArray::create();
      resident.packed = GlBuffer::create();
    }
    const std::vector<PackedPoint>& points = newest->cells.points;
    glBindBuffer(GL_ARRAY_BUFFER, resident.packed.id());
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(points.size() * sizeof(PackedPoint)), points.data(),
                 GL_STATIC_DRAW);
    upload_loose(resident);
  }
  return any;
}

void PointPass::upload_points(Resident& resident, const PointSet* former, const PointSet& set) {
  glBindBuffer(GL_ARRAY_BUFFER, resident.instances.id());
  const std::size_t count = set.points.size();
  static_assert(sizeof(FuzzyPoint) == 16 && std::is_trivially_copyable_v<FuzzyPoint>);
  std::size_t first = 0;  // Of those that the card does not have yet.
  if (former != nullptr && former->points.size() <= count && count <= resident.capacity &&
      std::memcmp(former->points.data(), set.points.data(), former->points.size() * sizeof(FuzzyPoint)) ==
          0) {
    first = former->points.size();
  }
  if (count > resident.capacity) {
    resident.capacity = count + count / 2;
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(resident.capacity * sizeof(FuzzyPoint)), nullptr,
                 GL_DYNAMIC_DRAW);
  }
  if (first == count) return;
  glBufferSubData(GL_ARRAY_BUFFER, static_cast<GLintptr>(first * sizeof(FuzzyPoint)),
                  static_cast<GLsizeiptr>((count - first) * sizeof(FuzzyPoint)), set.points.data() + first);
}

std::vector<PointPass::Drawn> PointPass::to_draw(const Scene& scene, const EyeUniforms& eye,
                                                 Stage stage) const {
  CellView view{eye.clip_from_eye * eye.eye_from_world, eye.position, eye.focal_px};
  if (in_detail(stage)) view.most_layers = std::numeric_limits<float>::infinity();
  std::vector<Drawn> all;
  for (const auto& [id, entity] : scene.entities) {
    const auto found = residents_.find(id);
    if (!entity->shows_points() || found == residents_.end()) continue;
    Drawn& drawn = all.emplace_back();
    drawn.entity = entity.get();
    drawn.resident = &found->second;
    if (!found->second.large || found->second.sorted == nullptr) continue;
    drawn.cells.reserve(found->second.sorted->cells.cells.size());
    for (const PointCell& cell : found->second.sorted->cells.cells) {
      drawn.cells.push_back(share_of(cell, view));
    }
  }
  return all;
}

double PointPass::cost_of(const Drawn& drawn, const DiscView& view) {
  const Resident& resident = *drawn.resident;
  const PointSet& set = *resident.points;
  double cost =
      cost_px(std::span(set.points).subspan(resident.first_loose, static_cast<std::size_t>(resident.count)),
              set.styles, view);
  for (std::size_t i = 0; i < drawn.cells.size(); ++i) {
    if (drawn.cells[i].count == 0) continue;
    const PointCell& cell = resident.sorted->cells.cells[i];
    cost += static_cast<double>(drawn.cells[i].count) *
            static_cast<double>(
                mean_disc_cost_px(cell, resident.sorted->cells, resident.sorted->of.set->styles, view));
  }
  return cost;
}

void PointPass::draw_cells(const Drawn& drawn, double share) const {
  static_assert(sizeof(PackedPoint) == 8 && std::is_trivially_copyable_v<PackedPoint>);
  const Resident& resident = *drawn.resident;
  program_.set("u_settled", std::numeric_limits<int>::max());
  glBindVertexArray(resident.cell_array.id());
  glBindBuffer(GL_ARRAY_BUFFER, resident.packed.id());
  for (const GLuint attribute : {0U, 1U}) {
    glEnableVertexAttribArray(attribute);
    glVertexAttribDivisor(attribute, 1);
  }
  for (std::size_t i = 0; i < drawn.cells.size(); ++i) {
    if (drawn.cells[i].count == 0) continue;
    const PointCell& cell = resident.sorted->cells.cells[i];
    const CellShare of_cell = thinned(drawn.cells[i], share);
    const std::size_t at = cell.first * sizeof(PackedPoint);
    glVertexAttribPointer(0, 3, GL_UNSIGNED_SHORT, GL_TRUE, sizeof(PackedPoint), offset(at));
    glVertexAttribIPointer(1, 1, GL_UNSIGNED_SHORT, sizeof(PackedPoint),
                           offset(at + offsetof(PackedPoint, style)));
    program_.set("u_cell_low", cell.low);
    program_.set("u_cell_size", cell.size);
    program_.set("u_boost", of_cell.boost);
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(of_cell.count));
  }
}

void PointPass::draw_loose(const Drawn& drawn, double share) const {
  const Resident& resident = *drawn.resident;
  if (resident.count == 0) return;
  const std::size_t first = std::min<std::size_t>(drawn.entity->settled_points, resident.first_loose);
  const std::size_t settled = drawn.entity->settled_points - first;
  const EveryNth every = every_nth(static_cast<std::size_t>(resident.count), share);
  program_.set("u_cell_low", glm::vec3(0.0F));
  program_.set("u_cell_size", glm::vec3(1.0F));
  program_.set("u_boost", every.boost);
  glBindVertexArray(resident.array.id());
  glBindBuffer(GL_ARRAY_BUFFER, resident.instances.id());
  const auto draw = [](std::size_t from, std::size_t stride, std::size_t count) {
    const std::size_t at = from * sizeof(FuzzyPoint);
    const auto bytes = static_cast<GLsizei>(stride * sizeof(FuzzyPoint));
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, bytes, offset(at + offsetof(FuzzyPoint, position)));
    glVertexAttribIPointer(1, 1, GL_UNSIGNED_INT, bytes, offset(at + offsetof(FuzzyPoint, style)));
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(count));
  };
  if (every.n <= widest_stride) {
    program_.set("u_settled", static_cast<int>((settled + every.n - 1) / every.n));
    draw(0, every.n, every.count);
    return;
  }
  for (std::size_t i = 0; i < every.count; ++i) {
    const std::size_t at = i * every.n;
    program_.set("u_settled", at < settled ? 1 : 0);
    draw(at, 1, 1);
  }
}

void PointPass::draw(const Scene& scene, const EyeUniforms& eye, Stage stage) const {
  DiscView view{eye.eye_from_world, eye.clip_from_eye, eye.viewport_px, eye.focal_px, 0.0F};
  view.smallest_px =
      std::max(smallest_point_px_of_720, smallest_point_px_of_720 * eye.viewport_px.y / 720.0F);
  program_.use();
  set_common_uniforms(program_, eye, stage);
  program_.set("u_styles", 0);
  program_.set("u_focal_px", eye.focal_px);
  program_.set("u_smallest_px", view.smallest_px);
  const std::vector<Drawn> all = to_draw(scene, eye, stage);
  double cost = 0.0;
  for (const Drawn& drawn : all) cost += cost_of(drawn, view);
  const double share =
      share_within(cost, view, in_detail(stage) ? most_coverings_of_a_still : most_coverings_of_a_frame);
  for (const Drawn& drawn : all) {
    const auto user = user_colours_.find(drawn.entity->provisional_by);
    program_.set("u_in_the_air", user == user_colours_.end() ? provisional_ink : user->second);
    program_.set("u_laid", drawn.resident->ink);
    program_.set("u_haze",
                 drawn.entity->shows_surface() && stage != Stage::coverage ? haze_over_surface : 1.0F);
    bind_texture(0, GL_TEXTURE_BUFFER, drawn.resident->style_texture.id());
    draw_cells(drawn, share);
    draw_loose(drawn, share);
  }
  glBindVertexArray(0);
}

}  // namespace handloft::client
