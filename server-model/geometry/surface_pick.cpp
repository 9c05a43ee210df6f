#include "server-model/geometry/surface_pick.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace handloft::geometry {
namespace {

/// Coefficients of a polynomial along a ray, in powers or in Bernstein form.
using Line = std::array<double, max_degree + 1>;

/// Heights along a ray are known to about this part of the sum of their terms.
constexpr double rounding = 1e-14;

/// Halvings of the ray's way over the trim's box before what still has several roots counts as one: 1e-12 of
/// the way.
constexpr int max_halvings = 40;

/// Places tried along a ray that lies within the surface.
constexpr int flush_samples = 256;

constexpr int max_newton_steps = 40;
constexpr int max_step_halvings = 30;
constexpr int golden_steps = 60;  ///< 0.618^60 = 3e-13 of an edge.

double binomial(int n, int k) {
  double result = 1;
  for (int i = 1; i <= k; ++i) result = result * (n - k + i) / i;
  return result;
}

Line multiplied(const Line& a, int a_degree, double constant, double slope) {
  Line result{};
  for (int i = 0; i <= a_degree; ++i) {
    const auto k = static_cast<std::size_t>(i);
    result[k] += constant * a[k];
    if (k + 1 < result.size()) result[k + 1] += slope * a[k];
  }
  return result;
}

/// Half of a Bezier polynomial by de Casteljau.
void halve(const Line& b, int degree, Line& left, Line& right) {
  Line work = b;
  for (int level = 0; level <= degree; ++level) {
    left[static_cast<std::size_t>(level)] = work[0];
    right[static_cast<std::size_t>(degree - level)] = work[static_cast<std::size_t>(degree - level)];
    for (int i = 0; i < degree - level; ++i) {
      const auto k = static_cast<std::size_t>(i);
      work[k] = 0.5 * (work[k] + work[k + 1]);
    }
  }
}

double bernstein_value(const Line& b, int degree, double t) {
  Line work = b;
  for (int level = 1; level <= degree; ++level) {
    for (int i = 0; i <= degree - level; ++i) {
      const auto k = static_cast<std::size_t>(i);
      work[k] += t * (work[k + 1] - work[k]);
    }
  }
  return work[0];
}

/// Calls `accept` for the roots over 0..1 in ascending order until it says that one will do.
template <typename Accept>
class RootSearch {
 public:
  RootSearch(int degree, double zero, const Accept& accept) : degree_(degree), zero_(zero), accept_(accept) {}

  bool search(const Line& b, double begin, double end, int depth) const {
    int changes = 0;
    double before = 0;
    double largest = 0;
    for (int i = 0; i <= degree_; ++i) {
      const double value = b[static_cast<std::size_t>(i)];
      largest = std::max(largest, std::abs(value));
      if (value == 0) continue;
      if (before != 0 && (before < 0) != (value < 0)) ++changes;
      before = value;
    }
    if (largest <= zero_) {
      for (int k = 0; k <= flush_samples; ++k) {
        if (accept_(begin + (end - begin) * k / flush_samples)) return true;
      }
      return false;
    }
    if (b[0] == 0 && accept_(begin)) return true;
    if (changes == 1) return accept_(begin + (end - begin) * single(b));
    if (changes > 1) {
      const double middle = 0.5 * (begin + end);
      if (depth >= max_halvings) return accept_(middle);
      Line left{};
      Line right{};
      halve(b, degree_, left, right);
      return search(left, begin, middle, depth + 1) || search(right, middle, end, depth + 1);
    }
    return b[static_cast<std::size_t>(degree_)] == 0 && accept_(end);
  }

 private:
  /// The only root of b over 0..1, at which it changes sign: by bisection, which can't fail.
  double single(const Line& b) const {
    double low = 0;
    double high = 1;
    double first = b[0];
    for (int i = 1; first == 0 && i <= degree_; ++i) first = b[static_cast<std::size_t>(i)];
    for (int k = 0; k < std::numeric_limits<double>::digits; ++k) {
      const double middle = 0.5 * (low + high);
      const double value = bernstein_value(b, degree_, middle);
      if (value == 0) return middle;
      ((value < 0) == (first < 0) ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }

  int degree_;
  double zero_;
  const Accept& accept_;
};

/// Narrows [begin, end] to where |position + t direction - centre| <= half. False: nowhere.
bool clip(double position, double direction, double centre, double half, double& begin, double& end) {
  if (direction == 0) return std::abs(position - centre) <= half;
  const double a = (centre - half - position) / direction;
  const double b = (centre + half - position) / direction;
  begin = std::max(begin, std::min(a, b));
  end = std::min(end, std::max(a, b));
  return begin <= end;
}

/// No height over the box is above this: |f| <= sum |c_k| |u|^i |v|^j.
double height_bound(const PolynomialSurface& surface, const Box2& box) {
  const Vec2 reach = ((box.centre - surface.box().centre).cwiseAbs() + box.half_extent)
                         .cwiseQuotient(surface.box().half_extent);
  const auto terms = monomials(surface.degree());
  double bound = 0;
  for (std::size_t k = 0; k < terms.size(); ++k) {
    bound += std::abs(surface.scaled_coefficients()[k]) * std::pow(reach.x(), terms[k].x_power) *
             std::pow(reach.y(), terms[k].y_power);
  }
  return bound;
}

SurfacePlace place_at(const PolynomialSurface& surface, const Frame& frame, const Vec2& xy, double distance) {
  return {xy, surface.world_point(frame, xy.x(), xy.y()), surface.world_normal(frame, xy.x(), xy.y()),
          distance};
}

}  // namespace

std::optional<SurfacePlace> pick_surface(const PolynomialSurface& surface, const Frame& frame,
                                         const TrimField& trim, const Vec3& origin, const Vec3& direction) {
  if (!origin.allFinite() || !direction.allFinite()) return std::nullopt;
  const Vec3 o = frame.to_local(origin);
  const Vec3 d = frame.direction_to_local(direction).stableNormalized();
  if (!(d.norm() > 0.5)) return std::nullopt;

  const Box2 box = trim.solid_box();
  const double height = height_bound(surface, box);
  if (!std::isfinite(height)) return std::nullopt;
  double begin = 0;
  double end = std::numeric_limits<double>::infinity();
  // A little wider, so that a ray along the border or a flat surface isn't lost to rounding.
  const double margin = 1e-9 * (box.half_extent.maxCoeff() + height);
  for (const int axis : {0, 1}) {
    if (!clip(o(axis), d(axis), box.centre(axis), box.half_extent(axis) + margin, begin, end))
      return std::nullopt;
  }
  if (!clip(o.z(), d.z(), 0, height + margin, begin, end) || !std::isfinite(end)) return std::nullopt;

  // g(s) = f(x(s), y(s)) - z(s) in powers of s = 0..1 over [begin, end].
  const Vec3 from = o + begin * d;
  const Vec3 way = (end - begin) * d;
  const Box2& scale = surface.box();
  const Vec2 uv0 = (from.head<2>() - scale.centre).cwiseQuotient(scale.half_extent);
  const Vec2 uv1 = way.head<2>().cwiseQuotient(scale.half_extent);
  const int degree = surface.degree();
  Line power{};
  power[0] = -from.z();
  power[1] = -way.z();
  const auto terms = monomials(degree);
  for (std::size_t k = 0; k < terms.size(); ++k) {
    Line term{};
    term[0] = surface.scaled_coefficients()[k];
    int reached = 0;
    for (int i = 0; i < terms[k].x_power; ++i) term = multiplied(term, reached++, uv0.x(), uv1.x());
    for (int j = 0; j < terms[k].y_power; ++j) term = multiplied(term, reached++, uv0.y(), uv1.y());
    for (std::size_t i = 0; i < term.size(); ++i) power[i] += term[i];
  }
  Line bernstein{};
  for (int j = 0; j <= degree; ++j) {
    for (int i = 0; i <= j; ++i) {
      bernstein[static_cast<std::size_t>(j)] +=
          binomial(j, i) / binomial(degree, i) * power[static_cast<std::size_t>(i)];
    }
  }

  std::optional<SurfacePlace> found;
  const auto accept = [&](double s) {
    const Vec2 xy = (from + s * way).head<2>();
    if (!trim.solid(xy)) return false;
    found = place_at(surface, frame, xy, begin + s * (end - begin));
    return true;
  };
  RootSearch(degree, rounding * (height + o.cwiseAbs().maxCoeff()), accept).search(bernstein, 0, 1, 0);
  return found;
}

namespace {

/// Half the squared distance from `p` (local) to the surface at xy.
double half_square(const PolynomialSurface& surface, const Vec3& p, const Vec2& xy) {
  return 0.5 * (surface.point(xy.x(), xy.y()) - p).squaredNorm();
}

/// Down from `xy` by Newton's method, with the Hessian made definite where it isn't and steps that descend.
Vec2 descend(const PolynomialSurface& surface, const Vec3& p, Vec2 xy, double size) {
  double value = half_square(surface, p, xy);
  for (int step = 0; step < max_newton_steps; ++step) {
    const HeightDerivatives f = surface.derivatives(xy.x(), xy.y());
    const double up = f.value - p.z();
    const Vec2 gradient = xy - p.head<2>() + up * Vec2(f.dx, f.dy);
    double a = 1 + f.dx * f.dx + up * f.dxx;
    const double b = f.dx * f.dy + up * f.dxy;
    double c = 1 + f.dy * f.dy + up * f.dyy;
    const double mean = (a + c) / 2;
    const double least = mean - std::hypot((a - c) / 2, b);
    // Towards steepest descent where the surface curves round the position.
    const double floor = 0.1 * (1 + f.dx * f.dx + f.dy * f.dy);
    if (least < floor * 1e-3) {
      a += floor - least;
      c += floor - least;
    }
    const double determinant = a * c - b * b;
    Vec2 move = -Vec2(c * gradient.x() - b * gradient.y(), a * gradient.y() - b * gradient.x()) / determinant;
    if (!move.allFinite()) return xy;
    if (move.norm() > size) move *= size / move.norm();
    bool lower = false;
    for (int halving = 0; halving < max_step_halvings && !lower; ++halving, move /= 2) {
      const double next = half_square(surface, p, xy + move);
      if (next <= value) {
        lower = true;
        value = next;
        xy += move;
        break;
      }
    }
    if (!lower || move.norm() <= 1e-16 * size) return xy;
  }
  return xy;
}

/// The place on the contour nearest to `p` as seen from the surface's places there.
Vec2 nearest_on_outline(const PolynomialSurface& surface, const TrimField& trim, const Vec3& p,
                        const std::vector<Vec2>& outline, int tries) {
  const Superellipse* const superellipse = trim.superellipse();
  const auto on_contour = [&](const Vec2& a, const Vec2& b, double t) -> Vec2 {
    const Vec2 chord = a + t * (b - a);
    if (superellipse == nullptr) return chord;
    const Vec2 out = chord - superellipse->centre();
    const double level = superellipse->level(chord);
    if (!(level > 0)) return chord;
    return superellipse->centre() + std::pow(trim_level() / level, 1 / superellipse->exponent()) * out;
  };
  const std::size_t count = outline.size();
  std::vector<std::pair<double, std::size_t>> edges(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double here = half_square(surface, p, outline[i]);
    const double middle = half_square(surface, p, on_contour(outline[i], outline[(i + 1) % count], 0.5));
    edges[i] = {std::min(here, middle), i};
  }
  const std::size_t tried = std::min(count, static_cast<std::size_t>(tries));
  std::partial_sort(edges.begin(), edges.begin() + static_cast<std::ptrdiff_t>(tried), edges.end());
  Vec2 best = outline[edges.front().second];
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < tried; ++k) {
    for (const std::size_t edge : {edges[k].second, (edges[k].second + count - 1) % count}) {
      const Vec2& a = outline[edge];
      const Vec2& b = outline[(edge + 1) % count];
      constexpr double golden = 0.6180339887498949;
      double low = 0;
      double high = 1;
      double left = high - golden;
      double right = low + golden;
      double left_value = half_square(surface, p, on_contour(a, b, left));
      double right_value = half_square(surface, p, on_contour(a, b, right));
      for (int step = 0; step < golden_steps; ++step) {
        if (left_value <= right_value) {
          high = right;
          right = left;
          right_value = left_value;
          left = high - golden * (high - low);
          left_value = half_square(surface, p, on_contour(a, b, left));
        } else {
          low = left;
          left = right;
          left_value = right_value;
          right = low + golden * (high - low);
          right_value = half_square(surface, p, on_contour(a, b, right));
        }
      }
      for (const double t : {0.0, 0.5 * (low + high), 1.0}) {
        const Vec2 xy = on_contour(a, b, t);
        const double value = half_square(surface, p, xy);
        if (value < least) {
          least = value;
          best = xy;
        }
      }
    }
  }
  return best;
}

}  // namespace

std::optional<SurfacePlace> nearest_solid_place(const PolynomialSurface& surface, const Frame& frame,
                                                const TrimField& trim, const Vec3& position,
                                                const NearestOptions& options) {
  if (!position.allFinite() || options.samples_per_side < 2 || options.starts < 1 ||
      options.outline_per_quadrant < 1) {
    return std::nullopt;
  }
  const Vec3 p = frame.to_local(position);
  const Box2 box = trim.solid_box();
  const double size = box.half_extent.norm();
  std::vector<std::pair<double, std::size_t>> order;
  std::vector<Vec2> places;
  const auto add = [&](const Vec2& xy) {
    order.emplace_back(half_square(surface, p, xy), places.size());
    places.push_back(xy);
  };
  const double last = options.samples_per_side - 1;
  for (int i = 0; i < options.samples_per_side; ++i) {
    for (int j = 0; j < options.samples_per_side; ++j) {
      const Vec2 xy = box.lower() + 2 * Vec2(i / last, j / last).cwiseProduct(box.half_extent);
      if (trim.solid(xy)) add(xy);
    }
  }
  add(trim.core());
  add(p.head<2>());  // A foot may be near even where no sample is solid.
  const std::vector<Vec2> outline = trim.outline(options.outline_per_quadrant);
  Vec2 best = nearest_on_outline(surface, trim, p, outline, options.starts);
  double least = half_square(surface, p, best);
  const std::size_t starts = std::min(order.size(), static_cast<std::size_t>(options.starts));
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(starts), order.end());
  for (std::size_t k = 0; k < starts; ++k) {
    const Vec2 xy = descend(surface, p, places[order[k].second], size);
    const double value = half_square(surface, p, xy);
    if (value < least && trim.solid(xy)) {
      least = value;
      best = xy;
    }
  }
  SurfacePlace place = place_at(surface, frame, best, 0);
  place.distance_m = (place.position - position).norm();
  if (!std::isfinite(place.distance_m) || !place.normal.allFinite()) return std::nullopt;
  return place;
}

}  // namespace handloft::geometry
