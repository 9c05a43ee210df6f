#pragma once
// What viewers see of reference geometry (A28), made once and off the model thread: the packed meshes of the
// references, which are then prepared for measuring before anybody asks, and how far each vertex of a surface
// is from the nearest of them. Distances are measured from the vertices as they are sent, so that what is
// shown belongs to what is seen.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "proto/scene.pb.h"
#include "server-model/model/reference_shape.h"

namespace handloft::stream {

/// The packed mesh of a reference, opaque, with a normal for each vertex. Errors: those of encode_mesh().
Result<v1::Mesh> reference_mesh(const model::ReferenceMesh& mesh);

/// One little-endian float a vertex of `surface`: the signed distance to the nearest of the references,
/// metres. Errors: those of decode_mesh(); failed_precondition without references.
Result<std::string> vertex_distances(const v1::Mesh& surface,
                                     std::span<const std::shared_ptr<const model::ReferenceMesh>> references);

class ReferenceCache {
 public:
  using Run = std::function<void(std::function<void()>)>;
  using Meshes = std::vector<std::shared_ptr<const model::ReferenceMesh>>;

  /// As MeshCache.
  ReferenceCache(Run run, std::function<void()> ready, std::size_t max_unused);

  /// Null while it is being made.
  std::shared_ptr<const v1::Mesh> find_mesh(const std::shared_ptr<const model::ReferenceMesh>& reference);

  /// Null without references, without a surface, and while they are being measured.
  std::shared_ptr<const std::string> find_distances(const std::shared_ptr<const v1::Mesh>& surface,
                                                    const Meshes& references);

  /// As MeshCache.
  void begin_round();
  void end_round();

 private:
  struct Entry {
    std::shared_ptr<const v1::Mesh> surface;  ///< Whose distances; null: a reference's own mesh.
    Meshes references;
    std::shared_ptr<const v1::Mesh> mesh;
    std::shared_ptr<const std::string> distances;
    bool done = false;
    std::uint64_t used_in_round = 0;
  };
  std::shared_ptr<Entry> find(const std::shared_ptr<const v1::Mesh>& surface, const Meshes& references);
  void make(const std::shared_ptr<Entry>& entry);

  Run run_;
  std::function<void()> ready_;
  std::size_t max_unused_;
  mutable std::mutex mutex_;
  std::list<std::shared_ptr<Entry>> entries_;
  std::uint64_t round_ = 0;
};

}  // namespace handloft::stream
