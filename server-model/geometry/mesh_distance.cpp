#include "server-model/geometry/mesh_distance.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace handloft::geometry {
namespace {

constexpr std::uint32_t triangles_per_leaf = 4;
constexpr double min_twice_area = 1e-150;  // m^2; its square is still a normal number.
// Boxes and triangles are rounded differently: what is as near within this is looked at.
constexpr double rounding = 1.0 + 1e-12;

// Where on a triangle the closest point lies; edge k runs from corner k to corner k + 1.
constexpr int on_face = 0;
constexpr int on_edge = 1;    // 1, 2, 3
constexpr int on_corner = 4;  // 4, 5, 6

double squared_distance_to_box(const Vec3& p, const Vec3& lower, const Vec3& upper) {
  return (lower - p).cwiseMax(p - upper).cwiseMax(0.0).squaredNorm();
}

struct OnTriangle {
  Vec3 point;
  int feature;
};

/// For needles whose area is lost in rounding.
OnTriangle closest_on_border(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const std::array<Vec3, 3> corners{a, b, c};
  OnTriangle best{a, on_corner};
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec3 along = corners[(k + 1) % 3] - corners[k];
    const double length = along.squaredNorm();
    const double t = length > 0 ? std::clamp((p - corners[k]).dot(along) / length, 0.0, 1.0) : 0.0;
    const Vec3 point = corners[k] + t * along;
    if ((p - point).squaredNorm() < (p - best.point).squaredNorm())
      best = {point, on_edge + static_cast<int>(k)};
  }
  return best;
}

// Ericson, "Real-Time Collision Detection", 5.1.5: by the Voronoi regions of corners, edges and face.
OnTriangle closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const Vec3 ap = p - a;
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {a, on_corner};
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {b, on_corner + 1};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {a + d1 / (d1 - d3) * ab, on_edge};
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {c, on_corner + 2};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {a + d2 / (d2 - d6) * ac, on_edge + 2};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return {b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b), on_edge + 1};
  }
  const double sum = va + vb + vc;  // The squared double area.
  if (!(sum > 0)) return closest_on_border(p, a, b, c);
  return {a + vb / sum * ab + vc / sum * ac, on_face};
}

}  // namespace

bool MeshDistance::has_area(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double twice_area = (b - a).cross(c - a).norm();
  return twice_area >= min_twice_area && std::isfinite(twice_area);
}

Result<MeshDistance> MeshDistance::create(std::span<const Vec3> positions,
                                          std::span<const std::uint32_t> indices) {
  constexpr std::size_t most = std::numeric_limits<std::uint32_t>::max() / 4;  // Half-edges fit into 32 bits.
  if (indices.size() % 3 != 0 || indices.size() / 3 > most || positions.size() > most) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} indices of {} vertices, expected three a triangle and at most {}",
                                  indices.size(), positions.size(), most),
                      "indices");
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (!positions[i].allFinite()) {
      return make_error(ErrorCode::invalid_argument, "found a coordinate that is not finite",
                        fmt::format("positions[{}]", i));
    }
  }
  MeshDistance mesh;
  mesh.positions_.assign(positions.begin(), positions.end());
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    const std::array<std::uint32_t, 3> corners{indices[i], indices[i + 1], indices[i + 2]};
    for (std::size_t k = 0; k < 3; ++k) {
      if (corners[k] >= positions.size()) {
        return make_error(ErrorCode::invalid_argument,
                          fmt::format("found {}, expected below {}", corners[k], positions.size()),
                          fmt::format("indices[{}]", i + k));
      }
    }
    if (!has_area(positions[corners[0]], positions[corners[1]], positions[corners[2]])) continue;
    mesh.triangles_.push_back(corners);
    mesh.original_.push_back(static_cast<std::uint32_t>(i / 3));
  }
  if (mesh.triangles_.empty()) {
    return make_error(ErrorCode::invalid_argument, "found no triangle with an area", "indices");
  }
  mesh.link_edges();
  mesh.sum_vertex_normals();
  mesh.build_tree();
  return mesh;
}

void MeshDistance::link_edges() {
  const auto half_edges = static_cast<std::uint32_t>(3 * triangles_.size());
  std::vector<std::uint32_t> sorted(half_edges);
  std::iota(sorted.begin(), sorted.end(), 0U);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges(half_edges);
  for (std::uint32_t h = 0; h < half_edges; ++h) {
    const std::array<std::uint32_t, 3>& corners = triangles_[h / 3];
    edges[h] = std::minmax(corners[h % 3], corners[(h % 3 + 1) % 3]);
  }
  std::sort(sorted.begin(), sorted.end(), [&](std::uint32_t a, std::uint32_t b) {
    return edges[a] != edges[b] ? edges[a] < edges[b] : a < b;
  });
  next_around_.resize(half_edges);
  for (std::uint32_t begin = 0; begin < half_edges;) {
    std::uint32_t end = begin + 1;
    while (end < half_edges && edges[sorted[end]] == edges[sorted[begin]]) ++end;
    for (std::uint32_t i = begin; i < end; ++i) next_around_[sorted[i]] = sorted[i + 1 < end ? i + 1 : begin];
    begin = end;
  }
}

Vec3 MeshDistance::face_normal(std::uint32_t triangle) const {
  const auto& [a, b, c] = triangles_[triangle];
  return (positions_[b] - positions_[a]).cross(positions_[c] - positions_[a]).normalized();
}

void MeshDistance::sum_vertex_normals() {
  vertex_normals_.assign(positions_.size(), Vec3::Zero());
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    const Vec3 normal = face_normal(t);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& at = positions_[triangles_[t][k]];
      const Vec3 to_next = positions_[triangles_[t][(k + 1) % 3]] - at;
      const Vec3 to_last = positions_[triangles_[t][(k + 2) % 3]] - at;
      const double angle = std::atan2(to_next.cross(to_last).norm(), to_next.dot(to_last));
      vertex_normals_[triangles_[t][k]] += angle * normal;
    }
  }
}

void MeshDistance::build_tree() {
  order_.resize(triangles_.size());
  std::iota(order_.begin(), order_.end(), 0U);
  std::vector<Vec3> centres(triangles_.size());
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const auto& [a, b, c] = triangles_[t];
    centres[t] = (positions_[a] + positions_[b] + positions_[c]) / 3.0;
  }
  // Halves by number along the longest side: depth log2(n / 4), so that the search's stack is bounded.
  struct Task {
    std::uint32_t begin, end;
    std::uint32_t parent;  // Whose second child this is; none for first children.
  };
  constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  std::vector<Task> tasks{{0, static_cast<std::uint32_t>(order_.size()), none}};
  while (!tasks.empty()) {
    const Task task = tasks.back();
    tasks.pop_back();
    const auto index = static_cast<std::uint32_t>(nodes_.size());
    if (task.parent != none) nodes_[task.parent].first = index;
    Node node;
    node.lower = Vec3::Constant(std::numeric_limits<double>::infinity());
    node.upper = -node.lower;
    Vec3 lower = node.lower;
    Vec3 upper = node.upper;
    for (std::uint32_t i = task.begin; i < task.end; ++i) {
      for (const std::uint32_t vertex : triangles_[order_[i]]) {
        node.lower = node.lower.cwiseMin(positions_[vertex]);
        node.upper = node.upper.cwiseMax(positions_[vertex]);
      }
      lower = lower.cwiseMin(centres[order_[i]]);
      upper = upper.cwiseMax(centres[order_[i]]);
    }
    const std::uint32_t count = task.end - task.begin;
    if (count <= triangles_per_leaf) {
      node.first = task.begin;
      node.count = count;
      nodes_.push_back(node);
      continue;
    }
    int axis = 0;
    (upper - lower).maxCoeff(&axis);
    const std::uint32_t middle = task.begin + count / 2;
    std::nth_element(order_.begin() + task.begin, order_.begin() + middle, order_.begin() + task.end,
                     [&](std::uint32_t a, std::uint32_t b) {
                       return centres[a][axis] != centres[b][axis] ? centres[a][axis] < centres[b][axis]
                                                                   : a < b;
                     });
    nodes_.push_back(node);
    tasks.push_back({middle, task.end, index});
    tasks.push_back({task.begin, middle, none});  // Next: directly behind its parent.
  }
}

MeshDistance::Candidate MeshDistance::closest_in(std::uint32_t triangle, const Vec3& point) const {
  const auto& [a, b, c] = triangles_[triangle];
  const OnTriangle on = closest_on_triangle(point, positions_[a], positions_[b], positions_[c]);
  return {(point - on.point).squaredNorm(), triangle, on.point, on.feature};
}

void MeshDistance::search(const Vec3& point, Candidate& best) const {
  struct Waiting {
    std::uint32_t node;
    double squared;
  };
  constexpr std::size_t max_depth = 64;  // The tree's depth is at most 32.
  std::array<Waiting, max_depth> stack;
  std::size_t waiting = 0;
  stack[waiting++] = {0, squared_distance_to_box(point, nodes_[0].lower, nodes_[0].upper)};
  while (waiting > 0) {
    const Waiting next = stack[--waiting];
    if (next.squared > best.squared * rounding) continue;
    const Node& node = nodes_[next.node];
    if (node.count > 0) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const Candidate candidate = closest_in(order_[i], point);
        // Of equals the lowest, so that the answer does not depend on the way to it.
        if (candidate.squared < best.squared ||
            (candidate.squared == best.squared && candidate.triangle < best.triangle)) {
          best = candidate;
        }
      }
      continue;
    }
    Waiting near{next.node + 1,
                 squared_distance_to_box(point, nodes_[next.node + 1].lower, nodes_[next.node + 1].upper)};
    Waiting far{node.first,
                squared_distance_to_box(point, nodes_[node.first].lower, nodes_[node.first].upper)};
    if (far.squared < near.squared) std::swap(near, far);
    if (far.squared <= best.squared * rounding) stack[waiting++] = far;
    if (near.squared <= best.squared * rounding) stack[waiting++] = near;
  }
}

Vec3 MeshDistance::pseudonormal(const Candidate& candidate) const {
  if (candidate.feature == on_face) return face_normal(candidate.triangle);
  if (candidate.feature >= on_corner) {
    const auto corner = static_cast<std::size_t>(candidate.feature - on_corner);
    return vertex_normals_[triangles_[candidate.triangle][corner]];
  }
  const std::uint32_t first =
      3 * candidate.triangle + static_cast<std::uint32_t>(candidate.feature - on_edge);
  Vec3 sum = Vec3::Zero();
  std::uint32_t half_edge = first;
  do {
    sum += face_normal(half_edge / 3);
    half_edge = next_around_[half_edge];
  } while (half_edge != first);
  return sum;
}

double MeshDistance::signed_distance(const Vec3& point, const Candidate& candidate) const {
  const double distance = std::sqrt(candidate.squared);
  return (point - candidate.point).dot(pseudonormal(candidate)) < 0 ? -distance : distance;
}

NearestOnMesh MeshDistance::nearest(const Vec3& point) const {
  Candidate best = closest_in(0, point);
  search(point, best);
  return {signed_distance(point, best), best.point, original_[best.triangle]};
}

Status MeshDistance::signed_distances(std::span<const Vec3> points, std::span<double> distances) const {
  if (points.size() != distances.size()) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found room for {} distances of {} points", distances.size(), points.size()),
        "distances");
  }
  std::uint32_t last = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) {
      return make_error(ErrorCode::invalid_argument, "found a coordinate that is not finite",
                        fmt::format("points[{}]", i));
    }
    Candidate best = closest_in(last, points[i]);  // A good bound where points follow one another.
    search(points[i], best);
    distances[i] = signed_distance(points[i], best);
    last = best.triangle;
  }
  return {};
}

}  // namespace handloft::geometry
