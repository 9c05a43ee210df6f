#pragma once
// What one tracking frame led to.

#include <string>
#include <vector>

#include "proto/operation.pb.h"
#include "server-model/model/model.h"

namespace handloft::interaction {

struct FrameOutcome {
  bool scene_changed = false;  ///< The document, a gesture in the air, the selection, or what a hand is near.
  std::vector<model::Submitted> submitted;  ///< In order.
  std::vector<std::string> problems;        ///< In words: ignored frames, refusals, cancellations.
  /// Asked for from the palette, for the session to name the file and write it: they change no document.
  std::vector<v1::Export> exports;
};

}  // namespace handloft::interaction
