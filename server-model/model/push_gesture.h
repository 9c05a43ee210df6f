#pragma once
// A push of the modification disk through shapes (PushPoints, A13-A17), taken pose by pose: the solvers of
// all shapes that it may change, and what their mirror images do (A12).
//
// Each shape is pushed for itself: its contacts, its d_max. A linked point follows its mirror image as if the
// mirrored disk pushed too; where both were met, the larger push counts (the earlier point's, where they are
// alike), and what is propagated is mirrored with them. A partner shape that is not named itself is pushed by
// its images alone.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "server-model/geometry/push_solver.h"
#include "server-model/model/document.h"

namespace handloft::model {

/// Errors, below `field`: invalid_argument for places outside the workspace, no normal, a radius outside
/// 0..Limits::max_disk_radius_m.
Result<geometry::DiskPose> read_disk_pose(const handloft::v1::DiskPose& pose, const std::string& field,
                                          const Limits& limits);
/// Checks the range and the number of poses that the gesture would have.
Status check_push(double range, std::size_t poses, const Limits& limits);

class PushGesture {
 public:
  /// Of the request's entities as they are in `document`; its path is not looked at. O(n log n) in their
  /// points. Errors: not_found, invalid_argument.
  static Result<PushGesture> begin(const Document& document, const handloft::v1::PushPoints& request);

  /// Precondition: read_disk_pose() let it pass.
  Status move_disk(const geometry::DiskPose& pose);

  struct Pushed {
    Document document;
    std::size_t contacts = 0;  ///< Points that the disk met, mirror images not counted.
  };
  /// `document`, of which this was begun, with the points where the gesture has brought them; fits stale, or
  /// fitted again when the request says so. A function of the poses and the range alone. Cost: O(points
  /// moved), and a fit with `refit`. Errors: invalid_argument for a point pushed out of the workspace; those
  /// of the fit.
  Result<Pushed> result(const Document& document, const handloft::v1::PushPoints& request,
                        const ApplyContext& context, std::vector<std::string>& notes) const;

 private:
  struct Shape {
    DualPtr before;
    geometry::PushSolver solver;
    bool named;          // Else it follows its partner alone.
    std::size_t linked;  // Which of the shapes holds its mirror images: itself, its partner, or none.
  };
  static constexpr std::size_t none = SIZE_MAX;

  Status add(DualPtr shape, bool named);
  std::vector<geometry::Contact> merged_contacts(
      std::size_t shape, const std::vector<std::vector<geometry::Contact>>& own) const;
  void mirror(std::vector<std::vector<geometry::Vec3>>& displacements) const;

  std::vector<Shape> shapes_;
};

}  // namespace handloft::model
