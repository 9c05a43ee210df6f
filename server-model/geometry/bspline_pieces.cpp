#include "server-model/geometry/bspline_pieces.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace handloft::geometry {

namespace {

constexpr std::size_t max_order = KnotVector::max_degree + 1;

/// The Bernstein polynomials of degree p and their first and second derivatives.
struct Bernstein {
  std::array<double, max_order> value, first, second;
};

inline void raise(std::array<double, max_order>& b, int degree, double t) {
  const auto n = static_cast<std::size_t>(degree);
  b[n] = t * b[n - 1];
  for (std::size_t i = n - 1; i > 0; --i) b[i] = t * b[i - 1] + (1 - t) * b[i];
  b[0] = (1 - t) * b[0];
}

void bernstein(int degree, double t, Bernstein& out) {
  const auto p = static_cast<std::size_t>(degree);
  std::array<double, max_order>& b = out.value;
  b[0] = 1;
  for (int n = 1; n <= degree - 2; ++n) raise(b, n, t);
  if (degree >= 2) {
    const double scale = degree * (degree - 1);
    for (std::size_t i = 0; i <= p; ++i) {
      const double before = i >= 2 ? b[i - 2] : 0;
      const double at = i >= 1 && i <= p - 1 ? b[i - 1] : 0;
      const double after = i <= p - 2 ? b[i] : 0;
      out.second[i] = scale * (before - 2 * at + after);
    }
    raise(b, degree - 1, t);
  } else {
    out.second.fill(0);
  }
  for (std::size_t i = 0; i <= p; ++i) {
    out.first[i] = degree * ((i >= 1 ? b[i - 1] : 0) - (i <= p - 1 ? b[i] : 0));
  }
  raise(b, degree, t);
}

inline void cubic(double t, double* value, double* first, double* second) {
  const double r = 1 - t;
  value[0] = r * r * r;
  value[1] = 3 * t * r * r;
  value[2] = 3 * t * t * r;
  value[3] = t * t * t;
  first[0] = -3 * r * r;
  first[1] = 3 * r * (r - 2 * t);
  first[2] = 3 * t * (2 * r - t);
  first[3] = 3 * t * t;
  second[0] = 6 * r;
  second[1] = 6 * t - 12 * r;
  second[2] = 6 * r - 12 * t;
  second[3] = 6 * t;
}

/// One component's value and derivatives: s, su, sv, suu, suv, svv.
template <typename Size>
inline std::array<double, 6> component(const double* c, Size rows, Size columns, const double* u,
                                       const double* u1, const double* u2, const double* v, const double* v1,
                                       const double* v2) {
  std::array<double, 6> sum{};
  for (Size a = 0; a < rows; ++a) {
    double row = 0, row1 = 0, row2 = 0;
    for (Size b = 0; b < columns; ++b) {
      const double x = c[a * columns + b];
      row += v[b] * x;
      row1 += v1[b] * x;
      row2 += v2[b] * x;
    }
    sum[0] += u[a] * row;
    sum[1] += u1[a] * row;
    sum[2] += u[a] * row1;
    sum[3] += u2[a] * row;
    sum[4] += u1[a] * row1;
    sum[5] += u[a] * row2;
  }
  return sum;
}

void evaluate_bicubic(const double* c, int, int, double s, double t, PieceDerivatives& d) {
  std::array<double, 4> u, u1, u2, v, v1, v2;
  cubic(s, u.data(), u1.data(), u2.data());
  cubic(t, v.data(), v1.data(), v2.data());
  for (int k = 0; k < 3; ++k) {
    std::array<double, 6> sum{};
    const double* x = c + 16 * static_cast<std::size_t>(k);
    for (std::size_t a = 0; a < 4; ++a, x += 4) {
      const double row = v[0] * x[0] + v[1] * x[1] + v[2] * x[2] + v[3] * x[3];
      const double row1 = v1[0] * x[0] + v1[1] * x[1] + v1[2] * x[2] + v1[3] * x[3];
      const double row2 = v2[0] * x[0] + v2[1] * x[1] + v2[2] * x[2] + v2[3] * x[3];
      sum[0] += u[a] * row;
      sum[1] += u1[a] * row;
      sum[2] += u[a] * row1;
      sum[3] += u2[a] * row;
      sum[4] += u1[a] * row1;
      sum[5] += u[a] * row2;
    }
    d.s[k] = sum[0], d.su[k] = sum[1], d.sv[k] = sum[2];
    d.suu[k] = sum[3], d.suv[k] = sum[4], d.svv[k] = sum[5];
  }
}

template <bool rational>
void evaluate_any(const double* c, int p, int q, double s, double t, PieceDerivatives& d) {
  Bernstein u, v;
  bernstein(p, s, u);
  bernstein(q, t, v);
  const auto rows = static_cast<std::size_t>(p) + 1, columns = static_cast<std::size_t>(q) + 1;
  const auto sums = [&](std::size_t k) {
    return component<std::size_t>(c + k * rows * columns, rows, columns, u.value.data(), u.first.data(),
                                  u.second.data(), v.value.data(), v.first.data(), v.second.data());
  };
  for (int k = 0; k < 3; ++k) {
    const std::array<double, 6> sum = sums(static_cast<std::size_t>(k));
    d.s[k] = sum[0], d.su[k] = sum[1], d.sv[k] = sum[2];
    d.suu[k] = sum[3], d.suv[k] = sum[4], d.svv[k] = sum[5];
  }
  if constexpr (rational) {
    const std::array<double, 6> w = sums(3);
    d.s /= w[0];
    d.su = (d.su - w[1] * d.s) / w[0];
    d.sv = (d.sv - w[2] * d.s) / w[0];
    d.suu = (d.suu - 2 * w[1] * d.su - w[3] * d.s) / w[0];
    d.suv = (d.suv - w[1] * d.sv - w[2] * d.su - w[4] * d.s) / w[0];
    d.svv = (d.svv - 2 * w[2] * d.sv - w[5] * d.s) / w[0];
  }
}

/// Row k of a span's extraction: the blossom at p - k times its lower and k times its upper end, as weights
/// of the p + 1 functions.
void blossom(const KnotVector& knots, int span, int k, double* row) {
  const int p = knots.degree();
  const auto order = static_cast<std::size_t>(p) + 1;
  const std::vector<double>& t = knots.knots();
  const double a = t[static_cast<std::size_t>(span)], b = t[static_cast<std::size_t>(span) + 1];
  std::vector<double> d(order * order, 0.0);
  for (std::size_t i = 0; i < order; ++i) d[i * order + i] = 1;
  for (int r = 1; r <= p; ++r) {
    const double x = r <= p - k ? a : b;
    for (int i = p; i >= r; --i) {
      const auto g =
          static_cast<std::size_t>(span) - static_cast<std::size_t>(p) + static_cast<std::size_t>(i);
      const double low = t[g], high = t[g + static_cast<std::size_t>(p + 1 - r)];
      const double alpha = (x - low) / (high - low);
      double* to = d.data() + static_cast<std::size_t>(i) * order;
      for (std::size_t m = 0; m < order; ++m) to[m] = (1 - alpha) * (to - order)[m] + alpha * to[m];
    }
  }
  std::copy_n(d.data() + static_cast<std::size_t>(p) * order, order, row);
}

}  // namespace

SpanExtraction::SpanExtraction(const KnotVector& knots) : degree(knots.degree()) {
  const std::vector<int> spans = knots.spans();
  const auto order = static_cast<std::size_t>(degree) + 1;
  matrix.resize(spans.size() * order * order);
  for (std::size_t n = 0; n < spans.size(); ++n) {
    bounds.push_back(knots.knots()[static_cast<std::size_t>(spans[n])]);
    first_function.push_back(spans[n] - degree);
    for (int k = 0; k <= degree; ++k) {
      blossom(knots, spans[n], k, matrix.data() + (n * order + static_cast<std::size_t>(k)) * order);
    }
  }
  bounds.push_back(knots.upper());
}

int SpanExtraction::find(double u) const {
  const auto above = std::upper_bound(bounds.begin(), bounds.end(), u);
  return static_cast<int>(std::clamp<std::ptrdiff_t>(above - bounds.begin() - 1, 0, count() - 1));
}

BezierPieces::BezierPieces(const BSplineSurface& surface)
    : u_(surface.u), v_(surface.v), weights_(surface.weights) {
  for (int f = 0; f < surface.u.function_count(); ++f) row_of_.push_back(surface.u.control_of(f));
  for (int f = 0; f < surface.v.function_count(); ++f) column_of_.push_back(surface.v.control_of(f));
  control_rows_ = surface.u.control_count();
  control_columns_ = surface.v.control_count();
  component_ = (static_cast<std::size_t>(u_.degree) + 1) * (static_cast<std::size_t>(v_.degree) + 1);
  stride_ = component_ * (weights_.empty() ? 3 : 4);
  const auto count = static_cast<std::size_t>(rows()) * static_cast<std::size_t>(columns());
  coefficients_.resize(count * stride_);
  bounds_.resize(count);
  boxes_.resize(count);
  if (is_rational()) {
    evaluate_ = evaluate_any<true>;
  } else {
    evaluate_ = u_.degree == 3 && v_.degree == 3 ? evaluate_bicubic : evaluate_any<false>;
  }
  update(surface.control, {});
}

void BezierPieces::mark(std::span<const std::uint8_t> moved, std::vector<std::uint8_t>& touched) const {
  touched.assign(size(), 0);
  for (int i = 0; i < rows(); ++i) {
    for (int j = 0; j < columns(); ++j) {
      std::uint8_t any = 0;
      for (int a = 0; a <= u_.degree && any == 0; ++a) {
        const auto row = static_cast<std::size_t>(
            row_of_[static_cast<std::size_t>(u_.first_function[static_cast<std::size_t>(i)]) +
                    static_cast<std::size_t>(a)]);
        for (int b = 0; b <= v_.degree && any == 0; ++b) {
          const auto column = static_cast<std::size_t>(
              column_of_[static_cast<std::size_t>(v_.first_function[static_cast<std::size_t>(j)]) +
                         static_cast<std::size_t>(b)]);
          any = moved[row * static_cast<std::size_t>(control_columns_) + column];
        }
      }
      touched[index(i, j)] = any;
    }
  }
}

void BezierPieces::update(std::span<const Vec3> control, std::span<const std::uint8_t> touched) {
  std::vector<double> scratch(2 * component_ * 4);
  for (std::size_t piece = 0; piece < size(); ++piece) {
    if (!touched.empty() && touched[piece] == 0) continue;
    extract(piece, control, scratch);
    bound_piece(piece);
  }
}

void BezierPieces::extract(std::size_t piece, std::span<const Vec3> control, std::vector<double>& scratch) {
  const auto columns_here = static_cast<std::size_t>(columns());
  const int i = static_cast<int>(piece / columns_here), j = static_cast<int>(piece % columns_here);
  const auto rows_p = static_cast<std::size_t>(u_.degree) + 1,
             columns_q = static_cast<std::size_t>(v_.degree) + 1;
  const std::size_t components = stride_ / component_;
  const double* eu = u_.of(i);
  const double* ev = v_.of(j);
  double* local = scratch.data();
  double* along = scratch.data() + 4 * component_;
  for (std::size_t a = 0; a < rows_p; ++a) {
    const int row = row_of_[static_cast<std::size_t>(u_.first_function[static_cast<std::size_t>(i)]) + a];
    for (std::size_t b = 0; b < columns_q; ++b) {
      const int column =
          column_of_[static_cast<std::size_t>(v_.first_function[static_cast<std::size_t>(j)]) + b];
      const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(control_columns_) +
                             static_cast<std::size_t>(column);
      const double w = components == 4 ? weights_[at] : 1.0;
      for (int k = 0; k < 3; ++k) {
        local[static_cast<std::size_t>(k) * component_ + a * columns_q + b] = control[at][k] * w;
      }
      if (components == 4) local[3 * component_ + a * columns_q + b] = w;
    }
  }
  double* out = coefficients_.data() + piece * stride_;
  for (std::size_t k = 0; k < components; ++k) {
    const double* in = local + k * component_;
    for (std::size_t a = 0; a < rows_p; ++a) {
      for (std::size_t b = 0; b < columns_q; ++b) {
        double sum = 0;
        for (std::size_t m = 0; m < columns_q; ++m) sum += ev[b * columns_q + m] * in[a * columns_q + m];
        along[a * columns_q + b] = sum;
      }
    }
    for (std::size_t a = 0; a < rows_p; ++a) {
      for (std::size_t b = 0; b < columns_q; ++b) {
        double sum = 0;
        for (std::size_t m = 0; m < rows_p; ++m) sum += eu[a * rows_p + m] * along[m * columns_q + b];
        out[k * component_ + a * columns_q + b] = sum;
      }
    }
  }
}

void BezierPieces::bound_piece(std::size_t piece) {
  const double* c = coefficients(piece);
  const auto p = static_cast<std::size_t>(u_.degree), q = static_cast<std::size_t>(v_.degree);
  const std::size_t columns_q = q + 1;
  const auto weight = [&](std::size_t n) { return is_rational() ? c[3 * component_ + n] : 1.0; };
  const auto homogeneous = [&](std::size_t n) {
    return Vec3(c[n], c[component_ + n], c[2 * component_ + n]);
  };
  const auto point = [&](std::size_t n) -> Vec3 {
    return is_rational() ? Vec3(homogeneous(n) / weight(n)) : homogeneous(n);
  };
  Box3 box;
  for (std::size_t n = 0; n < component_; ++n) box.include(point(n));
  boxes_[piece] = box;

  PieceBound& bound = bounds_[piece];
  const Vec3 p00 = point(0), p01 = point(q), p10 = point(p * columns_q), p11 = point(component_ - 1);
  const Vec3 along_u = p10 + p11 - p00 - p01, along_v = p01 + p11 - p00 - p10;
  const Vec3 across = along_u.cross(along_v);
  bound.axis = {Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};
  if (across.squaredNorm() > 1e-12 * along_u.squaredNorm() * along_v.squaredNorm()) {
    bound.axis[0] = along_u.normalized();
    bound.axis[2] = across.normalized();
    bound.axis[1] = bound.axis[2].cross(bound.axis[0]);
  }
  Vec3 least = Vec3::Constant(1e300), most = Vec3::Constant(-1e300);
  for (std::size_t n = 0; n < component_; ++n) {
    const Vec3 at = point(n) - p00;
    const Vec3 local(bound.axis[0].dot(at), bound.axis[1].dot(at), bound.axis[2].dot(at));
    least = least.cwiseMin(local);
    most = most.cwiseMax(local);
  }
  const Vec3 middle = (least + most) / 2;
  bound.half = (most - least) / 2;
  bound.radius = bound.half.norm();
  bound.centre = p00 + middle.x() * bound.axis[0] + middle.y() * bound.axis[1] + middle.z() * bound.axis[2];

  // Largest derivatives, from differences of the homogeneous points taken from the centre of the box.
  struct Most {
    double point = 0, weight = 0;
  };
  const Vec3 centre = bound.centre;
  const auto shifted = [&](std::size_t n) -> Vec3 { return homogeneous(n) - weight(n) * centre; };
  const auto largest = [&](std::size_t da, std::size_t db, double scale, const auto& difference) {
    Most sum;
    for (std::size_t a = 0; a + da <= p; ++a) {
      for (std::size_t b = 0; b + db <= q; ++b) {
        const std::size_t n = a * columns_q + b;
        sum.point = std::max(sum.point, difference(shifted, n).squaredNorm());
        if (is_rational()) {
          const double w = difference(weight, n);
          sum.weight = std::max(sum.weight, std::abs(w));
        }
      }
    }
    return Most{scale * std::sqrt(sum.point), scale * sum.weight};
  };
  const double pd = u_.degree, qd = v_.degree;
  const auto second = [](std::size_t step) {
    return [step](const auto& f, std::size_t n) {
      using Value = std::decay_t<decltype(f(n))>;
      return Value(f(n) - 2 * f(n + step) + f(n + 2 * step));
    };
  };
  const auto mixed = [columns_q](const auto& f, std::size_t n) {
    using Value = std::decay_t<decltype(f(n))>;
    return Value(f(n) - f(n + 1) - f(n + columns_q) + f(n + columns_q + 1));
  };
  Most uu, vv;
  if (p >= 2) uu = largest(2, 0, pd * (pd - 1), second(columns_q));
  if (q >= 2) vv = largest(0, 2, qd * (qd - 1), second(1));
  Most uv = largest(1, 1, pd * qd, mixed);
  if (is_rational()) {
    const auto first = [](std::size_t step) {
      return [step](const auto& f, std::size_t n) {
        using Value = std::decay_t<decltype(f(n))>;
        return Value(f(n + step) - f(n));
      };
    };
    const Most fu = largest(1, 0, pd, first(columns_q)), fv = largest(0, 1, qd, first(1));
    double least_weight = weight(0);
    for (std::size_t n = 1; n < component_; ++n) least_weight = std::min(least_weight, weight(n));
    const double r = bound.radius;
    const double su = (fu.point + r * fu.weight) / least_weight,
                 sv = (fv.point + r * fv.weight) / least_weight;
    uu.point = (uu.point + 2 * fu.weight * su + uu.weight * r) / least_weight;
    vv.point = (vv.point + 2 * fv.weight * sv + vv.weight * r) / least_weight;
    uv.point = (uv.point + fu.weight * sv + fv.weight * su + uv.weight * r) / least_weight;
  }

  bound.bend_uu = uu.point;
  bound.bend_uv = uv.point;
  bound.bend_vv = vv.point;

  PieceDerivatives d;
  derivatives(piece, 0.5, 0.5, d);
  const double a = d.su.norm(), b = d.sv.norm();
  bound.reach = 0;
  if (!(a > 0 && b > 0)) return;
  // In parameters scaled to unit speed at the middle: so that long, narrow pieces are not the worse for it.
  const double bend = std::max(uu.point / (a * a), vv.point / (b * b)) + uv.point / (a * b);
  const double cosine = std::abs(d.su.dot(d.sv)) / (a * b);
  const double sigma = std::sqrt(std::max(0.0, 1 - cosine)) - bend * std::hypot(a, b) / 2;
  if (sigma <= 0) return;
  bound.reach = bend > 0 ? sigma * sigma / bend : 1e300;
}

Vec2 BezierPieces::parameters(std::size_t piece, double s, double t) const {
  const auto columns_here = static_cast<std::size_t>(columns());
  const std::size_t i = piece / columns_here, j = piece % columns_here;
  const auto along = [](const std::vector<double>& bounds, std::size_t n, double x) {
    return x >= 1 ? bounds[n + 1] : bounds[n] + x * (bounds[n + 1] - bounds[n]);
  };
  return {along(u_.bounds, i, s), along(v_.bounds, j, t)};
}

std::size_t BezierPieces::locate(const Vec2& uv, double& s, double& t) const {
  const int i = u_.find(uv.x()), j = v_.find(uv.y());
  const auto part = [](const SpanExtraction& spans, int n, double x) {
    const double low = spans.bounds[static_cast<std::size_t>(n)],
                 high = spans.bounds[static_cast<std::size_t>(n) + 1];
    return std::clamp((x - low) / (high - low), 0.0, 1.0);
  };
  s = part(u_, i, uv.x());
  t = part(v_, j, uv.y());
  return index(i, j);
}

}  // namespace handloft::geometry
