#include "server-model/stream/scene_builder.h"

namespace handloft::stream {

v1::HistoryState history_state(const model::History& history) {
  v1::HistoryState state;
  state.set_undo_steps(static_cast<std::uint32_t>(history.undo_steps()));
  state.set_redo_steps(static_cast<std::uint32_t>(history.redo_steps()));
  state.set_next_undo(history.next_undo());
  state.set_next_redo(history.next_redo());
  return state;
}

ScenePtr SceneBuilder::build(const model::Model& model, std::string_view selected,
                             std::int64_t capture_time_ns) {
  auto scene = std::make_shared<Scene>();
  scene->epoch = epoch_;
  scene->sequence = model.sequence();
  scene->capture_time_ns = capture_time_ns;
  scene->history = history_state(model.history());
  meshes_.begin_round();
  const auto add = [&](const model::Document& document) {
    for (const auto& [id, entity] : document.entities) {
      SceneEntity& seen = scene->entities[id];
      seen.entity = entity;
      seen.revision = model.revision(id);
      seen.provisional = model.is_provisional(id);
      seen.selected = id == selected;
      if (const model::DualPtr shape = model::as_dual(entity)) seen.surface = meshes_.find(*shape);
    }
  };
  if (model.has_provisional()) {
    add(model.preview());
  } else {
    add(model.document());
  }
  meshes_.end_round();
  return scene;
}

}  // namespace handloft::stream
