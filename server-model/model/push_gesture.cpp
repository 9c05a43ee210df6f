#include "server-model/model/push_gesture.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "server-model/geometry/symmetry.h"
#include "server-model/model/operations/fitting.h"
#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace {

using geometry::Contact;
using geometry::Vec3;

// Two pushes of a point and its image that differ by less are alike: the choice between them must not turn on
// rounding.
constexpr double alike = 1e-6;

Result<Vec3> read_finite(const handloft::v1::Vec3& vector, const std::string& field, const Limits& limits) {
  const Vec3 read(vector.x(), vector.y(), vector.z());
  for (int axis = 0; axis < 3; ++axis) {
    if (auto status = check_coordinate(read[axis], fmt::format("{}.{}", field, "xyz"[axis]), limits);
        !status) {
      return status.error();
    }
  }
  return read;
}

bool clearly_longer(const Vec3& a, const Vec3& b) {
  return a.norm() > (1 + alike) * b.norm();
}

}  // namespace

Result<geometry::DiskPose> read_disk_pose(const handloft::v1::DiskPose& pose, const std::string& field,
                                          const Limits& limits) {
  auto centre = read_finite(pose.centre(), field + ".centre", limits);
  if (!centre) return centre.error();
  auto normal = read_finite(pose.normal(), field + ".normal", limits);
  if (!normal) return normal.error();
  if (!(normal->stableNorm() > 0)) {
    return make_error(ErrorCode::invalid_argument, "found no direction, expected a vector that is not 0",
                      field + ".normal");
  }
  if (!(pose.radius_m() >= 0 && pose.radius_m() <= limits.max_disk_radius_m)) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {}, expected metres, 0..{}", pose.radius_m(), limits.max_disk_radius_m),
        field + ".radius_m");
  }
  return geometry::DiskPose{*centre, normal->stableNormalized(), pose.radius_m()};
}

Status check_push(double range, std::size_t poses, const Limits& limits) {
  if (!(range >= 0 && range <= 1)) {
    return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected 0..1", range), "range");
  }
  if (poses > limits.max_disk_poses) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} poses, expected at most {}", poses, limits.max_disk_poses),
                      "path");
  }
  return {};
}

Result<PushGesture> PushGesture::begin(const Document& document, const handloft::v1::PushPoints& request) {
  if (request.entities().empty()) {
    return make_error(ErrorCode::invalid_argument, "found none, expected at least one shape", "entities");
  }
  std::set<std::string, std::less<>> named;
  PushGesture gesture;
  for (int i = 0; i < request.entities_size(); ++i) {
    const std::string field = fmt::format("entities[{}]", i);
    auto shape = require_dual(document, request.entities(i), field);
    if (!shape) return shape.error();
    if (!named.insert((*shape)->id).second) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found \"{}\" twice, expected each shape once", (*shape)->id), field);
    }
    if (auto status = gesture.add(*shape, true); !status) return status.error();
  }
  for (std::size_t i = 0, count = gesture.shapes_.size(); i < count; ++i) {
    const DualPtr partner = linked_partner(document, *gesture.shapes_[i].before);
    if (!partner || !named.insert(partner->id).second) continue;
    if (auto status = gesture.add(partner, false); !status) return status.error();
  }
  for (std::size_t i = 0; i < gesture.shapes_.size(); ++i) {
    const DualShape& shape = *gesture.shapes_[i].before;
    if (shape.symmetry == SymmetryMode::same_shape) gesture.shapes_[i].linked = i;
    if (shape.symmetry != SymmetryMode::partner) continue;
    for (std::size_t k = 0; k < gesture.shapes_.size(); ++k) {
      if (gesture.shapes_[k].before->id == shape.partner) gesture.shapes_[i].linked = k;
    }
  }
  return gesture;
}

Status PushGesture::add(DualPtr shape, bool named) {
  std::vector<Vec3> rest;
  rest.reserve(shape->points.size());
  for (const DualPoint& point : shape->points) rest.push_back(point.position());
  auto solver = geometry::PushSolver::create(rest);
  if (!solver) return solver.error();
  shapes_.push_back({std::move(shape), *std::move(solver), named, none});
  return {};
}

Status PushGesture::move_disk(const geometry::DiskPose& pose) {
  for (Shape& shape : shapes_) {
    if (!shape.named) continue;
    if (auto status = shape.solver.move_disk(pose); !status) return status;
  }
  return {};
}

std::vector<Contact> PushGesture::merged_contacts(std::size_t index,
                                                  const std::vector<std::vector<Contact>>& own) const {
  const Shape& shape = shapes_[index];
  if (shape.linked == none) return own[index];
  const DualShape& before = *shape.before;
  // Where each point's push stands among the contacts, of this shape and of the one that holds the images.
  const auto by_point = [&](std::size_t which) {
    std::vector<const Contact*> found(shapes_[which].before->points.size(), nullptr);
    for (const Contact& contact : own[which]) found[contact.index] = &contact;
    return found;
  };
  const auto mine = by_point(index), others = by_point(shape.linked);
  std::vector<Contact> merged;
  for (std::uint32_t i = 0; i < mine.size(); ++i) {
    const std::uint32_t image = before.mirror_partner(i);
    const Contact* other = image < others.size() ? others[image] : nullptr;
    if (!other) {
      if (mine[i]) merged.push_back(*mine[i]);
      continue;
    }
    const Vec3 mirrored = geometry::reflect_direction(other->displacement, before.plane);
    const bool earlier = shape.linked == index ? i < image : before.id < shapes_[shape.linked].before->id;
    const bool keep = mine[i] && (clearly_longer(mine[i]->displacement, mirrored) ||
                                  (earlier && !clearly_longer(mirrored, mine[i]->displacement)));
    merged.push_back({i, keep ? mine[i]->displacement : mirrored});
  }
  return merged;
}

// The images follow their points exactly, whatever the propagation's rounding.
void PushGesture::mirror(std::vector<std::vector<Vec3>>& displacements) const {
  for (std::size_t index = 0; index < shapes_.size(); ++index) {
    const Shape& shape = shapes_[index];
    if (shape.linked == none) continue;
    const DualShape& before = *shape.before;
    std::vector<Vec3>& images = displacements[shape.linked];
    if (shape.linked != index && !(before.id < shapes_[shape.linked].before->id)) continue;
    for (std::uint32_t i = 0; i < displacements[index].size(); ++i) {
      const std::uint32_t image = before.mirror_partner(i);
      if (image >= images.size() || (shape.linked == index && image < i)) continue;
      images[image] = geometry::reflect_direction(displacements[index][i], before.plane);
    }
  }
}

Result<PushGesture::Pushed> PushGesture::result(const Document& document,
                                                const handloft::v1::PushPoints& request,
                                                const ApplyContext& context,
                                                std::vector<std::string>& notes) const {
  const Limits& limits = context.limits;
  const auto falloff = request.falloff() == handloft::v1::FALLOFF_SMOOTH ? geometry::Falloff::smooth
                                                                         : geometry::Falloff::literal;
  Pushed pushed{document, 0};
  std::vector<std::vector<Contact>> own;
  for (const Shape& shape : shapes_) {
    own.push_back(shape.solver.contacts());
    pushed.contacts += own.back().size();
  }
  std::vector<std::vector<Vec3>> displacements;
  for (std::size_t i = 0; i < shapes_.size(); ++i) {
    displacements.push_back(
        shapes_[i].solver.displacements(merged_contacts(i, own), request.range(), falloff, context.parallel));
  }
  mirror(displacements);

  for (std::size_t s = 0; s < shapes_.size(); ++s) {
    const DualShape& before = *shapes_[s].before;
    std::vector<std::size_t> moved;
    std::vector<DualPoint> points;
    for (std::size_t i = 0; i < displacements[s].size(); ++i) {
      const Vec3& by = displacements[s][i];
      if (by.isZero(0)) continue;
      DualPoint point = before.points[i];
      const Vec3 place = point.position() + by;
      if (!(place.cwiseAbs().maxCoeff() <= limits.max_coordinate_m)) {
        return make_error(ErrorCode::invalid_argument,
                          fmt::format("would push point {} of \"{}\" out of the workspace of {} m", i,
                                      before.id, limits.max_coordinate_m),
                          "path");
      }
      point.x = place.x();
      point.y = place.y();
      point.z = place.z();
      moved.push_back(i);
      points.push_back(point);
    }
    if (moved.empty()) continue;
    DualShape after = before;
    after.points = before.points.with(moved, points);
    after.stale = after.fitted();
    put(pushed.document, std::move(after));
  }
  if (request.refit()) {
    std::set<std::string, std::less<>> fitted;
    for (int i = 0; i < request.entities_size(); ++i) {
      const DualPtr shape = pushed.document.find_dual(request.entities(i));
      if (!shape || !shape->stale || !fitted.insert(shape->id).second) continue;
      if (const DualPtr partner = linked_partner(pushed.document, *shape)) fitted.insert(partner->id);
      if (auto status = refit(pushed.document, shape->id, fmt::format("entities[{}]", i), notes); !status) {
        return status.error();
      }
    }
  }
  return pushed;
}

}  // namespace handloft::model
