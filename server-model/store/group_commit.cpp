#include "server-model/store/group_commit.h"

#include <chrono>
#include <utility>

namespace handloft::store {

namespace {
Error stopped() {
  return make_error(ErrorCode::cancelled, "the log is closed");
}
}  // namespace

GroupCommit::GroupCommit(OperationLog log, GroupCommitOptions options)
    : log_(std::move(log)), options_(std::move(options)), failure_(log_.failure()) {
  if (!options_.queue) thread_ = std::thread([this] { run(); });
}

GroupCommit::~GroupCommit() {
  stop();
}

void GroupCommit::append(LogRecord record, Durable durable) {
  {
    const std::lock_guard lock(mutex_);
    if (!stopping_) {
      waiting_bytes_ += record.operation.size() + record.answer.size();
      waiting_.push_back({std::move(record), std::move(durable)});
      wake();
      return;
    }
  }
  if (durable) durable(stopped());
}

bool GroupCommit::accepting() const {
  const std::lock_guard lock(mutex_);
  return failure_.ok() && !stopping_ && waiting_.size() < options_.max_waiting &&
         waiting_bytes_ < options_.max_waiting_bytes;
}

Status GroupCommit::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

void GroupCommit::snapshot(PreparedSnapshot snapshot, std::int64_t now_ns, Durable done) {
  std::unique_lock lock(mutex_);
  if (stopping_ || snapshot_under_way_) {
    lock.unlock();
    if (done) done(make_error(ErrorCode::failed_precondition, "a snapshot is being written"));
    return;
  }
  snapshot_under_way_ = true;
  jobs_.push_back([this, shared = std::make_shared<PreparedSnapshot>(std::move(snapshot)), now_ns,
                   done = std::move(done)](OperationLog& log) mutable {
    snapshot_ = std::make_unique<SnapshotWriter>(log, std::move(*shared), now_ns);
    snapshot_done_ = std::move(done);
  });
  wake();
}

void GroupCommit::add_audit(AuditEntry entry) {
  const std::lock_guard lock(mutex_);
  if (stopping_) return;
  jobs_.push_back([entry = std::move(entry)](OperationLog& log) { (void)log.add_audit(entry); });
  wake();
}

/// With mutex_ held.
void GroupCommit::wake() {
  if (!options_.queue) {
    wake_.notify_one();
  } else if (!std::exchange(scheduled_, true)) {
    options_.queue->post([self = std::weak_ptr<GroupCommit*>(self_)] {
      if (const auto alive = self.lock()) (*alive)->do_scheduled();
    });
  }
}

void GroupCommit::do_scheduled() {
  std::unique_lock lock(mutex_);
  scheduled_ = false;
  if (has_work()) do_some(lock);
  if (has_work()) wake();
}

void GroupCommit::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [&] { return stopping_ || has_work(); });
    if (stopping_ && !has_work()) return;
    do_some(lock);
  }
}

void GroupCommit::do_some(std::unique_lock<std::mutex>& lock) {
  busy_ = true;
  std::vector<Waiting> batch = std::exchange(waiting_, {});
  waiting_bytes_ = 0;
  const auto jobs = std::exchange(jobs_, {});
  lock.unlock();
  if (!batch.empty()) write(std::move(batch));
  for (const auto& job : jobs) job(log_);
  if (snapshot_) step_snapshot();
  log_.tidy();
  lock.lock();
  failure_ = log_.failure();
  busy_ = false;
  idle_.notify_all();
}

void GroupCommit::write(std::vector<Waiting> batch) {
  std::vector<LogRecord> records;
  records.reserve(batch.size());
  for (Waiting& one : batch) records.push_back(std::move(one.record));
  const auto begun = std::chrono::steady_clock::now();
  Status status = log_.append(records);
  const auto took = std::chrono::steady_clock::now() - begun;
  // A record that does not fit would leave a gap: as bad as a disk that fails.
  if (!status) status = log_.fail(status.error());
  {
    const std::lock_guard lock(mutex_);
    if (commit_times_) commit_times_->add(took);
    failure_ = log_.failure();
    if (status) {
      statistics_.records += records.size();
      ++statistics_.commits;
    }
  }
  for (const Waiting& one : batch) {
    if (one.durable) one.durable(status);
  }
}

void GroupCommit::step_snapshot() {
  const auto done = snapshot_->step();
  if (done && !*done) return;
  snapshot_.reset();
  const Durable tell = std::exchange(snapshot_done_, {});
  {
    const std::lock_guard lock(mutex_);
    snapshot_under_way_ = false;
    if (done) ++statistics_.snapshots;
  }
  if (tell) tell(done ? Status() : Status(done.error()));
}

void GroupCommit::flush() {
  std::unique_lock lock(mutex_);
  while (options_.queue && has_work()) do_some(lock);
  idle_.wait(lock, [&] { return waiting_.empty() && jobs_.empty() && !busy_ && !snapshot_under_way_; });
}

void GroupCommit::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    wake();
  }
  if (options_.queue) {
    if (!self_) return;
    flush();
    self_.reset();
  } else {
    if (!thread_.joinable()) return;
    thread_.join();
  }
  const OperationLog closed = std::move(log_);
}

void GroupCommit::time_commits(std::shared_ptr<Histogram> times) {
  const std::lock_guard lock(mutex_);
  commit_times_ = std::move(times);
}

GroupCommitStatistics GroupCommit::statistics() const {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

}  // namespace handloft::store
