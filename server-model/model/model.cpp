#include "server-model/model/model.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "server-model/model/query.h"
#include "server-model/model/sculpt_solvers.h"

namespace handloft::model {

namespace v1 = handloft::v1;

namespace {
Error no_such_gesture(ProvisionalId id) {
  return make_error(ErrorCode::not_found, fmt::format("there is no gesture {}", id));
}
}  // namespace

Model::Model(Document initial, ApplyContext context)
    : context_(std::move(context)), history_(std::move(initial), context_.limits.max_history_steps) {
  if (!context_.sculpt_solvers) context_.sculpt_solvers = std::make_shared<SculptSolvers>();
  touch_all();
}

Model Model::restored(FormerModel former, ApplyContext context) {
  Model model(Document(), std::move(context));
  model.history_ = std::move(former.history);
  model.sequence_ = former.sequence;
  model.touch_all();
  for (const FormerModel::Answer& answer : former.answers)
    model.remember(answer.client_id, answer.client_op_id, answer.submitted);
  return model;
}

void Model::touch_all() {
  Changes all;
  for (const auto& [id, entity] : history_.current().entities) all.created.push_back(id);
  touch(all);
}

std::optional<Submitted> Model::answered_before(const v1::Operation& operation) const {
  if (operation.client_op_id() == 0) return std::nullopt;
  const auto known = answered_.find({operation.client_id(), operation.client_op_id()});
  if (known != answered_.end()) return known->second;
  return journal_ ? journal_->answered(operation.client_id(), operation.client_op_id()) : std::nullopt;
}

Result<Submitted> Model::submit(const v1::Operation& operation) {
  if (auto before = answered_before(operation)) return *std::move(before);
  if (journal_) {
    if (auto status = journal_->accepting(); !status) return status.error();
  }
  auto submitted =
      operation.has_undo() || operation.has_redo() ? step_history(operation) : submit_new(operation);
  if (submitted) {
    touch(submitted->changes);
    submitted->cancelled_gestures = rebase_provisional();
    remember(operation.client_id(), operation.client_op_id(), *submitted);
    if (journal_ && submitted->sequence != 0) journal_->applied(*submitted, *this);
  }
  return submitted;
}

Result<Submitted> Model::submit_new(const v1::Operation& operation) {
  context_.sequence = sequence_ + 1;
  auto applied = apply(history_.current(), operation, context_);
  if (!applied) return applied.error();
  Submitted submitted;
  submitted.changes = std::move(applied->changes);
  submitted.effective = std::move(applied->effective);
  submitted.words = applied->words;
  submitted.notes = std::move(applied->notes);
  if (submitted.changes.empty()) return submitted;
  submitted.sequence = ++sequence_;
  history_.push(applied->document,
                {std::move(applied->words), operation.client_id(), operation.client_op_id(),
                 operation.author(), operation.made_ns(), sequence_},
                undo_rule_);
  return submitted;
}

Result<Submitted> Model::step_history(const v1::Operation& operation) {
  const Document before = history_.current();
  const std::uint64_t client = operation.client_id();
  const bool shared = undo_rule_ == UndoRule::shared;
  auto words =
      operation.has_undo()
          ? (shared ? history_.undo_newest(context_.limits) : history_.undo(client, context_.limits))
          : (shared ? history_.redo_oldest(context_.limits) : history_.redo(client, context_.limits));
  if (!words) return words.error();
  Submitted submitted;
  submitted.changes = difference(before, history_.current());
  submitted.effective = operation;
  submitted.words = (operation.has_undo() ? "Undo: " : "Redo: ") + *words;
  submitted.sequence = ++sequence_;
  return submitted;
}

Result<v1::QueryResult> Model::query(const v1::Query& query, std::uint64_t client_id) const {
  auto result = answer(
      query, history_.current(), history_, [this](std::string_view id) { return revision(id); },
      context_.limits, client_id);
  if (result && result->has_control_net()) result->mutable_control_net()->set_sequence(sequence_);
  return result;
}

Result<ProvisionalId> Model::begin_provisional(const v1::Operation& operation) {
  if (provisional_.size() >= context_.limits.max_provisional) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("{} gestures are in the air, no more are allowed", provisional_.size()));
  }
  auto begun = Provisional::begin(history_.current(), operation, context_);
  if (!begun) return begun.error();
  const ProvisionalId id = next_provisional_++;
  touch(begun->applied().changes);
  provisional_.emplace(id, std::move(*begun));
  return id;
}

Status Model::append_provisional(ProvisionalId id, std::span<const v1::Point> points) {
  const auto found = provisional_.find(id);
  if (found == provisional_.end()) return no_such_gesture(id);
  const Document before = found->second.result();
  auto status = found->second.append(points);
  if (status) touch(difference(before, found->second.result()));
  return status;
}

Status Model::append_disk(ProvisionalId id, std::span<const v1::DiskPose> poses, double range) {
  const auto found = provisional_.find(id);
  if (found == provisional_.end()) return no_such_gesture(id);
  const Document before = found->second.result();
  auto status = found->second.append_disk(poses, range);
  if (status) touch(difference(before, found->second.result()));
  return status;
}

Status Model::update_provisional(ProvisionalId id, const v1::Operation& operation) {
  const auto found = provisional_.find(id);
  if (found == provisional_.end()) return no_such_gesture(id);
  const Document before = found->second.result();
  auto status = found->second.update(operation);
  if (status) touch(difference(before, found->second.result()));
  return status;
}

Result<Submitted> Model::commit_provisional(ProvisionalId id) {
  const auto found = provisional_.find(id);
  if (found == provisional_.end()) return no_such_gesture(id);
  const v1::Operation operation = found->second.operation();
  cancel_provisional(id);
  return submit(operation);
}

bool Model::cancel_provisional(ProvisionalId id) {
  const auto found = provisional_.find(id);
  if (found == provisional_.end()) return false;
  touch(found->second.applied().changes);
  provisional_.erase(found);
  return true;
}

const Provisional* Model::provisional(ProvisionalId id) const {
  const auto found = provisional_.find(id);
  return found == provisional_.end() ? nullptr : &found->second;
}

namespace {

bool contains(const std::vector<std::string>& ids, std::string_view id) {
  return std::binary_search(ids.begin(), ids.end(), id);
}

/// Takes over what one gesture made of the base.
void show_result(const Provisional& gesture, Document& document) {
  const Changes& changes = gesture.applied().changes;
  for (const auto* ids : {&changes.created, &changes.changed}) {
    for (const std::string& entity : *ids) {
      document.entities.insert_or_assign(entity, gesture.result().find(entity));
    }
  }
  for (const std::string& entity : changes.removed) document.entities.erase(entity);
  if (!changes.created.empty()) {
    auto used = std::make_shared<Document::Ids>(*document.used_ids);
    used->insert(gesture.result().used_ids->begin(), gesture.result().used_ids->end());
    document.used_ids = std::move(used);
    document.next_shape = std::max(document.next_shape, gesture.result().next_shape);
  }
}

}  // namespace

// Points are cheap to lay anew on what another gesture has made of the shape; a push or a profile is not.
Document Model::preview() const {
  Document document = history_.current();
  std::set<std::string, std::less<>> shown;
  for (const bool strokes : {false, true}) {
    for (const auto& [id, gesture] : provisional_) {
      if (gesture.operation().has_add_points() != strokes) continue;
      const std::vector<std::string> changed = gesture.applied().changes.all();
      const bool shared = std::any_of(changed.begin(), changed.end(),
                                      [&](const std::string& entity) { return shown.contains(entity); });
      shown.insert(changed.begin(), changed.end());
      if (strokes && shared) {
        // Without a new fit, which would be another one with every look: the other gesture's stays.
        v1::Operation laid = gesture.operation();
        laid.mutable_add_points()->set_refit(false);
        if (auto both = apply(document, laid, context_)) {
          document = std::move(both->document);
          continue;
        }
      }
      show_result(gesture, document);
    }
  }
  return document;
}

std::optional<std::uint64_t> Model::provisional_by(std::string_view entity) const {
  for (auto gesture = provisional_.rbegin(); gesture != provisional_.rend(); ++gesture) {
    const Changes& changes = gesture->second.applied().changes;
    if (contains(changes.created, entity) || contains(changes.changed, entity) ||
        contains(changes.removed, entity)) {
      return gesture->second.operation().client_id();
    }
  }
  return std::nullopt;
}

std::uint64_t Model::revision(std::string_view entity) const {
  const auto found = revisions_.find(entity);
  return found == revisions_.end() ? 0 : found->second;
}

void Model::touch(const Changes& changes) {
  for (const auto* ids : {&changes.created, &changes.changed, &changes.removed}) {
    for (const std::string& id : *ids) revisions_.insert_or_assign(id, ++revision_counter_);
  }
}

void Model::remember(std::uint64_t client_id, std::uint64_t client_op_id, const Submitted& submitted) {
  if (client_op_id == 0) return;
  const auto key = std::pair{client_id, client_op_id};
  Submitted answer = submitted;
  answer.effective.Clear();  // It may be large, and was logged the first time.
  answered_.insert_or_assign(key, std::move(answer));
  answered_order_.push_back(key);
  if (answered_order_.size() > remembered_answers) {
    answered_.erase(answered_order_.front());
    answered_order_.pop_front();
  }
}

std::vector<std::string> Model::rebase_provisional() {
  std::vector<std::string> cancelled;
  for (auto it = provisional_.begin(); it != provisional_.end();) {
    if (auto status = it->second.rebase(history_.current()); !status) {
      touch(it->second.applied().changes);
      cancelled.push_back(fmt::format("{}: {}", it->second.applied().words, status.error().describe()));
      it = provisional_.erase(it);
    } else {
      touch(it->second.applied().changes);
      ++it;
    }
  }
  return cancelled;
}

}  // namespace handloft::model
