#pragma once
// What the virtual hand does in the course of time: hovers, presses, closes, lets go. Makes the tracking
// frames and palette commands of it, in order, so that the model server's gestures
// (interaction/interaction.h) come out as they were meant:
//
//   - Between gestures the hand is open and does not press: the server commits what was in the air, and
//     marks what it would act on.
//   - A place less than a millimetre from the last one waits for the next flush(): paths do not grow with the
//     mouse's rate, and whatever waits is sent before the hand lets go.
//   - A fist's place is where it closed, exactly: the server takes a mean over its first frames within a
//     millimetre, so there are none but the first (interaction/fist_hold.h).
//   - What would have to be taken back is taken back as a glove's wearer does: by taking the hand away for
//     longer than the grace period.
//   - No more frames than the server takes (240 a second, 480 at once; "A hand of one's own" in PROTOCOL.md):
//     a path that comes all at once is told whole, one that never ends at a rate.
//   - Times never go back, whatever the events' do.
//
// "Move", boundaries and regions are modes that a command toggles; the stream believes to know them, toggles
// what a gesture needs just before it, and starts from the server's defaults with every connection.

#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "client-hmd/desktop/desktop_state.h"
#include "client-hmd/desktop/virtual_hand.h"
#include "common/base/table_palette.h"
#include "proto/operation.pb.h"

namespace handloft::client {

/// In order: a frame of the hand, a command that it gives, or an operation that needs no hand.
using HandMessage = std::variant<v1::TrackingFrame, PaletteCommand, v1::Operation>;

/// How the hand works.
struct HandTouch {
  double pressure = 0.5;       ///< 0..1
  double potentiometer = 1.0;  ///< 0..1
};

struct HandStreamOptions {
  double step_m = 0.001;
  double frames_per_s = 200.0;
  double burst_frames = 400.0;
  /// An open hand that hovers tells where it is at this rate while it moves, so that viewers see it, and
  Duration hover_interval = std::chrono::milliseconds(16);
  /// this often while it rests: a server that heard nothing does not know that it is there.
  Duration rest_interval = std::chrono::milliseconds(200);
  /// InteractionOptions::grace and a bit, by the clock: the server does not believe times to come.
  Duration cancel_after = std::chrono::milliseconds(300);
};

class HandStream {
 public:
  explicit HandStream(HandStreamOptions options = {}) : options_(options), tokens_(options.burst_frames) {}

  /// The server's modes are its defaults again, and no gesture is in the air.
  void connected_anew();

  /// The open hand is there; told at the next flush(). Nothing during a gesture.
  void hover(TimePoint time, const glm::dvec3& at, const HandTouch& touch);
  /// The hand is nowhere: told once.
  void leave(TimePoint time);

  /// Begins what `tool` does there. `direction`: of pushing, or across the fist; unit. A push that is to meet
  /// a shape begins on that side of it which it comes from. Nothing while another gesture is in the air, or
  /// is being taken back.
  void begin(DesktopTool tool, TimePoint time, const glm::dvec3& at, const glm::dvec3& direction,
             const HandTouch& touch);
  void move(TimePoint time, const glm::dvec3& at, const HandTouch& touch);
  /// The fist has turned so much in all since it closed.
  void turn(TimePoint time, const glm::dquat& turn);
  /// Divides the stroke that is being drawn.
  void tap_thumb(TimePoint time);
  /// The gesture is over, there. With `more`, a pen is lifted but stays in hand: what it drew and what it
  /// draws next are one change.
  enum class Ending { whole, more };
  void end(TimePoint time, const glm::dvec3& at, const HandTouch& touch, Ending ending = Ending::whole);
  /// A pen that stayed in hand is put down: its change is committed.
  void put_down(TimePoint time);
  /// Takes back what is in the air.
  void cancel(TimePoint time);

  /// Once a frame: what waits is told.
  void flush(TimePoint time);
  std::vector<HandMessage> take();

  bool working() const { return tool_.has_value(); }
  /// A pen is in hand though it does not draw.
  bool pen_in_hand() const { return pen_in_hand_; }
  /// Somebody pressed that cell elsewhere (a key, a panel): the belief follows.
  void command(PaletteCommand command);
  /// What needs no hand, in its turn.
  void submit(v1::Operation operation) { messages_.emplace_back(std::move(operation)); }

 private:
  struct Modes {
    bool move = false;
    bool boundary = false;
    bool region = false;
  };
  HandPose pose_at(TimePoint time, const glm::dvec3& at, const HandTouch& touch) const;
  void send(HandPose pose);
  void send_hover(TimePoint time);
  void send_no_hand(TimePoint time);
  TimePoint later(TimePoint time);
  bool affords(TimePoint time) const;
  bool settling(TimePoint time, const glm::dvec3& at) const;
  void set_modes(DesktopTool tool);
  bool is_pen() const;

  HandStreamOptions options_;
  Modes modes_;
  std::vector<HandMessage> messages_;
  std::uint64_t sequence_ = 0;
  TimePoint last_time_;
  double tokens_ = 0.0;                    ///< Frames that may be sent at once, as of last_time_.
  std::optional<TimePoint> cancelled_at_;  ///< The hand is away until the server has noticed.
  std::optional<DesktopTool> tool_;
  bool pen_in_hand_ = false;
  v1::Gesture gesture_ = v1::GESTURE_OPEN;
  glm::dvec3 direction_{0.0, 0.0, 1.0};
  glm::dquat turn_{1.0, 0.0, 0.0, 0.0};
  TimePoint began_;
  glm::dvec3 began_at_{0.0};
  std::optional<HandPose> sent_;     ///< The last frame with a hand; nullopt: the hand is nowhere.
  std::optional<HandPose> waiting_;  ///< Of the gesture.
  std::optional<HandPose> hover_;    ///< Where the open hand is; told or not.
};

}  // namespace handloft::client
