#include "server-model/interaction/profile_gesture.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "server-model/interaction/pointing.h"

namespace handloft::interaction {
namespace {

/// What a place counts where the finger rests: enough to tell who is near, nothing beside a way.
constexpr double resting_m = 1e-6;

bool fitted(const model::Document& document, const std::string& id) {
  const model::DualPtr shape = document.find_dual(id);
  return shape && shape->fitted();
}

}  // namespace

void ProfileGesture::meet_shapes(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const model::Document& document = workbench_.model.document();
  Part& part = strokes_.back().parts.back();
  const double way_m = (to - from).norm() + resting_m;
  for (Near& near : workbench_.targets.all_within_reach(document, from, to)) {
    if (!fitted(document, near.entity)) continue;
    part.nearness[near.entity] += std::max(0.0, workbench_.options.reach_m - near.distance_m) * way_m;
    met_.insert(std::move(near.entity));
  }
}

void ProfileGesture::divide_here() {
  Stroke& stroke = strokes_.back();
  const bool moved_on = stroke.length_m - stroke.parts.back().begin_m >= workbench_.options.min_curve_m;
  if (moved_on) {
    stroke.parts.push_back({stroke.length_m, 0, {}});
  } else if (stroke.parts.size() > 1) {
    ++stroke.parts.back().passed_on;
  }
}

std::vector<std::string> ProfileGesture::owners(const Stroke& stroke) const {
  const model::Document& document = workbench_.model.document();
  std::vector<std::string> owners;
  for (const Part& part : stroke.parts) {
    const bool first = owners.empty();
    std::vector<std::pair<double, std::string>> ranked;  // Nearest first; of equals the smaller id.
    for (const auto& [id, nearness] : part.nearness) {
      if ((first || id != owners.back()) && fitted(document, id)) ranked.emplace_back(-nearness, id);
    }
    std::sort(ranked.begin(), ranked.end());
    if (first) {
      const std::string selected = workbench_.selected_shape();
      owners.push_back(!selected.empty() ? selected : ranked.empty() ? entity_ : ranked.front().second);
      continue;
    }
    const auto choice = static_cast<std::size_t>(part.passed_on) % (ranked.size() + 1);
    owners.push_back(choice < ranked.size() ? ranked[choice].second : std::string());
  }
  return owners;
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
    if (stroke.parts.size() > 1) {
      for (std::size_t k = 1; k < stroke.parts.size(); ++k) {
        curve.add_split_at(std::min(1.0, stroke.parts[k].begin_m / stroke.length_m));
      }
      for (std::string& owner : owners(stroke)) curve.add_split_entities(std::move(owner));
    } else if (!divided_) {
      curve.set_entity(entity_);
    }
  }
  if (divided_) {
    for (const std::string& id : met_) profile.add_entities(id);
  }
  profile.set_keep_as_points(workbench_.modes.keep_curve);
  return operation;
}

Result<Preview> ProfileGesture::on_frame(const HandFrame& frame) {
  const auto tip = pen_tip(frame.sample);
  const bool tapped = !std::exchange(thumb_laid_, frame.sample.thumb_laid) && frame.sample.thumb_laid;
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
  if (tapped) divide_here();
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
  const Stroke& stroke = strokes_.back();
  if (stroke.parts.size() < 2) return {"drawing a profile", entity_, {}, stroke.points};
  std::string owner = owners(stroke).back();
  std::string words = fmt::format("drawing a profile, part {}", stroke.parts.size());
  if (owner.empty()) words += " of nothing";
  return {std::move(words), std::move(owner), {}, stroke.points};
}

}  // namespace handloft::interaction
