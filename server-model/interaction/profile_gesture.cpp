#include "server-model/interaction/profile_gesture.h"

#include <fmt/core.h>

#include <utility>

#include "server-model/interaction/pointing.h"

namespace handloft::interaction {
namespace {

bool fitted(const model::Document& document, const std::string& id) {
  const model::DualPtr shape = document.find_dual(id);
  return shape && shape->fitted();
}

}  // namespace

void ProfileGesture::meet_shapes(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const model::Document& document = workbench_.model.document();
  for (Near& near : workbench_.targets.all_within_reach(document, from, to)) {
    if (fitted(document, near.entity)) met_.insert(std::move(near.entity));
  }
}

Status ProfileGesture::address() {
  const model::Document& document = workbench_.model.document();
  const std::string selected = workbench_.selected_shape();
  std::erase_if(met_, [&](const std::string& id) { return !fitted(document, id); });
  entity_ = !selected.empty() ? selected : met_.empty() ? workbench_.active_shape() : *met_.begin();
  if (entity_.empty()) {
    return make_error(ErrorCode::failed_precondition, "no surface is within reach, and no shape is selected");
  }
  if (!fitted(document, entity_)) {
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("\"{}\" has no surface yet whose profile could be drawn", entity_));
  }
  divided_ = selected.empty() && met_.size() > 1;
  return {};
}

v1::Operation ProfileGesture::operation() const {
  v1::Operation operation;
  v1::ModifyProfile& profile = *operation.mutable_modify_profile();
  for (const Stroke& stroke : strokes_) {
    if (stroke.length_m < workbench_.options.min_curve_m) continue;
    v1::ProfileCurve& curve = *profile.add_curves();
    curve = stroke.curve;
    if (!divided_) curve.set_entity(entity_);
  }
  if (divided_) {
    for (const std::string& id : met_) profile.add_entities(id);
  }
  profile.set_keep_as_points(workbench_.modes.keep_curve);
  return operation;
}

Result<Preview> ProfileGesture::on_frame(const HandFrame& frame) {
  const auto tip = pen_tip(frame.sample);
  if (!frame.sample.pressing) {
    const bool was_down = std::exchange(pen_down_, false);
    last_tip_.reset();
    if (!tip) return Preview::unseen;
    return was_down ? Preview::changed : Preview::same;
  }
  if (!tip) return Preview::unseen;
  if (!std::exchange(pen_down_, true)) strokes_.emplace_back();
  Stroke& stroke = strokes_.back();
  v1::Point& point = *stroke.curve.add_points();
  set_vec3(*point.mutable_position(), *tip);
  point.set_pressure(frame.sample.pressure);
  point.set_time_ns(to_ns(frame.sample.capture_time));
  if (!stroke.points.empty()) stroke.length_m += (*tip - stroke.points.back()).norm();
  stroke.points.push_back(*tip);
  meet_shapes(last_tip_.value_or(*tip), *tip);
  last_tip_ = tip;
  if (auto status = address(); !status) return status.error();
  v1::Operation drawn = operation();
  // What the model refuses so far is nothing to tell of: the next points may make it good.
  if (!drawn.modify_profile().curves().empty()) (void)air_.set(std::move(drawn));
  return Preview::changed;
}

Result<std::optional<model::Submitted>> ProfileGesture::commit() {
  if (!begun()) return std::optional<model::Submitted>();
  auto submitted = air_.commit();
  if (submitted && *submitted) workbench_.active = entity_;
  return submitted;
}

HandActivity ProfileGesture::activity() const {
  if (strokes_.empty()) return {};
  return {"drawing a profile", entity_, {}, strokes_.back().points};
}

}  // namespace handloft::interaction
