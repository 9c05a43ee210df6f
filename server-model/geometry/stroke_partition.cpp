#include "server-model/geometry/stroke_partition.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server-model/geometry/resample.h"

namespace handloft::geometry {
namespace {

/// costs[label][sample]; the last label is nobody.
using Costs = std::vector<std::vector<double>>;

double cost_of(const ProfileCandidate& candidate, const Vec3& point, double reach_m) {
  const Vec3 local = candidate.frame.to_local(point);
  const double outside = candidate.outside_m(local.head<2>());
  // Beyond the reach nobody looks closer; that also keeps the polynomial from places where it overflows.
  if (!(outside < reach_m)) return outside;
  const HeightDerivatives f = candidate.surface.derivatives(local.x(), local.y());
  // First-order distance: the height along the normal of the surface below, not of the base plane.
  const double height = std::abs(local.z() - f.value) / std::hypot(f.dx, f.dy, 1.0);
  const double distance = std::hypot(height, outside);
  return std::isfinite(distance) ? distance : std::numeric_limits<double>::infinity();
}

/// The labels of least total cost: each sample's cost times `step`, and `switch_cost` per change (Viterbi).
std::vector<std::size_t> best_labels(const Costs& costs, double step, double switch_cost) {
  const std::size_t labels = costs.size();
  const std::size_t samples = costs.front().size();
  std::vector<double> total(labels, 0.0);
  // came_from[i][k]: the label before sample i on the best way to label k.
  std::vector<std::vector<std::size_t>> came_from(samples, std::vector<std::size_t>(labels, 0));
  for (std::size_t i = 0; i < samples; ++i) {
    const std::size_t best =
        static_cast<std::size_t>(std::min_element(total.begin(), total.end()) - total.begin());
    const double change = total[best] + switch_cost;
    for (std::size_t k = 0; k < labels; ++k) {
      const bool stays = i == 0 || total[k] <= change;
      came_from[i][k] = stays ? k : best;
    }
    for (std::size_t k = 0; k < labels; ++k) {
      if (came_from[i][k] != k) total[k] = change;
      total[k] += step * costs[k][i];
    }
  }
  std::vector<std::size_t> path(samples);
  std::size_t label = static_cast<std::size_t>(std::min_element(total.begin(), total.end()) - total.begin());
  for (std::size_t i = samples; i-- > 0;) {
    path[i] = label;
    label = came_from[i][label];
  }
  return path;
}

/// Where between two samples, 0..1, the costs of the former and the next owner cross.
double crossing(double former_before, double next_before, double former_after, double next_after) {
  const double before = next_before - former_before;  // The former owner is nearer: >= 0, but for hysteresis.
  const double after = former_after - next_after;
  const double sum = before + after;
  return before >= 0 && after >= 0 && sum > 0 && std::isfinite(sum) ? before / sum : 0.5;
}

Status check_options(const PartitionOptions& options) {
  const auto refuse = [](double found, const char* field) {
    return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected a length above 0", found),
                      field);
  };
  if (!(options.reach_m > 0) || !std::isfinite(options.reach_m)) return refuse(options.reach_m, "reach_m");
  if (!(options.hysteresis_m > 0) || !std::isfinite(options.hysteresis_m)) {
    return refuse(options.hysteresis_m, "hysteresis_m");
  }
  constexpr std::size_t most_samples = 65536;
  if (options.samples < 2 || options.samples > most_samples) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 2..{}", options.samples, most_samples), "samples");
  }
  return {};
}

}  // namespace

double distance_outside(const Superellipse& superellipse, const Vec2& xy) {
  // The level grows with the n-th power along a ray, so the contour lies at a fixed fraction of the way.
  const double level = superellipse.level(xy);
  if (!(level > trim_level())) return 0;
  const double fraction = std::pow(trim_level() / level, 1.0 / superellipse.exponent());
  return (1 - fraction) * (xy - superellipse.centre()).norm();
}

Result<StrokeDivision> divide_stroke(std::span<const Vec3> points,
                                     std::span<const ProfileCandidate> candidates,
                                     const PartitionOptions& options) {
  if (Status status = check_options(options); !status.ok()) return status.error();
  auto samples = resample_evenly(points, options.samples);
  if (!samples.ok()) return samples.error();

  StrokeDivision division;
  Costs costs;
  std::vector<std::size_t> owners;  // Of each label.
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    std::vector<double> cost;
    cost.reserve(samples->size());
    for (const Vec3& sample : *samples) cost.push_back(cost_of(candidates[k], sample, options.reach_m));
    const double nearest = *std::min_element(cost.begin(), cost.end());
    division.nearest_m = std::min(division.nearest_m, nearest);
    if (!(nearest < options.reach_m)) continue;
    costs.push_back(std::move(cost));
    owners.push_back(k);
  }
  costs.emplace_back(samples->size(), options.reach_m);
  owners.push_back(nobody);

  const double length = curve_length(points);
  // A stroke without length has one owner: the nearest.
  const double step = length > 0 ? length / static_cast<double>(samples->size()) : 1.0;
  // Half a square of the hysteresis: the triangle under a cost that rises at 45 degrees over that length.
  const double switch_cost = 0.5 * options.hysteresis_m * options.hysteresis_m;
  const std::vector<std::size_t> path = best_labels(costs, step, switch_cost);

  division.owners.push_back(owners[path.front()]);
  for (std::size_t i = 1; i < path.size(); ++i) {
    const std::size_t former = path[i - 1];
    const std::size_t next = path[i];
    if (former == next) continue;
    const double between =
        crossing(costs[former][i - 1], costs[next][i - 1], costs[former][i], costs[next][i]);
    const double fraction = (static_cast<double>(i - 1) + between) / static_cast<double>(path.size() - 1);
    division.split_at.push_back(std::min(fraction, 1.0));
    division.owners.push_back(owners[next]);
  }
  return division;
}

}  // namespace handloft::geometry
