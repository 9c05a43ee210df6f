#pragma once
// Snapshots and deltas of the server, checked and applied (architecture idea 5: streams carry state). What
// comes over the socket may come from anybody: every count, index and number is held against a limit first,
// and a message that fails is refused whole, leaving the scene as it was. The scene handed out is an
// immutable value; what did not change is the same part of it, also across a restart of the server.

#include <cstdint>
#include <memory>

#include "client-hmd/mirror/limits.h"
#include "client-hmd/mirror/read_entity.h"
#include "client-hmd/mirror/scene.h"
#include "common/base/result.h"
#include "proto/scene.pb.h"

namespace handloft::client {

struct MirrorStatistics {
  std::uint64_t applied = 0;
  std::uint64_t refused = 0;
  std::uint64_t stale_entities = 0;  ///< Older than what is held, so passed over.
};

/// Called by one thread.
class SceneMirror {
 public:
  explicit SceneMirror(MirrorLimits limits = {}) : limits_(limits) {}

  /// Replaces everything. Errors: data_corrupt or resource_exhausted, naming the field.
  Status apply(const v1::SceneSnapshot& snapshot);
  /// Errors: as above; failed_precondition before the first snapshot, or for another epoch or an earlier
  /// sequence: then a new snapshot is needed (join again).
  Status apply(const v1::SceneDelta& delta);

  /// Never null; the same pointer until something is applied.
  std::shared_ptr<const Scene> scene() const { return scene_; }
  const MirrorStatistics& statistics() const { return statistics_; }

 private:
  Status count(Result<Scene> next);
  Result<Scene> after(const v1::SceneSnapshot& snapshot);
  Result<Scene> after(const v1::SceneDelta& delta);
  /// Puts one entity of a message into `scene`, whose size is `size`.
  Status put(const EntityBefore& before, const v1::EntityState& state, const std::string& field, Scene& scene,
             SceneSize& size);

  MirrorLimits limits_;
  MirrorStatistics statistics_;
  TopologyNumbers topologies_;
  bool begun_ = false;
  std::shared_ptr<const Scene> scene_ = std::make_shared<const Scene>();
};

}  // namespace handloft::client
