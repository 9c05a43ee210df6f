#include "server-model/geometry/mode_preconditioner.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <utility>

namespace handloft::geometry {

namespace {

constexpr std::size_t group_blocks = 2;                              // A task's columns of a product.
constexpr std::size_t group_columns = group_blocks * block_columns;  // Two blocks stay in a core's cache
constexpr std::size_t depth_step = 256;                              // with this many rows.

/// Free sides make vibrations couple more: worth this part of the direction's length, by measurement.
constexpr double free_side_cost = 0.05;

/// The energy as seen from the direction of the vibrations.
struct Coefficients {
  double mode_bending, mode_slope, twist, line_slope, line_bending;
};
Coefficients along(const SculptEnergy& energy, bool modes_along_u) {
  if (modes_along_u) return {energy.b11, energy.a11, 2 * energy.b12, energy.a22, energy.b22};
  return {energy.b22, energy.a22, 2 * energy.b12, energy.a11, energy.b11};
}

std::size_t round_up(std::size_t count, std::size_t step) {
  return (count + step - 1) / step * step;
}

/// Rows of a matrix by panels of eight, a panel's columns in turn; rows that do not exist are 0.
std::vector<double> in_panels(const Eigen::MatrixXd& matrix) {
  const auto rows = static_cast<std::size_t>(matrix.rows()),
             columns = static_cast<std::size_t>(matrix.cols());
  std::vector<double> result(round_up(rows, panel_lanes) * columns, 0.0);
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t k = 0; k < columns; ++k)
      result[(i / panel_lanes * columns + k) * panel_lanes + i % panel_lanes] =
          matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
  return result;
}

// The products below add to panels of a result, `stride` columns apart, in steps of rows: `pack` brings those
// of the right factor to blocks of 24 columns.
template <typename Pack>
void multiply_group(const std::vector<double>& left, std::size_t depth, std::size_t panels, const Pack& pack,
                    Lanes* result, std::size_t stride) {
  const StiffnessLoops& loops = stiffness_loops();
  std::vector<double> packed(group_blocks * depth_step * block_columns);
  for (std::size_t k = 0; k < depth; k += depth_step) {
    const std::size_t step = std::min(depth_step, depth - k);
    for (std::size_t block = 0; block < group_blocks; ++block)
      pack(k, step, block * block_columns, packed.data() + block * depth_step * block_columns);
    for (std::size_t panel = 0; panel < panels; ++panel)
      for (std::size_t block = 0; block < group_blocks; ++block)
        loops.multiply(left.data() + (panel * depth + k) * panel_lanes,
                       packed.data() + block * depth_step * block_columns, step,
                       (result + panel * stride + block * block_columns)->v.data());
  }
}

}  // namespace

Result<ModePreconditioner> ModePreconditioner::create(const StiffnessAxis& u, const StiffnessAxis& v,
                                                      const SculptEnergy& energy,
                                                      std::span<const StiffnessOperator::Tie> ties,
                                                      const ParallelFor& parallel) {
  const auto cost = [](const StiffnessAxis& axis) {
    return static_cast<double>(axis.size()) * (1 + free_side_cost * axis.free_sides);
  };
  const bool modes_along_u = cost(u) <= cost(v);
  const StiffnessAxis& modal = modes_along_u ? u : v;
  const StiffnessAxis& line = modes_along_u ? v : u;
  if (modal.size() > max_modes)
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} x {} unknowns, expected at most {} in one direction", u.size(),
                                  v.size(), max_modes),
                      "surface");
  const Coefficients c = along(energy, modes_along_u);

  ModePreconditioner result;
  result.layout_ =
      modes_along_u ? Layout{u.size(), v.size(), v.size(), 1} : Layout{v.size(), u.size(), 1, v.size()};
  result.panels_ = round_up(modal.size(), panel_lanes) / panel_lanes;
  result.padded_lines_ = round_up(line.size(), group_columns);

  const Eigen::MatrixXd slope = modal.slope.dense();
  const Eigen::MatrixXd form = c.mode_bending * modal.bending.dense() + c.mode_slope * slope;
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> eigen(form, modal.mass.dense());
  if (eigen.info() != Eigen::Success || !eigen.eigenvectors().allFinite())
    return make_error(ErrorCode::failed_precondition,
                      "the vibrations of one direction were not found, expected knots farther apart",
                      "surface");
  const Eigen::MatrixXd& vibrations = eigen.eigenvectors();
  result.from_modes_ = in_panels(vibrations);
  result.to_modes_ = in_panels(vibrations.transpose());

  if (!result.factor_lowest(line, energy, ties, vibrations, modal))
    return make_error(ErrorCode::failed_precondition,
                      "found parts that move without resistance, expected bending or stretching terms that "
                      "hold every control point to its neighbours",
                      "energy");
  const Eigen::VectorXd twist =
      c.twist * (vibrations.transpose() * slope).cwiseProduct(vibrations.transpose()).rowwise().sum();
  result.higher_.resize(result.panels_ - 1);
  std::atomic<bool> definite = true;
  parallel(result.higher_.size(), [&](std::size_t index) {
    const std::size_t reach = line.mass.reach();
    BorderedCholesky<Lanes> factor(line.size(), reach, line.mass.cyclic() ? reach : 0);
    Lanes of_mass, of_slope;
    for (std::size_t l = 0; l < panel_lanes; ++l) {
      const auto mode = static_cast<Eigen::Index>((index + 1) * panel_lanes + l);
      const bool exists = mode < vibrations.cols();
      of_mass.v[l] = exists ? std::max(eigen.eigenvalues()[mode], 0.0) : 1.0;
      of_slope.v[l] = c.line_slope + (exists ? twist[mode] : 0.0);
    }
    for (std::size_t i = 0; i < line.size(); ++i) {
      for (std::size_t j = factor.start(i); j <= i; ++j) {
        const double mass = line.mass.at(i, j), slopes = line.slope.at(i, j),
                     bending = c.line_bending * line.bending.at(i, j);
        Lanes& element = factor.at(i, j);
        for (std::size_t l = 0; l < panel_lanes; ++l)
          element.v[l] = of_mass.v[l] * mass + of_slope.v[l] * slopes + bending;
      }
    }
    if (!factor.factor()) definite = false;
    result.higher_[index] = std::move(factor);
  });
  if (!definite)
    return make_error(ErrorCode::failed_precondition,
                      "found bending without resistance, expected terms in both directions", "energy");
  return result;
}

// All couplings among the first eight vibrations, and what the ties are to them. Unknown k of line place j at
// 8 j + k, so that a panel is solved where it stands.
bool ModePreconditioner::factor_lowest(const StiffnessAxis& line, const SculptEnergy& energy,
                                       std::span<const StiffnessOperator::Tie> ties,
                                       const Eigen::MatrixXd& vibrations, const StiffnessAxis& modal) {
  const Coefficients c = along(energy, layout_.line_stride == 1);
  const auto count = static_cast<Eigen::Index>(std::min(layout_.modes, panel_lanes));
  const Eigen::MatrixXd low = vibrations.leftCols(count);
  const Eigen::MatrixXd slope = low.transpose() * modal.slope.dense() * low;
  const auto square = static_cast<Eigen::Index>(panel_lanes);
  Eigen::MatrixXd of_mass = Eigen::MatrixXd::Identity(square, square), of_slope = of_mass,
                  of_bending = of_mass;
  of_mass.topLeftCorner(count, count) =
      c.mode_bending * (low.transpose() * modal.bending.dense() * low) + c.mode_slope * slope;
  of_slope.topLeftCorner(count, count) =
      c.twist * slope + c.line_slope * Eigen::MatrixXd::Identity(count, count);
  of_bending.topLeftCorner(count, count) *= c.line_bending;

  const std::size_t reach = line.mass.reach() * panel_lanes + panel_lanes - 1;
  const std::size_t border = line.mass.cyclic() ? line.mass.reach() * panel_lanes : 0;
  double roughest = 0;
  for (std::size_t i = 0; i < line.size(); ++i)
    roughest =
        std::max(roughest, c.line_bending * line.bending.at(i, i) + c.line_slope * line.slope.at(i, i));
  // Rounding may leave what hardly resists below zero; a preconditioner may stiffen it a little.
  for (const double stiffening : {0.0, 1e-15, 1e-13, 1e-11}) {
    lowest_ = BorderedCholesky<double>(line.size() * panel_lanes, reach, border);
    for (std::size_t row = 0; row < lowest_.size(); ++row) {
      const std::size_t i = row / panel_lanes;
      const auto k = static_cast<Eigen::Index>(row % panel_lanes);
      for (std::size_t column = lowest_.start(row); column <= row; ++column) {
        const std::size_t j = column / panel_lanes;
        const auto other = static_cast<Eigen::Index>(column % panel_lanes);
        lowest_.at(row, column) = of_mass(k, other) * line.mass.at(i, j) +
                                  of_slope(k, other) * line.slope.at(i, j) +
                                  of_bending(k, other) * line.bending.at(i, j);
      }
      lowest_.at(row, row) += stiffening * roughest;
    }
    for (const StiffnessOperator::Tie& tie : ties) {
      const bool modes_first = layout_.line_stride == 1;
      const std::size_t first = modes_first ? tie.unknown / layout_.lines : tie.unknown % layout_.modes;
      const std::size_t place = modes_first ? tie.unknown % layout_.lines : tie.unknown / layout_.modes;
      const auto mode_row = low.row(static_cast<Eigen::Index>(first));
      for (Eigen::Index k = 0; k < count; ++k)
        for (Eigen::Index other = 0; other <= k; ++other)
          lowest_.at(place * panel_lanes + static_cast<std::size_t>(k),
                     place * panel_lanes + static_cast<std::size_t>(other)) +=
              tie.stiffness * mode_row[k] * mode_row[other];
    }
    if (lowest_.factor()) return true;
  }
  return false;
}

void ModePreconditioner::to_modes(std::span<const double> r, std::size_t group, Lanes* modes) const {
  const std::size_t first = group * group_columns;
  const auto pack = [&](std::size_t k, std::size_t step, std::size_t column, double* out) {
    for (std::size_t row = 0; row < step; ++row) {
      for (std::size_t j = 0; j < block_columns; ++j) {
        const std::size_t line = first + column + j;
        out[row * block_columns + j] =
            line < layout_.lines ? r[(k + row) * layout_.mode_stride + line * layout_.line_stride] : 0.0;
      }
    }
  };
  multiply_group(to_modes_, layout_.modes, panels_, pack, modes + first, padded_lines_);
}

void ModePreconditioner::from_modes(const Lanes* modes, std::size_t group, std::span<double> z) const {
  const std::size_t first = group * group_columns;
  const auto pack = [&](std::size_t k, std::size_t step, std::size_t column, double* out) {
    for (std::size_t row = 0; row < step; ++row) {
      const Lanes* from = modes + (k + row) / panel_lanes * padded_lines_ + first + column;
      for (std::size_t j = 0; j < block_columns; ++j)
        out[row * block_columns + j] = from[j].v[(k + row) % panel_lanes];
    }
  };
  std::vector<Lanes> places(panels_ * group_columns);
  multiply_group(from_modes_, layout_.modes, panels_, pack, places.data(), group_columns);
  const std::size_t columns = std::min(group_columns, layout_.lines - std::min(first, layout_.lines));
  for (std::size_t i = 0; i < layout_.modes; ++i) {
    const Lanes* from = places.data() + i / panel_lanes * group_columns;
    for (std::size_t j = 0; j < columns; ++j)
      z[i * layout_.mode_stride + (first + j) * layout_.line_stride] = from[j].v[i % panel_lanes];
  }
}

void ModePreconditioner::solve_panel(std::size_t panel, Lanes* places) const {
  if (panel == 0) {
    lowest_.solve(places->v.data());
  } else {
    higher_[panel - 1].solve(places);
  }
}

void ModePreconditioner::apply(std::span<const double> r, std::span<double> z,
                               const ParallelFor& parallel) const {
  std::vector<Lanes> modes(panels_ * padded_lines_);
  const std::size_t groups = padded_lines_ / group_columns;
  parallel(groups, [&](std::size_t group) { to_modes(r, group, modes.data()); });
  parallel(panels_, [&](std::size_t panel) { solve_panel(panel, modes.data() + panel * padded_lines_); });
  parallel(groups, [&](std::size_t group) { from_modes(modes.data(), group, z); });
}

ModeRows ModePreconditioner::rows(std::span<const SparseRow> c) const {
  ModeRows result;
  std::vector<std::vector<std::pair<std::size_t, double>>> entries;  // Of each line touched: place, value.
  result.start.push_back(0);
  for (const SparseRow& row : c) {
    std::map<std::size_t, std::vector<std::pair<std::size_t, double>>> by_line;
    for (std::size_t i = 0; i < row.at.size(); ++i) {
      const bool modes_first = layout_.line_stride == 1;
      const std::size_t place = modes_first ? row.at[i] / layout_.lines : row.at[i] % layout_.modes;
      const std::size_t line = modes_first ? row.at[i] % layout_.lines : row.at[i] / layout_.modes;
      by_line[line].emplace_back(place, row.value[i]);
    }
    for (auto& [line, places] : by_line) {
      result.line.push_back(line);
      entries.push_back(std::move(places));
    }
    result.start.push_back(result.line.size());
  }
  result.modes.resize(panels_ * entries.size());
  for (std::size_t panel = 0; panel < panels_; ++panel) {
    const double* const values = to_modes_.data() + panel * layout_.modes * panel_lanes;
    for (std::size_t e = 0; e < entries.size(); ++e) {
      Lanes& sum = result.modes[panel * entries.size() + e];
      for (const auto& [place, value] : entries[e])
        for (std::size_t l = 0; l < panel_lanes; ++l) sum.v[l] += value * values[place * panel_lanes + l];
    }
  }
  return result;
}

Eigen::MatrixXd ModePreconditioner::gram(const ModeRows& c, const ParallelFor& parallel) const {
  const auto m = static_cast<Eigen::Index>(c.size());
  const std::size_t entries = c.line.size();
  Eigen::MatrixXd result(m, m);
  parallel(c.size(), [&](std::size_t row) {
    std::vector<Lanes> sums(row + 1), places;
    for (std::size_t panel = 0; panel < panels_; ++panel) {
      const Lanes* const modes = c.modes.data() + panel * entries;
      places.assign(layout_.lines, {});
      for (std::size_t e = c.start[row]; e < c.start[row + 1]; ++e) places[c.line[e]] = modes[e];
      solve_panel(panel, places.data());
      for (std::size_t other = 0; other <= row; ++other)
        for (std::size_t e = c.start[other]; e < c.start[other + 1]; ++e)
          for (std::size_t l = 0; l < panel_lanes; ++l)
            sums[other].v[l] += modes[e].v[l] * places[c.line[e]].v[l];
    }
    for (std::size_t other = 0; other <= row; ++other) {
      double sum = 0;
      for (const double part : sums[other].v) sum += part;
      result(static_cast<Eigen::Index>(other), static_cast<Eigen::Index>(row)) = sum;
    }
  });
  for (Eigen::Index j = 0; j < m; ++j)
    for (Eigen::Index i = 0; i < j; ++i) result(j, i) = result(i, j);
  return result;
}

Eigen::VectorXd ModePreconditioner::apply_bearing(std::span<const double> r, const ModeRows& c,
                                                  const Bear& bear, std::span<double> z,
                                                  const ParallelFor& parallel) const {
  std::vector<Lanes> modes(panels_ * padded_lines_);
  const std::size_t groups = padded_lines_ / group_columns, entries = c.line.size();
  parallel(groups, [&](std::size_t group) { to_modes(r, group, modes.data()); });
  parallel(panels_, [&](std::size_t panel) { solve_panel(panel, modes.data() + panel * padded_lines_); });
  Eigen::VectorXd values(static_cast<Eigen::Index>(c.size()));
  parallel(c.size(), [&](std::size_t row) {
    Lanes sums;
    for (std::size_t panel = 0; panel < panels_; ++panel) {
      for (std::size_t e = c.start[row]; e < c.start[row + 1]; ++e) {
        const Lanes& of_row = c.modes[panel * entries + e];
        const Lanes& place = modes[panel * padded_lines_ + c.line[e]];
        for (std::size_t l = 0; l < panel_lanes; ++l) sums.v[l] += of_row.v[l] * place.v[l];
      }
    }
    double sum = 0;
    for (const double part : sums.v) sum += part;
    values[static_cast<Eigen::Index>(row)] = sum;
  });
  Eigen::VectorXd forces = bear(values);
  parallel(panels_, [&](std::size_t panel) {
    std::vector<Lanes> places(layout_.lines);
    for (std::size_t row = 0; row < c.size(); ++row) {
      const double force = forces[static_cast<Eigen::Index>(row)];
      if (force == 0) continue;
      for (std::size_t e = c.start[row]; e < c.start[row + 1]; ++e)
        for (std::size_t l = 0; l < panel_lanes; ++l)
          places[c.line[e]].v[l] += force * c.modes[panel * entries + e].v[l];
    }
    solve_panel(panel, places.data());
    Lanes* const all = modes.data() + panel * padded_lines_;
    for (std::size_t line = 0; line < layout_.lines; ++line)
      for (std::size_t l = 0; l < panel_lanes; ++l) all[line].v[l] -= places[line].v[l];
  });
  parallel(groups, [&](std::size_t group) { from_modes(modes.data(), group, z); });
  return forces;
}

}  // namespace handloft::geometry
