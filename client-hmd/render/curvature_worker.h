#pragma once
// Curvatures off the frame loop (newest_worker.h): while a surface is dragged its colours follow as fast as
// the thread can.

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "client-hmd/mirror/scene.h"
#include "client-hmd/render/curvature.h"
#include "client-hmd/render/newest_worker.h"

namespace handloft::client {

struct MeshCurvatures {
  std::shared_ptr<const SurfaceMesh> mesh;  ///< Of which they are.
  std::vector<PrincipalCurvatures> values;  ///< One a vertex.
  std::array<float, 4> range_per_m{};       ///< curvature_range() of each CurvatureKind, by its number.
  double seconds = 0.0;                     ///< What it took.
};

using MeshPtr = std::shared_ptr<const SurfaceMesh>;

class CurvatureWorker : public NewestWorker<MeshPtr, MeshCurvatures> {
 public:
  explicit CurvatureWorker(CurvatureOptions options = {});
  /// Null: forget the entity.
  void want(const std::string& id, const MeshPtr& mesh) {
    mesh == nullptr ? forget(id) : NewestWorker::want(id, mesh);
  }
};

}  // namespace handloft::client
