#include "server-model/geometry/constraint_factor.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace handloft::geometry {

namespace {

/// Singular values of B below this part of the largest are modes that the rows do not pin.
constexpr double least_pinned = 1e-8;
/// Coefficients below this part of the largest are rounding, not part of a combination.
constexpr double least_coefficient = 1e-6;
/// Pivots that reach this part of the largest are as good: the first row is taken, so that of duplicates it
/// is the later ones that follow from the first.
constexpr double first_of_equals = 1 - 1e-6;
constexpr int refinements = 2;
/// Columns eliminated before what comes after them is brought up to date.
constexpr Eigen::Index block = 64;

}  // namespace

ConstraintFactor::ConstraintFactor(Eigen::MatrixXd s, Eigen::MatrixXd b, std::vector<bool> soft)
    : s_(std::move(s)), b_(std::move(b)), soft_(std::move(soft)) {
  if (std::find(soft_.begin(), soft_.end(), true) == soft_.end()) soft_.clear();
  const Eigen::Index m = s_.rows();
  scale_.resize(m);
  for (Eigen::Index i = 0; i < m; ++i) scale_[i] = s_(i, i) > 0 ? std::sqrt(s_(i, i)) : 1.0;
  scaled_.resize(m, m);
  for (Eigen::Index j = 0; j < m; ++j)
    for (Eigen::Index i = 0; i <= j; ++i) scaled_(i, j) = scaled_(j, i) = s_(i, j) / (scale_[i] * scale_[j]);
  scaled_b_ = scale_.cwiseInverse().asDiagonal() * b_;
  choose_anchors();
  factorise();
}

void ConstraintFactor::choose_anchors() {
  const Eigen::Index m = rows();
  Eigen::Index pinned = 0;
  if (modes() > 0 && m > 0 && scaled_b_.cwiseAbs().maxCoeff() > 0) {
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled_b_, Eigen::ComputeThinU | Eigen::ComputeFullV);
    const auto& values = svd.singularValues();
    while (pinned < values.size() && values[pinned] > least_pinned * values[0]) ++pinned;
    pinned_ = svd.matrixV().leftCols(pinned);
  } else {
    pinned_.resize(modes(), 0);
  }
  scaled_b_ = (scaled_b_ * pinned_).eval();
  std::vector<bool> is_anchor(static_cast<std::size_t>(m), false);
  if (pinned > 0) {
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> order(scaled_b_.transpose());
    for (Eigen::Index i = 0; i < pinned; ++i)
      is_anchor[static_cast<std::size_t>(order.colsPermutation().indices()[i])] = true;
  }
  for (Eigen::Index i = 0; i < m; ++i)
    (is_anchor[static_cast<std::size_t>(i)] ? anchors_ : others_).push_back(i);
  if (pinned > 0) {
    anchor_inverse_ = Eigen::MatrixXd(scaled_b_(anchors_, Eigen::all)).inverse();
    by_anchors_ = scaled_b_(others_, Eigen::all) * anchor_inverse_;
  } else {
    by_anchors_.resize(static_cast<Eigen::Index>(others_.size()), 0);
  }
}

// Cholesky with diagonal pivots of E S E^T, E = [-T I]: the rows freed of the modes.
void ConstraintFactor::factorise() {
  const auto count = static_cast<Eigen::Index>(others_.size());
  Eigen::VectorXd noise(count);  // What rounding can leave on the diagonal goes with what was subtracted.
  noise.setConstant(dependence);
  if (anchors_.empty()) {
    lower_ = std::move(scaled_);
  } else {
    lower_ = scaled_(others_, others_);
    const Eigen::MatrixXd mixed = by_anchors_ * scaled_(anchors_, others_);
    lower_ += by_anchors_ * scaled_(anchors_, anchors_) * by_anchors_.transpose() - mixed - mixed.transpose();
    noise += dependence * by_anchors_.rowwise().squaredNorm();
  }
  for (Eigen::Index i = 0; i < count; ++i)
    if (is_soft(others_[static_cast<std::size_t>(i)])) noise[i] *= soft_dependence / dependence;
  place_of_.resize(others_.size());
  order_.resize(others_.size());
  std::iota(order_.begin(), order_.end(), Eigen::Index{0});
  eliminate(std::move(noise));
  for (std::size_t i = 0; i < order_.size(); ++i)
    place_of_[static_cast<std::size_t>(order_[i])] = static_cast<Eigen::Index>(i);
  kept_ = anchors_;
  for (const Eigen::Index pivot : pivots_) kept_.push_back(others_[static_cast<std::size_t>(pivot)]);
  std::sort(kept_.begin(), kept_.end());
  for (Eigen::Index i = 0; i < rows(); ++i)
    if (!std::binary_search(kept_.begin(), kept_.end(), i)) dependent_.push_back(i);
}

// Column by column within blocks, what comes after them at once (LAPACK's xPSTRF; Lucas 2004): most of the
// work is one product of matrices a block.
void ConstraintFactor::eliminate(Eigen::VectorXd noise) {
  const Eigen::Index count = lower_.rows();
  Eigen::VectorXd open = lower_.diagonal();
  Eigen::Index rank = 0;
  bool is_done = false;
  while (rank < count && !is_done) {
    const Eigen::Index first = rank;
    const Eigen::Index end = std::min(count, first + block);
    for (; rank < end; ++rank) {
      const Eigen::Index pivot = next_pivot(open, noise, rank);
      if (pivot < 0) {
        is_done = true;
        break;
      }
      swap_rows(rank, pivot);
      std::swap(open[rank], open[pivot]);
      std::swap(noise[rank], noise[pivot]);
      const double root = std::sqrt(open[rank]);
      lower_(rank, rank) = root;
      const Eigen::Index below = count - rank - 1;
      const Eigen::Index within = rank - first;
      auto column = lower_.col(rank).tail(below);
      if (within > 0)
        column.noalias() -= lower_.block(rank + 1, first, below, within) *
                            lower_.row(rank).segment(first, within).transpose();
      column /= root;
      open.tail(below) -= column.cwiseAbs2();
    }
    const Eigen::Index after = count - rank;
    if (after > 0 && !is_done) {
      lower_.bottomRightCorner(after, after)
          .selfadjointView<Eigen::Lower>()
          .rankUpdate(lower_.block(rank, first, after, rank - first), -1.0);
    }
  }
  lower_.triangularView<Eigen::StrictlyUpper>().setZero();
  if (rank < count) lower_.conservativeResize(Eigen::NoChange, rank);
  pivots_.assign(order_.begin(), order_.begin() + rank);
}

// The largest of hard rows, then of soft ones; of equals the first as they were given. -1: rounding is all
// that is left.
Eigen::Index ConstraintFactor::next_pivot(const Eigen::VectorXd& open, const Eigen::VectorXd& noise,
                                          Eigen::Index from) const {
  const auto given = [this](Eigen::Index i) { return order_[static_cast<std::size_t>(i)]; };
  for (const bool softly : {false, true}) {
    const auto can_be = [&](Eigen::Index i) {
      return open[i] > noise[i] && is_soft(others_[static_cast<std::size_t>(given(i))]) == softly;
    };
    double largest = 0;
    for (Eigen::Index i = from; i < open.size(); ++i)
      if (can_be(i)) largest = std::max(largest, open[i]);
    Eigen::Index pivot = -1;
    for (Eigen::Index i = from; i < open.size(); ++i)
      if (can_be(i) && open[i] >= first_of_equals * largest && (pivot < 0 || given(i) < given(pivot)))
        pivot = i;
    if (pivot >= 0) return pivot;
  }
  return -1;
}

// Of the lower half. Precondition: a <= b.
void ConstraintFactor::swap_rows(Eigen::Index a, Eigen::Index b) {
  if (a == b) return;
  std::swap(order_[static_cast<std::size_t>(a)], order_[static_cast<std::size_t>(b)]);
  const Eigen::Index after = lower_.rows() - b - 1;
  std::swap(lower_(a, a), lower_(b, b));
  lower_.row(a).head(a).swap(lower_.row(b).head(a));
  lower_.col(a).tail(after).swap(lower_.col(b).tail(after));
  for (Eigen::Index i = a + 1; i < b; ++i) std::swap(lower_(i, a), lower_(b, i));
}

std::vector<Eigen::Index> ConstraintFactor::combination(std::size_t at) const {
  const Eigen::Index row = dependent_[at];
  if (!(s_(row, row) > 0)) return {};
  const Eigen::Index place = std::lower_bound(others_.begin(), others_.end(), row) - others_.begin();
  // others[place] = sum_i a_i others[pivots_i] + anchors.
  Eigen::VectorXd by_pivots(0);
  if (!pivots_.empty()) {
    by_pivots = triangle().transpose().triangularView<Eigen::Upper>().solve(
        Eigen::VectorXd(lower_.row(place_of_[static_cast<std::size_t>(place)]).transpose()));
  }
  Eigen::VectorXd by_anchor(0);
  if (!anchors_.empty()) {
    by_anchor = by_anchors_.row(place).transpose();
    for (std::size_t i = 0; i < pivots_.size(); ++i)
      by_anchor -= by_pivots[static_cast<Eigen::Index>(i)] * by_anchors_.row(pivots_[i]).transpose();
  }
  double largest = 0;
  if (by_pivots.size() > 0) largest = by_pivots.cwiseAbs().maxCoeff();
  if (by_anchor.size() > 0) largest = std::max(largest, by_anchor.cwiseAbs().maxCoeff());
  Rows rows_of;
  for (std::size_t i = 0; i < pivots_.size(); ++i)
    if (std::abs(by_pivots[static_cast<Eigen::Index>(i)]) > least_coefficient * largest)
      rows_of.push_back(others_[static_cast<std::size_t>(pivots_[i])]);
  for (std::size_t i = 0; i < anchors_.size(); ++i)
    if (std::abs(by_anchor[static_cast<Eigen::Index>(i)]) > least_coefficient * largest)
      rows_of.push_back(anchors_[i]);
  std::sort(rows_of.begin(), rows_of.end());
  return rows_of;
}

Eigen::MatrixXd ConstraintFactor::borne(const Eigen::MatrixXd& mode_loads) const {
  return -(pinned_.transpose() * mode_loads);
}

double ConstraintFactor::unborne(const Eigen::MatrixXd& mode_loads) const {
  if (mode_loads.size() == 0) return 0;
  return (mode_loads - pinned_ * (pinned_.transpose() * mode_loads)).cwiseAbs().maxCoeff();
}

// All in scaled rows: S l + B c = d on the kept ones, B^T l = h.
ConstraintFactor::Multipliers ConstraintFactor::step(const Eigen::MatrixXd& d,
                                                     const Eigen::MatrixXd& h) const {
  Multipliers result{Eigen::MatrixXd::Zero(rows(), d.cols()),
                     Eigen::MatrixXd::Zero(pinned_.cols(), d.cols())};
  if (!anchors_.empty()) result.rows(anchors_, Eigen::all) = anchor_inverse_.transpose() * h;
  Eigen::MatrixXd open = d;
  if (!anchors_.empty()) open -= scaled_ * result.rows;
  if (!pivots_.empty()) {
    Eigen::MatrixXd right = open(others_, Eigen::all);
    if (!anchors_.empty()) right -= by_anchors_ * open(anchors_, Eigen::all);
    Eigen::MatrixXd amounts = right(pivots_, Eigen::all);
    triangle().triangularView<Eigen::Lower>().solveInPlace(amounts);
    triangle().transpose().triangularView<Eigen::Upper>().solveInPlace(amounts);
    for (std::size_t i = 0; i < pivots_.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      result.rows.row(others_[static_cast<std::size_t>(pivots_[i])]) += amounts.row(row);
      if (!anchors_.empty())
        result.rows(anchors_, Eigen::all) -= by_anchors_.row(pivots_[i]).transpose() * amounts.row(row);
    }
  }
  if (!anchors_.empty()) result.modes = anchor_inverse_ * (d - scaled_ * result.rows)(anchors_, Eigen::all);
  return result;
}

// Responses that the kept rows can bring about: those of the anchors at will, those of the others theirs
// through T, and beside that the span of the Cholesky factor.
ConstraintFactor::Multipliers ConstraintFactor::least_squares_step(const Eigen::MatrixXd& d,
                                                                   const Eigen::MatrixXd& h) const {
  Multipliers result{Eigen::MatrixXd::Zero(rows(), d.cols()),
                     Eigen::MatrixXd::Zero(pinned_.cols(), d.cols())};
  if (!anchors_.empty()) result.rows(anchors_, Eigen::all) = anchor_inverse_.transpose() * h;
  const auto pinned = static_cast<Eigen::Index>(anchors_.size());
  Eigen::MatrixXd right(rows(), d.cols());
  right.topRows(pinned) = d(anchors_, Eigen::all);
  right.bottomRows(rows() - pinned) = d(others_, Eigen::all);
  if (!anchors_.empty()) {
    const Eigen::MatrixXd before = scaled_ * result.rows;
    right.bottomRows(rows() - pinned) -=
        before(others_, Eigen::all) - by_anchors_ * before(anchors_, Eigen::all);
  }
  const Eigen::MatrixXd response =
      spanned_.cols() > 0 ? Eigen::MatrixXd(responses_.solve(right)) : Eigen::MatrixXd::Zero(0, right.cols());
  Eigen::MatrixXd amounts = response.bottomRows(response.rows() - pinned);
  triangle().transpose().triangularView<Eigen::Upper>().solveInPlace(amounts);
  for (std::size_t i = 0; i < pivots_.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    result.rows.row(others_[static_cast<std::size_t>(pivots_[i])]) += amounts.row(row);
    if (!anchors_.empty())
      result.rows(anchors_, Eigen::all) -= by_anchors_.row(pivots_[i]).transpose() * amounts.row(row);
  }
  if (!anchors_.empty())
    result.modes =
        anchor_inverse_ * (response.topRows(pinned) - (scaled_ * result.rows)(anchors_, Eigen::all));
  return result;
}

ConstraintFactor::Multipliers ConstraintFactor::unscaled(const Multipliers& scaled) const {
  return {scale_.cwiseInverse().asDiagonal() * scaled.rows, pinned_ * scaled.modes};
}

template <typename Step>
ConstraintFactor::Multipliers ConstraintFactor::refined(const Eigen::MatrixXd& values,
                                                        const Eigen::MatrixXd& mode_loads,
                                                        const Step& step) const {
  const Eigen::MatrixXd h = borne(mode_loads);
  Multipliers scaled = step(scale_.cwiseInverse().asDiagonal() * values, h);
  for (int i = 0; i < refinements; ++i) {
    const Eigen::MatrixXd off =
        scale_.cwiseInverse().asDiagonal() * Eigen::MatrixXd(-residual(unscaled(scaled), values));
    const Multipliers correction = step(off, h - scaled_b_.transpose() * scaled.rows);
    scaled.rows += correction.rows;
    scaled.modes += correction.modes;
  }
  return unscaled(scaled);
}

ConstraintFactor::Multipliers ConstraintFactor::solve(const Eigen::MatrixXd& values,
                                                      const Eigen::MatrixXd& mode_loads) const {
  return refined(values, mode_loads,
                 [this](const Eigen::MatrixXd& d, const Eigen::MatrixXd& h) { return step(d, h); });
}

void ConstraintFactor::prepare_least_squares() {
  if (has_responses_) return;
  has_responses_ = true;
  const auto pinned = static_cast<Eigen::Index>(anchors_.size());
  const auto free = static_cast<Eigen::Index>(pivots_.size());
  spanned_ = Eigen::MatrixXd::Zero(rows(), pinned + free);
  if (spanned_.cols() == 0) return;  // No row has any effect.
  spanned_.topLeftCorner(pinned, pinned).setIdentity();
  spanned_.bottomLeftCorner(rows() - pinned, pinned) = by_anchors_;
  for (Eigen::Index i = 0; i < lower_.rows(); ++i)
    spanned_.row(pinned + order_[static_cast<std::size_t>(i)]).tail(free) = lower_.row(i);
  responses_.compute(spanned_);
}

ConstraintFactor::Multipliers ConstraintFactor::solve_least_squares(const Eigen::MatrixXd& values,
                                                                    const Eigen::MatrixXd& mode_loads) {
  prepare_least_squares();
  return refined(values, mode_loads, [this](const Eigen::MatrixXd& d, const Eigen::MatrixXd& h) {
    return least_squares_step(d, h);
  });
}

Eigen::MatrixXd ConstraintFactor::residual(const Multipliers& multipliers,
                                           const Eigen::MatrixXd& values) const {
  return s_ * multipliers.rows + b_ * multipliers.modes - values;
}

}  // namespace handloft::geometry
