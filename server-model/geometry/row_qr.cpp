#include "server-model/geometry/row_qr.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace handloft::geometry {
namespace {

/// Rows per block: 256 rows of 29 doubles are 58 KB and stay in the second-level cache with their triangle.
constexpr Eigen::Index block_rows = 256;

/// For more columns than a surface of degree 6 has, the pivoted factorisation decides.
constexpr std::size_t max_proof_columns = 32;

/// Downdating loses digits as 1 / alpha; below this more than half of them (8 of 16) are gone.
constexpr double min_downdate_alpha = 1e-4;

/// Householder QR in place of [triangle; block], column by column (the structure of the triangle is used: a
/// reflection touches one row of it and the whole block). Costs 4 m p^2 / 2 flops for m rows.
void annihilate(Eigen::MatrixXd& triangle, Eigen::Ref<Eigen::MatrixXd> block, Eigen::VectorXd& workspace) {
  const Eigen::Index columns = triangle.cols();
  for (Eigen::Index k = 0; k < columns; ++k) {
    auto below = block.col(k);
    const double tail = below.squaredNorm();
    if (tail == 0) continue;
    const double head = triangle(k, k);
    const double norm = std::sqrt(head * head + tail);
    const double beta = head >= 0 ? -norm : norm;
    // v = (head - beta, below); H = I - tau v v^T with v scaled so that v_0 = 1.
    const double v0 = head - beta;
    const double tau = -v0 / beta;
    triangle(k, k) = beta;
    const Eigen::Index rest = columns - k - 1;
    if (rest == 0) break;
    const double inverse = 1 / v0;
    if (!std::isfinite(inverse)) {
      below /= v0;
    } else {
      below *= inverse;
    }
    auto trailing = block.rightCols(rest);
    auto top = triangle.row(k).tail(rest);
    auto projection = workspace.head(rest);
    projection.noalias() = trailing.transpose() * below;
    projection = tau * (projection + top.transpose());
    top -= projection.transpose();
    trailing.noalias() -= below * projection.transpose();
  }
}

/// A proof in O(p^2) that upper triangular r has rank p at this relative threshold, or false: |r^-1| is at
/// most that of the comparison matrix (Higham, Accuracy and Stability, 2nd ed., section 8.2), whose inverse
/// times the vector of ones is one substitution. The smallest pivot is at least the smallest singular value,
/// and the largest the largest column.
bool surely_full_rank(const Eigen::Ref<const Eigen::MatrixXd>& r, double threshold) {
  const Eigen::Index p = r.cols();
  std::array<double, max_proof_columns> x{};
  if (p > static_cast<Eigen::Index>(x.size())) return false;
  double inverse_norm = 0;  // Of rows: the infinity norm.
  double largest_column = 0;
  for (Eigen::Index i = p - 1; i >= 0; --i) x[static_cast<std::size_t>(i)] = 1;
  for (Eigen::Index j = p - 1; j >= 0; --j) {
    const double diagonal = std::abs(r(j, j));
    if (!(diagonal > 0)) return false;
    const double xj = x[static_cast<std::size_t>(j)] / diagonal;
    inverse_norm = std::max(inverse_norm, xj);
    double square = diagonal * diagonal;
    for (Eigen::Index i = 0; i < j; ++i) {
      x[static_cast<std::size_t>(i)] += std::abs(r(i, j)) * xj;
      square += r(i, j) * r(i, j);
    }
    largest_column = std::max(largest_column, square);
  }
  // |r^-1|_2 <= sqrt(p) |r^-1|_inf; twice, against rounding here and in the pivoted factorisation.
  const double bound = 2 * std::sqrt(static_cast<double>(p)) * inverse_norm * std::sqrt(largest_column);
  return bound * threshold < 1;  // False for NaN and infinity, too.
}

}  // namespace

RowQr::RowQr(int columns) : columns_(columns), triangle_(Eigen::MatrixXd::Zero(columns + 1, columns + 1)) {
  assert(columns >= 0);
}

void RowQr::append(Eigen::Ref<Eigen::MatrixXd> rows) {
  assert(rows.cols() == columns_ + 1);
  Eigen::VectorXd workspace(columns_ + 1);
  for (Eigen::Index begin = 0; begin < rows.rows(); begin += block_rows) {
    annihilate(triangle_, rows.middleRows(begin, std::min(block_rows, rows.rows() - begin)), workspace);
  }
  rows_ += static_cast<std::size_t>(rows.rows());
}

void RowQr::add_row(double* row) {
  const Eigen::Index size = columns_ + 1;
  for (Eigen::Index k = 0; k < size; ++k) {
    if (row[k] == 0) continue;
    const double norm = std::hypot(triangle_(k, k), row[k]);
    const double c = triangle_(k, k) / norm;
    const double s = row[k] / norm;
    triangle_(k, k) = norm;
    for (Eigen::Index j = k + 1; j < size; ++j) {
      const double upper = triangle_(k, j);
      triangle_(k, j) = c * upper + s * row[j];
      row[j] = c * row[j] - s * upper;
    }
  }
  ++rows_;
}

bool RowQr::remove_row(const double* row) {
  // LINPACK's xCHDD (Saunders): solve R^T q = a over the columns of A, alpha^2 = 1 - |q|^2; then rotations
  // that take (q, alpha) to the unit vector turn R into the triangle without the row.
  const Eigen::Index p = columns_;
  const auto r = triangle_.topLeftCorner(p, p);
  Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(row, p);
  for (Eigen::Index k = 0; k < p; ++k) {
    if (r(k, k) == 0) return false;
  }
  r.triangularView<Eigen::Upper>().transpose().solveInPlace(q);
  const double norm = q.norm();
  if (!(norm < 1)) return false;
  const double alpha = std::sqrt((1 - norm) * (1 + norm));
  if (alpha < min_downdate_alpha) return false;

  // The residual of the removed row: its part of b that the others' solution leaves, over alpha.
  const double zeta = (row[p] - q.dot(triangle_.col(p).head(p))) / alpha;
  const double rho = std::abs(triangle_(p, p));
  const double rho2 = (rho - std::abs(zeta)) * (rho + std::abs(zeta));
  if (rho2 < -1e-8 * rho * rho) return false;

  Eigen::MatrixXd next = triangle_;
  Eigen::VectorXd removed = Eigen::VectorXd::Zero(p + 1);
  removed[p] = zeta;  // b's component along the direction that goes.
  double a = alpha;
  for (Eigen::Index k = p - 1; k >= 0; --k) {
    const double length = std::hypot(a, q[k]);
    const double c = a / length;
    const double s = q[k] / length;
    a = length;
    for (Eigen::Index j = k; j <= p; ++j) {
      const double upper = next(k, j);
      const double carried = removed[j];
      removed[j] = c * carried + s * upper;
      next(k, j) = c * upper - s * carried;
    }
  }
  next(p, p) = std::sqrt(std::max(0.0, rho2));
  if (!next.allFinite()) return false;
  triangle_ = next;
  if (rows_ > 0) --rows_;
  return true;
}

void RowQr::transform_columns(const Eigen::Ref<const Eigen::MatrixXd>& upper) {
  assert(upper.rows() == columns_ && upper.cols() == columns_);
  // In place: column j of the product needs columns up to j of R only, so the last is replaced first.
  for (Eigen::Index j = columns_ - 1; j >= 0; --j) {
    triangle_.col(j).head(j + 1) *= upper(j, j);
    for (Eigen::Index k = 0; k < j; ++k) {
      const double factor = upper(k, j);
      if (factor != 0) triangle_.col(j).head(k + 1) += factor * triangle_.col(k).head(k + 1);
    }
  }
}

int RowQr::rank(int leading, double threshold) const {
  assert(leading >= 0 && leading <= columns_);
  if (leading == 0) return 0;
  if (surely_full_rank(triangle_.topLeftCorner(leading, leading), threshold)) return leading;
  const Eigen::MatrixXd r = triangle_.topLeftCorner(leading, leading).triangularView<Eigen::Upper>();
  if (r.cwiseAbs().maxCoeff() == 0) return 0;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(r);
  qr.setThreshold(threshold);
  return static_cast<int>(qr.rank());
}

Eigen::VectorXd RowQr::solve(int leading) const {
  assert(leading > 0 && leading <= columns_);
  return triangle_.topLeftCorner(leading, leading)
      .triangularView<Eigen::Upper>()
      .solve(triangle_.col(columns_).head(leading));
}

void RowQr::refine(const Eigen::Ref<const Eigen::MatrixXd>& rows, Eigen::VectorXd& c) const {
  assert(rows.cols() == columns_ + 1 && c.size() == columns_);
  Eigen::Matrix<long double, Eigen::Dynamic, 1> gradient =
      Eigen::Matrix<long double, Eigen::Dynamic, 1>::Zero(columns_);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    long double residual = rows(i, columns_);
    for (Eigen::Index k = 0; k < columns_; ++k) residual -= static_cast<long double>(rows(i, k)) * c[k];
    for (Eigen::Index k = 0; k < columns_; ++k)
      gradient[k] += static_cast<long double>(rows(i, k)) * residual;
  }
  const auto r = triangle_.topLeftCorner(columns_, columns_).triangularView<Eigen::Upper>();
  Eigen::VectorXd step = gradient.cast<double>();
  r.transpose().solveInPlace(step);
  r.solveInPlace(step);
  c += step;
}

double RowQr::residual_norm(int leading) const {
  return triangle_.col(columns_).tail(columns_ + 1 - leading).norm();
}

}  // namespace handloft::geometry
