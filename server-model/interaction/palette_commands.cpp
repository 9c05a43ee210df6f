#include "server-model/interaction/palette_commands.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "server-model/interaction/gesture.h"

namespace handloft::interaction {
namespace {

std::string symmetry_words(StrokeSymmetry symmetry) {
  switch (symmetry) {
    case StrokeSymmetry::same_shape:
      return "symmetry: one shape";
    case StrokeSymmetry::partner:
      return "symmetry: partner shape";
    case StrokeSymmetry::off:
      break;
  }
  return "symmetry off";
}

}  // namespace

CommandAnswer PaletteCommands::run(PaletteCommand command, FrameOutcome& outcome) {
  v1::Operation operation;
  switch (command) {
    case PaletteCommand::fit:
      return fit(outcome);
    case PaletteCommand::representation:
      return toggle_representation(outcome);
    case PaletteCommand::both:
      return show("points and surface", v1::REPRESENTATION_BOTH, outcome);
    case PaletteCommand::new_shape:
      return new_shape(outcome);
    case PaletteCommand::symmetry:
      return step_symmetry();
    case PaletteCommand::undo:
      operation.mutable_undo();
      return submit("undo", operation, outcome);
    case PaletteCommand::redo:
      operation.mutable_redo();
      return submit("redo", operation, outcome);
    case PaletteCommand::select_next:
      return select_next(outcome);
    case PaletteCommand::select_nearest:
      return select_nearest(outcome);
    case PaletteCommand::move:
      return toggle_move();
    case PaletteCommand::duplicate:
      return duplicate(outcome);
    case PaletteCommand::erase:
      operation.mutable_delete_()->set_entity(workbench_.active_shape());
      return submit("delete", operation, outcome);
    case PaletteCommand::refit_plane:
      operation.mutable_refit_plane()->set_entity(workbench_.active_shape());
      return submit("refit plane", operation, outcome);
    case PaletteCommand::degree:
      return step_degree(outcome);
    case PaletteCommand::trim_mode:
      return step_trim_mode();
    case PaletteCommand::keep_curve:
      return toggle_keep_curve();
    case PaletteCommand::falloff:
      return toggle_falloff();
    case PaletteCommand::next_page:
      return next_page();
    case PaletteCommand::new_alternative:
      operation.mutable_new_alternative();
      return submit("new alternative", operation, outcome);
    case PaletteCommand::next_alternative:
      return next_alternative(outcome);
    case PaletteCommand::export_file:
      outcome.exports.emplace_back();
      return {"export", {}};
    case PaletteCommand::sculpt:
      return sculpt_.make_surface(outcome);
    case PaletteCommand::commit_sculpting:
      return sculpt_.commit(outcome);
    case PaletteCommand::recover_sculpting:
      return sculpt_.recover(outcome);
    case PaletteCommand::icon_pen:
      return sculpt_.step_pen();
    case PaletteCommand::icon_property:
      return sculpt_.step_property(outcome);
    case PaletteCommand::icon_role:
      return sculpt_.step_role(outcome);
    case PaletteCommand::icon_state:
      return sculpt_.step_state(outcome);
    case PaletteCommand::icon_stiffness:
      return sculpt_.step_stiffness(outcome);
    case PaletteCommand::delete_icon:
      return sculpt_.delete_icon(outcome);
    case PaletteCommand::exponent:
      break;  // ExponentGesture
  }
  return {};
}

CommandAnswer PaletteCommands::submit(std::string words, const v1::Operation& operation,
                                      FrameOutcome& outcome) {
  return submit_command(workbench_, std::move(words), operation, outcome);
}

CommandAnswer PaletteCommands::show(std::string words, v1::Representation representation,
                                    FrameOutcome& outcome) {
  v1::Operation operation;
  operation.mutable_set_representation()->set_entity(workbench_.active_shape());
  operation.mutable_set_representation()->set_representation(representation);
  return submit(std::move(words), operation, outcome);
}

void PaletteCommands::set_degree(v1::Fit& fit) const {
  if (!workbench_.modes.degree) return;
  fit.set_degree(*workbench_.modes.degree);
  fit.set_automatic_degree(*workbench_.modes.degree == 0);
}

// One step to undo. A linked partner is fitted and shown along with its shape by the operation itself (A12).
CommandAnswer PaletteCommands::fit(FrameOutcome& outcome) {
  v1::Operation operation;
  v1::Fit& fit = *operation.mutable_fit();
  fit.set_entity(workbench_.active_shape());
  fit.set_show(v1::REPRESENTATION_SURFACE);
  set_degree(fit);
  return submit("fit", operation, outcome);
}

CommandAnswer PaletteCommands::toggle_representation(FrameOutcome& outcome) {
  const model::DualPtr shape = workbench_.model.document().find_dual(workbench_.active_shape());
  const bool points_only = !shape || shape->representation == model::Representation::points;
  return show("points / surface", points_only ? v1::REPRESENTATION_SURFACE : v1::REPRESENTATION_POINTS,
              outcome);
}

CommandAnswer PaletteCommands::new_shape(FrameOutcome& outcome) {
  workbench_.selected.clear();
  workbench_.active.clear();
  workbench_.picked_icon = IconName();
  outcome.scene_changed = true;
  return {"new shape", {}};
}

CommandAnswer PaletteCommands::step_symmetry() {
  StrokeSymmetry& symmetry = workbench_.modes.symmetry;
  symmetry = symmetry == StrokeSymmetry::off          ? StrokeSymmetry::same_shape
             : symmetry == StrokeSymmetry::same_shape ? StrokeSymmetry::partner
                                                      : StrokeSymmetry::off;
  return {symmetry_words(symmetry), {}};
}

// 1 to the highest, then automatic, then 1 again. A fitted shape is fitted anew at once; otherwise it counts
// for the next fit.
CommandAnswer PaletteCommands::step_degree(FrameOutcome& outcome) {
  std::optional<std::uint32_t>& degree = workbench_.modes.degree;
  const model::Limits& limits = workbench_.model.limits();
  const std::string entity = workbench_.active_shape();
  const model::DualPtr shape = workbench_.model.document().find_dual(entity);
  const std::uint32_t as_new =
      workbench_.options.new_degree != 0 ? workbench_.options.new_degree : limits.default_degree;
  std::uint32_t next = 1;
  if (degree != 0U) {  // An automatic degree is followed by 1.
    next = 1 + (shape ? shape->requested_degree : degree.value_or(as_new));
    if (next > limits.max_degree) next = 0;
  }
  degree = next;
  std::string words = next == 0 ? "degree: automatic" : fmt::format("degree {}", next);
  if (!shape || !shape->fitted()) return {std::move(words), {}};
  v1::Operation operation;
  operation.mutable_fit()->set_entity(entity);
  set_degree(*operation.mutable_fit());
  return submit(std::move(words), operation, outcome);
}

CommandAnswer PaletteCommands::step_trim_mode() {
  TrimMode& trim = workbench_.modes.trim;
  trim = trim == TrimMode::profile ? TrimMode::boundary : TrimMode::profile;
  workbench_.modes.tool = HandTool::sculpt;  // Who asks for a pen wants to draw with it.
  return {trim == TrimMode::profile ? "pointing draws profiles" : "pointing draws boundaries", {}};
}

CommandAnswer PaletteCommands::toggle_keep_curve() {
  bool& keep = workbench_.modes.keep_curve;
  keep = !keep;
  return {keep ? "profiles leave points" : "profiles leave no points", {}};
}

// A push that is in the air goes on as it began.
CommandAnswer PaletteCommands::toggle_falloff() {
  v1::Falloff& falloff = workbench_.modes.falloff;
  falloff = falloff == v1::FALLOFF_LITERAL ? v1::FALLOFF_SMOOTH : v1::FALLOFF_LITERAL;
  return {falloff == v1::FALLOFF_SMOOTH ? "falloff: smooth" : "falloff: literal", {}};
}

CommandAnswer PaletteCommands::next_page() {
  int& page = workbench_.modes.palette_page;
  page = palette_page_after(page);
  return {fmt::format("palette page {} of {}", page, palette_pages), {}};
}

CommandAnswer PaletteCommands::toggle_move() {
  HandTool& tool = workbench_.modes.tool;
  tool = tool == HandTool::sculpt ? HandTool::move : HandTool::sculpt;
  return {tool == HandTool::move ? "move" : "sculpt", {}};
}

// From nothing to the first shape, through all of them by id, and to nothing again.
CommandAnswer PaletteCommands::select_next(FrameOutcome& outcome) {
  const model::Document& document = workbench_.model.document();
  const std::string present = workbench_.selected_shape();
  model::EntityPtr next;
  for (const auto& [id, entity] : document.entities) {
    if (!present.empty() && id <= present) continue;
    if (model::as_dual(entity) || model::as_sculpt(entity)) {
      next = entity;
      break;
    }
  }
  workbench_.picked_icon = IconName();  // What is done with icons is done with its own from now on.
  workbench_.selected = next ? next->id : std::string();
  outcome.scene_changed = true;
  return {next ? fmt::format("selected \"{}\"", next->name) : "nothing selected", {}};
}

CommandAnswer PaletteCommands::select_nearest(FrameOutcome& outcome) {
  workbench_.selected.clear();
  workbench_.picked_icon = IconName();
  outcome.scene_changed = true;
  return {"nearest", {}};
}

CommandAnswer PaletteCommands::duplicate(FrameOutcome& outcome) {
  v1::Operation operation;
  operation.mutable_duplicate()->set_entity(workbench_.active_shape());
  set_vec3(*operation.mutable_duplicate()->mutable_translation(), workbench_.options.duplicate_offset_m);
  CommandAnswer answer = submit("duplicate", operation, outcome);
  if (answer.refusal.empty()) {
    const std::string& copy = outcome.submitted.back().effective.duplicate().id();
    if (!workbench_.selected_shape().empty()) workbench_.selected = copy;
    workbench_.active = copy;
  }
  return answer;
}

CommandAnswer PaletteCommands::next_alternative(FrameOutcome& outcome) {
  v1::Query query;
  query.mutable_alternatives();
  const auto answer = workbench_.model.query(query);
  if (!answer) {
    outcome.problems.push_back("command refused: " + answer.error().describe());
    return {"next alternative", answer.error().message};
  }
  const v1::AlternativesResult& all = answer->alternatives();
  if (all.names_size() < 2) return {"next alternative", "there is no other one"};
  const auto present = std::find(all.names().begin(), all.names().end(), all.present());
  const auto after =
      present == all.names().end() || present + 1 == all.names().end() ? all.names().begin() : present + 1;
  v1::Operation operation;
  operation.mutable_switch_alternative()->set_name(*after);
  return submit(fmt::format("alternative \"{}\"", *after), operation, outcome);
}

}  // namespace handloft::interaction
