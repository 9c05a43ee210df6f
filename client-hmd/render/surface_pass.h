#pragma once
// Surfaces with an opacity at every vertex (V3, A23): two-sided, lit as in a studio, so that reflections tell
// the curvature. A thin line marks opacity 0.5, which is the contour that an export trims to (A26).
// References (A28) are matt and dull beside them. On demand, shapes have the colours of their distances
// instead; references fade then, since a shape is partly inside of what it is compared with.

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "client-hmd/mirror/scene.h"
#include "client-hmd/render/distance_map.h"
#include "client-hmd/render/frame.h"
#include "client-hmd/render/gl.h"
#include "client-hmd/render/shaders.h"
#include "client-hmd/render/transparency.h"
#include "client-hmd/view/pinhole.h"

namespace handloft::client {

/// What every pass of a frame needs to know about the eye, in single precision.
struct EyeUniforms {
  glm::mat4 eye_from_world{1.0F};
  glm::mat4 clip_from_eye{1.0F};
  glm::vec3 position{0.0F};
  glm::vec2 viewport_px{1.0F};
  float focal_px = 1.0F;  ///< Vertical, in pixels of the drawn picture.
  TransparencyWeights weights;
  bool hand_before = false;  ///< A mask of the filmed hand is bound (hand_occlusion.h).
};

class SurfacePass {
 public:
  static Result<SurfacePass> create();

  /// Uploads what is new in `scene` and forgets what is gone.
  void update(const Scene& scene);
  /// From now on; nullopt: shapes look like what they are. One without distances does so always.
  void show_distances(const std::optional<DistanceScale>& scale) { scale_ = scale; }
  /// From now on, for all but references and what shows its distances.
  void show_shading(Shading shading) { shading_ = shading; }
  void draw(const Scene& scene, const EyeUniforms& eye, Stage stage) const;
  /// Triangles of the scene as last updated.
  std::size_t triangle_count() const;

 private:
  struct Resident;
  static void update_distances(Resident& resident, const Entity& entity);

  struct Resident {
    std::shared_ptr<const SurfaceMesh> mesh;
    GlVertexArray array;
    GlBuffer vertices;
    GlBuffer indices;
    std::shared_ptr<const std::vector<float>> distances_m;
    GlBuffer distances;
    GLsizei index_count = 0;
  };
  GlProgram program_;
  std::map<std::string, Resident> residents_;
  std::optional<DistanceScale> scale_;
  Shading shading_ = Shading::studio;
};

/// Sets the uniforms that emit_glsl and the vertex shaders share.
void set_common_uniforms(const GlProgram& program, const EyeUniforms& eye, Stage stage);

}  // namespace handloft::client
