#pragma once
// Constrained Delaunay triangulations of places in a rectangle: incremental insertion with flips (Lawson),
// constraints forced by flips (Sloan, "A fast algorithm for generating constrained Delaunay triangulations",
// 1993). Places are taken to a lattice of 2^28 steps a side, on which every decision is exact in integers:
// nothing depends on rounding, and no input makes it loop.

#include <array>
#include <cstdint>
#include <vector>

#include "server-model/geometry/types.h"

namespace handloft::geometry {

class ConstrainedDelaunay {
 public:
  static constexpr std::uint32_t none = 0xffffffff;

  /// For places in the rectangle; `scale` multiplies u and v before angles count (what makes a step in u as
  /// long as one in v). Precondition: finite, an extent above 0, scale above 0.
  ConstrainedDelaunay(const Vec2& lower, const Vec2& upper, const Vec2& scale);

  /// The number of a place, from 0 in the order of insertion; an earlier one's when both have the same place
  /// on the lattice; none on a constrained edge. Places outside are brought onto the rectangle's edge.
  std::uint32_t insert(const Vec2& place);
  /// Makes the segment between two places an edge, in pieces where places lie on it. False when it would
  /// cross another one; it is then not complete.
  bool constrain(std::uint32_t from, std::uint32_t to);

  std::size_t size() const { return lattice_.size() - corners; }
  /// Triangles inside the constrained loops by the even-odd rule, counterclockwise in (u, v).
  std::vector<std::array<std::uint32_t, 3>> inside() const;
  /// Of those, each inner edge once; constrained ones are left out.
  std::vector<std::array<std::uint32_t, 2>> free_edges() const;

 private:
  static constexpr std::size_t corners = 4;  ///< Of the square around all, before the first place.
  struct Point {
    std::int64_t x = 0, y = 0;
    bool operator==(const Point&) const = default;
  };
  struct Triangle {
    std::array<std::uint32_t, 3> vertex{};  ///< Counterclockwise.
    std::array<std::uint32_t, 3> beside{};  ///< Beyond the edge opposite of each vertex.
    std::array<std::uint8_t, 3> fixed{};    ///< How often that edge was constrained.
  };
  struct Edge {
    std::uint32_t triangle = none;
    std::uint32_t side = 0;
  };

  Point to_lattice(const Vec2& place) const;
  std::int64_t turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;
  bool in_circle(const Triangle& t, std::uint32_t d) const;
  std::uint32_t locate(const Point& p) const;
  void link(std::uint32_t triangle);
  void flip(std::uint32_t triangle, std::uint32_t side);
  void legalise(std::vector<Edge> suspects, std::uint32_t apex);
  void split_triangle(std::uint32_t triangle, std::uint32_t p);
  void split_edge(std::uint32_t triangle, std::uint32_t side, std::uint32_t p);
  Edge edge_between(std::uint32_t a, std::uint32_t b) const;
  std::vector<std::uint8_t> parity() const;

  Vec2 lower_, steps_;
  std::vector<Point> lattice_;
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> triangle_of_;  ///< Any that has the vertex.
  mutable std::uint32_t last_ = 0;
};

}  // namespace handloft::geometry
