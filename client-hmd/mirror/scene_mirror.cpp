#include "client-hmd/mirror/scene_mirror.h"

#include <fmt/format.h>

#include <string_view>
#include <unordered_set>
#include <utility>

#include "client-hmd/mirror/read_shared_work.h"

namespace handloft::client {
namespace {

Error corrupt(std::string field, std::string message) {
  return make_error(ErrorCode::data_corrupt, std::move(message), std::move(field));
}
Error too_many(std::string field, std::size_t found, std::size_t limit) {
  return make_error(ErrorCode::resource_exhausted, fmt::format("found {}, expected at most {}", found, limit),
                    std::move(field));
}

/// The error with `prefix` before its field.
Error within(const std::string& prefix, const Error& error) {
  return make_error(error.code, error.message, error.field.empty() ? prefix : prefix + "." + error.field);
}

Result<History> read_history(const v1::HistoryState& state, const MirrorLimits& limits) {
  if (state.next_undo().size() > limits.max_text_bytes || state.next_redo().size() > limits.max_text_bytes ||
      state.undo_refused().size() > limits.max_long_text_bytes ||
      state.redo_refused().size() > limits.max_long_text_bytes) {
    return corrupt("history",
                   fmt::format("expected descriptions of at most {} bytes", limits.max_text_bytes));
  }
  return History{state.undo_steps(), state.redo_steps(),   state.next_undo(),
                 state.next_redo(),  state.undo_refused(), state.redo_refused()};
}

Result<Alternatives> read_alternatives(const v1::AlternativesState& state, const MirrorLimits& limits) {
  const auto count = static_cast<std::size_t>(state.names_size());
  if (count > limits.max_alternatives) return too_many("alternatives.names", count, limits.max_alternatives);
  Alternatives alternatives{state.present(), {}};
  bool present_is_one = count == 0 && state.present().empty();
  for (const std::string& name : state.names()) {
    if (name.size() > limits.max_text_bytes) {
      return corrupt("alternatives.names",
                     fmt::format("found {} bytes, expected at most {}", name.size(), limits.max_text_bytes));
    }
    present_is_one = present_is_one || name == state.present();
    alternatives.names.push_back(name);
  }
  if (!present_is_one) return corrupt("alternatives.present", "expected one of the names");
  return alternatives;
}

/// Of a snapshot and a delta alike: what is absent stays as it is in `next`.
template <typename Message>
Status read_shared_work(const Message& message, const MirrorLimits& limits, Scene& next) {
  if (message.has_storage()) {
    Result<Storage> storage = read_storage(message.storage(), limits);
    if (!storage) return storage.error();
    next.storage = std::move(*storage);
  }
  if (message.has_comments()) {
    auto comments = read_comments(message.comments(), limits);
    if (!comments) return comments.error();
    next.comments = std::move(*comments);
  }
  if (message.has_versions()) {
    auto versions = read_versions(message.versions(), limits);
    if (!versions) return versions.error();
    next.versions = std::move(*versions);
  }
  return {};
}

}  // namespace

Status SceneMirror::put(const EntityBefore& before, const v1::EntityState& state, const std::string& field,
                        Scene& scene, SceneSize& size) {
  SceneSize others = size;
  if (before.base != nullptr) others -= size_of(*before.base);
  const MirrorLimits room = room_beside(others, limits_);
  Result<std::shared_ptr<const Entity>> entity = read_entity(before, state, room, topologies_);
  if (!entity) return within(field, entity.error());
  others += size_of(**entity);
  if (const Status fits = check_size(others, limits_); !fits) return within(field, fits.error());
  size = others;
  scene.entities[state.id()] = std::move(*entity);
  return {};
}

Result<Scene> SceneMirror::after(const v1::SceneSnapshot& snapshot) {
  const auto count = static_cast<std::size_t>(snapshot.entities_size());
  if (count > limits_.max_entities) return too_many("entities", count, limits_.max_entities);
  Scene next;
  next.epoch = snapshot.epoch();
  next.sequence = snapshot.sequence();
  SceneSize size;
  for (const v1::EntityState& state : snapshot.entities()) {
    const std::string field = fmt::format("entities[{}]", next.entities.size());
    if (next.entities.count(state.id()) != 0) return corrupt(field + ".id", "comes twice in one message");
    const auto shown = scene_->entities.find(state.id());
    const EntityBefore before{nullptr, shown == scene_->entities.end() ? nullptr : shown->second.get()};
    if (const Status done = put(before, state, field, next, size); !done) return done.error();
  }
  Result<History> history = read_history(snapshot.history(), limits_);
  if (!history) return history.error();
  next.history = std::move(*history);
  Result<Alternatives> alternatives = read_alternatives(snapshot.alternatives(), limits_);
  if (!alternatives) return alternatives.error();
  next.alternatives = std::move(*alternatives);
  if (const Status read = read_shared_work(snapshot, limits_, next); !read) return read.error();
  return next;
}

Result<Scene> SceneMirror::after(const v1::SceneDelta& delta) {
  if (!begun_) return make_error(ErrorCode::failed_precondition, "a delta came before the first snapshot");
  if (delta.epoch() != scene_->epoch || delta.sequence() < scene_->sequence) {
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("a delta of epoch {}, sequence {} does not follow epoch {}, sequence {}",
                                  delta.epoch(), delta.sequence(), scene_->epoch, scene_->sequence),
                      "sequence");
  }
  const auto count = static_cast<std::size_t>(delta.changed_size());
  if (count > limits_.max_entities) return too_many("changed", count, limits_.max_entities);
  const auto removed = static_cast<std::size_t>(delta.removed_size());
  if (removed > limits_.max_entities) return too_many("removed", removed, limits_.max_entities);
  Scene next = *scene_;
  next.sequence = delta.sequence();
  for (const std::string& id : delta.removed()) next.entities.erase(id);
  SceneSize size = size_of(next);
  std::uint64_t stale = 0;
  // Each costs a copy of what is held, however short it is: once a message is enough.
  std::unordered_set<std::string_view> named;
  for (int i = 0; i < delta.changed_size(); ++i) {
    const v1::EntityState& state = delta.changed(i);
    const std::string field = fmt::format("changed[{}]", i);
    if (!named.insert(state.id()).second) return corrupt(field + ".id", "comes twice in one message");
    const auto found = next.entities.find(state.id());
    const Entity* held = found == next.entities.end() ? nullptr : found->second.get();
    if (held != nullptr && state.revision() < held->revision) {
      ++stale;
      continue;
    }
    if (const Status done = put({held, held}, state, field, next, size); !done) return done.error();
  }
  if (delta.has_history()) {
    Result<History> history = read_history(delta.history(), limits_);
    if (!history) return history.error();
    next.history = std::move(*history);
  }
  if (delta.has_alternatives()) {
    Result<Alternatives> alternatives = read_alternatives(delta.alternatives(), limits_);
    if (!alternatives) return alternatives.error();
    next.alternatives = std::move(*alternatives);
  }
  if (const Status read = read_shared_work(delta, limits_, next); !read) return read.error();
  statistics_.stale_entities += stale;
  return next;
}

Status SceneMirror::count(Result<Scene> next) {
  if (!next) {
    ++statistics_.refused;
    return next.error();
  }
  ++statistics_.applied;
  begun_ = true;
  scene_ = std::make_shared<const Scene>(std::move(*next));
  return {};
}

Status SceneMirror::apply(const v1::SceneSnapshot& snapshot) {
  return count(after(snapshot));
}
Status SceneMirror::apply(const v1::SceneDelta& delta) {
  return count(after(delta));
}

}  // namespace handloft::client
