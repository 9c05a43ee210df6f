#include "server-model/store/model_store.h"

#include <algorithm>
#include <utility>

#include "server-model/store/side_files.h"

namespace handloft::store {

namespace {

/// What is left where a file could not be made, as on a full disk: it would be taken for a model.
void remove_unfinished(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::file_size(path, ignored) != 0 || ignored) return;
  std::filesystem::remove(path, ignored);
  for (const char* suffix : database_side_suffixes) std::filesystem::remove(path.string() + suffix, ignored);
}

}  // namespace

Result<ModelStore::Opened> ModelStore::open(const std::filesystem::path& path,
                                            const model::ApplyContext& context, ModelStoreOptions options) {
  const auto begun = std::chrono::steady_clock::now();
  const std::int64_t now = options.now_ns ? options.now_ns() : 0;
  auto log = OperationLog::open(path, OperationLog::Access::write, options.log);
  // Not there, or its making was cut off: it holds nothing yet.
  if (!log &&
      (log.error().code == ErrorCode::not_found || log.error().code == ErrorCode::failed_precondition)) {
    std::error_code failed;
    const auto size = std::filesystem::file_size(path, failed);
    auto made = OperationLog::create(path, new_identity(now), options.log);
    // Another process may be making it.
    if (!made && failed && made.error().code != ErrorCode::failed_precondition) remove_unfinished(path);
    // Why it could not be opened says more of a file that is there.
    if (!made) return failed || size == 0 ? made.error() : log.error();
    log = std::move(made);
  }
  if (!log) return log.error();
  auto epoch = log->next_epoch();
  if (!epoch) return epoch.error();
  auto recovered = recover(*log, context);
  if (!recovered) return recovered.error();
  auto reader = OperationLog::open(path, OperationLog::Access::read, options.log);
  if (!reader) return reader.error();
  const std::uint64_t snapshot = recovered->snapshot_sequence;
  Opened opened{std::shared_ptr<ModelStore>(new ModelStore(*std::move(log), *std::move(reader), *epoch,
                                                           snapshot, std::move(options))),
                std::move(recovered->model), snapshot, recovered->replayed};
  const std::shared_ptr<ModelStore> store = opened.store;
  store->path_ = path;
  store->opening_ = std::chrono::steady_clock::now() - begun;
  opened.model.keep_in(
      {[store](std::uint64_t client_id, std::uint64_t op) { return store->answered(client_id, op); },
       [store] { return store->accepting(); },
       [store](const model::Submitted& submitted, const model::Model& model) {
         store->applied(submitted, model);
       }});
  return opened;
}

ModelStore::ModelStore(OperationLog log, std::optional<OperationLog> reader, std::uint64_t epoch,
                       std::uint64_t last_snapshot, ModelStoreOptions options)
    : options_(std::move(options)),
      epoch_(epoch),
      reader_(std::move(reader)),
      last_snapshot_(last_snapshot),
      durable_sequence_(log.last_sequence()),
      commit_(std::move(log), options_.commit) {
  if (!options_.snapshots) snapshots_ = std::thread([this] { make_snapshots(); });
}

ModelStore::~ModelStore() {
  stop();
}

void ModelStore::stop() {
  {
    const std::lock_guard lock(snapshot_mutex_);
    stopping_ = true;
  }
  snapshot_wanted_.notify_one();
  if (snapshots_.joinable()) snapshots_.join();
  self_.reset();
  // Who closes the file last copies the write-ahead log into it: the one that may write.
  reader_.reset();
  commit_.stop();
}

Status ModelStore::accepting() const {
  if (auto failed = commit_.failure(); !failed) {
    return make_error(failed.error().code,
                      "the model can be looked at and exported, but not changed, since it can't be saved: " +
                          failed.error().message);
  }
  if (!commit_.accepting())
    return make_error(ErrorCode::resource_exhausted, "the disk is too slow: too many operations wait for it");
  return {};
}

std::optional<model::Submitted> ModelStore::answered(std::uint64_t client_id,
                                                     std::uint64_t client_op_id) const {
  if (!reader_) return std::nullopt;
  const auto found = reader_->find(client_id, client_op_id);
  if (!found || !*found) return std::nullopt;
  return answer_of((*found)->record);
}

void ModelStore::applied(const model::Submitted& submitted, const model::Model& model) {
  const std::uint64_t sequence = submitted.sequence;
  commit_.append(make_record(submitted, epoch_, now_ns()),
                 [this, sequence](const Status& status) { durable(sequence, status); });
  if (sequence - last_snapshot_ < options_.snapshot_every) return;
  const std::unique_lock lock(snapshot_mutex_, std::try_to_lock);
  // One is being handed over: the next operation asks again.
  if (!lock || to_snapshot_) return;
  last_snapshot_ = sequence;
  to_snapshot_ = model::KeptState{model.history().kept(options_.encode.max_steps), sequence};
  if (!options_.snapshots) {
    snapshot_wanted_.notify_one();
    return;
  }
  options_.snapshots->post([self = std::weak_ptr<ModelStore*>(self_)] {
    if (const auto alive = self.lock()) (*alive)->make_snapshot();
  });
}

void ModelStore::durable(std::uint64_t sequence, const Status& status) {
  std::unique_lock lock(mutex_);
  if (status) {
    durable_sequence_ = std::max(durable_sequence_, sequence);
  } else {
    failed_ = status;
  }
  // Who asks meanwhile for what is durable already is told after those before.
  telling_ = true;
  for (;;) {
    const auto first = waiting_.begin();
    if (first == waiting_.end() || (first->first > durable_sequence_ && failed_)) break;
    const Status outcome = first->first > durable_sequence_ ? failed_ : Status();
    const auto tell = std::move(first->second);
    waiting_.erase(first);
    lock.unlock();
    tell(outcome);
    lock.lock();
  }
  telling_ = false;
}

void ModelStore::when_durable(std::uint64_t sequence, std::function<void(const Status&)> tell) {
  Status status;
  {
    const std::lock_guard lock(mutex_);
    const bool open = sequence > durable_sequence_;
    if (telling_ || (open && failed_)) {
      waiting_.emplace(sequence, std::move(tell));
      return;
    }
    if (open) status = failed_;
  }
  tell(status);
}

std::uint64_t ModelStore::durable_sequence() const {
  const std::lock_guard lock(mutex_);
  return durable_sequence_;
}

void ModelStore::make_snapshots() {
  for (;;) {
    {
      std::unique_lock lock(snapshot_mutex_);
      snapshot_wanted_.wait(lock, [&] { return stopping_ || to_snapshot_; });
      if (stopping_) return;
    }
    make_snapshot();
  }
}

void ModelStore::make_snapshot() {
  std::optional<model::KeptState> state;
  {
    const std::lock_guard lock(snapshot_mutex_);
    state = std::exchange(to_snapshot_, std::nullopt);
  }
  if (!state) return;
  auto prepared = prepare_snapshot(*state, options_.encode);
  state.reset();
  // Without one a restart takes longer; nothing is lost. What failed with the disk is told by failure().
  if (prepared) commit_.snapshot(*std::move(prepared), now_ns(), {});
}

}  // namespace handloft::store
