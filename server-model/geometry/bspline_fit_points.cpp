// Fitting surfaces to points anywhere: sparse least squares with a trace of bending, so that control points
// without data are determined.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "server-model/geometry/bspline_fit.h"
#include "server-model/geometry/bspline_fit_detail.h"
#include "server-model/geometry/bspline_projection.h"
#include "server-model/geometry/sculpt_energy.h"

namespace handloft::geometry {
namespace {

/// Entries of the normal equations' band that are held at most: half a gigabyte.
constexpr std::size_t max_entries = std::size_t{1} << 26;
constexpr int max_rounds = 16;
/// A span with fewer samples than this is not halved.
constexpr std::size_t least_samples = 4;

Status check_samples(std::span<const SurfaceSample> samples) {
  double weights = 0;
  Vec2 mean = Vec2::Zero();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const SurfaceSample& s = samples[i];
    if (const Status status = detail::check_points({&s.place, 1}, "place"); !status) {
      return make_error(ErrorCode::invalid_argument, "found a coordinate that is no finite length",
                        fmt::format("samples[{}].place", i));
    }
    constexpr double max_parameter = 1e50;
    if (!(s.uv.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= max_parameter)) {
      return make_error(ErrorCode::invalid_argument, "found parameters that are not finite",
                        fmt::format("samples[{}].uv", i));
    }
    constexpr double max_weight = 1e50;
    if (!(s.weight >= 0 && s.weight <= max_weight)) {
      return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected >= 0", s.weight),
                        fmt::format("samples[{}].weight", i));
    }
    weights += s.weight;
    mean += s.uv / static_cast<double>(samples.size());
  }
  if (!(weights > 0)) {
    return make_error(ErrorCode::invalid_argument, "found none with a weight", "samples");
  }
  Vec2 low = mean, high = mean;
  for (const SurfaceSample& s : samples) {
    if (s.weight == 0) continue;
    low = low.cwiseMin(s.uv);
    high = high.cwiseMax(s.uv);
  }
  const Vec2 size = high - low;
  // Correlation of the scaled parameters: on one line they say nothing about the other direction.
  double xx = 0, xy = 0, yy = 0;
  for (const SurfaceSample& s : samples) {
    if (s.weight == 0) continue;
    const Vec2 d = (s.uv - mean).cwiseQuotient(size);
    xx += d.x() * d.x();
    xy += d.x() * d.y();
    yy += d.y() * d.y();
  }
  constexpr double least_area = 1e-12;
  if (!(xx * yy - xy * xy > least_area * xx * yy)) {
    return make_error(ErrorCode::invalid_argument, "found parameters without an area", "samples");
  }
  return {};
}

/// The least squares problem over one pair of knot vectors.
class NormalEquations {
 public:
  NormalEquations(const KnotVector& u, const KnotVector& v)
      : u_(u),
        v_(v),
        rows_(u.control_count()),
        columns_(v.control_count()),
        wide_(2 * v.degree() + 1),
        band_((static_cast<std::size_t>(u.degree()) + 1) * static_cast<std::size_t>(wide_)),
        entries_(static_cast<std::size_t>(rows_) * static_cast<std::size_t>(columns_) * band_),
        right_(Eigen::MatrixX3d::Zero(static_cast<Eigen::Index>(rows_) * columns_, 3)) {}

  static bool fits(const KnotVector& u, const KnotVector& v) {
    const std::size_t band =
        (static_cast<std::size_t>(u.degree()) + 1) * (2 * static_cast<std::size_t>(v.degree()) + 1);
    return static_cast<std::size_t>(u.control_count()) * static_cast<std::size_t>(v.control_count()) <=
           max_entries / band;
  }

  void add(const SurfaceSample& sample) {
    if (sample.weight == 0) return;
    const double u = u_.wrap(sample.uv.x());
    const double v = v_.wrap(sample.uv.y());
    const int p = u_.degree();
    const int q = v_.degree();
    const int first_u = u_.span(u) - p;
    const int first_v = v_.span(v) - q;
    std::array<double, static_cast<std::size_t>(KnotVector::max_degree) + 1> nu, nv;
    basis_functions(u_, first_u + p, u, 0, nu);
    basis_functions(v_, first_v + q, v, 0, nv);
    const auto at = [](const auto& values, int i) { return values[static_cast<std::size_t>(i)]; };
    for (int i = 0; i <= p; ++i) {
      for (int j = 0; j <= q; ++j) {
        const int point = (first_u + i) * columns_ + first_v + j;
        const double value = sample.weight * at(nu, i) * at(nv, j);
        right_.row(point) += value * sample.place.transpose();
        // The half with rows of control points up to this one.
        for (int k = 0; k <= i; ++k) {
          const double part = value * at(nu, k);
          double* const line = entries_.data() + static_cast<std::size_t>(point) * band_ +
                               static_cast<std::size_t>((i - k) * wide_);
          for (int l = 0; l <= q; ++l) line[l - j + q] += part * at(nv, l);
        }
      }
    }
  }

  /// With `bending` times `smoothing` of the sums' own size.
  std::optional<std::vector<Vec3>> solve(const Eigen::SparseMatrix<double>& bending, double smoothing) const {
    const Eigen::Index n = right_.rows();
    std::vector<Eigen::Triplet<double>> lower;
    double trace = 0;
    for (int i = 0; i < rows_; ++i) {
      for (int j = 0; j < columns_; ++j) {
        const int point = i * columns_ + j;
        const double* const band = entries_.data() + static_cast<std::size_t>(point) * band_;
        for (int k = 0; k <= std::min(i, u_.degree()); ++k) {
          for (int l = 0; l < wide_; ++l) {
            const double value = band[k * wide_ + l];
            const int other = point - k * columns_ + l - v_.degree();
            if (value == 0 || other > point) continue;
            lower.emplace_back(point, other, value);
            if (other == point) trace += value;
          }
        }
      }
    }
    Eigen::SparseMatrix<double> matrix(n, n);
    matrix.setFromTriplets(lower.begin(), lower.end());
    const double scale = bending.diagonal().sum();
    if (scale > 0)
      matrix +=
          (smoothing * trace / scale) * Eigen::SparseMatrix<double>(bending.triangularView<Eigen::Lower>());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor(matrix);
    if (factor.info() != Eigen::Success) return std::nullopt;
    Eigen::MatrixX3d control = factor.solve(right_);
    control += factor.solve(Eigen::MatrixX3d(right_ - matrix.selfadjointView<Eigen::Lower>() * control));
    if (!control.allFinite()) return std::nullopt;
    std::vector<Vec3> points;
    points.reserve(static_cast<std::size_t>(n));
    for (Eigen::Index i = 0; i < n; ++i) points.emplace_back(control.row(i).transpose());
    return points;
  }

 private:
  const KnotVector& u_;
  const KnotVector& v_;
  int rows_, columns_, wide_;
  std::size_t band_;
  std::vector<double> entries_;
  Eigen::MatrixX3d right_;
};

/// Metres a unit of each parameter, by the plane nearest to the samples as a function of them.
Vec2 metres_per_unit(std::span<const SurfaceSample> samples) {
  Mat3 sums = Mat3::Zero(), right = Mat3::Zero();
  const SurfaceSample& origin = samples.front();
  for (const SurfaceSample& s : samples) {
    const Vec3 row(1, s.uv.x() - origin.uv.x(), s.uv.y() - origin.uv.y());
    sums += s.weight * row * row.transpose();
    right += s.weight * row * (s.place - origin.place).transpose();
  }
  const Mat3 tangents = sums.fullPivLu().solve(right);
  Vec2 scale(tangents.row(1).norm(), tangents.row(2).norm());
  for (const int axis : {0, 1}) {
    if (!(scale[axis] > 0) || !std::isfinite(scale[axis])) scale[axis] = 1;
  }
  return scale;
}

KnotVector stretched(const KnotVector& knots, double factor) {
  std::vector<double> longer;
  for (const double knot : knots.knots()) longer.push_back((knot - knots.lower()) * factor);
  Result<KnotVector> made = KnotVector::open(knots.degree(), std::move(longer));
  return made ? *std::move(made) : knots;
}

Eigen::SparseMatrix<double> bending_of(const KnotVector& u, const KnotVector& v, const Vec2& scale) {
  SculptEnergy energy{.a11 = 0, .a12 = 0, .a22 = 0, .b11 = 1, .b12 = 1, .b22 = 1};
  // Facets do not bend; they stretch.
  if (u.degree() == 1 || v.degree() == 1)
    energy = {.a11 = 1, .a12 = 0, .a22 = 1, .b11 = 0, .b12 = 0, .b22 = 0};
  return stiffness(stretched(u, scale.x()), stretched(v, scale.y()), energy);
}

struct Measured {
  FitError error;
  std::vector<double> in_u, in_v;  ///< The worst of each span's samples, 0 below the tolerance.
};

/// Moves the samples' parameters to their foot points.
Measured measure(const BSplineSurface& surface, std::vector<SurfaceSample>& samples, double tolerance_m) {
  Measured measured;
  measured.in_u.assign(static_cast<std::size_t>(surface.u.function_count()), 0.0);
  measured.in_v.assign(static_cast<std::size_t>(surface.v.function_count()), 0.0);
  double squares = 0, weights = 0;
  for (SurfaceSample& s : samples) {
    const double distance = detail::distance_near(surface, s.place, s.uv);
    squares += s.weight * distance * distance;
    weights += s.weight;
    if (s.weight == 0) continue;
    measured.error.max_m = std::max(measured.error.max_m, distance);
    if (distance <= tolerance_m) continue;
    double& u = measured.in_u[static_cast<std::size_t>(surface.u.span(s.uv.x()))];
    double& v = measured.in_v[static_cast<std::size_t>(surface.v.span(s.uv.y()))];
    u = std::max(u, distance);
    v = std::max(v, distance);
  }
  measured.error.rms_m = std::sqrt(squares / weights);
  return measured;
}

/// The spans with errors halved, the worst first, up to max_count functions.
Result<KnotVector> halved(const KnotVector& knots, const std::vector<double>& errors,
                          const std::vector<SurfaceSample>& samples, int axis, int max_count) {
  std::vector<std::size_t> held(errors.size(), 0);
  for (const SurfaceSample& s : samples) ++held[static_cast<std::size_t>(knots.span(s.uv[axis]))];
  std::vector<std::size_t> order;
  for (std::size_t s = 0; s < errors.size(); ++s) {
    if (errors[s] > 0 && held[s] >= least_samples) order.push_back(s);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return errors[a] > errors[b]; });
  std::vector<double> inner = detail::inner_knots(knots);
  const int room = std::max(max_count - knots.control_count(), 0);
  if (order.size() > static_cast<std::size_t>(room)) order.resize(static_cast<std::size_t>(room));
  for (const std::size_t s : order) inner.push_back(knots.knots()[s] / 2 + knots.knots()[s + 1] / 2);
  std::sort(inner.begin(), inner.end());
  return detail::clamped_knots(knots.degree(), knots.lower(), knots.upper(), inner);
}

Result<KnotVector> first_knots(std::span<const SurfaceSample> samples, int axis, int degree, int spans) {
  double low = samples.front().uv[axis], high = low;
  for (const SurfaceSample& s : samples) {
    low = std::min(low, s.uv[axis]);
    high = std::max(high, s.uv[axis]);
  }
  std::vector<double> inner;
  for (int k = 1; k < spans; ++k) inner.push_back(low + (high - low) * k / spans);
  return detail::clamped_knots(degree, low, high, inner);
}

}  // namespace

Result<SurfaceFit> approximate_points(std::span<const SurfaceSample> given,
                                      const BSplineFitOptions& options) {
  if (const Status status = detail::check_options(options); !status) return status.error();
  if (given.empty()) return make_error(ErrorCode::invalid_argument, "found none", "samples");
  if (const Status status = check_samples(given); !status) return status.error();
  Result<KnotVector> u = first_knots(given, 0, options.degree_u, options.first_spans_u);
  Result<KnotVector> v = first_knots(given, 1, options.degree_v, options.first_spans_v);
  if (!u) return u.error();
  if (!v) return v.error();
  const Vec2 scale = metres_per_unit(given);
  const int cap = options.max_control_points;
  if (u->control_count() > cap / v->control_count() || !NormalEquations::fits(*u, *v)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, fewer than the first spans have", cap),
                      "options.max_control_points");
  }
  std::optional<SurfaceFit> best;
  for (int round = 0; round < max_rounds; ++round) {
    // From the given parameters each time: those of a coarser surface may have slid.
    std::vector<SurfaceSample> samples(given.begin(), given.end());
    const Eigen::SparseMatrix<double> bending = bending_of(*u, *v, scale);
    std::optional<Measured> round_best;
    for (int correction = 0; correction <= options.parameter_corrections; ++correction) {
      NormalEquations equations(*u, *v);
      for (const SurfaceSample& s : samples) equations.add(s);
      std::optional<std::vector<Vec3>> control = equations.solve(bending, options.smoothing);
      if (!control) break;
      SurfaceFit fit{{*u, *v, *std::move(control), {}}, {}, false};
      Measured now = measure(fit.surface, samples, options.tolerance_m);
      fit.error = now.error;
      fit.within_tolerance = now.error.max_m <= options.tolerance_m;
      const bool nearer = !round_best || now.error.max_m < round_best->error.max_m;
      if (!best || fit.error.max_m < best->error.max_m) best = std::move(fit);
      if (!nearer) break;
      round_best = std::move(now);
      if (best->within_tolerance) break;
    }
    if (!round_best || best->within_tolerance) break;
    Result<KnotVector> next_u = halved(*u, round_best->in_u, samples, 0, cap / v->control_count());
    if (!next_u) break;
    Result<KnotVector> next_v = halved(*v, round_best->in_v, samples, 1, cap / next_u->control_count());
    if (!next_v || !NormalEquations::fits(*next_u, *next_v)) break;
    if (*next_u == *u && *next_v == *v) break;
    u = std::move(next_u);
    v = std::move(next_v);
  }
  if (!best) {
    return make_error(ErrorCode::rank_deficient, "found samples that determine no surface", "samples");
  }
  return *std::move(best);
}

std::vector<SurfaceSample> projected_on(const Frame& frame, std::span<const Vec3> places) {
  std::vector<SurfaceSample> samples;
  samples.reserve(places.size());
  for (const Vec3& place : places) samples.push_back({place, frame.to_local(place).head<2>(), 1});
  return samples;
}

Result<std::vector<SurfaceSample>> projected_on(const BSplineSurface& base, std::span<const Vec3> places) {
  const Result<SurfaceProjector> projector = SurfaceProjector::create(base);
  if (!projector) return projector.error();
  std::vector<ClosestOnSurface> answers(places.size());
  if (const Status status = projector->closest(places, answers); !status) return status.error();
  std::vector<SurfaceSample> samples;
  samples.reserve(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) samples.push_back({places[i], answers[i].uv, 1});
  return samples;
}

Status weigh_by_area(std::span<const std::uint32_t> indices, std::span<SurfaceSample> vertices) {
  if (indices.size() % 3 != 0) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected three a triangle", indices.size()), "indices");
  }
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] >= vertices.size()) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected less than {}", indices[i], vertices.size()),
                        fmt::format("indices[{}]", i));
    }
  }
  for (SurfaceSample& vertex : vertices) vertex.weight = 0;
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    SurfaceSample& a = vertices[indices[i]];
    SurfaceSample& b = vertices[indices[i + 1]];
    SurfaceSample& c = vertices[indices[i + 2]];
    const double share = (b.place - a.place).cross(c.place - a.place).norm() / 2 / 3;
    for (SurfaceSample* vertex : {&a, &b, &c}) vertex->weight += share;
  }
  return {};
}

}  // namespace handloft::geometry
