#include "client-hmd/render/point_sorter.h"

#include <algorithm>
#include <utility>

namespace handloft::client {

PointSorter::PointSorter() : thread_([this] { run(); }) {}

PointSorter::~PointSorter() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void PointSorter::want(const std::string& id, std::shared_ptr<const PointSet> set, std::size_t count) {
  {
    const std::lock_guard lock(mutex_);
    Job& job = jobs_[id];
    if (job.wanted == set && job.count == count) return;
    job.wanted = std::move(set);
    job.count = count;
  }
  changed_.notify_all();
}

void PointSorter::forget(const std::string& id) {
  const std::lock_guard lock(mutex_);
  jobs_.erase(id);
}

std::shared_ptr<const SortedPoints> PointSorter::newest(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  return found == jobs_.end() ? nullptr : found->second.ready;
}

void PointSorter::wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] {
    return std::none_of(jobs_.begin(), jobs_.end(), [](const auto& item) { return item.second.due(); });
  });
}

void PointSorter::run() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    const auto is_due = [](const auto& item) { return item.second.due(); };
    auto next = std::find_if(jobs_.upper_bound(last_), jobs_.end(), is_due);
    if (next == jobs_.end()) next = std::find_if(jobs_.begin(), jobs_.end(), is_due);
    if (next == jobs_.end()) {
      changed_.wait(lock);
      continue;
    }
    last_ = next->first;
    auto result = std::make_shared<SortedPoints>();
    result->set = next->second.wanted;
    result->count = next->second.count;
    lock.unlock();
    if (std::optional<PointCells> cells = into_cells(*result->set, result->count)) {
      result->cells = std::move(*cells);
    }
    lock.lock();
    // The entity may be gone by now.
    if (const auto job = jobs_.find(last_); job != jobs_.end()) job->second.ready = std::move(result);
    changed_.notify_all();
  }
}

}  // namespace handloft::client
