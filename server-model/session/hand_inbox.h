#pragma once
// The tracking frames of one client's hands on their way to the model's thread (U4: bounded, and a flood
// harms nobody else). While the model keeps up every frame is handled. When it is behind, the newest of two
// frames that differ by motion only is enough; a change of gesture, pressing or contacts is always handed on.

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>

#include "common/base/clock.h"
#include "proto/tracking.pb.h"
#include "server-model/interaction/interaction.h"

namespace handloft::session {

struct HandInboxOptions {
  /// Twice what three cameras at 40 Hz bring. What comes faster is left out.
  double max_frames_per_s = 240;
  double burst_frames = 480;    ///< That may come at once: what a network kept back for two seconds.
  std::size_t few = 4;          ///< May wait of a hand that rests or flies: 40 ms of motion.
  std::size_t of_gesture = 64;  ///< Of one that presses or is closed, whose every frame is seen in the shape.
  std::size_t most = 256;       ///< Of any.
};

/// Frames that came, and what became of those that did not reach the hands.
struct HandInboxStatistics {
  std::uint64_t frames = 0;
  std::uint64_t replaced = 0;  ///< By a newer one, since the model was behind.
  std::uint64_t left_out = 0;  ///< Came too fast.

  HandInboxStatistics& operator+=(const HandInboxStatistics& other);
};

/// Thread-safe.
class HandInbox {
 public:
  enum class Taken {
    waits,     ///< To be popped once more than before.
    replaced,  ///< In place of the last one that waited.
    left_out,
  };

  explicit HandInbox(HandInboxOptions options = {}) : options_(options), tokens_(options.burst_frames) {}

  Taken push(v1::TrackingFrame frame, TimePoint now);
  /// Something else of the client comes after those that wait: none of them is replaced any more.
  void seal();
  /// The oldest; nullopt: none waits.
  std::optional<v1::TrackingFrame> pop();
  HandInboxStatistics statistics() const;

 private:
  /// What must not be lost of a frame.
  struct Look {
    struct Hand {
      bool seen = false;  ///< Any fingertip.
      v1::Gesture gesture = v1::GESTURE_UNKNOWN;
      bool pressing = false;
      std::uint32_t contacts = 0;
      bool operator==(const Hand&) const = default;
    };
    std::array<Hand, interaction::Interaction::max_hands> hands{};
    bool mouse_moves = false;
    bool operator==(const Look&) const = default;
    bool in_gesture() const;
  };
  struct Waiting {
    v1::TrackingFrame frame;
    Look look;
  };
  static Look look_of(const v1::TrackingFrame& frame);
  bool spend(bool change, TimePoint now);

  const HandInboxOptions options_;
  mutable std::mutex mutex_;
  std::deque<Waiting> waiting_;
  bool sealed_ = false;
  std::optional<Look> last_;  ///< Of the newest frame that was not left out.
  double tokens_;             ///< Frames that may come now.
  std::optional<TimePoint> refilled_;
  HandInboxStatistics statistics_;
};

}  // namespace handloft::session
