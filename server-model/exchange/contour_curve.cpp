#include "server-model/exchange/contour_curve.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace handloft::exchange::detail {
namespace {

using geometry::Superellipse;
using geometry::Vec2;
using geometry::Vec3;

/// Halvings of a quarter: towards a tip where the curvature is infinite (1 < n < 2) the pieces shrink
/// geometrically, and 24 halvings reach 1e-7 of the quarter.
constexpr int max_depth = 24;

/// For a box side that is itself as thin as a tip: an arm then ends here, as a fraction of the way from the
/// tip to the diagonal in terms of its width.
constexpr double widest_cut = 0.5;

/// The ends of the quarter of |x|^n + |y|^n = 1 in which x' and y' have these radii (metres).
struct QuarterEnds {
  Vec2 begin{1, 0}, end{0, 1};
};

QuarterEnds quarter_ends(double n, const Vec2& radius) {
  if (n >= 1) return {};
  const Vec2 half_width =
      (0.5 * min_tip_width_m * radius.cwiseInverse()).cwiseMin(widest_cut * std::pow(0.5, 1 / n));
  const auto along = [n](double across) { return std::pow(1 - std::pow(across, n), 1 / n); };
  return {{along(half_width.y()), half_width.y()}, {half_width.x(), along(half_width.x())}};
}

/// A joint of the spline; the tangents are derivatives by the common parameter.
struct Joint {
  Vec2 unit;  ///< On |x|^n + |y|^n = 1, first quadrant.
  Vec2 plane, plane_tangent;
  Vec3 space, space_tangent;
  Vec2 unit_tangent;  ///< Length 1.
};

struct Piece {
  Joint begin, end;
  double length = 0;  ///< Of the parameter.
};

template <typename Point>
Point hermite(const Point& p0, const Point& d0, const Point& p1, const Point& d1, double length, double t) {
  const double s = 1 - t;
  return (s * s * (1 + 2 * t)) * p0 + (s * s * t * length) * d0 + (t * t * (3 - 2 * t)) * p1 -
         (t * t * s * length) * d1;
}

class QuarterBuilder {
 public:
  QuarterBuilder(const SurfaceExport& item, double level, const ContourTolerance& tolerance, int quarter)
      : item_(item),
        n_(item.superellipse.exponent()),
        radius_(item.superellipse.contour_half_extent(level)),
        tolerance_(tolerance),
        quarter_(quarter) {}

  ContourArc build() {
    const double diagonal = std::pow(0.5, 1 / n_);
    const bool swapped = quarter_ % 2 == 1;  // The quarter's own x runs along y.
    const QuarterEnds ends = quarter_ends(n_, swapped ? Vec2(radius_.y(), radius_.x()) : radius_);
    const Joint start = joint(ends.begin);
    const Joint middle = joint({diagonal, diagonal});
    const Joint end = joint(ends.end);
    split(start, middle, 0);
    split(middle, end, 0);
    return splines();
  }

  /// The straight end of the tip at this quarter's end; nothing where the tip is whole.
  std::optional<ContourArc> build_tip() {
    if (n_ >= 1) return std::nullopt;
    const bool swapped = quarter_ % 2 == 1;
    const Vec2 end = quarter_ends(n_, swapped ? Vec2(radius_.y(), radius_.x()) : radius_).end;
    Joint from = joint(end);
    Joint to = joint({-end.x(), end.y()});
    const Vec2 across = to.plane - from.plane;
    const double length = across.norm();
    for (Joint* j : {&from, &to}) set_tangent(*j, across / length);
    pieces_ = {{from, to, length}};
    return splines();
  }

 private:
  ContourArc splines() const {
    return {
        spline<Vec2>([](const Joint& j) { return j.plane; }, [](const Joint& j) { return j.plane_tangent; }),
        spline<Vec3>([](const Joint& j) { return j.space; }, [](const Joint& j) { return j.space_tangent; })};
  }

  /// A quarter turn of the unit curve for each quarter.
  Vec2 turned(const Vec2& p) const {
    switch (quarter_) {
      case 0:
        return p;
      case 1:
        return {-p.y(), p.x()};
      case 2:
        return -p;
      default:
        return {p.y(), -p.x()};
    }
  }

  Joint joint(const Vec2& unit) const {
    Joint j;
    j.unit = unit;
    // Across the gradient (x^(n-1), y^(n-1)); for n < 1 that is infinite at the tips: times (x y)^(1-n).
    const Vec2 size = unit.cwiseAbs();
    const Vec2 gradient = n_ >= 1 ? Vec2(std::pow(size.x(), n_ - 1), std::pow(size.y(), n_ - 1))
                                  : Vec2(std::pow(size.y(), 1 - n_), std::pow(size.x(), 1 - n_));
    j.unit_tangent = Vec2(-gradient.y(), gradient.x()).normalized();
    j.plane = item_.superellipse.centre() + turned(unit).cwiseProduct(radius_);
    const double scale = 1 / radius_.maxCoeff();  // The parameter is about a length in metres.
    j.space = item_.surface.world_point(item_.frame, j.plane.x(), j.plane.y());
    set_tangent(j, turned(j.unit_tangent).cwiseProduct(radius_) * scale);
    return j;
  }

  void set_tangent(Joint& j, const Vec2& plane_tangent) const {
    j.plane_tangent = plane_tangent;
    const Vec2 slope = item_.surface.gradient(j.plane.x(), j.plane.y());
    j.space_tangent = item_.frame.direction_to_world(
        {j.plane_tangent.x(), j.plane_tangent.y(), slope.dot(j.plane_tangent)});
  }

  Vec2 onto_curve(const Vec2& unit) const {
    const Vec2 p = unit.cwiseMax(0.0);
    const double f = std::pow(p.x(), n_) + std::pow(p.y(), n_);
    return p * std::pow(f, -1 / n_);
  }

  /// First-order distance from the unit curve, in its units.
  double distance(const Vec2& p) const {
    const Vec2 a = p.cwiseAbs();
    const double f = std::pow(a.x(), n_) + std::pow(a.y(), n_);
    const double radial = a.norm() * std::abs(1 - std::pow(f, -1 / n_));
    const double slope = n_ * std::hypot(std::pow(a.x(), n_ - 1), std::pow(a.y(), n_ - 1));
    return std::isfinite(slope) && slope > 0 ? std::min(radial, std::abs(f - 1) / slope) : radial;
  }

  void split(const Joint& a, const Joint& b, int depth) {
    // Tangent length of the cubic that is best for a circular arc: chord / cos^2(turn / 4).
    const double chord = (b.unit - a.unit).norm();
    const double turn = std::acos(std::clamp(a.unit_tangent.dot(b.unit_tangent), -1.0, 1.0));
    const double cosine = std::cos(turn / 4);
    const double length = chord / (cosine * cosine) * radius_.maxCoeff();

    bool close = turn < 1.0;  // Radians: the formula is for gentle arcs.
    for (const double t : {0.25, 0.5, 0.75}) {
      if (!close) break;
      const double unit_length = length / radius_.maxCoeff();
      const Vec2 unit = hermite(a.unit, a.unit_tangent, b.unit, b.unit_tangent, unit_length, t);
      const Vec2 plane = hermite(a.plane, a.plane_tangent, b.plane, b.plane_tangent, length, t);
      const Vec3 space = hermite(a.space, a.space_tangent, b.space, b.space_tangent, length, t);
      const Vec3 expected = item_.surface.world_point(item_.frame, plane.x(), plane.y());
      close = distance(unit) * radius_.maxCoeff() <= tolerance_.plane_m &&
              (space - expected).norm() <= tolerance_.space_m;
    }
    if (close || depth >= max_depth) {
      pieces_.push_back({a, b, length});
      return;
    }
    const Joint middle = joint(onto_curve(0.5 * (a.unit + b.unit)));
    split(a, middle, depth + 1);
    split(middle, b, depth + 1);
  }

  template <typename Point, typename PositionOf, typename TangentOf>
  CubicSpline<Point> spline(const PositionOf& position, const TangentOf& tangent) const {
    CubicSpline<Point> result;
    double parameter = 0;
    result.knots.push_back(parameter);
    result.poles.push_back(position(pieces_.front().begin));
    for (const Piece& piece : pieces_) {
      result.poles.push_back(position(piece.begin) + piece.length / 3 * tangent(piece.begin));
      result.poles.push_back(position(piece.end) - piece.length / 3 * tangent(piece.end));
      parameter += piece.length;
      result.knots.push_back(parameter);
    }
    result.poles.push_back(position(pieces_.back().end));
    return result;
  }

  const SurfaceExport& item_;
  double n_;
  Vec2 radius_;
  ContourTolerance tolerance_;
  int quarter_;
  std::vector<Piece> pieces_;
};

}  // namespace

std::vector<ContourArc> contour_arcs(const SurfaceExport& item, double level,
                                     const ContourTolerance& tolerance) {
  std::vector<ContourArc> arcs;
  for (int quarter = 0; quarter < 4; ++quarter) {
    arcs.push_back(QuarterBuilder(item, level, tolerance, quarter).build());
    if (auto tip = QuarterBuilder(item, level, tolerance, quarter).build_tip()) {
      arcs.push_back(std::move(*tip));
    }
  }
  return arcs;
}

Vec2 boundary_half_extent(const Superellipse& superellipse, double level) {
  const Vec2 radius = superellipse.contour_half_extent(level);
  const QuarterEnds ends = quarter_ends(superellipse.exponent(), radius);
  return radius.cwiseProduct(Vec2(ends.begin.x(), ends.end.y()));
}

}  // namespace handloft::exchange::detail
