#include "server-model/stream/scene_builder.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "server-model/model/annotations.h"
#include "server-model/model/cad_model.h"
#include "server-model/model/sculpt_shape.h"
#include "server-model/stream/viewer.h"

namespace handloft::stream {

v1::HistoryState history_state(const model::History& history) {
  v1::HistoryState state;
  state.set_undo_steps(static_cast<std::uint32_t>(history.undo_steps()));
  state.set_redo_steps(static_cast<std::uint32_t>(history.redo_steps()));
  state.set_next_undo(history.next_undo());
  state.set_next_redo(history.next_redo());
  return state;
}

v1::HistoryState history_state(const model::History& history, std::uint64_t client_id) {
  v1::HistoryState state;
  state.set_undo_steps(static_cast<std::uint32_t>(history.undo_steps(client_id)));
  state.set_redo_steps(static_cast<std::uint32_t>(history.redo_steps(client_id)));
  state.set_next_undo(history.next_undo(client_id));
  state.set_next_redo(history.next_redo(client_id));
  state.set_undo_refused(history.undo_refused(client_id));
  state.set_redo_refused(history.redo_refused(client_id));
  return state;
}

void SceneBuilder::tell_histories(const model::History& history, const std::set<std::uint64_t>& viewers,
                                  Scene& scene) {
  if (last_ && told_changes_ == history.changes() && told_viewers_ == viewers) {
    scene.histories = last_->histories;
    return;
  }
  auto told = std::make_shared<std::map<std::uint64_t, v1::HistoryState>>();
  for (const std::uint64_t client : viewers) {
    // Who has done nothing looks on at the workstation: the server's own hand, and its script.
    const bool looks_on = history.undo_steps(client) + history.redo_steps(client) == 0;
    told->emplace(client, history_state(history, looks_on ? 0 : client));
  }
  scene.histories = std::move(told);
  told_changes_ = history.changes();
  told_viewers_ = viewers;
}

void SceneBuilder::tell_notes(const model::Document& document, Scene& scene) const {
  if (last_) {
    scene.comments = last_->comments;
    scene.versions = last_->versions;
    if (last_->sequence == scene.sequence) return;
  }
  // With each operation, since a comment goes along with its entity; there are few.
  auto comments = std::make_shared<v1::CommentsState>();
  model::write_comments(document, model::Resolved::among_them, *comments->mutable_comments());
  if (comments->SerializeAsString() != scene.comments->SerializeAsString())
    scene.comments = std::move(comments);
  auto versions = std::make_shared<v1::VersionsState>();
  model::write_versions(document, *versions->mutable_versions());
  if (versions->SerializeAsString() != scene.versions->SerializeAsString())
    scene.versions = std::move(versions);
}

std::uint64_t SceneBuilder::points_grow_since(const std::string& id, const SceneEntity& seen) const {
  const model::DualPtr shape = model::as_dual(seen.entity);
  if (!last_ || !shape) return seen.revision;
  const auto found = last_->entities.find(id);
  if (found == last_->entities.end()) return seen.revision;
  const model::DualPtr before = model::as_dual(found->second.entity);
  const bool grows =
      before && (before == shape || common_prefix(before->points, shape->points) == before->points.size());
  return grows ? found->second.points_grow_since : seen.revision;
}

std::uint64_t SceneBuilder::surface_id(const std::string& id, const SceneEntity& seen) {
  if (!seen.surface) return 0;
  if (last_) {
    const auto before = last_->entities.find(id);
    if (before != last_->entities.end() && before->second.surface == seen.surface &&
        before->second.distances == seen.distances) {
      return before->second.surface_id;
    }
  }
  return ++last_surface_id_;
}

ScenePtr SceneBuilder::build(const model::Model& model, std::int64_t capture_time_ns, const HandMarks& marks,
                             const std::set<std::uint64_t>& viewers) {
  auto scene = std::make_shared<Scene>();
  scene->epoch = epoch_;
  scene->sequence = model.sequence();
  scene->capture_time_ns = capture_time_ns;
  scene->history = history_state(model.history());
  tell_histories(model.history(), viewers, *scene);
  tell_notes(model.document(), *scene);
  scene->alternatives.set_present(model.document().present_alternative());
  for (const auto& each : *model.document().alternatives) scene->alternatives.add_names(each.name);
  meshes_.begin_round();
  const auto add = [&](const model::Document& document) {
    ReferenceCache::Meshes references;
    for (const auto& [id, entity] : document.entities) {
      if (const model::ReferencePtr reference = model::as_reference(entity))
        references.push_back(reference->mesh);
    }
    for (const auto& [id, entity] : document.entities) {
      SceneEntity& seen = scene->entities[id];
      seen.entity = entity;
      seen.revision = model.revision(id);
      const auto by = model.provisional_by(id);
      seen.provisional = by.has_value();
      seen.provisional_by = by.value_or(0);
      seen.selected = std::find(marks.active.begin(), marks.active.end(), id) != marks.active.end();
      seen.target = std::find(marks.targets.begin(), marks.targets.end(), id) != marks.targets.end();
      if (const model::DualPtr shape = model::as_dual(entity)) {
        seen.points_grow_since = points_grow_since(id, seen);
        seen.surface = meshes_.find(*shape);
        seen.distances = meshes_.references().find_distances(seen.surface, references);
      } else if (const model::ReferencePtr reference = model::as_reference(entity)) {
        seen.surface = meshes_.references().find_mesh(reference->mesh);
      } else if (const model::CadModelPtr cad = model::as_cad_model(entity)) {
        if (cad->rest) seen.surface = meshes_.references().find_mesh(cad->rest);
      } else if (const model::SculptPtr sculpted = model::as_sculpt(entity)) {
        using Moment = SculptCache::Moment;
        seen.surface =
            meshes_.sculpted().find(sculpted, seen.provisional ? Moment::dragged : Moment::settled);
        // Every frame of a drag has another mesh; measuring them all would hold up what is to be seen.
        if (!seen.provisional) seen.distances = meshes_.references().find_distances(seen.surface, references);
        std::copy_if(marks.icons.begin(), marks.icons.end(), std::back_inserter(seen.icon_marks),
                     [&id = id](const IconMark& mark) { return mark.entity == id; });
      }
      seen.surface_id = surface_id(id, seen);
      if (const auto lease = marks.leases.find(id); lease != marks.leases.end()) seen.lease = lease->second;
    }
  };
  if (model.has_provisional()) {
    add(model.preview());
  } else {
    add(model.document());
  }
  meshes_.end_round();
  last_ = scene;
  return scene;
}

}  // namespace handloft::stream
