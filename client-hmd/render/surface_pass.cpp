#include "client-hmd/render/surface_pass.h"

#include <array>
#include <cstddef>

namespace handloft::client {
namespace {

constexpr std::string_view vertex_glsl = R"glsl(
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in float a_opacity;
layout(location = 3) in float a_distance;
uniform mat4 u_eye_from_world;
uniform mat4 u_clip_from_eye;
out vec3 world;
out vec3 normal;
out float opacity;
out float distance_m;
out float eye_depth;
void main() {
  vec4 in_eye = u_eye_from_world * vec4(a_position, 1.0);
  world = a_position;
  normal = a_normal;
  opacity = a_opacity;
  distance_m = a_distance;
  eye_depth = -in_eye.z;
  gl_Position = u_clip_from_eye * in_eye;
}
)glsl";

constexpr std::string_view fragment_glsl = R"glsl(
in vec3 world;
in vec3 normal;
in float opacity;
in float distance_m;
in float eye_depth;
uniform vec3 u_eye_position;
uniform vec3 u_front;
uniform vec3 u_back;
uniform float u_gloss;
uniform float u_presence;    // Opacity of the whole thing.
uniform float u_range;       // Of the distances shown; 0: none.
uniform vec3 u_negative;
uniform vec3 u_nought;
uniform vec3 u_positive;
uniform float u_stripes;     // Of the mirrored room, from its one side to the other; 0: none.

// A room of long parallel lamps along y: what their reflections do on a surface is what an eye for cars looks at.
vec3 zebra(vec3 n, vec3 to_eye) {
  vec3 mirrored = reflect(-to_eye, n);
  float turn = atan(mirrored.x, abs(mirrored.z) + 1e-4) / 3.14159265 * u_stripes;
  float wave = abs(fract(turn) - 0.5) * 2.0;
  float soft = clamp(2.0 * fwidth(turn), 0.02, 1.0);
  float lit = smoothstep(0.5 - soft, 0.5 + soft, wave);
  vec3 body = mix(vec3(0.018, 0.022, 0.030), vec3(0.80, 0.82, 0.84), lit);
  float facing = clamp(dot(n, to_eye), 0.0, 1.0);
  return body * (0.72 + 0.28 * facing);
}

void main() {
  vec3 to_eye = normalize(u_eye_position - world);
  vec3 n = normalize(normal);
  bool front = dot(n, to_eye) >= 0.0;
  vec3 base = front ? u_front : u_back;
  if (u_range > 0.0) {
    float share = clamp(distance_m / u_range, -1.0, 1.0);
    base = mix(u_nought, share < 0.0 ? u_negative : u_positive, abs(share));
  }
  vec3 lit = studio_light(front ? n : -n, to_eye, base, front ? u_gloss : 0.35 * u_gloss);
  if (u_stripes > 0.0) lit = zebra(front ? n : -n, to_eye);
  float line = 1.0 - smoothstep(0.5, 1.4, abs(opacity - 0.5) / max(fwidth(opacity), 1e-4));
  float alpha = clamp(opacity, 0.0, 1.0);
  lit = mix(lit, vec3(0.03, 0.05, 0.09), 0.75 * line);
  emit(lit, u_presence * max(alpha, 0.8 * line), eye_depth);
}
)glsl";

struct Material {
  glm::vec3 front;
  glm::vec3 back;
  float gloss = 1.0F;
};
// Linear RGB: satin silver for what rests, a cool blue for what gestures act on.
constexpr Material resting{{0.330F, 0.345F, 0.365F}, {0.36F, 0.29F, 0.24F}};
constexpr Material selected{{0.235F, 0.375F, 0.53F}, {0.46F, 0.36F, 0.28F}};
// Dull putty without reflections: nothing that hands shape. Its back is hardly darker, as an import may be
// open.
constexpr Material reference{{0.225F, 0.205F, 0.175F}, {0.195F, 0.175F, 0.150F}, 0.0F};
constexpr float faded_presence = 0.15F;   ///< Of a reference, while distances to it are shown.
constexpr float distance_gloss = 0.1F;    ///< Reflections would wash the colours out ...
constexpr float distance_albedo = 0.75F;  ///< ... as would light on a bright base.

/// Fewer say little of a flat face, more run together on a round one.
constexpr float zebra_stripes = 14.0F;

constexpr GLuint distance_attribute = 3;

const void* offset(std::size_t bytes) {
  return reinterpret_cast<const void*>(bytes);
}

}  // namespace

void set_common_uniforms(const GlProgram& program, const EyeUniforms& eye, Stage stage) {
  program.set("u_eye_from_world", eye.eye_from_world);
  program.set("u_clip_from_eye", eye.clip_from_eye);
  program.set("u_eye_position", eye.position);
  program.set("u_stage", static_cast<int>(stage));
  program.set("u_weights", glm::vec4(eye.weights.reference_m, eye.weights.falloff_m, eye.weights.smallest,
                                     eye.weights.largest));
  program.set("u_opaque_depth", 6);  // Texture units that the peeling binds.
  program.set("u_last_depth", 7);
  program.set("u_hand_before", eye.hand_before ? 1 : 0);
  program.set("u_hand_mask", 8);
}

Result<SurfacePass> SurfacePass::create() {
  const std::array vertex{vertex_glsl};
  const std::array fragment{emit_glsl, studio_light_glsl, fragment_glsl};
  Result<GlProgram> program = GlProgram::build("surface", vertex, fragment);
  if (!program) return program.error();
  SurfacePass pass;
  pass.program_ = std::move(*program);
  return pass;
}

void SurfacePass::update(const Scene& scene) {
  std::erase_if(residents_, [&scene](const auto& item) {
    const auto found = scene.entities.find(item.first);
    return found == scene.entities.end() || found->second->surface == nullptr;
  });
  for (const auto& [id, entity] : scene.entities) {
    if (entity->surface == nullptr) continue;
    Resident& resident = residents_[id];
    if (resident.mesh == entity->surface) {
      update_distances(resident, *entity);
      continue;
    }
    if (!resident.array) {
      resident.array = GlVertexArray::create();
      resident.vertices = GlBuffer::create();
      resident.indices = GlBuffer::create();
    }
    const SurfaceMesh& mesh = *entity->surface;
    // A surface that is dragged keeps its triangles.
    const bool same_triangles = resident.mesh != nullptr && mesh.topology != 0 &&
                                resident.mesh->topology == mesh.topology &&
                                resident.mesh->indices.size() == mesh.indices.size();
    resident.mesh = entity->surface;
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
    glBindVertexArray(0);
    resident.index_count = static_cast<GLsizei>(mesh.indices.size());
    update_distances(resident, *entity);
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
  program_.use();
  set_common_uniforms(program_, eye, stage);
  const DistanceColours colours;
  program_.set("u_negative", distance_albedo * colours.negative);
  program_.set("u_nought", distance_albedo * colours.nought);
  program_.set("u_positive", distance_albedo * colours.positive);
  for (const auto& [id, entity] : scene.entities) {
    const auto found = residents_.find(id);
    if (!entity->shows_surface() || found == residents_.end()) continue;
    const bool is_reference = entity->kind == EntityKind::reference;
    const bool compared = scale_ && !is_reference && found->second.distances_m != nullptr;
    const Material& material = is_reference ? reference : entity->selected ? selected : resting;
    program_.set("u_front", material.front);
    program_.set("u_back", material.back);
    program_.set("u_gloss", compared ? distance_gloss : material.gloss);
    // On the table it throws its whole shadow.
    const bool faded = scale_ && is_reference && stage != Stage::coverage;
    program_.set("u_presence", faded ? faded_presence : 1.0F);
    const bool striped = shading_ == Shading::zebra && !is_reference && !compared;
    program_.set("u_stripes", striped ? zebra_stripes : 0.0F);
    program_.set("u_range", compared ? scale_->range_m : 0.0F);
    glBindVertexArray(found->second.array.id());
    glDrawElements(GL_TRIANGLES, found->second.index_count, GL_UNSIGNED_INT, nullptr);
  }
  glBindVertexArray(0);
}

std::size_t SurfacePass::triangle_count() const {
  std::size_t sum = 0;
  for (const auto& [id, resident] : residents_) sum += static_cast<std::size_t>(resident.index_count) / 3;
  return sum;
}

}  // namespace handloft::client
