#include "server-model/geometry/bspline_tessellate.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "server-model/geometry/surface_cells.h"

namespace handloft::geometry {

namespace detail {

namespace {

/// Of the surface's size: rows of control points nearer than this are one.
constexpr double joint_tolerance = 1e-12;
constexpr double least_tolerance_m = 1e-9;
constexpr std::size_t most_vertices = 4'000'000;
constexpr int cells_around = 4;  ///< Of a closed direction: with two or three, triangles would fold together.
constexpr double least_cell = 1e-9;  ///< Of the domain.

/// Whether two rows (or columns) of control points and weights are the same, or one is a single point.
struct Rows {
  const BSplineSurface& surface;
  double slack;

  Vec3 at(Vec2::Index axis, int line, int k) const {
    return axis == 0 ? surface.at(line, k) : surface.at(k, line);
  }
  double weight(Vec2::Index axis, int line, int k) const {
    if (!surface.is_rational()) return 1;
    return surface.weights[axis == 0 ? surface.index(line, k) : surface.index(k, line)];
  }
  bool same(Vec2::Index axis, int a, int b) const {
    const int n = axis == 0 ? surface.v.control_count() : surface.u.control_count();
    // Weights of one edge may be the other's times a number.
    const double ratio = weight(axis, a, 0) / weight(axis, b, 0);
    for (int k = 0; k < n; ++k) {
      if ((at(axis, a, k) - at(axis, b, k)).norm() > slack) return false;
      if (std::abs(weight(axis, a, k) / weight(axis, b, k) - ratio) > joint_tolerance * ratio) return false;
    }
    return true;
  }
  bool point(Vec2::Index axis, int line) const {
    const int n = axis == 0 ? surface.v.control_count() : surface.u.control_count();
    for (int k = 1; k < n; ++k) {
      if ((at(axis, line, k) - at(axis, line, 0)).norm() > slack) return false;
    }
    return true;
  }
};

bool clamped_ends(const KnotVector& knots) {
  return !knots.is_periodic() && knots.multiplicity(knots.lower()) > knots.degree() &&
         knots.multiplicity(knots.upper()) > knots.degree();
}

}  // namespace

SurfaceJoints::SurfaceJoints(const BSplineSurface& surface) {
  Box3 box;
  for (const Vec3& p : surface.control) box.include(p);
  const Rows rows{surface, joint_tolerance * (box.upper - box.lower).norm()};
  const int last_u = surface.u.control_count() - 1, last_v = surface.v.control_count() - 1;
  closed_u = surface.u.is_periodic();
  closed_v = surface.v.is_periodic();
  if (clamped_ends(surface.u)) {
    closed_u = rows.same(0, 0, last_u);
    pole_u_lower = rows.point(0, 0);
    pole_u_upper = rows.point(0, last_u);
  }
  if (clamped_ends(surface.v)) {
    closed_v = rows.same(1, 0, last_v);
    pole_v_lower = rows.point(1, 0);
    pole_v_upper = rows.point(1, last_v);
  }
}

std::vector<SurfaceCell> surface_cells(const BSplineSurface& surface, const SpanBends& bends,
                                       const SurfaceJoints& joints, const SurfaceMeshOptions& options) {
  const Vec2 domain(surface.u.length(), surface.v.length());
  const std::array<bool, 2> closed = {joints.closed_u, joints.closed_v};
  const std::array<const std::vector<double>*, 2> bounds = {&bends.us(), &bends.vs()};
  const std::array<const std::vector<double>*, 2> creases = {&bends.creases_u(), &bends.creases_v()};
  /// Where to halve along an axis: at the crease or the knot nearest to the middle, within a span in its
  /// middle.
  const auto cut_at = [](const std::vector<double>& lines, double low, double high) {
    const double middle = low + (high - low) / 2;
    const auto above = std::lower_bound(lines.begin(), lines.end(), middle);
    double best = low;
    for (const auto& line : {above, above == lines.begin() ? above : above - 1}) {
      if (line == lines.end() || *line <= low || *line >= high) continue;
      if (best == low || std::abs(*line - middle) < std::abs(best - middle)) best = *line;
    }
    return best;  // low: none inside.
  };
  std::vector<SurfaceCell> done, next;
  std::vector<SurfaceCell> open = {
      {{surface.u.lower(), surface.v.lower()}, {surface.u.upper(), surface.v.upper()}}};
  while (!open.empty()) {
    next.clear();
    for (const SurfaceCell& cell : open) {
      int axis = -1;
      double at = 0;
      for (int a = 0; a < 2 && axis < 0; ++a) {
        const auto k = static_cast<std::size_t>(a);
        at = cut_at(*creases[k], cell.lower[a], cell.upper[a]);
        if (at != cell.lower[a]) axis = a;
      }
      const Vec2 side = cell.upper - cell.lower;
      for (int a = 0; a < 2 && axis < 0; ++a) {
        if (closed[static_cast<std::size_t>(a)] && side[a] > domain[a] / cells_around * (1 + 1e-9))
          axis = a, at = cell.lower[a];
      }
      if (axis < 0) {
        const Vec2 shares = bends.shares(cell.lower, cell.upper);
        // Four triangles meet in most corners: about as many vertices as boxes.
        const bool full = done.size() + open.size() + next.size() >= options.max_vertices;
        const Vec2 wide = side.cwiseQuotient(domain) / (options.largest_cell * (1 + 1e-9));
        const bool too_wide = wide.maxCoeff() > 1;
        if ((!(shares.sum() > options.chord_tolerance_m) && !too_wide) || full ||
            (side - least_cell * domain).minCoeff() <= 0) {
          done.push_back(cell);
          continue;
        }
        axis = (too_wide ? wide.x() >= wide.y() : shares.x() >= shares.y()) ? 0 : 1;
        at = cell.lower[axis];
      }
      if (at == cell.lower[axis]) {
        const bool around =
            closed[static_cast<std::size_t>(axis)] && side[axis] > domain[axis] / cells_around;
        if (!around) at = cut_at(*bounds[static_cast<std::size_t>(axis)], cell.lower[axis], cell.upper[axis]);
        if (at == cell.lower[axis]) at = cell.lower[axis] + side[axis] / 2;
      }
      SurfaceCell low = cell, high = cell;
      low.upper[axis] = at;
      high.lower[axis] = at;
      next.push_back(low);
      next.push_back(high);
    }
    std::swap(open, next);
  }
  return done;
}

Vec2 SurfaceVertices::canonical(Vec2 uv) const {
  const KnotVector &u = surface_.u, &v = surface_.v;
  if (joints_.closed_u && uv.x() == u.upper()) uv.x() = u.lower();
  if (joints_.closed_v && uv.y() == v.upper()) uv.y() = v.lower();
  if ((joints_.pole_v_lower && uv.y() == v.lower()) || (joints_.pole_v_upper && uv.y() == v.upper())) {
    uv.x() = u.lower();
  }
  if ((joints_.pole_u_lower && uv.x() == u.lower()) || (joints_.pole_u_upper && uv.x() == u.upper())) {
    uv.y() = v.lower();
  }
  return uv;
}

std::uint32_t SurfaceVertices::at(const Vec2& uv) {
  const Vec2 key = canonical(uv);
  const auto [found, fresh] =
      index_.try_emplace({key.x(), key.y()}, static_cast<std::uint32_t>(mesh_.positions.size()));
  if (fresh) {
    mesh_.positions.push_back(surface_.evaluate(key.x(), key.y()));
    mesh_.normals.push_back(surface_.normal(key.x(), key.y()));
    mesh_.opacity.push_back(1);
  }
  return found->second;
}

std::vector<Vec2> SurfaceVertices::parameters() const {
  std::vector<Vec2> all(mesh_.positions.size());
  for (const auto& [uv, vertex] : index_) all[vertex] = {uv.first, uv.second};
  return all;
}

void SurfaceVertices::triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  if (a == b || b == c || c == a) return;
  mesh_.indices.insert(mesh_.indices.end(), {a, b, c});
}

Status check_options(const SurfaceMeshOptions& options) {
  if (!(options.chord_tolerance_m >= least_tolerance_m && std::isfinite(options.chord_tolerance_m))) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {} m, expected at least {}", options.chord_tolerance_m, least_tolerance_m),
        "chord_tolerance_m");
  }
  if (!(options.largest_cell >= least_cell)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected at least {}", options.largest_cell, least_cell),
                      "largest_cell");
  }
  if (options.max_vertices < 4 || options.max_vertices > most_vertices) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 4..{}", options.max_vertices, most_vertices),
                      "max_vertices");
  }
  return {};
}

}  // namespace detail

namespace {

/// The corners of boxes on each line of constant u (or v), ascending: whoever has a side there uses them all.
using Lines = std::unordered_map<double, std::vector<double>>;

void sort_lines(Lines& lines) {
  for (auto& [line, places] : lines) {
    std::sort(places.begin(), places.end());
    places.erase(std::unique(places.begin(), places.end()), places.end());
  }
}

/// Those strictly between.
std::span<const double> between(const std::vector<double>& places, double low, double high) {
  const auto begin = std::upper_bound(places.begin(), places.end(), low);
  const auto end = std::lower_bound(begin, places.end(), high);
  return {begin, end};
}

}  // namespace

TrimLoop domain_loop(const BSplineSurface& surface) {
  const double u0 = surface.u.lower(), u1 = surface.u.upper(), v0 = surface.v.lower(), v1 = surface.v.upper();
  return {{u0, v0}, {u1, v0}, {u1, v1}, {u0, v1}};
}

Result<TriangleMesh> tessellate(const BSplineSurface& surface, const SurfaceMeshOptions& options) {
  if (const Status status = check(surface); !status.ok()) return status.error();
  if (const Status status = detail::check_options(options); !status.ok()) return status.error();
  const SpanBends bends(surface);
  const detail::SurfaceJoints joints(surface);
  const std::vector<detail::SurfaceCell> cells = detail::surface_cells(surface, bends, joints, options);
  Lines along_v, along_u;  // By u: the v of corners there; by v: their u.
  // Both sides of a seam are one line.
  const auto line_u = [&](double u) {
    return joints.closed_u && u == surface.u.upper() ? surface.u.lower() : u;
  };
  const auto line_v = [&](double v) {
    return joints.closed_v && v == surface.v.upper() ? surface.v.lower() : v;
  };
  for (const detail::SurfaceCell& cell : cells) {
    for (const double u : {cell.lower.x(), cell.upper.x()}) {
      for (const double v : {cell.lower.y(), cell.upper.y()}) {
        along_v[line_u(u)].push_back(v);
        along_u[line_v(v)].push_back(u);
      }
    }
  }
  sort_lines(along_v);
  sort_lines(along_u);
  detail::SurfaceVertices vertices(surface, joints);
  std::vector<std::uint32_t> rim;
  for (const detail::SurfaceCell& cell : cells) {
    const Vec2 &low = cell.lower, &high = cell.upper;
    rim.clear();
    const auto add = [&](double u, double v) { rim.push_back(vertices.at({u, v})); };
    const auto bottom = between(along_u[line_v(low.y())], low.x(), high.x());
    const auto top = between(along_u[line_v(high.y())], low.x(), high.x());
    const auto left = between(along_v[line_u(low.x())], low.y(), high.y());
    const auto right = between(along_v[line_u(high.x())], low.y(), high.y());
    add(low.x(), low.y());
    for (const double u : bottom) add(u, low.y());
    add(high.x(), low.y());
    for (const double v : right) add(high.x(), v);
    add(high.x(), high.y());
    for (auto u = top.rbegin(); u != top.rend(); ++u) add(*u, high.y());
    add(low.x(), high.y());
    for (auto v = left.rbegin(); v != left.rend(); ++v) add(low.x(), *v);
    if (rim.size() == 4) {
      const bool first = (vertices.place(rim[0]) - vertices.place(rim[2])).squaredNorm() <=
                         (vertices.place(rim[1]) - vertices.place(rim[3])).squaredNorm();
      if (first) {
        vertices.triangle(rim[0], rim[1], rim[2]);
        vertices.triangle(rim[0], rim[2], rim[3]);
      } else {
        vertices.triangle(rim[0], rim[1], rim[3]);
        vertices.triangle(rim[1], rim[2], rim[3]);
      }
      continue;
    }
    const std::uint32_t centre = vertices.at((low + high) / 2);
    for (std::size_t k = 0; k < rim.size(); ++k) {
      vertices.triangle(centre, rim[k], rim[(k + 1) % rim.size()]);
    }
  }
  return std::move(vertices).take();
}

}  // namespace handloft::geometry
