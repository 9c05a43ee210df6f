#pragma once
// Packed triangles of one sculpted surface, frame after frame of a drag (D21): where the vertices are in its
// parameters and how they are joined stays as it is, so that a frame costs evaluating what moved and packing
// the vertices. Trimmed faces keep to their trim.

#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "common/codec/mesh_codec.h"
#include "proto/scene.pb.h"
#include "server-model/geometry/grid_tessellation.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::stream {

struct SculptMeshOptions {
  double chord_tolerance_m = 1e-4;     ///< As geometry::SurfaceMeshOptions.
  double chord_fraction = 2e-5;        ///< Or this part of the diagonal, where that is larger: a ship.
  std::size_t max_vertices = 120'000;  ///< Coarser than the tolerance, where it would take more.
  int least_parts = 64;                ///< In each direction: what is flat at rest bends under its icons.
};

/// Where an untrimmed surface gets vertices: within the tolerance or as near to it as max_vertices allows,
/// and at least so many parts.
Result<geometry::GridParameters> sculpt_grid(const geometry::BSplineSurface& surface,
                                             const SculptMeshOptions& options = {});

/// Not thread-safe.
class SculptMesher {
 public:
  /// For the shape's surface as it is now, and others that differ in control points alone. `topology`: see
  /// Mesh.topology. Errors: those of the tessellation.
  static Result<SculptMesher> create(const model::SculptShape& shape, std::uint64_t topology,
                                     const SculptMeshOptions& options = {});
  /// The same with vertices where the caller wants them, for an untrimmed one.
  static Result<SculptMesher> create(const model::SculptShape& shape, std::uint64_t topology,
                                     const geometry::GridParameters& grid);

  /// Whether mesh() can follow: the same knots, weights, trim and outside.
  bool fits(const model::SculptShape& shape) const;
  /// Whether it would be made about as fine for this shape as it is. Takes as long as create().
  bool fine_enough(const model::SculptShape& shape, const SculptMeshOptions& options = {}) const;

  /// Evaluates and packs. Precondition: fits(). Errors: invalid_argument for numbers that are not finite;
  /// those of encode_mesh().
  Result<v1::Mesh> mesh(const geometry::BSplineSurface& surface,
                        const geometry::ParallelFor& parallel = geometry::run_in_turn);
  /// Its first part alone: the vertices as they are to be packed.
  Status evaluate(const geometry::BSplineSurface& surface,
                  const geometry::ParallelFor& parallel = geometry::run_in_turn);
  /// And its second.
  Result<v1::Mesh> pack() const;

 private:
  explicit SculptMesher(const model::SculptShape& shape);
  Status prepare(std::vector<std::uint32_t> indices, std::uint64_t topology);
  void take(std::size_t vertex, const geometry::Vec3& place, const geometry::Vec3& normal);
  void evaluate_places(const geometry::BSplineSurface& surface);

  geometry::KnotVector u_, v_;
  std::vector<double> weights_;
  std::shared_ptr<const model::FaceTrim> trim_;
  bool reversed_ = false;

  std::vector<geometry::GridTessellation> grid_;  ///< One, or none for trimmed faces, which have:
  std::vector<geometry::Vec2> places_;            ///< By vertex.
  geometry::BasisTable in_u_, in_v_;

  codec::MeshData vertices_;  ///< Without indices.
  v1::Mesh triangles_;        ///< With no vertices but their number.
};

}  // namespace handloft::stream
