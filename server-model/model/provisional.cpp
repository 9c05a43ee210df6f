#include "server-model/model/provisional.h"

#include <fmt/format.h>

#include <utility>
#include <vector>

#include "server-model/model/operations/operations.h"
#include "server-model/model/operations/profile_edit.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace v1 = handloft::v1;

Provisional::Provisional(Document base, v1::Operation operation, ApplyContext context, ApplyResult applied)
    : base_(std::move(base)),
      operation_(std::move(operation)),
      context_(std::move(context)),
      applied_(std::move(applied)) {}

Result<Provisional> Provisional::begin(Document base, v1::Operation operation, ApplyContext context) {
  if (operation.has_modify_profile()) context.profile_solvers = std::make_shared<ProfileSolvers>();
  auto applied = apply(base, operation, context);
  if (!applied) return applied.error();
  return Provisional(std::move(base), std::move(operation), std::move(context), std::move(*applied));
}

Status Provisional::append(std::span<const v1::Point> points) {
  if (!operation_.has_add_points()) {
    return make_error(ErrorCode::failed_precondition, "points can only be appended to add_points");
  }
  v1::AddPoints& request = *operation_.mutable_add_points();
  const auto before = static_cast<std::size_t>(request.points_size());
  if (before + points.size() > context_.limits.max_points_per_operation) {
    return make_error(ErrorCode::resource_exhausted, "the gesture has too many points", "add_points.points");
  }
  auto read = read_points(points, "points", context_.limits);
  if (!read) return read.error();
  const std::string entity = applied_.effective.add_points().entity();
  if (request.refit() && !live_) live_ = std::make_unique<LiveFit>(applied_.document, entity);
  auto extended = extend_stroke(applied_.document, entity, applied_.effective.add_points().stroke(), *read,
                                request.min_spacing_m(), context_.limits);
  if (!extended) return extended.error();
  for (const v1::Point& point : points) *request.add_points() = point;
  applied_.document = std::move(*extended);
  if (live_) live_->follow(applied_.document);
  applied_.changes = difference(base_, applied_.document);
  return {};
}

Status Provisional::append_disk(std::span<const v1::DiskPose> poses, double range) {
  if (!operation_.has_push_points()) {
    return make_error(ErrorCode::failed_precondition,
                      "poses of the disk can only be appended to push_points");
  }
  v1::PushPoints& request = *operation_.mutable_push_points();
  const std::size_t before = static_cast<std::size_t>(request.path_size());
  if (auto status = check_push(range, before + poses.size(), context_.limits); !status) return status;
  std::vector<geometry::DiskPose> read;
  for (const v1::DiskPose& pose : poses) {
    auto one = read_disk_pose(pose, fmt::format("path[{}]", before + read.size()), context_.limits);
    if (!one) return one.error();
    read.push_back(*one);
  }
  // Poses that this gesture has not seen: all of them the first time, and after a refusal.
  if (!push_) {
    auto begun = PushGesture::begin(base_, request);
    if (!begun) return begun.error();
    push_ = std::make_unique<PushGesture>(*std::move(begun));
    std::vector<geometry::DiskPose> all;
    for (std::size_t i = 0; i < before; ++i) {
      auto one = read_disk_pose(request.path(static_cast<int>(i)), "path", context_.limits);
      if (!one) return one.error();
      all.push_back(*one);
    }
    all.insert(all.end(), read.begin(), read.end());
    read = std::move(all);
  }
  const double range_before = request.range();
  request.set_range(range);
  for (const v1::DiskPose& pose : poses) *request.add_path() = pose;
  std::vector<std::string> notes;
  auto pushed = [&]() -> Result<PushGesture::Pushed> {
    for (const geometry::DiskPose& pose : read) {
      if (auto status = push_->move_disk(pose); !status) return status.error();
    }
    return push_->result(base_, request, context_, notes);
  }();
  if (!pushed) {
    push_.reset();  // It has seen the refused poses.
    request.mutable_path()->DeleteSubrange(static_cast<int>(before), static_cast<int>(poses.size()));
    request.set_range(range_before);
    return pushed.error();
  }
  applied_.document = std::move(pushed->document);
  applied_.changes = difference(base_, applied_.document);
  applied_.notes = std::move(notes);
  return {};
}

Status Provisional::update(v1::Operation operation) {
  auto applied = apply(base_, operation, context_);
  if (!applied) return applied.error();
  operation_ = std::move(operation);
  applied_ = std::move(*applied);
  live_.reset();
  push_.reset();
  return {};
}

Status Provisional::rebase(Document base) {
  auto applied = apply(base, operation_, context_);
  if (!applied) return applied.error();
  base_ = std::move(base);
  applied_ = std::move(*applied);
  live_.reset();
  push_.reset();
  return {};
}

}  // namespace handloft::model
