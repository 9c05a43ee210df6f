#pragma once
// A thread that writes a log, so that no hand waits for a disk: records are handed over at once, and told of
// when they are durable. All that come while one commit is under way go into the next (group commit). Between
// commits it writes snapshots, a step at a time.

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "common/base/histogram.h"
#include "common/base/result.h"
#include "common/base/work_queue.h"
#include "server-model/store/operation_log.h"
#include "server-model/store/snapshot.h"

namespace handloft::store {

struct GroupCommitOptions {
  /// Records that may wait for the disk before accepting() says no: half a minute of work of 32 people.
  std::size_t max_waiting = 4096;
  std::size_t max_waiting_bytes = 256U << 20U;  ///< Two of the largest imports.
  /// Does the writing, a commit or a step of a snapshot at a time; null: a thread of its own. flush() and
  /// stop() then do what waits themselves.
  std::shared_ptr<WorkQueue> queue = {};
};

struct GroupCommitStatistics {
  std::uint64_t records = 0;
  std::uint64_t commits = 0;
  std::uint64_t snapshots = 0;
};

class GroupCommit {
 public:
  /// Called on the writing thread, in the order of append(); must not block.
  using Durable = std::function<void(const Status&)>;

  /// A log open for writing.
  explicit GroupCommit(OperationLog log, GroupCommitOptions options = {});
  ~GroupCommit();  ///< As stop().
  GroupCommit(const GroupCommit&) = delete;
  GroupCommit& operator=(const GroupCommit&) = delete;

  /// In the order of their sequence. Never blocks. After a failure `durable` is told it,
  /// and what was not durable by then is not. Thread-safe, as all below.
  void append(LogRecord record, Durable durable);
  /// False: too much waits, or writing has failed (failure() says why): take no more operations.
  bool accepting() const;
  Status failure() const;
  /// One at a time: while one is being written, further ones are refused (failed_precondition).
  void snapshot(PreparedSnapshot snapshot, std::int64_t now_ns, Durable done);
  void add_audit(AuditEntry entry);
  /// Waits until all that was handed over is durable or failed.
  void flush();
  /// Flushes, ends the thread and closes the file. Later records are refused.
  void stop();

  GroupCommitStatistics statistics() const;
  /// From now on each commit adds how long it took.
  void time_commits(std::shared_ptr<Histogram> times);

 private:
  struct Waiting {
    LogRecord record;
    Durable durable;
  };
  void run();
  void wake();
  void do_scheduled();
  bool has_work() const { return !waiting_.empty() || !jobs_.empty() || snapshot_; }
  void do_some(std::unique_lock<std::mutex>& lock);
  void write(std::vector<Waiting> batch);
  void step_snapshot();

  OperationLog log_;  ///< The thread's own.
  GroupCommitOptions options_;

  mutable std::mutex mutex_;
  std::condition_variable wake_, idle_;
  std::vector<Waiting> waiting_;
  std::vector<std::function<void(OperationLog&)>> jobs_;
  std::size_t waiting_bytes_ = 0;
  bool busy_ = false;
  bool stopping_ = false;
  bool scheduled_ = false;  ///< In the queue, if there is one.
  Status failure_;
  GroupCommitStatistics statistics_;
  std::shared_ptr<Histogram> commit_times_;

  bool snapshot_under_way_ = false;
  std::unique_ptr<SnapshotWriter> snapshot_;  ///< The thread's own, as is:
  Durable snapshot_done_;
  /// What the queue calls, which may outlive this.
  std::shared_ptr<GroupCommit*> self_ = std::make_shared<GroupCommit*>(this);
  std::thread thread_;
};

}  // namespace handloft::store
