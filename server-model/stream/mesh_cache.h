#pragma once
// Triangles of the fitted surfaces, tessellated and packed once for each fit and trim (A22, A24), off the
// model thread: a mesh of some ten thousand vertices takes milliseconds, and the hand must not wait for it.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>

#include "common/codec/mesh_codec.h"
#include "proto/scene.pb.h"
#include "server-model/geometry/tessellate.h"
#include "server-model/model/dual_shape.h"
#include "server-model/stream/reference_cache.h"
#include "server-model/stream/sculpt_cache.h"

namespace handloft::stream {

/// The packed mesh of a fitted shape's visible part. Errors: failed_precondition when it is not fitted; those
/// of tessellate() and encode_mesh().
Result<v1::Mesh> surface_mesh(const model::DualShape& shape,
                              const geometry::TessellationOptions& options = {});

struct MeshCacheOptions {
  geometry::TessellationOptions tessellation;
  SculptMeshOptions sculpting;
  std::size_t max_unused = 32;  ///< Meshes kept for undo and redo, some 100 KiB each; others are made anew.
};

struct MeshCacheStatistics {
  std::uint64_t made = 0;
  std::uint64_t failed = 0;
  std::size_t pending = 0;
};

class MeshCache {
 public:
  /// Runs a job, on another thread or at once.
  using Run = std::function<void(std::function<void()>)>;

  /// `ready` is called after each job, from where it ran: time to build the scene anew. The cache must
  /// outlive the jobs.
  MeshCache(Run run, std::function<void()> ready, MeshCacheOptions options = {});

  /// The mesh of the shape's present fit; null when it isn't fitted or the job, started now if need be, is
  /// not done yet.
  std::shared_ptr<const v1::Mesh> find(const model::DualShape& shape);

  /// To be called around the finds for one scene: what was not asked for between the two may be forgotten,
  /// and jobs for it that have not begun are dropped, so that surfaces that change faster than they are
  /// tessellated leave no backlog.
  void begin_round();
  void end_round();

  /// Of fitted and sculpted surfaces together.
  MeshCacheStatistics statistics() const;

  /// Kept in the same rounds, by the same workers.
  ReferenceCache& references() { return references_; }
  SculptCache& sculpted() { return sculpted_; }

 private:
  struct Entry {
    std::shared_ptr<const model::FittedSurface> fit;
    double exponent = 2.0;
    std::shared_ptr<const model::TrimCurve> boundary;
    std::shared_ptr<const v1::Mesh> mesh;
    bool done = false;
    std::uint64_t used_in_round = 0;
  };
  void make(const std::shared_ptr<Entry>& entry, const model::DualShape& shape);

  Run run_;
  std::function<void()> ready_;
  MeshCacheOptions options_;
  ReferenceCache references_;
  SculptCache sculpted_;
  mutable std::mutex mutex_;
  std::list<std::shared_ptr<Entry>> entries_;  ///< Most recently used first.
  std::uint64_t round_ = 0;
  MeshCacheStatistics statistics_;
};

}  // namespace handloft::stream
