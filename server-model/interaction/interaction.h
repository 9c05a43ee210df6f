#pragma once
// From the hand to the model (A25, architecture idea 2), a state machine by the gesture that the glove tells:
//
//   open, pressing      lays points (A1, A12)                        stroke_gesture.h
//   closed              near an icon drags it (D19);                 icon_drag_gesture.h
//                       else pushes points (A13-A17);                push_gesture.h
//                       with "Move" holds a shape                    transform_gesture.h
//   pointing, pressing  on a sculpted surface adds icons (D6-D12);   icon_pen_gesture.h
//                       else draws profiles or a boundary            profile_gesture.h, boundary_gesture.h
//                       (A18-A24);
//                       with "Move" (not pressing) holds a shape
//   on the table        the command whose cell is touched            palette_commands.h, exponent_gesture.h
//
// Beside the hands a 3D mouse drives the selected icon (space_mouse.h).
//
// A gesture is one operation, in the air while it lasts; when the glove tells another gesture it is committed
// and the next begins (the glove debounces). A hand that is lost beyond a grace period cancels it without a
// trace. A deterministic function of the sequence of tracking frames and the document: time is the frames'
// own.

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/table_palette.h"
#include "proto/tracking.pb.h"
#include "server-model/interaction/frame_outcome.h"
#include "server-model/interaction/gesture.h"
#include "server-model/interaction/hand_centre.h"
#include "server-model/interaction/hand_sample.h"
#include "server-model/interaction/palette_commands.h"
#include "server-model/interaction/space_mouse.h"
#include "server-model/interaction/workbench.h"
#include "server-model/model/model.h"

namespace handloft::interaction {

struct InteractionStatistics {
  std::uint64_t frames = 0;
  std::uint64_t frames_ignored = 0;  ///< With a NaN or the like; nothing of them was used.
  std::uint64_t frames_out_of_order = 0;
  std::uint64_t points_laid = 0;
  std::uint64_t strokes_committed = 0;
  std::uint64_t strokes_cancelled = 0;   ///< The hand was lost, or the base changed beneath the gesture.
  std::uint64_t gestures_committed = 0;  ///< Of all kinds, strokes among them.
  std::uint64_t gestures_cancelled = 0;
  std::uint64_t commands = 0;
  std::uint64_t refused = 0;  ///< Gestures and commands that the model refused.

  InteractionStatistics& operator+=(const InteractionStatistics& other);
};

/// What viewers show of an icon beside its state.
struct IconMark {
  enum class Kind {
    target,  ///< A hand would pick it now.
    held,    ///< A hand or the 3D mouse drives it now.
  };
  IconName name;
  Kind kind = Kind::target;
};

/// Owned and called by the model thread.
class Interaction {
 public:
  static constexpr std::size_t max_hands = 2;

  /// `model` must outlive it.
  explicit Interaction(model::Model& model, const InteractionOptions& options = {});
  /// One of several sources of hands on the model: the hands of client `client_id`, with a workbench of their
  /// own. All sources of a model share `claims`, not null.
  Interaction(model::Model& model, const InteractionOptions& options, ClaimsPtr claims,
              std::uint64_t client_id);

  FrameOutcome on_frame(const v1::TrackingFrame& frame);

  /// A command of the palette that a hand gives without touching the table (HandCommand): as a touch of its
  /// cell that leaves at once, whichever page is shown; gestures in the air go on, as they do when the other
  /// hand touches the table. Precondition: hand < max_hands.
  CommandAnswer command(std::size_t hand, PaletteCommand command, FrameOutcome& outcome);

  /// Nothing more comes (end of a recording, the daemon is gone): gestures in the air are committed, since a
  /// hand that we did not see leave made them on purpose.
  FrameOutcome finish();

  /// Nothing was heard of these hands for as long as a lease lasts: others may take the icons that they hold.
  /// They have them again with the next frame, if they are free by then. False: they held none.
  bool lapse();

  /// The entities that are selected: the one that was chosen, else what a gesture acted on last; at most one
  /// as yet.
  std::vector<std::string> selection() const;

  /// What strokes and the palette act on: the selected shape, else the one that a gesture acted on last,
  /// until "new shape"; empty when there is none or it is gone (an undo takes it away, a redo brings it
  /// back).
  std::string active_shape() const { return workbench_.active_shape(); }
  /// All gestures act on this shape from now on. Empty: as after "new shape". A gesture in the air goes on
  /// where it began.
  void select(std::string entity);
  /// What each hand acts on or would act on now: the selected shape, else the nearest within reach.
  /// Ascending, without repetition.
  std::vector<std::string> targets() const;

  /// The icons that hands are near or drive, by name; one that is driven is no target.
  std::vector<IconMark> icon_marks() const;
  /// What the palette's icon cells and the 3D mouse act on; empty: none.
  IconName selected_icon() const { return workbench_.selected_icon(); }

  /// What is chosen for sculpting, in words (sculpt_commands.h); empty while no sculpted surface is active.
  std::string sculpting_words() const { return interaction::sculpting_words(workbench_); }

  const Modes& modes() const { return workbench_.modes; }
  StrokeSymmetry symmetry() const { return workbench_.modes.symmetry; }
  const model::MirrorPlane& symmetry_plane() const { return workbench_.options.symmetry_plane; }
  HandActivity activity(std::size_t hand) const;
  const InteractionStatistics& statistics() const { return statistics_; }

 private:
  /// What a hand is at.
  enum class Doing {
    nothing,
    stroke,
    push,
    profile,
    boundary,
    hold_by_fist,
    hold_by_fingertip,
    exponent,
    drag_icon,
    draw_icon,
  };
  struct Hand {
    explicit Hand(const InteractionOptions& options) : centre(options.centre), fist(options.fist) {}
    HandCentre centre;
    HandCentre fist;
    std::unique_ptr<Gesture> gesture;  ///< Null: none.
    Doing doing = Doing::nothing;      ///< With a gesture, its kind.
    Doing refused = Doing::nothing;    ///< The model refused this one: quiet until the hand does another.
    std::optional<TimePoint> unusable_since;  ///< Of the present gap.
    bool touch_spent = false;                 ///< This touch of the table has given its command.
    HandActivity activity;
    std::optional<TimePoint> told_until;  ///< `activity` is bad news that stays until then.
    std::string target;
    std::optional<NearIcon> near_icon;  ///< That it would pick, or with `doing` picked.
    bool pressed = false;               ///< In the last frame.
    std::optional<Eigen::Vector3d> last_place;
  };
  enum class Gap { hand_lost, gesture_unknown };

  void on_hand(Hand& hand, const std::optional<HandSample>& sample, TimePoint now, FrameOutcome& outcome);
  void on_gap(Hand& hand, Gap gap, TimePoint now, FrameOutcome& outcome);
  void on_table(Hand& hand, const HandFrame& frame, FrameOutcome& outcome);
  CommandAnswer step_exponent(FrameOutcome& outcome);
  Doing wanted(Hand& hand, const HandFrame& frame);
  Doing wanted_closed(Hand& hand, const HandFrame& frame);
  Doing wanted_pointing(const Hand& hand, const HandFrame& frame);
  bool points_at_sculpted(const Eigen::Vector3d& tip);
  std::unique_ptr<Gesture> begin(Doing doing, const Hand& hand);
  void show_to(Hand& hand, const HandFrame& frame, TimePoint now, FrameOutcome& outcome);
  void commit(Hand& hand, FrameOutcome& outcome);
  void cancel(Hand& hand, std::string_view why, FrameOutcome& outcome);
  void refuse(Hand& hand, const Error& error, FrameOutcome& outcome);
  void tell(Hand& hand, std::string words, std::string entity, TimePoint now);
  void be_silent(Hand& hand, TimePoint now);
  void aim(Hand& hand, const HandFrame& frame, FrameOutcome& outcome);
  void aim_at_icon(Hand& hand, const HandFrame& frame, FrameOutcome& outcome);
  void count(const SpaceMouse::Counts& counts);
  /// What hands held, had selected and were refused before a frame, for feel().
  struct Felt {
    std::set<IconName> held;
    IconName selected;
    std::uint64_t refused = 0;
    bool refusing = false;
  };
  Felt felt() const;
  void feel(const Felt& before, FrameOutcome& outcome) const;

  Workbench workbench_;
  PaletteCommands palette_;
  SpaceMouse space_mouse_;
  std::vector<Hand> hands_;
  std::optional<TimePoint> last_frame_;
  InteractionStatistics statistics_;
};

}  // namespace handloft::interaction
