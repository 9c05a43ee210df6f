#pragma once
// Signed distance of points to a triangle mesh (A28: how far a shape is from the reference it is designed
// around). The closest point is exact, found in a tree of boxes in double precision; the sign comes from the
// angle-weighted pseudonormal of the closest face, edge or vertex (Baerentzen and Aanaes, "Signed distance
// computation using the angle weighted pseudonormal", TVCG 2005), which is right for closed meshes at every
// point, edges and vertices included. An open mesh has no inside: there the sign tells the side of its
// nearest part.
//
// Why not Embree's point queries: they cull in single precision and choose their code by the processor, and
// this room promises the same bits everywhere (X2).

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

struct NearestOnMesh {
  double signed_distance_m = 0;  ///< Positive on the side of the outward normals; 0 on the mesh.
  Vec3 point = Vec3::Zero();     ///< The closest point of the mesh, world.
  std::uint32_t triangle = 0;    ///< Which holds it; the lowest of several.
};

/// A mesh prepared for many questions. Immutable: any number of threads may ask. O(n log n) to make, some 130
/// bytes a triangle; a question takes about O(log n).
class MeshDistance {
 public:
  /// Three indices a triangle, counterclockwise seen from outside. Vertices that several triangles share must
  /// be one vertex, or signs beside their edges are those of an open mesh. Triangles without area don't
  /// count. Errors: invalid_argument ("positions[7]", "indices[12]") for numbers that are not finite, indices
  /// out of range or not three a triangle, and no triangle with an area.
  static Result<MeshDistance> create(std::span<const Vec3> positions, std::span<const std::uint32_t> indices);

  /// Whether a triangle counts. Of finite corners.
  static bool has_area(const Vec3& a, const Vec3& b, const Vec3& c);

  /// Precondition: `point` is finite.
  NearestOnMesh nearest(const Vec3& point) const;

  /// One signed distance a point, metres: what nearest() gives, faster where points that follow
  /// one another are near to each other. Errors: invalid_argument for lengths that differ and points that
  /// are not finite ("points[3]").
  Status signed_distances(std::span<const Vec3> points, std::span<double> distances) const;

  std::size_t triangle_count() const { return triangles_.size(); }

 private:
  struct Node {
    Vec3 lower, upper;
    std::uint32_t first = 0;  ///< Leaf: first of its triangles in order_. Else: its second child.
    std::uint32_t count = 0;  ///< Triangles of a leaf; 0: not a leaf, its first child follows it.
  };
  struct Candidate {
    double squared = 0;
    std::uint32_t triangle = 0;
    Vec3 point = Vec3::Zero();
    int feature = 0;
  };

  void link_edges();
  void sum_vertex_normals();
  void build_tree();
  Candidate closest_in(std::uint32_t triangle, const Vec3& point) const;
  void search(const Vec3& point, Candidate& best) const;
  Vec3 pseudonormal(const Candidate& candidate) const;
  double signed_distance(const Vec3& point, const Candidate& candidate) const;
  Vec3 face_normal(std::uint32_t triangle) const;

  std::vector<Vec3> positions_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<std::uint32_t> original_;     ///< Number of each triangle as it was given.
  std::vector<std::uint32_t> next_around_;  ///< Half-edge 3 t + k -> the next one on the same edge, a ring.
  std::vector<Vec3> vertex_normals_;        ///< Angle-weighted, not of unit length.
  std::vector<std::uint32_t> order_;        ///< Triangles as the leaves hold them.
  std::vector<Node> nodes_;
};

}  // namespace handloft::geometry
