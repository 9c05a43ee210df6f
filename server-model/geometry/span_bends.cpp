#include "server-model/geometry/span_bends.h"

#include <algorithm>

namespace handloft::geometry {

namespace {

std::vector<double> creases(const KnotVector& knots, const std::vector<double>& bounds) {
  std::vector<double> found;
  for (std::size_t k = 1; k + 1 < bounds.size(); ++k) {
    if (knots.multiplicity(bounds[k]) >= knots.degree()) found.push_back(bounds[k]);
  }
  return found;
}

}  // namespace

SpanBends::SpanBends(const BSplineSurface& surface) {
  const BezierPieces pieces(surface);
  us_ = pieces.u().bounds;
  vs_ = pieces.v().bounds;
  creases_u_ = creases(surface.u, us_);
  creases_v_ = creases(surface.v, vs_);
  bends_.resize(pieces.size());
  for (std::size_t i = 0; i + 1 < us_.size(); ++i) {
    for (std::size_t j = 0; j + 1 < vs_.size(); ++j) {
      const std::size_t piece = i * (vs_.size() - 1) + j;
      const PieceBound& bound = pieces.bound(piece);
      const double a = us_[i + 1] - us_[i], b = vs_[j + 1] - vs_[j];
      bends_[piece] = {bound.bend_uu / (a * a), bound.bend_uv / (a * b), bound.bend_vv / (b * b)};
    }
  }
}

Vec3 SpanBends::most(const Vec2& lower, const Vec2& upper) const {
  const auto range = [](const std::vector<double>& bounds, double low, double high) {
    const auto last = static_cast<std::ptrdiff_t>(bounds.size()) - 2;
    const auto first = std::upper_bound(bounds.begin(), bounds.end(), low) - bounds.begin() - 1;
    const auto end = std::lower_bound(bounds.begin(), bounds.end(), high) - bounds.begin() - 1;
    const auto begin = std::clamp<std::ptrdiff_t>(first, 0, last);
    return std::pair{static_cast<std::size_t>(begin), static_cast<std::size_t>(std::clamp(end, begin, last))};
  };
  const auto [i0, i1] = range(us_, lower.x(), upper.x());
  const auto [j0, j1] = range(vs_, lower.y(), upper.y());
  Vec3 most = Vec3::Zero();
  for (std::size_t i = i0; i <= i1; ++i) {
    for (std::size_t j = j0; j <= j1; ++j) most = most.cwiseMax(bends_[i * (vs_.size() - 1) + j]);
  }
  return most;
}

Vec2 SpanBends::shares(const Vec2& lower, const Vec2& upper) const {
  const Vec3 m = most(lower, upper);
  const Vec2 side = upper - lower;
  const double mixed = side.x() * side.y() * m.y();
  return Vec2(side.x() * side.x() * m.x() + mixed, side.y() * side.y() * m.z() + mixed) / 8;
}

double SpanBends::chord_bound(const Vec2& lower, const Vec2& upper) const {
  return shares(lower, upper).sum();
}

}  // namespace handloft::geometry
