#include "server-model/geometry/sculpt_columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace handloft::geometry {

namespace {

/// A functional of which less than this part acts on movable points is one of held points, but for rounding.
constexpr double least_grip = 1e-9;
/// What a functional leaves of a mode, of the sum of its parts' sizes, below which it is rounding.
constexpr double mode_noise = 1e-13;
/// A functional of which pins leave less than this follows from them (ConstraintFactor::dependence).
constexpr double least_freedom = 1e-11;
/// Columns taken through the factor together.
constexpr std::size_t batch = 8;

}  // namespace

double SculptColumn::of(const Eigen::Ref<const Eigen::VectorXd>& x) const {
  double sum = 0;
  for (std::size_t i = 0; i < at.size(); ++i) sum += value[i] * x[at[i]];
  return sum;
}

SculptColumns::SculptColumns(std::unique_ptr<StiffnessSolver> solver,
                             const std::vector<std::uint32_t>& unknowns, std::size_t point_count,
                             Eigen::MatrixXd modes)
    : solver_(std::move(solver)),
      pinned_(dynamic_cast<const PinnedSolver*>(solver_.get())),
      place_(point_count, -1),
      modes_(std::move(modes)) {
  for (std::size_t i = 0; i < unknowns.size(); ++i) place_[unknowns[i]] = static_cast<Eigen::Index>(i);
}

Result<SculptColumn> SculptColumns::localise(const SurfaceFunctional& functional) const {
  if (functional.point.size() != functional.value.size())
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} values of {} control points", functional.value.size(),
                                  functional.point.size()));
  SculptColumn column;
  double grip = 0;
  for (std::size_t i = 0; i < functional.point.size(); ++i) {
    const std::uint32_t point = functional.point[i];
    const double value = functional.value[i];
    if (point >= place_.size() || (i > 0 && point <= functional.point[i - 1]))
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found control point {}, expected ascending ones below {}", point, place_.size()));
    if (!std::isfinite(value))
      return make_error(ErrorCode::invalid_argument, "found a number that is not finite");
    column.magnitude += std::abs(value);
    if (place_[point] < 0) continue;
    grip += std::abs(value);
    column.at.push_back(place_[point]);
    column.value.push_back(value + 0.0);  // No -0.
  }
  if (!std::isfinite(column.magnitude))
    return make_error(ErrorCode::invalid_argument, "found numbers beyond those of a functional");
  // What pins hold alone is left to them: its answer would be nothing but the iteration's error.
  column.follows_pins =
      pinned_ != nullptr && !column.at.empty() && pinned_->freedom(column.at, column.value) <= least_freedom;
  if (!(grip > least_grip * column.magnitude) && !column.follows_pins) {
    column.at.clear();
    column.value.clear();
  }
  column.modes = Eigen::RowVectorXd::Zero(modes_.cols());
  for (Eigen::Index mode = 0; mode < modes_.cols(); ++mode) {
    double sum = 0;
    double size = 0;
    for (std::size_t i = 0; i < column.at.size(); ++i) {
      const double part = column.value[i] * modes_(column.at[i], mode);
      sum += part;
      size += std::abs(part);
    }
    if (std::abs(sum) > mode_noise * size) column.modes[mode] = sum;
  }
  return column;
}

Status SculptColumns::make_room(std::size_t columns) {
  const std::size_t one = static_cast<std::size_t>(size()) * sizeof(double);
  std::size_t in_use = columns;
  for (const auto& [key, kept] : kept_) in_use += kept.used == now_ ? 1 : 0;
  for (const auto& [key, kept] : fields_) in_use += kept.used == now_ ? 1 : 0;
  if (in_use * one > max_bytes)
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} functionals of {} control points, expected at most {}", in_use,
                                  size(), max_bytes / one),
                      "rows");
  const auto older = [](const auto& a, const auto& b) { return a.second.used < b.second.used; };
  while ((kept_.size() + fields_.size() + columns) * one > max_bytes) {
    const auto field = std::min_element(fields_.begin(), fields_.end(), older);
    if (field != fields_.end() && field->second.used < now_) {
      fields_.erase(field);
      continue;
    }
    const auto oldest = std::min_element(kept_.begin(), kept_.end(), older);
    kept_.erase(oldest);
  }
  return {};
}

Result<std::vector<std::shared_ptr<const SculptColumn>>> SculptColumns::get(
    const std::vector<const SurfaceFunctional*>& functionals, const char* field) {
  std::vector<std::shared_ptr<const SculptColumn>> columns(functionals.size());
  ++now_;
  std::map<Key, std::shared_ptr<SculptColumn>> missing;
  for (std::size_t i = 0; i < functionals.size(); ++i) {
    Key key{functionals[i]->point, functionals[i]->value};
    if (const auto known = kept_.find(key); known != kept_.end()) {
      known->second.used = now_;
      columns[i] = known->second.column;
      continue;
    }
    if (const auto asked = missing.find(key); asked != missing.end()) {
      columns[i] = asked->second;
      continue;
    }
    Result<SculptColumn> column = localise(*functionals[i]);
    if (!column) {
      Error error = column.error();
      error.field = fmt::format("{}[{}].functional", field, i);
      return error;
    }
    auto made = std::make_shared<SculptColumn>(std::move(*column));
    columns[i] = made;
    missing.emplace(std::move(key), std::move(made));
  }
  if (missing.empty()) return columns;
  if (const Status status = make_room(missing.size()); !status) return status.error();
  for (auto next = missing.begin(); next != missing.end();) {
    std::vector<SculptColumn*> together;
    for (; next != missing.end() && together.size() < batch; ++next) {
      const bool still = next->second->at.empty() || next->second->follows_pins;
      next->second->response = Eigen::VectorXd::Zero(still ? size() : 0);
      if (!still) together.push_back(next->second.get());
    }
    if (together.empty()) continue;
    Eigen::MatrixXd loads = Eigen::MatrixXd::Zero(size(), static_cast<Eigen::Index>(together.size()));
    for (std::size_t c = 0; c < together.size(); ++c)
      for (std::size_t i = 0; i < together[c]->at.size(); ++i)
        loads(together[c]->at[i], static_cast<Eigen::Index>(c)) = together[c]->value[i];
    const Result<Eigen::MatrixXd> responses = solver_->solve(loads);
    if (!responses) return responses.error();
    for (std::size_t c = 0; c < together.size(); ++c)
      together[c]->response = responses->col(static_cast<Eigen::Index>(c));
    solved_ += together.size();
  }
  for (auto& [key, column] : missing) kept_[key] = {std::move(column), now_};
  return columns;
}

Result<std::vector<std::shared_ptr<const Eigen::VectorXd>>> SculptColumns::follow(
    const std::vector<const std::vector<double>*>& fields) {
  std::vector<std::shared_ptr<const Eigen::VectorXd>> responses;
  for (const std::vector<double>* field : fields) {
    auto known = fields_.find(*field);
    if (known == fields_.end()) {
      if (const Status status = make_room(1); !status) return status.error();
      const Eigen::Map<const Eigen::VectorXd> values(field->data(), static_cast<Eigen::Index>(field->size()));
      Result<Eigen::MatrixXd> response = pinned_->follow(values);
      if (!response) return response.error();
      ++solved_;
      // What the pins leave open moves by the least.
      if (modes_.cols() > 0) response->col(0) -= modes_ * (modes_.transpose() * response->col(0));
      known =
          fields_.emplace(*field, KeptField{std::make_shared<const Eigen::VectorXd>(response->col(0)), now_})
              .first;
    }
    known->second.used = now_;
    responses.push_back(known->second.response);
  }
  return responses;
}

}  // namespace handloft::geometry
