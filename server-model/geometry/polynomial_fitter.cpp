#include <fmt/format.h>

#include <array>
#include <cmath>

#include "server-model/geometry/fit_checks.h"
#include "server-model/geometry/polynomial_fit.h"

namespace handloft::geometry {
namespace {

/// A point may lie this many half extents from the box's centre before the variables are scaled anew: at 2
/// the highest monomial reaches 2^6, which costs less than two digits.
constexpr double max_scaled_coordinate = 2.0;

int columns_of(const FitOptions& options) {
  return detail::check_fit_options(options).ok() ? coefficient_count(options.degree) : 0;
}

}  // namespace

PolynomialFitter::PolynomialFitter(const FitOptions& options)
    : options_(options), box_{Vec2::Zero(), Vec2::Ones()}, qr_(columns_of(options)) {}

bool PolynomialFitter::outgrows_box(const WeightedPoint& point) const {
  const Vec2 uv = (point.position.head<2>() - box_.centre).cwiseQuotient(box_.half_extent);
  return uv.cwiseAbs().maxCoeff() > max_scaled_coordinate;
}

void PolynomialFitter::row_of(const WeightedPoint& point, double* row) const {
  detail::weighted_row(point, box_, options_.degree, row, 1);
}

void PolynomialFitter::refactor() {
  std::vector<WeightedPoint> live;
  live.reserve(live_count_);
  weight_sum_ = 0;
  for (const Sample& sample : samples_) {
    if (!sample.live) continue;
    live.push_back(sample.point);
    weight_sum_ += sample.point.weight;
  }
  box_ = detail::scaling_box(live);
  qr_ = RowQr(columns_of(options_));
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(live.size()), qr_.columns() + 1);
  for (std::size_t i = 0; i < live.size(); ++i) {
    detail::weighted_row(live[i], box_, options_.degree, rows.data() + i, rows.outerStride());
  }
  qr_.append(rows);
  ++refactorisations_;
}

Result<PolynomialFitter::Slot> PolynomialFitter::add(const WeightedPoint& local_point) {
  if (Status status = detail::check_fit_options(options_); !status.ok()) return status.error();
  if (Status status = detail::check_point(local_point, "point"); !status.ok()) return status.error();
  const Slot slot = samples_.size();
  samples_.push_back({local_point, true});
  ++live_count_;
  weight_sum_ += local_point.weight;
  // The first points define the box: with fewer than a plane needs there is nothing worth keeping.
  if (live_count_ <= 3 || outgrows_box(local_point)) {
    refactor();
    return slot;
  }
  std::array<double, max_coefficients + 1> row;
  row_of(local_point, row.data());
  qr_.add_row(row.data());
  return slot;
}

Result<PolynomialFitter::Slot> PolynomialFitter::add(std::span<const WeightedPoint> local_points) {
  if (Status status = detail::check_fit_options(options_); !status.ok()) return status.error();
  if (Status status = detail::check_points(local_points); !status.ok()) return status.error();
  const Slot first = samples_.size();
  for (const WeightedPoint& point : local_points) samples_.push_back({point, true});
  live_count_ += local_points.size();
  refactor();
  return first;
}

Status PolynomialFitter::remove(Slot slot) {
  if (slot >= samples_.size() || !samples_[slot].live) {
    return make_error(ErrorCode::not_found, fmt::format("found no point in slot {}", slot), "slot");
  }
  samples_[slot].live = false;
  --live_count_;
  weight_sum_ -= samples_[slot].point.weight;
  std::array<double, max_coefficients + 1> row;
  row_of(samples_[slot].point, row.data());
  if (!qr_.remove_row(row.data())) refactor();
  return {};
}

Result<PolynomialFit> PolynomialFitter::solve() const {
  if (Status status = detail::check_fit_options(options_); !status.ok()) return status.error();
  std::size_t weighted_points = 0;
  if (live_count_ < static_cast<std::size_t>(qr_.columns())) {  // Few: count them exactly for the message.
    for (const Sample& sample : samples_) weighted_points += sample.live && sample.point.weight > 0 ? 1 : 0;
  } else {
    weighted_points = live_count_;
  }
  Result<PolynomialFit> fit = detail::solve_for_largest_degree(qr_, box_, options_, weighted_points);
  if (!fit.ok()) return fit;
  fit->statistics.count = live_count_;
  if (weight_sum_ > 0) {
    fit->statistics.weighted_rms =
        qr_.residual_norm(coefficient_count(fit->surface.degree())) / std::sqrt(weight_sum_);
  }
  return fit;
}

}  // namespace handloft::geometry
