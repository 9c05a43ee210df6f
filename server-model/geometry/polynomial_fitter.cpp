#include "server-model/geometry/polynomial_fitter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "server-model/geometry/fit_checks.h"

namespace handloft::geometry {
namespace {

/// A point may lie this many half extents from the box's centre before the box grows: at 2 the highest
/// monomial reaches 2^6, which costs less than two digits.
constexpr double max_scaled_coordinate = 2.0;

/// An element of R's diagonal that fell below this fraction of its largest has lost half of its digits.
constexpr double min_diagonal_ratio = 1e-4;

/// Half extent of a box round a single point at the origin: nothing beside any length, and the inverse of its
/// sixth power is still a number.
constexpr double least_half_extent_m = 1e-45;

int columns_of(const FitOptions& options) {
  return detail::check_fit_options(options).ok() ? coefficient_count(options.degree) : 0;
}

/// Its sides are shorter than what solve() takes for rounding.
Box2 box_round(const Vec2& point) {
  const double eps = std::numeric_limits<double>::epsilon();
  return {point, (eps * point.cwiseAbs()).cwiseMax(least_half_extent_m)};
}

/// About the points that pull; of none, about all. Points of no weight far away would squeeze the others into
/// a corner.
Box2 box_about(std::span<const WeightedPoint> points) {
  const bool any =
      std::any_of(points.begin(), points.end(), [](const auto& point) { return point.weight > 0; });
  Vec2 lower = Vec2::Constant(std::numeric_limits<double>::infinity());
  Vec2 upper = -lower;
  for (const WeightedPoint& point : points) {
    if (any && !(point.weight > 0)) continue;
    lower = lower.cwiseMin(point.position.head<2>());
    upper = upper.cwiseMax(point.position.head<2>());
  }
  return {0.5 * (lower + upper), 0.5 * (upper - lower)};
}

/// S^T of monomials(u') = S monomials(u), u' = (x - c') / s', u = (x - c) / s: by the binomial theorem of
/// u' = a u + b. Upper triangular in the order of eq. 2.
Eigen::MatrixXd change_of_box(int degree, const Box2& from, const Box2& to) {
  using Table = std::array<std::array<double, max_degree + 1>, max_degree + 1>;
  std::array<Table, 2> expansion{};  // [axis][power of u'][power of u]
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    const double a = from.half_extent[k] / to.half_extent[k];
    const double b = (from.centre[k] - to.centre[k]) / to.half_extent[k];
    Table& table = expansion[axis];
    table[0][0] = 1;
    for (std::size_t i = 1; i <= max_degree; ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        table[i][j] = (j < i ? b * table[i - 1][j] : 0.0) + (j > 0 ? a * table[i - 1][j - 1] : 0.0);
      }
    }
  }
  const std::span<const Monomial> terms = monomials(degree);
  const auto p = static_cast<Eigen::Index>(terms.size());
  Eigen::MatrixXd upper = Eigen::MatrixXd::Zero(p, p);
  for (Eigen::Index k = 0; k < p; ++k) {
    const auto [i, j] = terms[static_cast<std::size_t>(k)];
    for (int x = 0; x <= i; ++x) {
      for (int y = 0; y <= j; ++y) {
        upper(static_cast<Eigen::Index>(monomial_index(x, y)), k) =
            expansion[0][static_cast<std::size_t>(i)][static_cast<std::size_t>(x)] *
            expansion[1][static_cast<std::size_t>(j)][static_cast<std::size_t>(y)];
      }
    }
  }
  return upper;
}

}  // namespace

PolynomialFitter::PolynomialFitter(const FitOptions& options)
    : options_(options), box_{Vec2::Zero(), Vec2::Ones()}, qr_(columns_of(options)) {}

PolynomialFitter::Slot PolynomialFitter::hold(const WeightedPoint& point, Slot slot) {
  sample(slot).point = point;
  sample(slot).live = true;
  ++live_count_;
  weighted_count_ += point.weight > 0 ? 1 : 0;
  weight_sum_ += point.weight;
  return slot;
}

PolynomialFitter::Slot PolynomialFitter::next_slot() {
  if (slot_count_ == capacity()) {
    if (chunk_count_ == shelves_.size() * shelf_chunks) shelves_.push_back(std::make_unique<Shelf>());
    chunk(chunk_count_++) = std::make_unique<Chunk>();
  }
  return slot_count_++;
}

void PolynomialFitter::make_room_for(const Vec2& lower, const Vec2& upper) {
  const Vec2 low = (lower - box_.centre).cwiseQuotient(box_.half_extent);
  const Vec2 high = (upper - box_.centre).cwiseQuotient(box_.half_extent);
  if (low.minCoeff() >= -max_scaled_coordinate && high.maxCoeff() <= max_scaled_coordinate) return;
  const Vec2 new_lower = box_.lower().cwiseMin(lower);
  const Vec2 new_upper = box_.upper().cwiseMax(upper);
  // Rounding must not make a side of the new box shorter than the old one's.
  const Box2 grown{0.5 * (new_lower + new_upper), (0.5 * (new_upper - new_lower)).cwiseMax(box_.half_extent)};
  const Eigen::MatrixXd upper_factor = change_of_box(options_.degree, box_, grown);
  qr_.transform_columns(upper_factor);
  for (Eigen::Index k = 0; k < qr_.columns(); ++k) {
    largest_diagonal_[static_cast<std::size_t>(k)] *= upper_factor(k, k);
  }
  box_ = grown;
  ++growths_;
}

void PolynomialFitter::note_diagonal() {
  for (Eigen::Index k = 0; k < qr_.columns(); ++k) {
    double& largest = largest_diagonal_[static_cast<std::size_t>(k)];
    largest = std::max(largest, std::abs(qr_.triangle()(k, k)));
  }
}

void PolynomialFitter::collect_free_slots() {
  while (slot_count_ > 0 && !sample(slot_count_ - 1).live) --slot_count_;
  while (chunk_count_ * chunk_points >= slot_count_ + chunk_points) chunk(--chunk_count_).reset();
  first_free_ = no_slot;
  for (Slot slot = slot_count_; slot-- > 0;) {
    if (sample(slot).live) continue;
    sample(slot).next_free = first_free_;
    first_free_ = slot;
  }
}

void PolynomialFitter::forget() {
  shelves_.clear();
  chunk_count_ = 0;
  slot_count_ = 0;
  first_free_ = no_slot;
  weighted_count_ = 0;
  removed_since_built_ = 0;
  weight_sum_ = 0;
  largest_diagonal_.fill(0);
  qr_ = RowQr(columns_of(options_));
  dirty_ = false;
}

void PolynomialFitter::refactor() {
  collect_free_slots();
  std::vector<WeightedPoint> live;
  live.reserve(live_count_);
  weight_sum_ = 0;
  for (Slot slot = 0; slot < slot_count_; ++slot) {
    if (!sample(slot).live) continue;
    live.push_back(sample(slot).point);
    weight_sum_ += live.back().weight;
  }
  qr_ = RowQr(columns_of(options_));
  largest_diagonal_.fill(0);
  removed_since_built_ = 0;
  dirty_ = false;
  ++refactorisations_;
  if (live.empty()) return;
  box_ = box_about(live);
  // A side without length may grow later; solve() asks whether it is one.
  box_.half_extent = box_.half_extent.cwiseMax(box_round(box_.centre).half_extent);
  detail::append_points(detail::ScaledPoints::in_box(live, box_), options_.degree, 1.0, qr_);
  note_diagonal();
}

Result<PolynomialFitter::Slot> PolynomialFitter::add(const WeightedPoint& local_point) {
  if (Status status = detail::check_fit_options(options_); !status.ok()) return status.error();
  if (Status status = detail::check_point(local_point, "point"); !status.ok()) return status.error();
  if (live_count_ == 0) {
    forget();
    box_ = box_round(local_point.position.head<2>());
  }
  Slot slot = first_free_;
  if (slot == no_slot) {
    slot = next_slot();
  } else {
    first_free_ = sample(slot).next_free;
  }
  hold(local_point, slot);
  if (dirty_) return slot;
  if (local_point.weight == 0) return slot;  // It does not pull: no row, and no say in the box.
  if (weighted_count_ == 1) box_ = box_round(local_point.position.head<2>());
  make_room_for(local_point.position.head<2>(), local_point.position.head<2>());
  std::array<double, max_coefficients + 1> row;
  detail::weighted_row(local_point, box_, options_.degree, row.data());
  qr_.add_row(row.data());
  note_diagonal();
  return slot;
}

Result<PolynomialFitter::Slot> PolynomialFitter::add(std::span<const WeightedPoint> local_points) {
  if (Status status = detail::check_fit_options(options_); !status.ok()) return status.error();
  if (Status status = detail::check_points(local_points); !status.ok()) return status.error();
  if (live_count_ == 0) forget();
  const bool few = local_points.size() < live_count_ && weighted_count_ > 0;
  const Slot first = slot_count_;
  const std::size_t weighted_before = weighted_count_;
  if (local_points.empty()) return first;
  for (const WeightedPoint& point : local_points) hold(point, next_slot());
  if (!few) {
    refactor();
    return first;
  }
  if (dirty_) return first;
  if (weighted_count_ == weighted_before) return first;  // None of them pulls.
  const Box2 added = box_about(local_points);
  make_room_for(added.lower(), added.upper());
  detail::append_points(detail::ScaledPoints::in_box(local_points, box_), options_.degree, 1.0, qr_);
  note_diagonal();
  return first;
}

Status PolynomialFitter::remove(Slot slot) {
  if (slot >= slot_count_ || !sample(slot).live) {
    return make_error(ErrorCode::not_found, fmt::format("found no point in slot {}", slot), "slot");
  }
  Sample& leaving = sample(slot);
  leaving.live = false;
  leaving.next_free = first_free_;
  first_free_ = slot;
  --live_count_;
  if (live_count_ == 0) {
    forget();
    return {};
  }
  ++removed_since_built_;
  if (removed_since_built_ > live_count_) dirty_ = true;
  if (leaving.point.weight == 0) return {};
  --weighted_count_;
  weight_sum_ -= leaving.point.weight;
  if (weighted_count_ == 0) dirty_ = true;  // The next that pulls has a box of its own.
  if (dirty_) return {};
  std::array<double, max_coefficients + 1> row;
  detail::weighted_row(leaving.point, box_, options_.degree, row.data());
  if (!qr_.remove_row(row.data())) {
    dirty_ = true;
    return {};
  }
  for (Eigen::Index k = 0; k < qr_.columns(); ++k) {
    const double kept = std::abs(qr_.triangle()(k, k));
    if (kept < min_diagonal_ratio * largest_diagonal_[static_cast<std::size_t>(k)]) dirty_ = true;
  }
  return {};
}

Result<PolynomialFit> PolynomialFitter::solve() {
  if (Status status = detail::check_fit_options(options_); !status.ok()) return status.error();
  if (dirty_) refactor();
  // A side of the box that is no more than rounding is made as long as the other, as the fit of all points at
  // once does: that no points differ along it then shows in the rank.
  Result<PolynomialFit> fit = [&] {
    const Box2 usable = detail::usable_box(box_);
    if (live_count_ == 0 || usable.half_extent == box_.half_extent) {
      return detail::solve_for_largest_degree(qr_, box_, options_, weighted_count_);
    }
    RowQr widened = qr_;
    widened.transform_columns(change_of_box(options_.degree, box_, usable));
    return detail::solve_for_largest_degree(widened, usable, options_, weighted_count_);
  }();
  if (!fit.ok()) return fit;
  fit->statistics.count = live_count_;
  if (weight_sum_ > 0) {
    fit->statistics.weighted_rms =
        qr_.residual_norm(coefficient_count(fit->surface.degree())) / std::sqrt(weight_sum_);
  }
  return fit;
}

}  // namespace handloft::geometry
