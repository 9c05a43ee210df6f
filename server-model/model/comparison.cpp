#include "server-model/model/comparison.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "server-model/model/operations/operations.h"
#include "server-model/model/reference_shape.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

namespace {

namespace v1 = handloft::v1;

/// Along `direction` from `start` to the surface, metres, signed: Newton's method on the height over its base
/// plane. nullopt where it does not arrive.
std::optional<double> along(const FittedSurface& surface, const geometry::Vec3& start,
                            const geometry::Vec3& direction) {
  const geometry::Vec3 p = surface.frame.to_local(start);
  const geometry::Vec3 d = surface.frame.direction_to_local(direction);
  constexpr int max_steps = 30;
  constexpr double arrived_m = 1e-12;
  double t = 0;
  for (int i = 0; i < max_steps; ++i) {
    const geometry::Vec3 at = p + t * d;
    const double above = at.z() - surface.surface.value(at.x(), at.y());
    const double slope = d.z() - surface.surface.gradient(at.x(), at.y()).dot(d.head<2>());
    const double step = above / slope;
    if (!std::isfinite(step)) return std::nullopt;
    t -= step;
    if (std::abs(step) <= arrived_m * (1.0 + std::abs(t))) return t;
  }
  return std::nullopt;
}

double rms_between(const FittedSurface& present, const FittedSurface& other) {
  constexpr int side = 33;  // Resolves degree 6 many times over.
  double sum = 0;
  int count = 0;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      const geometry::Vec2 unit(2.0 * i / (side - 1) - 1.0, 2.0 * j / (side - 1) - 1.0);
      const geometry::Vec2 at = present.box.centre + present.box.half_extent.cwiseProduct(unit);
      const auto distance =
          along(other, present.surface.world_point(present.frame, at.x(), at.y()), present.frame.normal());
      if (!distance) continue;
      sum += *distance * *distance;
      ++count;
    }
  }
  return count > 0 ? std::sqrt(sum / count) : 0.0;
}

double max_between(const PointCloud& a, const PointCloud& b) {
  double max = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    max = std::max(max, (a[i].position() - b[i].position()).norm());
  }
  return max;
}

void describe_shapes(const DualShape& present, const DualShape& other, std::vector<std::string>& words,
                     v1::EntityDifference& out) {
  const auto points = static_cast<std::ptrdiff_t>(present.points.size());
  const auto former = static_cast<std::ptrdiff_t>(other.points.size());
  const auto counted = [](std::ptrdiff_t n) { return fmt::format("{} point{}", n, n == 1 ? "" : "s"); };
  if (points > former) words.push_back(counted(points - former) + " more");
  if (points < former) words.push_back(counted(former - points) + " fewer");
  const double moved = max_between(present.points, other.points);
  if (moved > 0) words.emplace_back("points moved");
  out.set_max_point_distance_m(moved);
  if (present.fit != other.fit) {
    words.emplace_back(!other.fit ? "fitted" : (!present.fit ? "not fitted" : "fitted again"));
    if (present.fit && other.fit) out.set_rms_surface_distance_m(rms_between(*present.fit, *other.fit));
  }
  if (present.superellipse_exponent != other.superellipse_exponent || present.boundary != other.boundary)
    words.emplace_back("trimmed otherwise");
  if (present.symmetry != other.symmetry || present.partner != other.partner) {
    words.emplace_back("symmetry changed");
  }
  if (present.representation != other.representation) words.emplace_back("shown otherwise");
}

void describe_surfaces(const SculptShape& present, const SculptShape& other, std::vector<std::string>& words,
                       v1::EntityDifference& out) {
  if (present.surface != other.surface) {
    const std::vector<geometry::Vec3>&a = present.surface->control, &b = other.surface->control;
    if (a.size() != b.size()) {
      words.emplace_back("refined otherwise");
    } else {
      double most = 0;
      for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, (a[i] - b[i]).norm());
      if (most > 0) words.emplace_back("sculpted otherwise");
      out.set_max_point_distance_m(most);
    }
  }
  if (present.icons != other.icons) words.emplace_back("other icons");
  if (present.energy != other.energy || present.supports != other.supports ||
      present.absolute != other.absolute || present.least_squares != other.least_squares) {
    words.emplace_back("yields otherwise");
  }
}

void describe(const EntityPtr& present, const EntityPtr& other, v1::EntityDifference& out) {
  std::vector<std::string> words;
  if (present->name != other->name) words.push_back(fmt::format("renamed from \"{}\"", other->name));
  const DualPtr shape = as_dual(present);
  const DualPtr former = as_dual(other);
  if (shape && former) describe_shapes(*shape, *former, words, out);
  const ReferencePtr reference = as_reference(present);
  const ReferencePtr former_reference = as_reference(other);
  if (reference && former_reference && reference->mesh != former_reference->mesh) {
    words.emplace_back("another mesh");
  }
  const SculptPtr surface = as_sculpt(present);
  const SculptPtr former_surface = as_sculpt(other);
  if (surface && former_surface) describe_surfaces(*surface, *former_surface, words, out);
  if (words.empty()) words.emplace_back("changed");
  out.set_words(fmt::format("{}", fmt::join(words, ", ")));
}

}  // namespace

std::vector<v1::EntityDifference> compare_entities(const Entities& now, const Entities& then) {
  std::vector<v1::EntityDifference> differences;
  Document here, there;
  here.entities = now;
  there.entities = then;
  for (const std::string& id : difference(there, here).all()) {
    v1::EntityDifference& each = differences.emplace_back();
    each.set_entity(id);
    const EntityPtr is = here.find(id);
    const EntityPtr was = there.find(id);
    if (is && was) {
      describe(is, was, each);
    } else {
      each.set_words(is ? "added" : "removed");
    }
  }
  return differences;
}

Result<v1::QueryResult> compare(const v1::CompareQuery& query, const Document& document) {
  const auto which = require_alternative(document, query.alternative(), "compare.alternative");
  if (!which) return which.error();
  v1::QueryResult result;
  v1::CompareResult& out = *result.mutable_compare();
  if (*which == document.present) return result;
  for (v1::EntityDifference& each :
       compare_entities(document.entities, *(*document.alternatives)[*which].entities)) {
    *out.add_differences() = std::move(each);
  }
  return result;
}

}  // namespace handloft::model
