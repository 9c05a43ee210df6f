#pragma once
// The 3D mouse drives the selected icon (seed 003, step 4 of D19), when that is driving and lists the sensor
// "spacemouse". The cap's displacement is a velocity: it is integrated over the frames' own times by the
// trapezoid rule, so that the way does not hang on how many frames there are. One push, up to the cap's rest
// of 0.3 s, is one DragIcon, seen in the air meanwhile; undo takes it back as one step.
//
// The axes are the world's: the mouse stands upright on the table as the designer sees it, x to the right, y
// away, z up. What tracking does not tell counts as a cap at rest.

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "proto/tracking.pb.h"
#include "server-model/interaction/air_operation.h"
#include "server-model/interaction/frame_outcome.h"
#include "server-model/interaction/workbench.h"

namespace handloft::interaction {

/// A cap's displacement, -1..1 an axis.
struct SpaceMouseSample {
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();

  bool at_rest() const { return translation.isZero(0) && rotation.isZero(0); }
};

/// Checks the frame's 3D mouse and takes the dead zone off; numbers beyond 1 count as 1. A frame without one
/// has a cap at rest. Errors: invalid_argument naming the field for what is not finite.
Result<SpaceMouseSample> read_space_mouse(const v1::TrackingFrame& frame, const SpaceMouseOptions& options);

class SpaceMouse {
 public:
  struct Counts {
    int committed = 0;
    int refused = 0;
  };

  /// `workbench` must outlive it.
  explicit SpaceMouse(Workbench& workbench) : workbench_(workbench) {}

  /// Frames must come in order of time.
  Counts on_frame(const SpaceMouseSample& sample, TimePoint now, FrameOutcome& outcome);
  /// Nothing more comes: what is in the air is committed.
  Counts finish(FrameOutcome& outcome);

  /// The icon that it drives now; empty: none.
  IconName held() const { return drag_ ? drag_->hold.name() : IconName(); }

 private:
  /// One push of the cap.
  struct Drag {
    explicit Drag(Workbench& workbench) : air(workbench), hold(workbench) {}
    AirOperation air;
    IconHold hold;
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
    bool turns = false;
    bool refusing = false;  ///< The model refused the last frame: told once.
  };

  void begin();
  void move(const SpaceMouseSample& sample, double seconds, FrameOutcome& outcome);
  Counts end(FrameOutcome& outcome);

  Workbench& workbench_;
  std::unique_ptr<Drag> drag_;  ///< Null: none.
  SpaceMouseSample last_;
  std::optional<TimePoint> last_time_;
  TimePoint moved_at_;  ///< The cap was last seen away from rest.
};

}  // namespace handloft::interaction
