#pragma once
// How hard a pressure pen presses, where the session is X11: GLFW knows mice only, so the tablet's axis is
// read beside it, by the X Input Extension 2 on a connection of its own. Pressure alone: the pen's place is
// the pointer's, which GLFW tells.

#include <memory>
#include <optional>

namespace handloft::client {

class PenListener {
 public:
  /// Null where there is no X server, or it does not know the extension. A pen may be plugged in later.
  static std::unique_ptr<PenListener> open();
  ~PenListener();
  PenListener(const PenListener&) = delete;
  PenListener& operator=(const PenListener&) = delete;

  /// The newest pressure of any pen, 0..1, when one has told since the last call; 0: it left. Never blocks.
  std::optional<double> poll();

 private:
  struct Implementation;
  explicit PenListener(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace handloft::client
