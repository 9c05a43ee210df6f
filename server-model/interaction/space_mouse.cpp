#include "server-model/interaction/space_mouse.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "server-model/interaction/gesture.h"

namespace handloft::interaction {
namespace {

using Eigen::Vector3d;

Result<Vector3d> read_axes(const v1::Vec3& axes, const char* field, double dead_zone) {
  Vector3d result(axes.x(), axes.y(), axes.z());
  constexpr std::array<char, 3> names{'x', 'y', 'z'};
  for (std::size_t i = 0; i < names.size(); ++i) {
    double& value = result[static_cast<Eigen::Index>(i)];
    if (!std::isfinite(value)) {
      return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected -1..1", value),
                        fmt::format("space_mouse.{}.{}", field, names[i]));
    }
    const double beyond = std::max(0.0, std::min(std::abs(value), 1.0) - dead_zone);
    value = std::copysign(beyond / (1 - dead_zone), value);
  }
  return result;
}

}  // namespace

Result<SpaceMouseSample> read_space_mouse(const v1::TrackingFrame& frame, const SpaceMouseOptions& options) {
  SpaceMouseSample sample;
  if (!frame.has_space_mouse()) return sample;
  auto translation = read_axes(frame.space_mouse().translation(), "translation", options.dead_zone);
  if (!translation) return translation.error();
  auto rotation = read_axes(frame.space_mouse().rotation(), "rotation", options.dead_zone);
  if (!rotation) return rotation.error();
  sample.translation = *translation;
  sample.rotation = *rotation;
  return sample;
}

void SpaceMouse::begin() {
  const IconName name = workbench_.selected_icon();
  const model::SculptIcon* icon = find_icon(workbench_.model.document(), name);
  if (icon == nullptr || !is_driven_by(*icon, space_mouse_sensor)) return;
  auto drag = std::make_unique<Drag>(workbench_);
  if (!drag->hold.take(name)) return;
  drag->turns = icon->shape != model::IconShape::point || icon->role == model::IconRole::load ||
                icon->property != model::IconProperty::position;
  drag_ = std::move(drag);
}

void SpaceMouse::move(const SpaceMouseSample& sample, double seconds, FrameOutcome& outcome) {
  const SpaceMouseOptions& options = workbench_.options.space_mouse;
  const Vector3d way = options.speed_m_s * seconds * (last_.translation + sample.translation) / 2;
  const Vector3d turn = options.turn_rad_s * seconds * (last_.rotation + sample.rotation) / 2;
  const Vector3d translation = drag_->translation + way;
  Eigen::Quaterniond rotation = drag_->rotation;
  if (drag_->turns && turn.norm() > 0) {
    rotation =
        (Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * rotation).normalized();
  }
  if (translation == drag_->translation && rotation.coeffs() == drag_->rotation.coeffs()) return;
  v1::Operation operation;
  v1::DragIcon& drag = *operation.mutable_drag_icon();
  drag.set_entity(drag_->hold.name().entity);
  drag.set_icon(drag_->hold.name().icon);
  set_vec3(*drag.mutable_translation(), translation);
  if (drag_->turns) {
    drag.mutable_rotation()->set_w(rotation.w());
    drag.mutable_rotation()->set_x(rotation.x());
    drag.mutable_rotation()->set_y(rotation.y());
    drag.mutable_rotation()->set_z(rotation.z());
  }
  outcome.scene_changed = true;
  if (const Status status = drag_->air.amend(std::move(operation)); !status) {
    // It stops where it was accepted last; pushing on against the wall leaves nothing to push back.
    if (!std::exchange(drag_->refusing, true)) {
      outcome.problems.push_back("3D mouse refused: " + status.error().describe());
    }
    return;
  }
  drag_->refusing = false;
  drag_->translation = translation;
  drag_->rotation = rotation;
}

SpaceMouse::Counts SpaceMouse::end(FrameOutcome& outcome) {
  Counts counts;
  const std::unique_ptr<Drag> drag = std::move(drag_);
  outcome.scene_changed = true;  // Nobody holds the icon any more.
  if (!drag->air.operation().has_drag_icon()) return counts;
  auto submitted = drag->air.commit();
  if (!submitted) {
    outcome.problems.push_back("3D mouse refused: " + submitted.error().describe());
    counts.refused = 1;
  } else if (*submitted) {
    outcome.submitted.push_back(**std::move(submitted));
    counts.committed = 1;
  }
  return counts;
}

SpaceMouse::Counts SpaceMouse::on_frame(const SpaceMouseSample& sample, TimePoint now,
                                        FrameOutcome& outcome) {
  const SpaceMouseOptions& options = workbench_.options.space_mouse;
  Counts counts;
  const bool lost = drag_ && (workbench_.selected_icon() != drag_->hold.name() || !drag_->hold.renew());
  if (lost) counts = end(outcome);
  if (!sample.at_rest()) {
    moved_at_ = now;
    if (!drag_) begin();
  }
  if (drag_ && last_time_ && now - *last_time_ <= options.longest_step) {
    move(sample, std::chrono::duration<double>(now - *last_time_).count(), outcome);
  }
  if (drag_ && now - moved_at_ >= options.pause) {
    const Counts ended = end(outcome);
    counts.committed += ended.committed;
    counts.refused += ended.refused;
  }
  last_ = sample;
  last_time_ = now;
  return counts;
}

SpaceMouse::Counts SpaceMouse::finish(FrameOutcome& outcome) {
  last_ = {};
  last_time_.reset();
  return drag_ ? end(outcome) : Counts{};
}

}  // namespace handloft::interaction
