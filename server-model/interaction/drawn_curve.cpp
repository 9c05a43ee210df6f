#include "server-model/interaction/drawn_curve.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace handloft::interaction {
namespace {

using Eigen::Vector3d;

/// Places at equal steps along the polyline, its ends among them.
std::vector<Vector3d> evenly(const std::vector<Vector3d>& points, double length_m, std::size_t steps) {
  std::vector<Vector3d> places{points.front()};
  places.reserve(steps + 1);
  const double step_m = length_m / static_cast<double>(steps);
  double before_m = 0;
  std::size_t k = 1;
  for (std::size_t i = 1; i < steps; ++i) {
    const double at_m = step_m * static_cast<double>(i);
    double span_m = (points[k] - points[k - 1]).norm();
    while (k + 1 < points.size() && before_m + span_m < at_m) {
      before_m += span_m;
      ++k;
      span_m = (points[k] - points[k - 1]).norm();
    }
    const double t = span_m > 0 ? std::clamp((at_m - before_m) / span_m, 0.0, 1.0) : 0.0;
    places.push_back(points[k - 1] + t * (points[k] - points[k - 1]));
  }
  places.push_back(points.back());
  return places;
}

/// Gaussian means whose window narrows towards the ends, so that those stay and nothing shrinks.
std::vector<Vector3d> smoothed(const std::vector<Vector3d>& places, double sigma_steps) {
  constexpr double window_sigmas = 3;
  const auto widest = static_cast<std::size_t>(std::ceil(window_sigmas * sigma_steps));
  std::vector<Vector3d> result(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const std::size_t half = std::min({widest, i, places.size() - 1 - i});
    Vector3d sum = places[i];
    double weights = 1;
    for (std::size_t k = 1; k <= half; ++k) {
      const double x = static_cast<double>(k) / sigma_steps;
      const double weight = std::exp(-0.5 * x * x);
      sum += weight * (places[i - k] + places[i + k]);
      weights += 2 * weight;
    }
    result[i] = sum / weights;
  }
  return result;
}

double distance_to_chord(const Vector3d& place, const Vector3d& from, const Vector3d& to) {
  const Vector3d way = to - from;
  const double length2 = way.squaredNorm();
  if (!(length2 > 0)) return (place - from).norm();
  return (place - from - std::clamp((place - from).dot(way) / length2, 0.0, 1.0) * way).norm();
}

/// Douglas and Peucker, 1973.
std::vector<Vector3d> thinned(const std::vector<Vector3d>& places, double tolerance_m) {
  std::vector<bool> keep(places.size(), false);
  keep.front() = keep.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> spans{{0, places.size() - 1}};
  while (!spans.empty()) {
    const auto [from, to] = spans.back();
    spans.pop_back();
    double most = tolerance_m;
    std::size_t at = from;
    for (std::size_t i = from + 1; i < to; ++i) {
      const double distance = distance_to_chord(places[i], places[from], places[to]);
      if (!(distance > most)) continue;
      most = distance;
      at = i;
    }
    if (at == from) continue;
    keep[at] = true;
    spans.emplace_back(from, at);
    spans.emplace_back(at, to);
  }
  std::vector<Vector3d> result;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (keep[i]) result.push_back(places[i]);
  }
  return result;
}

}  // namespace

std::vector<Vector3d> smooth_and_thin(const std::vector<Vector3d>& points, const DrawnCurveOptions& options) {
  double length_m = 0;
  for (std::size_t i = 1; i < points.size(); ++i) length_m += (points[i] - points[i - 1]).norm();
  if (!(length_m > 0)) return points;
  const double wanted = std::ceil(length_m / options.spacing_m);
  const double most = static_cast<double>(std::max<std::size_t>(options.max_places, 2) - 1);
  const auto steps = static_cast<std::size_t>(std::clamp(wanted, 1.0, most));
  const double step_m = length_m / static_cast<double>(steps);
  return thinned(smoothed(evenly(points, length_m, steps), options.smoothing_m / step_m),
                 options.tolerance_m);
}

}  // namespace handloft::interaction
