#include "server-model/geometry/profile_modification.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "server-model/geometry/design_block.h"
#include "server-model/geometry/fit_checks.h"
#include "server-model/geometry/resample.h"

namespace handloft::geometry {
namespace {

bool lexicographically_less(const Vec3& a, const Vec3& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

bool curve_less(const Curve& a, const Curve& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), lexicographically_less);
}

/// Appends the rows sqrt(theta) (monomials | height) of points; heights are above `surface`, or z as it is
/// without one.
void append_points(RowQr& qr, const detail::ScaledPoints& points, int degree,
                   const PolynomialSurface* surface) {
  detail::DesignBlock block(degree, points);
  const Eigen::Index p = coefficient_count(degree);
  for (Eigen::Index begin = 0; begin < points.count(); begin += block.capacity()) {
    auto rows = block.weighted(begin, std::min(block.capacity(), points.count() - begin), 1.0);
    if (surface != nullptr) {
      const Eigen::Map<const Eigen::VectorXd> c(surface->scaled_coefficients().data(), p);
      rows.col(p).noalias() -= rows.leftCols(p) * c;
    }
    qr.append(rows);
  }
}

/// Whether the columns are independent, each scaled to length 1: curves far outside of the box make the high
/// powers' columns long, which is not the same as dependent.
bool full_rank(const RowQr& qr, double threshold) {
  const Eigen::Index p = qr.columns();
  Eigen::MatrixXd r = qr.triangle().topLeftCorner(p, p).triangularView<Eigen::Upper>();
  if (!r.allFinite()) return false;
  for (Eigen::Index k = 0; k < p; ++k) {
    const double length = r.col(k).stableNorm();
    if (!(length > 0)) return false;
    r.col(k) /= length;
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> pivoted(r);
  pivoted.setThreshold(threshold);
  return pivoted.rank() == p;
}

}  // namespace

Result<std::vector<Curve>> prepare_strokes(std::span<const Curve> strokes,
                                           const SmoothingOptions& smoothing) {
  std::vector<Curve> curves;
  curves.reserve(strokes.size());
  for (std::size_t i = 0; i < strokes.size(); ++i) {
    auto smooth = smooth_curve(strokes[i], smoothing);
    if (!smooth.ok()) {
      Error error = smooth.error();
      if (error.field.starts_with("points")) error.field = fmt::format("strokes[{}].{}", i, error.field);
      return error;
    }
    if (smooth->empty()) continue;
    // Corners set one by one, as in a script: the window would see beyond both ends and flatten them.
    if (strokes[i].size() < static_cast<std::size_t>(smoothing.window)) *smooth = strokes[i];
    Curve reversed(smooth->rbegin(), smooth->rend());
    curves.push_back(curve_less(reversed, *smooth) ? std::move(reversed) : std::move(*smooth));
  }
  std::sort(curves.begin(), curves.end(), curve_less);
  return curves;
}

std::vector<std::size_t> share_by_length(std::span<const Curve> curves, std::size_t total) {
  std::vector<std::size_t> shares(curves.size(), 0);
  if (curves.empty()) return shares;
  std::vector<double> lengths;
  lengths.reserve(curves.size());
  for (const Curve& curve : curves) lengths.push_back(curve_length(curve));
  double sum = std::accumulate(lengths.begin(), lengths.end(), 0.0);
  if (!(sum > 0) || !std::isfinite(sum)) {
    std::fill(lengths.begin(), lengths.end(), 1.0);
    sum = static_cast<double>(curves.size());
  }
  const std::size_t least = total >= curves.size() ? 1 : 0;
  const std::size_t to_share = total - least * curves.size();
  std::vector<double> remainders(curves.size());
  std::size_t given = 0;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const double exact = static_cast<double>(to_share) * (lengths[i] / sum);
    const double whole = std::min(std::floor(exact), static_cast<double>(to_share - given));
    remainders[i] = exact - whole;
    shares[i] = least + static_cast<std::size_t>(whole);
    given += static_cast<std::size_t>(whole);
  }
  std::vector<std::size_t> order(curves.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return remainders[a] > remainders[b]; });
  for (std::size_t k = 0; given < to_share; ++k, ++given) ++shares[order[k % order.size()]];
  return shares;
}

Result<std::vector<Vec3>> points_along(std::span<const Curve> curves, std::size_t total) {
  const std::vector<std::size_t> shares = share_by_length(curves, total);
  std::vector<Vec3> points;
  points.reserve(total);
  for (std::size_t i = 0; i < curves.size(); ++i) {
    auto even = resample_evenly(curves[i], shares[i]);
    if (!even.ok()) return even.error();
    points.insert(points.end(), even->begin(), even->end());
  }
  return points;
}

ProfileFitter::ProfileFitter(PolynomialSurface current, RowQr qr, const Options& options)
    : current_(std::move(current)), qr_(std::move(qr)), options_(options) {}

Result<ProfileFitter> ProfileFitter::create(std::span<const WeightedPoint> local_points,
                                            const PolynomialSurface& current, const Options& options) {
  if (!(options.curve_weight > 0 && options.curve_weight <= 1)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected above 0, at most 1", options.curve_weight),
                      "curve_weight");
  }
  if (Status status = detail::check_points(local_points); !status.ok()) return status.error();
  const int degree = current.degree();
  const int p = coefficient_count(degree);
  RowQr qr(p);
  append_points(qr, detail::ScaledPoints::in_box(local_points, current.box()), degree, nullptr);
  if (!full_rank(qr, options.rank_threshold)) {
    return make_error(
        ErrorCode::rank_deficient,
        fmt::format("the {} points do not determine a surface of degree {}", local_points.size(), degree),
        "points");
  }
  // The optimum is where R c = Q^T z; a difference there is a gradient of eq. 3.
  const std::span<const double> scaled = current.scaled_coefficients();
  const Eigen::Map<const Eigen::VectorXd> c(scaled.data(), p);
  const auto r = qr.triangle().topLeftCorner(p, p).triangularView<Eigen::Upper>();
  const Eigen::VectorXd right = qr.triangle().col(p).head(p);
  const double height = right.stableNorm() + (r * c.cwiseAbs()).eval().stableNorm();
  const double off = (r * c - right).stableNorm();
  if (!(off <= options.optimum_tolerance * height)) {
    return make_error(ErrorCode::failed_precondition,
                      "the points were changed since their surface was fitted, expected a fit of them first",
                      "points");
  }
  return ProfileFitter(current, std::move(qr), options);
}

Result<PolynomialSurface> ProfileFitter::fit_with(std::span<const Vec3> curve_points) const {
  if (curve_points.empty()) return current_;
  std::vector<WeightedPoint> points;
  points.reserve(curve_points.size());
  for (const Vec3& point : curve_points) points.push_back({point, options_.curve_weight});
  if (Status status = detail::check_points(points); !status.ok()) {
    Error error = status.error();
    error.field = "curve_" + error.field;
    return error;
  }
  // Fitted is the change: heights above the present surface, the originals' part of which is all residual.
  // So a curve that lies on the surface changes nothing, to the last digits.
  const int degree = current_.degree();
  const int p = coefficient_count(degree);
  RowQr qr(p);
  Eigen::MatrixXd start = qr_.triangle().topRows(p);
  start.col(p).setZero();
  qr.append(start);
  append_points(qr, detail::ScaledPoints::in_box(points, current_.box()), degree, &current_);
  const auto too_far = [] {
    return make_error(ErrorCode::invalid_argument, "the curve is too far away from the shape to compute with",
                      "curve_points");
  };
  if (!full_rank(qr, options_.rank_threshold)) return too_far();
  const Eigen::VectorXd change = qr.solve(p);
  std::vector<double> scaled(current_.scaled_coefficients().begin(), current_.scaled_coefficients().end());
  for (int k = 0; k < p; ++k) scaled[static_cast<std::size_t>(k)] += change[k];
  auto surface = PolynomialSurface::from_scaled(degree, current_.box(), scaled);
  if (!surface.ok()) return too_far();
  return surface;
}

std::size_t kept_point_count(std::size_t n) {
  // round(n / 10), halves up.
  return std::max<std::size_t>(1, n / 10 + (n % 10 >= 5 ? 1 : 0));
}

Result<std::vector<Curve>> curves_on_surface(const PolynomialSurface& surface, std::span<const Curve> curves,
                                             std::size_t total) {
  // Even spacing before the projection is uneven after it where the surface is steep: the projected curve,
  // densely sampled, is resampled again. The chords of 16 pieces between two points bend the spacing by 1e-3
  // of their turn at most.
  constexpr std::size_t pieces_per_point = 16;
  constexpr std::size_t fewest_pieces = 256;
  const auto project = [&](Curve& curve) {
    for (Vec3& point : curve) point.z() = surface.value(point.x(), point.y());
  };
  std::vector<Curve> dense;
  dense.reserve(curves.size());
  const std::vector<std::size_t> first_shares = share_by_length(curves, total);
  for (std::size_t i = 0; i < curves.size(); ++i) {
    auto even = resample_evenly(curves[i], std::max(fewest_pieces, pieces_per_point * first_shares[i]) + 1);
    if (!even.ok()) return even.error();
    project(*even);
    dense.push_back(std::move(*even));
  }
  const std::vector<std::size_t> shares = share_by_length(dense, total);
  std::vector<Curve> kept;
  kept.reserve(curves.size());
  for (std::size_t i = 0; i < dense.size(); ++i) {
    auto even = resample_evenly(dense[i], shares[i]);
    if (!even.ok()) {
      return make_error(ErrorCode::invalid_argument,
                        "the surface is too far away along the curve to compute with", "curves");
    }
    project(*even);
    kept.push_back(std::move(*even));
  }
  return kept;
}

double mean_weight(std::span<const WeightedPoint> points) {
  if (points.empty()) return 0;
  long double sum = 0;  // 64 bits of mantissa: the mean is right to the last bit of a double (A20).
  for (const WeightedPoint& point : points) sum += static_cast<long double>(point.weight);
  return static_cast<double>(sum / static_cast<long double>(points.size()));
}

}  // namespace handloft::geometry
