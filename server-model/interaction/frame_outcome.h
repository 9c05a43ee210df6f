#pragma once
// What one tracking frame led to.

#include <string>
#include <vector>

#include "proto/operation.pb.h"
#include "server-model/model/model.h"

namespace handloft::interaction {

/// What a hand should feel of its work with icons, by its glove.
enum class Pulse {
  picked,    ///< It has taken hold of an icon, or selected one.
  released,  ///< It has let go of it.
  refused,   ///< What it does or did is not done.
};

struct FrameOutcome {
  bool scene_changed = false;  ///< The document, a gesture in the air, the selection, or what a hand is near.
  std::vector<model::Submitted> submitted;  ///< In order.
  std::vector<std::string> problems;        ///< In words: ignored frames, refusals, cancellations.
  /// Asked for from the palette, for the session to name the file and write it: they change no document.
  std::vector<v1::Export> exports;
  std::vector<Pulse> pulses;
};

}  // namespace handloft::interaction
