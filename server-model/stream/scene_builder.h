#pragma once
// From the model to the scene: after every operation and every frame that moved a gesture. Costs a look at
// each entity; unchanged ones are shared.

#include <cstdint>
#include <set>
#include <string>

#include "server-model/model/model.h"
#include "server-model/stream/mesh_cache.h"
#include "server-model/stream/scene.h"

namespace handloft::stream {

/// What viewers are told of the history.
v1::HistoryState history_state(const model::History& history);
/// And what one of them is told of its own steps (U1).
v1::HistoryState history_state(const model::History& history, std::uint64_t client_id);

class SceneBuilder {
 public:
  /// `epoch` differs between two starts of a server. `meshes` must outlive it.
  SceneBuilder(std::uint64_t epoch, MeshCache& meshes) : epoch_(epoch), meshes_(meshes) {}

  /// `capture_time_ns`: see Scene.
  /// `viewers`: clients whose own history is told.
  ScenePtr build(const model::Model& model, std::int64_t capture_time_ns, const HandMarks& marks = {},
                 const std::set<std::uint64_t>& viewers = {});

 private:
  /// A number for what `seen` shows: the former one while it is the same.
  std::uint64_t points_grow_since(const std::string& id, const SceneEntity& seen) const;
  std::uint64_t surface_id(const std::string& id, const SceneEntity& seen);
  /// What depends on the document alone, shared with the last scene while it is the same.
  void tell_histories(const model::History& history, const std::set<std::uint64_t>& viewers, Scene& scene);
  void tell_notes(const model::Document& document, Scene& scene) const;

  std::uint64_t epoch_;
  MeshCache& meshes_;
  ScenePtr last_;
  std::uint64_t told_changes_ = 0;  ///< Of the history, when `told_viewers_` were told.
  std::set<std::uint64_t> told_viewers_;
  std::uint64_t last_surface_id_ = 0;
};

}  // namespace handloft::stream
