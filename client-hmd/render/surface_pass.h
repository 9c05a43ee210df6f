#pragma once
// Surfaces with an opacity at every vertex (V3, A23): two-sided, under the light that is chosen (look.h). A
// thin line marks opacity 0.5, which is the contour that an export trims to (A26); on a selected shape it is
// wider and has the colour of selection. Backs are darker, duller and finely hatched. References (A28) are
// matt and dull. On demand, shapes have the colours of their distances instead; references fade then, since a
// shape is partly inside of what it is compared with.
//
// Nothing is uploaded again that has not changed: a mesh by its pointer, triangles by their topology. A
// dragged surface's vertices go up whole, into fresh memory of the driver's (orphaning), as 28 bytes each:
// packing them would cost the frame loop more than the bus.

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "client-hmd/mirror/scene.h"
#include "client-hmd/render/colours.h"
#include "client-hmd/render/curvature_worker.h"
#include "client-hmd/render/distance_map.h"
#include "client-hmd/render/frame.h"
#include "client-hmd/render/gl.h"
#include "client-hmd/render/materials.h"
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
  float above_table_m = 0.0F;  ///< For Stage::coverage: of an eye that looks straight down.
  bool behind_front = false;   ///< The nearest layer's depths are bound: only what is behind them.
  bool behind_veil = false;    ///< A veil of surfaces is bound (veil.h).
  bool hand_before = false;    ///< A mask of the filmed hand is bound (hand_occlusion.h).
};

/// The work's shadow and heights from above, for the light that things take from each other (StagePass).
struct SurroundingsMap {
  GLuint texture = 0;        ///< 0: none.
  float scale_per_m = 0.0F;  ///< Texture coordinates = scale * (x, y) + offset.
  glm::vec2 offset{0.0F};
};

/// What a rectangle along the axes holds, seen from above; metres.
struct GroundExtent {
  glm::vec2 low{0.0F}, high{0.0F};
};

class SurfacePass {
 public:
  static Result<SurfacePass> create();

  /// Uploads what is new in `scene` and forgets what is gone.
  void update(const Scene& scene);
  /// Light, colours and lines from now on, all but the eye: as `frame` says.
  void show(const Frame& frame, const SurroundingsMap& surroundings);
  /// Waits until the curvatures of the newest meshes are there: for stills.
  void await_curvatures();
  /// What the curvature's colours span on either side of nought, 1/m.
  float curvature_range() const { return curvature_range_per_m_; }
  void draw(const Scene& scene, const EyeUniforms& eye, Stage stage) const;
  /// Whether the stages of transparency have anything to draw.
  bool any_transparent(const Scene& scene) const;
  /// Triangles of the scene as last updated.
  std::size_t triangle_count() const;
  /// Of the shapes of the scene as last updated.
  ShapeColour colour_of(std::string_view id) const { return colours_.of(id); }
  /// Of all that is not quite transparent; nullopt: nothing.
  std::optional<GroundExtent> extent() const;

 private:
  struct Resident {
    std::shared_ptr<const SurfaceMesh> mesh;
    GlVertexArray array;
    GlBuffer vertices;
    GlBuffer indices;
    std::shared_ptr<const std::vector<float>> distances_m;
    GlBuffer distances;
    std::shared_ptr<const MeshCurvatures> curvatures;
    GlBuffer curvature_values;
    GLsizei index_count = 0;
    bool opaque_all_over = false;  ///< Then the stages of transparency have nothing to do.
    std::optional<GroundExtent> extent;
  };
  void upload(Resident& resident, const Entity& entity);
  static void update_distances(Resident& resident, const Entity& entity);
  void update_curvatures();
  void make_ramps(ColourScheme scheme);
  void draw_with(const GlProgram& program, const Scene& scene, const EyeUniforms& eye, Stage stage) const;

  GlProgram program_;
  GlProgram wire_program_;
  std::map<std::string, Resident> residents_;
  mutable ShapeColours colours_;
  GlTexture distance_ramp_, curvature_ramp_;
  ColourScheme scheme_ = ColourScheme::normal;
  std::optional<DistanceScale> scale_;
  Shading shading_ = Shading::studio;
  CurvatureView curvature_;
  SurfaceOverlays overlays_;
  SurfaceEdges edges_ = SurfaceEdges::soft;
  SurroundingsMap surroundings_;
  float curvature_range_per_m_ = 1.0F;
  std::unique_ptr<CurvatureWorker> worker_;  ///< From the first time that curvatures are shown.
};

/// Sets the uniforms that emit_glsl and the vertex shaders share.
void set_common_uniforms(const GlProgram& program, const EyeUniforms& eye, Stage stage);

}  // namespace handloft::client
