#include "client-hmd/render/curvature_worker.h"

#include <algorithm>
#include <chrono>

namespace handloft::client {

CurvatureWorker::CurvatureWorker(CurvatureOptions options) : options_(options), thread_([this] { run(); }) {}

CurvatureWorker::~CurvatureWorker() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void CurvatureWorker::want(const std::string& id, std::shared_ptr<const SurfaceMesh> mesh) {
  {
    const std::lock_guard lock(mutex_);
    if (mesh == nullptr) {
      jobs_.erase(id);
      return;
    }
    Job& job = jobs_[id];
    if (job.wanted == mesh) return;
    job.wanted = std::move(mesh);
  }
  changed_.notify_all();
}

std::shared_ptr<const MeshCurvatures> CurvatureWorker::newest(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  return found == jobs_.end() ? nullptr : found->second.ready;
}

void CurvatureWorker::wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] {
    return std::none_of(jobs_.begin(), jobs_.end(), [](const auto& item) { return item.second.due(); });
  });
}

void CurvatureWorker::run() {
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
    const std::shared_ptr<const SurfaceMesh> mesh = next->second.wanted;
    lock.unlock();

    const auto begun = std::chrono::steady_clock::now();
    auto result = std::make_shared<MeshCurvatures>();
    result->mesh = mesh;
    result->values = vertex_curvatures(mesh->vertices, mesh->indices, options_);
    for (const NamedChoice<CurvatureKind>& kind : curvature_kinds()) {
      result->range_per_m[static_cast<std::size_t>(kind.choice)] =
          curvature_range(result->values, mesh->vertices, kind.choice);
    }
    result->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();

    lock.lock();
    // The entity may be gone by now.
    if (const auto job = jobs_.find(last_); job != jobs_.end()) job->second.ready = std::move(result);
    changed_.notify_all();
  }
}

}  // namespace handloft::client
