#include "server-model/geometry/curve_smoothing.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <cstddef>

namespace handloft::geometry {
namespace {

/// Position i of a curve of `size` >= 2 points that goes on beyond its ends.
Vec3 extended(std::span<const Vec3> points, std::ptrdiff_t i, CurveEnds ends) {
  const auto last = static_cast<std::ptrdiff_t>(points.size()) - 1;
  const auto at = [&](std::ptrdiff_t k) { return points[static_cast<std::size_t>(k)]; };
  if (i >= 0 && i <= last) return at(i);
  const std::ptrdiff_t end = i < 0 ? 0 : last;
  const Vec3 image = extended(points, 2 * end - i, ends);
  return ends == CurveEnds::mirrored_at_end ? image : Vec3(2 * at(end) - image);
}

}  // namespace

Result<std::vector<double>> smoothing_weights(int window, int order) {
  if (window < 1 || window > max_smoothing_window || window % 2 == 0) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected an odd number of 1..{}", window, max_smoothing_window),
                      "window");
  }
  if (order < 0 || order >= window) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 0..{} for a window of {}", order, window - 1, window),
                      "order");
  }
  // An orthonormal basis q_j of the polynomials over the window, each from t q_(j-1); orthogonalised twice,
  // which is what keeps high orders accurate. The best polynomial's middle value is sum_j q_j(0) <q_j, y>.
  const int middle = window / 2;
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(window, -1.0, 1.0);
  Eigen::MatrixXd basis(window, order + 1);
  basis.col(0).setConstant(1.0);
  basis.col(0).normalize();
  for (int j = 1; j <= order; ++j) {
    Eigen::VectorXd next = t.cwiseProduct(basis.col(j - 1));
    for (int pass = 0; pass < 2; ++pass) {
      next -= basis.leftCols(j) * (basis.leftCols(j).transpose() * next).eval();
    }
    basis.col(j) = next.normalized();
  }
  Eigen::VectorXd weights = basis * basis.row(middle).transpose();
  // Exactly symmetric, so that a curve and its reverse are smoothed alike.
  weights = (0.5 * (weights + weights.reverse())).eval();
  return std::vector<double>(weights.data(), weights.data() + window);
}

Result<std::vector<Vec3>> smooth_curve(std::span<const Vec3> points, const SmoothingOptions& options) {
  auto weights = smoothing_weights(options.window, options.order);
  if (!weights.ok()) return weights.error();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].allFinite()) continue;
    return make_error(ErrorCode::invalid_argument, "found a coordinate that is not finite, expected metres",
                      fmt::format("points[{}]", i));
  }
  if (points.size() < 2) return std::vector<Vec3>(points.begin(), points.end());

  const std::ptrdiff_t reach = options.window / 2;
  const auto count = static_cast<std::ptrdiff_t>(points.size());
  std::vector<Vec3> padded;
  padded.reserve(points.size() + 2 * static_cast<std::size_t>(reach));
  for (std::ptrdiff_t i = -reach; i < count + reach; ++i) padded.push_back(extended(points, i, options.ends));

  std::vector<Vec3> smooth;
  smooth.reserve(points.size());
  const std::vector<double>& w = *weights;
  const auto half = static_cast<std::size_t>(reach);
  for (std::size_t i = 0; i < points.size(); ++i) {
    // In pairs from the outside in: the sum is the same to the bit for the reversed curve.
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 0; k < half; ++k) sum += w[k] * (padded[i + k] + padded[i + 2 * half - k]);
    smooth.push_back(sum + w[half] * padded[i + half]);
  }
  return smooth;
}

}  // namespace handloft::geometry
