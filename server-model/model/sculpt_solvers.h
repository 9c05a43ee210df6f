#pragma once
// The sculpt systems that are worth keeping between operations: a factor of ten thousand control points takes
// a fifth of a second to make and a frame of a drag a thousandth to use (architecture idea 4). No result
// depends on what is kept here.

#include <cstddef>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/sculpt_system.h"
#include "server-model/model/control_buffers.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

/// Any thread may use it; callers queue while a system works.
class SculptSolvers {
 public:
  /// Kept at most, the least recently used go first: so many systems, of so many unknowns together.
  /// `iteration`: how surfaces too large for a factor are solved, and which are (its `parallel` is not
  /// asked).
  explicit SculptSolvers(std::size_t max_systems = 8, std::size_t max_unknowns = 1'500'000,
                         geometry::IterativeOptions iteration = default_iteration())
      : max_systems_(max_systems), max_unknowns_(max_unknowns), iteration_(std::move(iteration)) {}

  /// To a relative residual of 1e-8, or as near to it as the numbers come, but within the 1e-6 of D21. From
  /// 20,000 unknowns on, where a factor takes a second and an iteration a fifth of it.
  static geometry::IterativeOptions default_iteration();
  const geometry::IterativeOptions& iteration() const { return iteration_; }

  using Use = std::function<Status(geometry::SculptSystem&)>;
  /// Calls `use` with the system of this rest shape and setup, made if need be. Errors: those of
  /// SculptSystem::create() and of `use`.
  Status with(const std::shared_ptr<const geometry::BSplineSurface>& rest, const geometry::SculptSetup& setup,
              const geometry::ParallelFor& parallel, const Use& use);

  /// Of the rest shape's control points: the diagonal of their box, remembered of the last few.
  double diagonal_m(const std::shared_ptr<const geometry::BSplineSurface>& rest);
  ControlBuffers& buffers() { return buffers_; }

  /// How many were made so far.
  std::size_t made() const;

 private:
  struct Kept {
    std::shared_ptr<const geometry::BSplineSurface> rest;
    geometry::SculptSetup setup;
    geometry::SculptSystem system;
  };

  std::size_t max_systems_, max_unknowns_;
  geometry::IterativeOptions iteration_;
  mutable std::mutex mutex_;
  std::list<Kept> kept_;  ///< Most recently used first.
  std::size_t made_ = 0;
  ControlBuffers buffers_;
  struct Measured {
    std::weak_ptr<const geometry::BSplineSurface> rest;
    double diagonal_m = 0;
  };
  std::mutex measured_mutex_;
  std::list<Measured> measured_;  ///< Most recent first.
};

}  // namespace handloft::model
