// A grid about a drawn curve (A24), its triangles halved from their newest vertex where the surface bends or
// the opacity changes. Halving goes on to neighbours until no vertex lies on another triangle's side.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <vector>

#include "server-model/geometry/mesh_builder.h"

namespace handloft::geometry::detail {
namespace {

/// Squares along the shorter side of the box to begin with, and at most so many along the longer one.
constexpr double first_squares = 4;
constexpr double most_first_squares = 64;

/// Triangles larger than this part of d_max are halved before their opacities are looked at: what is finer
/// than a triangle may not show at its samples.
constexpr double largest_fade_size = 0.35;

/// Of the opacity tolerance at the places where a triangle is judged; between them it may be off by more.
constexpr double sampled_share = 0.8;

/// No opacity is sought in triangles smaller than this part of the box: 2^-12 is some 20 micrometres.
constexpr double smallest_size = 1.0 / 4096;

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

struct Triangle {
  /// Counterclockwise. The side 0-1 is halved; 2 is the newest.
  std::array<std::uint32_t, 3> corners{};
  enum class State : std::uint8_t { unknown, coarse, fine, unseen } state = State::unknown;
};

class Bisection {
 public:
  Bisection(const PolynomialSurface& surface, const BoundaryTrim& boundary,
            const TessellationOptions& options)
      : surface_(surface), boundary_(boundary), options_(options) {
    begin();
    refine();
  }

  Result<TriangleMesh> mesh(const Frame& frame) const {
    std::vector<std::uint32_t> renumbered(places_.size(), none);
    MeshBuilder builder(surface_, frame);
    std::uint32_t count = 0;
    for (const Triangle& triangle : triangles_) {
      if (triangle.state == Triangle::State::unseen) continue;
      for (const std::uint32_t corner : triangle.corners) {
        if (renumbered[corner] != none) continue;
        renumbered[corner] = count++;
        builder.vertex(places_[corner], opacity_[corner]);
      }
      builder.triangle(renumbered[triangle.corners[0]], renumbered[triangle.corners[1]],
                       renumbered[triangle.corners[2]]);
    }
    return std::move(builder).finish();
  }

 private:
  std::uint32_t add(const Vec2& xy, double opacity) {
    places_.push_back(xy);
    opacity_.push_back(opacity);
    return static_cast<std::uint32_t>(places_.size() - 1);
  }

  void begin() {
    const Box2 box = boundary_.visible_box();
    size_ = box.half_extent.maxCoeff();
    const double square = std::max(2 * box.half_extent.minCoeff() / first_squares,
                                   2 * box.half_extent.maxCoeff() / most_first_squares);
    const auto nx = static_cast<std::uint32_t>(std::ceil(2 * box.half_extent.x() / square));
    const auto ny = static_cast<std::uint32_t>(std::ceil(2 * box.half_extent.y() / square));
    const Vec2 corner = box.centre - 0.5 * square * Vec2(nx, ny);
    for (std::uint32_t i = 0; i <= nx; ++i) {
      for (std::uint32_t j = 0; j <= ny; ++j) {
        const Vec2 xy = corner + square * Vec2(i, j);
        add(xy, boundary_.opacity(xy));
      }
    }
    for (std::uint32_t i = 0; i < nx; ++i) {
      for (std::uint32_t j = 0; j < ny; ++j) {
        const std::uint32_t a = i * (ny + 1) + j;
        const std::uint32_t c = a + ny + 2;
        triangles_.push_back({{c, a, a + ny + 1}});
        triangles_.push_back({{a, c, a + 1}});
      }
    }
  }

  static std::uint64_t side(std::uint32_t a, std::uint32_t b) {
    return (std::uint64_t{std::min(a, b)} << 32U) | std::max(a, b);
  }

  struct Middle {
    double opacity = 0;
    std::uint32_t vertex = none;  ///< Once the side is halved.
  };
  /// Of a side; made when first asked for.
  Middle& middle(std::uint32_t a, std::uint32_t b) {
    const auto [found, inserted] = middles_.try_emplace(side(a, b));
    if (inserted) found->second.opacity = boundary_.opacity(0.5 * (places_[a] + places_[b]));
    return found->second;
  }
  bool halved(std::uint32_t a, std::uint32_t b) const {
    const auto found = middles_.find(side(a, b));
    return found != middles_.end() && found->second.vertex != none;
  }

  Triangle::State judge(const Triangle& triangle) {
    using State = Triangle::State;
    const Vec2& a = places_[triangle.corners[0]];
    const Vec2& b = places_[triangle.corners[1]];
    const Vec2& c = places_[triangle.corners[2]];
    const Vec2 centre = (a + b + c) / 3;
    const double radius = std::sqrt(
        std::max({(a - centre).squaredNorm(), (b - centre).squaredNorm(), (c - centre).squaredNorm()}));
    const double d = boundary_.signed_distance(centre);
    const double reach = boundary_.reach();
    // Signed distances within the triangle differ from its centre's by no more than the radius.
    if (boundary_opacity(d + radius, reach) < faintest_opacity) return State::unseen;
    // Half a right-angled square: within the circle about its longest side (a, b).
    const double length2 = (b - a).squaredNorm();
    const double bend = std::max({bend_at(surface_, a), bend_at(surface_, b), bend_at(surface_, c)});
    if (!(bend * length2 <= 8 * options_.chord_tolerance_m) &&
        length2 > smallest_size * smallest_size * size_ * size_)
      return State::coarse;
    if (length2 > 4 * size_ * size_ / (options_.min_divisions * options_.min_divisions)) return State::coarse;
    if (boundary_opacity(d - radius, reach) > 1 - options_.opacity_tolerance) return State::fine;
    if (length2 <= smallest_size * smallest_size * size_ * size_) return State::fine;
    if (radius > largest_fade_size * reach) return State::coarse;
    const double at_a = opacity_[triangle.corners[0]];
    const double at_b = opacity_[triangle.corners[1]];
    const double at_c = opacity_[triangle.corners[2]];
    const double tolerance = sampled_share * options_.opacity_tolerance;
    if (std::abs(boundary_opacity(d, reach) - (at_a + at_b + at_c) / 3) > tolerance) return State::coarse;
    const auto& [v0, v1, v2] = triangle.corners;
    if (std::abs(middle(v0, v1).opacity - 0.5 * (at_a + at_b)) > tolerance ||
        std::abs(middle(v1, v2).opacity - 0.5 * (at_b + at_c)) > tolerance ||
        std::abs(middle(v2, v0).opacity - 0.5 * (at_c + at_a)) > tolerance) {
      return State::coarse;
    }
    return State::fine;
  }

  void refine() {
    // Level by level, so that where the cap ends it, it ends everywhere alike.
    bool changed = true;
    while (changed) {
      changed = false;
      std::vector<Triangle> next;
      next.reserve(triangles_.size() + triangles_.size() / 2);
      const bool full = places_.size() >= options_.max_vertices;
      for (Triangle& triangle : triangles_) {
        if (triangle.state == Triangle::State::unknown) triangle.state = judge(triangle);
        const auto [v0, v1, v2] = triangle.corners;
        const bool wanted = triangle.state == Triangle::State::coarse && !full;
        if (!wanted && !halved(v0, v1) && !halved(v1, v2) && !halved(v2, v0)) {
          next.push_back(triangle);
          continue;
        }
        changed = true;
        Middle& half = middle(v0, v1);
        if (half.vertex == none) half.vertex = add(0.5 * (places_[v0] + places_[v1]), half.opacity);
        const auto state =
            triangle.state == Triangle::State::coarse ? Triangle::State::unknown : triangle.state;
        next.push_back({{v2, v0, half.vertex}, state});
        next.push_back({{v1, v2, half.vertex}, state});
      }
      triangles_ = std::move(next);
    }
  }

  const PolynomialSurface& surface_;
  const BoundaryTrim& boundary_;
  const TessellationOptions& options_;
  double size_ = 0;
  std::vector<Vec2> places_;
  std::vector<double> opacity_;
  std::vector<Triangle> triangles_;
  std::unordered_map<std::uint64_t, Middle> middles_;
};

}  // namespace

Result<TriangleMesh> tessellate_boundary(const PolynomialSurface& surface, const Frame& frame,
                                         const BoundaryTrim& boundary, const TessellationOptions& options) {
  return Bisection(surface, boundary, options).mesh(frame);
}

}  // namespace handloft::geometry::detail
