#pragma once
// Fuzzy points (A2, A3): five nested transparent spheres each, drawn as one camera-facing disc whose
// fragments composite, from the outermost to the innermost, the shells that their line of sight through the
// centre's plane meets. The result is the staircase of A3; radii and opacities come from the server, so that
// all viewers agree. A growing stroke costs its new points only, 16 bytes each.
//
// Large clouds are put into cells by a thread of its own (point_cells.h); then every frame draws what of them
// it needs, and what came since as it is. Until a large cloud is in its cells, a few of its points stand for
// it, and the last one that was, for one that moves.

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client-hmd/render/disc_fill.h"
#include "client-hmd/render/point_sorter.h"
#include "client-hmd/render/surface_pass.h"

namespace handloft::client {

/// Opacity at distance `r_m` from the centre: 'over' of every shell that is wider. What the shader computes.
float shells_opacity(const ShellStyle& style, float r_m);

/// How many of the points are drawn. Never more than cover the picture some hundred times (disc_fill.h).
enum class PointDetail {
  as_seen,  ///< Of large clouds as many as the picture shows apart from fewer (point_cells.h).
  all,      ///< For stills.
};

class PointPass {
 public:
  static Result<PointPass> create();
  /// After that of `surfaces`, which knows the shapes' inks.
  void update(const Scene& scene, const SurfacePass& surfaces);
  /// From now on: what users' gestures are about to leave is in their colours, linear RGB.
  void show_users(std::map<std::uint64_t, glm::vec3> colours) { user_colours_ = std::move(colours); }
  /// Once a frame: takes large clouds over that are in their cells by now; with all details it waits for
  /// them. Whether there were any.
  bool follow(const Scene& scene, PointDetail detail);
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
    std::uint32_t settled = 0;
    // Of large clouds; `instances` then has only what is not in cells.
    bool large = false;
    std::shared_ptr<const SortedPoints> sorted;  ///< Null: none yet.
    GlVertexArray cell_array;
    GlBuffer packed;
    std::size_t first_loose = 0;  ///< Of the set: this one and those after it are not in cells.
  };
  void update_large(const std::string& id, Resident& resident);
  static void upload_loose(Resident& resident);
  /// One that is shown, and its cells' shares.
  struct Drawn {
    const Entity* entity = nullptr;
    const Resident* resident = nullptr;
    std::vector<CellShare> cells;
  };
  /// What peeling draws is the reference.
  bool in_detail(Stage stage) const { return detail_ == PointDetail::all || stage == Stage::peel; }
  std::vector<Drawn> to_draw(const Scene& scene, const EyeUniforms& eye, Stage stage) const;
  /// What `drawn` costs, of a picture that sees it as `view`.
  static double cost_of(const Drawn& drawn, const DiscView& view);
  void draw_cells(const Drawn& drawn, double share) const;
  void draw_loose(const Drawn& drawn, double share) const;
  static void upload_points(Resident& resident, const PointSet* former, const PointSet& set);
  GlProgram program_;
  std::map<std::string, Resident> residents_;
  std::map<std::uint64_t, glm::vec3> user_colours_;
  std::unique_ptr<PointSorter> sorter_;  ///< From the first large cloud on.
  PointDetail detail_ = PointDetail::as_seen;
};

}  // namespace handloft::client
