#include "server-model/geometry/push_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "server-model/geometry/push.h"

namespace handloft::geometry {

namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
// Farther away than any workspace; keeps squares and their sums far from overflow.
constexpr double absurd_m = 1e9;

bool sensible(const Vec3& v) {
  return v.allFinite() && v.cwiseAbs().maxCoeff() <= absurd_m;
}

Status check(const DiskPose& pose) {
  if (!sensible(pose.centre)) {
    return make_error(ErrorCode::invalid_argument, "found a coordinate that is not finite or absurdly large",
                      "centre");
  }
  if (!pose.normal.allFinite() || !(pose.normal.stableNorm() > 0)) {
    return make_error(ErrorCode::invalid_argument,
                      "found no direction, expected a finite vector that is not 0", "normal");
  }
  if (!(pose.radius_m >= 0 && pose.radius_m <= absurd_m)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected metres, 0 or more", pose.radius_m), "radius_m");
  }
  return {};
}

}  // namespace

PushSolver::PushSolver(std::shared_ptr<const PointTree> tree)
    : tree_(std::move(tree)), place_(tree_->size(), none) {}

Result<PushSolver> PushSolver::create(std::span<const Vec3> rest) {
  if (rest.size() >= none) {
    return make_error(ErrorCode::resource_exhausted, fmt::format("found {} points", rest.size()), "rest");
  }
  const auto bad = std::find_if(rest.begin(), rest.end(), [](const Vec3& p) { return !sensible(p); });
  if (bad != rest.end()) {
    return make_error(ErrorCode::invalid_argument, "found a coordinate that is not finite or absurdly large",
                      fmt::format("rest[{}]", bad - rest.begin()));
  }
  return PushSolver(std::make_shared<const PointTree>(rest, propagation_leaf_size));
}

Status PushSolver::move_disk(const DiskPose& pose) {
  if (auto status = check(pose); !status) return status;
  DiskPose now = pose;
  now.normal = pose.normal.stableNormalized();
  if (disk_) {
    const DiskSweep sweep(*disk_, now);
    // Points met before may be away from their places in the tree.
    for (Met& met : met_) met.position = sweep.push(met.position);
    const double reach = sweep.reach_m() + contact_slack_m;
    tree_->near_segment(disk_->centre, now.centre, reach, [&](std::uint32_t slot) {
      if (place_[slot] != none) return;
      const Vec3& rest = tree_->points()[slot];
      const Vec3 moved = sweep.push(rest);
      if ((moved - rest).isZero(0)) return;
      place_[slot] = static_cast<std::uint32_t>(met_.size());
      met_.push_back({slot, moved});
    });
  }
  disk_ = now;
  return {};
}

std::vector<Contact> PushSolver::contacts() const {
  std::vector<Contact> result;
  result.reserve(met_.size());
  for (const Met& met : met_) {
    const Vec3 pushed = met.position - tree_->points()[met.slot];
    if (pushed.squaredNorm() > contact_slack_m * contact_slack_m) {
      result.push_back({tree_->index_of(met.slot), pushed});
    }
  }
  std::sort(result.begin(), result.end(),
            [](const Contact& a, const Contact& b) { return a.index < b.index; });
  return result;
}

double PushSolver::squared_reach_m2(std::span<const Contact> contacts) const {
  if (contacts.empty()) return 0;
  std::vector<Vec3> pushed;
  pushed.reserve(contacts.size());
  std::vector<std::uint8_t> is_contact(tree_->size(), 0);
  for (const Contact& contact : contacts) {
    const std::uint32_t slot = tree_->slot_of(contact.index);
    pushed.push_back(tree_->points()[slot]);
    is_contact[slot] = 1;
  }
  const auto& nodes = tree_->nodes();
  std::vector<std::uint32_t> others(nodes.size());
  for (std::size_t i = nodes.size(); i-- > 0;) {  // Children stand behind their parents.
    const PointTree::Node& node = nodes[i];
    if (node.leaf()) {
      for (std::uint32_t slot = node.begin; slot < node.end; ++slot) others[i] += is_contact[slot] == 0;
    } else {
      others[i] = others[node.left] + others[node.right];
    }
  }
  return farthest_squared_distance(
      PointTree(pushed, propagation_leaf_size), *tree_,
      [&](std::uint32_t slot) { return is_contact[slot] == 0; }, others);
}

std::vector<Vec3> PushSolver::displacements(double range, Falloff falloff,
                                            const ParallelFor& parallel) const {
  return displacements(contacts(), range, falloff, parallel);
}

std::vector<Vec3> PushSolver::displacements(std::span<const Contact> contacts, double range, Falloff falloff,
                                            const ParallelFor& parallel) const {
  const double fraction = std::isfinite(range) ? std::clamp(range, 0.0, 1.0) : 0.0;
  // The square of the fraction times d_max^2 itself: with fraction 1 the farthest point gets exactly nothing.
  const double squared_range = fraction > 0 ? fraction * fraction * squared_reach_m2(contacts) : 0.0;
  std::vector<Vec3> result = propagate(*tree_, contacts, squared_range, falloff, parallel);
  for (const Contact& contact : contacts) {
    Vec3& v = result[contact.index];
    if (contact.displacement.squaredNorm() >= v.squaredNorm()) v = contact.displacement;
  }
  return result;
}

}  // namespace handloft::geometry
