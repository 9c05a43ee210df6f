#pragma once
// One push gesture on one cloud (A13-A17): made of the rest positions at the gesture's start, it takes the
// poses of the disk one at a time and gives the displacement of every point for the present range.
//
//   auto solver = PushSolver::create(rest_positions);
//   solver->move_disk(pose);                                // every frame; the first only places the disk
//   solver->displacements(potentiometer, Falloff::literal); // by index
//
// What is frame-rate independent, and how (A17). A contact is tested where the point's own pushes have
// brought it, never where propagation has, so that the contacts depend on the motion of the disk alone;
// between poses the disk moves as push.h says, in closed form. Propagation is a function of the rest
// distances, the contacts' total displacements and the range, computed anew each time: turning the
// potentiometer back gives what was. The same motion at 30 and at 90 poses a second thus gives the same
// within 1e-9 m, and poses given one at a time the same bits as all at once.
//
// A pushed point moves by its own push, unless what it would get from the others is larger: a point that the
// disk reaches only now stays where propagation has already brought it, until its own push exceeds that.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/disk.h"
#include "server-model/geometry/propagation.h"

namespace handloft::geometry {

/// A value: copies share the immutable tree. Not thread-safe.
class PushSolver {
 public:
  /// O(n log n). Errors: invalid_argument for a coordinate that is not finite, resource_exhausted for 2^32
  /// points or more.
  static Result<PushSolver> create(std::span<const Vec3> rest);

  /// Sweeps the disk from the last pose to this one. The normal is normalised. Cost: the points near the
  /// sweep. Errors: invalid_argument for numbers that are not finite, no normal or a negative radius; then
  /// nothing changes.
  Status move_disk(const DiskPose& pose);

  /// The points pushed by more than contact_slack_m so far, by ascending index, with their total pushes
  /// (A14).
  std::vector<Contact> contacts() const;

  /// Where each point is displaced to, for the disk's own contacts. `range` is the potentiometer's fraction
  /// 0..1 of d_max (A16), clamped.
  std::vector<Vec3> displacements(double range, Falloff falloff,
                                  const ParallelFor& parallel = run_in_turn) const;

  /// The same for other contacts, such as those of a mirrored disk. Precondition: as propagate().
  std::vector<Vec3> displacements(std::span<const Contact> contacts, double range, Falloff falloff,
                                  const ParallelFor& parallel = run_in_turn) const;

  /// d_max^2: of all pairs of a contact and a point that is none, at rest (A16); 0 when there is no such
  /// pair.
  double squared_reach_m2(std::span<const Contact> contacts) const;

  std::size_t size() const { return tree_->size(); }

 private:
  explicit PushSolver(std::shared_ptr<const PointTree> tree);

  std::shared_ptr<const PointTree> tree_;
  std::optional<DiskPose> disk_;
  // Where pushes have brought the points that the disk has met, by slot: a list and each slot's place in it.
  struct Met {
    std::uint32_t slot;
    Vec3 position;
  };
  std::vector<Met> met_;
  std::vector<std::uint32_t> place_;  // By slot; none: never met.
};

}  // namespace handloft::geometry
