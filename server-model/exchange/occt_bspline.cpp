#include "server-model/exchange/occt_bspline.h"

#include <fmt/format.h>

#include <BSplCLib.hxx>
#include <Geom2dConvert.hxx>
#include <Geom2d_TrimmedCurve.hxx>
#include <GeomConvert.hxx>
#include <Geom_BezierSurface.hxx>
#include <Geom_RectangularTrimmedSurface.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColStd_Array2OfReal.hxx>
#include <TColgp_Array1OfPnt2d.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace handloft::exchange::detail {
namespace {

using geometry::BSplineSurface;
using geometry::KnotVector;
using geometry::Vec2;
using geometry::Vec3;

std::vector<double> expanded(const TColStd_Array1OfReal& knots, const TColStd_Array1OfInteger& multiplicities,
                             int first) {
  std::vector<double> all;
  for (int i = first; i <= knots.Upper(); ++i) {
    all.insert(all.end(), static_cast<std::size_t>(multiplicities(i)), knots(i));
  }
  return all;
}

/// The library's first knot is the period's beginning, whatever its multiplicity; its first control point
/// acts in the first span.
Result<KnotVector> periodic_knots(int degree, const TColStd_Array1OfReal& knots,
                                  const TColStd_Array1OfInteger& multiplicities) {
  std::vector<double> inner = expanded(knots, multiplicities, knots.Lower() + 1);
  const auto n = static_cast<std::ptrdiff_t>(inner.size());
  inner.insert(inner.begin(), knots(knots.Lower()));
  const double period = inner.back() - inner.front();
  std::vector<double> all;
  for (std::ptrdiff_t j = -degree; j <= n + degree; ++j) {
    if (j >= 0 && j <= n) {
      all.push_back(inner[static_cast<std::size_t>(j)]);
      continue;
    }
    const std::ptrdiff_t whole = j >= 0 ? j / n : -((-j + n - 1) / n);
    all.push_back(inner[static_cast<std::size_t>(j - whole * n)] + static_cast<double>(whole) * period);
  }
  return KnotVector::periodic(degree, std::move(all));
}

Result<KnotVector> to_knots(int degree, bool periodic, const TColStd_Array1OfReal& knots,
                            const TColStd_Array1OfInteger& multiplicities) {
  return periodic ? periodic_knots(degree, knots, multiplicities)
                  : KnotVector::open(degree, expanded(knots, multiplicities, knots.Lower()));
}

struct OcctKnots {
  TColStd_Array1OfReal knots;
  TColStd_Array1OfInteger multiplicities;
};

/// Each knot once, with its multiplicity. Of a periodic vector those of one period, both ends alike.
OcctKnots to_occt_knots(const KnotVector& vector) {
  const std::vector<double>& all = vector.knots();
  const auto p = static_cast<std::size_t>(vector.degree());
  std::vector<std::pair<double, int>> found;
  const std::size_t first = vector.is_periodic() ? p : 0;
  const std::size_t end = vector.is_periodic() ? all.size() - p : all.size();
  for (std::size_t i = first; i < end; ++i) {
    if (found.empty() || found.back().first != all[i]) found.emplace_back(all[i], 0);
    ++found.back().second;
  }
  if (vector.is_periodic()) found.front().second = found.back().second;
  const int count = static_cast<int>(found.size());
  OcctKnots result{TColStd_Array1OfReal(1, count), TColStd_Array1OfInteger(1, count)};
  for (int i = 1; i <= count; ++i) {
    result.knots(i) = found[static_cast<std::size_t>(i - 1)].first;
    result.multiplicities(i) = found[static_cast<std::size_t>(i - 1)].second;
  }
  return result;
}

Error of(Error error, const char* field) {
  error.field = field;
  return error;
}

}  // namespace

Handle(Geom_BSplineSurface) bspline_of(const Handle(Geom_Surface) & surface) {
  Handle(Geom_Surface) basis = surface;
  for (;;) {
    const Handle(Geom_RectangularTrimmedSurface) trimmed =
        Handle(Geom_RectangularTrimmedSurface)::DownCast(basis);
    if (trimmed.IsNull()) break;
    basis = trimmed->BasisSurface();
  }
  if (const Handle(Geom_BezierSurface) bezier = Handle(Geom_BezierSurface)::DownCast(basis);
      !bezier.IsNull()) {
    return GeomConvert::SurfaceToBSplineSurface(bezier);
  }
  return Handle(Geom_BSplineSurface)::DownCast(basis);
}

Result<BSplineSurface> to_geometry(const Handle(Geom_BSplineSurface) & surface,
                                   const CadPlacement& placement) {
  Handle(Geom_BSplineSurface) from = surface;
  const auto knots_u = [&] {
    return to_knots(from->UDegree(), from->IsUPeriodic(), from->UKnots(), from->UMultiplicities());
  };
  const auto knots_v = [&] {
    return to_knots(from->VDegree(), from->IsVPeriodic(), from->VKnots(), from->VMultiplicities());
  };
  Result<KnotVector> u = knots_u();
  Result<KnotVector> v = knots_v();
  if ((!u && from->IsUPeriodic()) || (!v && from->IsVPeriodic())) {
    from = Handle(Geom_BSplineSurface)::DownCast(from->Copy());
    if (!u && from->IsUPeriodic()) from->SetUNotPeriodic();
    if (!v && from->IsVPeriodic()) from->SetVNotPeriodic();
    u = knots_u();
    v = knots_v();
  }
  if (!u) return of(u.error(), "knots_u");
  if (!v) return of(v.error(), "knots_v");
  if (u->control_count() != from->NbUPoles() || v->control_count() != from->NbVPoles()) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found {} x {} control points, expected {} x {}", from->NbUPoles(),
                                  from->NbVPoles(), u->control_count(), v->control_count()),
                      "control");
  }
  BSplineSurface result{std::move(*u), std::move(*v), {}, {}};
  const bool rational = from->IsURational() || from->IsVRational();
  for (int i = 1; i <= from->NbUPoles(); ++i) {
    for (int j = 1; j <= from->NbVPoles(); ++j) {
      const gp_Pnt& p = from->Pole(i, j);
      result.control.emplace_back(placement.metres_per_unit * Vec3(p.X(), p.Y(), p.Z()) +
                                  placement.translation);
      if (rational) result.weights.push_back(from->Weight(i, j));
    }
  }
  if (Status status = geometry::check(result); !status) return status.error();
  return result;
}

Result<Handle(Geom_BSplineSurface)> to_occt(const BSplineSurface& surface, const CadPlacement& placement) {
  if (Status status = geometry::check(surface); !status) return status.error();
  const OcctKnots u = to_occt_knots(surface.u);
  const OcctKnots v = to_occt_knots(surface.v);
  TColgp_Array2OfPnt poles(1, surface.u.control_count(), 1, surface.v.control_count());
  TColStd_Array2OfReal weights(1, surface.u.control_count(), 1, surface.v.control_count());
  weights.Init(1.0);
  for (int i = 0; i < surface.u.control_count(); ++i) {
    for (int j = 0; j < surface.v.control_count(); ++j) {
      const Vec3 p = (surface.at(i, j) - placement.translation) / placement.metres_per_unit;
      poles.SetValue(i + 1, j + 1, gp_Pnt(p.x(), p.y(), p.z()));
      if (surface.is_rational()) weights.SetValue(i + 1, j + 1, surface.weights[surface.index(i, j)]);
    }
  }
  return Handle(Geom_BSplineSurface)(new Geom_BSplineSurface(
      poles, weights, u.knots, v.knots, u.multiplicities, v.multiplicities, surface.u.degree(),
      surface.v.degree(), surface.u.is_periodic(), surface.v.is_periodic()));
}

void set_domain(Handle(Geom_BSplineSurface) & surface, double u0, double u1, double v0, double v1) {
  // Of a clamped surface the ends of the knots are the domain's; of another the inner ones.
  const auto stretch = [](TColStd_Array1OfReal knots, double from, double to, double lower, double upper) {
    for (double& knot : knots) {
      knot = knot == from ? lower
             : knot == to ? upper
                          : lower + (knot - from) * (upper - lower) / (to - from);
    }
    return knots;
  };
  double from_u = 0;
  double to_u = 0;
  double from_v = 0;
  double to_v = 0;
  surface->Bounds(from_u, to_u, from_v, to_v);
  if (from_u != u0 || to_u != u1) surface->SetUKnots(stretch(surface->UKnots(), from_u, to_u, u0, u1));
  if (from_v != v0 || to_v != v1) surface->SetVKnots(stretch(surface->VKnots(), from_v, to_v, v0, v1));
}

Result<TrimCurve> to_trim(const Handle(Geom2d_Curve) & curve, double first, double last, Sense sense) {
  if (curve.IsNull() || !std::isfinite(first) || !std::isfinite(last) || !(first < last)) {
    return make_error(ErrorCode::data_corrupt,
                      "found an edge without a curve in the parameters, expected one", "loops");
  }
  Handle(Geom2d_BSplineCurve) spline =
      Geom2dConvert::CurveToBSplineCurve(new Geom2d_TrimmedCurve(curve, first, last), Convert_TgtThetaOver2);
  if (spline->IsPeriodic()) spline->SetNotPeriodic();
  if (sense == Sense::reversed) spline->Reverse();
  auto knots = KnotVector::open(spline->Degree(), expanded(spline->Knots(), spline->Multiplicities(), 1));
  if (!knots) return of(knots.error(), "loops");
  TrimCurve result{std::move(*knots), {}, {}};
  for (int i = 1; i <= spline->NbPoles(); ++i) {
    const gp_Pnt2d p = spline->Pole(i);
    result.control.emplace_back(p.X(), p.Y());
    if (!result.control.back().allFinite()) {
      return make_error(ErrorCode::data_corrupt, "found a curve that is not finite", "loops");
    }
    if (spline->IsRational()) result.weights.push_back(spline->Weight(i));
  }
  return result;
}

Result<Handle(Geom2d_BSplineCurve)> to_occt(const TrimCurve& curve) {
  const auto count = static_cast<std::size_t>(curve.knots.control_count());
  if (curve.knots.is_periodic() || curve.control.size() != count ||
      (!curve.weights.empty() && curve.weights.size() != count)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} control points and {} weights, expected {} of an open curve",
                                  curve.control.size(), curve.weights.size(), count),
                      "loops");
  }
  TColgp_Array1OfPnt2d poles(1, static_cast<int>(count));
  TColStd_Array1OfReal weights(1, static_cast<int>(count));
  weights.Init(1.0);
  for (std::size_t i = 0; i < count; ++i) {
    const double weight = curve.weights.empty() ? 1.0 : curve.weights[i];
    if (!curve.control[i].allFinite() || !(weight > 0 && std::isfinite(weight))) {
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found ({}, {}) of weight {}, expected finite numbers and a weight above 0",
                      curve.control[i].x(), curve.control[i].y(), weight),
          "loops");
    }
    poles.SetValue(static_cast<int>(i) + 1, gp_Pnt2d(curve.control[i].x(), curve.control[i].y()));
    weights.SetValue(static_cast<int>(i) + 1, weight);
  }
  const OcctKnots knots = to_occt_knots(curve.knots);
  return Handle(Geom2d_BSplineCurve)(
      new Geom2d_BSplineCurve(poles, weights, knots.knots, knots.multiplicities, curve.knots.degree()));
}

}  // namespace handloft::exchange::detail
