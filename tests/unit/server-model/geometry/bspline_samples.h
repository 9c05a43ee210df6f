#pragma once
// Random B-splines of every kind, OCCT's counterparts of them, and how far two shapes lie apart.

#include <Geom_BSplineCurve.hxx>
#include <Geom_BSplineSurface.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColStd_Array2OfReal.hxx>
#include <TColgp_Array1OfPnt.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "server-model/geometry/bspline_curve.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/knot_vector.h"

namespace handloft::geometry::samples {

using Random = std::mt19937_64;

enum class Kind { clamped, unclamped, periodic };
inline constexpr Kind kinds[] = {Kind::clamped, Kind::unclamped, Kind::periodic};

inline double uniform(Random& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
}

/// Knots with uneven steps of 0.2 .. 1 (degree + 3 .. degree + 8 control values), some of them repeated up to
/// p times. An unclamped one's outer knots are simple.
inline KnotVector random_knots(Random& random, Kind kind, int degree) {
  const auto p = static_cast<std::size_t>(degree);
  const std::size_t spans = 3 + random() % 4;
  std::vector<double> inner = {uniform(random, -2, 2)};
  std::vector<double> distinct = inner;
  for (std::size_t i = 1; i <= spans; ++i) {
    distinct.push_back(distinct.back() + uniform(random, 0.2, 1));
    const std::size_t times = i == spans ? 1 : (random() % 3 == 0 ? 1 + random() % p : 1);
    inner.insert(inner.end(), times, distinct.back());
  }
  std::vector<double> knots;
  if (kind == Kind::periodic) {
    const double period = inner.back() - inner.front();
    const long n = static_cast<long>(inner.size()) - 1;
    for (long i = -degree; i <= n + degree; ++i) {
      const long k = i >= 0 ? i / n : -((-i + n - 1) / n);
      knots.push_back(inner[static_cast<std::size_t>(i - k * n)] + static_cast<double>(k) * period);
    }
    return KnotVector::periodic(degree, knots).value();
  }
  for (std::size_t i = p; i > 0; --i) {
    knots.push_back(inner.front() - (kind == Kind::unclamped ? 0.3 * static_cast<double>(i) : 0));
  }
  knots.insert(knots.end(), inner.begin(), inner.end());
  for (std::size_t i = 1; i <= p; ++i) {
    knots.push_back(inner.back() + (kind == Kind::unclamped ? 0.4 * static_cast<double>(i) : 0));
  }
  return KnotVector::open(degree, knots).value();
}

enum class Weights { none, random };

inline std::vector<double> random_weights(Random& random, std::size_t count, Weights weights) {
  std::vector<double> w;
  if (weights == Weights::random) {
    for (std::size_t i = 0; i < count; ++i) w.push_back(uniform(random, 0.5, 2));
  }
  return w;
}

inline BSplineCurve random_curve(Random& random, Kind kind, int degree, Weights weights) {
  BSplineCurve curve{random_knots(random, kind, degree), {}, {}};
  const auto n = static_cast<std::size_t>(curve.knots.control_count());
  for (std::size_t i = 0; i < n; ++i) {
    curve.control.emplace_back(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1));
  }
  curve.weights = random_weights(random, n, weights);
  return curve;
}

inline BSplineSurface random_surface(Random& random, Kind in_u, Kind in_v, int p, int q, Weights weights) {
  KnotVector u = random_knots(random, in_u, p);
  KnotVector v = random_knots(random, in_v, q);
  BSplineSurface surface{u, v, {}, {}};
  const auto n = static_cast<std::size_t>(u.control_count()) * static_cast<std::size_t>(v.control_count());
  for (std::size_t i = 0; i < n; ++i) {
    surface.control.emplace_back(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1));
  }
  surface.weights = random_weights(random, n, weights);
  return surface;
}

/// `count` parameters over the domain, the ends and all knots among them.
inline std::vector<double> parameters(const KnotVector& knots, int count) {
  std::vector<double> us = {knots.lower(), knots.upper()};
  for (const int s : knots.spans()) us.push_back(knots.knots()[static_cast<std::size_t>(s)]);
  for (int i = 0; i < count; ++i) us.push_back(knots.lower() + knots.length() * (i + 0.5) / count);
  std::sort(us.begin(), us.end());
  return us;
}

/// The largest distance at equal parameters, over the first one's domain.
inline double difference(const BSplineCurve& a, const BSplineCurve& b) {
  double worst = 0;
  for (const double u : parameters(a.knots, 50))
    worst = std::max(worst, (a.evaluate(u) - b.evaluate(u)).norm());
  return worst;
}

inline double difference(const BSplineSurface& a, const BSplineSurface& b) {
  double worst = 0;
  for (const double u : parameters(a.u, 13)) {
    for (const double v : parameters(a.v, 11)) {
      worst = std::max(worst, (a.evaluate(u, v) - b.evaluate(u, v)).norm());
    }
  }
  return worst;
}

/// A quarter of the unit circle's control polygon times four: the usual nine points, clamped, degree 2.
inline BSplineCurve circle() {
  const double w = std::sqrt(0.5);
  return {KnotVector::open(2, {0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1}).value(),
          {{1, 0, 0},
           {1, 1, 0},
           {0, 1, 0},
           {-1, 1, 0},
           {-1, 0, 0},
           {-1, -1, 0},
           {0, -1, 0},
           {1, -1, 0},
           {1, 0, 0}},
          {1, w, 1, w, 1, w, 1, w, 1}};
}

struct OcctKnots {
  explicit OcctKnots(const std::vector<double>& knots) {
    for (const double knot : knots) {
      if (!values.empty() && values.back() == knot) {
        ++times.back();
      } else {
        values.push_back(knot);
        times.push_back(1);
      }
    }
  }
  TColStd_Array1OfReal value_array() const {
    TColStd_Array1OfReal array(1, static_cast<int>(values.size()));
    for (std::size_t i = 0; i < values.size(); ++i) array.SetValue(static_cast<int>(i) + 1, values[i]);
    return array;
  }
  TColStd_Array1OfInteger times_array() const {
    TColStd_Array1OfInteger array(1, static_cast<int>(times.size()));
    for (std::size_t i = 0; i < times.size(); ++i) array.SetValue(static_cast<int>(i) + 1, times[i]);
    return array;
  }
  std::vector<double> values;
  std::vector<int> times;
};

/// Of open curves and surfaces.
inline Handle(Geom_BSplineCurve) to_occt(const BSplineCurve& curve) {
  const int n = curve.knots.control_count();
  TColgp_Array1OfPnt poles(1, n);
  TColStd_Array1OfReal weights(1, n);
  for (int i = 0; i < n; ++i) {
    const Vec3& p = curve.control[static_cast<std::size_t>(i)];
    poles.SetValue(i + 1, gp_Pnt(p.x(), p.y(), p.z()));
    weights.SetValue(i + 1, curve.is_rational() ? curve.weights[static_cast<std::size_t>(i)] : 1);
  }
  const OcctKnots knots(curve.knots.knots());
  return new Geom_BSplineCurve(poles, weights, knots.value_array(), knots.times_array(),
                               curve.knots.degree());
}

inline Handle(Geom_BSplineSurface) to_occt(const BSplineSurface& surface) {
  const int n = surface.u.control_count();
  const int m = surface.v.control_count();
  TColgp_Array2OfPnt poles(1, n, 1, m);
  TColStd_Array2OfReal weights(1, n, 1, m);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      const Vec3& p = surface.at(i, j);
      poles.SetValue(i + 1, j + 1, gp_Pnt(p.x(), p.y(), p.z()));
      weights.SetValue(i + 1, j + 1, surface.is_rational() ? surface.weights[surface.index(i, j)] : 1);
    }
  }
  const OcctKnots u(surface.u.knots());
  const OcctKnots v(surface.v.knots());
  return new Geom_BSplineSurface(poles, weights, u.value_array(), v.value_array(), u.times_array(),
                                 v.times_array(), surface.u.degree(), surface.v.degree());
}

inline Vec3 to_vec(const gp_XYZ& p) {
  return {p.X(), p.Y(), p.Z()};
}

}  // namespace handloft::geometry::samples
