#pragma once
// What a frame needs of each entity and takes longer than a frame: one thread makes it, the frame loop goes
// on with the last one meanwhile. Of what is wanted while the thread is busy only the newest is made (V5);
// entities take turns.

#include <algorithm>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace handloft::client {

/// `Wanted` is compared with == to know that the same is wanted again. Thread-safe.
template <typename Wanted, typename Made>
class NewestWorker {
 public:
  /// `make` is called on the thread, one at a time; it must return something.
  using Make = std::function<std::shared_ptr<const Made>(const Wanted&)>;

  explicit NewestWorker(Make make) : make_(std::move(make)), thread_([this] { run(); }) {}
  /// Waits for the one that is being worked on.
  ~NewestWorker() {
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  NewestWorker(const NewestWorker&) = delete;
  NewestWorker& operator=(const NewestWorker&) = delete;

  /// Never waits. The same again costs nothing.
  void want(const std::string& id, Wanted wanted) {
    {
      const std::lock_guard lock(mutex_);
      const auto [job, is_new] = jobs_.try_emplace(id);
      if (!is_new && job->second.wanted == wanted) return;
      job->second.wanted = std::move(wanted);
      job->second.due = true;
    }
    changed_.notify_all();
  }
  void forget(const std::string& id) {
    const std::lock_guard lock(mutex_);
    jobs_.erase(id);
  }
  /// Forgets all entities for which `keep` is false.
  template <typename Keep>
  void keep_only(const Keep& keep) {
    const std::lock_guard lock(mutex_);
    std::erase_if(jobs_, [&keep](const auto& item) { return !keep(item.first); });
  }
  /// The newest that is ready; null: none yet. It may be of something older than was wanted last.
  std::shared_ptr<const Made> newest(const std::string& id) const {
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(id);
    return found == jobs_.end() ? nullptr : found->second.ready;
  }
  /// Until everything that was wanted is ready: for stills.
  void wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return std::none_of(jobs_.begin(), jobs_.end(), is_due); });
  }

 private:
  struct Job {
    Wanted wanted{};
    std::shared_ptr<const Made> ready;
    bool due = false;
  };
  static bool is_due(const std::pair<const std::string, Job>& item) { return item.second.due; }

  void run() {
    std::unique_lock lock(mutex_);
    while (!ending_) {
      auto next = std::find_if(jobs_.upper_bound(last_), jobs_.end(), is_due);
      if (next == jobs_.end()) next = std::find_if(jobs_.begin(), jobs_.end(), is_due);
      if (next == jobs_.end()) {
        changed_.wait(lock);
        continue;
      }
      last_ = next->first;
      const Wanted wanted = next->second.wanted;
      lock.unlock();
      std::shared_ptr<const Made> made = make_(wanted);
      lock.lock();
      // The entity may be gone by now, or something newer wanted of it.
      if (const auto job = jobs_.find(last_); job != jobs_.end()) {
        job->second.ready = std::move(made);
        if (job->second.wanted == wanted) job->second.due = false;
      }
      changed_.notify_all();
    }
  }

  const Make make_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;  ///< Something is wanted, or ready, or it ends.
  std::map<std::string, Job> jobs_;
  std::string last_;  ///< Worked on last.
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace handloft::client
