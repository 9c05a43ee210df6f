// What the actor does for clients: operations and queries, who sees what of them, leases, and what is on the
// disk.

#include <algorithm>
#include <string>
#include <utility>

#include "server-model/model/reference_distance.h"
#include "server-model/session/export.h"
#include "server-model/session/model_actor.h"
#include "server-model/session/shown_name.h"

namespace handloft::session {
namespace {

bool reads_files(const v1::Operation& operation) {
  if (operation.has_import_reference()) return !operation.import_reference().has_resolved();
  if (operation.has_import_model()) return true;  // Also one that brings a model: it is refused there.
  return operation.has_import_strokes() &&
         (!operation.import_strokes().path().empty() || operation.import_strokes().resolved().empty());
}

}  // namespace

void ModelActor::answer_when_saved(Result<Outcome> outcome, const std::function<void(Result<Outcome>)>& done,
                                   v1::SaveLevel answer_when) {
  const bool at_once =
      answer_when == v1::SAVE_LEVEL_APPLIED || (answer_when == v1::SAVE_LEVEL_UNSPECIFIED &&
                                                options_.acknowledge == ActorOptions::Acknowledge::applied);
  if (!options_.store || at_once) {
    done(std::move(outcome));
    return;
  }
  options_.store->when_durable(model_.sequence(), [outcome = std::move(outcome),
                                                   done](const Status& saved) mutable {
    if (!outcome || outcome->sequence == 0) {
      done(outcome);
    } else if (saved) {
      outcome->durable = true;
      done(outcome);
    } else {
      done(make_error(saved.error().code, "it was done, but could not be saved: " + saved.error().message));
    }
  });
}

void ModelActor::tell_when_durable() {
  if (!options_.store || model_.sequence() == awaited_sequence_) return;
  awaited_sequence_ = model_.sequence();
  options_.store->when_durable(awaited_sequence_, [this](const Status&) {
    // All that one commit has made durable is told of by one message a viewer, the newest.
    if (storage_news_.exchange(true)) return;
    post([this] {
      storage_news_ = false;
      if (events_.on_scene) events_.on_scene();
    });
  });
}

Result<ModelActor::Outcome> ModelActor::apply(const v1::Operation& resolved, const Allowed& allowed) {
  // What was done is answered so, whoever has leased, deleted or closed what it was done to since (H3).
  auto before = model_.answered_before(resolved);
  if (!before && allowed) {
    if (const Status status = allowed(model_.document()); !status) return status.error();
  }
  if (!before) {
    if (Status free = claims_->leases.check(resolved); !free) return free.error();
  }
  auto submitted = before ? Result<model::Submitted>(*std::move(before)) : model_.submit(resolved);
  if (!submitted) return submitted.error();
  if (submitted->sequence != 0) publish_scene();
  Outcome outcome;
  outcome.sequence = submitted->sequence;
  outcome.entities = submitted->changes.all();
  outcome.notes = submitted->notes;
  return outcome;
}

std::function<void(Result<ModelActor::Outcome>)> ModelActor::counted(
    std::function<void(Result<Outcome>)> done, TimePoint came) {
  return
      [metrics = options_.metrics, &clock = clock_, came, done = std::move(done)](Result<Outcome> outcome) {
        if (outcome && outcome->durable) metrics->durable(clock.now() - came);
        done(std::move(outcome));
      };
}

namespace {

/// What the server's own hand and its script did is the work of whoever owns the host: one who has done
/// nothing by this client takes theirs back. Without a number for retries, which are counted by client.
v1::Operation of_host(const v1::Operation& operation, const model::History& history) {
  const std::uint64_t client = operation.client_id();
  const bool step = operation.has_undo() || operation.has_redo();
  if (!step || history.undo_steps(client) + history.redo_steps(client) > 0) return operation;
  v1::Operation theirs = operation;
  theirs.set_client_id(0);
  theirs.set_client_op_id(0);
  return theirs;
}

}  // namespace

void ModelActor::submit(v1::Operation operation, model::FileAccess files,
                        std::function<void(Result<Outcome>)> done, Allowed allowed,
                        v1::SaveLevel answer_when) {
  seal_inbox(operation.client_id());
  if (answer_when == v1::SAVE_LEVEL_DURABLE && !options_.store) {
    done(make_error(ErrorCode::failed_precondition,
                    "this server keeps nothing on a disk: expected SAVE_LEVEL_APPLIED",
                    "submit.answer_when"));
    return;
  }
  const TimePoint came = clock_.now();
  if (options_.metrics) done = counted(std::move(done), came);
  const bool owns_host = files.scope == model::FileAccess::Scope::anywhere;
  const auto perform = [this, allowed = std::move(allowed), answer_when, came, owns_host](
                           const v1::Operation& resolved,
                           const std::function<void(Result<Outcome>)>& answer) {
    auto outcome = apply(owns_host ? of_host(resolved, model_.history()) : resolved, allowed);
    if (outcome && options_.metrics)
      options_.metrics->applied(options_.name, resolved.body_case(), clock_.now() - came);
    answer_when_saved(std::move(outcome), answer, answer_when);
  };
  if (operation.has_export_()) {
    post([this, operation = std::move(operation), files = std::move(files), done = std::move(done)] {
      in_pool([document = model_.document(), operation, files, done] {
        auto exported = model::export_document(document, operation.export_(), files);
        if (!exported) {
          done(exported.error());
          return;
        }
        Outcome outcome;
        outcome.entities = std::move(exported->entities);
        outcome.notes = std::move(exported->notes);
        done(std::move(outcome));
      });
    });
  } else if (reads_files(operation)) {
    in_pool(
        [this, perform, operation = std::move(operation), files = std::move(files), done = std::move(done)] {
          auto resolved = model::resolve_operation(operation, files, model_.limits());
          if (!resolved) {
            // A retry of what was done needs its file no more.
            post([perform, operation, refused = resolved.error(), done, this] {
              if (model_.answered_before(operation)) {
                perform(operation, done);
              } else {
                done(refused);
              }
            });
            return;
          }
          post([perform, resolved = *std::move(resolved), done] { perform(resolved, done); });
        });
  } else {
    post([perform, operation = std::move(operation), done = std::move(done)] { perform(operation, done); });
  }
}

void ModelActor::answer_again(v1::Operation operation, Error refused,
                              std::function<void(Result<Outcome>)> done, v1::SaveLevel answer_when) {
  post([this, operation = std::move(operation), refused = std::move(refused), done = std::move(done),
        answer_when] {
    if (model_.answered_before(operation)) {
      answer_when_saved(apply(operation, {}), done, answer_when);
    } else {
      done(refused);
    }
  });
}

void ModelActor::ask(v1::Query query, std::function<void(Result<v1::QueryResult>)> done,
                     std::uint64_t client_id) {
  post([this, query = std::move(query), done = std::move(done), client_id] {
    if (!query.has_distance()) {
      done(model_.query(query, client_id));
      return;
    }
    // Measures every point against a mesh, which may have to be prepared first: not while a hand waits.
    in_pool([document = model_.document(), distance = query.distance(), done] {
      done(model::distance_to_reference(distance, document));
    });
  });
}

void ModelActor::viewer_came(std::uint64_t client_id, const std::string& name, std::function<void()> joined) {
  post([this, client_id, name, joined = std::move(joined)] {
    viewers_.insert(client_id);
    claims_->leases.introduce(client_id, name);
    publish_scene();
    if (joined) joined();
  });
}

void ModelActor::viewer_gone(std::uint64_t client_id) {
  post([this, client_id] {
    viewers_.erase(client_id);
    claims_->leases.forget(client_id);
    publish_scene();
  });
}

void ModelActor::end_leases(std::uint64_t client_id) {
  post([this, client_id] {
    claims_->leases.release_all(client_id);
    publish_scene();
  });
}

void ModelActor::lease(std::uint64_t client_id, const std::string& entity, LeaseWish wish,
                       std::function<void(Status)> done) {
  post([this, client_id, entity, wish, done = std::move(done)] {
    using Kind = interaction::Leases::Kind;
    Status status;
    if (wish == LeaseWish::release) {
      claims_->leases.release(entity, client_id, Kind::asked);
    } else if (!model_.document().find(entity)) {
      status = make_error(ErrorCode::not_found, "there is no entity \"" + shown_name(entity) + "\"",
                          "lease.entity");
    } else {
      status = claims_->leases.take(entity, client_id, Kind::asked);
    }
    if (status) publish_scene();
    done(status);
  });
}

void ModelActor::tick() {
  post([this] {
    bool changed = claims_->leases.sweep();
    for (auto& [id, source] : sources_) {
      if (clock_.now() - source.heard_at >= options_.silence) changed |= source.interaction.lapse();
    }
    if (changed) publish_scene();
  });
}

stream::Personal ModelActor::personal(const stream::Scene& scene, std::uint64_t client_id) const {
  stream::Personal own;
  const auto history = scene.histories->find(client_id);
  if (history != scene.histories->end()) own.history = history->second;
  own.storage.set_kept(options_.store != nullptr);
  if (!options_.store) return own;
  // Never later than the scene that it comes with: a viewer must not be told that what it has not seen is
  // safe.
  own.storage.set_durable_sequence(std::min(options_.store->durable_sequence(), scene.sequence));
  if (const Status good = options_.store->failure(); !good) own.storage.set_problem(good.error().message);
  return own;
}

}  // namespace handloft::session
