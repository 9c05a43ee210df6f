#include "client-hmd/hud/panel_contents.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "client-hmd/hud/hud.h"
#include "client-hmd/hud/shortcuts.h"
#include "client-hmd/hud/words.h"

namespace handloft::client {
namespace {

constexpr std::array<std::string_view, 7> section_order{"Shape",  "Edit",   "Select", "Curves",
                                                        "Design", "Sculpt", "Icons"};

constexpr std::size_t longest_problem = 60;  ///< Of the words of a state.

bool can_edit(const PanelFacts& facts) {
  return facts.model.connected && facts.desktop.available;
}

const Entity* selected_entity(const Scene& scene) {
  for (const auto& [id, entity] : scene.entities) {
    if (entity->selected) return entity.get();
  }
  return nullptr;
}

/// What a command would act on: the selected one, else whatever the hand finds.
const Entity* acted_on(const Scene& scene) {
  if (const Entity* selected = selected_entity(scene)) return selected;
  for (const auto& [id, entity] : scene.entities) {
    if (entity->target) return entity.get();
  }
  return nullptr;
}

bool any_of_kind(const Scene& scene, EntityKind kind) {
  return std::any_of(scene.entities.begin(), scene.entities.end(),
                     [kind](const auto& named) { return named.second->kind == kind; });
}

bool any_icon(const Scene& scene) {
  return std::any_of(scene.entities.begin(), scene.entities.end(), [](const auto& named) {
    return named.second->icons != nullptr && !named.second->icons->empty();
  });
}

std::string needs_surface(const Scene& scene) {
  const Entity* shape = acted_on(scene);
  if (scene.entities.empty()) return "There is no shape yet";
  if (shape != nullptr && shape->surface == nullptr) return "The shape is not fitted yet";
  return {};
}

void add_model_state(const PanelFacts& facts, std::vector<StateWords>& states) {
  if (facts.model.denied) {
    states.push_back(
        {"⚠", "Not let in: " + shortened(facts.model.denied->message, longest_problem), Tone::bad});
  } else if (facts.model.snapshots == 0) {
    states.push_back({"○", "Connecting", Tone::caution});
  } else if (!facts.model.connected) {
    states.push_back({"○", "Reconnecting", Tone::bad});
  } else {
    states.push_back({"●", facts.desktop.available ? "Live" : "Live, watching", Tone::good});
  }
}

/// "Saved" only what is on the server's disk (U5).
void add_saved_state(const PanelFacts& facts, std::vector<StateWords>& states) {
  if (!facts.model.connected || facts.model.snapshots == 0) return;
  const Storage& storage = facts.model.scene->storage;
  switch (saved_state(storage, facts.model.scene->sequence)) {
    case SavedState::saved:
      states.push_back({"●", "Saved", Tone::good});
      break;
    case SavedState::saving:
      states.push_back({"○", "Saving", Tone::plain});
      break;
    case SavedState::not_kept:
      states.push_back({"◇", "Not kept in a file", Tone::caution});
      break;
    case SavedState::failing:
      states.push_back({"⚠", "Not saved: " + shortened(storage.problem, longest_problem), Tone::bad});
      break;
    case SavedState::unknown:
      break;
  }
}

void add_tracking_state(const PanelFacts& facts, std::vector<StateWords>& states) {
  if (!facts.tracking_wanted) {
    states.push_back({"◇", "Mouse and keyboard", Tone::plain});
  } else if (facts.tracking.end_of_recording) {
    states.push_back({"◇", "Recording ended", Tone::plain});
  } else if (!facts.tracking.connected) {
    states.push_back({"◇", "No tracking", Tone::caution});
  } else {
    states.push_back({"◆", "Tracking", Tone::good});
  }
}

void add_figures(const PanelFacts& facts, std::vector<StateWords>& figures) {
  if (!facts.model.refusal.empty()) {
    figures.push_back({"⚠", "Refused: " + shortened(facts.model.refusal, longest_problem), Tone::bad});
  }
  if (facts.lag && *facts.lag > lag_threshold) {
    figures.push_back({"⚠", fmt::format("{:.1f} s behind", to_seconds(*facts.lag)), Tone::bad});
  }
  if (facts.latency_ms > 0.0) {
    figures.push_back({"", fmt::format("{:.0f} ms latency", facts.latency_ms), Tone::plain});
  }
  if (facts.frames_per_second >= 1.0) {
    figures.push_back({"", fmt::format("{:.0f} fps", facts.frames_per_second), Tone::plain});
  }
  if (facts.model.snapshots > 0) {
    figures.push_back({"", "Revision " + grouped(facts.model.scene->sequence), Tone::plain});
  }
}

std::vector<Person> people(const PanelFacts& facts) {
  std::vector<Person> others;
  std::uint64_t last = 0;
  for (const auto& [key, activity] : facts.model.activities) {
    if (activity.client_id == 0 || activity.client_id == facts.model.own_client_id) continue;
    if (!others.empty() && activity.client_id == last) {  // Another hand of the same person.
      if (others.back().doing.empty()) others.back().doing = activity.tool;
      continue;
    }
    last = activity.client_id;
    others.push_back({activity.name.empty() ? "Somebody" : activity.name,
                      user_colour(activity.client_id, facts.colours), activity.tool});
  }
  if (facts.model.people == nullptr) return others;
  // Those who only look have no hand; and the server knows what everybody may do.
  std::vector<Person> all;
  for (const PersonHere& here : *facts.model.people) {
    if (here.client_id == facts.model.own_client_id) continue;
    Person person{
        here.name.empty() ? here.user : here.name, user_colour(here.client_id, facts.colours), {}, here.role};
    for (const auto& [key, activity] : facts.model.activities) {
      if (key.client_id == here.client_id && person.doing.empty()) person.doing = activity.tool;
    }
    if (person.name.empty()) person.name = "Somebody";
    all.push_back(std::move(person));
  }
  return all;
}

std::vector<CommentRow> comment_rows(const PanelFacts& facts) {
  std::vector<CommentRow> open, resolved;
  const Scene& scene = *facts.model.scene;
  if (scene.comments == nullptr) return open;
  int number = 0;  // As of open_threads().
  for (const PinnedComment& comment : *scene.comments) {
    if (!comment.reply_to.empty()) continue;
    CommentRow row;
    row.id = comment.id;
    row.resolved = comment.resolved;
    row.number = comment.resolved ? 0 : ++number;
    row.text = comment.text;
    row.about = comment.author.empty() ? "Somebody" : comment.author;
    if (const auto shape = scene.entities.find(comment.entity); shape != scene.entities.end()) {
      row.about += " on " + shape->second->name;
    }
    row.colour = user_colour(comment.client_id, facts.colours);
    for (const PinnedComment& reply : *scene.comments) {
      if (reply.reply_to != comment.id) continue;
      row.replies.push_back((reply.author.empty() ? "Somebody" : reply.author) + ": " + reply.text);
    }
    (comment.resolved ? resolved : open).push_back(std::move(row));
  }
  open.insert(open.end(), std::make_move_iterator(resolved.begin()), std::make_move_iterator(resolved.end()));
  return open;
}

std::string_view kind_words(EntityKind kind) {
  switch (kind) {
    case EntityKind::dual_shape:
      return "Shape";
    case EntityKind::reference:
      return "Reference";
    case EntityKind::sculpt_surface:
      return "Sculpted surface";
    case EntityKind::cad_model:
      return "CAD model";
  }
  return "";
}

std::string_view kind_sign(EntityKind kind) {
  switch (kind) {
    case EntityKind::dual_shape:
      return "◠";
    case EntityKind::reference:
      return "◇";
    case EntityKind::sculpt_surface:
      return "▦";
    case EntityKind::cad_model:
      return "◈";
  }
  return "";
}

std::string details_of(const Entity& entity) {
  std::vector<std::string> parts;
  if (entity.points != nullptr) parts.push_back(plural(entity.points->points.size(), "point"));
  if (entity.kind == EntityKind::reference && entity.surface != nullptr) {
    parts.push_back(plural(entity.surface->indices.size() / 3, "triangle"));
  }
  if (entity.kind == EntityKind::sculpt_surface && entity.icons != nullptr) {
    parts.push_back(plural(entity.icons->size(), "icon"));
  }
  if (entity.kind == EntityKind::dual_shape) {
    if (entity.surface == nullptr) {
      parts.emplace_back("not fitted");
    } else if (std::isfinite(entity.residual_rms_m)) {
      parts.push_back(fmt::format("RMS {:.2f} mm", 1e3 * entity.residual_rms_m));
    }
  }
  std::string joined;
  for (const std::string& part : parts) joined += (joined.empty() ? "" : " · ") + part;
  return joined;
}

std::string who_changes(const Entity& entity, const ModelState& model) {
  if (!entity.provisional) {
    if (entity.leased_by == 0) return {};
    if (entity.leased_by == model.own_client_id) return "you";
    return entity.leased_by_name.empty() ? "somebody" : entity.leased_by_name;
  }
  if (entity.provisional_by == 0 || entity.provisional_by == model.own_client_id) return "you";
  for (const auto& [key, activity] : model.activities) {
    if (activity.client_id == entity.provisional_by && !activity.name.empty()) return activity.name;
  }
  return "somebody";
}

std::vector<ShapeRow> shape_rows(const ModelState& model) {
  std::vector<ShapeRow> rows;
  rows.reserve(model.scene->entities.size());
  for (const auto& [id, entity] : model.scene->entities) {
    ShapeRow row;
    row.id = id;
    row.name = entity->name.empty() ? id : entity->name;
    row.sign = kind_sign(entity->kind);
    row.kind = kind_words(entity->kind);
    row.details = details_of(*entity);
    row.by = who_changes(*entity, model);
    row.representation = entity->representation;
    row.representable = entity->kind == EntityKind::dual_shape && entity->surface != nullptr;
    row.selectable = entity->kind == EntityKind::dual_shape || entity->kind == EntityKind::sculpt_surface;
    row.selected = entity->selected;
    row.target = entity->target;
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<CommandSection> sections(const PanelFacts& facts) {
  std::vector<CommandSection> all;
  all.reserve(section_order.size());
  for (const std::string_view title : section_order) all.push_back({title, {}});
  for (const PaletteCell& cell : table_palette) {
    const std::string_view title = section_of(cell.command);
    const auto section = std::find_if(all.begin(), all.end(),
                                      [title](const CommandSection& one) { return one.title == title; });
    if (section == all.end()) continue;
    section->buttons.push_back(
        {cell.command, cell.label, cell.sign, shortcut_of(cell.command), why_not(cell.command, facts)});
  }
  return all;
}

Gauge gauge(std::string_view label, double value, bool active) {
  const double share = std::isfinite(value) ? std::clamp(value, 0.0, 1.0) : 0.0;
  return {label, share, fmt::format("{:.0f} %", 100.0 * share), active};
}

void add_hand(const PanelFacts& facts, PanelContents& contents) {
  if (facts.tracking.hand) {
    contents.gesture = gesture_words(facts.tracking.hand->gesture);
    contents.pressure = gauge("Pressure", facts.tracking.hand->pressure, facts.tracking.hand->pressing);
  }
  for (const auto& [key, activity] : facts.model.activities) {
    const bool own = activity.client_id == 0 || activity.client_id == facts.model.own_client_id;
    if (!own) continue;
    contents.symmetry = contents.symmetry || activity.symmetry;
    if (contents.drawing.empty()) contents.drawing = activity.mode;
    if (activity.disk && !contents.range) contents.range = gauge("Range", activity.range, true);
  }
  if (!facts.desktop.available) return;
  contents.tool_words = facts.desktop.tool_words;
  contents.hint = facts.desktop.hint;
  if (!facts.tracking.hand) {
    contents.pressure = gauge(facts.desktop.pressure_from_pen ? "Pressure (pen)" : "Pressure",
                              facts.desktop.pressure, facts.desktop.working);
  }
  if (!contents.range) contents.range = gauge("Range", facts.desktop.range, facts.desktop.working);
}

}  // namespace

std::string why_not(PaletteCommand command, const PanelFacts& facts) {
  const Scene& scene = *facts.model.scene;
  if (facts.model.snapshots == 0 || !facts.model.connected) return "The model server is not there";
  if (!can_edit(facts)) return "You are watching: start with a hand of your own to change things";
  switch (command) {
    case PaletteCommand::undo:
      return scene.history.undo_steps == 0 ? "There is nothing to undo" : scene.history.undo_refused;
    case PaletteCommand::redo:
      return scene.history.redo_steps == 0 ? "There is nothing to redo" : scene.history.redo_refused;
    case PaletteCommand::fit:
    case PaletteCommand::refit_plane:
    case PaletteCommand::duplicate:
    case PaletteCommand::erase:
    case PaletteCommand::select_next:
      return scene.entities.empty() ? "There is no shape yet" : "";
    case PaletteCommand::representation:
    case PaletteCommand::both:
    case PaletteCommand::exponent:
      return needs_surface(scene);
    case PaletteCommand::export_file:
      return scene.entities.empty() ? "There is nothing to export yet" : "";
    case PaletteCommand::next_alternative:
      return scene.alternatives.names.size() < 2 ? "There is only one alternative" : "";
    case PaletteCommand::commit_sculpting:
    case PaletteCommand::recover_sculpting:
    case PaletteCommand::icon_pen:
      return any_of_kind(scene, EntityKind::sculpt_surface) ? ""
                                                            : "There is no sculpted surface: press Sculpt";
    case PaletteCommand::icon_property:
    case PaletteCommand::icon_role:
    case PaletteCommand::icon_state:
    case PaletteCommand::icon_stiffness:
    case PaletteCommand::delete_icon:
      return any_icon(scene) ? "" : "There is no icon yet";
    case PaletteCommand::new_shape:
    case PaletteCommand::symmetry:
    case PaletteCommand::select_nearest:
    case PaletteCommand::move:
    case PaletteCommand::degree:
    case PaletteCommand::trim_mode:
    case PaletteCommand::keep_curve:
    case PaletteCommand::new_alternative:
    case PaletteCommand::next_page:
    case PaletteCommand::falloff:
    case PaletteCommand::sculpt:
      return {};
  }
  return {};
}

PanelContents panel_contents(const PanelFacts& facts, const HistoryTrail& trail) {
  PanelContents contents;
  contents.has_scene = facts.model.snapshots > 0;
  contents.can_edit = can_edit(facts);
  contents.can_comment = facts.model.role == v1::ROLE_UNSPECIFIED
                             ? contents.can_edit
                             : facts.model.connected && facts.model.role != v1::ROLE_VIEWER;
  add_model_state(facts, contents.states);
  add_saved_state(facts, contents.states);
  add_tracking_state(facts, contents.states);
  add_figures(facts, contents.figures);
  contents.people = people(facts);
  add_hand(facts, contents);
  contents.sections = sections(facts);
  contents.shapes = shape_rows(facts.model);
  contents.alternatives = facts.model.scene->alternatives;
  contents.history = trail.rows();
  contents.comments = comment_rows(facts);
  contents.is_owner = facts.model.connected && facts.model.role == v1::ROLE_OWNER;
  contents.difference = facts.model.difference;
  if (facts.model.scene->versions != nullptr) contents.versions = *facts.model.scene->versions;
  return contents;
}

}  // namespace handloft::client
