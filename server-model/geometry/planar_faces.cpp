#include "server-model/geometry/planar_faces.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>

namespace handloft::geometry {
namespace {

/// Places nearer than this part of the polygon's size are one.
constexpr double same_place = 1e-9;

double cross(const Vec2& a, const Vec2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

double signed_area(const std::vector<Vec2>& loop) {
  double twice = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    twice += cross(loop[i] - loop.front(), loop[(i + 1) % loop.size()] - loop.front());
  }
  return twice / 2;
}

double distance_to_segment(const Vec2& p, const Vec2& a, const Vec2& b) {
  const double length2 = (b - a).squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(b - a) / length2, 0.0, 1.0) : 0.0;
  return (a + t * (b - a) - p).norm();
}

/// Douglas and Peucker's simplification of a closed polygon, begun at its first vertex and the farthest from
/// it.
std::vector<Vec2> simplified(std::span<const Vec2> polygon, double tolerance) {
  const std::size_t count = polygon.size();
  if (count == 0) return {};
  std::size_t far = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if ((polygon[i] - polygon[0]).norm() > (polygon[far] - polygon[0]).norm()) far = i;
  }
  std::vector<char> kept(count + 1, 0);
  kept[0] = kept[far] = kept[count] = 1;
  std::vector<std::pair<std::size_t, std::size_t>> work{{0, far}, {far, count}};
  while (!work.empty()) {
    const auto [begin, end] = work.back();
    work.pop_back();
    double worst = tolerance;
    std::size_t at = 0;
    for (std::size_t i = begin + 1; i < end; ++i) {
      const double off = distance_to_segment(polygon[i], polygon[begin], polygon[end % count]);
      if (off > worst) {
        worst = off;
        at = i;
      }
    }
    if (at == 0) continue;
    kept[at] = 1;
    work.emplace_back(begin, at);
    work.emplace_back(at, end);
  }
  std::vector<Vec2> result;
  for (std::size_t i = 0; i < count; ++i) {
    if (kept[i] != 0) result.push_back(polygon[i]);
  }
  return result;
}

/// The plane graph of a polygon and its crossings.
class Graph {
 public:
  Graph(std::vector<Vec2> polygon, const PlanarFaceOptions& options)
      : polygon_(std::move(polygon)), options_(options) {
    Vec2 lower = polygon_.front();
    Vec2 upper = polygon_.front();
    for (const Vec2& p : polygon_) {
      lower = lower.cwiseMin(p);
      upper = upper.cwiseMax(p);
    }
    grain_ = same_place * std::max((upper - lower).maxCoeff(), std::numeric_limits<double>::min());
  }

  Result<std::vector<PlanarFace>> faces() {
    if (Status status = divide(); !status.ok()) return status.error();
    connect();
    trace();
    return enclosed();
  }

 private:
  using Node = std::uint32_t;

  /// The node at a place; those within the grain are one.
  Node node_at(const Vec2& p) {
    const auto x = static_cast<std::int64_t>(std::floor((p.x() - polygon_[0].x()) / grain_));
    const auto y = static_cast<std::int64_t>(std::floor((p.y() - polygon_[0].y()) / grain_));
    for (std::int64_t i = x - 1; i <= x + 1; ++i) {
      for (std::int64_t j = y - 1; j <= y + 1; ++j) {
        const auto found = cells_.find({i, j});
        if (found != cells_.end() && (nodes_[found->second] - p).norm() <= grain_) return found->second;
      }
    }
    nodes_.push_back(p);
    const auto node = static_cast<Node>(nodes_.size() - 1);
    cells_.emplace(std::pair{x, y}, node);
    return node;
  }

  /// Edges between the vertices and crossings along each side. What is there twice is gone over twice, which
  /// by the even-odd rule is no border: it is left out.
  Status divide() {
    const std::size_t count = polygon_.size();
    std::vector<std::vector<std::pair<double, Node>>> along(count);
    for (std::size_t i = 0; i < count; ++i) {
      along[i].emplace_back(0.0, node_at(polygon_[i]));
      along[i].emplace_back(1.0, node_at(polygon_[(i + 1) % count]));
    }
    std::vector<std::size_t> order(count);  // By least x, so that only sides that may meet are looked at.
    for (std::size_t i = 0; i < count; ++i) order[i] = i;
    const auto least_x = [&](std::size_t i) {
      return std::min(polygon_[i].x(), polygon_[(i + 1) % count].x());
    };
    const auto most_x = [&](std::size_t i) {
      return std::max(polygon_[i].x(), polygon_[(i + 1) % count].x());
    };
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return std::pair{least_x(a), a} < std::pair{least_x(b), b};
    });
    std::size_t crossings = 0;
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t m = k + 1; m < count && least_x(order[m]) <= most_x(order[k]) + grain_; ++m) {
        crossings += meet(order[k], order[m], along);
        if (crossings > options_.max_crossings) {
          return make_error(
              ErrorCode::resource_exhausted,
              fmt::format("the curve crosses itself more than {} times", options_.max_crossings), "curve");
        }
      }
    }
    for (auto& places : along) {
      std::sort(places.begin(), places.end());
      for (std::size_t i = 1; i < places.size(); ++i) {
        const Node a = places[i - 1].second;
        const Node b = places[i].second;
        if (a == b) continue;
        const auto [found, inserted] = edges_.insert({std::minmax(a, b), true});
        if (!inserted) found->second = !found->second;
      }
    }
    return {};
  }

  /// Adds to two sides where they cross or touch; how many such places there are.
  std::size_t meet(std::size_t i, std::size_t j, std::vector<std::vector<std::pair<double, Node>>>& along) {
    const std::size_t count = polygon_.size();
    const Vec2& a = polygon_[i];
    const Vec2& b = polygon_[(i + 1) % count];
    const Vec2& c = polygon_[j];
    const Vec2& d = polygon_[(j + 1) % count];
    if (std::max(a.y(), b.y()) + grain_ < std::min(c.y(), d.y()) ||
        std::max(c.y(), d.y()) + grain_ < std::min(a.y(), b.y())) {
      return 0;
    }
    std::size_t found = 0;
    // Ends that lie on the other side.
    const auto touch = [&](std::size_t side, const Vec2& from, const Vec2& to, const Vec2& end) {
      const double length2 = (to - from).squaredNorm();
      const double t = length2 > 0 ? (end - from).dot(to - from) / length2 : 0;
      const Node node = node_at(end);
      if (t <= 0 || t >= 1 || (from + t * (to - from) - end).norm() > grain_) return false;
      if (node == node_at(from) || node == node_at(to)) return false;
      along[side].emplace_back(t, node);
      return true;
    };
    bool touched = false;
    for (const Vec2* end : {&c, &d}) touched = touch(i, a, b, *end) || touched;
    for (const Vec2* end : {&a, &b}) touched = touch(j, c, d, *end) || touched;
    if (touched) return 1;
    const double turn = cross(b - a, d - c);
    if (turn == 0) return found;
    const double t = cross(c - a, d - c) / turn;
    const double u = cross(c - a, b - a) / turn;
    if (!(t > 0 && t < 1 && u > 0 && u < 1)) return 0;
    const Node node = node_at(a + t * (b - a));
    along[i].emplace_back(t, node);
    along[j].emplace_back(u, node);
    return 1;
  }

  struct HalfEdge {
    Node from = 0, to = 0;
    std::size_t next = 0;
    std::size_t face = 0;
  };

  /// Half-edges in pairs; each is followed by the one that turns left the most, so that faces lie to the
  /// left.
  void connect() {
    std::vector<std::vector<std::size_t>> out(nodes_.size());
    for (const auto& [edge, odd] : edges_) {
      if (!odd) continue;
      for (const auto& [from, to] :
           {std::pair{edge.first, edge.second}, std::pair{edge.second, edge.first}}) {
        out[from].push_back(half_.size());
        half_.push_back({from, to, 0, 0});
      }
    }
    const auto angle = [&](std::size_t h) {
      const Vec2 way = nodes_[half_[h].to] - nodes_[half_[h].from];
      return std::atan2(way.y(), way.x());
    };
    for (auto& around : out) {
      std::sort(around.begin(), around.end(), [&](std::size_t a, std::size_t b) {
        return std::pair{angle(a), a} < std::pair{angle(b), b};
      });
      for (std::size_t k = 0; k < around.size(); ++k) {
        // Coming in against around[k], the next is the one clockwise of it.
        const std::size_t back = around[k] ^ 1U;
        half_[back].next = around[(k + around.size() - 1) % around.size()];
      }
    }
  }

  void trace() {
    constexpr std::size_t untraced = std::numeric_limits<std::size_t>::max();
    for (HalfEdge& h : half_) h.face = untraced;
    for (std::size_t first = 0; first < half_.size(); ++first) {
      if (half_[first].face != untraced) continue;
      std::vector<Node> walk;
      for (std::size_t h = first; half_[h].face == untraced; h = half_[h].next) {
        half_[h].face = walks_.size();
        walk.push_back(half_[h].from);
      }
      walks_.push_back(std::move(walk));
    }
  }

  std::vector<Vec2> places(const std::vector<Node>& walk) const {
    std::vector<Vec2> result;
    result.reserve(walk.size());
    for (const Node node : walk) result.push_back(nodes_[node]);
    return result;
  }

  Result<std::vector<PlanarFace>> enclosed() const {
    std::optional<std::size_t> unbounded;
    for (std::size_t w = 0; w < walks_.size(); ++w) {
      if (signed_area(places(walks_[w])) >= 0) continue;
      if (unbounded) {
        return make_error(ErrorCode::invalid_argument,
                          "found a curve that runs along itself, so that what it encloses can't be told",
                          "curve");
      }
      unbounded = w;
    }
    std::vector<PlanarFace> faces;
    if (unbounded) {
      // Inside and outside alternate across edges.
      std::vector<int> parity(walks_.size(), -1);
      parity[*unbounded] = 0;
      std::vector<std::size_t> work{*unbounded};
      std::vector<std::vector<std::size_t>> neighbours(walks_.size());
      for (std::size_t h = 0; h < half_.size(); ++h) neighbours[half_[h].face].push_back(half_[h ^ 1U].face);
      while (!work.empty()) {
        const std::size_t w = work.back();
        work.pop_back();
        for (const std::size_t n : neighbours[w]) {
          if (parity[n] >= 0) continue;
          parity[n] = 1 - parity[w];
          work.push_back(n);
        }
      }
      for (std::size_t w = 0; w < walks_.size(); ++w) {
        if (parity[w] == 1) add_simple(walks_[w], faces);
      }
    }
    if (faces.empty()) return make_error(ErrorCode::invalid_argument, "found nothing enclosed", "curve");
    std::stable_sort(faces.begin(), faces.end(),
                     [](const PlanarFace& a, const PlanarFace& b) { return a.area() > b.area(); });
    return faces;
  }

  /// A walk that comes through a vertex again is divided there into simple loops: clockwise ones are holes of
  /// the face, several counterclockwise ones are faces that touch.
  void add_simple(const std::vector<Node>& walk, std::vector<PlanarFace>& faces) const {
    std::vector<std::vector<Vec2>> outers;
    std::vector<std::vector<Vec2>> holes;
    const auto add = [&](const std::vector<Node>& loop) {
      std::vector<Vec2> border = places(loop);
      const double area = signed_area(border);
      if (std::abs(area) < options_.least_area_m2) return;
      (area > 0 ? outers : holes).push_back(std::move(border));
    };
    std::vector<Node> path;
    std::unordered_map<Node, std::size_t> on_path;
    for (const Node node : walk) {
      if (const auto found = on_path.find(node); found != on_path.end()) {
        const auto begin = path.begin() + static_cast<std::ptrdiff_t>(found->second);
        add({begin, path.end()});
        for (auto gone = begin; gone != path.end(); ++gone) on_path.erase(*gone);
        path.erase(begin, path.end());
      }
      on_path.emplace(node, path.size());
      path.push_back(node);
    }
    add(path);
    if (outers.empty()) return;
    for (auto& outer : outers) faces.push_back({std::move(outer), {}});
    // The walk is of one face: only one of its loops can go round others.
    PlanarFace& largest =
        *std::max_element(faces.end() - static_cast<std::ptrdiff_t>(outers.size()), faces.end(),
                          [](const PlanarFace& a, const PlanarFace& b) { return a.area() < b.area(); });
    largest.holes = std::move(holes);
  }

  std::vector<Vec2> polygon_;
  const PlanarFaceOptions& options_;
  double grain_ = 0;
  std::vector<Vec2> nodes_;
  std::map<std::pair<std::int64_t, std::int64_t>, Node> cells_;
  std::map<std::pair<Node, Node>, bool> edges_;  ///< Whether it is there an odd number of times.
  std::vector<HalfEdge> half_;
  std::vector<std::vector<Node>> walks_;
};

}  // namespace

double PlanarFace::area() const {
  double sum = signed_area(outer);
  for (const auto& hole : holes) sum += signed_area(hole);
  return sum;
}

Result<std::vector<PlanarFace>> planar_faces(std::span<const Vec2> polygon,
                                             const PlanarFaceOptions& options) {
  if (polygon.size() < 3) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} places, expected at least 3", polygon.size()), "curve");
  }
  for (const Vec2& p : polygon) {
    if (!p.allFinite())
      return make_error(ErrorCode::invalid_argument, "found a number that is not finite", "curve");
  }
  std::vector<Vec2> few = simplified(polygon, options.tolerance_m);
  if (few.size() > options.max_vertices) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} vertices, expected at most {}", few.size(), options.max_vertices),
                      "curve");
  }
  if (few.size() < 3) return make_error(ErrorCode::invalid_argument, "found nothing enclosed", "curve");
  return Graph(std::move(few), options).faces();
}

}  // namespace handloft::geometry
