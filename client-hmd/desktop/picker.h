#pragma once
// What is under the pointer: surfaces by their triangles, points and icons by how near to the pixel they are
// seen. Looks at the mirrored scene alone; meshes' boxes are kept until the mesh is replaced.

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "client-hmd/desktop/mesh_index.h"
#include "client-hmd/mirror/scene.h"

namespace handloft::client {

struct PickOptions {
  double point_px = 9.0;  ///< A fuzzy point is seen about so large, and nobody aims better.
  double snap_px = 12.0;
  double icon_px = 16.0;  ///< Icons are never drawn smaller than ten pixels (D17).
};

/// Something under the pointer.
struct Picked {
  std::string entity;  ///< Id.
  std::string name;    ///< For people.
  EntityKind kind = EntityKind::dual_shape;
  std::string icon;                  ///< Id of the icon, when it is one.
  glm::dvec3 at{0.0};                ///< World, metres.
  glm::dvec3 normal{0.0, 0.0, 1.0};  ///< Unit, towards the viewer.
  bool on_surface = false;           ///< Else on a point or an icon.
};

class Picker {
 public:
  explicit Picker(PickOptions options = {}) : options_(options) {}

  /// The nearest surface; where there is none, the nearest point that is shown within reach of the pixel.
  std::optional<Picked> pick(const Scene& scene, const Eye& eye, const glm::dvec2& at_px);
  /// The icon that is seen nearest to the pixel, within reach. Its normal is that of the surface under it,
  /// where that is seen, else towards the viewer.
  std::optional<Picked> pick_icon(const Scene& scene, const Eye& eye, const glm::dvec2& at_px);
  /// The point, or end of a curve, that is seen nearest to the pixel, within reach.
  std::optional<Picked> snap(const Scene& scene, const Eye& eye, const glm::dvec2& at_px) const;

 private:
  const MeshIndex& index_of(const std::string& id, const std::shared_ptr<const SurfaceMesh>& mesh);
  void forget_removed(const Scene& scene);

  PickOptions options_;
  std::map<std::string, MeshIndex> indices_;
};

}  // namespace handloft::client
