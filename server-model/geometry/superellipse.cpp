#include "server-model/geometry/superellipse.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace handloft::geometry {
namespace {

/// Points of the auxiliary polyline along which arc length is measured: its error is far below a chord's.
constexpr int arc_length_samples = 1024;

}  // namespace

double opacity_at_level(double f) {
  if (std::isnan(f)) return 0;
  const double f2 = f * f;
  return std::clamp(std::exp(-f2 * f2 * f2 / 10), 0.0, 1.0);
}

double level_of_opacity(double opacity) {
  assert(opacity > 0 && opacity < 1);
  return std::pow(-10 * std::log(opacity), 1.0 / 6);
}

double trim_level() {
  return level_of_opacity(0.5);
}
double visible_level() {
  return level_of_opacity(1.0 / 255);
}

Result<Superellipse> Superellipse::create(const Box2& box, double exponent) {
  if (!box.centre.allFinite() || !box.half_extent.allFinite() || box.half_extent.minCoeff() < 0) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found half extents {} x {}, expected finite numbers >= 0",
                                  box.half_extent.x(), box.half_extent.y()),
                      "box");
  }
  if (!std::isfinite(exponent) || exponent <= 0) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected a finite number above 0", exponent), "exponent");
  }
  Superellipse result;
  result.box_ = box;
  const double least = std::max(min_extent_fraction * box.half_extent.maxCoeff(), min_extent_m);
  result.box_.half_extent = box.half_extent.cwiseMax(least);
  result.exponent_ = std::clamp(exponent, min_exponent, max_exponent);
  return result;
}

double Superellipse::level(const Vec2& xy) const {
  const Vec2 unit = (xy - box_.centre).cwiseQuotient(box_.half_extent).cwiseAbs();
  return std::pow(unit.x(), exponent_) + std::pow(unit.y(), exponent_);
}

Vec2 Superellipse::contour_point(double angle, double level) const {
  // f is homogeneous of degree n in (x', y'): the ray reaches the level at (level / f(direction))^(1/n).
  const Vec2 direction(std::cos(angle), std::sin(angle));
  const double f =
      std::pow(std::abs(direction.x()), exponent_) + std::pow(std::abs(direction.y()), exponent_);
  return box_.centre + std::pow(level / f, 1 / exponent_) * direction.cwiseProduct(box_.half_extent);
}

Vec2 Superellipse::contour_half_extent(double level) const {
  return box_.half_extent * std::pow(level, 1 / exponent_);
}

double Superellipse::area(double level) const {
  const double n = exponent_;
  const double log_ratio = 2 * std::lgamma(1 + 1 / n) - std::lgamma(1 + 2 / n);
  return 4 * box_.half_extent.prod() * std::exp(log_ratio) * std::pow(level, 2 / n);
}

std::vector<Vec2> Superellipse::contour(double level, int per_quadrant) const {
  assert(per_quadrant >= 1);
  // One quadrant of the unit superellipse, from (1, 0) to (0, 1), by Lame's parameter.
  std::vector<Vec2> curve;
  std::vector<double> length{0};
  curve.reserve(arc_length_samples + 1);
  length.reserve(arc_length_samples + 1);
  curve.emplace_back(1, 0);
  for (int i = 1; i <= arc_length_samples; ++i) {
    const double t = std::numbers::pi / 2 * i / arc_length_samples;
    curve.emplace_back(i == arc_length_samples ? Vec2(0, 1)
                                               : Vec2(std::pow(std::cos(t), 2 / exponent_),
                                                      std::pow(std::sin(t), 2 / exponent_)));
    length.push_back(length.back() + (curve.back() - curve[curve.size() - 2]).norm());
  }

  // Evenly spaced by length, then moved radially onto the curve itself.
  std::vector<Vec2> quadrant{Vec2(1, 0)};
  std::size_t segment = 0;
  for (int k = 1; k < per_quadrant; ++k) {
    const double wanted = length.back() * k / per_quadrant;
    while (length[segment + 1] < wanted) ++segment;
    const double step = (wanted - length[segment]) / (length[segment + 1] - length[segment]);
    const Vec2 chord_point = curve[segment] + step * (curve[segment + 1] - curve[segment]);
    const double f = std::pow(chord_point.x(), exponent_) + std::pow(chord_point.y(), exponent_);
    quadrant.push_back(chord_point * std::pow(1 / f, 1 / exponent_));
  }

  const Vec2 radius = contour_half_extent(level);
  std::vector<Vec2> result;
  result.reserve(4 * quadrant.size());
  for (int turn = 0; turn < 4; ++turn) {
    // The unit curve is symmetric under quarter turns.
    for (const Vec2& p : quadrant) {
      const Vec2 turned = turn == 0   ? p
                          : turn == 1 ? Vec2(-p.y(), p.x())
                          : turn == 2 ? Vec2(-p)
                                      : Vec2(p.y(), -p.x());
      result.push_back(box_.centre + turned.cwiseProduct(radius));
    }
  }
  return result;
}

}  // namespace handloft::geometry
