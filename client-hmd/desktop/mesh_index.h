#pragma once
// Which triangle of a mesh a ray meets first. Boxes about runs of triangles in the mesh's own order, in two
// levels: a tessellation's neighbours are neighbours in its list, so runs are compact, and boxes are made in
// one pass over the vertices: for a surface that changes with every frame of a drag that counts more than
// the last factor of a sorted tree. A mesh in no order at all costs what looking at every triangle does.

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "client-hmd/desktop/work_plane.h"
#include "client-hmd/mirror/scene.h"

namespace handloft::client {

struct MeshHit {
  double distance_m = 0.0;
  glm::dvec3 normal{0.0, 0.0, 1.0};  ///< Unit, of the vertices' normals, towards the ray's origin.
};

class MeshIndex {
 public:
  explicit MeshIndex(std::shared_ptr<const SurfaceMesh> mesh);

  /// The nearest place where what is met is at least half opaque: that is where a surface ends to the eye,
  /// and in an export (A26).
  std::optional<MeshHit> meet(const Ray& ray) const;
  const SurfaceMesh* mesh() const { return mesh_.get(); }

 private:
  struct Box {
    glm::vec3 low{0.0F}, high{0.0F};
  };
  static bool meets(const Box& box, const Ray& ray, const glm::dvec3& inverse, double within_m);

  std::shared_ptr<const SurfaceMesh> mesh_;
  std::vector<Box> runs_;    ///< Of triangles_per_run triangles each.
  std::vector<Box> groups_;  ///< Of runs_per_group runs each.
};

}  // namespace handloft::client
