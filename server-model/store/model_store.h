#pragma once
// A model on disk while it is worked on: opens or makes its log, gives the model back as it was, and from
// then on keeps every operation that is applied, without the model's thread ever waiting for the disk. Who
// wants to call something saved asks when_durable(). Snapshots are made beside, every so many operations.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "common/base/result.h"
#include "server-model/model/model.h"
#include "server-model/store/group_commit.h"
#include "server-model/store/operation_log.h"
#include "server-model/store/recovery.h"

namespace handloft::store {

struct ModelStoreOptions {
  LogOptions log;
  GroupCommitOptions commit;
  /// Operations from one snapshot to the next: a restart then replays at most as many (D7), and one takes
  /// some tenths of a second of another thread.
  std::uint64_t snapshot_every = 1000;
  model::EncodeOptions encode;
  /// Prepares snapshots; null: a thread of its own. With commit.queue a simulation steps all of the store.
  std::shared_ptr<WorkQueue> snapshots = {};
  /// The wall clock, ns since 1970, for people who read the history.
  std::function<std::int64_t()> now_ns;
};

class ModelStore {
 public:
  struct Opened {
    std::shared_ptr<ModelStore> store;
    model::Model model;  ///< As it was, and kept by the store from now on.
    std::uint64_t snapshot_sequence = 0;
    std::uint64_t replayed = 0;
  };

  /// A file that is not there is made. Errors: those of OperationLog::open() and recover().
  static Result<Opened> open(const std::filesystem::path& path, const model::ApplyContext& context,
                             ModelStoreOptions options = {});
  ~ModelStore();  ///< As stop().
  ModelStore(const ModelStore&) = delete;
  ModelStore& operator=(const ModelStore&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// How long the file took to open.
  std::chrono::steady_clock::duration opening() const { return opening_; }
  /// One more with every start that logged something: for ids that must never come again.
  std::uint64_t epoch() const { return epoch_; }
  /// `tell` is called once: when the operation and all before it are durable (maybe at once, on this thread),
  /// or with what ended writing. Else on the writing thread; it must not block. Calls with ascending
  /// sequences are told in their order. Thread-safe.
  void when_durable(std::uint64_t sequence, std::function<void(const Status&)> tell);
  /// The last operation that is durable. Thread-safe.
  std::uint64_t durable_sequence() const;
  /// Writing has ended: the disk is full or failed. Thread-safe.
  Status failure() const { return commit_.failure(); }
  /// From now on each commit adds how long it took. Thread-safe.
  void time_commits(std::shared_ptr<Histogram> times) { commit_.time_commits(std::move(times)); }
  GroupCommitStatistics statistics() const { return commit_.statistics(); }
  /// Waits until all is durable or failed, and told. Thread-safe.
  void flush() { commit_.flush(); }
  /// Flushes and closes the file; the model's journal refuses operations afterwards. A snapshot under way is
  /// given up. Not while the model's thread runs.
  void stop();

 private:
  ModelStore(OperationLog log, std::optional<OperationLog> reader, std::uint64_t epoch,
             std::uint64_t last_snapshot, ModelStoreOptions options);
  void applied(const model::Submitted& submitted, const model::Model& model);
  std::optional<model::Submitted> answered(std::uint64_t client_id, std::uint64_t client_op_id) const;
  Status accepting() const;
  void durable(std::uint64_t sequence, const Status& status);
  void make_snapshots();
  void make_snapshot();
  std::int64_t now_ns() const { return options_.now_ns ? options_.now_ns() : 0; }

  std::filesystem::path path_;
  std::chrono::steady_clock::duration opening_{};
  const ModelStoreOptions options_;
  const std::uint64_t epoch_;
  /// Of the model's thread: answers of long ago, by a connection of its own.
  std::optional<OperationLog> reader_;
  std::uint64_t last_snapshot_;

  mutable std::mutex mutex_;
  std::uint64_t durable_sequence_;
  Status failed_;
  bool telling_ = false;
  std::multimap<std::uint64_t, std::function<void(const Status&)>> waiting_;

  std::mutex snapshot_mutex_;
  std::condition_variable snapshot_wanted_;
  std::optional<model::KeptState> to_snapshot_;
  bool stopping_ = false;

  GroupCommit commit_;
  /// What the queue calls, which may outlive this.
  std::shared_ptr<ModelStore*> self_ = std::make_shared<ModelStore*>(this);
  std::thread snapshots_;
};

}  // namespace handloft::store
