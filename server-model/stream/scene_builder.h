#pragma once
// From the model to the scene: after every operation and every frame that moved a gesture. Costs a look at
// each entity; unchanged ones are shared.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

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

  /// `selected`: the id that gestures act on, may be empty. `capture_time_ns`: see Scene. `targets`: ids of
  /// what hands act on now or would; `icons`: which icons.
  ScenePtr build(const model::Model& model, std::string_view selected, std::int64_t capture_time_ns,
                 std::span<const std::string> targets = {}, std::span<const IconMark> icons = {});

 private:
  std::uint64_t epoch_;
  MeshCache& meshes_;
};

}  // namespace handloft::stream
