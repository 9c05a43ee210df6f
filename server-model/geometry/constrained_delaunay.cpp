#include "server-model/geometry/constrained_delaunay.h"

#include <algorithm>
#include <cmath>
#include <deque>

namespace handloft::geometry {

namespace {

__extension__ using Wide128 = __int128;

constexpr std::int64_t lattice_side = std::int64_t{1} << 28;  ///< Of the rectangle's longer side.
constexpr std::int64_t margin = lattice_side / 2;             ///< From it to the square around all.

constexpr std::uint32_t next(std::uint32_t side) {
  return side == 2 ? 0 : side + 1;
}
constexpr std::uint32_t before(std::uint32_t side) {
  return side == 0 ? 2 : side - 1;
}

}  // namespace

ConstrainedDelaunay::ConstrainedDelaunay(const Vec2& lower, const Vec2& upper, const Vec2& scale)
    : lower_(lower) {
  const Vec2 extent = (upper - lower).cwiseProduct(scale);
  // Beyond 1 : 4096 the shorter side would have too few steps.
  const double longer = extent.maxCoeff();
  const Vec2 sides = (extent / longer).cwiseMax(1.0 / 4096) * static_cast<double>(lattice_side);
  steps_ = sides.cwiseQuotient(upper - lower);
  const std::int64_t far = lattice_side + 2 * margin;
  lattice_ = {{0, 0}, {far, 0}, {far, far}, {0, far}};
  triangle_of_ = {0, 0, 0, 1};
  triangles_ = {{{0, 1, 2}, {none, 1, none}, {}}, {{0, 2, 3}, {none, none, 0}, {}}};
}

ConstrainedDelaunay::Point ConstrainedDelaunay::to_lattice(const Vec2& place) const {
  const Vec2 at = (place - lower_).cwiseProduct(steps_);
  const auto step = [](double x) {
    return std::llround(std::clamp(x, 0.0, static_cast<double>(lattice_side))) + margin;
  };
  return {step(at.x()), step(at.y())};
}

std::int64_t ConstrainedDelaunay::turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
  const Point &p = lattice_[a], &q = lattice_[b], &r = lattice_[c];
  return (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);  // Below 2^61.
}

bool ConstrainedDelaunay::in_circle(const Triangle& t, std::uint32_t d) const {
  const Point& o = lattice_[d];
  std::array<std::int64_t, 3> x{}, y{}, square{};
  for (std::size_t k = 0; k < 3; ++k) {
    x[k] = lattice_[t.vertex[k]].x - o.x;
    y[k] = lattice_[t.vertex[k]].y - o.y;
    square[k] = x[k] * x[k] + y[k] * y[k];
  }
  Wide128 sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
    sum += static_cast<Wide128>(square[k]) * (x[l] * y[m] - y[l] * x[m]);
  }
  return sum > 0;
}

/// A triangle that holds the place, its edges and vertices included.
std::uint32_t ConstrainedDelaunay::locate(const Point& p) const {
  const auto right_of = [&](const Point& a, const Point& b) {
    return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) < 0;
  };
  std::uint32_t at = last_;
  for (std::size_t step = 0; step < triangles_.size(); ++step) {
    bool inside = true;
    // Another first side each time, so that the walk turns in no circle.
    for (std::uint32_t k = 0; k < 3 && inside; ++k) {
      const auto side = static_cast<std::uint32_t>((k + step) % 3);
      const Triangle& t = triangles_[at];
      if (!right_of(lattice_[t.vertex[next(side)]], lattice_[t.vertex[before(side)]])) continue;
      at = t.beside[side];
      inside = false;
    }
    if (inside) return last_ = at;
  }
  for (at = 0; at + 1 < triangles_.size(); ++at) {
    const Triangle& t = triangles_[at];
    bool inside = true;
    for (std::uint32_t side = 0; side < 3; ++side) {
      inside = inside && !right_of(lattice_[t.vertex[next(side)]], lattice_[t.vertex[before(side)]]);
    }
    if (inside) break;
  }
  return last_ = at;
}

/// After a triangle was written: its neighbours and vertices learn of it.
void ConstrainedDelaunay::link(std::uint32_t triangle) {
  const Triangle& t = triangles_[triangle];
  for (std::uint32_t side = 0; side < 3; ++side) {
    triangle_of_[t.vertex[side]] = triangle;
    if (t.beside[side] == none) continue;
    Triangle& other = triangles_[t.beside[side]];
    for (std::uint32_t k = 0; k < 3; ++k) {
      if (other.vertex[next(k)] == t.vertex[before(side)] &&
          other.vertex[before(k)] == t.vertex[next(side)]) {
        other.beside[k] = triangle;
      }
    }
  }
}

/// The edge opposite of vertex `side` becomes the other diagonal; that vertex is then the first of both.
void ConstrainedDelaunay::flip(std::uint32_t triangle, std::uint32_t side) {
  const Triangle t = triangles_[triangle];
  const std::uint32_t beyond = t.beside[side];
  const Triangle u = triangles_[beyond];
  std::uint32_t j = 0;
  while (u.vertex[j] == t.vertex[next(side)] || u.vertex[j] == t.vertex[before(side)]) ++j;
  const std::uint32_t p = t.vertex[side], a = t.vertex[next(side)], b = t.vertex[before(side)],
                      d = u.vertex[j];
  triangles_[triangle] = {{p, a, d},
                          {u.beside[next(j)], beyond, t.beside[before(side)]},
                          {u.fixed[next(j)], 0, t.fixed[before(side)]}};
  triangles_[beyond] = {{p, d, b},
                        {u.beside[before(j)], t.beside[next(side)], triangle},
                        {u.fixed[before(j)], t.fixed[next(side)], 0}};
  link(triangle);
  link(beyond);
}

void ConstrainedDelaunay::legalise(std::vector<Edge> suspects, std::uint32_t apex) {
  while (!suspects.empty()) {
    const Edge edge = suspects.back();
    suspects.pop_back();
    const Triangle& t = triangles_[edge.triangle];
    std::uint32_t side = 0;
    while (side < 3 && t.vertex[side] != apex) ++side;
    if (side == 3 || t.fixed[side] != 0 || t.beside[side] == none) continue;
    const Triangle& u = triangles_[t.beside[side]];
    std::uint32_t j = 0;
    while (u.vertex[j] == t.vertex[next(side)] || u.vertex[j] == t.vertex[before(side)]) ++j;
    if (!in_circle(t, u.vertex[j])) continue;
    const std::uint32_t beyond = t.beside[side];
    flip(edge.triangle, side);
    suspects.push_back({edge.triangle, 0});
    suspects.push_back({beyond, 0});
  }
}

void ConstrainedDelaunay::split_triangle(std::uint32_t triangle, std::uint32_t p) {
  const Triangle t = triangles_[triangle];
  const auto second = static_cast<std::uint32_t>(triangles_.size()), third = second + 1;
  const auto [a, b, c] = t.vertex;
  triangles_[triangle] = {{p, a, b}, {t.beside[2], second, third}, {t.fixed[2], 0, 0}};
  triangles_.push_back({{p, b, c}, {t.beside[0], third, triangle}, {t.fixed[0], 0, 0}});
  triangles_.push_back({{p, c, a}, {t.beside[1], triangle, second}, {t.fixed[1], 0, 0}});
  for (const std::uint32_t k : {triangle, second, third}) link(k);
  legalise({{triangle, 0}, {second, 0}, {third, 0}}, p);
}

void ConstrainedDelaunay::split_edge(std::uint32_t triangle, std::uint32_t side, std::uint32_t p) {
  const Triangle t = triangles_[triangle];
  const std::uint32_t beyond = t.beside[side];
  const Triangle u = triangles_[beyond];
  std::uint32_t j = 0;
  while (u.vertex[j] == t.vertex[next(side)] || u.vertex[j] == t.vertex[before(side)]) ++j;
  const std::uint32_t c = t.vertex[side], a = t.vertex[next(side)], b = t.vertex[before(side)],
                      d = u.vertex[j];
  const auto third = static_cast<std::uint32_t>(triangles_.size()), fourth = third + 1;
  triangles_[triangle] = {{p, c, a}, {t.beside[before(side)], fourth, third}, {t.fixed[before(side)], 0, 0}};
  triangles_.push_back({{p, b, c}, {t.beside[next(side)], triangle, beyond}, {t.fixed[next(side)], 0, 0}});
  triangles_[beyond] = {{p, d, b}, {u.beside[before(j)], third, fourth}, {u.fixed[before(j)], 0, 0}};
  triangles_.push_back({{p, a, d}, {u.beside[next(j)], beyond, triangle}, {u.fixed[next(j)], 0, 0}});
  for (const std::uint32_t k : {triangle, third, beyond, fourth}) link(k);
  legalise({{triangle, 0}, {third, 0}, {beyond, 0}, {fourth, 0}}, p);
}

std::uint32_t ConstrainedDelaunay::insert(const Vec2& place) {
  const Point at = to_lattice(place);
  const std::uint32_t triangle = locate(at);
  const Triangle t = triangles_[triangle];
  const auto p = static_cast<std::uint32_t>(lattice_.size());
  std::uint32_t on = 3;
  for (std::uint32_t side = 0; side < 3; ++side) {
    if (lattice_[t.vertex[side]] == at) return t.vertex[side] - static_cast<std::uint32_t>(corners);
  }
  lattice_.push_back(at);
  triangle_of_.push_back(triangle);
  for (std::uint32_t side = 0; side < 3; ++side) {
    if (turn(t.vertex[next(side)], t.vertex[before(side)], p) == 0) on = side;
  }
  if (on == 3) {
    split_triangle(triangle, p);
  } else if (t.fixed[on] != 0) {
    lattice_.pop_back();
    triangle_of_.pop_back();
    return none;
  } else {
    split_edge(triangle, on, p);
  }
  return p - static_cast<std::uint32_t>(corners);
}

/// The triangle with the directed edge a -> b and its side; none when there is no such edge. Not both may be
/// corners of the square.
ConstrainedDelaunay::Edge ConstrainedDelaunay::edge_between(std::uint32_t a, std::uint32_t b) const {
  const bool from_corner = a < corners;  // Whose ring of triangles is not closed: around the other one.
  const std::uint32_t around = from_corner ? b : a, other = from_corner ? a : b;
  std::uint32_t at = triangle_of_[around];
  const std::uint32_t first = at;
  do {
    const Triangle& t = triangles_[at];
    std::uint32_t k = 0;
    while (t.vertex[k] != around) ++k;
    if (!from_corner && t.vertex[next(k)] == other) return {at, before(k)};
    if (from_corner && t.vertex[before(k)] == other) return {at, next(k)};
    at = t.beside[next(k)];
  } while (at != first && at != none);
  return {};
}

bool ConstrainedDelaunay::constrain(std::uint32_t from, std::uint32_t to) {
  std::uint32_t a = from + static_cast<std::uint32_t>(corners);
  const std::uint32_t end = to + static_cast<std::uint32_t>(corners);
  while (a != end) {
    // Where the segment leaves a: along an edge, through a place, or across a triangle.
    std::uint32_t along = none, right = none, left = none, at = triangle_of_[a];
    const std::uint32_t first = at;
    do {
      const Triangle& t = triangles_[at];
      std::uint32_t k = 0;
      while (t.vertex[k] != a) ++k;
      const std::uint32_t r = t.vertex[next(k)], l = t.vertex[before(k)];
      const std::int64_t of_right = turn(a, end, r), of_left = turn(a, end, l);
      const auto forward = [&](std::uint32_t w) {
        const Point &p = lattice_[a], &q = lattice_[end], &x = lattice_[w];
        return (q.x - p.x) * (x.x - p.x) + (q.y - p.y) * (x.y - p.y) > 0;
      };
      if (r == end || (of_right == 0 && forward(r))) {
        along = r;
        break;
      }
      if (of_right < 0 && of_left > 0) {
        right = r, left = l;
        break;
      }
      at = t.beside[next(k)];
    } while (at != first && at != none);
    if (along == none && right == none) return false;
    std::uint32_t b = along;
    if (along == none) {
      std::deque<std::array<std::uint32_t, 2>> crossed;
      while (b == none) {
        const Edge edge = edge_between(left, right);
        if (edge.triangle == none || triangles_[edge.triangle].fixed[edge.side] != 0) return false;
        crossed.push_back({right, left});
        const std::uint32_t d = triangles_[edge.triangle].vertex[edge.side];
        const std::int64_t side = d == end ? 0 : turn(a, end, d);
        if (side == 0) {
          b = d;
        } else {
          (side > 0 ? left : right) = d;
        }
      }
      std::vector<std::array<std::uint32_t, 2>> made;
      while (!crossed.empty()) {
        const auto [p, q] = crossed.front();
        crossed.pop_front();
        const Edge edge = edge_between(p, q);
        const Triangle t = triangles_[edge.triangle];
        const Triangle& u = triangles_[t.beside[edge.side]];
        std::uint32_t j = 0;
        while (u.vertex[j] == p || u.vertex[j] == q) ++j;
        const std::uint32_t c = t.vertex[edge.side], d = u.vertex[j];
        if (turn(d, q, c) <= 0 || turn(c, p, d) <= 0) {  // No convex quadrangle yet.
          crossed.push_back({p, q});
          continue;
        }
        flip(edge.triangle, edge.side);
        const bool crosses =
            c != a && c != b && d != a && d != b && (turn(a, b, c) > 0) != (turn(a, b, d) > 0);
        if (crosses) {
          crossed.push_back({c, d});
        } else {
          made.push_back({c, d});
        }
      }
      for (bool again = true; again;) {  // Back to Delaunay, all but the constraint itself.
        again = false;
        for (auto& [c, d] : made) {
          if ((c == a && d == b) || (c == b && d == a)) continue;
          const Edge edge = edge_between(c, d);
          if (edge.triangle == none) continue;
          const Triangle t = triangles_[edge.triangle];
          if (t.fixed[edge.side] != 0 || t.beside[edge.side] == none) continue;
          const Triangle& u = triangles_[t.beside[edge.side]];
          std::uint32_t j = 0;
          while (u.vertex[j] == c || u.vertex[j] == d) ++j;
          const std::uint32_t e = u.vertex[j];
          if (!in_circle(t, e)) continue;
          flip(edge.triangle, edge.side);
          c = t.vertex[edge.side];
          d = e;
          again = true;
        }
      }
    }
    for (const auto& [p, q] : {std::array{a, b}, std::array{b, a}}) {
      const Edge edge = edge_between(p, q);
      if (edge.triangle == none) return false;
      ++triangles_[edge.triangle].fixed[edge.side];
    }
    a = b;
  }
  return true;
}

/// One a triangle: 1 inside. From the square's corner on, over every edge that was constrained an odd number
/// of times.
std::vector<std::uint8_t> ConstrainedDelaunay::parity() const {
  constexpr std::uint8_t unseen = 2;
  std::vector<std::uint8_t> odd(triangles_.size(), unseen);
  std::vector<std::uint32_t> waiting = {triangle_of_[0]};
  odd[waiting.front()] = 0;
  while (!waiting.empty()) {
    const std::uint32_t at = waiting.back();
    waiting.pop_back();
    const Triangle& t = triangles_[at];
    for (std::size_t side = 0; side < 3; ++side) {
      const std::uint32_t other = t.beside[side];
      if (other == none || odd[other] != unseen) continue;
      odd[other] = static_cast<std::uint8_t>((odd[at] + t.fixed[side]) % 2);
      waiting.push_back(other);
    }
  }
  return odd;
}

std::vector<std::array<std::uint32_t, 3>> ConstrainedDelaunay::inside() const {
  const std::vector<std::uint8_t> odd = parity();
  std::vector<std::array<std::uint32_t, 3>> result;
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    if (odd[t] != 1) continue;
    std::array<std::uint32_t, 3> vertices = triangles_[t].vertex;
    for (std::uint32_t& v : vertices) v -= static_cast<std::uint32_t>(corners);
    result.push_back(vertices);
  }
  return result;
}

std::vector<std::array<std::uint32_t, 2>> ConstrainedDelaunay::free_edges() const {
  const std::vector<std::uint8_t> odd = parity();
  std::vector<std::array<std::uint32_t, 2>> result;
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    if (odd[t] != 1) continue;
    for (std::uint32_t side = 0; side < 3; ++side) {
      const Triangle& triangle = triangles_[t];
      if (triangle.fixed[side] != 0 || triangle.beside[side] < t) continue;
      result.push_back({triangle.vertex[next(side)] - static_cast<std::uint32_t>(corners),
                        triangle.vertex[before(side)] - static_cast<std::uint32_t>(corners)});
    }
  }
  return result;
}

}  // namespace handloft::geometry
