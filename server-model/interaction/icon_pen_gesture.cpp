#include "server-model/interaction/icon_pen_gesture.h"

#include <fmt/core.h>

#include <utility>

#include "server-model/interaction/pointing.h"

namespace handloft::interaction {
namespace {

/// Nearer than this to the last place nothing was drawn: a fingertip's noise at rest.
constexpr double least_step_m = 0.0005;

}  // namespace

Status IconPenGesture::press(const Eigen::Vector3d& tip) {
  const model::Document& document = workbench_.model.document();
  path_.clear();
  drawn_ = false;
  refused_.clear();
  if (corner_ && document.find(entity_)) return {};
  corner_.reset();
  pen_ = workbench_.modes.icon_pen;
  const std::string selected = workbench_.selected_shape();
  const auto near = workbench_.icons.nearest_surface(document, tip, selected);
  if (!near) {
    return make_error(ErrorCode::failed_precondition, "no surface that can be sculpted is within reach");
  }
  entity_ = near->entity;
  tapped_ = IconName();
  const auto icon = workbench_.icons.nearest(document, tip);
  if (icon && icon->name.entity == entity_ && icon->distance_m <= workbench_.options.icon_tap_m &&
      pen_ == IconPen::point_or_curve) {
    tapped_ = icon->name;
  }
  return {};
}

void IconPenGesture::add(v1::IconShape shape, const std::vector<Eigen::Vector3d>& places) {
  v1::Operation operation;
  v1::AddIcon& add = *operation.mutable_add_icon();
  add.set_entity(entity_);
  add.set_shape(shape);
  for (const Eigen::Vector3d& place : places) set_vec3(*add.add_places(), place);
  add.set_role(workbench_.modes.icon_role);
  if (shape == v1::ICON_POINT && add.role() == v1::ICON_CONSTRAINT) {
    add.set_property(workbench_.modes.icon_property);
  }
  add.add_sensors(std::string(hand_sensor));
  add.add_sensors(std::string(space_mouse_sensor));
  // What is refused so far may be accepted when more is drawn.
  const Status status = air_.set(std::move(operation));
  refused_ = status ? std::string() : status.error().message;
}

void IconPenGesture::draw(const Eigen::Vector3d& tip) {
  const bool moved = path_.empty() || (tip - path_.back()).norm() >= least_step_m;
  if (!moved) return;
  path_.push_back(tip);
  drawn_ = drawn_ || (tip - path_.front()).norm() > workbench_.options.icon_curve_m;
  if (pen_ == IconPen::region) {
    if (corner_) {
      add(v1::ICON_REGION, {*corner_, tip});
    } else if (drawn_) {
      add(v1::ICON_REGION, {path_.front(), tip});
    }
  } else if (drawn_) {
    add(v1::ICON_CURVE, smooth_and_thin(path_, workbench_.options.drawn_curve));
  } else if (tapped_.empty() && path_.size() == 1) {
    add(v1::ICON_POINT, {tip});
  }
}

void IconPenGesture::lift() {
  if (pen_ == IconPen::region && !corner_ && !drawn_) {
    corner_ = path_.front();
    return;
  }
  if (!drawn_ && !tapped_.empty()) workbench_.select_icon(tapped_);
  done_ = true;
}

Result<Preview> IconPenGesture::on_frame(const HandFrame& frame) {
  const auto tip = pen_tip(frame.sample);
  if (!frame.sample.pressing) {
    const bool was_down = std::exchange(pen_down_, false);
    if (was_down) lift();
    if (was_down) return Preview::changed;
    return tip ? Preview::same : Preview::unseen;
  }
  if (!tip) return Preview::unseen;
  if (!pen_down_) {
    if (auto status = press(*tip); !status) return status.error();
    pen_down_ = true;
  }
  draw(*tip);
  return Preview::changed;
}

Result<std::optional<model::Submitted>> IconPenGesture::commit() {
  if (!begun()) return std::optional<model::Submitted>();
  auto submitted = air_.commit();
  if (submitted && *submitted) {
    workbench_.select_icon({entity_, (*submitted)->effective.add_icon().id()});
  }
  return submitted;
}

HandActivity IconPenGesture::activity() const {
  if (!busy()) return {};
  if (!refused_.empty()) return {fmt::format("no icon yet: {}", refused_), entity_, {}, path_};
  if (pen_ == IconPen::region) {
    const bool one = corner_ && !pen_down_;
    return {one ? "a region: the other corner" : "picking a region", entity_, {}, {}};
  }
  if (drawn_) return {"drawing a curve icon", entity_, {}, path_};
  return {tapped_.empty() ? "adding a point icon" : fmt::format("selecting icon \"{}\"", tapped_.icon),
          entity_,
          {},
          {}};
}

}  // namespace handloft::interaction
