#include "server-model/model/sculpt_solvers.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

namespace handloft::model {

namespace {

bool same(const geometry::SculptSetup& a, const geometry::SculptSetup& b) {
  return a.energy == b.energy && a.supports == b.supports && a.mode == b.mode && a.held == b.held &&
         a.pins == b.pins;
}

}  // namespace

geometry::IterativeOptions SculptSolvers::default_iteration() {
  geometry::IterativeOptions options;
  options.relative_residual = 1e-8;
  options.acceptable_residual = 1e-6;
  options.direct_unknowns = 20'000;
  return options;
}

Status SculptSolvers::with(const std::shared_ptr<const geometry::BSplineSurface>& rest,
                           const geometry::SculptSetup& setup, const geometry::ParallelFor& parallel,
                           const Use& use) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& each) {
    return each.rest == rest && same(each.setup, setup);
  });
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
    return use(kept_.front().system);
  }
  geometry::IterativeOptions iteration = iteration_;
  iteration.parallel = parallel;
  auto system = geometry::SculptSystem::create(*rest, setup, iteration);
  if (!system) return system.error();
  ++made_;
  kept_.push_front({rest, setup, std::move(*system)});
  std::size_t unknowns = 0, count = 0;
  for (auto each = kept_.begin(); each != kept_.end();) {
    unknowns += each->system.unknown_count();
    ++count;
    const bool keep = count == 1 || (count <= max_systems_ && unknowns <= max_unknowns_);
    each = keep ? std::next(each) : kept_.erase(each);
  }
  return use(kept_.front().system);
}

double SculptSolvers::diagonal_m(const std::shared_ptr<const geometry::BSplineSurface>& rest) {
  const std::lock_guard lock(measured_mutex_);
  const auto found = std::find_if(measured_.begin(), measured_.end(),
                                  [&](const Measured& each) { return each.rest.lock() == rest; });
  if (found != measured_.end()) return found->diagonal_m;
  Eigen::AlignedBox3d box;
  for (const geometry::Vec3& point : rest->control) box.extend(point);
  measured_.push_front({rest, box.diagonal().norm()});
  if (measured_.size() > max_systems_ + 1) measured_.pop_back();
  return measured_.front().diagonal_m;
}

std::size_t SculptSolvers::made() const {
  const std::lock_guard lock(mutex_);
  return made_;
}

}  // namespace handloft::model
