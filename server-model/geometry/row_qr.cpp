#include "server-model/geometry/row_qr.h"

#include <Eigen/QR>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace handloft::geometry {
namespace {

/// Rows per block: 256 rows of 29 doubles are 58 KB and stay in the second-level cache with their triangle.
constexpr Eigen::Index block_rows = 256;

/// Downdating loses digits as 1 / alpha; below this more than half of them (8 of 16) are gone.
constexpr double min_downdate_alpha = 1e-4;

/// Householder QR in place of [triangle; block], column by column (the structure of the triangle is used: a
/// reflection touches one row of it and the whole block). Costs 4 m p^2 / 2 flops for m rows.
void annihilate(Eigen::MatrixXd& triangle, Eigen::Ref<Eigen::MatrixXd> block) {
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
    below /= v0;
    triangle(k, k) = beta;
    for (Eigen::Index j = k + 1; j < columns; ++j) {
      const double projection = tau * (triangle(k, j) + below.dot(block.col(j)));
      triangle(k, j) -= projection;
      block.col(j).noalias() -= projection * below;
    }
  }
}

}  // namespace

RowQr::RowQr(int columns) : columns_(columns), triangle_(Eigen::MatrixXd::Zero(columns + 1, columns + 1)) {
  assert(columns >= 0);
}

void RowQr::append(Eigen::Ref<Eigen::MatrixXd> rows) {
  assert(rows.cols() == columns_ + 1);
  for (Eigen::Index begin = 0; begin < rows.rows(); begin += block_rows) {
    annihilate(triangle_, rows.middleRows(begin, std::min(block_rows, rows.rows() - begin)));
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

int RowQr::rank(int leading, double threshold) const {
  assert(leading >= 0 && leading <= columns_);
  if (leading == 0) return 0;
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

double RowQr::residual_norm(int leading) const {
  return triangle_.col(columns_).tail(columns_ + 1 - leading).norm();
}

}  // namespace handloft::geometry
