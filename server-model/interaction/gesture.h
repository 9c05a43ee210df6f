#pragma once
// What all gestures of the hand have in common (A25, architecture idea 2): begun by a first frame, previewed
// with every further one as one operation in the air, and ended by a commit, which makes it one step of
// history, or by a cancel, which leaves no trace. One subclass a kind of gesture, one object a gesture.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "server-model/geometry/disk.h"
#include "server-model/interaction/hand_sample.h"
#include "server-model/model/model.h"

namespace handloft::interaction {

/// What presence shows of a hand.
struct HandActivity {
  std::string tool;                        ///< "laying points", "fit", "hand lost", or empty
  std::string entity;                      ///< On which entity; may be empty.
  std::optional<geometry::DiskPose> disk;  ///< While the hand is closed (A13).
  std::vector<Eigen::Vector3d> curve;      ///< Being drawn by a pointing hand, world, metres.
};

/// A hand's frame with what was worked out of it.
struct HandFrame {
  HandSample sample;
  /// The mean of the fingertips, as HandCentre has it; nullopt: the hand is not seen well enough.
  std::optional<Eigen::Vector3d> centre;
  /// The same by the fist's more patient options.
  std::optional<Eigen::Vector3d> fist_centre;
};

enum class Preview {
  unseen,   ///< This frame held nothing that the gesture can use.
  same,     ///< Used, and the scene is as it was.
  changed,  ///< The scene has changed.
};

class Gesture {
 public:
  Gesture() = default;
  virtual ~Gesture() = default;
  Gesture(const Gesture&) = delete;
  Gesture& operator=(const Gesture&) = delete;

  /// One more frame of the hand in this gesture, in order of time. An error: the model refuses the gesture,
  /// which is over then and has left no trace.
  virtual Result<Preview> on_frame(const HandFrame& frame) = 0;
  /// The glove tells of another gesture since `since`, before debouncing; nullopt: it is not known since
  /// when. A commit follows, or the like again, or frames when the hand comes back to this gesture.
  virtual void let_go(std::optional<TimePoint> since) { static_cast<void>(since); }
  /// Ends it as one operation; nullopt: there was nothing to do. An error: refused at last, without a trace.
  virtual Result<std::optional<model::Submitted>> commit() = 0;
  /// Ends it without a trace.
  virtual void cancel() = 0;
  /// The hand has done something that would be lost with it: laid a point, met a shape, drawn a line.
  virtual bool begun() const = 0;
  /// It is complete, though the hand goes on with the like: to be committed now.
  virtual bool done() const { return false; }
  /// The model refused what the last frame asked for; the gesture goes on as it was before.
  virtual bool refusing() const { return false; }
  virtual HandActivity activity() const = 0;
  virtual std::string_view name() const = 0;  ///< For messages: "stroke", "push".
};

inline void set_vec3(v1::Vec3& to, const Eigen::Vector3d& from) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

}  // namespace handloft::interaction
