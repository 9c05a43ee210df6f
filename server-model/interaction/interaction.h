#pragma once
// From the hand to the model (architecture idea 2; A1, A12, A25): the open hand lays points while it presses,
// one gesture is one stroke is one operation, provisional while it lasts; the hand on the table gives the
// command whose cell it touches (common/base/table_palette.h). A deterministic function of the sequence of
// tracking frames and the document: time is the frames' own.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/clock.h"
#include "common/base/table_palette.h"
#include "proto/tracking.pb.h"
#include "server-model/interaction/hand_centre.h"
#include "server-model/interaction/hand_sample.h"
#include "server-model/model/model.h"

namespace handloft::interaction {

/// What new strokes do (A12). The palette's symmetry cell steps through these in this order: a top surface
/// wants its mirror image in the same set, a side surface a partner on the other side.
enum class StrokeSymmetry { off, same_shape, partner };

struct InteractionOptions {
  /// A hand that is lost this long is gone: its gesture is cancelled. Shorter gaps (a hidden finger, a radio
  /// frame) only leave out points.
  Duration grace = std::chrono::milliseconds(250);
  double min_spacing_m = 0.0;    ///< Arc-length thinning (A1); 0: one point a frame, as the paper does.
  std::uint32_t new_degree = 0;  ///< Of shapes made by hand; 0: the model's default (2, A4).
  model::MirrorPlane symmetry_plane{
      Eigen::Vector3d::Zero(),
      Eigen::Vector3d::UnitX()};  ///< x = 0 through the table's origin: the mouse points along y.
  HandCentreOptions centre;
  SampleLimits limits;
};

struct InteractionStatistics {
  std::uint64_t frames = 0;
  std::uint64_t frames_ignored = 0;  ///< With a NaN or the like; nothing of them was used.
  std::uint64_t frames_out_of_order = 0;
  std::uint64_t points_laid = 0;
  std::uint64_t strokes_committed = 0;
  std::uint64_t strokes_cancelled = 0;  ///< The hand was lost, or the base changed beneath the gesture.
  std::uint64_t commands = 0;
  std::uint64_t refused = 0;  ///< Strokes and commands that the model refused.
};

/// What one frame led to.
struct FrameOutcome {
  bool scene_changed = false;               ///< The document, a gesture in the air, or the selection.
  std::vector<model::Submitted> submitted;  ///< In order.
  std::vector<std::string> problems;        ///< In words: ignored frames, refusals, cancellations.
};

/// What presence shows of a hand.
struct HandActivity {
  std::string tool;    ///< "laying points", "fit", "hand lost", or empty
  std::string entity;  ///< On which entity; may be empty.
};

/// Owned and called by the model thread.
class Interaction {
 public:
  static constexpr std::size_t max_hands = 2;

  /// `model` must outlive it.
  explicit Interaction(model::Model& model, InteractionOptions options = {});

  FrameOutcome on_frame(const v1::TrackingFrame& frame);

  /// Nothing more comes (end of a recording, the daemon is gone): strokes in the air are committed, since a
  /// hand that we did not see leave laid their points on purpose.
  FrameOutcome finish();

  /// What gestures act on: the shape that the hand made or added to last, until "new shape"; empty when there
  /// is none or it is gone (an undo takes it away, a redo brings it back).
  std::string active_shape() const;
  /// Empty clears it. A stroke in the air goes on where it began.
  void select(std::string entity);

  StrokeSymmetry symmetry() const { return symmetry_; }
  HandActivity activity(std::size_t hand) const;
  const InteractionStatistics& statistics() const { return statistics_; }

 private:
  struct Stroke {
    model::ProvisionalId id = 0;
    std::string entity;
    v1::Operation operation;  ///< With all of its points, to begin anew when the base changed beneath it.
  };
  struct Hand {
    explicit Hand(const HandCentreOptions& options) : centre(options) {}
    HandCentre centre;
    std::optional<Stroke> stroke;
    std::optional<TimePoint> unusable_since;  ///< Of the present gap.
    bool touch_spent = false;                 ///< This touch of the table has given its command.
    bool refused = false;  ///< The model refused this gesture's stroke: quiet until the next.
    HandActivity activity;
  };

  void on_hand(Hand& hand, const std::optional<HandSample>& sample, TimePoint now, FrameOutcome& outcome);
  enum class Gap { hand_lost, gesture_unknown };

  void on_gap(Hand& hand, Gap gap, TimePoint now, FrameOutcome& outcome);
  void lay_point(Hand& hand, const Eigen::Vector3d& position, const HandSample& sample,
                 FrameOutcome& outcome);
  v1::Operation new_stroke() const;
  std::string next_shape_id() const;
  bool begin_stroke(Hand& hand, v1::Operation operation, FrameOutcome& outcome);
  void commit_stroke(Hand& hand, FrameOutcome& outcome);
  void cancel_stroke(Hand& hand, std::string_view why, FrameOutcome& outcome);
  void run_command(Hand& hand, PaletteCommand command, FrameOutcome& outcome);
  bool submit(const v1::Operation& operation, FrameOutcome& outcome);
  bool submit_fit(FrameOutcome& outcome);
  bool toggle_representation(FrameOutcome& outcome);
  bool show(model::Representation representation, FrameOutcome& outcome);

  model::Model& model_;
  InteractionOptions options_;
  std::vector<Hand> hands_;
  std::string active_;
  StrokeSymmetry symmetry_ = StrokeSymmetry::off;
  std::optional<TimePoint> last_frame_;
  InteractionStatistics statistics_;
};

}  // namespace handloft::interaction
