#pragma once
// From the model to the scene: after every operation and every frame that moved a gesture. Costs a look at
// each entity; unchanged ones are shared.

#include <cstdint>

#include "server-model/model/model.h"
#include "server-model/stream/mesh_cache.h"
#include "server-model/stream/scene.h"

namespace handloft::stream {

/// What viewers are told of the history.
v1::HistoryState history_state(const model::History& history);

class SceneBuilder {
 public:
  /// `epoch` differs between two starts of a server. `meshes` must outlive it.
  SceneBuilder(std::uint64_t epoch, MeshCache& meshes) : epoch_(epoch), meshes_(meshes) {}

  /// `capture_time_ns`: see Scene.
  ScenePtr build(const model::Model& model, std::int64_t capture_time_ns, const HandMarks& marks = {});

 private:
  std::uint64_t epoch_;
  MeshCache& meshes_;
};

}  // namespace handloft::stream
