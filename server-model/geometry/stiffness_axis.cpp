#include "server-model/geometry/stiffness_axis.h"

#include <algorithm>
#include <cmath>

#include "server-model/geometry/stiffness_loops.h"

namespace handloft::geometry {

namespace {

/// Unknowns a task of a product: enough to be worth a task's start.
constexpr std::size_t task_unknowns = 16384;

std::ptrdiff_t offset(std::size_t row, std::size_t column, std::size_t size, bool cyclic) {
  auto d = static_cast<std::ptrdiff_t>(column) - static_cast<std::ptrdiff_t>(row);
  const auto n = static_cast<std::ptrdiff_t>(size);
  if (cyclic && 2 * d > n) d -= n;
  if (cyclic && 2 * d < -n) d += n;
  return d;
}

}  // namespace

BandMatrix::BandMatrix(const Eigen::SparseMatrix<double>& matrix, const std::vector<std::uint32_t>& chosen,
                       std::size_t reach, bool cyclic)
    : size_(chosen.size()),
      reach_(std::min(reach, size_ - 1)),
      cyclic_(cyclic),
      elements_((2 * reach_ + 1) * size_, 0.0) {
  std::vector<std::ptrdiff_t> place(static_cast<std::size_t>(matrix.rows()), -1);
  for (std::size_t i = 0; i < size_; ++i) place[chosen[i]] = static_cast<std::ptrdiff_t>(i);
  for (const std::uint32_t column : chosen) {
    for (Eigen::SparseMatrix<double>::InnerIterator at(matrix, static_cast<Eigen::Index>(column)); at; ++at) {
      const std::ptrdiff_t i = place[static_cast<std::size_t>(at.row())], j = place[column];
      if (i < 0) continue;
      const std::ptrdiff_t d =
          offset(static_cast<std::size_t>(i), static_cast<std::size_t>(j), size_, cyclic) +
          static_cast<std::ptrdiff_t>(reach_);
      elements_[static_cast<std::size_t>(d) * size_ + static_cast<std::size_t>(i)] = at.value();
    }
  }
}

double BandMatrix::at(std::size_t row, std::size_t column) const {
  const std::ptrdiff_t d = offset(row, column, size_, cyclic_);
  return static_cast<std::size_t>(std::abs(d)) > reach_ ? 0.0 : diagonal(d)[row];
}

Eigen::MatrixXd BandMatrix::dense() const {
  const auto n = static_cast<Eigen::Index>(size_);
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      result(i, j) = at(static_cast<std::size_t>(i), static_cast<std::size_t>(j));
  return result;
}

BandMatrix BandMatrix::absolute() const {
  BandMatrix result = *this;
  for (double& element : result.elements_) element = std::abs(element);
  return result;
}

bool BandMatrix::is_zero() const {
  return std::all_of(elements_.begin(), elements_.end(), [](double element) { return element == 0; });
}

BandMatrix operator+(BandMatrix a, const BandMatrix& b) {
  for (std::size_t i = 0; i < a.elements_.size(); ++i) a.elements_[i] += b.elements_[i];
  return a;
}

BandMatrix operator*(double factor, BandMatrix a) {
  for (double& element : a.elements_) element *= factor;
  return a;
}

StiffnessAxis stiffness_axis(const KnotVector& knots, Support lower, Support upper) {
  const auto held = [&](Support support) {
    return knots.is_periodic() ? std::uint32_t{0} : static_cast<std::uint32_t>(support);
  };
  std::vector<std::uint32_t> unknowns;
  for (std::uint32_t i = held(lower); i + held(upper) < static_cast<std::uint32_t>(knots.control_count());
       ++i)
    unknowns.push_back(i);
  return stiffness_axis(knots, unknowns);
}

StiffnessAxis stiffness_axis(const KnotVector& knots, const std::vector<std::uint32_t>& unknowns) {
  const bool periodic = knots.is_periodic();
  const auto degree = static_cast<std::size_t>(knots.degree());
  // Few functions round a period meet both ways: all of them are then within reach without counting round.
  const bool cyclic = periodic && unknowns.size() > 2 * degree + 1;
  const std::size_t reach = periodic && !cyclic ? unknowns.size() : degree;
  const auto part = [&](int a, int b) {
    return BandMatrix(gram_matrix(knots, a, b), unknowns, reach, cyclic);
  };
  StiffnessAxis axis;
  axis.mass = part(0, 0);
  axis.slope = part(1, 1);
  axis.bending = part(2, 2);
  axis.slope_value = part(1, 0);
  axis.value_slope = part(0, 1);
  const auto last = static_cast<std::uint32_t>(knots.control_count() - 1);
  if (!periodic) axis.free_sides = (unknowns.front() == 0 ? 1 : 0) + (unknowns.back() == last ? 1 : 0);
  axis.length = knots.length();
  return axis;
}

StiffnessOperator::StiffnessOperator(const StiffnessAxis& u, const StiffnessAxis& v,
                                     const SculptEnergy& energy, std::vector<Tie> ties)
    : rows_(u.size()), columns_(v.size()), ties_(std::move(ties)) {
  const auto add = [this](BandMatrix left, const BandMatrix& right) {
    if (!left.is_zero()) terms_.push_back({std::move(left), right});
  };
  add(energy.b11 * u.bending + energy.a11 * u.slope, v.mass);
  add(2 * energy.b12 * u.slope + energy.a22 * u.mass, v.slope);
  add(energy.b22 * u.mass, v.bending);
  add(energy.a12 * u.slope_value, v.value_slope);
  add(energy.a12 * u.value_slope, v.slope_value);
}

void StiffnessOperator::apply_rows(std::size_t first, std::size_t last, const double* x, double* y) const {
  const StiffnessLoops& loops = stiffness_loops();
  std::vector<double> padded;
  std::vector<const double*> rows;
  std::vector<double> weights;
  std::vector<const double*> bands;
  for (std::size_t i = first; i < last; ++i) {
    double* out = y + i * columns_;
    std::fill(out, out + columns_, 0.0);
    for (const Term& term : terms_) {
      rows.clear();
      weights.clear();
      const auto reach = static_cast<std::ptrdiff_t>(term.u.reach());
      const auto count = static_cast<std::ptrdiff_t>(rows_);
      for (std::ptrdiff_t d = -reach; d <= reach; ++d) {
        std::ptrdiff_t row = static_cast<std::ptrdiff_t>(i) + d;
        if (term.u.cyclic()) row = (row + count) % count;
        if (row < 0 || row >= count) continue;
        rows.push_back(x + static_cast<std::size_t>(row) * columns_);
        weights.push_back(term.u.diagonal(d)[i]);
      }
      const std::size_t pad = term.v.reach();
      padded.assign(columns_ + 2 * pad, 0.0);
      double* middle = padded.data() + pad;
      loops.combine(rows.data(), weights.data(), rows.size(), columns_, middle);
      if (term.v.cyclic()) {
        for (std::size_t k = 0; k < pad; ++k) {
          padded[k] = middle[columns_ - pad + k];
          middle[columns_ + k] = middle[k];
        }
      }
      bands.clear();
      for (std::size_t d = 0; d <= 2 * pad; ++d)
        bands.push_back(term.v.diagonal(static_cast<std::ptrdiff_t>(d) - static_cast<std::ptrdiff_t>(pad)));
      loops.add_band(bands.data(), bands.size(), padded.data(), columns_, out);
    }
  }
}

void StiffnessOperator::apply(std::span<const double> x, std::span<double> y,
                              const ParallelFor& parallel) const {
  const std::size_t rows_a_task = std::max<std::size_t>(1, task_unknowns / columns_);
  const std::size_t tasks = (rows_ + rows_a_task - 1) / rows_a_task;
  parallel(tasks, [&](std::size_t task) {
    apply_rows(task * rows_a_task, std::min(rows_, (task + 1) * rows_a_task), x.data(), y.data());
  });
  for (const Tie& tie : ties_) y[tie.unknown] += tie.stiffness * x[tie.unknown];
}

StiffnessOperator StiffnessOperator::absolute() const {
  StiffnessOperator result = *this;
  for (Term& term : result.terms_) term = {term.u.absolute(), term.v.absolute()};
  for (Tie& tie : result.ties_) tie.stiffness = std::abs(tie.stiffness);
  return result;
}

}  // namespace handloft::geometry
