#pragma once
// Triangles of the sculpted surfaces, made off the model thread: one job an entity at a time, which takes the
// newest surface when it begins and when it ends, so that a drag that is faster than its meshes shows the
// newest that there is and leaves no backlog.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "proto/scene.pb.h"
#include "server-model/stream/sculpt_mesher.h"

namespace handloft::stream {

class SculptCache {
 public:
  using Run = std::function<void(std::function<void()>)>;
  enum class Moment : std::uint8_t {
    dragged,  ///< More will follow: the triangles stay.
    settled,  ///< They are made anew if they are too coarse by now.
  };
  struct Statistics {
    std::uint64_t made = 0, failed = 0;
    std::size_t pending = 0;
  };

  /// As MeshCache.
  SculptCache(Run run, std::function<void()> ready, SculptMeshOptions options = {});

  /// The newest mesh of the entity that is done, of the surface as it is or as it was a moment ago; null when
  /// there is none.
  std::shared_ptr<const v1::Mesh> find(const model::SculptPtr& shape, Moment moment);

  /// As MeshCache; entities that were not asked for are forgotten.
  void begin_round();
  void end_round();

  Statistics statistics() const;

 private:
  struct Track {
    model::SculptPtr wanted;
    Moment moment = Moment::dragged;
    model::SculptPtr made;  ///< What `mesh` shows; or what could not be made, when there is no mesh.
    Moment made_at = Moment::dragged;
    std::shared_ptr<const v1::Mesh> mesh;
    bool working = false;
    std::uint64_t used_in_round = 0;
    std::optional<SculptMesher> mesher;  ///< Of the job alone.
  };
  static bool is_current(const Track& track);
  void work(const std::shared_ptr<Track>& track);
  Result<v1::Mesh> make(Track& track, const model::SculptShape& shape, Moment moment);

  Run run_;
  std::function<void()> ready_;
  SculptMeshOptions options_;
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Track>> tracks_;  ///< By entity.
  std::uint64_t round_ = 0;
  std::uint64_t next_topology_ = 1;
  Statistics statistics_;
};

}  // namespace handloft::stream
