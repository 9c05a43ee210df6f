#pragma once
// A gesture in the air (architecture idea 2): an operation under construction, evaluated against the
// unchanged base document. Points are appended in O(new points); when the base changes beneath it, it is
// evaluated anew.

#include <memory>
#include <span>
#include <string>

#include "common/base/result.h"
#include "server-model/model/document.h"
#include "server-model/model/live_fit.h"
#include "server-model/model/push_gesture.h"

namespace handloft::model {

class Provisional {
 public:
  /// Evaluates `operation` on `base`; what apply() refuses is refused.
  static Result<Provisional> begin(Document base, handloft::v1::Operation operation,
                                   ApplyContext context = {});

  /// Only while the operation is add_points: more points of the same stroke. Equal to beginning with all
  /// points at once, to the bit; with add_points.refit all but the surface, which follows live as live_fit.h
  /// says. On refusal nothing changes.
  Status append(std::span<const handloft::v1::Point> points);

  /// Only while the operation is push_points: the disk's next poses (none: only the range changes), and the
  /// range from now on, for the whole gesture. Begin with two poses, which may be alike, then call this every
  /// frame. Equal to beginning with all poses and the last range at once, to the bit. Cost: the points near
  /// the disk and those that move; the first call makes the solvers, O(n log n). On refusal nothing changes.
  Status append_disk(std::span<const handloft::v1::DiskPose> poses, double range);

  /// Replaces the operation by another one, evaluated on the same base. On refusal nothing changes. Where
  /// both are modify_profile, what was factored of the shapes is kept (profile_edit.h).
  Status update(handloft::v1::Operation operation);

  /// Evaluates anew on another base. On refusal (its entity is gone, its stroke number was taken) nothing
  /// changes.
  Status rebase(Document base);

  const handloft::v1::Operation& operation() const {
    return operation_;
  }  ///< As asked for, with all points so far.
  const Document& base() const { return base_; }
  const Document& result() const { return applied_.document; }  ///< The base with the gesture so far.
  const ApplyResult& applied() const {
    return applied_;
  }  ///< `effective` is not kept up to date by append().

 private:
  Provisional(Document base, handloft::v1::Operation operation, ApplyContext context, ApplyResult applied);

  Document base_;
  handloft::v1::Operation operation_;
  ApplyContext context_;
  ApplyResult applied_;
  std::unique_ptr<PushGesture> push_;  ///< From the first append_disk() on.
  std::unique_ptr<LiveFit> live_;      ///< With add_points.refit, from the first append() on.
};

}  // namespace handloft::model
