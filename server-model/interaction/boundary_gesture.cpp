#include "server-model/interaction/boundary_gesture.h"

#include <fmt/core.h>

#include <utility>

#include "server-model/interaction/pointing.h"

namespace handloft::interaction {

Status BoundaryGesture::address(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const model::Document& document = workbench_.model.document();
  if (!met_) {
    std::string entity = workbench_.selected_shape();
    if (entity.empty()) {
      if (auto near = workbench_.targets.nearest(document, from, to)) entity = std::move(near->entity);
    }
    met_ = !entity.empty();
    entity_ = met_ ? std::move(entity) : workbench_.active_shape();
  }
  if (entity_.empty()) {
    return make_error(ErrorCode::failed_precondition, "no surface is within reach, and no shape is selected");
  }
  const model::DualPtr shape = document.find_dual(entity_);
  if (!shape || !shape->fitted()) {
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("\"{}\" has no surface yet that could be trimmed", entity_));
  }
  return {};
}

Result<Preview> BoundaryGesture::on_frame(const HandFrame& frame) {
  const auto tip = pen_tip(frame.sample);
  if (!frame.sample.pressing) {
    pen_down_ = false;
    last_tip_.reset();
    return tip ? Preview::same : Preview::unseen;
  }
  if (!tip) return Preview::unseen;
  if (!std::exchange(pen_down_, true)) {
    curve_.clear();
    length_m_ = 0;
  }
  if (auto status = address(last_tip_.value_or(*tip), *tip); !status) return status.error();
  last_tip_ = tip;
  if (!curve_.empty()) length_m_ += (*tip - curve_.back()).norm();
  curve_.push_back(*tip);
  if (length_m_ < workbench_.options.min_curve_m) return Preview::changed;
  v1::Operation operation;
  operation.mutable_set_boundary()->set_entity(entity_);
  for (const Eigen::Vector3d& point : curve_) set_vec3(*operation.mutable_set_boundary()->add_curve(), point);
  (void)air_.set(std::move(operation));  // An open curve is refused; the next points may close it.
  return Preview::changed;
}

Result<std::optional<model::Submitted>> BoundaryGesture::commit() {
  if (!begun()) return std::optional<model::Submitted>();
  auto submitted = air_.commit();
  if (submitted && *submitted) workbench_.active = entity_;
  return submitted;
}

HandActivity BoundaryGesture::activity() const {
  if (curve_.empty()) return {};
  return {air_.live() ? "drawing a boundary" : "drawing a boundary: open", entity_, {}, curve_};
}

}  // namespace handloft::interaction
