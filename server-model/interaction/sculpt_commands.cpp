#include "server-model/interaction/sculpt_commands.h"

#include <fmt/core.h>

#include <cmath>
#include <utility>

#include "server-model/interaction/gesture.h"
#include "server-model/model/sculpt_solve.h"

namespace handloft::interaction {
namespace {

constexpr std::string_view no_icon = "no icon is selected";

v1::IconProperty next(v1::IconProperty property) {
  return property >= v1::ICON_NORMAL ? v1::ICON_POSITION : static_cast<v1::IconProperty>(property + 1);
}

v1::IconState next(v1::IconState state) {
  return state >= v1::ICON_SLEEPING ? v1::ICON_DRIVING : static_cast<v1::IconState>(state + 1);
}

v1::IconRole other(v1::IconRole role) {
  return role == v1::ICON_LOAD ? v1::ICON_CONSTRAINT : v1::ICON_LOAD;
}

std::string role_words(v1::IconRole role) {
  return role == v1::ICON_LOAD ? "load" : "constraint";
}

/// The stiffness with which a load moves its place as far as the hand (D16): tried out beside the document,
/// since the surface yields in proportion. The place's own step is measured along its normal. nullopt: the
/// surface cannot yield there.
std::optional<double> following_stiffness(const model::Document& document, const model::Limits& limits,
                                          const IconName& name) {
  constexpr double tried_n_per_m = 1.0;
  constexpr double tried_m = 1e-3;
  const model::ApplyContext context{limits, {}, geometry::run_in_turn, {}};
  v1::Operation soften;
  soften.mutable_change_icon()->set_entity(name.entity);
  soften.mutable_change_icon()->set_icon(name.icon);
  soften.mutable_change_icon()->set_stiffness(tried_n_per_m);
  const auto before = model::apply(document, soften, context);
  if (!before) return std::nullopt;
  const model::SculptPtr shape = model::as_sculpt(before->document.find(name.entity));
  const model::SculptIcon* icon = shape ? shape->find_icon(name.icon) : nullptr;
  if (icon == nullptr) return std::nullopt;
  const Eigen::Vector2d at = (icon->parameters.front() + icon->parameters.back()) / 2;
  const Eigen::Vector3d normal = shape->surface->normal(at.x(), at.y());
  v1::Operation pull;
  pull.mutable_drag_icon()->set_entity(name.entity);
  pull.mutable_drag_icon()->set_icon(name.icon);
  set_vec3(*pull.mutable_drag_icon()->mutable_translation(), tried_m * normal);
  const auto after = model::apply(before->document, pull, context);
  if (!after) return std::nullopt;
  const model::SculptPtr pulled = model::as_sculpt(after->document.find(name.entity));
  const double moved =
      (pulled->surface->evaluate(at.x(), at.y()) - shape->surface->evaluate(at.x(), at.y())).dot(normal);
  const double stiffness = tried_n_per_m * tried_m / moved;
  if (!(moved > 0) || !std::isfinite(stiffness)) return std::nullopt;
  return stiffness;
}

}  // namespace

std::string_view property_words(v1::IconProperty property) {
  switch (property) {
    case v1::ICON_TANGENT_U:
      return "R";
    case v1::ICON_TANGENT_V:
      return "V";
    case v1::ICON_SECOND_U:
      return "R2";
    case v1::ICON_SECOND_V:
      return "V2";
    case v1::ICON_TWIST:
      return "RV";
    case v1::ICON_NORMAL:
      return "normal";
    default:
      return "position";
  }
}

std::string sculpting_words(const Workbench& workbench) {
  if (!workbench.sculpted()) return {};
  const Modes& modes = workbench.modes;
  const IconName name = workbench.selected_icon();
  const model::SculptIcon* icon = find_icon(workbench.model.document(), name);
  if (icon == nullptr) {
    const bool region = modes.icon_pen == IconPen::region;
    std::string words = region ? "new icons: regions, " : "new icons: points and curves, ";
    if (modes.icon_role == v1::ICON_LOAD) return words + "loads";
    if (!region) words += fmt::format("{} ", property_words(modes.icon_property));
    return words + "constraints";
  }
  std::string words =
      fmt::format("icon \"{}\": {} {}, ", name.icon, to_string(icon->state), to_string(icon->shape));
  if (icon->role == model::IconRole::load) {
    words += "load";
    if (icon->stiffness > 0) words += fmt::format(" of {:.3g} N/m", icon->stiffness);
    return words;
  }
  if (icon->shape == model::IconShape::point) {
    words += fmt::format("{} ", property_words(model::to_proto(icon->property)));
  }
  return words + "constraint";
}

CommandAnswer SculptCommands::make_surface(FrameOutcome& outcome) {
  const InteractionOptions& options = workbench_.options;
  const std::string active = workbench_.active_shape();
  v1::Operation operation;
  v1::CreateSculptSurface& create = *operation.mutable_create_sculpt_surface();
  create.set_control_u(options.sculpt_control);
  create.set_control_v(options.sculpt_control);
  if (active.empty()) {
    set_vec3(*create.mutable_rectangle()->mutable_pose()->mutable_position(), options.sheet.centre_m);
    create.mutable_rectangle()->set_width_m(options.sheet.width_m);
    create.mutable_rectangle()->set_depth_m(options.sheet.depth_m);
  } else if (const model::DualPtr shape = workbench_.model.document().find_dual(active)) {
    if (shape->fitted()) {
      create.set_fitted(active);
    } else {
      create.set_points(active);
    }
  } else {
    return {"sculpt", fmt::format("\"{}\" is no shape of points; \"New shape\" gives a flat sheet", active)};
  }
  CommandAnswer answer = submit_command(workbench_, "surface to sculpt", operation, outcome);
  if (!answer.refusal.empty()) return answer;
  const std::string& id = outcome.submitted.back().effective.create_sculpt_surface().id();
  if (!workbench_.selected_shape().empty()) workbench_.selected = id;
  workbench_.active = id;
  workbench_.picked_icon = IconName();
  return answer;
}

CommandAnswer SculptCommands::commit(FrameOutcome& outcome) {
  const model::SculptPtr shape = workbench_.sculpted();
  if (!shape) return {"commit", "no sculpted surface is active"};
  v1::Operation operation;
  operation.mutable_commit_sculpting()->set_entity(shape->id);
  return submit_command(workbench_, "committed", operation, outcome);
}

CommandAnswer SculptCommands::recover(FrameOutcome& outcome) {
  const model::SculptPtr shape = workbench_.sculpted();
  if (!shape) return {"recover", "no sculpted surface is active"};
  v1::Operation operation;
  operation.mutable_recover_sculpting()->set_entity(shape->id);
  return submit_command(workbench_, "recovered", operation, outcome);
}

CommandAnswer SculptCommands::step_pen() {
  IconPen& pen = workbench_.modes.icon_pen;
  pen = pen == IconPen::region ? IconPen::point_or_curve : IconPen::region;
  workbench_.modes.tool = HandTool::sculpt;  // Who asks for a pen wants to draw with it.
  return {pen == IconPen::region ? "icons: regions" : "icons: points and curves", {}};
}

CommandAnswer SculptCommands::change(std::string words, const v1::ChangeIcon& change, FrameOutcome& outcome) {
  const IconName name = workbench_.selected_icon();
  v1::Operation operation;
  *operation.mutable_change_icon() = change;
  operation.mutable_change_icon()->set_entity(name.entity);
  operation.mutable_change_icon()->set_icon(name.icon);
  return submit_command(workbench_, fmt::format("icon \"{}\": {}", name.icon, words), operation, outcome);
}

CommandAnswer SculptCommands::step_property(FrameOutcome& outcome) {
  const model::SculptIcon* icon = find_icon(workbench_.model.document(), workbench_.selected_icon());
  if (icon == nullptr) {
    v1::IconProperty& property = workbench_.modes.icon_property;
    property = next(property);
    return {fmt::format("new icons: {}", property_words(property)), {}};
  }
  v1::ChangeIcon message;
  message.set_property(next(model::to_proto(icon->property)));
  return change(std::string(property_words(message.property())), message, outcome);
}

CommandAnswer SculptCommands::step_role(FrameOutcome& outcome) {
  const model::SculptIcon* icon = find_icon(workbench_.model.document(), workbench_.selected_icon());
  if (icon == nullptr) {
    v1::IconRole& role = workbench_.modes.icon_role;
    role = other(role);
    return {fmt::format("new icons: {}s", role_words(role)), {}};
  }
  v1::ChangeIcon message;
  message.set_role(other(model::to_proto(icon->role)));
  return change(role_words(message.role()), message, outcome);
}

CommandAnswer SculptCommands::step_state(FrameOutcome& outcome) {
  const model::SculptIcon* icon = find_icon(workbench_.model.document(), workbench_.selected_icon());
  if (icon == nullptr) return {"state", std::string(no_icon)};
  v1::ChangeIcon message;
  message.set_state(next(model::to_proto(icon->state)));
  const std::string_view words = message.state() == v1::ICON_DRIVING   ? "driving"
                                 : message.state() == v1::ICON_PASSIVE ? "passive"
                                                                       : "sleeping";
  return change(std::string(words), message, outcome);
}

CommandAnswer SculptCommands::step_stiffness(FrameOutcome& outcome) {
  const IconName name = workbench_.selected_icon();
  const model::SculptIcon* icon = find_icon(workbench_.model.document(), name);
  if (icon == nullptr) return {"stiffness", std::string(no_icon)};
  if (icon->role != model::IconRole::load || icon->state != model::IconState::driving) {
    return {"stiffness", fmt::format("icon \"{}\" is no driving load", name.icon)};
  }
  const auto own = following_stiffness(workbench_.model.document(), workbench_.model.limits(), name);
  if (!own) return {"stiffness", fmt::format("the surface cannot yield at icon \"{}\"", name.icon)};
  const InteractionOptions& options = workbench_.options;
  // Which of the steps it is at is told by its value: between soft and stiff the mean divides.
  const bool soft = icon->stiffness > 0 && icon->stiffness < *own * std::sqrt(options.soft * options.stiff);
  v1::ChangeIcon message;
  message.set_stiffness(!(icon->stiffness > 0) ? options.soft * *own : soft ? options.stiff * *own : 0.0);
  std::string words = "follows the hand";
  if (message.stiffness() > 0) {
    words = fmt::format("{}, {:.3g} N/m", soft ? "stiff" : "soft", message.stiffness());
  }
  return change(std::move(words), message, outcome);
}

CommandAnswer SculptCommands::delete_icon(FrameOutcome& outcome) {
  const IconName name = workbench_.selected_icon();
  if (name.empty()) return {"delete icon", std::string(no_icon)};
  v1::Operation operation;
  operation.mutable_delete_icon()->set_entity(name.entity);
  operation.mutable_delete_icon()->set_icon(name.icon);
  return submit_command(workbench_, fmt::format("deleted icon \"{}\"", name.icon), operation, outcome);
}

}  // namespace handloft::interaction
