#include "server-model/interaction/stroke_gesture.h"

#include <fmt/core.h>

#include <span>
#include <utility>

namespace handloft::interaction {
namespace {

model::SymmetryMode shape_mode(StrokeSymmetry symmetry) {
  switch (symmetry) {
    case StrokeSymmetry::same_shape:
      return model::SymmetryMode::same_shape;
    case StrokeSymmetry::partner:
      return model::SymmetryMode::partner;
    case StrokeSymmetry::off:
      break;
  }
  return model::SymmetryMode::off;
}

v1::SetSymmetry symmetry_message(StrokeSymmetry symmetry, const model::MirrorPlane& plane) {
  v1::SetSymmetry message;
  switch (symmetry) {
    case StrokeSymmetry::off:
      message.set_mode(v1::SetSymmetry::OFF);
      return message;
    case StrokeSymmetry::same_shape:
      message.set_mode(v1::SetSymmetry::SAME_SHAPE);
      break;
    case StrokeSymmetry::partner:
      message.set_mode(v1::SetSymmetry::PARTNER);
      break;
  }
  set_vec3(*message.mutable_plane()->mutable_origin(), plane.origin);
  set_vec3(*message.mutable_plane()->mutable_normal(), plane.normal);
  return message;
}

}  // namespace

Result<Preview> StrokeGesture::on_frame(const HandFrame& frame) {
  if (!frame.centre) return Preview::unseen;
  v1::Point point;
  set_vec3(*point.mutable_position(), *frame.centre);
  point.set_pressure(frame.sample.pressure);
  point.set_time_ns(to_ns(frame.sample.capture_time));

  Status status;
  if (!begun_) {
    v1::Operation operation = new_stroke();
    choose_id(*operation.mutable_add_points());
    *operation.mutable_add_points()->add_points() = point;
    status = air_.set(std::move(operation));
    begun_ = status.ok();
  } else if (air_.live()) {
    status = air_.append_points(std::span(&point, 1));
  } else {
    // Somebody else changed the base so that the stroke could not go on as it was: once more with all of its
    // points.
    v1::Operation operation = air_.operation();
    *operation.mutable_add_points()->add_points() = point;
    choose_id(*operation.mutable_add_points());
    status = air_.set(std::move(operation));
  }
  if (!status) return status.error();
  return Preview::changed;
}

Result<std::optional<model::Submitted>> StrokeGesture::commit() {
  if (!begun()) return std::optional<model::Submitted>();
  if (!air_.live()) {
    v1::Operation operation = air_.operation();
    choose_id(*operation.mutable_add_points());
    if (auto status = air_.set(std::move(operation)); !status) return status.error();
  }
  auto submitted = air_.commit();
  if (submitted && *submitted) workbench_.active = entity_;
  return submitted;
}

void StrokeGesture::cancel() {
  air_.cancel();
  release_id();
}

v1::Operation StrokeGesture::new_stroke() const {
  const InteractionOptions& options = workbench_.options;
  const StrokeSymmetry symmetry = workbench_.modes.symmetry;
  v1::Operation operation;
  v1::AddPoints& add = *operation.mutable_add_points();
  add.set_min_spacing_m(options.min_spacing_m);
  add.set_entity(workbench_.active_shape());
  const model::DualPtr shape = workbench_.model.document().find_dual(add.entity());
  if (!shape) {  // None is active, or a surface that has no points.
    add.mutable_create()->set_degree(workbench_.modes.degree.value_or(options.new_degree));
    if (symmetry != StrokeSymmetry::off)
      *add.mutable_symmetry() = symmetry_message(symmetry, options.symmetry_plane);
    return operation;
  }
  add.set_refit(workbench_.fits_live(add.entity()));
  const bool same_plane = shape->plane.origin == options.symmetry_plane.origin &&
                          shape->plane.normal == options.symmetry_plane.normal;
  if (shape->symmetry != shape_mode(symmetry) || (symmetry != StrokeSymmetry::off && !same_plane)) {
    *add.mutable_symmetry() = symmetry_message(symmetry, options.symmetry_plane);
  }
  return operation;
}

void StrokeGesture::choose_id(v1::AddPoints& add) {
  if (add.has_create()) {
    release_id();
    promised_ = next_shape_id();
    workbench_.claims->shape_ids.insert(promised_);
    add.set_entity(promised_);
  }
  entity_ = add.entity();
}

std::string StrokeGesture::next_shape_id() const {
  // Also not one that another hand's stroke in the air is about to make.
  const model::Document& document = workbench_.model.document();
  std::uint64_t number = document.next_shape;
  std::string id;
  do {
    id = fmt::format("shape-{}", number++);
  } while (document.used_ids->contains(id) ||
           workbench_.claims->shape_ids.contains(id));  // both are bounded: it ends
  return id;
}

void StrokeGesture::release_id() {
  if (promised_.empty()) return;
  workbench_.claims->shape_ids.extract(promised_);
  promised_.clear();
}

}  // namespace handloft::interaction
