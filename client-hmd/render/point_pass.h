#pragma once
// Fuzzy points (A2, A3): five nested transparent spheres each, drawn as one camera-facing disc whose
// fragments composite, from the outermost to the innermost, the shells that their line of sight through the
// centre's plane meets. The result is the staircase of A3; radii and opacities come from the server, so that
// all viewers agree. A growing stroke costs its new points only, 16 bytes each.

#include <map>
#include <memory>
#include <string>

#include "client-hmd/render/surface_pass.h"

namespace handloft::client {

/// Opacity at distance `r_m` from the centre: 'over' of every shell that is wider. What the shader computes.
float shells_opacity(const ShellStyle& style, float r_m);

class PointPass {
 public:
  static Result<PointPass> create();
  /// After that of `surfaces`, which knows the shapes' inks.
  void update(const Scene& scene, const SurfacePass& surfaces);
  /// From now on: what users' gestures are about to leave is in their colours, linear RGB.
  void show_users(std::map<std::uint64_t, glm::vec3> colours) { user_colours_ = std::move(colours); }
  /// `stage` weighted, peel or coverage: fuzzy points are never opaque all over.
  void draw(const Scene& scene, const EyeUniforms& eye, Stage stage) const;

 private:
  struct Resident {
    std::shared_ptr<const PointSet> points;
    GlVertexArray array;
    GlBuffer instances;
    GlBuffer styles;
    GlTexture style_texture;
    GLsizei count = 0;
    glm::vec3 ink{0.0F};       ///< Linear RGB.
    std::size_t capacity = 0;  ///< Of `instances`, in points.
  };
  static void upload_points(Resident& resident, const PointSet* former, const PointSet& set);
  GlProgram program_;
  std::map<std::string, Resident> residents_;
  std::map<std::uint64_t, glm::vec3> user_colours_;
};

}  // namespace handloft::client
