#include "server-model/geometry/sculpt_system.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "server-model/geometry/column_sum.h"

namespace handloft::geometry {

namespace {

/// A dependent row this near its target, of its scale, follows from the others but for rounding.
constexpr double follows = 1e-11;
/// A row this far off, of its scale, is a conflict where it has no tolerance of its own.
constexpr double least_conflict = 1e-9;
/// Loads on free modes below this part of all are rounding.
constexpr double least_imbalance = 1e-9;

bool same(const SurfaceFunctional& a, const SurfaceFunctional& b) {
  return a.point == b.point && a.value == b.value;
}

Error not_finite(const char* list, std::size_t i, const char* field) {
  return make_error(ErrorCode::invalid_argument, "found a number that is not finite",
                    fmt::format("{}[{}].{}", list, i, field));
}

}  // namespace

Status SculptSystem::check_rows(std::span<const SculptRow> rows) const {
  if (rows.size() > max_rows)
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {}, expected at most {}", rows.size(), max_rows), "rows");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!rows[i].target.allFinite()) return not_finite("rows", i, "target");
    if (!(rows[i].tolerance >= 0))
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected 0 or more", rows[i].tolerance),
                        fmt::format("rows[{}].tolerance", i));
    if (!(rows[i].yield >= 0) || !std::isfinite(rows[i].yield))
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected 0 or more", rows[i].yield),
                        fmt::format("rows[{}].yield", i));
    if (!rows[i].along) continue;
    const double length = rows[i].along->stableNorm();
    if (!std::isfinite(length)) return not_finite("rows", i, "along");
    if (!(length > 0))
      return make_error(ErrorCode::invalid_argument, "found no length", fmt::format("rows[{}].along", i));
  }
  return {};
}

Status SculptSystem::check_loads(std::span<const SculptLoad> loads) const {
  if (loads.size() > max_rows)
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {}, expected at most {}", loads.size(), max_rows), "loads");
  for (std::size_t i = 0; i < loads.size(); ++i)
    if (!loads[i].force.allFinite()) return not_finite("loads", i, "force");
  return {};
}

// The dense system of the rows, kept until their functionals or directions change.
Status SculptSystem::prepare(std::span<const SculptRow> rows) {
  std::vector<bool> soft;
  std::vector<double> yield;
  for (const SculptRow& row : rows) {
    soft.push_back(row.tolerance > 0 && row.yield == 0);
    yield.push_back(row.yield);
  }
  if (is_prepared_ && rows.size() == prepared_.functionals.size() && soft == prepared_.soft &&
      yield == prepared_.yield &&
      std::equal(
          rows.begin(), rows.end(), prepared_.functionals.begin(),
          [](const SculptRow& row, const SurfaceFunctional& known) { return same(row.functional, known); }) &&
      std::equal(rows.begin(), rows.end(), prepared_.along.begin(),
                 [](const SculptRow& row, const std::optional<Vec3>& known) { return row.along == known; }))
    return {};
  is_prepared_ = false;
  Prepared next;
  next.soft = std::move(soft);
  next.yield = std::move(yield);
  std::vector<const SurfaceFunctional*> functionals;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    functionals.push_back(&rows[i].functional);
    next.functionals.push_back(rows[i].functional);
    next.along.push_back(rows[i].along);
    next.coupled = next.coupled || rows[i].along.has_value();
  }
  Result<Columns> columns = columns_.get(functionals, "rows");
  if (!columns) return columns.error();
  next.columns = std::move(*columns);

  const auto m = static_cast<Eigen::Index>(rows.size());
  const Eigen::Index modes = columns_.modes().cols();
  Eigen::MatrixXd s(m, m);
  Eigen::MatrixXd b(m, modes);
  for (Eigen::Index j = 0; j < m; ++j) {
    const SculptColumn& column = *next.columns[static_cast<std::size_t>(j)];
    for (Eigen::Index i = 0; i < m; ++i) {
      const SculptColumn& row = *next.columns[static_cast<std::size_t>(i)];
      s(i, j) = row.follows_pins ? 0.0 : row.of(column.response);
    }
    s(j, j) += next.yield[static_cast<std::size_t>(j)];
    if (modes > 0) b.row(j) = column.modes;
  }
  Eigen::VectorXd soft_yields = Eigen::VectorXd::Zero(m);
  for (Eigen::Index j = 0; j < m; ++j)
    if (next.soft[static_cast<std::size_t>(j)]) soft_yields[j] = soft_yield * s(j, j);
  s.diagonal() += soft_yields;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!next.coupled) {
      next.row_of.push_back(i);
    } else if (rows[i].along) {
      next.row_of.push_back(i);
      next.direction.push_back(*rows[i].along / rows[i].along->stableNorm());
    } else {
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        next.row_of.push_back(i);
        next.direction.push_back(Vec3::Unit(axis));
      }
    }
  }
  if (next.coupled) {
    const auto equations = static_cast<Eigen::Index>(next.row_of.size());
    Eigen::MatrixXd all(equations, equations);
    Eigen::MatrixXd all_modes = Eigen::MatrixXd::Zero(equations, 3 * modes);
    for (Eigen::Index i = 0; i < equations; ++i) {
      const auto row = static_cast<Eigen::Index>(next.row_of[static_cast<std::size_t>(i)]);
      const Vec3& along = next.direction[static_cast<std::size_t>(i)];
      for (Eigen::Index j = 0; j < equations; ++j)
        all(i, j) = along.dot(next.direction[static_cast<std::size_t>(j)]) *
                    s(row, static_cast<Eigen::Index>(next.row_of[static_cast<std::size_t>(j)]));
      for (Eigen::Index mode = 0; mode < modes; ++mode)
        all_modes.row(i).segment<3>(3 * mode) = b(row, mode) * along.transpose();
    }
    next.factor = ConstraintFactor(std::move(all), std::move(all_modes));
  } else {
    next.factor = ConstraintFactor(std::move(s), std::move(b));
  }
  if (std::find(next.soft.begin(), next.soft.end(), true) != next.soft.end())
    for (const std::size_t row : next.row_of)
      next.soft_yield.push_back(soft_yields[static_cast<Eigen::Index>(row)]);
  for (std::size_t i = 0; i < next.factor.dependent().size(); ++i) {
    const std::size_t row = next.row_of[static_cast<std::size_t>(next.factor.dependent()[i])];
    if (next.dependent.empty() || next.dependent.back().row != row) next.dependent.push_back({row, {}});
    std::vector<std::size_t>& on = next.dependent.back().on;
    for (const Eigen::Index equation : next.factor.combination(i))
      on.push_back(next.row_of[static_cast<std::size_t>(equation)]);
    std::sort(on.begin(), on.end());
    on.erase(std::unique(on.begin(), on.end()), on.end());
  }
  add_soft_duplicates(next);
  prepared_ = std::move(next);
  is_prepared_ = true;
  return {};
}

Vec3 SculptSystem::rest_value(const SurfaceFunctional& functional) const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < functional.point.size(); ++i)
    sum += functional.value[i] * rest_[functional.point[i]];
  return sum;
}

// With `at_rest` the rows hold the displacement at zero, whatever their targets, and the loads are alone.
Result<SculptSystem::Answer> SculptSystem::multipliers(std::span<const SculptRow> rows,
                                                       std::span<const SculptLoad> loads,
                                                       const Columns& load_columns, const Moves& moves,
                                                       bool at_rest, ConflictPolicy policy) {
  const auto m = static_cast<Eigen::Index>(rows.size());
  const Eigen::Index modes = columns_.modes().cols();
  Eigen::MatrixX3d wanted(m, 3);
  Eigen::VectorXd scale(m);  // In each row's unit: what its rounding goes with.
  for (Eigen::Index i = 0; i < m; ++i) {
    const SculptRow& row = rows[static_cast<std::size_t>(i)];
    const SculptColumn& column = *prepared_.columns[static_cast<std::size_t>(i)];
    Vec3 open = Vec3::Zero();
    scale[i] = column.magnitude * extent_m_;
    if (!at_rest) {
      const Vec3 rest = rest_value(row.functional);
      open = row.target - rest;
      scale[i] += row.target.norm() + rest.norm();
      if (own_response_.rows() > 0)
        for (Eigen::Index axis = 0; axis < 3; ++axis) open[axis] -= column.of(own_response_.col(axis));
      for (const auto& [response, amount] : moves) open -= column.of(*response) * amount;
    }
    for (std::size_t l = 0; l < loads.size(); ++l)
      open -= column.of(load_columns[l]->response) * loads[l].force;
    wanted.row(i) = open.transpose();
  }
  Eigen::MatrixX3d mode_loads = Eigen::MatrixX3d::Zero(modes, 3);
  double all_loads = 0;
  for (std::size_t l = 0; l < loads.size(); ++l) {
    mode_loads += load_columns[l]->modes.transpose() * loads[l].force.transpose();
    all_loads += load_columns[l]->modes.cwiseAbs().sum() * loads[l].force.cwiseAbs().sum();
  }
  Eigen::MatrixXd values = wanted;
  Eigen::MatrixXd balance = mode_loads;
  if (prepared_.coupled) {
    const auto equations = static_cast<Eigen::Index>(prepared_.row_of.size());
    values.resize(equations, 1);
    for (Eigen::Index i = 0; i < equations; ++i)
      values(i, 0) = prepared_.direction[static_cast<std::size_t>(i)].dot(
          wanted.row(static_cast<Eigen::Index>(prepared_.row_of[static_cast<std::size_t>(i)])).transpose());
    balance.resize(3 * modes, 1);
    for (Eigen::Index mode = 0; mode < modes; ++mode)
      balance.block<3, 1>(3 * mode, 0) = mode_loads.row(mode).transpose();
  }
  if (prepared_.factor.unborne(balance) > least_imbalance * all_loads)
    return make_error(ErrorCode::failed_precondition,
                      "found loads that nothing bears, expected sides or constraints that hold the surface "
                      "against them",
                      "supports");

  Answer answer{solve_softly(values, balance), {}, {}};
  const bool hard_dependent = !prepared_.factor.dependent().empty();
  if (prepared_.soft_yield.empty() && !hard_dependent) return answer;
  Eigen::VectorXd off = off_rows(answer.multipliers, values, rows.size());
  const auto is_met = [&](Eigen::Index i, double part) {
    const double tolerance = rows[static_cast<std::size_t>(i)].tolerance;
    return off[i] <= (tolerance > 0 ? tolerance : part * scale[i]);
  };
  const auto find_conflicts = [&] {
    answer.conflicts.clear();
    for (Eigen::Index i = 0; i < m; ++i)
      if (!is_met(i, least_conflict)) answer.conflicts.push_back({static_cast<std::size_t>(i), off[i]});
  };
  // Rows that follow from others have no say in the solution: where they disagree, all are met as near as
  // they come.
  const bool agree =
      std::all_of(prepared_.dependent.begin(), prepared_.dependent.end(), [&](const DependentRow& row) {
        return prepared_.soft[row.row] || is_met(static_cast<Eigen::Index>(row.row), follows);
      });
  if (!agree) {
    answer.multipliers = prepared_.factor.solve_least_squares(values, balance);
    off = off_rows(answer.multipliers, values, rows.size());
  }
  find_conflicts();
  answer.off.assign(off.begin(), off.end());
  if (answer.conflicts.empty() || policy == ConflictPolicy::least_squares) return answer;
  std::vector<std::string> names;
  for (const SculptConflict& conflict : answer.conflicts)
    names.push_back(fmt::format("rows[{}] (off by {:.3g})", conflict.row, conflict.off));
  return make_error(ErrorCode::failed_precondition,
                    fmt::format("found constraints that contradict each other: {}; expected ones that can be "
                                "met together",
                                fmt::join(names, ", ")),
                    fmt::format("rows[{}]", answer.conflicts.back().row));
}

// What a soft row was off is added to what it is asked for: what the surface can do easily is soon met to
// rounding, what it can hardly do is not forced.
ConstraintFactor::Multipliers SculptSystem::solve_softly(const Eigen::MatrixXd& values,
                                                         const Eigen::MatrixXd& balance) const {
  ConstraintFactor::Multipliers found = prepared_.factor.solve(values, balance);
  if (prepared_.soft_yield.empty()) return found;
  const Eigen::Map<const Eigen::VectorXd> yield(prepared_.soft_yield.data(),
                                                static_cast<Eigen::Index>(prepared_.soft_yield.size()));
  for (int round = 1; round < soft_rounds; ++round)
    found = prepared_.factor.solve(values + yield.asDiagonal() * found.rows, balance);
  return found;
}

Eigen::VectorXd SculptSystem::off_rows(const ConstraintFactor::Multipliers& multipliers,
                                       const Eigen::MatrixXd& values, std::size_t row_count) const {
  Eigen::MatrixXd off = prepared_.factor.residual(multipliers, values);
  for (std::size_t i = 0; i < prepared_.soft_yield.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    off.row(row) -= prepared_.soft_yield[i] * multipliers.rows.row(row);
  }
  Eigen::VectorXd by_row = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(row_count));
  for (std::size_t i = 0; i < prepared_.row_of.size(); ++i)
    by_row[static_cast<Eigen::Index>(prepared_.row_of[i])] +=
        off.row(static_cast<Eigen::Index>(i)).squaredNorm();
  return by_row.cwiseSqrt();
}

// A soft row never depends on others, as it yields; the same place asked for twice is told all the same
// (D20).
void SculptSystem::add_soft_duplicates(Prepared& prepared) {
  std::map<std::pair<std::vector<std::uint32_t>, std::vector<double>>, std::size_t> known;
  for (std::size_t i = 0; i < prepared.functionals.size(); ++i) {
    if (!prepared.soft[i]) continue;
    const SurfaceFunctional& functional = prepared.functionals[i];
    const auto [first, is_new] = known.try_emplace({functional.point, functional.value}, i);
    if (!is_new && !prepared.along[i]) prepared.dependent.push_back({i, {first->second}});
  }
  std::sort(prepared.dependent.begin(), prepared.dependent.end(),
            [](const DependentRow& a, const DependentRow& b) { return a.row < b.row; });
}

Vec3 SculptSystem::reaction(const Answer& answer, std::size_t row) const {
  if (!prepared_.coupled) return answer.multipliers.rows.row(static_cast<Eigen::Index>(row)).transpose();
  Vec3 sum = Vec3::Zero();
  const auto [first, last] = std::equal_range(prepared_.row_of.begin(), prepared_.row_of.end(), row);
  for (auto at = first; at != last; ++at) {
    const auto equation = at - prepared_.row_of.begin();
    sum += answer.multipliers.rows(equation, 0) * prepared_.direction[static_cast<std::size_t>(equation)];
  }
  return sum;
}

Eigen::MatrixX3d SculptSystem::mode_amounts(const Answer& answer) const {
  if (!prepared_.coupled) return answer.multipliers.modes;
  const Eigen::Index modes = columns_.modes().cols();
  Eigen::MatrixX3d amounts(modes, 3);
  for (Eigen::Index mode = 0; mode < modes; ++mode)
    amounts.row(mode) = answer.multipliers.modes.block<3, 1>(3 * mode, 0).transpose();
  return amounts;
}

Result<SculptSolution> SculptSystem::solve(std::span<const SculptRow> rows, std::span<const SculptLoad> loads,
                                           ConflictPolicy policy) {
  return solve(rows, loads, {}, policy);
}

Result<SculptSystem::Moves> SculptSystem::moves_of(std::span<const SculptField> fields) {
  Moves moves;
  std::vector<const std::vector<double>*> weights;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (fields[i].weight.size() != pin_count_)
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {} weights, expected {}", fields[i].weight.size(), pin_count_),
                        fmt::format("fields[{}].weight", i));
    if (!fields[i].amount.allFinite()) return not_finite("fields", i, "amount");
    if (fields[i].amount.isZero(0)) continue;
    weights.push_back(&fields[i].weight);
    moves.emplace_back(nullptr, fields[i].amount);
  }
  if (weights.empty()) return moves;
  auto responses = columns_.follow(weights);
  if (!responses) return responses.error();
  for (std::size_t i = 0; i < moves.size(); ++i) moves[i].first = std::move((*responses)[i]);
  return moves;
}

Result<SculptSolution> SculptSystem::solve(std::span<const SculptRow> rows, std::span<const SculptLoad> loads,
                                           std::span<const SculptField> fields, ConflictPolicy policy,
                                           SculptDetail detail, std::vector<Vec3> reused) {
  if (const Status status = check_rows(rows); !status) return status.error();
  if (const Status status = check_loads(loads); !status) return status.error();
  if (const Status status = prepare(rows); !status) return status.error();
  std::vector<const SurfaceFunctional*> functionals;
  for (const SculptLoad& load : loads) functionals.push_back(&load.functional);
  const Result<Columns> load_columns = columns_.get(functionals, "loads");
  if (!load_columns) return load_columns.error();
  const Result<Moves> found_moves = moves_of(fields);
  if (!found_moves) return found_moves.error();
  const Moves& moves = *found_moves;
  Result<Answer> answer = multipliers(rows, loads, *load_columns, moves, false, policy);
  if (!answer) return answer.error();

  SculptSolution solution;
  solution.control = std::move(reused);
  solution.dependent = prepared_.dependent;
  solution.off = std::move(answer->off);
  solution.conflicts = std::move(answer->conflicts);
  std::vector<WeightedColumn> parts;
  for (const auto& [response, amount] : moves) parts.push_back({response->data(), amount});
  for (std::size_t l = 0; l < loads.size(); ++l)
    parts.push_back({(*load_columns)[l]->response.data(), loads[l].force});
  for (std::size_t i = 0; i < rows.size(); ++i) {
    solution.reactions.push_back(reaction(*answer, i));
    parts.push_back({prepared_.columns[i]->response.data(), solution.reactions.back()});
  }
  const Eigen::MatrixX3d amounts = mode_amounts(*answer);
  for (Eigen::Index mode = 0; mode < amounts.rows(); ++mode)
    parts.push_back({columns_.modes().col(mode).data(), amounts.row(mode).transpose()});
  const MovedPoints moved =
      move_points(rest_, unknowns_, own_response_, parts, parallel_, solution.control,
                  detail == SculptDetail::displacement ? &solution.displacement : nullptr);
  if (!moved.finite)
    return make_error(ErrorCode::invalid_argument, "found targets or forces beyond any shape", "rows");
  solution.moved = moved.any;
  solution.farthest_m = moved.farthest_m;
  return solution;
}

Result<double> SculptSystem::compliance(std::span<const SculptRow> rows, std::span<const SculptLoad> loads) {
  if (const Status status = check_rows(rows); !status) return status.error();
  if (const Status status = check_loads(loads); !status) return status.error();
  if (const Status status = prepare(rows); !status) return status.error();
  std::vector<const SurfaceFunctional*> functionals;
  for (const SculptLoad& load : loads) functionals.push_back(&load.functional);
  const Result<Columns> load_columns = columns_.get(functionals, "loads");
  if (!load_columns) return load_columns.error();
  const Result<Answer> answer =
      multipliers(rows, loads, *load_columns, {}, true, ConflictPolicy::least_squares);
  if (!answer) return answer.error();
  const Eigen::MatrixX3d amounts = mode_amounts(*answer);
  double work = 0;
  double alone = 0;  // Without the rows: what the rows' part is to be measured by.
  for (std::size_t l = 0; l < loads.size(); ++l) {
    const SculptColumn& column = *(*load_columns)[l];
    Vec3 moved = amounts.transpose() * column.modes.transpose();
    for (std::size_t i = 0; i < loads.size(); ++i)
      moved += column.of((*load_columns)[i]->response) * loads[i].force;
    alone += std::abs(moved.dot(loads[l].force));
    for (std::size_t i = 0; i < rows.size(); ++i)
      moved += column.of(prepared_.columns[i]->response) * reaction(*answer, i);
    work += moved.dot(loads[l].force);
  }
  return work > ConstraintFactor::dependence * alone ? work : 0.0;
}

}  // namespace handloft::geometry
