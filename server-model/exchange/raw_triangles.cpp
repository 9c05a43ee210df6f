#include "server-model/exchange/raw_triangles.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

namespace handloft::exchange::detail {
namespace {

using geometry::Vec3;

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

/// Finds points within a tolerance of one another in a hash of cubic cells.
class Welder {
 public:
  Welder(const Vec3& lower, double tolerance) : lower_(lower), tolerance_(tolerance) {}

  /// The number of the first point within the tolerance; a new one when there is none.
  std::uint32_t find_or_add(const Vec3& p, std::vector<Vec3>& points) {
    // Cells are eight tolerances wide, so that most points look into one only.
    const double cell = 8.0 * tolerance_;
    const Eigen::Array3i first = ((p - lower_).array() / cell - 0.125).floor().cast<int>();
    const Eigen::Array3i last = ((p - lower_).array() / cell + 0.125).floor().cast<int>();
    for (int x = first.x(); x <= last.x(); ++x) {
      for (int y = first.y(); y <= last.y(); ++y) {
        for (int z = first.z(); z <= last.z(); ++z) {
          const auto found = cells_.find(Key{x, y, z});
          if (found == cells_.end()) continue;
          for (std::uint32_t i = found->second; i != none; i = next_[i]) {
            if ((points[i] - p).cwiseAbs().maxCoeff() <= tolerance_) return i;
          }
        }
      }
    }
    const auto number = static_cast<std::uint32_t>(points.size());
    points.push_back(p);
    const Eigen::Array3i home = ((p - lower_).array() / cell).floor().cast<int>();
    const auto [at, fresh] = cells_.try_emplace(Key{home.x(), home.y(), home.z()}, number);
    next_.push_back(fresh ? none : at->second);
    at->second = number;
    return number;
  }

 private:
  using Key = std::array<int, 3>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      std::size_t hash = 0;
      for (const int k : key)
        hash = (hash ^ static_cast<std::size_t>(k)) * 0x9e3779b97f4a7c15U + (hash >> 29U);
      return hash;
    }
  };
  Vec3 lower_;
  double tolerance_;
  std::unordered_map<Key, std::uint32_t, Hash> cells_;
  std::vector<std::uint32_t> next_;  ///< Of the points in one cell.
};

/// As a float holds it: the document and its log keep floats.
Vec3 rounded(const Vec3& p) {
  return p.cast<float>().cast<double>();
}

/// Twice the area of a triangle seen along `normal`: positive when it winds around it.
double winding(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& normal) {
  return (b - a).cross(c - a).dot(normal);
}

}  // namespace

void append_polygon(std::span<const std::uint32_t> corners, RawTriangles& into) {
  std::vector<std::uint32_t> left(corners.begin(), corners.end());
  const auto at = [&](std::size_t k) -> const Vec3& { return into.positions[left[k % left.size()]]; };
  Vec3 normal = Vec3::Zero();
  for (std::size_t k = 1; k + 1 < left.size(); ++k) normal += (at(k) - at(0)).cross(at(k + 1) - at(0));
  // Quadratic at best and cubic at worst: long polygons, which nobody draws, become fans.
  constexpr std::size_t max_clipped = 64;
  while (left.size() > 3 && left.size() <= max_clipped) {
    std::size_t ear = left.size();
    for (std::size_t k = 0; k < left.size() && ear == left.size(); ++k) {
      const Vec3& a = at(k);
      const Vec3& b = at(k + 1);
      const Vec3& c = at(k + 2);
      if (!(winding(a, b, c, normal) > 0)) continue;
      bool empty = true;
      for (std::size_t other = 3; other < left.size() && empty; ++other) {
        const Vec3& p = at(k + other);
        empty = !(winding(a, b, p, normal) >= 0 && winding(b, c, p, normal) >= 0 &&
                  winding(c, a, p, normal) >= 0);
      }
      if (empty) ear = (k + 1) % left.size();
    }
    if (ear == left.size()) break;
    const std::size_t before = (ear + left.size() - 1) % left.size();
    into.indices.insert(into.indices.end(), {left[before], left[ear], left[(ear + 1) % left.size()]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  for (std::size_t k = 1; k + 1 < left.size(); ++k) {
    into.indices.insert(into.indices.end(), {left[0], left[k], left[k + 1]});
  }
}

std::size_t max_raw_vertices(const ReferenceOptions& options) {
  constexpr std::size_t duplicates = 6;  // Triangles around a vertex of a good mesh.
  return duplicates * options.max_vertices;
}

Status check_counts(std::size_t vertices, std::size_t triangles, const ReferenceOptions& options) {
  if (vertices > max_raw_vertices(options)) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} vertices, expected at most {}", vertices, max_raw_vertices(options)), "path");
  }
  if (triangles > options.max_triangles) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} triangles, expected at most {}", triangles, options.max_triangles), "path");
  }
  return {};
}

Result<ImportedReference> place_in_world(const RawTriangles& raw, double metres_per_unit, UpAxis up,
                                         const ReferenceOptions& options) {
  if (Status status = check_counts(raw.positions.size(), raw.indices.size() / 3, options); !status) {
    return status.error();
  }
  ImportedReference result;
  std::vector<Vec3> placed(raw.positions.size());
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const Vec3& p = raw.positions[i];
    if (!p.allFinite()) {
      return make_error(ErrorCode::data_corrupt,
                        fmt::format("vertex {} has a coordinate that is not finite", i), "path");
    }
    const Vec3 turned = up == UpAxis::y ? Vec3(p.x(), -p.z(), p.y()) : p;
    const Vec3 world = metres_per_unit * turned + options.translation;
    if (!(world.cwiseAbs().maxCoeff() <= options.max_coordinate_m)) {
      return make_error(
          ErrorCode::data_corrupt,
          fmt::format("vertex {} would lie {:.3g} m from the origin, expected at most {} m; the file "
                      "may be in other units (see scale)",
                      i, world.cwiseAbs().maxCoeff(), options.max_coordinate_m),
          "path");
    }
    placed[i] = rounded(world);
    result.lower = i == 0 ? placed[i] : Vec3(result.lower.cwiseMin(placed[i]));
    result.upper = i == 0 ? placed[i] : Vec3(result.upper.cwiseMax(placed[i]));
  }
  const double diagonal = (result.upper - result.lower).norm();
  if (!(diagonal > 0)) {
    return make_error(ErrorCode::data_corrupt, "found no triangle with an area", "path");
  }
  const double tolerance = options.weld_tolerance * diagonal;
  Welder welder(result.lower, tolerance);
  // Only vertices of triangles that stay are kept, numbered as they are first used.
  std::vector<Vec3> welded;
  std::vector<std::uint32_t> welded_of(placed.size(), none);
  const auto weld = [&](std::uint32_t vertex) {
    if (welded_of[vertex] == none) welded_of[vertex] = welder.find_or_add(placed[vertex], welded);
    return welded_of[vertex];
  };
  std::vector<std::uint32_t> kept;
  kept.reserve(raw.indices.size());
  for (std::size_t t = 0; t + 2 < raw.indices.size(); t += 3) {
    std::array<std::uint32_t, 3> corner{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (raw.indices[t + k] >= placed.size()) {
        return make_error(ErrorCode::data_corrupt,
                          fmt::format("triangle {} names vertex {}, expected below {}", t / 3,
                                      raw.indices[t + k], placed.size()),
                          "path");
      }
      corner[k] = weld(raw.indices[t + k]);
    }
    const double longest = std::max({(welded[corner[1]] - welded[corner[0]]).norm(),
                                     (welded[corner[2]] - welded[corner[1]]).norm(),
                                     (welded[corner[0]] - welded[corner[2]]).norm()});
    const double twice_area =
        (welded[corner[1]] - welded[corner[0]]).cross(welded[corner[2]] - welded[corner[0]]).norm();
    // Lower than the tolerance over its longest side: what welding would make a line.
    if (!(longest > 0) || !(twice_area > tolerance * longest)) {
      ++result.dropped_triangles;
      continue;
    }
    kept.insert(kept.end(), corner.begin(), corner.end());
  }
  if (kept.empty()) {
    return make_error(ErrorCode::data_corrupt, "found no triangle with an area", "path");
  }
  std::vector<std::uint32_t> number(welded.size(), none);
  std::size_t referenced = 0;
  for (const std::uint32_t vertex : welded_of) referenced += vertex != none ? 1U : 0U;
  result.welded_vertices = referenced - welded.size();
  result.indices.reserve(kept.size());
  for (const std::uint32_t vertex : kept) {
    if (number[vertex] == none) {
      number[vertex] = static_cast<std::uint32_t>(result.positions.size());
      result.positions.push_back(welded[vertex]);
    }
    result.indices.push_back(number[vertex]);
  }
  if (result.positions.size() > options.max_vertices) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} vertices after welding, expected at most {}",
                                  result.positions.size(), options.max_vertices),
                      "path");
  }
  return result;
}

}  // namespace handloft::exchange::detail
