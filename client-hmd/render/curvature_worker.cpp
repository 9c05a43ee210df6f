#include "client-hmd/render/curvature_worker.h"

#include <chrono>

namespace handloft::client {
namespace {

std::shared_ptr<const MeshCurvatures> curvatures_of(const MeshPtr& mesh, const CurvatureOptions& options) {
  const auto begun = std::chrono::steady_clock::now();
  auto result = std::make_shared<MeshCurvatures>();
  result->mesh = mesh;
  result->values = vertex_curvatures(mesh->vertices, mesh->indices, options);
  for (const NamedChoice<CurvatureKind>& kind : curvature_kinds()) {
    result->range_per_m[static_cast<std::size_t>(kind.choice)] =
        curvature_range(result->values, mesh->vertices, kind.choice);
  }
  result->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  return result;
}

}  // namespace

CurvatureWorker::CurvatureWorker(CurvatureOptions options)
    : NewestWorker([options](const MeshPtr& mesh) { return curvatures_of(mesh, options); }) {}

}  // namespace handloft::client
