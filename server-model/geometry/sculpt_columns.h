#pragma once
// The surface's answers to unit loads, K^-1 phi, one a functional, kept from call to call (architecture idea
// 4): an icon that comes costs one substitution, an icon that goes nothing. An answer's bits depend on its
// functional alone, so that it does not matter which were asked for before or together.

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/stiffness_pins.h"

namespace handloft::geometry {

/// A functional among the unknowns, and what the surface answers.
struct SculptColumn {
  std::vector<Eigen::Index> at;  ///< Unknowns; none where only held control points matter.
  std::vector<double> value;
  double magnitude = 0;       ///< Sum of |value| over all control points: carries the functional's unit.
  Eigen::VectorXd response;   ///< K^-1 phi.
  Eigen::RowVectorXd modes;   ///< phi of each free mode.
  bool follows_pins = false;  ///< The answer is none; places come with the pins.

  double of(const Eigen::Ref<const Eigen::VectorXd>& x) const;
};

class SculptColumns {
 public:
  /// No more memory than this is taken for answers; those not asked for last go first.
  static constexpr std::size_t max_bytes = std::size_t{2} << 30U;

  SculptColumns() = default;
  /// `unknowns` ascending, of `point_count` control points; `modes` as free_modes() says.
  SculptColumns(std::unique_ptr<StiffnessSolver> solver, const std::vector<std::uint32_t>& unknowns,
                std::size_t point_count, Eigen::MatrixXd modes);

  Eigen::Index size() const { return modes_.rows(); }
  const Eigen::MatrixXd& modes() const { return modes_; }
  /// Null: none. With pins all answers are those of the surface that they hold.
  const PinnedSolver* pinned() const { return pinned_; }
  const StiffnessSolver& solver() const { return *solver_; }
  /// Substitutions so far.
  std::size_t solved() const { return solved_; }

  /// In the order asked for. Errors: invalid_argument, naming `field`[i], for functionals of control points
  /// that are not there or numbers that are not finite; resource_exhausted; and the solver's.
  Result<std::vector<std::shared_ptr<const SculptColumn>>> get(
      const std::vector<const SurfaceFunctional*>& functionals, const char* field);
  /// The surface with its pins at these values, a vector each (stiffness_pins.h), kept like answers.
  /// Precondition: pinned(). Errors: as PinnedSolver::follow(), and resource_exhausted.
  Result<std::vector<std::shared_ptr<const Eigen::VectorXd>>> follow(
      const std::vector<const std::vector<double>*>& fields);
  /// What the surface answers to other loads; n x r.
  Result<Eigen::MatrixXd> solve(const Eigen::MatrixXd& loads) const { return solver_->solve(loads); }

 private:
  using Key = std::pair<std::vector<std::uint32_t>, std::vector<double>>;
  struct Kept {
    std::shared_ptr<const SculptColumn> column;
    std::uint64_t used = 0;
  };

  Result<SculptColumn> localise(const SurfaceFunctional& functional) const;
  Status make_room(std::size_t columns);

  struct KeptField {
    std::shared_ptr<const Eigen::VectorXd> response;
    std::uint64_t used = 0;
  };

  std::unique_ptr<StiffnessSolver> solver_;
  const PinnedSolver* pinned_ = nullptr;  // The solver, where it is one.
  std::map<std::vector<double>, KeptField> fields_;
  std::vector<Eigen::Index> place_;  // By control point: its unknown, -1: held.
  Eigen::MatrixXd modes_;
  std::map<Key, Kept> kept_;
  std::uint64_t now_ = 0;
  std::size_t solved_ = 0;
};

}  // namespace handloft::geometry
