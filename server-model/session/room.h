#pragma once
// One model that is served: its actor and the file that keeps it. Who is in it is the peers' business
// (peers.h).

#include <functional>
#include <memory>
#include <string>

#include "server-model/model/model.h"
#include "server-model/session/model_actor.h"
#include "server-model/store/model_store.h"

namespace handloft::session {

/// A model as its file has it, and who keeps it; null: nobody.
struct OpenedModel {
  model::Model model;
  std::shared_ptr<store::ModelStore> store;
};

struct Room {
  std::string name;
  std::uint64_t epoch = 0;
  std::unique_ptr<ModelActor> actor;         ///< Never null.
  std::shared_ptr<store::ModelStore> store;  ///< Null: nothing is kept.

  /// Ends gestures, so that nothing that a hand has laid is lost, and returns when all is on the disk and the
  /// file is closed. Not from the model's thread.
  void close();
};
using RoomPtr = std::shared_ptr<Room>;

}  // namespace handloft::session
