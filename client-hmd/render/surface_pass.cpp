#include "client-hmd/render/surface_pass.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <set>

#include "client-hmd/render/curvature_map.h"
#include "client-hmd/render/surface_shader.h"

namespace handloft::client {
namespace {

/// Values of `u_look`.
enum class Look : int {
  studio = 0,
  car_paint = 1,
  silver = 2,
  zebra = 3,
  distances = 4,
  curvature = 5,
  clay = 6,
};

struct Material {
  glm::vec3 base{0.5F};  ///< Linear RGB.
  float gloss = 1.0F;
};
// Dull putty without reflections: nothing that hands shape.
constexpr Material reference{{0.225F, 0.205F, 0.175F}, 0.0F};
constexpr float shape_gloss = 1.0F;
/// How much a selected shape takes on the colour of selection; its wider contour tells it too.
constexpr float selected_tint = 0.22F;
constexpr float selected_line = 2.6F;         ///< Contours.
constexpr float faded_presence = 0.15F;       ///< Of a reference, while distances to it are shown.
constexpr float ramp_albedo = 0.75F;          ///< Light on a bright base would wash the colours out.
constexpr float line_px_of_720 = 1.25F;       ///< Width of a contour; grows with the picture.
constexpr float contour_darkness = 0.10F;     ///< Of the shape's own colour.
constexpr float as_good_as_opaque = 0.985F;   ///< As in emit_glsl.
constexpr float seen_at_all = 1.0F / 255.0F;  ///< Fainter is no part of the extent.

/// Fewer say little of a flat face, more run together on a round one.
constexpr float zebra_stripes = 14.0F;
/// Between full light and the edge of the shadow.
constexpr float isophote_count = 18.0F;

constexpr GLuint distance_attribute = 3, curvature_attribute = 4;
constexpr int ramp_unit = 2, surroundings_unit = 3;
constexpr int ramp_texels = 128;  ///< The shader's share of a texel depends on it.

const void* offset(std::size_t bytes) {
  return reinterpret_cast<const void*>(bytes);
}

Look look_of_shading(Shading shading) {
  switch (shading) {
    case Shading::studio:
      return Look::studio;
    case Shading::clay:
      return Look::clay;
    case Shading::car_paint:
      return Look::car_paint;
    case Shading::silver:
      return Look::silver;
    case Shading::zebra:
      return Look::zebra;
    case Shading::curvature:
      return Look::curvature;
  }
  return Look::studio;
}

}  // namespace

void set_common_uniforms(const GlProgram& program, const EyeUniforms& eye, Stage stage) {
  program.set("u_eye_from_world", eye.eye_from_world);
  program.set("u_clip_from_eye", eye.clip_from_eye);
  program.set("u_eye_position", eye.position);
  program.set("u_stage", static_cast<int>(stage));
  program.set("u_above", eye.above_table_m);
  program.set("u_weights", glm::vec4(eye.weights.reference_m, eye.weights.falloff_m, eye.weights.smallest,
                                     eye.weights.largest));
  program.set("u_opaque_depth", 6);  // Texture units that the peeling binds.
  program.set("u_last_depth", 7);
  program.set("u_hand_before", eye.hand_before ? 1 : 0);
  program.set("u_hand_mask", 8);
  program.set("u_behind_front", eye.behind_front ? 1 : 0);
  program.set("u_behind_veil", eye.behind_veil ? 1 : 0);
  program.set("u_veil", 9);
  program.set("u_depth_terms", glm::vec2(eye.clip_from_eye[2][2], eye.clip_from_eye[3][2]));
}

Result<SurfacePass> SurfacePass::create() {
  SurfacePass pass;
  constexpr std::string_view with_wires = "#define WIRES\n";
  const std::array vertex{surface_vertex_glsl};
  const std::array fragment{emit_glsl, studio_light_glsl, surface_fragment_glsl};
  Result<GlProgram> program = GlProgram::build("surface", vertex, fragment);
  if (!program) return program.error();
  pass.program_ = std::move(*program);
  const std::array wire_vertex{with_wires, surface_vertex_glsl};
  const std::array wire_geometry{surface_wire_geometry_glsl};
  const std::array wire_fragment{with_wires, emit_glsl, studio_light_glsl, surface_fragment_glsl};
  Result<GlProgram> wires = GlProgram::build("surface with wires", wire_vertex, wire_fragment, wire_geometry);
  if (!wires) return wires.error();
  pass.wire_program_ = std::move(*wires);
  pass.make_ramps(ColourScheme::normal);
  return pass;
}

void SurfacePass::make_ramps(ColourScheme scheme) {
  scheme_ = scheme;
  const SceneColours& colours = scene_colours(scheme);
  const auto upload_ramp = [](GlTexture& texture, const auto& colour_at) {
    std::vector<glm::vec3> texels;
    for (int i = 0; i < ramp_texels; ++i) {
      const float share = 2.0F * static_cast<float>(i) / (ramp_texels - 1) - 1.0F;
      texels.push_back(ramp_albedo * colour_at(share));
    }
    texture = GlTexture::create();
    glBindTexture(GL_TEXTURE_2D, texture.id());
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB16F, ramp_texels, 1, 0, GL_RGB, GL_FLOAT, texels.data());
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  };
  upload_ramp(distance_ramp_, [&colours](float share) { return ramp_colour(colours.distance, share); });
  upload_ramp(curvature_ramp_,
              [&colours](float share) { return curvature_colour(colours.curvature, share); });
}

void SurfacePass::update(const Scene& scene) {
  std::erase_if(residents_, [&scene](const auto& item) {
    const auto found = scene.entities.find(item.first);
    return found == scene.entities.end() || found->second->surface == nullptr;
  });
  std::set<std::string_view> names;
  for (const auto& [id, entity] : scene.entities) names.insert(without_mirror(id));
  colours_.keep_only([&names](std::string_view name) { return names.count(name) != 0; });
  for (const auto& [id, entity] : scene.entities) {
    if (entity->kind != EntityKind::reference) (void)colours_.of(id);
  }
  for (const auto& [id, entity] : scene.entities) {
    if (entity->surface == nullptr) continue;
    Resident& resident = residents_[id];
    if (resident.mesh != entity->surface) upload(resident, *entity);
    update_distances(resident, *entity);
  }
}

void SurfacePass::upload(Resident& resident, const Entity& entity) {
  if (!resident.array) {
    resident.array = GlVertexArray::create();
    resident.vertices = GlBuffer::create();
    resident.indices = GlBuffer::create();
  }
  const SurfaceMesh& mesh = *entity.surface;
  // A surface that is dragged keeps its triangles.
  const bool same_triangles = resident.mesh != nullptr && mesh.topology != 0 &&
                              resident.mesh->topology == mesh.topology &&
                              resident.mesh->indices.size() == mesh.indices.size();
  resident.mesh = entity.surface;
  glBindVertexArray(resident.array.id());
  glBindBuffer(GL_ARRAY_BUFFER, resident.vertices.id());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.vertices.size() * sizeof(SurfaceVertex)),
               mesh.vertices.data(), GL_DYNAMIC_DRAW);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, resident.indices.id());
  if (!same_triangles) {
    glBufferData(GL_ELEMENT_ARRAY_BUFFER,
                 static_cast<GLsizeiptr>(mesh.indices.size() * sizeof(std::uint32_t)), mesh.indices.data(),
                 GL_DYNAMIC_DRAW);
  }
  const auto attribute = [](GLuint index, GLint count, std::size_t at) {
    glEnableVertexAttribArray(index);
    glVertexAttribPointer(index, count, GL_FLOAT, GL_FALSE, sizeof(SurfaceVertex), offset(at));
  };
  attribute(0, 3, offsetof(SurfaceVertex, position));
  attribute(1, 3, offsetof(SurfaceVertex, normal));
  attribute(2, 1, offsetof(SurfaceVertex, opacity));
  if (resident.curvatures != nullptr && resident.curvatures->values.size() != mesh.vertices.size()) {
    // Of other vertices: none until new ones are there.
    glDisableVertexAttribArray(curvature_attribute);
    resident.curvatures = nullptr;
  }
  glBindVertexArray(0);
  resident.index_count = static_cast<GLsizei>(mesh.indices.size());
  resident.opaque_all_over = true;
  resident.extent.reset();
  for (const SurfaceVertex& vertex : mesh.vertices) {
    if (vertex.opacity < as_good_as_opaque) resident.opaque_all_over = false;
    if (vertex.opacity < seen_at_all) continue;
    const glm::vec2 at(vertex.position.x, vertex.position.y);
    if (!resident.extent) resident.extent = GroundExtent{at, at};
    resident.extent->low = glm::min(resident.extent->low, at);
    resident.extent->high = glm::max(resident.extent->high, at);
  }
}

std::optional<GroundExtent> SurfacePass::extent() const {
  std::optional<GroundExtent> all;
  for (const auto& [id, resident] : residents_) {
    if (!resident.extent) continue;
    if (!all) all = resident.extent;
    all->low = glm::min(all->low, resident.extent->low);
    all->high = glm::max(all->high, resident.extent->high);
  }
  return all;
}

void SurfacePass::show(const Frame& frame, const SurroundingsMap& surroundings) {
  scale_ = frame.distances;
  if (frame.colours != scheme_) make_ramps(frame.colours);
  shading_ = frame.shading;
  curvature_ = frame.curvature;
  overlays_ = frame.overlays;
  edges_ = frame.edges;
  surroundings_ = surroundings;
  if (shading_ == Shading::curvature) update_curvatures();
}

void SurfacePass::await_curvatures() {
  if (shading_ != Shading::curvature || worker_ == nullptr) return;
  worker_->wait();
  update_curvatures();
}

void SurfacePass::update_curvatures() {
  if (worker_ == nullptr) worker_ = std::make_unique<CurvatureWorker>();
  worker_->keep_only([this](const std::string& id) { return residents_.count(id) != 0; });
  std::vector<float> ranges;
  for (auto& [id, resident] : residents_) {
    worker_->want(id, resident.mesh);
    const std::shared_ptr<const MeshCurvatures> newest = worker_->newest(id);
    if (newest == nullptr || newest->values.size() != resident.mesh->vertices.size()) continue;
    ranges.push_back(newest->range_per_m[static_cast<std::size_t>(curvature_.kind)]);
    if (newest == resident.curvatures) continue;
    resident.curvatures = newest;
    if (!resident.curvature_values) resident.curvature_values = GlBuffer::create();
    glBindVertexArray(resident.array.id());
    glBindBuffer(GL_ARRAY_BUFFER, resident.curvature_values.id());
    glBufferData(GL_ARRAY_BUFFER,
                 static_cast<GLsizeiptr>(newest->values.size() * sizeof(PrincipalCurvatures)),
                 newest->values.data(), GL_DYNAMIC_DRAW);
    glEnableVertexAttribArray(curvature_attribute);
    glVertexAttribPointer(curvature_attribute, 2, GL_FLOAT, GL_FALSE, sizeof(PrincipalCurvatures), nullptr);
    glBindVertexArray(0);
  }
  if (curvature_.range_per_m > 0.0F) {
    curvature_range_per_m_ = curvature_.range_per_m;
  } else if (!ranges.empty()) {
    // That of the middle shape: one small sharp part must not make all others pale.
    const auto middle = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2);
    std::nth_element(ranges.begin(), middle, ranges.end());
    curvature_range_per_m_ = *middle;
  }
}

void SurfacePass::update_distances(Resident& resident, const Entity& entity) {
  if (resident.distances_m == entity.distances_m) return;
  resident.distances_m = entity.distances_m;
  glBindVertexArray(resident.array.id());
  if (entity.distances_m == nullptr) {
    glDisableVertexAttribArray(distance_attribute);
  } else {
    if (!resident.distances) resident.distances = GlBuffer::create();
    const std::vector<float>& distances = *entity.distances_m;
    glBindBuffer(GL_ARRAY_BUFFER, resident.distances.id());
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(distances.size() * sizeof(float)), distances.data(),
                 GL_DYNAMIC_DRAW);
    glEnableVertexAttribArray(distance_attribute);
    glVertexAttribPointer(distance_attribute, 1, GL_FLOAT, GL_FALSE, sizeof(float), nullptr);
  }
  glBindVertexArray(0);
}

void SurfacePass::draw(const Scene& scene, const EyeUniforms& eye, Stage stage) const {
  const bool seen = stage == Stage::opaque || stage == Stage::weighted || stage == Stage::peel;
  draw_with(overlays_.wires && seen ? wire_program_ : program_, scene, eye, stage);
}

void SurfacePass::draw_with(const GlProgram& program, const Scene& scene, const EyeUniforms& eye,
                            Stage stage) const {
  program.use();
  set_common_uniforms(program, eye, stage);
  const glm::vec3 selection = linear_rgb(scene_colours(scheme_).selected);
  const float line_px = std::max(1.0F, line_px_of_720 * eye.viewport_px.y / 720.0F);
  const bool lit = stage != Stage::coverage && surroundings_.texture != 0;
  program.set("u_viewport", eye.viewport_px);
  program.set("u_ramp", ramp_unit);
  program.set("u_surroundings", surroundings_unit);
  program.set("u_surroundings_from_world",
              lit ? glm::vec4(surroundings_.scale_per_m, surroundings_.offset, 0.0F) : glm::vec4(0.0F));
  bind_texture(surroundings_unit, GL_TEXTURE_2D, lit ? surroundings_.texture : 0);
  program.set("u_kind", static_cast<int>(curvature_.kind));
  program.set("u_stripes", zebra_stripes);
  program.set("u_trimmed", edges_ == SurfaceEdges::trimmed ? 1.0F : 0.0F);
  const bool sees_transparency = stage == Stage::weighted || stage == Stage::peel || stage == Stage::mask;
  for (const auto& [id, entity] : scene.entities) {
    const auto found = residents_.find(id);
    if (!entity->shows_surface() || found == residents_.end()) continue;
    const Resident& resident = found->second;
    const bool is_reference = entity->kind == EntityKind::reference;
    const bool compared = scale_ && !is_reference && resident.distances_m != nullptr;
    // On the table it throws its whole shadow.
    const bool faded = scale_ && is_reference && stage != Stage::coverage;
    if (sees_transparency && resident.opaque_all_over && !faded) continue;
    Material material{is_reference ? reference.base : colours_.of(id).shell,
                      is_reference ? reference.gloss : shape_gloss};
    if (entity->selected) material.base = glm::mix(material.base, selection, selected_tint);
    Look look = Look::studio;
    float range = 1.0F;
    if (compared) {
      look = Look::distances;
      range = scale_->range_m;
    } else if (!is_reference) {
      look = look_of_shading(shading_);
      range = curvature_range_per_m_;
    }
    program.set("u_look", static_cast<int>(look));
    program.set("u_range", std::max(range, 1e-9F));
    program.set("u_base", material.base);
    program.set("u_gloss", material.gloss);
    program.set("u_presence", faded ? faded_presence : 1.0F);
    program.set("u_line_px", entity->selected ? selected_line * line_px : line_px);
    program.set("u_line_colour", entity->selected ? selection : contour_darkness * material.base);
    program.set("u_isophotes", overlays_.isophotes && !is_reference ? isophote_count : 0.0F);
    bind_texture(ramp_unit, GL_TEXTURE_2D,
                 look == Look::distances ? distance_ramp_.id() : curvature_ramp_.id());
    glBindVertexArray(resident.array.id());
    glDrawElements(GL_TRIANGLES, resident.index_count, GL_UNSIGNED_INT, nullptr);
  }
  glBindVertexArray(0);
}

bool SurfacePass::any_transparent(const Scene& scene) const {
  return std::any_of(scene.entities.begin(), scene.entities.end(), [this](const auto& item) {
    const auto found = residents_.find(item.first);
    if (!item.second->shows_surface() || found == residents_.end()) return false;
    return !found->second.opaque_all_over || (scale_ && item.second->kind == EntityKind::reference);
  });
}

std::size_t SurfacePass::triangle_count() const {
  std::size_t sum = 0;
  for (const auto& [id, resident] : residents_) sum += static_cast<std::size_t>(resident.index_count) / 3;
  return sum;
}

}  // namespace handloft::client
