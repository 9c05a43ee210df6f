#pragma once
// A surface or curve that yields to constraints and loads with the least deformation energy (requirements D1
// to D8, D16, D20):
//
//   auto system = SculptSystem::create(surface, setup);        // factorises K once
//   auto shape = system->solve(rows, loads, ConflictPolicy::refuse);   // every frame of a drag
//
// solve() is the only way to a shape, for previews as for commits. While the rows' functionals stay the same
// (a drag changes targets and forces only) it costs O(points x rows); a new functional costs one
// substitution, a functional less only the small dense factor (constraint_factor.h). Whatever was asked
// before, the shape's bits depend only on the rest shape, the setup, the rows and loads and their order.
//
// Soft rows (those with a tolerance) are springs so stiff that a shape which the surface is made for is met
// to its last digits, and so yielding that none is forced: each gives way by soft_yield of what the surface
// itself does there, and what they are off is asked for again soft_rounds - 1 times (iterated Tikhonov
// regularisation; Engl, Hanke and Neubauer 1996, 5.1). SculptSolution::off says what remains.

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bspline_curve.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/constraint_factor.h"
#include "server-model/geometry/sculpt_columns.h"
#include "server-model/geometry/sculpt_energy.h"
#include "server-model/geometry/sculpt_rows.h"
#include "server-model/geometry/stiffness_solver.h"

namespace handloft::geometry {

enum class SculptMode : std::uint8_t {
  displacement,      ///< The energy is that of the displacement: without loads the rest shape stays (D4).
  absolute_fairing,  ///< It is that of the shape: the surface becomes as fair as rows and supports let it.
};

struct SculptSetup {
  SculptEnergy energy;
  SculptSupports supports;
  SculptMode mode = SculptMode::displacement;
  std::vector<std::uint32_t> held;  ///< Further control points that stay, ascending: points_outside().
  /// Curves and regions of surfaces too large to keep the answer to each of their rows: they are held by the
  /// solver itself, by iteration whatever the size (stiffness_pins.h), and moved by SculptField.
  StiffnessPins pins;
};

/// A way in which the pins move together: by weight[i] * amount each, beyond their places at rest. While the
/// weights stay the same, it costs what a row does.
struct SculptField {
  std::vector<double> weight;  ///< By pin, points first.
  Vec3 amount = Vec3::Zero();
};

/// Of curves: E = integral alpha |w_u|^2 + beta |w_uu|^2 (D1).
struct CurveSculptSetup {
  double alpha = 0.05, beta = 1;
  Support lower = Support::clamped, upper = Support::clamped;
  SculptMode mode = SculptMode::displacement;
};

enum class ConflictPolicy : std::uint8_t {
  refuse,         ///< Contradicting rows are an error that names them.
  least_squares,  ///< They are met as nearly as all of them can be; see ConstraintFactor.
};

/// A row that follows from others (by their indices, ascending; none: from held control points alone).
struct DependentRow {
  std::size_t row = 0;
  std::vector<std::size_t> on;
};
/// A row that could not be met, and by how much it is off (in its functional's unit).
struct SculptConflict {
  std::size_t row = 0;
  double off = 0;
};

struct SculptSolution {
  std::vector<Vec3> control;              ///< All control points; the held ones have the rest shape's bits.
  bool moved = false;                     ///< Some control point has other bits than at rest.
  double farthest_m = 0;                  ///< Largest |coordinate| of control points.
  Eigen::MatrixX3d displacement;          ///< Of the movable ones, ascending, before it is added and rounded.
  std::vector<Vec3> reactions;            ///< The force by which each row acts, on its functional.
  std::vector<DependentRow> dependent;    ///< Ascending.
  std::vector<double> off;                ///< How far each row is off, in its unit; none where all are met.
  std::vector<SculptConflict> conflicts;  ///< Ascending; none under ConflictPolicy::refuse.
};

/// What a frame of a drag asks for: a million control points and their displacements are twice the memory.
enum class SculptDetail : std::uint8_t {
  shape,         ///< SculptSolution::displacement stays empty; residual() needs it.
  displacement,  ///< All.
};

/// How well a solution meets the conditions of a minimum (Karush, Kuhn and Tucker).
struct SculptResidual {
  double stationarity = 0;  ///< |K x - F - C^T l| / (|F| + |C^T l|).
  double constraints = 0;   ///< Largest |phi(x) - target| of rows, of the rest shape's extent in its unit.
};

/// Movable; not thread-safe. The parameters of energies are lengths: each direction is scaled to the mean
/// length of its rows of control points (scaled_domain()), while functionals keep the surface's parameters.
class SculptSystem {
 public:
  static constexpr std::size_t max_rows = 4096;
  static constexpr double soft_yield = 1e-5;
  static constexpr int soft_rounds = 5;
  /// Curves are one direction alone: free or held at both ends.
  /// Errors: invalid_argument, naming the field; failed_precondition where the energy leaves parts loose
  /// (energy); resource_exhausted.
  static Result<SculptSystem> create(const BSplineSurface& rest, const SculptSetup& setup,
                                     const IterativeOptions& iteration = {});
  static Result<SculptSystem> create(const BSplineCurve& rest, const CurveSculptSetup& setup);

  /// Errors: invalid_argument, naming rows[i] or loads[i]; failed_precondition when loads act on a surface
  /// that nothing holds against them (supports), and for contradicting rows (rows[i]; the message names all)
  /// under ConflictPolicy::refuse; resource_exhausted above max_rows. Where rows leave a surface without
  /// supports open, it moves by the least that they demand.
  Result<SculptSolution> solve(std::span<const SculptRow> rows, std::span<const SculptLoad> loads,
                               ConflictPolicy policy);
  /// The same with the pins moved. Pins that follow from others go where those take them; how far that is
  /// from where they are to be is for the caller to see. Errors: also invalid_argument, naming fields[i].
  /// `reused`: memory for the control points, whatever it holds.
  Result<SculptSolution> solve(std::span<const SculptRow> rows, std::span<const SculptLoad> loads,
                               std::span<const SculptField> fields, ConflictPolicy policy,
                               SculptDetail detail = SculptDetail::displacement,
                               std::vector<Vec3> reused = {});
  /// Pins that follow from others or from what is held, ascending.
  std::vector<std::size_t> dependent_pins() const {
    return columns_.pinned() == nullptr ? std::vector<std::size_t>{} : columns_.pinned()->dependent();
  }

  /// The work that these loads do, as they come, on a surface held by these rows: f^T K_c^-1 f. Of a unit
  /// force g with dy = g f along it, of a unit moment the same for turning; see matching_stiffness() (D16).
  /// Errors: as solve().
  Result<double> compliance(std::span<const SculptRow> rows, std::span<const SculptLoad> loads);

  /// O(points x degree), not for every frame. Precondition: rows and loads are those of the solution.
  SculptResidual residual(std::span<const SculptRow> rows, std::span<const SculptLoad> loads,
                          const SculptSolution& solution) const;

  std::size_t unknown_count() const { return unknowns_.size(); }
  /// Substitutions so far: each functional once.
  std::size_t solved() const { return columns_.solved(); }
  StiffnessSolver::Report solver_report() const { return columns_.solver().report(); }

 private:
  using Product = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;
  using Columns = std::vector<std::shared_ptr<const SculptColumn>>;
  /// Fields of pins: their answers and amounts.
  using Moves = std::vector<std::pair<std::shared_ptr<const Eigen::VectorXd>, Vec3>>;

  /// What stays the same while only targets and forces change.
  struct Prepared {
    std::vector<SurfaceFunctional> functionals;
    std::vector<std::optional<Vec3>> along;
    std::vector<bool> soft;
    std::vector<double> yield;
    std::vector<double> soft_yield;  ///< By equation; 0 of rows that are not soft. None where no row is.
    Columns columns;
    bool coupled = false;  ///< Some row has `along`: x, y and z are one system of 3 times the size.
    std::vector<std::size_t> row_of;  ///< By equation.
    std::vector<Vec3> direction;      ///< By equation, unit; when coupled.
    ConstraintFactor factor;
    std::vector<DependentRow> dependent;
  };
  struct Answer {
    ConstraintFactor::Multipliers multipliers;
    std::vector<SculptConflict> conflicts;
    std::vector<double> off;  ///< By row; none where all are kept.
  };

  SculptSystem() = default;
  static Result<SculptSystem> finish(std::vector<Vec3> rest, SculptMode mode,
                                     std::vector<std::uint32_t> unknowns,
                                     std::unique_ptr<StiffnessSolver> solver, Eigen::MatrixXd modes,
                                     Product product);
  Status check_rows(std::span<const SculptRow> rows) const;
  Status check_loads(std::span<const SculptLoad> loads) const;
  Status prepare(std::span<const SculptRow> rows);
  Result<Answer> multipliers(std::span<const SculptRow> rows, std::span<const SculptLoad> loads,
                             const Columns& load_columns, const Moves& moves, bool at_rest,
                             ConflictPolicy policy);
  ConstraintFactor::Multipliers solve_softly(const Eigen::MatrixXd& values,
                                             const Eigen::MatrixXd& balance) const;
  static void add_soft_duplicates(Prepared& prepared);
  Eigen::VectorXd off_rows(const ConstraintFactor::Multipliers& multipliers, const Eigen::MatrixXd& values,
                           std::size_t row_count) const;
  Result<Moves> moves_of(std::span<const SculptField> fields);
  Vec3 reaction(const Answer& answer, std::size_t row) const;
  Eigen::MatrixX3d mode_amounts(const Answer& answer) const;
  Vec3 rest_value(const SurfaceFunctional& functional) const;

  ParallelFor parallel_ = run_in_turn;
  std::vector<Vec3> rest_;
  double extent_m_ = 1;  // The diagonal of the rest shape's box.
  double stiffness_norm_ = 0;
  std::size_t pin_count_ = 0;
  std::vector<std::uint32_t> unknowns_;
  Product product_;
  SculptColumns columns_;
  Eigen::MatrixX3d own_load_;      // -K rest in the absolute mode, else empty; by unknown.
  Eigen::MatrixX3d own_response_;  // K^-1 of it.
  Prepared prepared_;
  bool is_prepared_ = false;
};

}  // namespace handloft::geometry
