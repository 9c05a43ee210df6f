#pragma once
// Snapshots and deltas of the server, checked and applied (architecture idea 5: streams carry state). What
// comes over the socket may come from anybody: every count, index and number is held against a limit first,
// and a message that fails is refused whole, leaving the scene as it was. The scene handed out is an
// immutable value.

#include <cstdint>
#include <memory>

#include "client-hmd/mirror/scene.h"
#include "common/base/result.h"
#include "proto/scene.pb.h"

namespace handloft::client {

struct MirrorLimits {
  std::size_t max_entities = 4096;
  std::size_t max_points = std::size_t{8} << 20;    ///< In the whole scene: 128 MiB.
  std::size_t max_vertices = std::size_t{4} << 20;  ///< In the whole scene: 112 MiB.
  std::size_t max_curve_points = 1'000'000;
  std::size_t max_icons = 4096;  ///< Of one entity.
  std::size_t max_text_bytes = 256;
  std::size_t max_alternatives = 256;  ///< A document holds 64.
  double max_coordinate_m = 1e4;       ///< As in common/codec: nothing on a table is 10 km away.
  double max_radius_m = 1.0;           ///< A fuzzy point is 12.7 mm at most (A2); a metre hides the scene.
};

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
  Result<Scene> after(const v1::SceneSnapshot& snapshot) const;
  Result<Scene> after(const v1::SceneDelta& delta);

  MirrorLimits limits_;
  MirrorStatistics statistics_;
  bool begun_ = false;
  std::shared_ptr<const Scene> scene_ = std::make_shared<const Scene>();
};

}  // namespace handloft::client
