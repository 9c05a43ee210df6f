#pragma once
// Selecting a shape by its row: the wire knows "select next" (A25), so that is given until the shape is the
// selected one, a step with every state of the scene. It ends when the row is gone, when somebody selects
// otherwise, or after one round.

#include <optional>
#include <string>

#include "client-hmd/mirror/scene.h"
#include "common/base/clock.h"

namespace handloft::client {

class SelectionSeeker {
 public:
  void seek(std::string id);
  bool seeking() const { return !wanted_.empty(); }

  /// Once a frame. True: give "select next" now.
  bool step(const Scene& scene, TimePoint now);

 private:
  static constexpr Duration patience = std::chrono::seconds(1);  ///< For a step to be seen.

  std::string wanted_;
  std::string last_selected_;
  std::size_t steps_ = 0;
  bool waiting_ = false;
  TimePoint asked_at_;
};

}  // namespace handloft::client
