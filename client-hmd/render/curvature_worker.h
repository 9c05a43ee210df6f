#pragma once
// Curvatures off the frame loop: one thread computes them for the newest mesh of each entity; the loop goes
// on with the last ones meanwhile. While a surface is dragged its colours follow as fast as the thread can,
// meshes in between are left out (newest wins).

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "client-hmd/mirror/scene.h"
#include "client-hmd/render/curvature.h"

namespace handloft::client {

struct MeshCurvatures {
  std::shared_ptr<const SurfaceMesh> mesh;  ///< Of which they are.
  std::vector<PrincipalCurvatures> values;  ///< One a vertex.
  std::array<float, 4> range_per_m{};       ///< curvature_range() of each CurvatureKind, by its number.
  double seconds = 0.0;                     ///< What it took.
};

class CurvatureWorker {
 public:
  explicit CurvatureWorker(CurvatureOptions options = {});
  ~CurvatureWorker();  ///< Waits for the mesh that is being worked on.
  CurvatureWorker(const CurvatureWorker&) = delete;
  CurvatureWorker& operator=(const CurvatureWorker&) = delete;

  /// Never waits. The same mesh again costs nothing. Null: forget the entity.
  void want(const std::string& id, std::shared_ptr<const SurfaceMesh> mesh);
  /// Forgets all entities for which `keep` is false.
  template <typename Keep>
  void keep_only(const Keep& keep) {
    const std::lock_guard lock(mutex_);
    std::erase_if(jobs_, [&keep](const auto& item) { return !keep(item.first); });
  }
  /// The newest that is ready; null: none yet. Its mesh may be an older one than was wanted last.
  std::shared_ptr<const MeshCurvatures> newest(const std::string& id) const;
  /// Until everything that was wanted is ready: for stills.
  void wait();

 private:
  struct Job {
    std::shared_ptr<const SurfaceMesh> wanted;
    std::shared_ptr<const MeshCurvatures> ready;
    bool due() const { return wanted != nullptr && (ready == nullptr || ready->mesh != wanted); }
  };
  void run();

  const CurvatureOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;  ///< Something is wanted, or ready, or it ends.
  std::map<std::string, Job> jobs_;
  std::string last_;  ///< Worked on last: entities take turns.
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace handloft::client
